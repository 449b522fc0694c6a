"""Memory of robots that are gone."""

from __future__ import annotations

import contextlib
import ctypes
import gc
import sys


def clear_away() -> None:
    """Return the memory of a robot that is gone to the system, so that a long stay needs no more.

    The C library of Linux would keep what lies between other things.
    """
    gc.collect()
    if sys.platform == "linux":
        # Another C library than GNU's lacks it.
        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None).malloc_trim(ctypes.c_size_t(0))
