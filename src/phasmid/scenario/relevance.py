"""Which fields of a scenario do nothing, since another one leaves them out."""

from __future__ import annotations

from phasmid.formats import is_foreign
from phasmid.robot import Robot
from phasmid.scenario.robot_import import RobotImportTable
from phasmid.scenario.scenario import Scenario, option_keys
from phasmid.scenario.sensors import SensorsTable
from phasmid.scenario.servo import ServoTable
from phasmid.tables import Table

Counts = dict[str, set[str]]
"""By the name of a field, the values of another field with which it counts."""

SERVO_LAWS: Counts = {
    "compliance_margin": {"compliance"},
    "compliance_slope": {"compliance"},
    "punch": {"compliance"},
    "p_gain": {"pid"},
    "d_gain": {"pid"},
}
CONTACT_LAWS: Counts = {
    "stiffness": {"spring-damper", "simscape"},
    "damping": {"spring-damper", "simscape"},
    "friction_damping": {"spring-damper"},
    "impedance": {"spring-damper"},
    "kinetic_friction": {"simscape"},
    "friction_threshold": {"simscape"},
}

FORCE_MODELS: Counts = {"tangential_weight": {"weighted-minimum-norm"}}

TERRAINS: Counts = {
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

IMPORTS: Counts = {name: set() for name in RobotImportTable.model_fields}
JUDGED = {"voltage", "ambient_temperature", "torque_limit"}
"""Settings of the servos that the verdict on them counts, whatever the drive."""

OWN_DRIVE: Counts = {name: {"servo"} for name in ServoTable.model_fields if name not in JUDGED}
GAINS: Counts = {"position_gain": {"torque"}, "speed_gain": {"torque"}}
MEASURED: Counts = {
    name: {"everything"} for name in SensorsTable.model_fields if name != "measured"
}


def idle_fields(scenario: Scenario, robot: Robot | None = None) -> list[str]:
    """What a scenario says without effect.

    Only a value that differs from its default counts: files of results name every field.

    Args:
        scenario: The scenario.
        robot: Its robot, where the scenario names no file that is there.

    Returns:
        A sentence on each field, such as ``punch has no effect with drive "prescribed".``

    Raises:
        InvalidInput: The robot file is absent or not well formed.
        InvalidRobot: No machine could have these numbers.
    """
    drive = scenario.simulation.planned_drive
    kind = scenario.terrain.kind
    contact, model = scenario.contact, scenario.model
    found = [
        *_idle("model", model, FORCE_MODELS, "force_model", model.force_model),
        *_idle("contact", contact, CONTACT_LAWS, "contact_law", contact.contact_law),
        *_idle("terrain", scenario.terrain, TERRAINS, "terrain", kind),
        *_idle("simulation", scenario.simulation, GAINS, "drive", drive),
    ]
    if robot is None and isinstance(scenario.robot, str) and not is_foreign(scenario.robot):
        found += _idle("robot_import", scenario.robot_import, IMPORTS, "robot", scenario.robot)
    if kind == "flat" and not scenario.terrain.patches:
        only: Counts = {"terrain_yaw": set(), "planned_on": set()}
        found += _idle("terrain", scenario.terrain, only, "terrain", kind)
    if drive == "servo":
        servo = (robot or scenario.base_robot()).servo
        law = f"the {servo.name}, whose law is"
        found += _idle("servo", scenario.servo, SERVO_LAWS, law, servo.law)
    else:
        found += _idle("servo", scenario.servo, OWN_DRIVE, "drive", drive)
    measured = scenario.sensors.measured
    return found + _idle("sensors", scenario.sensors, MEASURED, "measured", measured)


def _idle(name: str, table: Table, counts: Counts, what: str, value: str) -> list[str]:
    """Sentences on the fields of a table that do not count where another one has this value."""
    keys = {path: key for key, path in option_keys().items()}
    return [
        f'{keys[name, field]} has no effect with {what} "{value}".'
        for field, values in counts.items()
        if value not in values and getattr(table, field) != type(table).model_fields[field].default
    ]
