"""Fields of a scenario that have no effect, because of another field."""

from __future__ import annotations

from collections.abc import Iterable

from phasmid.robot import Robot
from phasmid.scenario.scenario import Scenario, option_keys
from phasmid.tables import Table

CONTACT_LAWS = {
    "stiffness": {"spring-damper", "simscape"},
    "damping": {"spring-damper", "simscape"},
    "friction_damping": {"spring-damper"},
    "impedance": {"spring-damper"},
    "kinetic_friction": {"simscape"},
    "friction_threshold": {"simscape"},
}
"""Contact laws that use a field."""

TERRAINS: dict[str, set[str]] = {
    "terrain_start": {
        *("slope", "stairs", "step", "gap", "blocks", "waves", "rough", "height-map", "ice")
    },
    "terrain_seed": {"blocks", "rough"},
    "slope": {"slope"},
    "rise": {"stairs", "step"},
    "run": {"stairs"},
    "stair_count": {"stairs"},
    "gap_width": {"gap"},
    "gap_depth": {"gap", "blocks"},
    "edge_x": {"steps"},
    "edge_z": {"steps"},
    "block_size": {"blocks"},
    "block_gap": {"blocks"},
    "block_height": {"blocks"},
    "wave_height": {"waves"},
    "wave_length": {"waves"},
    "roughness": {"rough"},
    "rough_length": {"rough"},
    "height_map": {"height-map"},
    "map_sha256": {"height-map"},
    "map_cell": {"height-map"},
    "map_height": {"height-map"},
    "ice_friction": {"ice"},
    "tile": {"ice"},
}
"""Kinds of terrain that use a field."""

GAINS = {"compliance": ("p_gain", "d_gain"), "pid": ("compliance_margin", "compliance_slope")}
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
    drive, law = scenario.simulation.planned_drive, scenario.contact.contact_law
    terrain, measured = scenario.terrain, scenario.sensors.measured
    found = _idle(
        "contact",
        scenario.contact,
        [name for name, laws in CONTACT_LAWS.items() if law not in laws],
        f'contact_law "{law}"',
    )
    unused = [name for name, kinds in TERRAINS.items() if terrain.kind not in kinds]
    if terrain.kind == "flat" and not terrain.patches:
        unused += ["terrain_yaw", "planned_on"]
    found += _idle("terrain", terrain, unused, f'terrain "{terrain.kind}"')
    if drive != "torque":
        gains = ("position_gain", "speed_gain")
        found += _idle("simulation", scenario.simulation, gains, f'drive "{drive}"')
    if drive == "servo":
        servo = (robot or scenario.base_robot()).servo
        what = f'the {servo.name}, whose law is "{servo.law}"'
        found += _idle("servo", scenario.servo, GAINS.get(servo.law, ()), what)
    else:
        names = type(scenario.servo).model_fields.keys() - JUDGED
        found += _idle("servo", scenario.servo, names, f'drive "{drive}"')
    if measured == "nothing":
        names = type(scenario.sensors).model_fields.keys() - {"measured"}
        found += _idle("sensors", scenario.sensors, names, 'measured "nothing"')
    return found


def _idle(name: str, table: Table, fields: Iterable[str], what: str) -> list[str]:
    """Return a sentence on each of these fields that differs from its default."""
    keys = {path: key for key, path in option_keys().items()}
    return [
        f"{keys[name, field]} has no effect with {what}."
        for field, info in type(table).model_fields.items()
        if field in set(fields) and getattr(table, field) != info.default
    ]
