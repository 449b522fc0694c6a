"""The stage of the locomotion engine in which the ground is felt."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled
from phasmid.control.feel.feeling import Feeling, Felt, Intent
from phasmid.control.feel.settings import FeelSettings
from phasmid.control.observation import Observation
from phasmid.control.state import (
    HELD,
    OBSTACLE,
    PROBING,
    SETTLING,
    STANCE,
    STILL,
    SWING,
    Order,
    State,
)
from phasmid.robot import Robot


class FeelStage:
    """Puts what is felt into the engine's order: touch, plane, corrections, landing heights.

    Args:
        robot: The robot, L legs.
        settings: How it feels.
        dt: From one update to the next [s].
    """

    def __init__(self, robot: Robot, settings: FeelSettings, dt: float) -> None:
        self.feeling = Feeling(robot, settings, dt)
        self.settings = settings
        legs = len(robot.legs)
        self._standing = np.ones(legs, dtype=bool)
        self._progress = np.zeros(legs)
        self._R_path = np.eye(3)
        self._hits = np.zeros(legs)
        # Height of a step that is asked, and what was made of it.
        self._steps = np.zeros(2)
        self.felt: Felt | None = None

    def reset(self, observation: Observation) -> None:
        """Forget all; see `Feeling.reset`."""
        self.feeling.reset(observation)
        self.felt = None

    def update(self, observation: Observation, state: State, order: Order) -> list[str]:
        """Feel, and write the order.

        Args:
            observation: What the sensors told.
            state: Where the engine is, at its last update.
            order: Is changed.

        Returns:
            What is new of the sensors, a sentence each.
        """
        tell_intent(
            state.leg,
            state.swing,
            state.retreat,
            state.path,
            self._standing,
            self._progress,
            self._R_path,
        )
        self.feeling.set_upright(state)
        felt = self.felt = self.feeling.update(
            observation,
            Intent(
                self._standing,
                self._progress,
                state.foot,
                state.path,
                state.trunk[0],
                state.body,
                self._R_path,
                state.q[0],
                bool(state.mode[0] != STILL),
            ),
        )
        write_order(
            felt.touch,
            felt.hits,
            felt.correction,
            felt.plane,
            felt.foot_offset,
            self.settings.hit_rise,
            self.settings.landing_sink,
            self.settings.step_rise,
            self.settings.body_rise,
            state.leg,
            state.foot,
            self._hits,
            self._steps,
            order.step,
            order.touch,
            order.correction,
            order.plane,
            order.foot_offset,
            order.landing,
            state.landing,
        )
        # A leg that is limp sags by more than any that gives way.
        np.minimum(felt.sag, self.settings.height_limit, out=order.sag)
        events = self.feeling.events
        if not events:
            return []
        told = events.copy()
        events.clear()
        return told


@compiled
def tell_intent(
    leg: np.ndarray,
    swing: np.ndarray,
    retreat: np.ndarray,
    path: np.ndarray,
    standing: np.ndarray,
    progress: np.ndarray,
    R_path: np.ndarray,
) -> None:
    """Write which feet stand, how far the others have swung, and the axes of the path."""
    for i in range(len(leg)):
        doing = leg[i]
        standing[i] = doing in (STANCE, SETTLING)
        progress[i] = 0.0
        if doing == SWING and retreat[i] == 0.0:
            progress[i] = min(max(swing[i, 0] / swing[i, 1], 0.0), 1.0)
        elif doing in (PROBING, HELD):
            progress[i] = 1.0
    c, s = math.cos(path[2]), math.sin(path[2])
    R_path[0, 0], R_path[0, 1] = c, -s
    R_path[1, 0], R_path[1, 1] = s, c


@compiled
def write_order(
    touch: np.ndarray,
    hits: np.ndarray,
    correction: np.ndarray,
    plane: np.ndarray,
    offset: np.ndarray,
    hit_rise: float,
    sink: float,
    step_rise: float,
    body_rise: float,
    leg: np.ndarray,
    foot: np.ndarray,
    known: np.ndarray,
    steps: np.ndarray,
    to_step: np.ndarray,
    to_touch: np.ndarray,
    to_correction: np.ndarray,
    to_plane: np.ndarray,
    to_offset: np.ndarray,
    to_landing: np.ndarray,
    landing: np.ndarray,
) -> None:
    """Write what is felt where the engine's loops read it."""
    for i in range(5):
        to_correction[i] = correction[i]
    n = 1.0 / math.sqrt(1.0 + plane[1] ** 2 + plane[2] ** 2)
    to_plane[0], to_plane[1], to_plane[2] = -plane[1] * n, -plane[2] * n, n
    to_plane[3] = plane[0] - plane[1] * plane[3] - plane[2] * plane[4]
    low, high = 0.0, 0.0
    for i in range(len(touch)):
        if leg[i] == STANCE:
            z = foot[i, 2] - to_plane[3] - plane[1] * foot[i, 0] - plane[2] * foot[i, 1]
            low, high = min(low, z), max(high, z)
    # Legs that step higher need more room.
    to_correction[2] += body_rise * min(high - low, 0.05)
    if to_step[0] != steps[1]:
        steps[0] = to_step[0]
    # Ground that is as rough as what the feet stand on is stepped over.
    to_step[0] = steps[1] = steps[0] + min(step_rise * (high - low), steps[0])
    for i in range(len(touch)):
        to_touch[i] = touch[i]
        if hits[i] > known[i] and touch[i] == 1:
            to_touch[i] = OBSTACLE
        known[i] = hits[i]
        to_offset[i, 2] = offset[i]
        to_landing[i] = math.nan
        if touch[i] >= 0:
            z = to_plane[3] + plane[1] * landing[i, 0] + plane[2] * landing[i, 1]
            # Where a foot has met an obstacle on its way it looks for the ground on top of it.
            to_landing[i] = z - sink + min(hits[i], 3.0) * hit_rise
