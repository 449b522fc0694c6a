"""The seam between what decides and what is moved: a simulated robot or a real one."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from phasmid.control.command import Command
from phasmid.control.observation import Observation
from phasmid.control.targets import JointTargets


@runtime_checkable
class Controller(Protocol):
    """Decides what the joints do next; it neither knows nor asks what moves them.

    A class with these two methods is one. It may also have a method ``telemetry``, which tells
    numbers by channel name, to be recorded beside what the sensors told.
    """

    def reset(self, observation: Observation) -> None:
        """Forget all, and begin with the robot as it is observed."""

    def update(self, observation: Observation, command: Command) -> JointTargets:
        """What the joints shall do until the next update, at the controller's own rate."""
