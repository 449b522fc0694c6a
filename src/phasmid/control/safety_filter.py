"""Safety filter around a controller: checks its inputs and the joint targets it returns."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.control.command import Command
from phasmid.control.controller import Controller
from phasmid.control.observation import Observation
from phasmid.control.safety import Mode, SafetyMonitor, SafetySettings
from phasmid.control.targets import JointTargets
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

    Attributes:
        controller: The controller inside.
        monitor: Checks observations and commands.
        limits: Lowest and highest targets [rad], shape (2, L, 3).
        speed: Largest speed of targets [rad/s].
        last: Last targets; None before the first update.
    """

    def __init__(
        self, controller: Controller, robot: Robot, settings: SafetySettings | None = None
    ) -> None:
        """Initialise with a controller.

        Args:
            controller: Any controller.
            robot: The robot, L legs.
            settings: Thresholds of the monitor; None for the default.
        """
        self.controller, self.monitor = controller, SafetyMonitor(robot, settings)
        limits = robot.arrays.joint_limits
        self.limits = np.stack([limits[..., 0] - LIMIT_SLACK, limits[..., 1] + LIMIT_SLACK])
        self.speed = SPEED_SLACK * robot.servo.no_load_speed
        self._violations = compiled(target_violations)
        self._names = [f"{leg}.{joint}" for leg in robot.leg_names for joint in JOINTS]
        self._zero = np.zeros(self.limits.shape[1:])
        self.last: JointTargets | None = None
        self._time, self._holds = 0.0, False
        self._reported: dict[str, float] = {}
        # Number of the controller's events that were taken already.
        self._taken = 0

    @property
    def events(self) -> list[tuple[float, str]]:
        """Events of monitor and controller since `reset`: times [s] and sentences."""
        inner = list(getattr(self.controller, "events", ()))
        return sorted([*self.monitor.events, *inner], key=lambda event: event[0])

    def take_events(self) -> list[tuple[float, str]]:
        """Return the events since the last call, and forget them."""
        inner = list(getattr(self.controller, "events", ()))[self._taken :]
        events = sorted([*self.monitor.events, *inner], key=lambda event: event[0])
        self.monitor.events.clear()
        self._taken += len(inner)
        take = getattr(self.controller, "take_events", None)
        if callable(take):
            take()
            self._taken = 0
        return events

    def reset(self, observation: Observation) -> None:
        """Begin with the robot as it is observed."""
        self.monitor.reset(observation)
        self.last, self._holds, self._time = None, False, observation.time
        self._reported.clear()
        self._taken = 0
        self.controller.reset(observation)

    def update(self, observation: Observation, command: Command) -> JointTargets:
        """Return the joint targets until the next update."""
        dt = observation.time - self._time
        dt = dt if math.isfinite(dt) and dt > 0.0 else 0.0
        observation, command = self.monitor.check(observation, command)
        if math.isfinite(observation.time):
            self._time = observation.time
        if self.monitor.mode is Mode.HOLD:
            return self._hold(observation, dt)
        if self._holds:
            self._restart(observation)
        targets, last = self.controller.update(observation, command), self.last
        if last is None:
            last = JointTargets(observation.joint_position, targets.velocity)
            dt = math.inf
        reach = self.speed * dt if dt > 0.0 else math.inf
        torque = self._zero if targets.torque is None else targets.torque
        violations = self._violations(
            targets.position, targets.velocity, torque, last.position, self.limits, reach
        )
        if violations:
            targets = self._permitted(targets, last, reach, violations)
        self.last = targets
        return targets

    def telemetry(self) -> Mapping[str, Any]:
        """Return the controller's telemetry with the safety mode as a number."""
        inner = getattr(self.controller, "telemetry", None)
        return {**(inner() if callable(inner) else {}), "safety_mode": float(self.monitor.mode)}

    def _hold(self, observation: Observation, dt: float) -> JointTargets:
        """Brake the joints, and keep them at rest."""
        last, self._holds = self.last, True
        if last is None:
            last = JointTargets(np.array(observation.joint_position), self._zero)
        change = BRAKING * dt
        v = last.velocity - np.clip(last.velocity, -change, change)
        q = np.clip(last.position + dt * (last.velocity + v) / 2, *self.limits)
        self.last = JointTargets(q, v, last.torque)
        return self.last

    def _restart(self, observation: Observation) -> None:
        """Reset the controller where the joints were held; its events stay."""
        self._holds = False
        assert self.last is not None
        self.monitor.events += list(getattr(self.controller, "events", ()))[self._taken :]
        self._taken = 0
        self.controller.reset(replace(observation, joint_position=self.last.position.copy()))

    def _permitted(
        self, targets: JointTargets, last: JointTargets, reach: float, violations: int
    ) -> JointTargets:
        """Return the nearest permitted targets, and add an event on the violation."""
        q, v = np.array(targets.position), np.array(targets.velocity)
        torque, bad = targets.torque, ~(np.isfinite(q) & np.isfinite(v))
        limp = np.zeros_like(bad) if torque is None else ~np.isfinite(torque)
        if torque is not None and limp.any():
            torque = np.where(limp, self._zero if last.torque is None else last.torque, torque)
        q[bad], v[bad] = np.broadcast_to(last.position, q.shape)[bad], 0.0
        low, high = self.limits
        if violations & NOT_FINITE:
            where, why = bad | limp, "not finite; the last one stays"
        elif violations & BEYOND_LIMITS:
            where, why = (q < low) | (q > high), "beyond the joint's limits"
        else:
            where, why = np.abs(q - last.position) > reach, "farther than the servo can turn"
        permitted = np.clip(np.clip(q, low, high), last.position - reach, last.position + reach)
        v[permitted != q] = 0.0
        if self._time - self._reported.get(why, -math.inf) >= REPEAT:
            self._reported[why] = self._time
            name = self._names[int(np.argmax(where))]
            self.monitor.events.append((self._time, f"the target of {name} is {why}."))
        return JointTargets(permitted, v, torque)


NOT_FINITE, BEYOND_LIMITS, TOO_FAR = 1, 2, 4
"""Bits of the violations of joint targets."""


def target_violations(
    q: Float[np.ndarray, "legs 3"],
    v: Float[np.ndarray, "legs 3"],
    torque: Float[np.ndarray, "legs 3"],
    last: Float[np.ndarray, "legs 3"],
    limits: Float[np.ndarray, "2 legs 3"],
    reach: float,
) -> int:
    """Return the violations of joint targets as a sum of bits.

    Args:
        q: Angles [rad].
        v: Speeds [rad/s].
        torque: Torques [N·m].
        last: Angles of the last targets [rad].
        limits: Lowest and highest angles [rad].
        reach: Largest change of an angle [rad].
    """
    violations = 0
    for leg in range(q.shape[0]):
        for joint in range(3):
            x = q[leg, joint]
            # The sum of such small numbers is finite where all of them are.
            if not math.isfinite(x + v[leg, joint] + torque[leg, joint]):
                violations |= NOT_FINITE
            if x < limits[0, leg, joint] or x > limits[1, leg, joint]:
                violations |= BEYOND_LIMITS
            if abs(x - last[leg, joint]) > reach:
                violations |= TOO_FAR
    return violations
