"""The fields of the setting, as people see and change them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, get_args

from phasmid.arguments import described
from phasmid.errors import InvalidInput, nearest
from phasmid.gait import gaits_of
from phasmid.robot import preset_names, servo_names
from phasmid.scenario.contact import ContactTable
from phasmid.scenario.model import ModelTable
from phasmid.scenario.relevance import TERRAINS
from phasmid.scenario.simulation import SimulationTable
from phasmid.scenario.stride import StrideTable
from phasmid.scenario.terrain import START, TerrainTable
from phasmid.studio.field import Field, Span, Value
from phasmid.studio.setting import MOST_PAYLOAD, OWN_SERVO, Setting, Walks
from phasmid.tables import Table
from phasmid.tables import choices as words_of


def _words(table: type[Table], name: str) -> Callable[[Setting], dict[str, str]]:
    """The words that a scenario's field accepts, as they are."""
    known = {word: word.replace("-", " ") for word in words_of(table.model_fields[name])}
    return lambda _: dict(known)


def _of(name: str, *path: str) -> dict[str, Any]:
    """How a scenario's field is read and written."""

    def read(setting: Setting) -> Any:
        value: Any = setting.scenario
        for part in path:
            value = getattr(value, part)
        return value

    def write(setting: Setting, value: Any) -> Setting:
        return replace(setting, scenario=setting.scenario.replace(**{name: value}))

    return {"name": name, "read": read, "write": write}


def _pose(place: int) -> dict[str, Any]:
    """How a coordinate of the body's pose is read and written."""

    def write(setting: Setting, value: float) -> Setting:
        pose = list(setting.pose)
        pose[place] = value
        return replace(setting, pose=tuple(pose))  # type: ignore[arg-type]

    return {"read": lambda setting: setting.pose[place], "write": write}


def _own(name: str) -> dict[str, Any]:
    """How one of the setting's own attributes is read and written."""
    return {
        "name": name,
        "read": lambda setting: getattr(setting, name),
        "write": lambda setting, value: replace(setting, **{name: value}),
    }


def _gaits(setting: Setting) -> dict[str, str]:
    known = [*gaits_of(len(setting.base.legs))]
    now = setting.scenario.gait.name
    return {name: name for name in (known if now in known else [*known, now])}


def _robots(setting: Setting) -> dict[str, str]:
    return {name: name for name in (*preset_names(), *setting.robots)}


def _with_robot(setting: Setting, name: str) -> Setting:
    return setting.with_robot(name if name in preset_names() else setting.robots[name])


def _terrains(setting: Setting) -> dict[str, str]:
    kinds = [kind for kind in words_of(TerrainTable.model_fields["kind"]) if kind != "height-map"]
    if not setting.scenario.terrain.edge_x:
        # Their edges are told by a file.
        kinds.remove("steps")
    if setting.terrain_name == "height-map":
        kinds.append("height-map")
    return {name: name for name in (*kinds, *setting.grounds)}


def _with_terrain(setting: Setting, name: str) -> Setting:
    changes: dict[str, Any] = {"terrain": name}
    if name == "slope" and setting.scenario.terrain.terrain_start is None:
        # Not under the robot: it starts on level ground, and walks onto the slope.
        changes["terrain_start"] = START
    elif name in setting.grounds:
        changes = {"terrain": "height-map", "height_map": setting.grounds[name]}
    return replace(setting, scenario=setting.scenario.replace(**changes))


def _servos(_: Setting) -> dict[str, str]:
    return {name: name for name in (OWN_SERVO, *servo_names())}


def _with_voltage(setting: Setting, voltage: float) -> Setting:
    rated = setting.robot.servo.rated_voltage
    chosen = None if voltage == rated else voltage
    return replace(setting, scenario=setting.scenario.replace(voltage=chosen))


def _contact_laws(setting: Setting) -> dict[str, str]:
    known = _words(ContactTable, "contact_law")(setting)
    if setting.scenario.contact.contact_law != "simscape":
        # It has a simulator of its own, which knows no robot that is driven.
        del known["simscape"]
    return known


def _shares(least: float, most: float, step: float) -> Callable[[Setting], Span]:
    """A range in shares of the height of the hips over the ground, of whole steps."""
    return lambda setting: (
        math.floor(least * setting.height / step) * step,
        math.ceil(most * setting.height / step) * step,
        step,
    )


def _always(span: Span) -> Callable[[Setting], Span]:
    return lambda _: span


def _on(name: str) -> Callable[[Setting], bool]:
    """Whether a number of the terrain counts on the present one."""
    return lambda setting: setting.scenario.terrain.kind in TERRAINS[name]


def _by_plan(setting: Setting) -> bool:
    """Whether the robot walks by a plan, which has numbers of its own."""
    return setting.walks == "the plan"


def _not_by_plan(setting: Setting) -> bool:
    """Whether a controller has the robot, which poses its body and senses the ground."""
    return setting.walks != "the plan"


MM, DEGREE = 1e-3, math.radians(1)
LEAN = math.radians(20)

GROUPS = {
    "walk": "Walk",
    "body": "Body",
    "machine": "Machine",
    "world": "World",
    "forces": "Forces",
}
"""Groups of fields, and what people call them."""

