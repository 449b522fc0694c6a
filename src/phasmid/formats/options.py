"""Options for reading a robot from a file that lacks data for walking."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from phasmid.errors import InvalidInput
from phasmid.scenario.robot_import import RobotImportTable


@dataclass(frozen=True)
class ImportOptions:
    """Options for reading a robot from URDF, MJCF or STEP.

    Attributes:
        foot: Where the feet are: name of a link or its ending, such as ``foot_link``; or three
            numbers such as ``0,0,-0.13``, metres in the frame of the last link of each leg; or
            such a place for each leg, as ``1-3=0,0,-0.13; 4-6=foot_link``; empty to find them in
            the file.
        masses: ``as-given``; or ``geometry``: the mass of each link is spread over its box.
        total_mass: What the whole robot weighs on a scale [kg]: all masses are scaled to it.
        servo: Name of the servo; empty to take efforts and speeds from the file.
        packages: Folders by the name of the package that ``package://`` names.
        mesh_unit: Unit of mesh files: ``m`` or ``mm``; empty for that of the file.
        strict: Whether anything that was ignored is an error.
    """

    foot: str = ""
    masses: str = "as-given"
    total_mass: float | None = None
    servo: str = ""
    packages: Mapping[str, str] = field(default_factory=dict)
    mesh_unit: str = ""
    strict: bool = False

    @classmethod
    def of(cls, table: RobotImportTable, *, strict: bool = False) -> ImportOptions:
        """Convert the ``[robot_import]`` of a scenario.

        Raises:
            InvalidInput: A package has no folder.
        """
        packages = {}
        for pair in filter(None, (part.strip() for part in table.package.split(","))):
            name, equals, folder = pair.partition("=")
            if not (name and equals and folder):
                raise InvalidInput(
                    f'package is "{pair}"; it must be a name and its folder.',
                    hint="--package my_robot=../my_robot",
                )
            packages[name.strip()] = folder.strip()
        unit = "" if table.mesh_unit == "as-given" else table.mesh_unit
        return cls(
            table.foot,
            table.masses,
            table.total_mass,
            table.servo_model,
            packages,
            unit,
            strict,
        )
