"""Any controller, with what keeps a robot from harm around it."""

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
from phasmid.control.safety import Guard, Mode, SafetySettings
from phasmid.control.targets import JointTargets
from phasmid.robot import JOINTS, Robot

LIMIT_SLACK = 1e-6
"""Targets may pass a joint limit by as much, which is round-off [rad]."""

SPEED_SLACK = 1.02
"""And move faster than the servo by this factor."""

BRAKING = 60.0
"""Deceleration of joints that come to hold still [rad/s²]."""


class SafeController:
    """A controller that is told only what is sound, and whose targets are looked at.

    What it is told goes through a `Guard`. Where the guard holds the robot still, the joints brake
    and stay; when it lets go, the controller begins anew with the robot as it stands. Targets that
    are not finite, beyond the joint limits or farther away than a servo can turn are replaced by
    the nearest that are not. Torques are passed on; one that is not finite is replaced by the last
    that was, and those that held the robot stay while it holds still.

    Attributes:
        controller: What decides.
        guard: What it is told goes through this.
        limits: Lowest and highest targets [rad], shape (2, L, 3).
        speed: Largest speed of targets [rad/s].
        last: The last targets; None: none yet.
    """

    def __init__(
        self, controller: Controller, robot: Robot, settings: SafetySettings | None = None
    ) -> None:
        """Begin.

        Args:
            controller: Any controller.
            robot: The robot, L legs.
            settings: When safety steps in; None: the usual.
        """
        self.controller, self.guard = controller, Guard(robot, settings)
        limits = robot.arrays.joint_limits
        self.limits = np.stack([limits[..., 0] - LIMIT_SLACK, limits[..., 1] + LIMIT_SLACK])
        self._low, self._high = self.limits
        self.speed = SPEED_SLACK * robot.servo.no_load_speed
        self._faulty = compiled(faulty)
        self._names = [f"{leg}.{joint}" for leg in robot.leg_names for joint in JOINTS]
        self._none = np.zeros(self._low.shape)
        self.last: JointTargets | None = None
        self._time = 0.0
        self._held = False
        self._told: dict[str, float] = {}
        # How much of what the controller has said was taken already.
        self._heard = 0

    @property
    def events(self) -> list[tuple[float, str]]:
        """What safety and the controller have said since `reset`: times [s] and sentences."""
        inner = list(getattr(self.controller, "events", ()))
        return sorted([*self.guard.events, *inner], key=lambda event: event[0])

    def take_events(self) -> list[tuple[float, str]]:
        """What was said since it was asked last; it is forgotten, so that no memory grows."""
        inner = list(getattr(self.controller, "events", ()))
        told = sorted([*self.guard.events, *inner[self._heard :]], key=lambda event: event[0])
        self.guard.events.clear()
        self._heard = len(inner)
        take = getattr(self.controller, "take_events", None)
        if callable(take):
            take()
            self._heard = 0
        return told

    def reset(self, observation: Observation) -> None:
        """Forget all, and begin with the robot as it is observed."""
        self.guard.reset(observation)
        self.last, self._held, self._time = None, False, observation.time
        self._told.clear()
        self._heard = 0
        self.controller.reset(observation)

    def update(self, observation: Observation, command: Command) -> JointTargets:
        """What the joints shall do until the next update."""
        dt = observation.time - self._time
        dt = dt if math.isfinite(dt) and dt > 0.0 else 0.0
        observation, command = self.guard.check(observation, command)
        if math.isfinite(observation.time):
            self._time = observation.time
        if self.guard.mode is Mode.HOLD:
            return self._hold(observation, dt)
        if self._held:
            self._held = False
            assert self.last is not None
            # It forgets what it has said.
            self.guard.events += list(getattr(self.controller, "events", ()))[self._heard :]
            self._heard = 0
            self.controller.reset(replace(observation, joint_position=self.last.position.copy()))
        targets = self.controller.update(observation, command)
        last = self.last
        if last is None:
            last = JointTargets(observation.joint_position, targets.velocity)
            dt = math.inf
        farthest = self.speed * dt if dt > 0.0 else math.inf
        torque = targets.torque
        wrong = self._faulty(
            targets.position,
            targets.velocity,
            self._none if torque is None else torque,
            last.position,
            self._low,
            self._high,
            farthest,
        )
        if wrong:
            targets = self._mended(targets, last, farthest, wrong)
        self.last = targets
        return targets

    def telemetry(self) -> Mapping[str, Any]:
        """The mode by number, beside what the controller tells."""
        inner = getattr(self.controller, "telemetry", None)
        told = inner() if callable(inner) else {}
        return {**told, "safety_mode": float(self.guard.mode)}

    def _hold(self, observation: Observation, dt: float) -> JointTargets:
        """Brake, and stay there."""
        last, self._held = self.last, True
        if last is None:
            q = np.array(observation.joint_position)
            last = JointTargets(q, 0 * q)
        change = BRAKING * dt
        v = last.velocity - np.clip(last.velocity, -change, change)
        q = np.clip(last.position + dt * (last.velocity + v) / 2, self._low, self._high)
        self.last = JointTargets(q, v, last.torque)
        return self.last

    def _mended(
        self, targets: JointTargets, last: JointTargets, farthest: float, wrong: int
    ) -> JointTargets:
        """Targets that a servo can be given, and a sentence on those that it cannot."""
        q, v = np.array(targets.position), np.array(targets.velocity)
        torque, bad = targets.torque, ~(np.isfinite(q) & np.isfinite(v))
        limp = np.zeros_like(bad) if torque is None else ~np.isfinite(torque)
        if torque is not None and limp.any():
            torque = np.where(limp, self._none if last.torque is None else last.torque, torque)
        q[bad], v[bad] = np.broadcast_to(last.position, q.shape)[bad], 0.0
        why, seen = "", q.copy()
        if wrong & 1:
            where, why = bad | limp, "not finite; the last one stays"
        elif wrong & 2:
            where, why = (q < self._low) | (q > self._high), "beyond the joint's limits"
        else:
            where, why = np.abs(q - last.position) > farthest, "farther than the servo can turn"
        q = np.clip(q, self._low, self._high)
        q = np.clip(q, last.position - farthest, last.position + farthest)
        v[q != seen] = 0.0
        name = self._names[int(np.argmax(where))]
        # Once a second for each kind.
        if self._time - self._told.get(why, -math.inf) >= 1.0:
            self._told[why] = self._time
            self.guard.events.append((self._time, f"the target of {name} is {why}."))
        return JointTargets(q, v, torque)


def faulty(
    q: Float[np.ndarray, "legs 3"],
    v: Float[np.ndarray, "legs 3"],
    torque: Float[np.ndarray, "legs 3"],
    last: Float[np.ndarray, "legs 3"],
    low: Float[np.ndarray, "legs 3"],
    high: Float[np.ndarray, "legs 3"],
    farthest: float,
) -> int:
    """What is wrong with targets, one bit each: not finite, beyond limits, too far away.

    Args:
        q: Angles [rad].
        v: Speeds [rad/s].
        torque: Torques [N·m].
        last: Angles of the last targets [rad].
        low: Lowest angles [rad].
        high: Highest angles [rad].
        farthest: Largest change of an angle [rad].
    """
    wrong = 0
    for leg in range(q.shape[0]):
        for joint in range(3):
            x = q[leg, joint]
            # A sum is finite where all its parts are: they are no larger than a few thousand.
            if not math.isfinite(x + v[leg, joint] + torque[leg, joint]):
                wrong |= 1
            if x < low[leg, joint] or x > high[leg, joint]:
                wrong |= 2
            if abs(x - last[leg, joint]) > farthest:
                wrong |= 4
    return wrong
