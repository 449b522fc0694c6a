"""Where the rows are measured: the walks that several of them share, each made once."""

from __future__ import annotations

from typing import Any

from phasmid.errors import PhasmidError
from phasmid.motion import plan
from phasmid.recording import Recording
from phasmid.scenario import Scenario, load_scenario
from phasmid.simulation import Ending, Run, simulate


class CannotMeasure(PhasmidError):
    """An experiment that did not come to its end."""


def walked(scenario: Scenario, *, to_the_end: bool = True) -> Recording:
    """Simulate the walk of a scenario.

    Args:
        scenario: The experiment.
        to_the_end: Whether a walk that ends early is of no use.

    Raises:
        CannotMeasure: It ended early.
        KeyboardInterrupt: It was stopped by Ctrl-C.
    """
    recording = simulate(scenario, plan(scenario))
    if recording.attrs["ending"] == Ending.STOPPED.name:
        raise KeyboardInterrupt
    if to_the_end and recording.attrs["ending"] != Ending.COMPLETED.name:
        raise CannotMeasure(str(recording.attrs["ending_reason"]))
    return recording


class Laboratory:
    """The paper's robot and walk, on the bench and in the engine.

    Attributes:
        scenario: The basis of all experiments.
    """

    def __init__(self, scenario: Scenario | None = None) -> None:
        self.scenario = load_scenario("paper") if scenario is None else scenario
        self._walks: dict[str, Recording] = {}

    def walk(self, *, to_the_end: bool = True, **changes: Any) -> Recording:
        """Return the simulated walk with these changes; made once.

        Raises:
            CannotMeasure: It ended early.
        """
        key = repr(sorted(changes.items()))
        if key not in self._walks:
            self._walks[key] = walked(self.scenario.replace(**changes), to_the_end=to_the_end)
        return self._walks[key]

    def standing(self, **changes: Any) -> Run:
        """Return the robot at rest on its neutral feet, joints held.

        A new one at each call: experiments push it about.
        """
        scenario = self.scenario.replace(**{"step_length": 0.0, "step_height": 0.0, **changes})
        return Run(scenario, plan(scenario))
