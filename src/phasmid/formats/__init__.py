"""Robots in and out of the formats that people have: TOML, URDF, MJCF, STEP."""

from phasmid.formats.findings import Finding, Severity
from phasmid.formats.options import ImportOptions
from phasmid.formats.outgoing import tree_of
from phasmid.formats.tree import Inertial, Tree, TreeJoint, TreeLink
from phasmid.formats.urdf_in import read_urdf
from phasmid.formats.urdf_out import urdf_files

__all__ = [
    "Finding",
    "ImportOptions",
    "Inertial",
    "Severity",
    "Tree",
    "TreeJoint",
    "TreeLink",
    "read_urdf",
    "tree_of",
    "urdf_files",
]
