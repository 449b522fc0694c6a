"""Rigid links, checked for physical plausibility."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid import units
from phasmid.arguments import check_fields, numbers
from phasmid.errors import InvalidInput, InvalidRobot
from phasmid.units import plain_number

LONGEST_LENGTH = 2.0
"""Lengths above this are slips of the unit, not walking robots [m]."""

BESIDE = 0.2
"""Distance from a short link at which its motor may be, as beside the hips of quadrupeds [m]."""

SMALLEST_MASS = 1e-12
"""Masses below this are those of no part that can be seen [kg]."""

LARGEST_MASS = 200.0
"""Masses above this are slips of the unit, not parts of walking robots [kg]."""


def frozen_array(values: object, shape: tuple[int, ...], what: str) -> np.ndarray:
    """Return a read-only array of floats of a shape, or refuse it in a sentence."""
    try:
        array = numbers(values, what)
    except InvalidInput as error:
        raise InvalidRobot(error.what) from None
    if array.shape != shape:
        raise InvalidRobot(f"{what} has shape {array.shape}; it must have shape {shape}.")
    if not np.all(np.isfinite(array)):
        raise InvalidRobot(f"{what} is {_list(array)}; every number must be finite.")
    array.flags.writeable = False
    return array


def _list(array: np.ndarray) -> str:
    return ", ".join(f"{v:.4g}" for v in array.ravel())


def check_length(value: float, what: str, key: str, *, may_be_zero: bool = False) -> None:
    """Refuse a length that is not finite, not positive or not a walking robot's."""
    if not math.isfinite(value):
        raise InvalidRobot(f"{what} is {value}; it must be a finite number.")
    if value < 0 or (value == 0 and not may_be_zero):
        least = "0 or more" if may_be_zero else "greater than 0"
        raise InvalidRobot(f"{what} is {units.text(value, 'mm')}; it must be finite and {least}.")
    if value > LONGEST_LENGTH:
        raise InvalidRobot(
            f"{what} is {value:.4g} m; lengths above {LONGEST_LENGTH:g} m are refused.",
            hint=f"{key}_mm = {value:.4g}" if value <= 1000 * LONGEST_LENGTH else "",
        )


def check_mass(value: float, what: str) -> None:
    """Refuse a mass that is not finite, not positive or not a walking robot's."""
    if not math.isfinite(value):
        raise InvalidRobot(f"{what} is {value}; it must be a finite number.")
    if value <= 0:
        raise InvalidRobot(f"{what} is {value:.4g} kg; it must be greater than 0.")
    if value < SMALLEST_MASS:
        raise InvalidRobot(f"{what} is {value:.4g} kg; it must be {SMALLEST_MASS:g} kg or more.")
    if value > LARGEST_MASS:
        raise InvalidRobot(
            f"{what} is {value:.4g} kg; masses above {LARGEST_MASS:g} kg are refused.",
            hint=f"mass_g = {value:.4g}" if value <= 1000 * LARGEST_MASS else "",
        )


def check_inertia(
    inertia: Float[np.ndarray, "3 3"], mass: float, size: float, what: str, long: str
) -> None:
    """Refuse an inertia that no rigid body of this mass and size can have.

    Args:
        inertia: About the centre of mass [kg·m²].
        mass: Mass [kg].
        size: The body's longest measure [m].
        what: Name of the body, for the message.
        long: The body in the message of a wrong gyration radius, such as "52 mm link".
    """
    # Unlike NumPy's, Python's own numbers become infinite without a warning.
    tensor = inertia.tolist()
    for i, j, names in ((0, 1, "xy"), (0, 2, "xz"), (1, 2, "yz")):
        if abs(tensor[i][j] - tensor[j][i]) > 1e-9 * np.abs(inertia).max():
            raise InvalidRobot(
                f"{what}: inertia is not symmetric; I_{names} is {tensor[i][j] * 1e9:.4g} "
                f"and I_{names[::-1]} is {tensor[j][i] * 1e9:.4g} g mm^2."
            )
    principal = np.linalg.eigvalsh(inertia)
    moments, listed = principal.tolist(), _list(principal)
    if moments[0] <= 0:
        raise InvalidRobot(
            f"{what}: principal moments {listed} kg m^2 are not all positive; "
            "a rigid body's must be greater than 0."
        )
    # Round-off of a flat plate, for which the largest equals the sum of the others.
    if moments[2] > (moments[0] + moments[1]) * (1 + 1e-9):
        raise InvalidRobot(
            f"{what}: principal moments {listed} kg m^2 cannot belong to a rigid body; "
            "the largest may not exceed the sum of the others."
        )
    radius = math.sqrt(moments[2] / mass)
    if not size / 50 <= radius <= 1.5 * size:
        raise InvalidRobot(
            f"{what}: inertia {moments[2]:.2g} kg m^2 gives a gyration radius of "
            f"{plain_number(1000 * radius, 2)} mm for a {long}; it must lie between "
            f"{plain_number(20 * size, 2)} and {plain_number(1500 * size, 2)} mm.",
            hint="check the unit: inertia_g_mm2 or inertia_kg_m2",
        )


