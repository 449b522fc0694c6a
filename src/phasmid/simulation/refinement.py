"""What the time step costs: the same walk at half of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from phasmid.motion import Motion
from phasmid.recording import Recording
from phasmid.scenario import Scenario
from phasmid.simulation.experiment import simulate
from phasmid.simulation.termination import Ending

CYCLES = 2
"""Cycles of the walk that are compared: one from standing still and one in full swing."""

PREFIX = "refinement_"
"""Begins the names of a recording's attributes that tell of a refinement."""


@dataclass(frozen=True)
class Refinement:
    """The difference between a walk and the same walk at half its time step.

    Attributes:
        time_step: Of the walk [s].
        duration: How much of it was compared [s].
        normal_force: Rms difference of the feet's normal forces over their rms, at all instants.
        joint_torque: Rms difference of the joint torques over their rms, at all instants.
        way: Largest distance between the two trunks [m].
    """

    time_step: float
    duration: float
    normal_force: float
    joint_torque: float
    way: float

    def attributes(self) -> dict[str, float]:
        """The numbers as attributes of a recording, whose summary then tells them."""
        return {f"{PREFIX}{name}": value for name, value in vars(self).items()}


def time_step_refinement(scenario: Scenario, walk: Motion) -> Refinement | None:
    """Simulate the first two cycles again, at the time step and at half of it, and compare.

    An error that falls with the time step is about as large as this difference where it is of
    first order, as the engine's is.

    Args:
        scenario: As for `simulate`.
        walk: The plan that the joints follow.

    Returns:
        The difference; None where one of the two runs did not come to its end.

    Raises:
        InvalidInput: As for `simulate`.
        InfeasibleLoad: As for `simulate`.
        KeyboardInterrupt: It was stopped by Ctrl-C.
    """
    duration = min(scenario.duration, CYCLES * scenario.stride.period)
    dt = scenario.simulation.dt
    changes = {"duration": duration, "record_interval": dt * scenario.record_steps}
    runs = []
    for shorter in (scenario.replace(**changes), scenario.replace(**changes, dt=dt / 2)):
        run = simulate(shorter, walk)
        if run.attrs["ending"] == Ending.STOPPED.name:
            # A run that is stopped keeps what it has; here there is nothing to keep.
            raise KeyboardInterrupt
        if run.attrs["ending"] != Ending.COMPLETED.name:
            return None
        runs.append(run)
    coarse, fine = runs
    apart = np.linalg.norm(coarse["body_position"].values - fine["body_position"].values, axis=1)
    return Refinement(
        time_step=dt,
        duration=duration,
        normal_force=_relative(coarse, fine, "foot_normal_force"),
        joint_torque=_relative(coarse, fine, "joint_torque"),
        way=float(apart.max()),
    )


def _relative(coarse: Recording, fine: Recording, name: str) -> float:
    """Rms difference over rms."""
    ours, theirs = coarse[name].values, fine[name].values
    return float(np.sqrt(((ours - theirs) ** 2).mean() / (theirs**2).mean()))
