"""Safety filter around a controller: checks its inputs and the joint targets it returns."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from phasmid.arguments import checked
from phasmid.control.safety import Mode, SafetyMonitor, SafetySettings
from phasmid.experiment.command import Command
from phasmid.experiment.controller import Controller
from phasmid.experiment.observation import Observation
from phasmid.experiment.targets import JointTargets, checked_targets
from phasmid.robot import JOINTS, Robot

LIMIT_SLACK = 1e-6
"""Excess over a joint limit that counts as round-off [rad]."""

SPEED_SLACK = 1.02
"""Largest speed of targets divided by the servo's no-load speed."""

BRAKING = 60.0
"""Deceleration of joints that come to rest [rad/s²]."""

REPEAT = 1.0
"""Time after which a violation of the same kind is an event again [s]."""


class SafetyFilter:
    """Controller that passes checked inputs to another controller and checks its joint targets.

    A `SafetyMonitor` checks observations and commands. While it holds the robot still, the joints
    brake and stay; afterwards the controller is reset with the joints where they are. Targets that
    are not finite, beyond joint limits or farther than a servo can turn are replaced by the nearest
    permitted ones. A torque that is not finite is replaced by the last finite one.

    Args:
        controller: Any controller.
        robot: The robot, L legs.
        settings: Thresholds of the monitor; None for the default.

    Attributes:
        controller: The controller inside.
        monitor: Checks observations and commands.
        limits: Lowest and highest targets [rad], shape (2, L, 3).
        speed: Largest speeds of targets [rad/s], shape (L, 3).
        last: Last targets; None before the first update.
    """

    @checked
    def __init__(
        self, controller: Controller, robot: Robot, settings: SafetySettings | None = None
    ) -> None:
        self.controller, self.monitor = controller, SafetyMonitor(robot, settings)
        limits = robot.arrays.joint_limits
        self.limits = np.stack([limits[..., 0] - LIMIT_SLACK, limits[..., 1] + LIMIT_SLACK])
        self.speed = SPEED_SLACK * robot.arrays.no_load_speed
        self._shape = len(robot.legs), len(JOINTS)
        self._names = [f"{leg}.{joint}" for leg in robot.leg_names for joint in JOINTS]
        self._clear()

    def _clear(self) -> None:
        self.last: JointTargets | None = None
        self._holds = False
        self._reported: dict[str, float] = {}
        # Number of events taken from a controller that keeps its own.
        self._taken = 0

    @property
    def events(self) -> list[tuple[float, str]]:
        """Events of monitor and controller since `reset` or `take_events`: times [s], sentences."""
        self._collect_events()
        return self.monitor.events

    def take_events(self) -> list[tuple[float, str]]:
        """Return the events since the last call, and forget them."""
        events = self.events
        self.monitor.events = []
        return events

    def _collect_events(self) -> None:
        """Move new events of the controller to those of the monitor, by time."""
        events, take = getattr(self.controller, "events", []), None
        if events:
            take = getattr(self.controller, "take_events", None)
        if take is None:
            new, self._taken = events[self._taken :], len(events)
        else:
            new = take()
        if new:
            self.monitor.events += new
            self.monitor.events.sort(key=lambda event: event[0])

    def reset(self, observation: Observation) -> None:
        """Begin with the robot as it is observed."""
        self.monitor.reset(observation)
        self._clear()
        self.controller.reset(observation)

    def update(self, observation: Observation, command: Command) -> JointTargets:
        """Return the joint targets until the next update."""
        observation, command = self.monitor.check(observation, command)
        if self.monitor.mode is Mode.HOLD:
            return self._hold(observation)
        if self._holds:
            self._restart(observation)
        targets = checked_targets(self.controller.update(observation, command), self._shape)
        self.last = self._permitted(targets, observation)
        return self.last

    def telemetry(self) -> Mapping[str, Any]:
        """Return the controller's telemetry with the safety mode as a number."""
        inner: Callable[[], Mapping[str, Any]] = getattr(self.controller, "telemetry", dict)
        return {**inner(), "safety_mode": float(self.monitor.mode)}

    def _hold(self, observation: Observation) -> JointTargets:
        """Brake the joints, and keep them at rest."""
        last, self._holds = self.last, True
        if last is None:
            q = np.array(observation.joint_position)
            last = JointTargets(q, np.zeros(q.shape))
        dt = self.monitor.dt
        v = last.velocity - np.clip(last.velocity, -BRAKING * dt, BRAKING * dt)
        q = np.clip(last.position + dt * (last.velocity + v) / 2, *self.limits)
        self.last = JointTargets(q, v, last.torque)
        return self.last

    def _restart(self, observation: Observation) -> None:
        """Reset the controller where the joints were held; its events stay."""
        self._holds = False
        assert self.last is not None
        self._collect_events()
        self._taken = 0
        self.controller.reset(replace(observation, joint_position=self.last.position.copy()))

    def _permitted(self, targets: JointTargets, observation: Observation) -> JointTargets:
        """Return the nearest permitted targets, and add an event on the violation."""
        last, dt = self.last, self.monitor.dt
        reach = self.speed * dt if dt else math.inf
        if last is None:
            last, reach = JointTargets(observation.joint_position, targets.velocity), math.inf
        q, v, torque, (low, high) = targets.position, targets.velocity, targets.torque, self.limits
        permitted = _clipped(_clipped(q, low, high), last.position - reach, last.position + reach)
        limp = np.zeros(q.shape, dtype=bool) if torque is None else ~np.isfinite(torque)
        if ((permitted == q) & np.isfinite(v) & ~limp).all():
            return targets
        bad = ~(np.isfinite(q) & np.isfinite(v))
        if (bad | limp).any():
            where, why = bad | limp, "not finite; the last one stays"
        elif ((q < low) | (q > high)).any():
            where, why = (q < low) | (q > high), "beyond the joint's limits"
        else:
            where, why = permitted != q, "farther than the servo can turn"
        time = self.monitor.time
        if time - self._reported.get(why, -math.inf) >= REPEAT:
            self._reported[why] = time
            name = self._names[int(np.argmax(where))]
            self.monitor.events.append((time, f"the target of {name} is {why}."))
        v = np.where(bad | (permitted != q), 0.0, v)
        if torque is not None and limp.any():
            torque = np.where(limp, 0.0 if last.torque is None else last.torque, torque)
        return JointTargets(np.where(bad, last.position, permitted), v, torque)


def _clipped(values: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return values within limits, and NaN unchanged; 3 times as fast as `numpy.clip`."""
    return np.asarray(np.minimum(np.maximum(values, low), high))
