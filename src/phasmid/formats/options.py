"""What a person adds to a file that does not say all that a walking robot needs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class ImportOptions:
    """How a robot is read from URDF, MJCF or STEP.

    Attributes:
        foot: Where the feet are: name of a link or its ending, such as ``foot_link``; or three
            numbers such as ``0,0,-0.13``, metres in the frame of the last link of each leg; empty
            to find them in the tree or in the last link's mesh.
        masses: ``as-given``; ``geometry`` keeps each link's mass and spreads it over its box; or a
            preset or robot file whose links' masses and inertias are taken.
        total_mass: What the whole robot weighs on a scale [kg]: all masses are scaled to it.
        servo: Name of the servo; empty to take efforts and speeds from the file.
        packages: Folders by the name of the package that ``package://`` names.
        mesh_unit: Unit of mesh files: ``m`` or ``mm``; empty as the file says.
        strict: Whether anything that was ignored is an error.
    """

    foot: str = ""
    masses: str = "as-given"
    total_mass: float | None = None
    servo: str = ""
    packages: Mapping[str, str] = field(default_factory=dict)
    mesh_unit: str = ""
    strict: bool = False
