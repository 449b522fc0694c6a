"""What a browser may ask of the live robot: the seam between server and stage."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias


@dataclass(frozen=True, slots=True)
class Stick:
    """Where to go, as shares of what is possible; it is to be told again within half a second.

    Attributes:
        at: Ahead, to the left, turn to the left, each within -1 and 1.
    """

    at: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Change:
    """Give a field of the setting another value.

    Attributes:
        name: One of the catalogue's.
        value: A number, a text or a truth value, as its kind is.
    """

    name: str
    value: float | str | bool


@dataclass(frozen=True, slots=True)
class Play:
    """Let time pass.

    Attributes:
        how: ``step`` makes one update and pauses; ``reset`` puts the robot back to its start.
    """

    how: Literal["play", "pause", "step", "reset"]


@dataclass(frozen=True, slots=True)
class Pace:
    """How much faster than real time it goes; 1 is real time."""

    factor: float


@dataclass(frozen=True, slots=True)
class Push:
    """Push the trunk once.

    Attributes:
        impulse: In the body's axes, ahead, left and up [N·s].
    """

    impulse: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Limb:
    """Lose a leg, have it back, or let one of its servos die.

    Attributes:
        leg: Its number, from 1.
        how: ``lose`` takes it out of the gait and lifts it; ``limp`` kills all its servos, for as
            long as the run lasts.
    """

    leg: int
    how: Literal["lose", "restore", "limp"]


@dataclass(frozen=True, slots=True)
class Record:
    """Begin to record, or end it and write the run's folder with its report."""

    on: bool


@dataclass(frozen=True, slots=True)
class Keep:
    """Ask for the present setting as a file's text, or as the part of an address that tells it."""

    what: Literal["scenario", "link"]


@dataclass(frozen=True, slots=True)
class Load:
    """Take up a setting, or a file.

    Attributes:
        what: ``setting`` is the text that a link carries; the others are files.
        name: The file's own name, which tells its format.
        content: The file's bytes, or the text in UTF-8.
    """

    what: Literal["setting", "scenario", "robot", "terrain"]
    name: str
    content: bytes = field(repr=False)


@dataclass(frozen=True, slots=True)
class Bench:
    """One leg by itself: the paper's equations at one pose.

    Attributes:
        leg: Its number, from 1.
        angles: Joint angles [rad]; or
        foot: the foot in the hip frame [m].
        force: Of the ground on the foot, in the hip frame [N].
    """

    leg: int
    angles: tuple[float, float, float] | None = None
    foot: tuple[float, float, float] | None = None
    force: tuple[float, float, float] = (0.0, 0.0, 0.0)


Request: TypeAlias = Stick | Change | Play | Pace | Push | Limb | Record | Keep | Load | Bench

Answer: TypeAlias = dict[str, Any]
"""What is replied, as JSON holds it; empty where there is nothing to say but yes."""
