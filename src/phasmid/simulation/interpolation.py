"""What joints do between two updates of their controller."""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.control import JointTargets
from phasmid.errors import InvalidInput, nearest
from phasmid.simulation.drives import Setpoints

Between: TypeAlias = Literal["hold", "linear", "cubic"]
"""How targets are filled in between updates.

``hold``: the angles stay until the next update, as on a servo's bus; ``linear``: they go on with
the targets' speeds; ``cubic``: joints go from the last targets to the new ones, which they reach
with the targets' speeds as the next update comes.
"""

_USUAL: dict[str, Between] = {"prescribed": "cubic", "torque": "linear"}
"""By a drive's name, where it is not ``hold``."""


def between_updates(drive: str, between: str | None) -> Between:
    """How targets are filled in with a drive.

    Args:
        drive: Its name.
        between: What was asked for; None: ``cubic`` for prescribed joints, which would be torn by
            a staircase, ``linear`` for torques, ``hold`` for servos.

    Raises:
        InvalidInput: There is no such way, or it is none for prescribed joints.
    """
    if between is None:
        return _USUAL.get(drive, "hold")
    ways = get_args(Between)
    if between not in ways:
        guess = nearest(str(between), ways)
        raise InvalidInput(
            f'between is "{between}"; it must be {", ".join(ways[:-1])} or {ways[-1]}.',
            hint=f'"{guess}"' if guess else "",
        )
    if drive == "prescribed" and between != "cubic":
        raise InvalidInput(
            f'between is "{between}" and drive "prescribed"; joints that follow exactly cannot '
            "follow steps.",
            hint='between = "cubic", or drive = "ideal-servo"',
        )
    return between  # type: ignore[return-value]


class SetpointInterpolator:
    """Fills in targets for all steps of one period.

    Args:
        between: How.
        steps: Number of steps from one update to the next.
        dt: Time step [s].
        q: Angles from which the joints begin [rad], shape (L, 3).
        qd: Speeds with which they begin [rad/s], shape (L, 3).

    Attributes:
        weights: What each step takes of both ends, as `fill_setpoints` has it.
        ends: Angles and speeds of the last targets but one, then of the last, shape (4, 3 L).
    """

    def __init__(
        self,
        between: Between,
        steps: int,
        dt: float,
        q: Float[np.ndarray, "legs 3"],
        qd: Float[np.ndarray, "legs 3"],
    ) -> None:
        self._shape = (3, steps, *q.shape)
        period = steps * dt
        self.weights = _weights(between, np.arange(steps) / steps, period)
        self._torque = np.zeros(self._shape[1:])
        self._ends = np.stack([q, qd, q, qd])
        # The same memory, as it is multiplied.
        self.ends = self._ends.reshape(4, -1)

    def setpoints(
        self, targets: JointTargets, rows: Float[np.ndarray, "3 steps legs 3"] | None = None
    ) -> Setpoints:
        """What the joints do at each step from an update to before the next.

        Args:
            targets: Of that update.
            rows: Takes angles, speeds and accelerations at each step, shape (3, steps, L, 3).
        """
        ends = self._ends
        ends[:2] = ends[2:]
        ends[2], ends[3] = targets.position, targets.velocity
        rows = np.empty(self._shape) if rows is None else rows
        compiled(fill_setpoints)(self.weights, self.ends, rows.reshape(3, len(rows[0]), -1))
        torque = None
        if targets.torque is not None:
            torque = self._torque
            torque[:] = targets.torque
        return Setpoints(rows[0], rows[1], rows[2], torque)

    @property
    def last(self) -> JointTargets:
        """What was asked last, or where the joints began."""
        return JointTargets(self._ends[2].copy(), self._ends[3].copy())


def fill_setpoints(
    weights: Float[np.ndarray, "rows 4"],
    ends: Float[np.ndarray, "4 joints"],
    rows: Float[np.ndarray, "3 steps joints"],
) -> None:
    """Write angles, speeds and accelerations between two targets.

    Args:
        weights: What each step's take of the ends: all angles, then speeds, then accelerations.
        ends: Angles and speeds at the beginning, then at the end.
        rows: Written.
    """
    steps = rows.shape[1]
    for row in range(weights.shape[0]):
        a, b, c, d = weights[row, 0], weights[row, 1], weights[row, 2], weights[row, 3]
        for j in range(ends.shape[1]):
            value = a * ends[0, j] + b * ends[1, j] + c * ends[2, j] + d * ends[3, j]
            rows[row // steps, row % steps, j] = value


def _weights(
    between: Between, s: Float[np.ndarray, " steps"], period: float
) -> Float[np.ndarray, "rows 4"]:
    """What angles, then speeds, then accelerations take of the last angle and speed, and the new.

    Args:
        between: How targets are filled in.
        s: Part of the period that has passed at each step.
        period: From an update to the next [s].
    """
    zero, one, T = np.zeros_like(s), np.ones_like(s), period
    if between == "hold":
        # Joints stay, but the speeds are told: what a motion takes at a speed depends on it.
        rows = [[zero, zero, one, zero], [zero, zero, zero, one], [zero] * 4]
    elif between == "linear":
        rows = [[zero, zero, one, T * s], [zero, zero, zero, one], [zero] * 4]
    else:
        # Hermite's cubic and its derivatives.
        rows = [
            [
                1 - 3 * s**2 + 2 * s**3,
                T * (s - 2 * s**2 + s**3),
                3 * s**2 - 2 * s**3,
                T * (s**3 - s**2),
            ],
            [
                (6 * s**2 - 6 * s) / T,
                1 - 4 * s + 3 * s**2,
                (6 * s - 6 * s**2) / T,
                3 * s**2 - 2 * s,
            ],
            [
                (12 * s - 6) / T**2,
                (6 * s - 4) / T,
                (6 - 12 * s) / T**2,
                (6 * s - 2) / T,
            ],
        ]
    return np.concatenate([np.stack(row, axis=-1) for row in rows])
