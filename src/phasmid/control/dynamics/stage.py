"""The engine's stage of dynamics: what torques its motion takes, and slower where it takes more."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled, internal
from phasmid.control.dynamics.effort import MISSING, Effort, FeedForward, find_effort
from phasmid.control.dynamics.settings import EffortSettings
from phasmid.control.dynamics.sharing import space_in
from phasmid.control.memory import Memory, unwrapped
from phasmid.control.state import STANCE, WALKING, Order, State
from phasmid.control.views import take
from phasmid.robot import Robot

LEAST = 1e-3
"""Share of a foot that may lift at once, or has landed but now: where all are like it, they carry
all."""

OWN = (9, 11)
"""Numbers that the stage keeps, whatever the number of legs, and for each leg."""

Own = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Shares (L,), times since the feet landed (L,), normals (L, 3), joint speeds and accelerations
(2, L, 3), and the trunk's angular velocity, its rate, and acceleration (3, 3)."""

SLOWER, FASTER = 2.0, 0.25
"""How fast the velocity is taken back while it cannot be had, and given again [1/s]."""


@internal
def _smooth(x: float) -> float:
    """From 0 to 1 with no slope nor bend at either end."""
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


@internal
def fill_shares(
    state: State,
    order: Order,
    dt: float,
    transfer: float,
    landed: np.ndarray,
    share: np.ndarray,
    normals: np.ndarray,
) -> None:
    """Write each foot's part of its full share of the load, from 0 to 1, and its ground's normal.

    Args:
        state: Where the engine is.
        order: What it is to do.
        dt: Time since the last call [s].
        transfer: Time in which the load moves [s].
        landed: Time since each foot landed [s], changed, shape (L,).
        share: The last shares, changed, shape (L,).
        normals: Written, shape (L, 3).
    """
    clock = state.clock
    legs = share.shape[0]
    for leg in range(legs):
        for i in range(3):
            normals[leg, i] = order.plane[i]
        if state.leg[leg] != STANCE:
            landed[leg] = 0.0
            share[leg] = 0.0
            continue
        landed[leg] += dt
        wanted = 1.0
        if transfer > 0.0:
            time = min(landed[leg], transfer)
            if clock.mode == WALKING:
                left = (order.offsets[leg] - clock.phase) % 1.0 * order.gait[1]
                time = min(time, left)
            wanted = _smooth(time / transfer)
            # A lift that was foreseen may not come, and one may come unforeseen.
            most = 2.0 * dt / transfer
            wanted = min(max(wanted, share[leg] - most), share[leg] + most)
        share[leg] = max(wanted, LEAST)


@internal
def let_go(share: np.ndarray, normals: np.ndarray, force: np.ndarray) -> bool:
    """Take its share from each foot that has hardly any, and would have to pull.

    Args:
        share: Each foot's part of its full share of the load, changed, shape (L,).
        normals: Of the ground, shape (L, 3).
        force: Of the ground on the feet [N], shape (L, 3).

    Returns:
        Whether there is one.
    """
    pulls = False
    for leg in range(share.shape[0]):
        n, f = normals[leg], force[leg]
        if share[leg] == LEAST and f[0] * n[0] + f[1] * n[1] + f[2] * n[2] < 0.0:
            share[leg] = 0.0
            pulls = True
    return pulls


@internal
def _own_at(row: np.ndarray, legs: int) -> Own:
    """Views of what the stage keeps in one row."""
    share, a = take(row, 0, (legs,))
    landed, a = take(row, a, (legs,))
    normals, a = take(row, a, (legs, 3))
    rates, a = take(row, a, (2, legs, 3))
    trunk, a = take(row, a, (3, 3))
    return share, landed, normals, rates, trunk


