"""Kinds of robot files that are not read, by their endings."""

from __future__ import annotations

from pathlib import Path

from phasmid.errors import InvalidInput
from phasmid.toml import is_file

_ENDINGS = {
    ".sdf .world": ("an SDF file", "convert it to URDF or MJCF"),
    ".usd .usda .usdc .usdz": (
        "a USD file",
        "export it as URDF with Isaac Sim's USD to URDF exporter, or use the URDF or MJCF that it "
        "was made from",
    ),
    ".wbt .proto": (
        "a file of Webots",
        "save the text that robot.getUrdf() returns in a Webots controller as a .urdf file",
    ),
    ".ttt .ttm": ("a file of CoppeliaSim", "export the robot there with simURDF.export"),
    ".srdf": ("an SRDF file, which has no masses or lengths", "the .urdf file of the same robot"),
    ".mjb": ("a compiled MuJoCo model", "the .xml file that it was compiled from"),
    ".dae .obj .stl .ply .fbx .glb .gltf .3ds .3mf .off .msh .wrl .vrml": (
        "a mesh, which has no joints",
        "a URDF or MJCF file that names its meshes",
    ),
    ".blend": ("a Blender file", "export the robot as URDF, such as with the add-on Phobos"),
    ".f3d .f3z .fcstd .sldasm .sldprt .ipt .iam .catpart .catproduct .prt .asm .x_t .x_b .3dm "
    ".iges .igs .dwg .dxf .scad": (
        "a file of a CAD program",
        "export it as STEP, and put the table of docs/cad.md beside it",
    ),
    ".json": ("a JSON file", "phasmid convert phantomx-ax robot.toml, which shows the keys"),
    ".yaml .yml": ("a YAML file", "phasmid convert phantomx-ax robot.toml, which shows the keys"),
    ".zip .tar .gz .tgz .bz2 .xz .7z .rar": (
        "an archive",
        "unpack it, and use the .urdf or .xml file of the robot",
    ),
}
"""Kinds of files and what to do instead."""

UNREAD = {ending: words for endings, words in _ENDINGS.items() for ending in endings.split()} | {
    ".xacro": ("a xacro template", "")
}
"""Kind of the files of each ending, and what to do instead."""


def refuse_unread(path: Path) -> None:
    """Refuse a file whose ending says that it is of a kind that is not read.

    Raises:
        InvalidInput: It is.
    """
    if path.suffix.lower() not in UNREAD:
        return
    if not is_file(path):
        raise InvalidInput(f"{path} does not exist.")
    kind, hint = UNREAD[path.suffix.lower()]
    if not hint:
        # robot.xacro and robot.urdf.xacro both become robot.urdf.
        hint = f"xacro {path.name} > {path.stem.removesuffix('.urdf')}.urdf"
    raise InvalidInput(
        f"{path} is {kind}; robots are read from TOML, URDF, MJCF and STEP files.", hint=hint
    )
