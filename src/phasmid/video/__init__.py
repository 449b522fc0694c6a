"""Recordings as moving pictures, drawn by the engine's renderer.

What draws and writes is loaded when it is first used: to ask what a machine lacks needs none of it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from phasmid.video.probe import Lack, gl_backend, lack

if TYPE_CHECKING:
    from phasmid.video.video import check_video, save_video

__all__ = ["Lack", "check_video", "gl_backend", "lack", "save_video"]


def __getattr__(name: str) -> Any:
    if name in ("check_video", "save_video"):
        return getattr(import_module("phasmid.video.video"), name)
    raise AttributeError(f"module 'phasmid.video' has no attribute {name!r}")
