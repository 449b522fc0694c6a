"""The joints of a robot as servos on a bus."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from phasmid.errors import InvalidInput
from phasmid.experiment import Observation
from phasmid.hardware.bus import MONITORED, TRIES, Bus, BusError, ServoReading
from phasmid.hardware.calibration import ServoCalibration
from phasmid.hardware.rates import read_time
from phasmid.hardware.status import StatusError, hardware_error
from phasmid.hardware.torque_off import READ_BACK, switch_torque_off
from phasmid.motion.trajectory import joint_names
from phasmid.robot import Robot

SHUTDOWNS = StatusError.OVERHEATING | StatusError.OVERLOAD | StatusError.SHOCK
"""Errors with which a servo switches its motor off."""

SILENT_AFTER = 3
"""Readings in a row without an answer, after which a servo counts as silent. With 1 % of lost
packets this happens by chance once in 10⁶ readings."""

SILENCE = 0.1
"""Time without an answer of any servo, after which the bus counts as silent [s]."""

SILENT_SERVOS = 4
"""Servos that were asked in this time: more than the three of a leg, whose cable may be broken."""

DOUBTED_AFTER = 10
"""Answers in a row whose angles are not credible, after which a servo counts as failed. If one
answer in five has random data, this happens by chance once in 10⁷ readings."""

START_READINGS = 6
"""Most readings of a servo at the start, of which two must agree."""

CONFIRMED = 2
"""Readings in a row that report a shutdown, after which the servo counts as shut down."""

FAST = {1: MONITORED, 2: ("present_position", "present_load")}
"""Registers that are read most often, by protocol: those of protocol 2.0 lie far apart."""

HEALTH = "torque_enable", "hardware_error_status", "present_voltage", "present_temperature"
"""Registers of one servo in turn, where they are not read with the others."""

LONGEST_HEALTH_GAP = 0.1
"""Time after which one servo's health is read even where a period is too short for it [s]."""

RETRY = 0.1
"""Time after which a silent servo is read again [s]: each try costs the time of a lost answer."""

JUMP, AGREEMENT = np.radians(10), np.radians(3)
"""An angle is not credible if it is farther from the last one than the servo can turn and this
[rad], until a second reading in a row agrees with it within that distance [rad]."""


def servo_range(bus: Bus, row: ServoCalibration) -> ServoCalibration:
    """Return a servo with the range of its own position limits in place of the calibrated one."""
    names = "min_position_limit", "max_position_limit"
    low, high = (bus.read_raw(row.id, bus.model(row.id).register(name)) for name in names)
    return replace(row, range_min=low, range_max=high)


