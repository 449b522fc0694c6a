"""Scripts: commands over time, or waypoints, from files and recordings."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import asdict, replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

from annotated_types import Ge, Gt, Le, Len
from pydantic import BeforeValidator, FailFast, PrivateAttr

from phasmid.errors import InvalidInput, located
from phasmid.experiment.command import Command, LegCommand, Posture
from phasmid.gait import Gait
from phasmid.tables import (
    Angle,
    AngularVelocity,
    Count,
    Length,
    Number,
    Table,
    Time,
    Velocity,
    dotted,
    in_file,
    validate,
)
from phasmid.toml import parse_toml, read_toml, toml_string

MOST_ENTRIES = 200_000
"""Largest number of commands of a script."""

LARGEST_TEXT = 50_000_000
"""Largest script in a recording [characters]."""

ROUND_OFF = 1e-9
"""Of times [s]."""


class GaitEntry(Table):
    """A gait that is not in the library; attributes as of `phasmid.Gait`."""

    name: str
    duty_factor: Number
    offsets: tuple[Number, ...]
    sway: Number = 0.0


class LegEntry(Table):
    """A manual leg: its number, and its foot [m] in the body frame or its joint angles [rad]."""

    number: Annotated[Count, Ge(1)]
    foot: tuple[Length, Length, Length] | None = None
    joints: tuple[Angle, Angle, Angle] | None = None


class CommandEntry(Table):
    """``[[command]]``: the command from a time on; absent keys keep their previous values.

    Attributes:
        time: Since the beginning of the drive [s].
        ahead: Forward velocity of the body over ground [m/s].
        left: Lateral velocity, to the left [m/s].
        turn: Yaw rate, to the left [rad/s].
        shift: Displacement of the body: forward, left, up [m].
        tilt: Roll, pitch and yaw of the body [rad].
        posture: ``packed``, ``standing`` or ``walking``.
        gait: Name of a gait, or a table of one.
        period: Duration of a cycle [s].
        step_height: Height to which a foot lifts [m].
        lost_legs: Numbers of legs that are not used.
        legs: Manual legs.
    """

    time: Annotated[Time, Ge(0), Le(1e6)] = 0.0
    ahead: Annotated[Velocity, Ge(-10), Le(10)] | None = None
    left: Annotated[Velocity, Ge(-10), Le(10)] | None = None
    turn: Annotated[AngularVelocity, Ge(-100), Le(100)] | None = None
    shift: tuple[Length, Length, Length] | None = None
    tilt: tuple[Angle, Angle, Angle] | None = None
    posture: Literal["packed", "standing", "walking"] | None = None
    gait: str | GaitEntry | None = None
    period: Annotated[Time, Gt(0), Le(1000)] | None = None
    step_height: Annotated[Length, Ge(0), Le(10)] | None = None
    lost_legs: tuple[Annotated[Count, Ge(1)], ...] | None = None
    legs: tuple[LegEntry, ...] | None = None

    def after(self, previous: Command) -> Command:
        """Return the command from this time on, after the previous one."""
        velocity = zip((self.ahead, self.left, self.turn), previous.velocity, strict=True)
        changes: dict[str, Any] = {
            "velocity": tuple(old if new is None else new for new, old in velocity),
            "pose": (self.shift or previous.pose[:3]) + (self.tilt or previous.pose[3:]),
            "gait": Gait(**dict(self.gait)) if isinstance(self.gait, GaitEntry) else self.gait,
            "period": self.period,
            "step_height": self.step_height,
            "posture": None if self.posture is None else Posture[self.posture.upper()],
            "lost_legs": None if self.lost_legs is None else frozenset(self.lost_legs),
            "legs": None
            if self.legs is None
            else {leg.number: LegCommand(leg.foot, leg.joints) for leg in self.legs},
        }
        changes = {name: value for name, value in changes.items() if value is not None}
        return replace(previous, **changes)


class WaypointEntry(Table):
    """``[[waypoint]]``: a place to walk to, in the frame of the robot at the beginning.

    Attributes:
        x: Forward [m].
        y: To the left [m].
        heading: Yaw to turn to at the place [rad]; absent: none.
    """

    x: Annotated[Length, Ge(-1e4), Le(1e4)]
    y: Annotated[Length, Ge(-1e4), Le(1e4)]
    heading: Annotated[Angle, Ge(-1e3), Le(1e3)] | None = None


class FollowTable(Table):
    """``[follow]``: how waypoints are followed.

    Attributes:
        speed: Walking speed [m/s].
        turn_speed: Largest yaw rate [rad/s].
        reached: Distance at which a waypoint is reached [m].
        aligned: Tolerance of its heading [rad].
    """

    speed: Annotated[Velocity, Gt(0), Le(10)] = 0.08
    turn_speed: Annotated[AngularVelocity, Gt(0), Le(100)] = 0.4
    reached: Annotated[Length, Gt(0), Le(10)] = 0.03
    aligned: Annotated[Angle, Gt(0), Le(math.pi)] = math.radians(5)


def _check_length(entries: Any) -> Any:
    """Refuse too many commands before each of them is validated."""
    if isinstance(entries, list | tuple) and len(entries) > MOST_ENTRIES:
        raise InvalidInput(f"the script has {len(entries)} commands; it may have {MOST_ENTRIES}.")
    return entries


class CommandScript(Table):
    """Commands over time, or waypoints.

    Attributes:
        format: Version of this table.
        between: ``steps``: a command holds until the next; ``linear``: velocity and pose are
            interpolated, everything else steps.
        duration: End of the drive [s]; absent: that of the scenario, or the last waypoint.
        command: Commands at increasing times; before the first one the robot stands.
        waypoint: Waypoints.
        follow: How they are followed.

    Raises:
        InvalidInput: There are no commands and no waypoints, or both; a value is out of range, or
            a time does not increase.
    """

    format: Annotated[Count, Ge(1), Le(1)] = 1
    between: Literal["steps", "linear"] = "steps"
    duration: Annotated[Time, Gt(0), Le(1e6)] | None = None
    command: Annotated[tuple[CommandEntry, ...], FailFast(), BeforeValidator(_check_length)] = ()
    waypoint: Annotated[tuple[WaypointEntry, ...], Len(0, 10_000), FailFast()] = ()
    follow: FollowTable = FollowTable()
    _commands: list[Command] = PrivateAttr(default_factory=list)

    def model_post_init(self, context: Any) -> None:
        """Validate what concerns several entries, and compute the whole command from each on."""
        super().model_post_init(context)
        if bool(self.command) == bool(self.waypoint):
            both = "both commands and waypoints" if self.command else "no command and no waypoint"
            raise InvalidInput(
                f"the script has {both}; it must have one of the two.",
                hint="[[command]] time_s = 0, ahead_mm_per_s = 50",
            )
        for number, (before, after) in enumerate(pairwise(self.command), 2):
            if after.time <= before.time:
                raise InvalidInput(
                    f"command {number}: time {after.time:g} s does not follow {before.time:g} s."
                )
        command = Command()
        for number, entry in enumerate(self.command, 1):
            with located(f"command {number}"):
                command = entry.after(command)
            self._commands.append(command)

    def check_legs(self, count: int) -> None:
        """Raise InvalidInput where a command names a lost leg beyond a robot's number of legs."""
        for number, entry in enumerate(self.command, 1):
            for leg in entry.lost_legs or ():
                if leg > count:
                    raise InvalidInput(
                        f"command {number}: lost_legs has {leg}; the robot has legs 1 to {count}."
                    )

    def at(self, time: float) -> Command | None:
        """Return the command at a time since the beginning [s]; None after the end."""
        if self.duration is not None and time > self.duration + ROUND_OFF:
            return None
        index = bisect_right(self.command, time + ROUND_OFF, key=lambda entry: entry.time) - 1
        if index < 0:
            return Command()
        now = self._commands[index]
        if self.between == "steps" or index + 1 == len(self._commands):
            return now
        following, begin = self._commands[index + 1], self.command[index].time
        s = (time - begin) / (self.command[index + 1].time - begin)
        velocity, pose = (
            tuple(a + s * (b - a) for a, b in zip(x, y, strict=True))
            for x, y in ((now.velocity, following.velocity), (now.pose, following.pose))
        )
        return replace(now, velocity=velocity, pose=pose)  # type: ignore[arg-type]

    def to_text(self) -> str:
        """Return the script as TOML in SI; `script_from_text` reads it back without loss."""
        fields = self.model_dump(exclude_none=True)
        return "".join(f"{key} = {_toml(value)}\n" for key, value in fields.items())


