"""Explanation of a foot position: what keeps a leg from it, and the nearest one in reach."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.arguments import numbers
from phasmid.errors import InvalidInput
from phasmid.kinematics.leg import angles_and_margin, foot_position
from phasmid.kinematics.workspace import LIMIT_TOLERANCE, usable_limits
from phasmid.robot import JOINTS, Leg

GRID = 61
"""Angles of femur and of tibia that each round of the search for the nearest position looks at."""

ROUNDS, NARROWING = 14, 0.2
"""Rounds of the search, and width of the next grid over that of the last: to 1e-9 rad."""

AT_LIMIT = 1e-6
"""Distance from a limit up to which an angle of the nearest position is on it [rad]."""

TIBIA = JOINTS.index("tibia")

LEAST_OUT = 1e-6
"""Least distance of the nearest foot position from the coxa axis, in lengths of the leg; on the
axis the coxa's angle is undefined."""


@dataclass(frozen=True)
class Violation:
    """A joint angle or a distance that a foot position needs, outside its limits.

    Attributes:
        what: ``coxa``, ``femur`` or ``tibia``; ``reach``: the distance of the foot from the femur
            axis; ``offset``: its distance from the coxa axis, for a leg with a lateral offset.
        needed: The angle [rad] or distance [m] that the foot position needs.
        lowest: Lower limit [rad or m].
        highest: Upper limit [rad or m].
        bound: Posture of the tibia at the limit of a reach, in words.
    """

    what: str
    needed: float
    lowest: float
    highest: float
    bound: str = ""

    @property
    def is_angle(self) -> bool:
        """It is the angle of a joint."""
        return self.what in JOINTS

    @property
    def excess(self) -> float:
        """Distance from the nearer limit, 0 or more [rad or m]."""
        return max(self.lowest - self.needed, self.needed - self.highest, 0.0)

    @property
    def reason(self) -> str:
        """The violation in words that follow the name of a leg."""
        is_low = self.needed < self.lowest
        side, limit = ("near", self.lowest) if is_low else ("far", self.highest)
        if self.is_angle:
            needed, excess, end = map(math.degrees, (self.needed, self.excess, limit))
            return f"its {self.what} would turn to {needed:.1f}°, {excess:.1f}° beyond {end:.4g}°"
        axis = "femur" if self.what == "reach" else "coxa"
        bound = f", {self.bound}" if self.bound else ""
        return (
            f"the foot would be {1000 * self.needed:.1f} mm from the {axis} axis, "
            f"{1000 * self.excess:.1f} mm too {side}: the limit is {1000 * limit:.1f} mm{bound}"
        )


@dataclass(frozen=True, eq=False)
class FootExplanation:
    """Whether a leg can place its foot at a position, what keeps it from it, and the nearest.

    Attributes:
        leg: The leg.
        wanted: The foot position in the hip frame [m], shape (3,).
        q: Joint angles that it needs [rad], shape (3,); NaN where no angles reach it.
        violations: What is outside its limits; empty where the position is possible.
        nearest_q: Joint angles of the nearest possible position [rad], shape (3,); NaN where the
            joint limits permit no position.
        nearest: The nearest possible position in the hip frame [m], shape (3,).
    """

    leg: Leg
    wanted: Float[np.ndarray, "3"]
    q: Float[np.ndarray, "3"]
    violations: tuple[Violation, ...]
    nearest_q: Float[np.ndarray, "3"]
    nearest: Float[np.ndarray, "3"]

    @property
    def is_possible(self) -> bool:
        """The leg can place its foot there, within its joint limits."""
        return not self.violations

    @property
    def distance(self) -> float:
        """Distance of the nearest possible position from the wanted one [m]."""
        return float(np.linalg.norm(self.nearest - self.wanted))

    @property
    def margin(self) -> tuple[str, float]:
        """The joint nearest to a limit at the nearest possible position, and how near [rad].

        A tibia in line with the femur counts as a limit: the leg is stretched.
        """
        joint, side = self._nearest_limit
        return JOINTS[joint], float(self._room[joint, side])

    @property
    def _room(self) -> Float[np.ndarray, "3 2"]:
        """Angles from the nearest possible position to both limits of each joint [rad]."""
        return np.abs(self.nearest_q[:, None] - usable_limits(self.leg))

    @property
    def _nearest_limit(self) -> tuple[int, int]:
        """Joint and side, 0 low and 1 high, of the nearest limit."""
        joint, side = divmod(int(np.argmin(self._room)), 2)
        return joint, side

    @property
    def margin_words(self) -> str:
        """The nearest limit: ``tibia at -51.0°, 39.0° from its limit of -90°``."""
        joint, side = self._nearest_limit
        room = math.degrees(self._room[joint, side])
        angle = math.degrees(self.nearest_q[joint])
        limit = limit_words(self.leg, joint, side)
        return f"{JOINTS[joint]} at {angle:z.1f}°, {room:.1f}° from {limit}"

    @property
    def binding(self) -> tuple[str, ...]:
        """The limits at the nearest possible position, in words; empty where that is the wanted."""
        if self.is_possible:
            return ()
        return tuple(
            f"the {JOINTS[joint]} at {limit_words(self.leg, joint, side)}"
            for joint, side in np.argwhere(self._room < AT_LIMIT).tolist()
        )

    @property
    def sentence(self) -> str:
        """The explanation in one sentence or two."""
        name = self.leg.name
        if self.is_possible:
            return (
                f"{name} can place its foot there; nearest to a limit is its {self.margin_words}."
            )
        reasons = "; ".join(violation.reason for violation in self.violations)
        if not math.isfinite(self.distance):
            return f"{name} cannot place its foot anywhere within its joint limits: {reasons}."
        binding = f", with {' and '.join(self.binding)}" if self.binding else ""
        return (
            f"{name} cannot place its foot there: {reasons}. "
            f"The nearest possible position is {1000 * self.distance:.1f} mm away{binding}."
        )