FIELDS = (
    Field(
        **_own("walks"),
        label="Walks",
        group="walk",
        help="By itself: ahead at half its largest speed; by hand: as stick and keys say; the "
        "plan: the scenario's walk, planned beforehand.",
        choices=lambda _: {word: word for word in get_args(Walks)},
    ),
    Field(
        name="gait",
        label="Gait",
        group="walk",
        help="Which legs stand, when.",
        read=lambda setting: setting.scenario.gait.name,
        write=lambda setting, value: replace(
            setting,
            scenario=setting.scenario
            if value == setting.scenario.gait.name
            else setting.scenario.replace(gait=value),
        ),
        choices=_gaits,
    ),
    Field(
        **_of("period", "stride", "period"),
        label="Cycle time",
        group="walk",
        help="Time in which every leg steps once: the shorter, the quicker the cadence.",
        unit="s",
        span=lambda _: (0.3, 6.0, 0.05),
    ),
    Field(
        **_of("step_height", "stride", "step_height"),
        label="Step height",
        group="walk",
        help="Height to which a foot lifts.",
        unit="mm",
        span=_shares(0.0, 0.6, MM),
    ),
    Field(
        **_of("step_length", "stride", "step_length"),
        label="Step length of the plan",
        group="walk",
        help="The body's way forward while a foot stands, where the robot walks by the plan.",
        unit="mm",
        span=_shares(-1.0, 1.0, MM),
        shown=_by_plan,
    ),
    Field(
        **_of("stance_law", "stride", "stance_law"),
        label="Stance law of the plan",
        group="walk",
        help="Straight: standing feet stay where they are; coxa only: one joint moves, feet slip.",
        choices=_words(StrideTable, "stance_law"),
        shown=_by_plan,
    ),
    Field(
        **_of("stance_timing", "stride", "stance_timing"),
        label="Timing of the plan",
        group="walk",
        help="Whether the body stops whenever a foot lifts or lands, or never.",
        choices=_words(StrideTable, "stance_timing"),
        shown=_by_plan,
    ),
    Field(
        **_own("ground_sensing"),
        label="Senses the ground",
        group="walk",
        help="Whether the robot looks for the ground with its feet, or trusts that it is level.",
        shown=_not_by_plan,
    ),
    *(
        Field(
            name=name,
            label=label,
            group="body",
            help=words,
            unit=unit,
            span=span,
            shown=_not_by_plan,
            **_pose(place),
        )
        for place, name, label, words, unit, span in (
            (2, "body_height", "Height", "Up or down.", "mm", _shares(-0.4, 0.4, MM)),
            (0, "body_x", "Ahead", "Ahead or back of the feet.", "mm", _shares(-0.4, 0.4, MM)),
            (1, "body_y", "Left", "To the left or right.", "mm", _shares(-0.4, 0.4, MM)),
            (3, "roll", "Roll", "To the right or left.", "deg", lambda _: (-LEAN, LEAN, DEGREE)),
            (4, "pitch", "Pitch", "Nose down or up.", "deg", lambda _: (-LEAN, LEAN, DEGREE)),
            (5, "yaw", "Yaw", "Turned left or right.", "deg", lambda _: (-LEAN, LEAN, DEGREE)),
        )
    ),
    Field(
        name="robot",
        label="Robot",
        group="machine",
        help="A robot that comes with phasmid, or one from a file.",
        read=lambda setting: setting.robot_name,
        write=_with_robot,
        choices=_robots,
    ),
    Field(
        **_of("drive", "simulation", "drive"),
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
        choices=_servos,
    ),
    Field(
        name="voltage",
        read=lambda setting: setting.scenario.servo.supply(setting.robot.servo),
        write=_with_voltage,
        label="Supply",
        group="machine",
        help="Voltage of the servos' supply; it follows the servo's rated voltage until it is set.",
        unit="v",
        span=lambda _: (6.0, 16.0, 0.1),
        shown=lambda setting: setting.scenario.simulation.drive == "servo",
    ),
    Field(
        **_own("payload"),
        label="Payload",
        group="machine",
        help="A load in the middle of the trunk's upper side, counted by the robot too.",
        unit="kg",
        span=lambda setting: (
            0.0,
            math.floor(MOST_PAYLOAD * setting.base.mass / 0.05) * 0.05,
            0.05,
        ),
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
            **_of(name, "terrain", name),
            label=label,
            group="world",
            help=words,
            unit=unit,
            span=_always(span),
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
        **_of("friction", "terrain", "friction"),
        label="Friction",
        group="world",
        help="Coefficient of Coulomb friction between foot and ground.",
        span=lambda _: (0.0, 2.0, 0.05),
    ),
    Field(
        **_of("contact_law", "contact", "contact_law"),
        label="Contact law",
        group="world",
        help="The law by which the ground holds the feet.",
        choices=_contact_laws,
    ),
    Field(
        **_of("force_model", "model", "force_model"),
        label="Force distribution",
        group="forces",
        help="How the model shares the robot's weight among the standing feet.",
        choices=_words(ModelTable, "force_model"),
    ),
)
"""All fields, in the order in which several of them are set."""

BY_NAME = {one.name: one for one in FIELDS}


def field_of(name: str) -> Field:
    """A field by its name.

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
    """All values of a setting, as people know them."""
    return {one.name: one.value(setting) for one in FIELDS}


def catalogue(setting: Setting) -> dict[str, Any]:
    """What can be set at present, for a page to show."""
    return {
        "groups": [{"name": name, "label": label} for name, label in GROUPS.items()],
        "fields": [one.told(setting) for one in FIELDS if one.shown(setting)],
        "legs": [name.replace("_", " ") for name in setting.base.leg_names],
    }
