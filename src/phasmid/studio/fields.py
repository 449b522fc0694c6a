"""Fields of the setting in the page."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeAlias, get_args

from phasmid.arguments import described
from phasmid.errors import InvalidInput, nearest
from phasmid.gait import gaits_of
from phasmid.robot import preset_names, servo_names
from phasmid.scenario.contact import ContactTable
from phasmid.scenario.model import ModelTable
from phasmid.scenario.relevance import is_used
from phasmid.scenario.simulation import SimulationTable
from phasmid.scenario.stride import StrideTable
from phasmid.scenario.terrain import START, TerrainTable
from phasmid.studio.setting import (
    LOCOMOTION,
    MOST_PAYLOAD,
    OWN_SERVO,
    Setting,
    Walks,
    policies,
)
from phasmid.tables import Table, choices
from phasmid.units import UNITS

Value: TypeAlias = float | str | bool
"""Number in the field's unit, word or flag."""

Span: TypeAlias = tuple[float, float, float]
"""Least and largest value, and step of the slider, SI."""

DIGITS = 9
"""Digits after the point of a number on the page."""


@dataclass(frozen=True)
class Field:
    """One field of the setting: a range, a choice or a switch.

    Attributes:
        name: Name in messages.
        label: Name on the page.
        group: Name of its group.
        help: One sentence.
        read: Return its value, SI.
        write: Return the setting with another value, SI.
        unit: Unit on the page, a key of `UNITS`; empty for plain numbers and words.
        span: Return the range of a number.
        choices: Return the words of a choice and their labels.
        shown: Return True if the field has an effect in a setting.
    """

    name: str
    label: str
    group: str
    help: str
    read: Callable[[Setting], Value]
    write: Callable[[Setting, Any], Setting]
    unit: str = ""
    span: Callable[[Setting], Span] | None = None
    choices: Callable[[Setting], dict[str, str]] | None = None
    shown: Callable[[Setting], bool] = lambda _: True

    def _to_unit(self, value: float) -> float:
        return round(UNITS[self.unit].from_si(value) if self.unit else value, DIGITS)

    def value(self, setting: Setting) -> Value:
        """Return its value in the unit of the page."""
        value = self.read(setting)
        return value if self.span is None else self._to_unit(float(value))

    def as_dict(self, setting: Setting) -> dict[str, Any]:
        """Return its description for the page."""
        table: dict[str, Any] = {"name": self.name, "label": self.label, "group": self.group}
        table |= {"help": self.help, "unit": UNITS[self.unit].symbol if self.unit else ""}
        if self.span is not None:
            least, most, step = map(self._to_unit, self.span(setting))
            now = float(self.value(setting))
            bounds = {"least": min(least, now), "most": max(most, now), "step": step}
            return table | {"kind": "range"} | bounds
        if self.choices is not None:
            words = [{"value": v, "label": text} for v, text in self.choices(setting).items()]
            return table | {"kind": "choice", "choices": words}
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
            number = UNITS[self.unit].to_si(value) if self.unit else float(value)
            # First the package's own refusal: it explains more than the ends of a slider.
            changed = self.write(setting, number)
            table = self.as_dict(setting)
            if not table["least"] <= value <= table["most"]:
                unit = f" {table['unit']}" if table["unit"] else ""
                raise InvalidInput(
                    f"{self.label.lower()} is {value:g}{unit}; it must be at least "
                    f"{table['least']:g} and at most {table['most']:g}{unit}."
                )
            return changed
        if self.choices is not None:
            known = self.choices(setting)
            if not isinstance(value, str) or value not in known:
                guess = nearest(str(value), known)
                raise InvalidInput(
                    f"{what}; it must be one of {', '.join(known)}.",
                    hint=f'"{guess}"' if guess else "",
                )
        elif not isinstance(value, bool):
            raise InvalidInput(f"{what}; it must be true or false.")
        return self.write(setting, value)


# Reading and writing --------------------------------------------------------------------------


def _scenario(table: str, name: str) -> dict[str, Any]:
    """Name, read and write of a field of the scenario."""
    return {
        "name": name,
        "read": lambda setting: getattr(getattr(setting.scenario, table), name),
        "write": lambda setting, value: replace(
            setting, scenario=setting.scenario.replace(**{name: value})
        ),
    }


def _own(name: str) -> dict[str, Any]:
    """Name, read and write of an attribute of the setting."""
    return {
        "name": name,
        "read": lambda setting: getattr(setting, name),
        "write": lambda setting, value: replace(setting, **{name: value}),
    }


def _pose(index: int) -> dict[str, Any]:
    """Read and write of a coordinate of the body's pose."""

    def write(setting: Setting, value: float) -> Setting:
        pose = [*setting.pose]
        pose[index] = value
        return replace(setting, pose=tuple(pose))  # type: ignore[arg-type]

    return {"read": lambda setting: setting.pose[index], "write": write}


def _with_gait(setting: Setting, name: str) -> Setting:
    if name == setting.scenario.gait.name:
        return setting
    return replace(setting, scenario=setting.scenario.replace(gait=name))


