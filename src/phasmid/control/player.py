"""A controller that plays a planned motion, whatever is observed or commanded."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Bool

from phasmid.arguments import checked
from phasmid.errors import InvalidInput
from phasmid.experiment.command import Command
from phasmid.experiment.observation import Observation
from phasmid.experiment.targets import JointTargets
from phasmid.motion import Motion, Walk

BLOCK = 256
"""Updates for which the motion is evaluated at once."""


class Player:
    """Plays a planned walk, or a trajectory of joint angles.

    Args:
        motion: Played from its beginning; after its end a trajectory holds its last angles, and a
            walk goes on.
        rate: Updates per second [1/s].
        lead: Time from an observation to its targets [s]; None: one period, when the next update
            replaces them.

    Attributes:
        motion: What is played; a simulation begins with its first instant.

    Raises:
        InvalidInput: The motion is none, or a number is out of range.
    """

    @checked
    def __init__(self, motion: Motion, *, rate: float = 200.0, lead: float | None = None) -> None:
        if not (math.isfinite(rate) and rate > 0):
            raise InvalidInput(f"rate is {rate:g}; it must be a finite number greater than 0.")
        lead = 1 / rate if lead is None else lead
        if not (math.isfinite(lead) and lead >= 0):
            raise InvalidInput(f"lead is {lead:g}; it must be a finite number, 0 or more.")
        self.motion, self.rate, self.lead = motion, float(rate), float(lead)
        self._start, self._block, self._row = 0.0, -1, 0
        self._q = self._qd = np.empty((0, 0, 3))
        self._stance: Bool[np.ndarray, "block legs"] | None = None

    def reset(self, observation: Observation) -> None:
        """Begin the motion now."""
        self._start, self._block = observation.time, -1
        self._read(observation.time)

    def update(self, observation: Observation, command: Command) -> JointTargets:
        """Return joint angles and speeds of the motion, a lead ahead of the observation."""
        del command
        self._read(observation.time)
        return JointTargets(self._q[self._row], self._qd[self._row])

    def telemetry(self) -> dict[str, Bool[np.ndarray, "..."]]:
        """Return the planned stance; a trajectory has none."""
        return {} if self._stance is None else {"stance": self._stance[self._row]}

    def _read(self, time: float) -> None:
        """Select the sample of a time [s]; evaluate its block of the motion if necessary."""
        block, self._row = divmod(round((time - self._start) * self.rate), BLOCK)
        if block != self._block:
            self._block = block
            samples = np.arange(block * BLOCK, (block + 1) * BLOCK) / self.rate + self.lead
            motion = self.motion.sample(samples)
            self._q, self._qd = motion.q, motion.qd
            self._stance = motion.stance if isinstance(motion, Walk) else None
