"""Fields of a scenario that have no effect, because of another field."""

from __future__ import annotations

from collections.abc import Set

from phasmid.robot import Robot
from phasmid.robot.servo_words import servo_label
from phasmid.scenario.scenario import Scenario, option_keys
from phasmid.tables import Of, Table

GAINS = {"compliance": {"p_gain", "d_gain"}, "pid": {"compliance_margin", "compliance_slope"}}
"""Fields of the servo that a law does not use."""

JUDGED = {"voltage", "ambient_temperature", "torque_limit"}
"""Fields of the servo that its verdict uses with every drive."""


def idle_fields(scenario: Scenario, robot: Robot | None = None) -> list[str]:
    """Find fields without effect that mislead users.

    A value equal to its default does not count: files of results name every field.

    Args:
        scenario: The scenario.
        robot: Its robot, where the scenario's file of it is gone.

    Returns:
        A sentence on each field, such as ``punch has no effect with drive "prescribed".``
    """
    drive, measured = scenario.simulation.planned_drive, scenario.sensors.measured
    contact, terrain = scenario.contact, scenario.terrain
    law, kind = contact.contact_law, terrain.kind
    found = _idle("contact", contact, _unused(contact, law), f'contact_law "{law}"')
    unused = _unused(terrain, kind)
    if kind in {"flat", "steps"}:
        unused.add("terrain_start")
    if kind == "flat" and not terrain.patches:
        unused |= {"terrain_yaw", "planned_on"}
    found += _idle("terrain", terrain, unused, f'terrain "{kind}"')
    if drive != "torque":
        gains = {"position_gain", "speed_gain"}
        found += _idle("simulation", scenario.simulation, gains, f'drive "{drive}"')
    if drive == "servo":
        servo = (robot or scenario.base_robot()).servo
        what = f'the {servo_label(servo.name)}, whose law is "{servo.law}"'
        found += _idle("servo", scenario.servo, GAINS[servo.law], what)
    else:
        names = type(scenario.servo).model_fields.keys() - JUDGED
        found += _idle("servo", scenario.servo, names, f'drive "{drive}"')
    depth = scenario.sensors.depth
    found += _idle(
        "sensors", scenario.sensors, _unused(scenario.sensors, depth), f'depth "{depth}"'
    )
    if measured == "nothing":
        names = {
            name for name in type(scenario.sensors).model_fields if not name.startswith("depth")
        } - {"measured", "body_state"}
        if depth in ("camera", "lidar"):
            names.remove("sensor_seed")
        found += _idle("sensors", scenario.sensors, names, 'measured "nothing"')
    return found


def is_used(table: type[Table], name: str, choice: str) -> bool:
    """Return whether a field of a table is used with a choice, such as a kind of terrain."""
    marks = [m for m in table.model_fields[name].metadata if isinstance(m, Of)]
    return all(choice in mark.choices for mark in marks)


def _unused(table: Table, choice: str) -> set[str]:
    kind = type(table)
    return {name for name in kind.model_fields if not is_used(kind, name, choice)}


def _idle(name: str, table: Table, fields: Set[str], what: str) -> list[str]:
    """Return a sentence on each of these fields that differs from its default."""
    keys = {path: key for key, path in option_keys().items()}
    return [
        f"{keys[name, field]} has no effect with {what}."
        for field, info in type(table).model_fields.items()
        if field in fields and getattr(table, field) != info.default
    ]