def _with_robot(setting: Setting, name: str) -> Setting:
    return setting.with_robot(name if name in preset_names() else setting.robots[name])


def _with_terrain(setting: Setting, name: str) -> Setting:
    changes: dict[str, Any] = {"terrain": name}
    if name == "slope" and setting.scenario.terrain.terrain_start is None:
        # The robot starts on level ground and walks onto the slope.
        changes["terrain_start"] = START
    elif name in setting.grounds:
        changes = {"terrain": "height-map", "height_map": setting.grounds[name]}
    return replace(setting, scenario=setting.scenario.replace(**changes))


def _with_voltage(setting: Setting, voltage: float) -> Setting:
    rated = setting.robot.servo.rated_voltage
    chosen = None if voltage == rated else voltage
    return replace(setting, scenario=setting.scenario.replace(voltage=chosen))


# Choices and ranges ---------------------------------------------------------------------------


def _words(table: type[Table], name: str) -> Callable[[Setting], dict[str, str]]:
    """Words of a field of the scenario."""
    known = {word: word.replace("-", " ") for word in choices(table.model_fields[name])}
    return lambda _: dict(known)


def _gaits(setting: Setting) -> dict[str, str]:
    names = (*gaits_of(len(setting.base.legs)), setting.scenario.gait.name)
    return {name: name for name in names}


def _terrains(setting: Setting) -> dict[str, str]:
    kinds = [kind for kind in choices(TerrainTable.model_fields["kind"]) if kind != "height-map"]
    if not setting.scenario.terrain.edge_x:
        # Their edges come from a file.
        kinds.remove("steps")
    if setting.terrain_name == "height-map":
        kinds.append("height-map")
    return {name: name for name in (*kinds, *setting.grounds)}


def _contact_laws(setting: Setting) -> dict[str, str]:
    known = _words(ContactTable, "contact_law")(setting)
    if setting.scenario.contact.contact_law != "simscape":
        # Its simulator follows plans only.
        del known["simscape"]
    return known


def _of_height(least: float, most: float, step: float) -> Callable[[Setting], Span]:
    """Range in shares of the height of the hips, of whole steps."""
    return lambda setting: (
        math.floor(least * setting.height / step) * step,
        math.ceil(most * setting.height / step) * step,
        step,
    )


def _fixed(*span: float) -> Callable[[Setting], Span]:
    least, most, step = span
    return lambda _: (least, most, step)


def _payloads(setting: Setting) -> Span:
    return 0.0, math.floor(MOST_PAYLOAD * setting.base.mass / 0.05) * 0.05, 0.05


def _on(name: str) -> Callable[[Setting], bool]:
    """Return the test that a number has an effect on the present terrain."""
    return lambda setting: is_used(TerrainTable, name, setting.scenario.terrain.kind)


def _by_plan(setting: Setting) -> bool:
    return setting.walks == "the plan"


def _by_gait(setting: Setting) -> bool:
    """Return True if the gait has an effect: a learned policy has its own."""
    return setting.walks == "the plan" or setting.controller == LOCOMOTION


def _controlled(setting: Setting) -> bool:
    return setting.walks != "the plan" and setting.controller == LOCOMOTION


MM, DEGREE = 1e-3, math.radians(1)
LEAN = _fixed(-20 * DEGREE, 20 * DEGREE, DEGREE)
SHIFT = _of_height(-0.4, 0.4, MM)

GROUPS = {
    "walk": "Walk",
    "body": "Body",
    "machine": "Machine",
    "world": "World",
    "forces": "Forces",
}
"""Groups of fields, and their labels."""