class RobotBus:
    """The joints of a robot as servos on a bus: targets in, readings out.

    Servos without a common read are read one after the other, as many as the time allows; the next
    call goes on with the others.

    Args:
        bus: The bus, with the models of all servos.
        robot: The robot, L legs.
        calibration: The servos, leg by leg.

    Attributes:
        names: Leg and joint of each servo, such as ``right_front.coxa``.
        ids: Ids of the servos, leg by leg.
        low: Lowest targets [rad], shape (L, 3): the limits of the robot and of the calibration.
        high: Highest targets [rad], shape (L, 3).
        position: Last credible angles of the joints [rad], shape (L, 3); NaN before the first.
        load: Last outputs, as shares of the largest, shape (L, 3).
        voltage: Last supplies [V], shape (L, 3); NaN before the first.
        temperature: Last temperatures [°C], shape (L, 3); NaN before the first.
        read_at: Times of these readings by the monotonic clock [s], shape (L, 3).
        misses: Readings in a row without an answer, shape (L, 3).
        doubts: Answers in a row whose angle is not credible, shape (L, 3).
        shutdowns: Readings in a row that report a shutdown, shape (L, 3).
        readings: Number of credible readings of the angle of each servo, shape (L, 3).
        health_readings: The same of supply and temperature, shape (L, 3).
        limp: Readings in a row of torque that is off without a shutdown, shape (L, 3); protocol 1.0
            does not read it, since a goal switches the torque on.
        has_shut_down: Servos that have shut down since the start, shape (L, 3).
        output_limit: Largest outputs that the servos have confirmed since the start, as shares of
            the full one, shape (L, 3); NaN before.
        answered_at: Time of the last answer of any servo [s].

    Raises:
        InvalidInput: The calibration has other joints than the robot.
    """

    def __init__(self, bus: Bus, robot: Robot, calibration: Sequence[ServoCalibration]) -> None:
        self.bus, self.robot, rows = bus, robot, list(calibration)
        self.names = tuple(joint_names(robot))
        if tuple(row.joint for row in rows) != self.names:
            raise InvalidInput(
                f"the calibration has other joints than {robot.name}.", hint="phasmid bus calibrate"
            )
        self.ids, shape = [row.id for row in rows], (len(robot.legs), 3)
        self._sign = np.array([row.direction for row in rows], dtype=float).reshape(shape)
        self._zero = np.array([row.zero for row in rows]).reshape(shape)
        self._models = [bus.model(id_) for id_ in self.ids]
        calibrated = [row.joint_range for row in rows]
        permitted = [servo_range(bus, row).joint_range for row in rows]
        ranges = [np.reshape(each, (*shape, 2)) for each in (calibrated, permitted)]
        limits = np.stack([*ranges, robot.arrays.joint_limits])
        self.low, self.high = limits[..., 0].max(axis=0), limits[..., 1].min(axis=0)
        self._full = {
            id_: bus.read(id_, "max_torque" if "max_torque" in model.registers else "pwm_limit")
            for id_, model in zip(self.ids, self._models, strict=True)
        }
        self._limit = "torque_limit" if "torque_limit" in self._models[0].registers else "goal_pwm"
        # The current at standstill of the full output, at the supply.
        stall = (robot.servo.stall_current or 1.0) * robot.servo.voltage / robot.servo.rated_voltage
        in_ampere = ["current_limit" in model.registers for model in self._models]
        self._load_scale = np.where(in_ampere, 1 / stall, 1.0)
        self.position, self.read_at = np.full(shape, np.nan), np.full(shape, -np.inf)
        self.load = np.zeros(shape)
        self.voltage, self.temperature = np.full((2, *shape), np.nan)
        self.misses, self.doubts, self.shutdowns, self.limp = np.zeros((4, *shape), dtype=int)
        self.readings, self.health_readings = np.zeros((2, *shape), dtype=int)
        self.has_shut_down = np.zeros(shape, dtype=bool)
        self.output_limit = np.full(shape, np.nan)
        self.answered_at = self._health_at = time.monotonic()
        self._doubted, self._tried = np.full(shape, np.nan), np.full(shape, -np.inf)
        self._queue = list(range(len(rows)))
        self._asked: set[int] = set()
        self._was_silent = np.zeros(shape, dtype=bool)
        self._limit_queue = list(range(len(rows)))
        self._common_read = all(model.reads != "single" for model in self._models)
        self._names = FAST[bus.protocol]
        self._delay = bus.read(self.ids[0], "return_delay_time")
        self._latency = bus.measure_latency(self.ids[0])
        self._read_time = self._time_of(self._names)
        self._health_time = self._time_of(HEALTH) if bus.protocol == 2 else 0.0

    def _time_of(self, names: Sequence[str]) -> float:
        """Return the time to read registers of one servo [s]."""
        registers = [self._models[0].register(name) for name in names]
        size = max(r.end for r in registers) - min(r.address for r in registers)
        return read_time(
            self._models[0],
            1,
            size,
            baud=self.bus.baud,
            return_delay=self._delay,
            latency=self._latency,
        )

    # Readings ------------------------------------------------------------------------------------

    @property
    def running(self) -> Bool[np.ndarray, "legs 3"]:
        """Servos that answer credibly and have not shut down, shape (L, 3)."""
        answers = (self.misses < SILENT_AFTER) & (self.doubts < DOUBTED_AFTER)
        return answers & (self.shutdowns < CONFIRMED)

    @property
    def is_silent(self) -> bool:
        """Whether no servo has answered for `SILENCE`, though several were asked."""
        asked = len(self._asked) >= min(SILENT_SERVOS, len(self.ids))
        return asked and time.monotonic() - self.answered_at > SILENCE

    def observe(self, clock: float) -> Observation:
        """Return the last readings as an observation at a time of the controller's clock [s].

        Of a silent bus it is not known which servos run.
        """
        return Observation(
            clock,
            self.position.copy(),
            joint_load=self.load.copy(),
            servo_running=None if self.is_silent else self.running,
        )

    def read_all(self) -> None:
        """Read each servo until a second reading confirms its angle, `START_READINGS` at most.

        Raises:
            BusError: Angle, supply or temperature of a servo is not known afterwards.
        """
        for _ in range(START_READINGS):
            for k in np.flatnonzero(self._is_unknown()).tolist():
                self._take(k, self.bus.read_all([self.ids[k]], self._names)[self.ids[k]])
                self._take_health(k)
        if self._is_unknown().any():
            k = int(np.argmax(self._is_unknown()))
            raise BusError(
                f"servo {self.ids[k]} ({self.names[k]}) gives no steady readings.",
                hint="check its cable, and that no two servos have this id",
            )

    def _is_unknown(self) -> Bool[np.ndarray, "legs 3"]:
        """Return the servos of which a reading is not known, shape (L, 3)."""
        return np.isnan(self.position) | np.isnan(self.voltage) | np.isnan(self.temperature)

    def read(self, until: float) -> None:
        """Read servos until a time of the monotonic clock [s], one at least.

        After a lost answer of a common read, the others are read at the next call.

        Raises:
            PortLost: The adapter is gone.
        """
        now, misses, tried = time.monotonic(), self.misses.ravel(), self._tried.ravel()
        due = [k for k in self._queue if misses[k] < SILENT_AFTER or now - tried[k] > RETRY]
        # Behind a lost answer of a common read all others are lost.
        due = sorted(due or self._queue, key=lambda k: misses[k] >= SILENT_AFTER)
        if self._common_read:
            readings = self.bus.read_all([self.ids[k] for k in due], self._names)
        for k in due:
            id_ = self.ids[k]
            if not self._common_read:
                readings = self.bus.read_all([id_], self._names)
            reading = readings[id_]
            self._take(k, reading)
            self._queue.remove(k)
            self._queue.append(k)
            if reading is None and self._common_read:
                return
            if not self._common_read and time.monotonic() + self._read_time > until:
                return
        now = time.monotonic()
        if self.bus.protocol == 1:
            return
        if now + self._health_time < until or now - self._health_at > LONGEST_HEALTH_GAP:
            self._health_at = now
            self._take_health(self._queue[0])
            # A common read leaves the order to the turns of the health.
            self._queue.append(self._queue.pop(0))

    def _take_health(self, k: int) -> None:
        """Read supply, temperature, torque and errors of a servo, where no other reading does."""
        if self.bus.protocol == 1:
            return
        reading, at = self.bus.read_all([self.ids[k]], HEALTH)[self.ids[k]], divmod(k, 3)
        if reading is None or not reading.values:
            return
        torque, errors, self.voltage[at], self.temperature[at] = reading.values.values()
        self.health_readings[at] += 1
        has_shut_down = bool(hardware_error(int(errors)) & SHUTDOWNS)
        self._take_shutdown(at, has_shut_down)
        self.limp[at] = 0 if torque or has_shut_down else self.limp[at] + 1

    def _take(self, k: int, reading: ServoReading | None) -> None:
        """Take the reading of a servo."""
        now, at = time.monotonic(), divmod(k, 3)
        self._tried[at] = now
        if reading is None or not reading.values:
            self.misses[at] += 1
            self._asked.add(k)
            return
        if self.is_silent:
            # The bus was silent, not these servos.
            self.misses[:] = np.where(self._was_silent, SILENT_AFTER, 0)
        self.answered_at = now
        self._asked.clear()
        self._was_silent = self.misses >= SILENT_AFTER
        angle, load, *health = (reading.values[name] for name in self._names)
        q = float(self._sign[at] * (angle - self._zero[at]))
        reach = self.robot.arrays.no_load_speed[at] * (now - self.read_at[at]) + JUMP
        is_known = abs(q - self.position[at]) < reach or abs(q - self._doubted[at]) < AGREEMENT
        self._doubted[at] = q
        self.misses[at] = 0
        if not is_known:
            self.doubts[at] += 1
            return
        self.doubts[at] = 0
        self.readings[at] += 1
        self.position[at], self.read_at[at] = q, now
        self.load[at] = self._sign[at] * self._load_scale[k] * load
        if health:
            self.voltage[at], self.temperature[at] = health
            self.health_readings[at] += 1
            self._take_shutdown(at, bool(reading.error & SHUTDOWNS))

    def _take_shutdown(self, at: tuple[int, int], is_reported: bool) -> None:
        """Take whether a servo reports a shutdown."""
        self.shutdowns[at] = self.shutdowns[at] + 1 if is_reported else 0
        self.has_shut_down[at] |= self.shutdowns[at] >= CONFIRMED

    # Settings and goals --------------------------------------------------------------------------

    def write_goals(self, q: Float[np.ndarray, "legs 3"], speed: float = 0.0) -> None:
        """Write goals, within the limits, with the servos' own speed limit [rad/s]; 0: none.

        Goals switch the torque of the AX and MX series on.
        """
        angles = (self._zero + self._sign * np.clip(q, self.low, self.high)).ravel()
        values = {id_: (angle, speed) for id_, angle in zip(self.ids, angles.tolist(), strict=True)}
        self.bus.write_all(("goal_position", "goal_speed"), values)

    def hold(self, k: int, speed: float) -> None:
        """Switch the torque of a servo on without output, with the measured angle as its goal.

        The servo confirms each write: a lost goal would turn it to an old one.

        Args:
            k: Number of the servo, leg by leg.
            speed: The servo's own speed limit [rad/s].

        Raises:
            BusError: The servo does not confirm.
        """
        id_, at = self.ids[k], divmod(k, 3)
        q = np.clip(self.position[at], self.low[at], self.high[at])
        self.bus.write(id_, self._limit, 0.0)
        self.bus.write(id_, "goal_speed", speed)
        self.bus.write(id_, "goal_position", float(self._zero[at] + self._sign[at] * q))
        self.bus.write(id_, "torque_enable", 1.0)
        # Before, it was limp.
        self.limp[at], self.output_limit[at] = 0, 0.0

    def switch_torque_off(self, duration: float, alive: Callable[[], object]) -> list[str]:
        """Send torque off until all servos confirm it, see `torque_off.switch_torque_off`.

        Args:
            duration: Longest time [s].
            alive: Called before each reading.

        Returns:
            Names of the servos that have not confirmed it.
        """
        remaining = switch_torque_off(self.bus, self.ids, duration, alive)
        return [name for name, id_ in zip(self.names, self.ids, strict=True) if id_ in remaining]

    def limit_output(self, share: float, until: float) -> None:
        """Write the output limit of servos in turn, one at least, until a time.

        The limit of the AX and MX series also ends a shutdown. Each write follows a reading of
        the same servo, and a servo that has shut down keeps its limit. Where a shutdown comes
        between reading and write, 3 ms, the servo runs again.

        Args:
            share: Largest output, as a share of the full one.
            until: Time of the monotonic clock [s].

        Raises:
            PortLost: The port fails.
        """
        shuts_down = (self.shutdowns > 0) | self.has_shut_down
        due = [
            k
            for k in self._limit_queue
            if self.output_limit.flat[k] != share and self.running.flat[k]
            if not shuts_down.flat[k]
        ]
        for k in due:
            id_, at = self.ids[k], divmod(k, 3)
            self._take(k, self.bus.read_all([id_], self._names)[id_])
            is_sound = not (self.misses[at] or self.doubts[at] or self.shutdowns[at])
            if is_sound and self.bus.write_once(id_, self._limit, share * self._full[id_]):
                self.output_limit[at] = share
            self._limit_queue.remove(k)
            self._limit_queue.append(k)
            if time.monotonic() > until:
                return

    def torque_is_on(self, alive: Callable[[], object]) -> bool | None:
        """Read whether the torque is on of all servos that run; None where one gives no answer.

        Args:
            alive: Called before each reading.

        Raises:
            PortLost: The port fails.
        """
        for k in np.flatnonzero(self.running).tolist():
            for _ in range(TRIES):
                alive()
                reading = self.bus.read_all([self.ids[k]], READ_BACK)[self.ids[k]]
                if reading is not None and reading.values:
                    break
            else:
                return None
            if not reading.values["torque_enable"]:
                return False
        return True
