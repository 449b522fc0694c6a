"""The walks that the paper's statements are measured on, each made once, when first asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool

from phasmid.motion import Walk, plan
from phasmid.recording import Recording
from phasmid.reporting import Summary, summarise
from phasmid.reporting.steps import middle_halves
from phasmid.robot import Robot
from phasmid.scenario import Scenario, load_scenario
from phasmid.simulation import simulate

SOFT_STIFFNESS = 40.0
"""Of the soft position servo, between joints that do not give and the AX-12A [N·m/rad]."""

GAITS = ("wave", "ripple", "amble")
"""Gaits besides the paper's; four and more feet stand in them."""

Announce = Callable[[str], None]
"""Is told what is being done now."""


@dataclass(frozen=True, eq=False)
class Trial:
    """One simulated walk, with its plan at the recorded instants.

    Attributes:
        scenario: What was walked.
        walk: The plan, sampled at the recording's times.
        recording: What physics made of it, beside the model's figures.
        summary: Its numbers, as `phasmid.summarise` gives them.
    """

    scenario: Scenario
    walk: Walk
    recording: Recording
    summary: Summary

    @cached_property
    def amid_stance(self) -> Bool[np.ndarray, "time legs"]:
        """Samples in the middle half of each whole stance of each leg."""
        return middle_halves(self.channel("stance"))

    def channel(self, name: str) -> np.ndarray:
        """A channel of the recording as an array."""
        return np.asarray(self.recording[name].values)


class Evidence:
    """All trials of a scenario and of its variants.

    Args:
        scenario: What the statements are held against; the paper's by default.
        announce: Is told of each walk before it is simulated.
    """

    def __init__(
        self, scenario: Scenario | None = None, *, announce: Announce | None = None
    ) -> None:
        self.scenario = scenario or load_scenario("paper")
        self._announce = announce or (lambda _: None)
        self._trials: dict[str, Trial] = {}

    @cached_property
    def robot(self) -> Robot:
        """The paper's robot."""
        return self.scenario.load_robot()

    @property
    def walk(self) -> Trial:
        """The paper's walk as this project reads it."""
        return self.trial("the paper's walk")

    def variant(self, stance_law: str, mounts: str) -> Trial:
        """The walk under one of the two stance laws, on one of the two layouts of the hips."""
        if (stance_law, mounts) == ("straight", "as-given"):
            return self.walk
        return self.trial(f"{stance_law}, mounts {mounts}", stance_law=stance_law, mounts=mounts)

    def driven(self, drive: str) -> Trial:
        """The walk with ``prescribed`` joints, ``soft`` position servos, or the ``AX-12A``."""
        if drive == "prescribed":
            return self.walk
        if drive == "AX-12A":
            return self.trial("AX-12A servos", drive="servo")
        servo = replace(
            self.robot.servo,
            name=f"soft servo, {SOFT_STIFFNESS:g} N·m/rad",
            stiffness=SOFT_STIFFNESS,
        )
        robot = replace(self.robot, servo=servo)
        return self.trial("soft servos", drive="servo", robot=robot)

    def gait(self, name: str) -> Trial:
        """The walk in another gait."""
        return self.trial(f"{name} gait", gait=name)

    def trial(self, name: str, **changes: Any) -> Trial:
        """The paper's scenario with some changes, simulated.

        Args:
            name: What is said of it; one name always goes with the same changes.
            **changes: As of `Scenario.replace`.
        """
        if name not in self._trials:
            self._announce(name)
            scenario = self.scenario.replace(**changes)
            walk = plan(scenario)
            recording = simulate(scenario, walk)
            fine = walk.sample(np.asarray(recording["time"].values))
            self._trials[name] = Trial(scenario, fine, recording, summarise(recording))
        return self._trials[name]
