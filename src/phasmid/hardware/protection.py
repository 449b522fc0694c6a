"""Protection of a robot on a bus: which readings make it hold, sit down or go limp."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, fields
from enum import IntEnum
from typing import Literal

import numpy as np

from phasmid.control import Mode, SafetyMonitor
from phasmid.control.sequences.leg_loss import LOSS_TIME
from phasmid.errors import InvalidInput
from phasmid.hardware.robot_bus import CONFIRMED, SILENCE, RobotBus

DEBOUNCE = 3
"""Readings in a row of one servo that confirm its temperature or supply. A single one may be
damaged without being detected."""


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
        ramp_time: Time in which the output limits are raised at the start, and lowered after
            sitting down [s].
        hold_time: Time of holding after which it sits down, or goes limp where the driver's process
            has ended [s].
        sit_time: Longest time for sitting down, holds included [s].
        off_time: Longest time for which torque off is sent until all servos confirm it [s].
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
    off_time: float = 3.0
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
        # The last readings of temperature and supply of each servo.
        self._recent = np.full((DEBOUNCE, 2, *shape), np.nan)
        self._runs_at = np.full(shape, time.monotonic())
        self._lost = np.zeros(shape[0], dtype=bool)

    @property
    def hottest(self) -> float:
        """Highest temperature of the servos, the median of `DEBOUNCE` readings [°C]."""
        return float(np.median(self._recent[:, 0], axis=0).max())

    @property
    def lowest_voltage(self) -> float:
        """Lowest supply of the servos, the median of `DEBOUNCE` readings [V]."""
        return float(np.median(self._recent[:, 1], axis=0).min())

    def check(self, monitor: SafetyMonitor) -> tuple[Reaction, str]:
        """Return a reaction to the last readings, and the sentence on its cause."""
        robot, settings, now = self._robot, self._settings, time.monotonic()
        new = robot.health_readings != self._seen
        self._seen = robot.health_readings.copy()
        latest = np.stack([robot.temperature, robot.voltage])
        self._recent[:, :, new] = np.concatenate([self._recent[1:], latest[None]])[:, :, new]
        is_hot = (self._recent[:, 0] > self._hottest).all(axis=0)
        is_low = (self._recent[:, 1] < self._lowest).all(axis=0)
        if robot.is_silent:
            self._runs_at[:] = now
            return Reaction.HOLD, f"no servo answers for {SILENCE:g} s"
        self._runs_at[robot.running] = now
        # As for the controller, a leg that was lost stays lost.
        self._lost |= (now - self._runs_at > LOSS_TIME).any(axis=1)
        if (robot.limp >= CONFIRMED).any():
            name = robot.names[int(np.argmax(robot.limp))]
            return Reaction.LIMP, f"the servo of {name} has restarted, and is limp"
        if is_low.any():
            k = int(np.argmax(is_low))
            return Reaction.SIT, f"the supply of {robot.names[k]} is {robot.voltage.flat[k]:.1f} V"
        if is_hot.any():
            k = int(np.argmax(is_hot))
            warm = robot.temperature.flat[k]
            return Reaction.SIT, f"the servo of {robot.names[k]} has {warm:.0f} °C"
        if self._lost.sum() > settings.lost_legs:
            names = " and ".join(robot.robot.leg_names[k] for k in np.flatnonzero(self._lost))
            return Reaction.SIT, f"the legs {names} have servos that do not run"
        if monitor.mode is Mode.SIT:
            return Reaction.SIT, "the safety monitor lets the robot sit down"
        return Reaction.NONE, ""