FIELDS = (
    Field(
        **_own("walks"),
        label="Walks",
        group="walk",
        help="By itself: ahead at half its largest speed; by hand: by stick and keys; the "
        "plan: the scenario's walk, planned beforehand.",
        choices=lambda _: {word: word for word in get_args(Walks)},
    ),
    Field(
        **_own("controller"),
        label="Controller",
        group="walk",
        help="The locomotion controller, or a policy that was learned for the phantomx-ax.",
        choices=lambda _: {name: name for name in (LOCOMOTION, *policies())},
        shown=lambda setting: setting.walks != "the plan" and bool(policies()),
    ),
    Field(
        name="gait",
        label="Gait",
        group="walk",
        help="Schedule of stance and swing of the legs.",
        read=lambda setting: setting.scenario.gait.name,
        write=_with_gait,
        choices=_gaits,
        shown=_by_gait,
    ),
    Field(
        **_scenario("stride", "period"),
        label="Cycle time",
        group="walk",
        help="Time in which every leg steps once: the shorter, the quicker the cadence.",
        unit="s",
        span=_fixed(0.3, 6.0, 0.05),
        shown=_by_gait,
    ),
    Field(
        **_scenario("stride", "step_height"),
        label="Step height",
        group="walk",
        help="Height to which a foot lifts.",
        unit="mm",
        span=_of_height(0.0, 0.6, MM),
        shown=_by_gait,
    ),
    Field(
        **_scenario("stride", "step_length"),
        label="Step length of the plan",
        group="walk",
        help="Distance of the body forward during a stance, where the robot walks by the plan.",
        unit="mm",
        span=_of_height(-1.0, 1.0, MM),
        shown=_by_plan,
    ),
    Field(
        **_scenario("stride", "stance_law"),
        label="Stance law of the plan",
        group="walk",
        help="Straight: stance feet stay where they are; coxa only: one joint moves, feet slip.",
        choices=_words(StrideTable, "stance_law"),
        shown=_by_plan,
    ),
    Field(
        **_scenario("stride", "stance_timing"),
        label="Timing of the plan",
        group="walk",
        help="The body stops whenever a foot lifts or lands, or never.",
        choices=_words(StrideTable, "stance_timing"),
        shown=_by_plan,
    ),
    Field(
        **_own("ground_sensing"),
        label="Senses the ground",
        group="walk",
        help="On: the robot searches the ground with its feet. Off: it takes it for level.",
        shown=_controlled,
    ),
    *(
        Field(
            name=name,
            label=label,
            group="body",
            help=words,
            unit=unit,
            span=span,
            shown=_controlled,
            **_pose(index),
        )
        for index, name, label, words, unit, span in (
            (2, "body_height", "Height", "Up or down.", "mm", SHIFT),
            (0, "body_x", "Ahead", "Ahead or back of the feet.", "mm", SHIFT),
            (1, "body_y", "Left", "To the left or right.", "mm", SHIFT),
            (3, "roll", "Roll", "To the right or left.", "deg", LEAN),
            (4, "pitch", "Pitch", "Nose down or up.", "deg", LEAN),
            (5, "yaw", "Yaw", "Turned left or right.", "deg", LEAN),
        )
    ),
    Field(
        name="robot",
        label="Robot",
        group="machine",
        help="A robot that comes with phasmid, or one from a file.",
        read=lambda setting: setting.robot_name,
        write=_with_robot,
        choices=lambda setting: {name: name for name in (*preset_names(), *setting.robots)},
    ),
    Field(
        **_scenario("simulation", "drive"),
        label="Drive",
        group="machine",
        help="Prescribed joints take whatever torque it needs; the others are servos with limits.",
        choices=_words(SimulationTable, "drive"),
    ),
    Field(
        **_own("servo"),
        label="Servo",
        group="machine",
        help="The motor of every joint.",
        choices=lambda _: {name: name for name in (OWN_SERVO, *servo_names())},
    ),
    Field(
        name="voltage",
        read=lambda setting: setting.scenario.servo.supply(setting.robot.servo),
        write=_with_voltage,
        label="Supply",
        group="machine",
        help="Voltage of the servos' supply; it follows the servo's rated voltage until it is set.",
        unit="v",
        span=_fixed(6.0, 16.0, 0.1),
        shown=lambda setting: setting.scenario.simulation.drive == "servo",
    ),
    Field(
        **_own("payload"),
        label="Payload",
        group="machine",
        help="A load in the middle of the trunk's upper side, counted by the robot too.",
        unit="kg",
        span=_payloads,
    ),
    Field(
        name="terrain",
        label="Terrain",
        group="world",
        help="The ground, which begins ahead of where the robot starts.",
        read=lambda setting: setting.terrain_name,
        write=_with_terrain,
        choices=_terrains,
    ),
    *(
        Field(
            **_scenario("terrain", name),
            label=label,
            group="world",
            help=words,
            unit=unit,
            span=_fixed(*span),
            shown=_on(name),
        )
        for name, label, words, unit, span in (
            ("slope", "Slope", "Uphill.", "deg", (-45 * DEGREE, 45 * DEGREE, DEGREE)),
            ("rise", "Step's rise", "Height of each step.", "mm", (0.0, 0.1, MM)),
            ("gap_width", "Gap", "Width of the gap.", "mm", (5 * MM, 0.2, 5 * MM)),
            ("block_height", "Blocks", "Of the highest above the lowest.", "mm", (0.0, 0.1, MM)),
            ("wave_height", "Waves", "From trough to crest.", "mm", (0.0, 0.1, MM)),
            ("roughness", "Roughness", "Standard deviation of its height.", "mm", (0.0, 0.03, MM)),
            ("ice_friction", "Friction of ice", "Of the slippery tiles.", "", (0.0, 1.0, 0.05)),
        )
    ),
    Field(
        **_scenario("terrain", "friction"),
        label="Friction",
        group="world",
        help="Coefficient of Coulomb friction between foot and ground.",
        span=_fixed(0.0, 2.0, 0.05),
    ),
    Field(
        **_scenario("contact", "contact_law"),
        label="Contact law",
        group="world",
        help="The law by which the ground holds the feet.",
        choices=_contact_laws,
    ),
    Field(
        **_scenario("model", "force_model"),
        label="Force distribution",
        group="forces",
        help="Distribution of the robot's weight among the stance feet in the model.",
        choices=_words(ModelTable, "force_model"),
    ),
)

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
    """Return the groups, the fields in use and the legs, for the page."""
    return {
        "groups": [{"name": name, "label": label} for name, label in GROUPS.items()],
        "fields": [field.as_dict(setting) for field in FIELDS if field.shown(setting)],
        "legs": [name.replace("_", " ") for name in setting.base.leg_names],
    }
