"""Recordings as moving pictures, drawn by the engine's renderer."""

from phasmid.video.probe import Lack, gl_backend, lack
from phasmid.video.video import check_video, save_video

__all__ = ["Lack", "check_video", "gl_backend", "lack", "save_video"]
