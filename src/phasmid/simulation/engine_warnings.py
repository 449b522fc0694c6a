"""What the engine complains of, run by run, also where several run side by side."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

_LOCK = threading.Lock()
_COLLECTING: dict[int, list[str]] = {}
_BEFORE: list[Callable[[str], Any] | None] = []


class EngineWarnings:
    """Collect the engine's warnings in this thread, which it would else print and write to a file.

    The engine has one place for all threads to be told of them, and calls it in the thread that it
    steps in.

    Args:
        complaints: Takes them.
    """

    # A class, as a driven run enters it at each update, and a generator would take longer.
    __slots__ = ("_complaints", "_outer", "_own")

    def __init__(self, complaints: list[str]) -> None:
        self._complaints, self._own = complaints, threading.get_ident()

    def __enter__(self) -> None:
        with _LOCK:
            if not _COLLECTING:
                import mujoco

                _BEFORE.append(mujoco.get_mju_user_warning())
                mujoco.set_mju_user_warning(_collect)
            self._outer = _COLLECTING.get(self._own)
            _COLLECTING[self._own] = self._complaints

    def __exit__(self, *_: object) -> None:
        with _LOCK:
            if self._outer is None:
                del _COLLECTING[self._own]
            else:
                _COLLECTING[self._own] = self._outer
            if not _COLLECTING:
                import mujoco

                mujoco.set_mju_user_warning(_BEFORE.pop())


def _collect(message: str) -> None:
    complaints = _COLLECTING.get(threading.get_ident())
    if complaints is not None:
        complaints.append(message)
    elif _BEFORE and _BEFORE[0]:
        _BEFORE[0](message)
