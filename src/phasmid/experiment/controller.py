"""Interface of controllers, for simulated robots and real ones."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from phasmid.experiment.command import Command
from phasmid.experiment.observation import Observation
from phasmid.experiment.targets import JointTargets


@runtime_checkable
class Controller(Protocol):
    """Computes joint targets from an observation and a command.

    A class with these two methods is a controller. It may also have ``telemetry()``, which returns
    numbers by channel name to be recorded, and ``events``, a list of times [s] and sentences, with
    ``take_events()``, which returns and clears them. Of a controller that walks without lost legs
    `Sequencer` calls ``catch()`` to land swing legs at once, ``fold(leg, q)`` with joint angles
    [rad] of a lost leg, and ``hold(leg, q)`` if such a leg is in the air already.
    """

    def reset(self, observation: Observation) -> None:
        """Begin with the robot as it is observed."""

    def update(self, observation: Observation, command: Command) -> JointTargets:
        """Return joint targets until the next update, at the controller's own rate."""
