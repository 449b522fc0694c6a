"""What a person adds to a file that does not say all that a walking robot needs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from phasmid.arguments import check_number, check_type, described
from phasmid.errors import InvalidInput


@dataclass(frozen=True)
class ImportOptions:
    """How a robot is read from URDF, MJCF or STEP.

    Attributes:
        foot: Where the feet are: name of a link or its ending, such as ``foot_link``; or three
            numbers such as ``0,0,-0.13``, metres in the frame of the last link of each leg; or
            such a place for each leg by number, range or name, as
            ``1-3=0,0,-0.13; left_front=foot_link``; empty to find them in the tree or in the last
            link's mesh.
        masses: ``as-given``; ``geometry`` keeps each link's mass and spreads it over its box; or a
            preset or robot file whose links' masses and inertias are taken.
        total_mass: What the whole robot weighs on a scale [kg]: all masses are scaled to it.
        servo: Name of the servo; empty to take efforts and speeds from the file.
        packages: Folders by the name of the package that ``package://`` names.
        mesh_unit: Unit of mesh files: ``m`` or ``mm``; empty as the file says.
        strict: Whether anything that was ignored is an error.

    Raises:
        InvalidInput: A value is of a wrong kind, or none that can be.
    """

    foot: str = ""
    masses: str = "as-given"
    total_mass: float | None = None
    servo: str = ""
    packages: Mapping[str, str] = field(default_factory=dict)
    mesh_unit: str = ""
    strict: bool = False

    def __post_init__(self) -> None:
        for name in ("foot", "masses", "servo", "mesh_unit"):
            check_type(name, getattr(self, name), (str,), "text")
        check_type("strict", self.strict, (bool,), "true or false")
        check_type("packages", self.packages, (Mapping,), "folders by the names of packages")
        for name, folder in self.packages.items():
            check_type("a name in packages", name, (str,), "text")
            check_type(f'packages["{name}"]', folder, (str,), "a folder's path, as text")
        if self.mesh_unit not in ("", "m", "mm"):
            raise InvalidInput(
                f'mesh_unit is {described(self.mesh_unit)}; it must be "m" or "mm".',
                hint="--mesh-unit mm",
            )
        if self.total_mass is not None:
            check_number("total_mass", self.total_mass)
            if not (math.isfinite(self.total_mass) and self.total_mass > 0):
                raise InvalidInput(
                    f"the total mass is {self.total_mass:g} kg; "
                    "it must be finite and greater than 0.",
                    where="option --total-mass-g",
                )
