"""Options of reading a robot from URDF, MJCF or STEP, which lack what a walk needs."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

from annotated_types import Gt, Le
from pydantic import model_validator

from phasmid.errors import InvalidInput
from phasmid.robot import preset_names
from phasmid.robot.file import OTHER_FORMATS
from phasmid.robot.unread import UNREAD
from phasmid.tables import Angle, Mass, Table


def is_foreign(source: str | Path) -> bool:
    """Return whether a source is a robot file of another program's format."""
    suffix = Path(source).suffix.lower()
    return str(source) not in preset_names() and suffix in {*OTHER_FORMATS, *UNREAD}


class ImportOptions(Table):
    """``[robot_import]``: how a robot is read from URDF, MJCF or STEP; no other file needs it.

    Attributes:
        foot: Where the feet are: a link's name or its ending, or x,y,z in metres in the frame of
            each leg's last link; or one place for each leg, as 1-3=0,0,-0.13; 4-6=0,0,0.13;
            empty: found in the tree, or else at the end of the last mesh.
        masses: as-given; or geometry, which distributes each link's mass over its box.
        total_mass: Measured mass of the robot [kg]; all masses are scaled to it.
        servo_model: Servo of the catalogue at the file's joints; empty: torques and speeds of the
            file.
        package: Folders that package:// names, such as my_robot=../my_robot; commas between.
        forward: Axis of the file's trunk that points forward (x, y, -x or -y).
        joint_limit: Largest angle to either side of joints for which the file has no limits, 0 to
            0, or a turn or more [rad]; absent: half a turn.
        mesh_unit: Unit of the mesh files (as-given, m or mm).
    """

    foot: str = ""
    masses: Literal["as-given", "geometry"] = "as-given"
    total_mass: Annotated[Mass, Gt(0), Le(1000)] | None = None
    servo_model: str = ""
    package: str = ""
    forward: Literal["x", "y", "-x", "-y"] = "x"
    joint_limit: Annotated[Angle, Gt(0), Le(math.pi)] | None = None
    mesh_unit: Literal["as-given", "m", "mm"] = "as-given"

    @property
    def packages(self) -> dict[str, str]:
        """Folders by the name of the package that ``package://`` names.

        Raises:
            InvalidInput: A package has no folder.
        """
        packages = {}
        for pair in filter(None, (part.strip() for part in self.package.split(","))):
            name, equals, folder = pair.partition("=")
            if not (name and equals and folder):
                raise InvalidInput(
                    f'package is "{pair}"; it must be a name and its folder.',
                    hint='package = "my_robot=../my_robot"',
                )
            packages[name.strip()] = folder.strip()
        return packages

    @model_validator(mode="after")
    def _check_packages(self) -> ImportOptions:
        _ = self.packages
        return self
