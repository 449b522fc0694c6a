"""Fields of the setting in the page: numbers with a range, choices and switches."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias, get_args

from phasmid.arguments import described
from phasmid.errors import InvalidInput, nearest
from phasmid.gait import gaits_of
from phasmid.robot import preset_names
from phasmid.scenario import Scenario
from phasmid.scenario.relevance import is_used
from phasmid.scenario.terrain import START, TerrainTable
from phasmid.servo import servo_names
from phasmid.studio.setting import (
    LOCOMOTION,
    MOST_PAYLOAD,
    Setting,
    Walks,
    policies,
)
from phasmid.tables import choices, field_help, quantity
from phasmid.units import UNITS

Value: TypeAlias = float | str | bool
"""Number in the field's unit, word or flag."""

Span: TypeAlias = tuple[float, float, float]
"""Least and largest value, and step of the slider, in the field's unit."""

OWN_SERVO = "the robot's own"
"""Choice of the servo that the robot's file names."""

DIGITS = 9
"""Digits after the point of a number on the page."""


@dataclass(frozen=True)
class Field:
    """One field of the setting: a number, a choice or a switch.

    Attributes:
        name: Name in messages.
        label: Name on the page.
        help: One sentence.
        read: Return its value, SI.
        write: Return the setting with another value, SI.
        unit: Unit on the page, a key of `UNITS`; empty for plain numbers and words.
        span: Range of a number, or a function of the setting that returns it.
        choices: Words of a choice, or a function of the setting that returns them.
        shown: Return True if the field has an effect in a setting.
    """

    name: str
    label: str
    help: str
    read: Callable[[Setting], Value]
    write: Callable[[Setting, Any], Setting]
    unit: str = ""
    span: Span | Callable[[Setting], Span] | None = None
    choices: Sequence[str] | Callable[[Setting], Sequence[str]] | None = None
    shown: Callable[[Setting], bool] = lambda _: True

    def value(self, setting: Setting) -> Value:
        """Return its value in the unit of the page."""
        value = self.read(setting)
        if self.span is None:
            return value
        number = float(value)
        return round(UNITS[self.unit].from_si(number) if self.unit else number, DIGITS)

    def as_dict(self, setting: Setting) -> dict[str, Any]:
        """Return its description for the page."""
        table: dict[str, Any] = {"name": self.name, "label": self.label}
        table |= {"help": self.help, "unit": UNITS[self.unit].symbol if self.unit else ""}
        if self.span is not None:
            (least, most, step), now = _of(self.span, setting), float(self.value(setting))
            bounds = {"least": min(least, now), "most": max(most, now), "step": step}
            return table | {"kind": "range"} | bounds
        if self.choices is not None:
            return table | {"kind": "choice", "choices": list(_of(self.choices, setting))}
        return table | {"kind": "switch"}

    def changed(self, setting: Setting, value: object) -> Setting:
        """Return the setting with another value of this field.

        Args:
            setting: Present setting.
            value: In the unit of the page.

        Raises:
            InvalidInput: It is no value of this field, or does not fit the rest.
        """
        what = f"{self.label.lower()} is {described(value)}"
        if self.span is not None:
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise InvalidInput(f"{what}; it must be a number.")
            # First the package's own refusal: it explains more than the ends of a slider.
            changed = self.write(setting, UNITS[self.unit].to_si(value) if self.unit else value)
            table = self.as_dict(setting)
            if not table["least"] <= value <= table["most"]:
                unit = f" {table['unit']}" if table["unit"] else ""
                raise InvalidInput(
                    f"{self.label.lower()} is {value:g}{unit}; it must be at least "
                    f"{table['least']:g} and at most {table['most']:g}{unit}."
                )
            return changed
        if self.choices is not None:
            known = _of(self.choices, setting)
            if value not in known:
                guess = nearest(str(value), known)
                raise InvalidInput(
                    f"{what}; it must be one of {', '.join(known)}.",
                    hint=f'"{guess}"' if guess else "",
                )
        elif not isinstance(value, bool):
            raise InvalidInput(f"{what}; it must be true or false.")
        # A gait of a file is no name that could be set again.
        return setting if value == self.read(setting) else self.write(setting, value)


def _of(value: Any, setting: Setting) -> Any:
    """Return a value, or what a function returns for a setting."""
    return value(setting) if callable(value) else value


# Kinds of fields ------------------------------------------------------------------------------


def _scenario(path: str, label: str, **parts: Any) -> Field:
    """Return a field of the scenario, with the unit, words and description of its table."""
    table, name = path.split(".")
    kind: Any = Scenario.model_fields[table].annotation
    field = kind.model_fields[name]
    carried = quantity(field)
    given: dict[str, Any] = {
        "name": name,
        "help": field_help(kind, name).partition(" [")[0].rstrip(".") + ".",
        "read": lambda setting: getattr(getattr(setting.scenario, table), name),
        "write": lambda setting, value: _with(setting, **{name: value}),
        "unit": carried.unit if carried else "",
        "choices": choices(field) or None,
    }
    return Field(label=label, **given | parts)


