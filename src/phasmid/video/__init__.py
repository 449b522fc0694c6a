"""Recordings as videos, drawn by the engine's renderer."""

from phasmid.video.video import check_video, save_video

__all__ = ["check_video", "save_video"]
