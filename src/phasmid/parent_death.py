"""End of a child process with its parent, whatever ends the parent."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time

PR_SET_PDEATHSIG = 1
"""Option of Linux's ``prctl``: the signal that this process receives when its parent ends."""

POLL_INTERVAL = 0.5
"""Time between two looks at the parent where the system sends no such signal [s]."""


def end_with_parent(parent: int | None = None, *, ignores_interrupts: bool = False) -> None:
    """Kill this process once its parent has ended, also after ``kill -9`` of the parent.

    Linux kills it when the thread that started it ends, so that thread must last. Other systems
    take up to `POLL_INTERVAL`.

    Args:
        parent: Process id of the parent. None: the present parent; a parent that ended before this
            call is then not noticed.
        ignores_interrupts: Ignore Ctrl-C, which a terminal sends to the parent too.
    """
    if ignores_interrupts:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = os.getppid() if parent is None else parent
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != parent:
            # It ended before the call above.
            os._exit(1)
        return
    threading.Thread(target=_end_after, args=(parent,), daemon=True).start()


def _end_after(parent: int) -> None:
    """Wait for the end of the parent, then end this process."""
    if sys.platform == "win32":
        import _winapi

        with_wait = 0x100000  # the right SYNCHRONIZE
        try:
            handle = _winapi.OpenProcess(with_wait, False, parent)
            _winapi.WaitForSingleObject(handle, _winapi.INFINITE)
        except OSError:
            # It has ended already.
            pass
    else:
        while os.getppid() == parent:
            time.sleep(POLL_INTERVAL)
    os._exit(1)
