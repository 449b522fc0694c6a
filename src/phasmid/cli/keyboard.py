"""Commands from the keys of a terminal, in real time."""

from __future__ import annotations

import importlib
import os
import sys
import time
from types import TracebackType
from typing import Any

from phasmid.control import Command, Observation
from phasmid.errors import InvalidInput

STEPS = {
    "w": (0.01, 0.0, 0.0),
    "s": (-0.01, 0.0, 0.0),
    "a": (0.0, 0.01, 0.0),
    "d": (0.0, -0.01, 0.0),
    "q": (0.0, 0.0, 0.1),
    "e": (0.0, 0.0, -0.1),
}
"""By how much a key changes the velocity [m/s, m/s, rad/s]."""

MOST = (0.5, 0.5, 2.0)
"""Largest velocity that keys ask for; what the robot can is less."""

SHOWN = 0.2
"""Time between two lines on the state [s]."""

WORDS = "w s ahead, back · a d left, right · q e turn · space stop · 1-4 gait · x end"


def check_terminal() -> None:
    """Refuse to read keys where there are none.

    Raises:
        InvalidInput: Standard input is no terminal.
    """
    if not sys.stdin.isatty():
        raise InvalidInput(
            "--keys reads the keys of a terminal; standard input is none.", hint="--commands FILE"
        )


class Keyboard:
    """Asks the keys, and lets simulated time pass no faster than real time.

    Args:
        legs: Number of the robot's legs, whose gaits the digits choose.

    Raises:
        InvalidInput: Standard input is no terminal.
    """

    def __init__(self, legs: int) -> None:
        from phasmid.gait import GAITS

        check_terminal()
        self._gaits = list(GAITS.get(legs, {}))[:4]
        self._command = Command()
        self._began: float | None = None
        self._shown = -1.0
        self._before: Any = None

    def __enter__(self) -> Keyboard:
        if os.name != "nt":
            termios, tty = (importlib.import_module(name) for name in ("termios", "tty"))
            self._before = termios.tcgetattr(sys.stdin)
            # Each key at once, and Ctrl-C still stops.
            tty.setcbreak(sys.stdin)
        print(WORDS, file=sys.stderr)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._before is not None:
            termios = importlib.import_module("termios")
            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self._before)
        print(file=sys.stderr)

    def __call__(self, now: float, observation: Observation) -> Command | None:
        """What the keys command by a time of the run; None once they have ended it.

        Args:
            now: [s].
            observation: Is not looked at.
        """
        del observation
        clock = time.monotonic()
        if self._began is None:
            self._began = clock - now
        late = clock - self._began - now
        if late < 0:
            time.sleep(-late)
        for key in self._keys():
            if key == "x":
                return None
            self._press(key)
        if now - self._shown >= SHOWN:
            self._shown = now
            self._show(now, late)
        return self._command

    def _press(self, key: str) -> None:
        """Change the command as a key says; others do nothing."""
        velocity, gait = self._command.velocity, self._command.gait
        if key == " ":
            velocity = (0.0, 0.0, 0.0)
        elif key in STEPS:
            velocity = tuple(  # type: ignore[assignment]
                min(max(round(v + step, 3), -most), most)
                for v, step, most in zip(velocity, STEPS[key], MOST, strict=True)
            )
        elif key.isdecimal() and 1 <= int(key) <= len(self._gaits):
            gait = self._gaits[int(key) - 1]
        else:
            return
        self._command = Command(velocity=velocity, gait=gait)

    def _keys(self) -> str:
        """Those that were pressed since the last look."""
        if os.name == "nt":
            console = importlib.import_module("msvcrt")
            pressed = []
            while console.kbhit():
                pressed.append(console.getwch())
            return "".join(pressed).lower()
        select = importlib.import_module("select")
        if not select.select([sys.stdin], [], [], 0)[0]:
            return ""
        return os.read(sys.stdin.fileno(), 1024).decode(errors="replace").lower()

    def _show(self, now: float, late: float) -> None:
        ahead, left, turn = self._command.velocity
        gait = self._command.gait or ""
        slow = f"  {late:.1f} s behind" if late > 0.5 else ""
        line = f"{now:7.1f} s  {ahead:+.2f} {left:+.2f} m/s  {turn:+.1f} rad/s  {gait}{slow}"
        print(f"\r{line:<70}", end="", file=sys.stderr, flush=True)
