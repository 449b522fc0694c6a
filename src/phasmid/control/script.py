"""Commands over time, or places to go to one after the other, as a file or a recording has them."""

from __future__ import annotations

import csv
import io
import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

from annotated_types import Ge, Gt, Le, Len
from pydantic import FailFast

from phasmid.arguments import check_type, path_of
from phasmid.control.command import Command, LegCommand, Posture
from phasmid.errors import InvalidInput, located
from phasmid.gait import Gait
from phasmid.tables import (
    Angle,
    AngularVelocity,
    Count,
    Length,
    Locator,
    Number,
    Table,
    Time,
    Velocity,
    dotted,
    in_file,
    speaking,
    validate,
)
from phasmid.toml import parse_toml, read_toml, toml_string

MOST_ENTRIES = 200_000
"""Most commands of a script."""

LARGEST_TEXT = 50_000_000
"""Most bytes of a script in a recording, and of a table of commands."""

POSTURES = {"packed": Posture.PACKED, "standing": Posture.STANDING, "walking": Posture.WALKING}


class GaitEntry(Table):
    """A gait of one's own; attributes as of `phasmid.Gait`."""

    name: str
    duty_factor: Number
    offsets: tuple[Number, ...]
    sway: Number = 0.0


class LegEntry(Table):
    """A leg that is moved by hand: its number, and its foot [m] in the body frame or its joints."""

    number: Annotated[Count, Ge(1)]
    foot: tuple[Length, Length, Length] | None = None
    joints: tuple[Angle, Angle, Angle] | None = None


