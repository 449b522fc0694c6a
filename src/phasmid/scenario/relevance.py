"""Fields of a scenario that have no effect, because of another field or of its use."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Set

from phasmid.robot import Robot
from phasmid.scenario.scenario import Scenario, option_keys
from phasmid.scenario.tables import ServoTable
from phasmid.scenario.terrain import TerrainTable
from phasmid.servo.words import servo_label
from phasmid.tables import Of, Table

GAINS = {"compliance": {"p_gain", "d_gain"}, "pid": {"compliance_margin", "compliance_slope"}}
"""Fields of the servo that a law does not use."""

JUDGED = {"servo", "voltage", "ambient_temperature", "torque_limit"}
"""Fields of the servo that count with every drive, in limits of the plan or in its verdict."""


ANALYSIS = {
    "body_acceleration",
    "force_model",
    "tangential_weight",
    "torque_limits",
    "load_transfer",
}
"""Fields of the model that only the analysis of a planned walk uses."""

PLAN = {
    "step_length",
    "step_sideways",
    "step_turn",
    "samples",
    "stance_law",
    "stance_timing",
    "curve",
}
"""Fields of the stride that only a plan uses."""

REFUSABLE = {"drive", "servo", "voltage", "torque_limit", "kind", "patches", "planned_on"}
"""Fields for which a plan may be refused, whatever else they do."""

POSITION_LAW = {*ServoTable.model_fields} - JUDGED
"""Fields of the servo that only its position law uses."""

_NO_RUN = dict.fromkeys(("footing", "simulation", "contact", "servo", "sensors"), ("*",))

UNUSED: Mapping[str, Mapping[str, Iterable[str]]] = {
    "a plan": {"simulation": {"start_posture"}, "sensors": {"body_state", "depth"}},
    "a simulated walk": {
        "stride": {"samples"},
        "simulation": {"start_posture"},
        "sensors": {"body_state", "depth"},
    },
    "a driven robot": {
        "stride": PLAN,
        "footing": ("*",),
        "model": ANALYSIS,
        "terrain": {"planned_on"},
    },
    "the advice on servos": {
        **_NO_RUN,
        "": {"duration"},
        "stride": {"samples"},
        "model": ANALYSIS,
        "servo": POSITION_LAW,
        "terrain": {*TerrainTable.model_fields} - {"friction", "patches"},
    },
    "the list of gaits": {
        **_NO_RUN,
        "": {"duration"},
        "stride": {"samples", "stance_law"},
        "model": {*ANALYSIS, "gravity"},
        "terrain": ("*",),
    },
    "a posture": {
        **_NO_RUN,
        "": {"duration"},
        "stride": {*PLAN, "period", "step_height"},
        "model": ("*",),
        "terrain": ("*",),
    },
    "a C header": {
        **_NO_RUN,
        "": {"duration"},
        "model": {*ANALYSIS, "gravity", "mass_model"},
        "terrain": ("*",),
    },
}
"""Fields that a use of a scenario leaves out, by table; ``*``: all, but for `REFUSABLE` ones."""


def idle_fields(
    scenario: Scenario, robot: Robot | None = None, use: str | None = None
) -> list[str]:
    """Find fields without effect that mislead users.

    A value equal to its default does not count: files of results name every field.

    Args:
        scenario: The scenario.
        robot: Its robot, where the scenario's file of it is gone.
        use: What the scenario is for, one of `UNUSED`; None: any run.

    Returns:
        A sentence on each field, such as ``punch has no effect with drive "prescribed".``
    """
    found: dict[str, str] = {}
    for name, unused in UNUSED[use].items() if use else ():
        table = getattr(scenario, name) if name else scenario
        fields = set(type(table).model_fields) - REFUSABLE if "*" in unused else set(unused)
        found |= _idle(name, table, fields, f"on {use}")
    found = _idle_by_choice(scenario, robot) | found
    return [f"{key} has no effect {reason}." for key, reason in found.items()]


def _idle_by_choice(scenario: Scenario, robot: Robot | None) -> dict[str, str]:
    """Return the fields that another field of the scenario leaves out, with that one."""
    drive, measured = scenario.simulation.planned_drive, scenario.sensors.measured
    contact, terrain, model = scenario.contact, scenario.terrain, scenario.model
    law, kind = contact.contact_law, terrain.kind
    found = _idle("contact", contact, _unused(contact, law), f'with contact_law "{law}"')
    unused = _unused(terrain, kind)
    if kind in {"flat", "steps"}:
        unused.add("terrain_start")
    if kind == "flat" and not terrain.patches:
        unused |= {"terrain_yaw", "planned_on"}
        footing = set(type(scenario.footing).model_fields)
        found |= _idle("footing", scenario.footing, footing, f'with terrain "{kind}"')
    found |= _idle("terrain", terrain, unused, f'with terrain "{kind}"')
    if model.force_model != "weighted-minimum-norm":
        found |= _idle("model", model, {"tangential_weight"}, f"with {model.force_model} forces")
    if drive != "torque":
        gains = {"position_gain", "speed_gain"}
        found |= _idle("simulation", scenario.simulation, gains, f'with drive "{drive}"')
    if drive == "servo":
        servo = (robot or scenario.base_robot()).servo
        reason = f'with the {servo_label(servo.name)}, whose law is "{servo.law}"'
        found |= _idle("servo", scenario.servo, GAINS[servo.law], reason)
    else:
        names = type(scenario.servo).model_fields.keys() - JUDGED
        found |= _idle("servo", scenario.servo, names, f'with drive "{drive}"')
    depth = scenario.sensors.depth
    names = _unused(scenario.sensors, depth)
    found |= _idle("sensors", scenario.sensors, names, f'with depth "{depth}"')
    if measured == "nothing":
        names = {
            name for name in type(scenario.sensors).model_fields if not name.startswith("depth")
        } - {"measured", "body_state"}
        if depth in ("camera", "lidar"):
            names.remove("sensor_seed")
        found |= _idle("sensors", scenario.sensors, names, 'with measured "nothing"')
    return found


def is_used(table: type[Table], name: str, choice: str) -> bool:
    """Return whether a field of a table is used with a choice, such as a kind of terrain."""
    marks = [m for m in table.model_fields[name].metadata if isinstance(m, Of)]
    return all(choice in mark.choices for mark in marks)


def _unused(table: Table, choice: str) -> set[str]:
    kind = type(table)
    return {name for name in kind.model_fields if not is_used(kind, name, choice)}


def _idle(name: str, table: Table, fields: Set[str], reason: str) -> dict[str, str]:
    """Return those of these fields that differ from their defaults, by key, with a reason."""
    keys = {path: key for key, path in option_keys().items()}
    return {
        keys[(name, field) if name else (field,)]: reason
        for field, info in type(table).model_fields.items()
        if field in fields and getattr(table, field) != info.default
    }
