"""Robot files that are not read, by their endings, and what to do instead."""

from __future__ import annotations

from pathlib import Path

from phasmid.errors import InvalidInput
from phasmid.toml import is_file

_ENDINGS = {
    ".xacro": "",
    ".sdf .world .usd .usda .usdc .usdz .wbt .proto .ttt .ttm .blend": (
        "export the robot as URDF or MJCF from the program that made it"
    ),
    ".srdf": "the .urdf of the same robot",
    ".mjb": "the .xml from which it was compiled",
    ".dae .obj .stl .ply .fbx .glb .gltf .3ds .3mf .off .msh .wrl .vrml": (
        "a URDF or MJCF file that names its meshes"
    ),
    ".f3d .f3z .fcstd .sldasm .sldprt .ipt .iam .catpart .catproduct .prt .asm .x_t .x_b .3dm "
    ".iges .igs .dwg .dxf .scad": "export it as STEP, and put the table of docs/cad.md beside it",
    ".json .yaml .yml": (
        "phasmid export --robot phantomx-ax --out robot.toml, which shows the keys"
    ),
    ".zip .tar .gz .tgz .bz2 .xz .7z .rar": "unpack it, and use the robot file inside",
}

UNREAD = {ending: hint for endings, hint in _ENDINGS.items() for ending in endings.split()}
"""What to do with the files of each ending; empty: expand it by xacro."""


def refuse_unread(path: Path) -> None:
    """Refuse a file whose ending says that it is of a kind that is not read.

    Raises:
        InvalidInput: It is.
    """
    ending = path.suffix.lower()
    if ending not in UNREAD:
        return
    if not is_file(path):
        raise InvalidInput(f"{path} does not exist.")
    # robot.xacro and robot.urdf.xacro both become robot.urdf.
    expand = f"xacro {path.name} > {path.stem.removesuffix('.urdf')}.urdf"
    raise InvalidInput(
        f"{path} ends in {ending}; robots are read from TOML, URDF, MJCF and STEP files.",
        hint=UNREAD[ending] or expand,
    )
