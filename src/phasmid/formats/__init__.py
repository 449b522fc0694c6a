"""Robots in and out of the formats of other programs: TOML, URDF, MJCF, STEP."""

from phasmid.formats.findings import Finding, Severity
from phasmid.formats.firmware import firmware_header
from phasmid.formats.importing import Imported, robot_from_tree
from phasmid.formats.judge import judge_robot
from phasmid.formats.legs import FoundLeg
from phasmid.formats.robots import (
    ROBOT_SUFFIXES,
    import_robot,
    is_foreign,
    load_robot,
    load_scenario,
    possible,
    save_robot,
    with_robot,
)
from phasmid.formats.tree import Tree, TreeJoint, TreeLink, tree_of
from phasmid.robot.inertial import Inertial
from phasmid.scenario.tables import ImportOptions

__all__ = [
    "ROBOT_SUFFIXES",
    "Finding",
    "FoundLeg",
    "ImportOptions",
    "Imported",
    "Inertial",
    "Severity",
    "Tree",
    "TreeJoint",
    "TreeLink",
    "firmware_header",
    "import_robot",
    "is_foreign",
    "judge_robot",
    "load_robot",
    "load_scenario",
    "possible",
    "robot_from_tree",
    "save_robot",
    "tree_of",
    "with_robot",
]
