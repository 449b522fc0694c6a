"""Recordings as moving pictures, drawn by the engine's renderer."""

from phasmid.video.probe import Lack, gl_backend, lack

__all__ = ["Lack", "gl_backend", "lack"]
