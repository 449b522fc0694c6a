"""Locomotion engines of many robots, updated together on several threads."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from phasmid.arguments import check_type
from phasmid.control.command import Command
from phasmid.control.engine import LocomotionEngine
from phasmid.control.memory import Records
from phasmid.control.observation import Observation
from phasmid.control.settings import EngineSettings
from phasmid.control.targets import JointTargets
from phasmid.cores import cores
from phasmid.errors import InvalidInput
from phasmid.robot import Robot


class EngineBatch:
    """Locomotion engines whose records lie side by side.

    Attributes:
        engines: The engines; each is also a controller of its own.
        records: Records of all engines.
    """

    def __init__(
        self,
        robot: Robot,
        count: int,
        settings: EngineSettings | None = None,
        *,
        threads: int | None = None,
        **keywords: Any,
    ) -> None:
        """Make the engines.

        Args:
            robot: The robot, L legs.
            count: Number of engines.
            settings: Settings of all; None for the default.
            threads: Number of threads; None for one per core.
            keywords: Settings by name, as those of `LocomotionEngine`.

        Raises:
            InvalidInput: A number is less than 1, or a setting is out of range.
        """
        for name, value in (("count", count), ("threads", threads)):
            if value is None:
                continue
            check_type(name, value, (int,), "a whole number", "2")
            if value < 1:
                raise InvalidInput(f"{name} is {value}; it must be 1 or more.")
        self.records = Records.zeros(count)
        self.engines = [
            LocomotionEngine(robot, settings, records=self.records.of(i), **keywords)
            for i in range(count)
        ]
        self._parts = min(cores() if threads is None else threads, count)
        self._threads = ThreadPoolExecutor(self._parts)

    def reset(self, observations: Sequence[Observation]) -> None:
        """Reset every engine with its observation."""
        for engine, observation in zip(self.engines, observations, strict=True):
            engine.reset(observation)

    def update(
        self, observations: Sequence[Observation], commands: Sequence[Command]
    ) -> list[JointTargets]:
        """Return the joint targets of every robot until the next update.

        Args:
            observations: Observation of each robot.
            commands: Command of each robot.

        Raises:
            InvalidInput: A command is infeasible for its robot; no robot is updated.
        """
        from phasmid.control.update import update_many

        for engine, observation, command in zip(self.engines, observations, commands, strict=True):
            engine.prepare(observation, command)
        dt = self.engines[0].settings.update_period
        results = update_many(self.records, dt, self._threads, self._parts)
        return [
            engine.finish(command, *result)
            for engine, command, result in zip(
                self.engines, commands, results.tolist(), strict=True
            )
        ]
