"""Protection of a robot on a bus: which readings make it hold, sit down or go limp."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from enum import IntEnum
from typing import Literal

import numpy as np

from phasmid.control import Mode, SafetyMonitor
from phasmid.errors import InvalidInput
from phasmid.hardware.robot_bus import SILENCE, RobotBus

DEBOUNCE = 3
"""Readings in a row that confirm a temperature of one servo, or the supply of any. A single one
may be damaged without being detected."""


class Reaction(IntEnum):
    """What the driver does, from the mildest to the strongest.

    Attributes:
        NONE: The robot walks.
        HOLD: Goals are no longer written; the servos hold the last ones.
        SIT: The robot sits down, then its torque is switched off.
        LIMP: The torque is switched off at once.
    """

    NONE = 0
    HOLD = 1
    SIT = 2
    LIMP = 3


@dataclass(frozen=True, kw_only=True)
class DriverSettings:
    """Limits and times of the driver.

    Attributes:
        start_speed: Largest joint speed until the robot stands [rad/s].
        sit_speed: Largest joint speed while it sits down [rad/s].
        ramp_time: Time in which the output of the servos rises at the start, and falls after
            sitting down [s].
        hold_time: Time of holding after which it sits down, or goes limp where the driver's process
            has ended [s].
        sit_time: Longest time for sitting down [s].
        temperature_margin: It sits down where a servo is warmer than its limit less this [K].
        voltage_margin: It sits down where a supply is below the servo's limit and this [V].
        lost_legs: Most lost legs with which it walks on.
        after_exit: What the servos do after the driver's process was killed: ``limp`` after
            `hold_time`, or ``hold``.
    """

    start_speed: float = math.radians(30)
    sit_speed: float = math.radians(60)
    ramp_time: float = 1.0
    hold_time: float = 2.0
    sit_time: float = 20.0
    temperature_margin: float = 5.0
    voltage_margin: float = 0.3
    lost_legs: int = 1
    after_exit: Literal["limp", "hold"] = "limp"

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, int | float) and not (math.isfinite(value) and value >= 0):
                raise InvalidInput(
                    f"{field.name} is {value:g}; it must be a finite number, 0 or more."
                )
        if self.after_exit not in ("limp", "hold"):
            raise InvalidInput(f'after_exit is "{self.after_exit}"; it must be "limp" or "hold".')


class Protection:
    """Derives a reaction from readings.

    Args:
        robot: The robot, whose servos answer.
        settings: Limits.
    """

    def __init__(self, robot: RobotBus, settings: DriverSettings) -> None:
        self._robot, self._settings = robot, settings
        shape = robot.position.shape
        limits = np.array(
            [
                [robot.bus.read(id_, name) for name in ("temperature_limit", "min_voltage_limit")]
                for id_ in robot.ids
            ]
        ).reshape(*shape, 2)
        self._hottest = limits[..., 0] - settings.temperature_margin
        self._lowest = limits[..., 1] + settings.voltage_margin
        self._seen = robot.health_readings.copy()
        self._hot, self._low = np.zeros(shape, dtype=int), 0

    def check(self, monitor: SafetyMonitor) -> tuple[Reaction, str]:
        """Return a reaction to the last readings, and the sentence on its cause."""
        robot, settings = self._robot, self._settings
        new = robot.health_readings != self._seen
        self._seen = robot.health_readings.copy()
        self._hot[new] = np.where(robot.temperature > self._hottest, self._hot + 1, 0)[new]
        low = new & (robot.voltage < self._lowest)
        if new.any():
            # All servos have one supply.
            self._low = self._low + int(low.sum()) if (low == new).all() else 0
        lost = ~robot.running.all(axis=1)
        if robot.is_silent:
            return Reaction.HOLD, f"no servo answers for {SILENCE:g} s"
        if self._low >= DEBOUNCE:
            return Reaction.SIT, f"the supply is {robot.voltage[low].min():.1f} V"
        if self._hot.max() >= DEBOUNCE:
            k = int(np.argmax(self._hot))
            warm = robot.temperature.flat[k]
            return Reaction.SIT, f"the servo of {robot.names[k]} has {warm:.0f} °C"
        if lost.sum() > settings.lost_legs:
            names = " and ".join(robot.robot.leg_names[k] for k in np.flatnonzero(lost))
            return Reaction.SIT, f"the legs {names} have servos that do not run"
        limp = robot.running & ~robot.has_torque
        if limp.any():
            name = robot.names[int(np.argmax(limp))]
            return Reaction.LIMP, f"the servo of {name} has restarted, and is limp"
        if monitor.mode is Mode.SIT:
            return Reaction.SIT, "the safety monitor lets the robot sit down"
        return Reaction.NONE, ""
