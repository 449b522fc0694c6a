"""A controller that knows its motion beforehand, and looks at nothing."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Bool, Float

from phasmid.arguments import check_number, check_type
from phasmid.control.command import Command
from phasmid.control.observation import Observation
from phasmid.control.targets import JointTargets
from phasmid.errors import InvalidInput
from phasmid.motion import JointTrajectory, Motion, Walk

AHEAD = 256
"""Updates for which the motion is evaluated at once, which is quicker than one by one."""


class Player:
    """Plays a planned walk, or a trajectory of joint angles, whatever is commanded or observed.

    Args:
        motion: What is played from its beginning on; after its end a trajectory holds its last
            angles, and a walk goes on.
        rate: Updates a second [1/s].
        lead: How far ahead of the observation's time the targets are [s]; None: one period, the
            time at which the next update replaces them.

    Attributes:
        motion: What is played; a simulation begins with its first instant.

    Raises:
        InvalidInput: The motion is none, or a number is not finite or not positive.
    """

    def __init__(self, motion: Motion, *, rate: float = 200.0, lead: float | None = None) -> None:
        must, hint = "a plan or a trajectory", "phasmid.plan(scenario)"
        check_type("motion", motion, (Walk, JointTrajectory), must, hint)
        check_number("rate", rate)
        if not (math.isfinite(rate) and rate > 0):
            raise InvalidInput(f"rate is {rate:g}; it must be a finite number greater than 0.")
        if lead is not None:
            check_number("lead", lead)
            if not (math.isfinite(lead) and lead >= 0):
                raise InvalidInput(f"lead is {lead:g}; it must be a finite number, 0 or more.")
        self.motion, self.rate = motion, float(rate)
        self.lead = 1 / self.rate if lead is None else float(lead)
        self._begin = 0.0
        self._first = -1
        self._q = self._qd = np.empty((0, 0, 3))
        self._stance: Bool[np.ndarray, "ahead legs"] | None = None
        self._row = 0

    def reset(self, observation: Observation) -> None:
        """Begin the motion now."""
        self._begin, self._first = observation.time, -1
        self._read(observation.time)

    def update(self, observation: Observation, command: Command) -> JointTargets:
        """The motion's angles and speeds, a lead ahead of now."""
        del command
        self._read(observation.time)
        return JointTargets(self._q[self._row], self._qd[self._row])

    def telemetry(self) -> dict[str, Float[np.ndarray, "..."] | Bool[np.ndarray, "..."]]:
        """Which feet the plan has standing; nothing of a trajectory, which does not say."""
        return {} if self._stance is None else {"stance": self._stance[self._row]}

    def _read(self, time: float) -> None:
        """Turn to the row of a time, and evaluate the motion anew where that is not at hand."""
        count = round((time - self._begin) * self.rate)
        block = count // AHEAD
        if block != self._first:
            self._first = block
            due = np.arange(block * AHEAD, (block + 1) * AHEAD) / self.rate + self.lead
            motion = self.motion.sample(due)
            self._q, self._qd = motion.q, motion.qd
            self._stance = motion.stance if isinstance(motion, Walk) else None
        self._row = count - block * AHEAD
