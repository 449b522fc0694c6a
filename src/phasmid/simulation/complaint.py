"""What the engine complains of, run by run, also where several run side by side."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

_LOCK = threading.Lock()
_COLLECTING: dict[int, list[str]] = {}
_BEFORE: list[Callable[[str], Any] | None] = []


@contextmanager
def collected_complaints(complaints: list[str]) -> Iterator[None]:
    """Collect the engine's warnings in this thread, which it would else print and write to a file.

    The engine has one place for all threads to be told of them, and calls it in the thread that it
    steps in.

    Args:
        complaints: Takes them.
    """
    import mujoco

    own = threading.get_ident()
    with _LOCK:
        if not _COLLECTING:
            _BEFORE.append(mujoco.get_mju_user_warning())
            mujoco.set_mju_user_warning(_collect)
        outer = _COLLECTING.get(own)
        _COLLECTING[own] = complaints
    try:
        yield
    finally:
        with _LOCK:
            if outer is None:
                del _COLLECTING[own]
            else:
                _COLLECTING[own] = outer
            if not _COLLECTING:
                mujoco.set_mju_user_warning(_BEFORE.pop())


def _collect(message: str) -> None:
    complaints = _COLLECTING.get(threading.get_ident())
    if complaints is not None:
        complaints.append(message)
    elif _BEFORE and _BEFORE[0]:
        _BEFORE[0](message)
