"""Settings for reading a robot from a file that lacks data for walking."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Gt, Le
from pydantic import model_validator

from phasmid.errors import InvalidInput
from phasmid.tables import Mass, Table


class ImportOptions(Table):
    """``[robot_import]``: how a robot is read from URDF, MJCF or STEP; no other file needs it.

    Attributes:
        foot: Where the feet are: a link's name or its ending, or x,y,z in metres in the frame of
            each leg's last link; or one place for each leg, as 1-3=0,0,-0.13; 4-6=0,0,0.13;
            empty: found in the tree, or else at the end of the last mesh.
        masses: as-given; or geometry, which spreads each link's mass over its box.
        total_mass: What the robot weighs on a scale [kg]; all masses are scaled to it.
        servo_model: Name of the servo; empty: efforts and speeds of the file.
        package: Folders that package:// names, such as my_robot=../my_robot; commas between.
        mesh_unit: Unit of the mesh files (as-given, m or mm).
    """

    foot: str = ""
    masses: Literal["as-given", "geometry"] = "as-given"
    total_mass: Annotated[Mass, Gt(0), Le(1000)] | None = None
    servo_model: str = ""
    package: str = ""
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
                    hint="--package my_robot=../my_robot",
                )
            packages[name.strip()] = folder.strip()
        return packages

    @model_validator(mode="after")
    def _check_packages(self) -> ImportOptions:
        _ = self.packages
        return self
