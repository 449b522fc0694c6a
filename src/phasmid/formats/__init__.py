"""Robots in and out of the formats that people have: TOML, URDF, MJCF, STEP."""

from phasmid.formats.extension import extension_of
from phasmid.formats.findings import Finding, Severity
from phasmid.formats.legs import Imported, ImportFacts, LegFacts, robot_from_tree
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
    "robot_from_tree",
    "read_urdf",
    "tree_of",
]
