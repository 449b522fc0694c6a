"""Robots in and out of the formats that people have: TOML, URDF, MJCF, STEP."""

from phasmid.formats.extension import extension_of
from phasmid.formats.findings import Finding, Severity
from phasmid.formats.imported import Imported, ImportFacts, LegFacts
from phasmid.formats.judge import judge, judge_robot
from phasmid.formats.legs import robot_from_tree
from phasmid.formats.options import ImportOptions
from phasmid.formats.outgoing import tree_of
from phasmid.formats.tree import Inertial, Tree, TreeJoint, TreeLink
from phasmid.formats.urdf_in import read_urdf

__all__ = [
    "Finding",
    "ImportFacts",
    "ImportOptions",
    "Imported",
    "Inertial",
    "LegFacts",
    "Severity",
    "Tree",
    "TreeJoint",
    "TreeLink",
    "extension_of",
    "judge",
    "judge_robot",
    "read_urdf",
    "robot_from_tree",
    "tree_of",
]
