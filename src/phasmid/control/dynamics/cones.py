"""Foot forces within friction and torque limits at one instant, by one quadratic programme."""

from __future__ import annotations

import math

import daqp
import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled, internal
from phasmid.control.dynamics.instant import find_needs, needs_in, unpack
from phasmid.control.dynamics.sharing import (
    demand_of,
    friction_needed,
    grasp_of,
    load_joints,
    space_in,
)
from phasmid.control.memory import unwrapped
from phasmid.control.views import take

FACES = 8
"""Faces of the pyramid inside each friction cone; its edges lie on the cone."""

WITHIN = math.cos(math.pi / FACES)
"""How far such a pyramid's faces are inside."""

DEARER = 1e3
"""What leaving out all of the motion costs beside forces of the size of the load."""

BOX, EQUATION = 0, 5
"""The solver's words for a limit and for an equation."""

UNBOUNDED = 1e30
"""What the solver takes for infinity."""


NEGLIGIBLE = 1e-9
"""A foot with a smaller share than this carries nothing."""


@internal
def programme_size(feet: int) -> tuple[int, int]:
    """Unknowns and rows of a programme: three and eleven a foot, one and six beside them."""
    return 3 * feet + 1, (FACES + 3) * feet + 6


@internal
def programme_in(
    row: np.ndarray, feet: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Views of a programme that lies in one row: its matrix, lower and upper bounds, and W."""
    size, rows = programme_size(feet)
    A, a = take(row, 0, (rows, size))
    lower, a = take(row, a, (size + rows,))
    upper, a = take(row, a, (size + rows,))
    W, a = take(row, a, (feet, 3, 3))
    return A, lower, upper, W


class Programme:
    """The programme of a number of feet that carry something: min |y|² + s² and more for s.

    Unknowns are y of F = cheapest + W y, and s, the part of the motion that is left out.

    Args:
        feet: How many.

    Attributes:
        row: What `write_programme` fills.
    """

    def __init__(self, feet: int) -> None:
        self._feet = feet
        size, rows = unwrapped(programme_size)(feet)
        self.row = np.zeros((rows + 2) * size + 2 * rows + 9 * feet)
        self._A, self._lower, self._upper, _ = unwrapped(programme_in)(self.row, feet)
        self._square, self._cost = np.eye(size), np.zeros(size)
        self._cost[-1] = DEARER
        self._kinds = np.zeros(size + rows, np.int32)
        self._kinds[size : size + 6] = EQUATION
        self._model: daqp.Model | None = None

    def __reduce__(self) -> tuple[type[Programme], tuple[int]]:
        """A copy is made anew: its views are of its own row, and the solver has no copies."""
        return Programme, (self._feet,)

    def solve(self) -> Float[np.ndarray, " unknowns"] | None:
        """The unknowns; None where nothing keeps the limits."""
        rows = self._A, self._upper, self._lower, self._kinds
        if self._model is None:
            # One that goes on is given the kinds anew, and so begins as if it were new.
            model = daqp.Model()
            flag, _ = model.setup(self._square, self._cost, *rows)
            if flag < 0:
                return None
            self._model = model
        elif self._model.update(None, None, *rows) < 0:
            # It would go on with the limits of before.
            self._model = None
            return None
        x, _, flag, _ = self._model.solve()
        return x if flag > 0 else None


@compiled
def write_programme(
    masses: np.ndarray,
    numbers: np.ndarray,
    friction: float,
    R: np.ndarray,
    q: np.ndarray,
    share: np.ndarray,
    normals: np.ndarray,
    work: np.ndarray,
    rest: np.ndarray,
    row: np.ndarray,
    count: int,
) -> float:
    """Write the programme for forces near the cheapest that keep friction and torque limits.

    Args:
        masses: Of the robot, packed.
        numbers: Of the `FeedForward`.
        friction: Coefficient that may be used; the pyramid inside its cone is kept to.
        R: Rotation of the trunk, shape (3, 3).
        q: Joint angles [rad], shape (L, 3).
        share: Each foot's part of its full share, shape (L,).
        normals: Of the ground, shape (L, 3).
        work: With what `find_effort` found.
        rest: Written: needs of the robot in the same pose without any motion, in one row.
        row: Written: of the `Programme`.
        count: Feet that carry something.

    Returns:
        The load of the robot at rest, by which all forces are counted [N].
    """
    legs = q.shape[0]
    needs, still = needs_in(work, legs), needs_in(rest, legs)
    D, _, limits, cheapest, _ = space_in(work, legs)
    nothing, felt, rates = np.zeros(3), np.zeros(3), np.zeros((legs, 3))
    felt[2] = numbers[0]
    find_needs(unpack(masses, legs), R, nothing, nothing, felt, q, rates, rates, still)
    scale = 0.0
    for i in range(3):
        scale = max(scale, abs(still.wrench[i]))
    if not scale > 0.0:
        return 0.0
    A, lower, upper, W = programme_in(row, count)
    A[:] = 0.0
    lower[:] = -UNBOUNDED
    last, inside = 3 * count, friction * WITHIN
    upper[:last] = UNBOUNDED
    lower[last], upper[last] = 0.0, 1.0
    first = last + 1
    grasp = np.zeros((6, 3))
    # What is left out of the wrench is no longer to be given.
    reach = 1e-9
    for leg in range(legs):
        for i in range(3):
            if share[leg] >= NEGLIGIBLE:
                reach = max(reach, abs(needs.foot[leg, i]))
    for i in range(6):
        unit = 1.0 if i < 3 else 1.0 / reach
        A[i, last] = unit * (needs.wrench[i] - still.wrench[i]) / scale
        lower[first + i] = upper[first + i] = 0.0
    k, t, u = -1, np.empty(3), np.empty(3)
    for foot in range(legs):
        if not share[foot] >= NEGLIGIBLE:
            continue
        k += 1
        _root_of(D[foot], W[k])
        grasp_of(needs.foot[foot], 1.0 / reach, grasp)
        for i in range(6):
            for j in range(3):
                for m in range(3):
                    A[i, 3 * k + j] += grasp[i, m] * W[k, m, j]
        n = normals[foot]
        _tangents_of(n, t, u)
        for face in range(FACES):
            at = 6 + FACES * k + face
            c, s = math.cos(2 * math.pi * face / FACES), math.sin(2 * math.pi * face / FACES)
            now = 0.0
            for i in range(3):
                side = c * t[i] + s * u[i] - inside * n[i]
                now += side * cheapest[foot, i] / scale
                for j in range(3):
                    A[at, 3 * k + j] += side * W[k, i, j]
            upper[first + at] = -now
        for joint in range(3):
            at = 6 + FACES * count + 3 * k + joint
            now = needs.torque[foot, joint]
            for i in range(3):
                J = needs.jacobian[foot, i, joint]
                now -= J * cheapest[foot, i]
                for j in range(3):
                    A[at, 3 * k + j] -= J * W[k, i, j]
            A[at, last] = (still.torque[foot, joint] - needs.torque[foot, joint]) / scale
            lower[first + at] = (limits[0, foot, joint] - now) / scale
            upper[first + at] = (limits[1, foot, joint] - now) / scale
    return scale


@compiled
def take_solution(
    x: np.ndarray,
    part: float,
    scale: float,
    share: np.ndarray,
    normals: np.ndarray,
    work: np.ndarray,
    rest: np.ndarray,
    row: np.ndarray,
    count: int,
) -> tuple[float, float]:
    """Write the forces and torques that a solution means in the place of the cheapest.

    Args:
        x: The unknowns.
        part: How much of the motion they give.
        scale: What `write_programme` returned [N].
        share: As there.
        normals: As there.
        work: As there, changed.
        rest: As there.
        row: As there.
        count: As there.

    Returns:
        The friction that they need, and the largest torque as a part of what its servo gives.
    """
    legs, k = share.shape[0], -1
    needs, still = needs_in(work, legs), needs_in(rest, legs)
    _, _, limits, force, torque = space_in(work, legs)
    W = programme_in(row, count)[3]
    for foot in range(legs):
        if not share[foot] >= NEGLIGIBLE:
            force[foot] = 0.0
            continue
        k += 1
        for i in range(3):
            for j in range(3):
                force[foot, i] += scale * W[k, i, j] * x[3 * k + j]
    load_joints(needs, force, torque)
    for leg in range(legs):
        for i in range(3):
            torque[leg, i] += (1.0 - part) * (still.torque[leg, i] - needs.torque[leg, i])
    return friction_needed(force, normals, share), demand_of(torque, limits)


@internal
def _tangents_of(n: np.ndarray, t: np.ndarray, u: np.ndarray) -> None:
    """Two tangents of a normal, the first from the axis that lies farthest from it."""
    least = 0
    for i in range(1, 3):
        if abs(n[i]) < abs(n[least]):
            least = i
    for i in range(3):
        t[i] = (1.0 if i == least else 0.0) - n[least] * n[i]
    length = math.sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
    for i in range(3):
        t[i] /= length
    u[0], u[1] = n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2]
    u[2] = n[0] * t[1] - n[1] * t[0]


@internal
def _root_of(D: np.ndarray, W: np.ndarray) -> None:
    """W with W Wᵀ = D, of a positive 3 x 3 matrix."""
    W[:] = 0.0
    W[0, 0] = math.sqrt(D[0, 0])
    W[1, 0], W[2, 0] = D[1, 0] / W[0, 0], D[2, 0] / W[0, 0]
    W[1, 1] = math.sqrt(D[1, 1] - W[1, 0] * W[1, 0])
    W[2, 1] = (D[2, 1] - W[2, 0] * W[1, 0]) / W[1, 1]
    W[2, 2] = math.sqrt(D[2, 2] - W[2, 0] * W[2, 0] - W[2, 1] * W[2, 1])
