"""Simulated walks on which the paper's statements are measured, each made once, on demand."""

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

SERVO_STIFFNESS = 40.0
"""Of the position servo that stands between joints that do not give and the AX-12A [N·m/rad]."""

STIFF = f"servos of {SERVO_STIFFNESS:g} N·m/rad"
"""Name of that servo, and of the walk with it."""

DRIVES = {
    "prescribed": "prescribed",
    STIFF: "ideal-servo",
    "AX-12A as springs": "ideal-servo",
    "AX-12A": "servo",
}
"""Drives by their names, from joints that no torque moves off their plan to the own servos."""

GAITS = ("wave", "ripple", "amble")
"""Gaits besides the paper's; four and more feet stand in them."""

Announce = Callable[[str], None]
"""Receives a sentence on the present work."""


@dataclass(frozen=True, eq=False)
class Trial:
    """One simulated walk, with its plan at the recorded instants.

    Attributes:
        scenario: The experiment.
        walk: The plan, sampled at the recording's times.
        recording: Simulated channels beside the model's.
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
        """Return a channel of the recording as an array."""
        return np.asarray(self.recording[name].values)


class Evidence:
    """All trials of a scenario and of its variants.

    Args:
        scenario: Scenario of the statements; the paper's by default.
        announce: Receives a sentence before each simulation.

    Attributes:
        trials: Those made so far, by name.
    """

    def __init__(
        self, scenario: Scenario | None = None, *, announce: Announce | None = None
    ) -> None:
        self.scenario = scenario or load_scenario("paper")
        self._announce = announce or (lambda _: None)
        self.trials: dict[str, Trial] = {}

    @cached_property
    def robot(self) -> Robot:
        """The paper's robot."""
        return self.scenario.build().robot

    @cached_property
    def planned(self) -> Walk:
        """The paper's walk as planned, every millisecond of it."""
        walk = plan(self.scenario)
        return walk.sample(np.arange(round(1000 * self.scenario.duration) + 1) / 1000)

    @property
    def walk(self) -> Trial:
        """The paper's walk as this project reads it."""
        return self.trial("the paper's walk")

    def variant(self, stance_law: str, mounts: str) -> Trial:
        """Return the walk with one stance law and one layout of the hips."""
        if (stance_law, mounts) == ("straight", "as-given"):
            return self.walk
        return self.trial(f"{stance_law}, mounts {mounts}", stance_law=stance_law, mounts=mounts)

    def driven(self, drive: str) -> Trial:
        """Return the walk with one of `DRIVES`."""
        changes: dict[str, Any] = {"drive": DRIVES[drive]}
        if drive == STIFF:
            servo = replace(self.robot.servo, name=drive, stiffness=SERVO_STIFFNESS)
            changes["robot"] = replace(self.robot, servo=servo)
        return self.walk if drive == "prescribed" else self.trial(drive, **changes)

    def creeping(self, friction_damping: float) -> Trial:
        """Return the walk with prescribed joints and a friction damping [N·s/m]."""
        if friction_damping == self.scenario.build().world.contact.friction_damping:
            return self.walk
        name = f"friction damping {friction_damping:g} N·s/m"
        return self.trial(name, friction_damping=friction_damping)

    def gait(self, name: str) -> Trial:
        """Return the walk in another gait."""
        return self.trial(f"{name} gait", gait=name)

    def trial(self, name: str, **changes: Any) -> Trial:
        """Simulate the paper's scenario with some changes.

        Args:
            name: Name of the variant; one name always has the same changes.
            **changes: As of `Scenario.replace`.
        """
        if name not in self.trials:
            self._announce(name)
            scenario = self.scenario.replace(**changes)
            walk = plan(scenario)
            recording = simulate(scenario, walk)
            fine = walk.sample(np.asarray(recording["time"].values))
            self.trials[name] = Trial(scenario, fine, recording, summarise(recording))
        return self.trials[name]
