"""The engine's stage of dynamics: what torques its motion takes, and slower where it takes more."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.control.dynamics.effort import Effort, FeedForward
from phasmid.control.dynamics.settings import EffortSettings
from phasmid.control.state import STANCE, WALKING, Order, State
from phasmid.robot import Robot

LEAST = 1e-3
"""Share of a foot that has just landed: where it is with others like it, they carry all."""

SLOWER, FASTER = 2.0, 0.25
"""How fast the velocity is taken back while it cannot be had, and given again [1/s]."""


@compiled
def _smooth(x: float) -> float:
    """From 0 to 1 with no slope nor bend at either end."""
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


@compiled
def fill_shares(
    codes: np.ndarray,
    clock: np.ndarray,
    offsets: np.ndarray,
    gait: np.ndarray,
    plane: np.ndarray,
    dt: float,
    transfer: float,
    landed: np.ndarray,
    share: np.ndarray,
    normals: np.ndarray,
) -> None:
    """Write each foot's part of its full share of the load, from 0 to 1, and its ground's normal.

    Args:
        codes: What each leg does, then what the clock does: the engine's, shape (L + 1 or more,).
        clock: The engine's: the gait's phase first, shape (1 or more,).
        offsets: Phases at which the legs lift, shape (L,).
        gait: Its period [s] is the second number, shape (2 or more,).
        plane: Of the ground: its normal first, shape (3 or more,).
        dt: Time since the last call [s].
        transfer: Time in which the load moves [s].
        landed: Time since each foot landed [s], changed, shape (L,).
        share: The last shares, changed, shape (L,).
        normals: Written, shape (L, 3).
    """
    legs = share.shape[0]
    for leg in range(legs):
        for i in range(3):
            normals[leg, i] = plane[i]
        if codes[leg] != STANCE:
            landed[leg] = 0.0
            share[leg] = 0.0
            continue
        landed[leg] += dt
        wanted = 1.0
        if transfer > 0.0:
            time = min(landed[leg], transfer)
            if codes[legs] == WALKING:
                left = (offsets[leg] - clock[0]) % 1.0 * gait[1]
                time = min(time, left)
            wanted = _smooth(time / transfer)
            # A lift that was foreseen may not come, and one may come unforeseen.
            most = 2.0 * dt / transfer
            wanted = min(max(wanted, share[leg] - most), share[leg] + most)
        share[leg] = max(wanted, LEAST)


class DynamicsStage:
    """Torques for a locomotion engine's motion, update by update.

    Args:
        robot: The robot.
        settings: How forces are chosen.
        update_period: Time from one update to the next [s].

    Attributes:
        effort: What the last motion takes.
        share: Each foot's part of its full share of the load, shape (L,).
        velocity_share: Part of the admitted velocity that can be had by what was found so far.
    """

    def __init__(self, robot: Robot, settings: EffortSettings, update_period: float) -> None:
        legs = len(robot.legs)
        self.share, self._landed = np.ones(legs), np.full(legs, settings.load_transfer)
        self.velocity_share = 1.0
        self.effort = Effort(np.zeros((legs, 3)), np.zeros((legs, 3)), 1.0, 0.0, 0.0, "")
        self._feed, self._dt = FeedForward(robot, settings), update_period
        self._transfer = settings.load_transfer
        self._normals = np.zeros((legs, 3))

    def reset(self) -> None:
        """Begin with all feet on the ground."""
        self.share[:], self._landed[:] = 1.0, self._transfer
        self.velocity_share = 1.0

    def update(self, state: State, order: Order) -> Float[np.ndarray, "legs 3"]:
        """Torques of the joints for the motion that the engine has come to [N·m].

        Args:
            state: Where the engine is.
            order: What it is to do; its ground counts.
        """
        fill_shares(
            state.codes,
            state.clock,
            order.offsets,
            order.gait,
            order.plane,
            self._dt,
            self._transfer,
            self._landed,
            self.share,
            self._normals,
        )
        q, trunk, slow = state.q, state.trunk, float(state.clock[3])
        qd, qdd, w, dw, a = q[1], q[2], trunk[2], trunk[4], trunk[3]
        if slow != 1.0:
            # The engine's own time goes slower than the clock on the wall.
            qd, w = slow * qd, slow * w
            qdd, dw, a = slow**2 * qdd, slow**2 * dw, slow**2 * a
        self.effort = effort = self._feed.update(
            state.body, w, dw, a, q[0], qd, qdd, self.share, self._normals
        )
        if effort.part < 1.0:
            self.velocity_share *= 1.0 - SLOWER * self._dt
        else:
            self.velocity_share = min(1.0, self.velocity_share + FASTER * self._dt)
        return effort.torque
