"""Robots in and out of the formats of other programs: TOML, URDF, MJCF, STEP.

The names load when they are first used: scenarios have `ImportOptions`, and readers are slow.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from phasmid.formats.import_options import ImportOptions, is_foreign

if TYPE_CHECKING:
    from phasmid.formats.findings import Finding, Severity
    from phasmid.formats.firmware import firmware_header
    from phasmid.formats.importing import Imported, robot_from_tree
    from phasmid.formats.judge import judge_robot
    from phasmid.formats.legs import FoundLeg
    from phasmid.formats.robots import import_robot, load_robot, possible, save_robot
    from phasmid.formats.tree import Tree, TreeJoint, TreeLink, tree_of

_NAMES = {
    "findings": "Finding Severity",
    "firmware": "firmware_header",
    "importing": "Imported robot_from_tree",
    "judge": "judge_robot",
    "legs": "FoundLeg",
    "robots": "import_robot load_robot possible save_robot",
    "tree": "Tree TreeJoint TreeLink tree_of",
}
"""Public names by the module that has them."""

_MODULE_OF = {name: module for module, names in _NAMES.items() for name in names.split()}

__all__ = [
    "Finding",
    "FoundLeg",
    "ImportOptions",
    "Imported",
    "Severity",
    "Tree",
    "TreeJoint",
    "TreeLink",
    "firmware_header",
    "import_robot",
    "is_foreign",
    "judge_robot",
    "load_robot",
    "possible",
    "robot_from_tree",
    "save_robot",
    "tree_of",
]


def __getattr__(name: str) -> Any:
    if name in _MODULE_OF:
        return getattr(import_module(f"{__name__}.{_MODULE_OF[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
