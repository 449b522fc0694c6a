"""The controller's machine code, made by another process.

A compiler keeps hundreds of megabytes of what it compiled and how; the live robot's process, which
may stay for days, only loads the code.
"""

from __future__ import annotations

import contextlib
import subprocess
import sys
import threading
import time

from phasmid.compiled import is_kept
from phasmid.control.compilation import FUNCTIONS, are_compiled
from phasmid.scenario import load_scenario
from phasmid.scenario.simulation import SimulationTable
from phasmid.studio.fields import field_of
from phasmid.studio.live import LiveRobot
from phasmid.studio.scene import Scene
from phasmid.studio.setting import Setting, setting_of
from phasmid.tables import choices as words_of

COMMAND = [sys.executable, "-P", "-m", "phasmid.studio.compiling"]
"""Without the present folder, in which a file may have a module's name."""

LENGTH = 2.0
"""For which a robot walks, so that all feet leave the ground and meet it again [s]."""

PATIENCE = 600.0
"""Longest time that is waited for the other process [s]."""


def compile_beside(closing: threading.Event) -> None:
    """Wait until another process has compiled what a live robot uses, where nobody has yet.

    Whatever goes wrong there, what is lacking is compiled when it is first used.

    Args:
        closing: Ends it before its time.
    """
    if are_compiled() or not is_kept(FUNCTIONS[0]) or not sys.executable:
        return
    with contextlib.suppress(OSError):
        silent = subprocess.DEVNULL
        process = subprocess.Popen(  # noqa: S603, the command is our own
            COMMAND, stdin=silent, stdout=silent, stderr=silent
        )
        end = time.monotonic() + PATIENCE
        try:
            while process.poll() is None and time.monotonic() < end and not closing.wait(0.1):
                pass
        finally:
            process.kill()
            process.wait()


def main() -> None:
    """Let a robot walk a little with each drive, and where neither ground nor servos suffice."""
    setting = setting_of(load_scenario("paper"))
    for drive in words_of(SimulationTable.model_fields["drive"]):
        setting = field_of("drive").write(setting, drive)
        _walk(setting)
    for name, value in (("friction", 0.1), ("payload", 1.0)):
        setting = field_of(name).write(setting, value)
    _walk(setting)


def _walk(setting: Setting) -> None:
    live = LiveRobot(setting)
    live.follow(setting, (0.5, 0.0, 0.2), frozenset())
    live.advance(round(LENGTH / live.period))
    Scene(live, 1).row(live, 1.0)


if __name__ == "__main__":
    main()
