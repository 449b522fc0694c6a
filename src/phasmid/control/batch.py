"""Locomotion engines of many robots, updated together on several threads."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np

from phasmid.control.command import Command
from phasmid.control.engine import LocomotionEngine
from phasmid.control.memory import MEMORY
from phasmid.control.observation import Observation
from phasmid.control.settings import EngineSettings
from phasmid.control.targets import JointTargets
from phasmid.cores import cores
from phasmid.errors import InvalidInput
from phasmid.robot import Robot


class EngineBatch:
    """Locomotion engines whose memories lie side by side.

    Attributes:
        engines: The engines; each is also a controller of its own.
        memories: Records of all engines, shape (N,).
        results: Of `phasmid.control.update.update`, shape (N, 2).
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
            if value < 1:
                raise InvalidInput(f"{name} is {value}; it must be 1 or more.")
        self.memories = np.zeros(count, MEMORY)
        self.engines = [
            LocomotionEngine(robot, settings, memory=self.memories[i : i + 1], **keywords)
            for i in range(count)
        ]
        self.results = np.zeros((count, 2), np.int64)
        threads = min(cores() if threads is None else threads, count)
        bounds = pairwise(np.linspace(0, count, threads + 1).astype(int))
        self._parts = [(self.memories[i:j], self.results[i:j]) for i, j in bounds]
        # The calling thread takes the first part.
        self._threads = ThreadPoolExecutor(max(threads - 1, 1))

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
        for engine, observation, command in zip(self.engines, observations, commands, strict=True):
            engine.prepare(observation, command)
        self.advance()
        return [
            engine.finish(command, *result)
            for engine, command, result in zip(
                self.engines, commands, self.results.tolist(), strict=True
            )
        ]

    def advance(self) -> None:
        """Advance all engines by an update period, each thread a part of them."""
        # Lazy import: numba takes 0.6 s.
        from phasmid.control.update import update

        dt = self.engines[0].settings.update_period
        (memories, results), *others = self._parts
        running = [self._threads.submit(update, part, dt, out) for part, out in others]
        update(memories, dt, results)
        for part in running:
            part.result()