@compiled
def weigh(
    states: np.ndarray,
    orders: np.ndarray,
    times: np.ndarray,
    row: np.ndarray,
    masses: np.ndarray,
    servo: np.ndarray,
    work: np.ndarray,
) -> tuple[float, float, float]:
    """What the motion takes that an engine has come to; see `find_effort`.

    Args:
        states: Of the engine's `Memory`.
        orders: The same.
        times: From one update to the next, and in which the load moves [s], shape (2,).
        row: The stage's own, changed.
        masses: Of the `FeedForward`.
        servo: Its numbers.
        work: Of the same.
    """
    state = states[0]
    legs = state.leg_count
    share, landed, normals, rates, trunk = _own_at(row, legs)
    fill_shares(state, orders[0], times[0], times[1], landed, share, normals)
    # The engine's own time may go slower than the clock on the wall.
    slow = state.clock.time_scale
    for i in range(3):
        trunk[0, i] = slow * state.trunk[2, i]
        trunk[1, i] = slow * slow * state.trunk[4, i]
        trunk[2, i] = slow * slow * state.trunk[3, i]
        for leg in range(legs):
            rates[0, leg, i] = slow * state.q[1, leg, i]
            rates[1, leg, i] = slow * slow * state.q[2, leg, i]
    q = state.q[0, :legs]
    motion = (state.body, trunk[0], trunk[1], trunk[2], q, rates[0], rates[1])
    missing, friction, demand = find_effort(masses, *motion, share, normals, servo, work)
    if math.isinf(friction) and let_go(share, normals, space_in(work, legs)[3]):
        missing, friction, demand = find_effort(masses, *motion, share, normals, servo, work)
        if not missing <= MISSING or math.isinf(friction) or demand > 1.0:
            # Without them the others cannot carry the robot, or pull themselves, or not so much.
            for leg in range(legs):
                if share[leg] == 0.0 and state.leg[leg] == STANCE:
                    share[leg] = LEAST
            return find_effort(masses, *motion, share, normals, servo, work)
    return missing, friction, demand


class DynamicsStage:
    """Torques for a locomotion engine's motion, update by update.

    Args:
        robot: The robot.
        settings: How forces are chosen.
        update_period: Time from one update to the next [s].

    Attributes:
        effort: What the last motion takes.
        share: Each foot's part of its full share of the load, shape (L,).
        times: From one update to the next, and in which the load moves [s], shape (2,).
        own: What it keeps from one update to the next.
        feed: What finds torques.
        velocity_share: Part of the admitted velocity that can be had by what was found so far.
    """

    def __init__(self, robot: Robot, settings: EffortSettings, update_period: float) -> None:
        legs = len(robot.legs)
        self.own = np.zeros(OWN[0] + OWN[1] * legs)
        own = unwrapped(_own_at)(self.own, legs)
        self.share, self._landed, self._normals = own[:3]
        self._transfer = settings.load_transfer
        self.times = np.array([update_period, settings.load_transfer])
        self.effort = Effort(np.zeros((legs, 3)), np.zeros((legs, 3)), 1.0, 0.0, 0.0, "")
        self.feed, self._dt = FeedForward(robot, settings), update_period
        self.reset()

    def reset(self) -> None:
        """Begin with all feet on the ground."""
        self.share[:], self._landed[:] = 1.0, self._transfer
        self.velocity_share = 1.0

    def update(self, memory: Memory) -> Float[np.ndarray, "legs 3"]:
        """Torques of the joints for the motion that the engine has come to [N·m].

        Args:
            memory: The engine's.
        """
        feed = self.feed
        missing, friction, demand = weigh(
            memory.states,
            memory.orders,
            self.times,
            self.own,
            feed.masses,
            feed.numbers,
            feed.work,
        )
        body, q = memory.state.body, memory.state.q[0]
        self.effort = effort = feed.answer(
            missing, friction, demand, body, q, self.share, self._normals
        )
        if effort.part < 1.0:
            self.velocity_share *= 1.0 - SLOWER * self._dt
        else:
            self.velocity_share = min(1.0, self.velocity_share + FASTER * self._dt)
        return effort.torque