class CommandEntry(Table):
    """``[[command]]``: what is commanded from a time on; what is absent stays as it was.

    Attributes:
        time: From the beginning of the drive [s].
        ahead: Velocity of the body over ground, ahead [m/s].
        left: To the left [m/s].
        turn: Turn to the left [rad/s].
        shift: Pose of the body beside where it stands or walks: ahead, to the left, up [m].
        tilt: Its roll, pitch and yaw [rad].
        posture: ``packed``, ``standing`` or ``walking``.
        gait: Name of a gait, or a table of one.
        period: Time of a cycle [s].
        step_height: Height to which a foot lifts [m].
        lost_legs: Numbers of legs that are not used.
        legs: Legs that are moved by hand.
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

    def after(self, before: Command) -> Command:
        """The command from this time on, of the one before."""
        v, pose = list(before.velocity), list(before.pose)
        for i, value in enumerate((self.ahead, self.left, self.turn)):
            v[i] = v[i] if value is None else value
        pose[:3] = pose[:3] if self.shift is None else self.shift
        pose[3:] = pose[3:] if self.tilt is None else self.tilt
        changes: dict[str, Any] = {"velocity": tuple(v), "pose": tuple(pose)}
        if self.posture is not None:
            changes["posture"] = POSTURES[self.posture]
        if self.gait is not None:
            own = isinstance(self.gait, GaitEntry)
            changes["gait"] = Gait(**dict(self.gait)) if own else self.gait  # type: ignore[arg-type]
        for name in ("period", "step_height"):
            if getattr(self, name) is not None:
                changes[name] = getattr(self, name)
        if self.lost_legs is not None:
            changes["lost_legs"] = frozenset(self.lost_legs)
        if self.legs is not None:
            changes["legs"] = {leg.number: LegCommand(leg.foot, leg.joints) for leg in self.legs}
        return replace(before, **changes)


class WaypointEntry(Table):
    """``[[waypoint]]``: a place to go to.

    Attributes:
        x: Ahead of where the drive begins [m].
        y: To the left of it [m].
        heading: To which the robot turns there [rad]; absent: as it comes.
    """

    x: Annotated[Length, Ge(-1e4), Le(1e4)]
    y: Annotated[Length, Ge(-1e4), Le(1e4)]
    heading: Annotated[Angle, Ge(-1e3), Le(1e3)] | None = None


class FollowTable(Table):
    """``[follow]``: how places are gone to.

    Attributes:
        speed: Ahead [m/s].
        turn_speed: Fastest turn [rad/s].
        reached: Distance at which a place is reached [m].
        aligned: Error of the heading that is let be [rad].
    """

    speed: Annotated[Velocity, Gt(0), Le(10)] = 0.08
    turn_speed: Annotated[AngularVelocity, Gt(0), Le(100)] = 0.4
    reached: Annotated[Length, Gt(0), Le(10)] = 0.03
    aligned: Annotated[Angle, Gt(0), Le(math.pi)] = math.radians(5)


class CommandScript(Table):
    """Commands over time, or places to go to.

    Attributes:
        format: Version of this table.
        between: ``steps``: a command stands until the next; ``linear``: velocity and pose go
            evenly from one to the next, and all else steps.
        duration: Time at which the drive ends [s]; absent: nothing ends it but the scenario, or
            the last place.
        command: The commands, with increasing times; before the first the robot stands.
        waypoint: The places.
        follow: How they are gone to.

    Raises:
        InvalidInput: It has neither or both, or too many, a value is refused, or a time does not
            increase.
    """

    def __init__(self, **fields: Any) -> None:
        with speaking(CommandScript, fields):
            super().__init__(**fields)

    format: Annotated[Count, Ge(1), Le(1)] = 1
    between: Literal["steps", "linear"] = "steps"
    duration: Annotated[Time, Gt(0), Le(1e6)] | None = None
    command: Annotated[tuple[CommandEntry, ...], Len(0, MOST_ENTRIES), FailFast()] = ()
    waypoint: Annotated[tuple[WaypointEntry, ...], Len(0, 10_000), FailFast()] = ()
    follow: FollowTable = FollowTable()

    def model_post_init(self, context: Any) -> None:
        """Refuse what is no script."""
        del context
        if bool(self.command) == bool(self.waypoint):
            both = "both commands and waypoints" if self.command else "no command and no waypoint"
            raise InvalidInput(
                f"the script has {both}; it must have one of the two.",
                hint="[[command]] time_s = 0, ahead_mm_per_s = 50",
            )
        times = [entry.time for entry in self.command]
        for number, (before, after) in enumerate(pairwise(times), 2):
            if after <= before:
                raise InvalidInput(
                    f"command {number}: time {after:g} s does not follow {before:g} s."
                )
        for number, entry in enumerate(self.command, 1):
            with located(f"command {number}"):
                entry.after(Command())

    @cached_property
    def _commands(self) -> tuple[list[float], list[Command]]:
        """Times, and the whole command from each on."""
        now, commands = Command(), []
        for entry in self.command:
            now = entry.after(now)
            commands.append(now)
        return [entry.time for entry in self.command], commands

    def at(self, time: float) -> Command | None:
        """What is commanded at a time; None after the end.

        Args:
            time: From the beginning [s].
        """
        if self.duration is not None and time > self.duration + 1e-9:
            return None
        times, commands = self._commands
        # A step that is due now has come, whatever the last digit of either time says.
        index = bisect_right(times, time + 1e-9) - 1
        if index < 0:
            return Command()
        now = commands[index]
        if self.between == "steps" or index + 1 == len(times):
            return now
        following = commands[index + 1]
        s = (time - times[index]) / (times[index + 1] - times[index])
        velocity, pose = (
            tuple(a + s * (b - a) for a, b in zip(x, y, strict=True))
            for x, y in ((now.velocity, following.velocity), (now.pose, following.pose))
        )
        return replace(now, velocity=velocity, pose=pose)  # type: ignore[arg-type]

    @classmethod
    def of(
        cls, commands: Sequence[tuple[float, Command]], duration: float | None = None
    ) -> CommandScript:
        """The script of commands that were given one by one.

        Args:
            commands: Each with its time [s].
            duration: When the drive ended [s].
        """
        entries = [_entry(time, command) for time, command in commands]
        return cls(command=tuple(entries), duration=duration)

    def to_text(self) -> str:
        """The script as TOML in SI, which `script_from_text` reads back to the bit."""
        lines = ["format = 1", f'between = "{self.between}"']
        if self.duration is not None:
            lines.append(f"duration = {self.duration!r}")
        for name, entries in (("command", self.command), ("waypoint", self.waypoint)):
            if entries:
                rows = (f"  {_toml(entry.model_dump(exclude_none=True))}," for entry in entries)
                lines.append(f"{name} = [\n" + "\n".join(rows) + "\n]")
        if self.waypoint:
            lines += ["[follow]", *(f"{name} = {value!r}" for name, value in self.follow)]
        return "\n".join(lines) + "\n"


def _entry(time: float, command: Command) -> CommandEntry:
    ahead, left, turn = command.velocity
    gait = command.gait
    if isinstance(gait, Gait):
        gait = GaitEntry(  # type: ignore[assignment]
            name=gait.name,
            duty_factor=gait.duty_factor,
            offsets=tuple(float(x) for x in gait.offsets),
            sway=gait.sway,
        )
    return CommandEntry(
        time=time,
        ahead=ahead,
        left=left,
        turn=turn,
        shift=command.pose[:3],
        tilt=command.pose[3:],
        posture={posture: name for name, posture in POSTURES.items()}[command.posture],  # type: ignore[arg-type]
        gait=gait,  # type: ignore[arg-type]
        period=command.period,
        step_height=command.step_height,
        lost_legs=tuple(sorted(command.lost_legs)),
        legs=tuple(
            LegEntry(number=number, foot=leg.foot, joints=leg.joints)
            for number, leg in sorted(command.legs.items())
        ),
    )


def _toml(value: Any) -> str:
    """A value as TOML writes it on one line."""
    if isinstance(value, dict):
        inner = ", ".join(f"{k} = {_toml(v)}" for k, v in value.items() if v is not None)
        return f"{{ {inner} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    return toml_string(value) if isinstance(value, str) else repr(value)


def load_script(source: str | Path) -> CommandScript:
    """Read a script of commands.

    Args:
        source: A ``.toml`` file with ``[[command]]`` or ``[[waypoint]]`` entries, or a ``.csv``
            file with a column for each key, such as ``time_s,ahead_mm_per_s,turn_deg_per_s``,
            whose empty cells leave a thing as it was.

    Raises:
        InvalidInput: The file cannot be read, or is no script.
    """
    path = path_of("script", source)
    if path.suffix == ".csv":
        return _read_csv(path)
    if path.suffix != ".toml":
        raise InvalidInput(
            f"{path} is no script of commands; it must be a .toml or .csv file.",
            hint="commands.toml",
        )
    raw, content = read_toml(path)
    with located(path.name):
        return validate(CommandScript, raw, in_file(path, content))


def script_from_text(text: str) -> CommandScript:
    """The script that `CommandScript.to_text` wrote.

    Raises:
        InvalidInput: It is none.
    """
    check_type("script", text, (str,), "text")
    if len(text) > LARGEST_TEXT:
        raise InvalidInput(f"the script has {len(text)} characters; such are refused.")
    raw = parse_toml(text, "the script")
    return validate(CommandScript, raw, lambda loc: (dotted(loc), "the script"))


def _read_csv(path: Path) -> CommandScript:
    """The script of a table, one row for each command."""
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_TEXT + 1)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InvalidInput(f"cannot read {path}: {reason}.") from None
    if len(content) > LARGEST_TEXT:
        raise InvalidInput(f"{path} holds more than {LARGEST_TEXT} bytes; such files are refused.")
    try:
        rows = csv.reader(io.StringIO(content.decode("utf-8-sig"), newline=""))
        table = [(rows.line_num, [cell.strip() for cell in row]) for row in rows if any(row)]
    except (UnicodeDecodeError, csv.Error) as error:
        raise InvalidInput(f"{path} is no table in UTF-8: {error}.") from None
    if not table:
        raise InvalidInput(f"{path} is empty.", hint="time_s,ahead_mm_per_s")
    (_, head), *body = table
    if len(body) > MOST_ENTRIES:
        raise InvalidInput(f"{path} has {len(body)} rows; it may have {MOST_ENTRIES}.")
    entries = []
    for line, row in body:
        if len(row) != len(head):
            raise InvalidInput(
                f"{path.name} line {line}: {len(row)} cells for {len(head)} columns."
            )
        raw = {key: _cell(text) for key, text in zip(head, row, strict=True) if text}
        entries.append(validate(CommandEntry, raw, _on_line(path, line)))
    with located(path.name):
        return CommandScript(command=tuple(entries))


def _on_line(path: Path, line: int) -> Locator:
    return lambda loc: (dotted(loc), f"{path.name}, line {line}")


def _cell(text: str) -> Any:
    """A cell as a number, where it is one."""
    try:
        return float(text)
    except ValueError:
        return text