def _own(name: str, label: str, help: str, **parts: Any) -> Field:
    """Return a field that is an attribute of the setting."""
    return Field(
        name=name,
        label=label,
        help=help,
        read=lambda setting: getattr(setting, name),
        write=lambda setting, value: replace(setting, **{name: value}),
        **parts,
    )


def _pose(index: int, name: str, label: str, help: str, unit: str) -> Field:
    """Return a field of the pose of the body."""

    def write(setting: Setting, value: float) -> Setting:
        pose = [*setting.pose]
        pose[index] = value
        return replace(setting, pose=tuple(pose))  # type: ignore[arg-type]

    return Field(
        name=name,
        label=label,
        help=help,
        read=lambda setting: setting.pose[index],
        write=write,
        unit=unit,
        span=_of_height(-0.4, 0.4) if unit == "mm" else (-20, 20, 1),
        shown=_controlled,
    )


def _with(setting: Setting, **changes: Any) -> Setting:
    """Return the setting with changes of its scenario."""
    return replace(setting, scenario=setting.scenario.replace(**changes))


def _with_robot(setting: Setting, name: str) -> Setting:
    return setting.with_robot(name if name in preset_names() else setting.robots[name])


def _with_terrain(setting: Setting, name: str) -> Setting:
    if name in setting.grounds:
        return _with(setting, terrain="height-map", height_map=setting.grounds[name])
    if name == "slope" and setting.scenario.terrain.terrain_start is None:
        # The robot starts on level ground and walks onto the slope.
        return _with(setting, terrain=name, terrain_start=START)
    return _with(setting, terrain=name)


def _with_voltage(setting: Setting, voltage: float) -> Setting:
    rated = setting.robot.servo.rated_voltage
    return _with(setting, voltage=None if voltage == rated else voltage)


# Choices and ranges ---------------------------------------------------------------------------


def _terrains(setting: Setting) -> list[str]:
    kinds = [*choices(TerrainTable.model_fields["kind"])]
    kinds.remove("height-map")
    if not setting.scenario.terrain.edge_x:
        # Their edges come from a file.
        kinds.remove("steps")
    if setting.terrain_name == "height-map":
        kinds.append("height-map")
    return [*kinds, *setting.grounds]


def _contact_laws(setting: Setting) -> list[str]:
    # The simulator of the law "simscape" follows plans only.
    present = setting.scenario.contact.contact_law
    laws = choices(type(setting.scenario.contact).model_fields["contact_law"])
    return [law for law in laws if law != "simscape" or law == present]


def _of_height(least: float, most: float) -> Callable[[Setting], Span]:
    """Return the range in shares of the height of the hips, in whole millimetres."""
    return lambda setting: (
        math.floor(1000 * least * setting.height),
        math.ceil(1000 * most * setting.height),
        1.0,
    )


def _payloads(setting: Setting) -> Span:
    return 0.0, round(math.floor(MOST_PAYLOAD * setting.base.mass / 0.05) * 0.05, 2), 0.05


def _on(name: str) -> Callable[[Setting], bool]:
    """Return the test that a number has an effect on the present terrain."""
    return lambda setting: is_used(TerrainTable, name, setting.scenario.terrain.kind)


def _planned(setting: Setting) -> bool:
    return setting.walks == "the plan"


def _controlled(setting: Setting) -> bool:
    return not _planned(setting) and setting.controller == LOCOMOTION


def _by_gait(setting: Setting) -> bool:
    """Return True if the gait has an effect: a learned policy has its own."""
    return _planned(setting) or _controlled(setting)


POSES = (
    _pose(2, "body_height", "Height", "Up or down.", "mm"),
    _pose(0, "body_x", "Ahead", "Ahead or back of the feet.", "mm"),
    _pose(1, "body_y", "Left", "To the left or right.", "mm"),
    _pose(3, "roll", "Roll", "To the right or left.", "deg"),
    _pose(4, "pitch", "Pitch", "Nose down or up.", "deg"),
    _pose(5, "yaw", "Yaw", "Turned left or right.", "deg"),
)

SIZES = {
    "slope": ("Slope", (-45, 45, 1)),
    "rise": ("Step's rise", (0, 100, 1)),
    "gap_width": ("Gap", (5, 200, 5)),
    "block_height": ("Blocks", (0, 100, 1)),
    "stone_distance": ("Stones' distance", (105, 300, 5)),
    "beam_height": ("Beams", (0, 100, 1)),
    "course_level": ("Difficulty", (0, 1, 0.05)),
    "wave_height": ("Waves", (0, 100, 1)),
    "roughness": ("Roughness", (0, 30, 1)),
    "ice_friction": ("Friction of ice", (0, 1, 0.05)),
}
"""Label and range of the numbers of each terrain."""

