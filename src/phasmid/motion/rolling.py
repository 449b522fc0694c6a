"""Rolling of balls at the feet, in the stance of a planned walk on level ground."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from phasmid.gait import Gait
from phasmid.gait.gait import PHASE_TOLERANCE
from phasmid.kinematics import hip_from_body, joint_motion
from phasmid.kinematics.leg import angles_and_margin
from phasmid.motion.curves import Path
from phasmid.motion.trunk import TrunkMotion
from phasmid.robot import Robot

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

SAMPLES = 41
"""Samples of a stance, between which the way is a cubic spline."""

PASSES, CLOSE = 30, 1e-8
"""Most passes in which the way of rolling is fitted to the angles to which it leads, and the change
of the last one [m]. Each reduces the error to about the radius over the leg's length."""


@dataclass(frozen=True, eq=False)
class Rolling:
    """Way of the centres of balls that roll without slip, from their places at mid-stance.

    Attributes:
        ways: Way along and across by the own phase of a leg, in the axes of the body at mid-stance
            [m], of values (2, L).
        first: Own phase at the beginning of a stance; it ends at 1.
    """

    ways: PPoly
    first: float

    def at(
        self,
        phase: Float[np.ndarray, "time legs"],
        heading: Float[np.ndarray, "time legs"],
        period: float,
    ) -> Path:
        """Return the way in world axes with time derivatives, shape (N, L, 3).

        Args:
            phase: Own phase of each leg; before its stance that of the beginning.
            heading: Heading of the body at mid-stance [rad].
            period: Time of a cycle [s].
        """
        within = np.maximum(phase, self.first)
        middle = self.ways((1.0 + self.first) / 2)
        c, s = np.cos(heading), np.sin(heading)

        def order(n: int) -> np.ndarray:
            # Of the values of all legs at all phases, those of each leg at its own.
            x, y = np.einsum("clnl->cnl", self.ways(within, n)) / period**n
            if n == 0:
                x, y = x - middle[0], y - middle[1]
            return np.stack([c * x - s * y, s * x + c * y, np.zeros_like(x)], axis=-1)

        return Path(order(0), order(1), order(2))


def rolling(
    robot: Robot,
    gait: Gait,
    period: float,
    feet: Callable[[Float[np.ndarray, " time"], Rolling | None], tuple[TrunkMotion, Path]],
    heading: Callable[[Float[np.ndarray, " time"]], Float[np.ndarray, "time legs"]],
) -> Rolling | None:
    """Find how balls roll in a stance; all stances of a leg are alike.

    A ball of radius r that rolls with its tibia, of angular velocity w, over level ground of
    normal n has the velocity r w × n.

    Args:
        robot: The robot, L legs.
        gait: The gait.
        period: Time of a cycle [s].
        feet: Returns the trunk, and the feet in the body frame that roll in a given way.
        heading: Returns the heading of the body at mid-stance of each leg [rad], shape (N, L).

    Returns:
        The way; None where a foot is out of reach, or a ball too large for its leg.
    """
    # Lazy import: SciPy takes 0.2 s, and most robots have points.
    from scipy.interpolate import CubicSpline

    first = gait.swing_fraction
    phase = np.linspace(first, 1.0, SAMPLES)
    # The end of the stance belongs to the swing that follows, and so does what is close to it.
    last = 1.0 - 2 * PHASE_TOLERANCE
    times = (np.asarray(gait.offsets)[:, None] + np.minimum(phase, last)) * period
    turn = np.einsum("lml->lm", heading(times.ravel()).reshape(*times.shape, -1))
    c, s = np.cos(turn), np.sin(turn)
    found: Rolling | None = None
    for _ in range(PASSES):
        trunk, path = feet(times.ravel(), found)
        v = _velocity(robot, trunk, path)
        if not np.isfinite(v).all():
            return None
        x, y, _ = period * np.einsum("lmlk->klm", v.reshape(*times.shape, -1, 3))
        ways = CubicSpline(phase, np.stack([c * x + s * y, c * y - s * x]), axis=-1)
        before, found = found, Rolling(ways.antiderivative(), first)
        if before is not None and np.ptp(found.ways(phase) - before.ways(phase)) < CLOSE:
            return found
    return None


def _velocity(robot: Robot, trunk: TrunkMotion, feet: Path) -> Float[np.ndarray, "time legs 3"]:
    """Return the velocities of rolling balls in world axes [m/s]; NaN where out of reach."""
    p = hip_from_body(robot, feet.position)
    R_hip_body = np.swapaxes(robot.arrays.R_body_hip, -1, -2)
    v, a = (np.einsum("lij,nlj->nli", R_hip_body, order) for order in feet[1:])
    q, margin = angles_and_margin(robot.arrays, p)
    if not (margin > 0).all():
        return np.full_like(p, np.nan)
    qd, _ = joint_motion(robot.arrays, q, v, a)
    pitch, yaw = qd[..., 1] + qd[..., 2], q[..., 0]
    w_hip = np.stack([pitch * np.sin(yaw), -pitch * np.cos(yaw), qd[..., 0]], axis=-1)
    w_body = np.einsum("lij,nlj->nli", robot.arrays.R_body_hip, w_hip)
    w = np.einsum("nij,nlj->nli", trunk.rotation, w_body) + trunk.angular_velocity[:, None]
    return robot.foot_radius * np.stack([w[..., 1], -w[..., 0], np.zeros_like(yaw)], axis=-1)