def solid_box(size: Sequence[float], mass: float) -> Float[np.ndarray, "3 3"]:
    """Return the inertia of a solid box about its centre, in its axes [kg·m²], shape (3, 3).

    Args:
        size: Its sides along x, y and z [m].
        mass: Mass [kg].
    """
    # Python's floats overflow without a warning.
    a, b, c = (float(side) * float(side) for side in size)
    mass = float(mass)
    return np.diag([(b + c) * mass / 12, (a + c) * mass / 12, (a + b) * mass / 12])


@dataclass(frozen=True, eq=False)
class Link:
    """Coxa, femur or tibia in its Denavit-Hartenberg frame (x along the link).

    Attributes:
        name: ``coxa``, ``femur`` or ``tibia``.
        length: From its own joint axis to the next one, or to the foot [m]; 0 for a coxa whose
            axis meets the femur's.
        mass: Mass [kg].
        com: Centre of mass in the link's frame [m], shape (3,).
        inertia: About the centre of mass, in the axes of the link's frame [kg·m²], shape (3, 3).
            Off-diagonal entries are those of the tensor.
        lateral_offset: From the link's plane to the origin of the next link's frame, or to the
            foot, along the femur's axis and positive to the leg's left [m].

    Raises:
        InvalidRobot: No body can have these numbers.

    Source: Table 2 for the paper's robot; axes as Table 1.
    """

    name: str
    length: float
    mass: float
    com: Float[np.ndarray, "3"]
    inertia: Float[np.ndarray, "3 3"]
    lateral_offset: float = 0.0

    def __post_init__(self) -> None:
        what = f"link {self.name}"
        check_fields(self, f"{what}: ", InvalidRobot)
        check_length(self.length, f"{what}: length", "length", may_be_zero=self.name == "coxa")
        if not abs(self.lateral_offset) <= LONGEST_LENGTH:
            raise InvalidRobot(
                f"{what}: lateral offset is {self.lateral_offset:.4g} m; it must be within "
                f"{LONGEST_LENGTH:g} m.",
                hint=f"lateral_offset_mm = {self.lateral_offset:.4g}"
                if abs(self.lateral_offset) <= 1000 * LONGEST_LENGTH
                else "",
            )
        check_mass(self.mass, f"{what}: mass")
        object.__setattr__(self, "com", frozen_array(self.com, (3,), f"{what}: com"))
        object.__setattr__(self, "inertia", frozen_array(self.inertia, (3, 3), f"{what}: inertia"))
        # Servos are beside a short link: their size is the least bound.
        size = max(math.hypot(self.length, self.lateral_offset), 0.04)
        # Unlike a norm of NumPy, hypot does not overflow.
        offset = math.dist(self.com, (self.length / 2, 0.0, 0.0))
        if offset > 1.5 * size + BESIDE:
            raise InvalidRobot(
                f"{what}: centre of mass lies {math.hypot(*self.com):.2g} m "
                f"from a {self.length:.2g} m link.",
                hint="check the unit: com_mm or com_m",
            )
        check_inertia(
            self.inertia, self.mass, size, what, f"{plain_number(1000 * self.length, 3)} mm link"
        )

    @property
    def end(self) -> Float[np.ndarray, "3"]:
        """Origin of the next link's frame, or the foot, in the link's own frame [m], shape (3,)."""
        left = self.lateral_offset
        # The axes of femur and tibia are to the leg's right.
        beside = (left, 0.0) if self.name == "coxa" else (0.0, -left)
        return np.array([self.length, *beside])