GROUPS = {
    "Walk": (
        _own(
            "walks",
            "Walks",
            "By itself: ahead at half its largest speed; by hand: by stick and keys; the plan: the "
            "scenario's walk, planned beforehand.",
            choices=get_args(Walks),
        ),
        _own(
            "controller",
            "Controller",
            "The locomotion controller, or a policy that was learned for the phantomx-ax.",
            choices=lambda _: (LOCOMOTION, *policies()),
            shown=lambda setting: not _planned(setting) and bool(policies()),
        ),
        _scenario(
            "gait.name",
            "Gait",
            name="gait",
            help="Schedule of stance and swing of the legs.",
            write=lambda setting, name: _with(setting, gait=name),
            choices=lambda setting: [
                *dict.fromkeys((*gaits_of(len(setting.base.legs)), setting.gait.name))
            ],
            shown=_by_gait,
        ),
        _scenario(
            "stride.period",
            "Cycle time",
            span=(0.3, 6, 0.05),
            read=lambda setting: setting.experiment.course.stride.period,
            shown=_by_gait,
        ),
        _scenario("stride.step_height", "Step height", span=_of_height(0, 0.6), shown=_by_gait),
        _scenario(
            "stride.step_length",
            "Step length of the plan",
            span=_of_height(-1, 1),
            shown=_planned,
        ),
        _scenario("stride.stance_law", "Stance law of the plan", shown=_planned),
        _scenario("stride.stance_timing", "Timing of the plan", shown=_planned),
        _own(
            "ground_sensing",
            "Senses the ground",
            "On: the robot searches the ground with its feet. Off: it takes it for level.",
            shown=_controlled,
        ),
    ),
    "Body": POSES,
    "Machine": (
        Field(
            "robot",
            "Robot",
            "A robot that comes with phasmid, or one from a file.",
            read=lambda setting: setting.robot_name,
            write=_with_robot,
            choices=lambda setting: [*preset_names(), *setting.robots],
        ),
        _scenario(
            "simulation.drive",
            "Drive",
            help="Prescribed joints take whatever torque it needs; all others have limits.",
        ),
        _scenario(
            "servo.servo",
            "Servo",
            help="The motor of every joint.",
            read=lambda setting: setting.scenario.servo.servo or OWN_SERVO,
            write=lambda setting, name: _with(setting, servo=None if name == OWN_SERVO else name),
            choices=[OWN_SERVO, *servo_names()],
        ),
        _scenario(
            "servo.voltage",
            "Supply",
            help="Voltage of the servos' supply; the servo's rated voltage until it is set.",
            read=lambda setting: setting.robot.servo.voltage,
            write=_with_voltage,
            span=(6, 16, 0.1),
        ),
        _scenario(
            "model.payload",
            "Payload",
            unit="kg",
            help="A load in the middle of the trunk's upper side, counted by the robot too.",
            span=_payloads,
        ),
    ),
    "World": (
        _scenario(
            "terrain.kind",
            "Terrain",
            name="terrain",
            help="The ground, which begins ahead of where the robot starts.",
            read=lambda setting: setting.terrain_name,
            write=_with_terrain,
            choices=_terrains,
        ),
        *(
            _scenario(f"terrain.{name}", label, span=span, shown=_on(name))
            for name, (label, span) in SIZES.items()
        ),
        _scenario("terrain.friction", "Friction", span=(0, 2, 0.05)),
        _scenario("contact.contact_law", "Contact law", choices=_contact_laws),
    ),
    "Forces": (_scenario("model.force_model", "Force distribution"),),
}
"""Fields by their groups on the page."""

FIELDS = tuple(field for group in GROUPS.values() for field in group)

BY_NAME = {field.name: field for field in FIELDS}


def field_of(name: str) -> Field:
    """Return a field by its name.

    Raises:
        InvalidInput: There is none.
    """
    if name not in BY_NAME:
        guess = nearest(name, BY_NAME)
        raise InvalidInput(
            f"the setting has no field {described(name)}.", hint=f'"{guess}"' if guess else ""
        )
    return BY_NAME[name]


def values(setting: Setting) -> dict[str, Value]:
    """Return all values in the units of the page."""
    return {field.name: field.value(setting) for field in FIELDS}


def catalogue(setting: Setting) -> dict[str, Any]:
    """Return the fields in use by their groups, for the page."""
    return {
        name: [field.as_dict(setting) for field in fields if field.shown(setting)]
        for name, fields in GROUPS.items()
    }