def limit_words(leg: Leg, joint: int, side: int) -> str:
    """Return the lower (side 0) or upper limit of a joint in words."""
    own, usable = leg.joint_limits[joint, side], usable_limits(leg)[joint, side]
    if own == usable:
        return f"its limit of {math.degrees(own):.4g}°"
    return "the stretched leg" if joint == TIBIA and side == 1 else "half a turn"


def explain_foot(leg: Leg, p_hip_foot: object) -> FootExplanation:
    """Explain whether a leg can place its foot at a position.

    Possible is what `within_reach` is: knee up, leg outwards, within the joint limits.

    Args:
        leg: The leg.
        p_hip_foot: Foot in the leg's hip frame [m], shape (3,).

    Raises:
        InvalidInput: The position is not three finite numbers.
    """
    wanted = numbers(p_hip_foot, "foot")
    if wanted.shape != (3,) or not np.isfinite(wanted).all():
        raise InvalidInput(f"foot is {p_hip_foot}; it must be three finite numbers, x, y and z.")
    violations = foot_violations(leg, wanted)
    q, margin = angles_and_margin(leg, wanted)
    nearest_q = nearest_angles(leg, wanted) if violations else q
    return FootExplanation(
        leg,
        wanted,
        q if margin > 0 else np.full(3, np.nan),
        violations,
        nearest_q,
        foot_position(leg, nearest_q) if violations else wanted,
    )


def foot_violations(leg: Leg, p_hip_foot: Float[np.ndarray, "3"]) -> tuple[Violation, ...]:
    """Return the limits that a foot in the hip frame [m] violates; none where it is possible."""
    q, margin = angles_and_margin(leg, p_hip_foot)
    violations = []
    if not margin > 0:
        violations = _distance_violations(leg, p_hip_foot)
        # The angle of the coxa does not depend on the reach; nearer than the offset there is none.
        q = q[: 0 if violations[0].what == "offset" else 1]
    for joint, angle, (low, high) in zip(JOINTS, q, leg.joint_limits, strict=False):
        if not low - LIMIT_TOLERANCE <= angle <= high + LIMIT_TOLERANCE:
            violations.append(Violation(joint, float(angle), float(low), float(high)))
    return tuple(violations)


def _distance_violations(leg: Leg, foot: np.ndarray) -> list[Violation]:
    """Return the distance by which a foot is too far or too near for the lengths of the links."""
    coxa, femur, tibia = leg.lengths.tolist()
    aside, offset = math.hypot(foot[0], foot[1]), abs(float(leg.lateral_offsets.sum()))
    if aside < offset:
        return [Violation("offset", aside, offset, math.inf)]
    out = math.sqrt(aside**2 - offset**2) - coxa
    # The distance grows as the knee stretches: the limits of the tibia bound it.
    low, high = usable_limits(leg)[TIBIA]
    bent, stretched = (
        math.sqrt(femur**2 + tibia**2 + 2 * femur * tibia * math.cos(angle))
        for angle in (low, high)
    )
    far = math.hypot(out, foot[2])
    bound = f"with the tibia at {limit_words(leg, TIBIA, 0 if far < bent else 1)}"
    return [Violation("reach", far, bent, stretched, bound)]


def nearest_angles(leg: Leg, p_hip_foot: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    """Return the joint angles of the possible foot position nearest to a wanted one.

    The search looks at a grid of angles of femur and tibia within their limits, and again and again
    at a finer grid around the best of them.

    Args:
        leg: The leg.
        p_hip_foot: Wanted foot in the hip frame [m], shape (3,).

    Returns:
        Joint angles [rad], shape (3,); NaN where the joint limits permit no position.
    """
    limits = usable_limits(leg)
    best, (low, high) = np.full(3, np.nan), limits[1:].T
    if not (limits[:, 0] <= limits[:, 1]).all():
        return best
    for _ in range(ROUNDS):
        femur, tibia = np.linspace(low, high, GRID, axis=1)
        q, square = _turned(leg, p_hip_foot, *np.meshgrid(femur, tibia, indexing="ij"))
        place = np.unravel_index(int(np.argmin(square)), square.shape)
        if not np.isfinite(square[place]):
            break
        best = q[place]
        around = NARROWING / 2 * (high - low)
        low = np.maximum(best[1:] - around, limits[1:, 0])
        high = np.minimum(best[1:] + around, limits[1:, 1])
    return best


def _turned(
    leg: Leg, wanted: np.ndarray, femur: np.ndarray, tibia: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return joint angles with the best angle of the coxa, and squares of the distance [m²].

    The best angle points to the wanted foot, or is a limit. Feet behind the coxa axis do not count.
    """
    straight = foot_position(leg, np.stack([np.zeros_like(femur), femur, tibia], axis=-1))
    low, high = usable_limits(leg)[0]
    turn = math.atan2(wanted[1], wanted[0]) - np.arctan2(straight[..., 1], straight[..., 0])
    turn = np.arctan2(np.sin(turn), np.cos(turn))
    turns = np.stack([np.clip(turn, low, high), np.full_like(turn, low), np.full_like(turn, high)])
    q = np.stack(np.broadcast_arrays(turns, femur, tibia), axis=-1)
    square = np.sum((foot_position(leg, q) - wanted) ** 2, axis=-1)
    square[:, straight[..., 0] < LEAST_OUT * leg.lengths.sum()] = np.inf
    best = np.argmin(square, axis=0)[None]
    q = np.take_along_axis(q, best[..., None], axis=0)[0]
    return q, np.take_along_axis(square, best, axis=0)[0]