def commands_to_text(commands: Sequence[tuple[float, Command]], duration: float | None) -> str:
    """Return commands with their times as the text of a script; see `CommandScript.to_text`.

    Args:
        commands: Times [s] and commands.
        duration: End of the drive [s]; None where it has none.
    """
    end = "" if duration is None else f"duration = {float(duration)!r}\n"
    entries, before = [], _entry(Command())
    for time, command in commands:
        now = _entry(command)
        changes = {k: v for k, v in now.items() if v != before[k] and v is not None}
        entries.append(_toml({"time": float(time)} | changes))
        before = now
    rows = ",\n  ".join(entries)
    return f"format = 1\n{end}command = [\n  {rows}]\n"


def _entry(command: Command) -> dict[str, Any]:
    ahead, left, turn = map(float, command.velocity)
    pose = tuple(map(float, command.pose))
    gait = command.gait
    return {
        "ahead": ahead,
        "left": left,
        "turn": turn,
        "shift": pose[:3],
        "tilt": pose[3:],
        "posture": command.posture.name.lower(),
        "gait": asdict(gait) if isinstance(gait, Gait) else gait,
        "period": command.period,
        "step_height": command.step_height,
        "lost_legs": sorted(command.lost_legs),
        "legs": [
            {"number": number} | {k: v for k, v in asdict(leg).items() if v is not None}
            for number, leg in sorted(command.legs.items())
        ],
    }


def _toml(value: Any) -> str:
    """Return a value as TOML: tables inline, each table of a list on a line of its own."""
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{key} = {_toml(item)}' for key, item in value.items())} }}"
    if isinstance(value, list | tuple):
        start, comma = ("\n  ", ",\n  ") if value and isinstance(value[0], dict) else ("", ", ")
        return f"[{start}{comma.join(map(_toml, value))}]"
    return toml_string(value) if isinstance(value, str) else repr(value)


def load_script(source: str | Path) -> CommandScript:
    """Read a script of commands from a file.

    Args:
        source: A ``.toml`` file with ``[[command]]`` or ``[[waypoint]]`` entries.

    Raises:
        InvalidInput: The file cannot be read, or is no script.
    """
    path = Path(source)
    if path.suffix != ".toml":
        raise InvalidInput(
            f"{path} is no script of commands; it must be a .toml file.",
            hint="commands.toml",
        )
    raw, content = read_toml(path)
    with located(path.name):
        return validate(CommandScript, raw, in_file(path, content))


def script_from_text(text: str) -> CommandScript:
    """Return the script that `CommandScript.to_text` wrote.

    Raises:
        InvalidInput: The text is no script.
    """
    if len(text) > LARGEST_TEXT:
        raise InvalidInput(f"the script has {len(text)} characters; such are refused.")
    raw = parse_toml(text, "the script")
    return validate(CommandScript, raw, lambda loc: (dotted(loc), "the script"))
