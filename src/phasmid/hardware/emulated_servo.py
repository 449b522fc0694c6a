"""An emulated servo: its control table, and its answers to instructions as the manuals say."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

from phasmid.hardware.control_table import Model, Register
from phasmid.hardware.packets import BROADCAST, Instruction, Packet
from phasmid.hardware.status import (
    NONE,
    StatusError,
    error_byte,
    hardware_byte,
    hardware_error,
)
from phasmid.servo import Servo

STOPPED = -1
"""Value of ``bus_watchdog`` after it has stopped the servo."""

PROTECTION_PERIOD = 0.01
"""Time from one look at errors to the next [s]."""

STILL = 0.03
"""Distance from the goal within which a servo no longer moves [rad]."""

GOALS = "goal_position", "goal_velocity", "goal_current", "goal_pwm"
"""Registers that cannot be written after the watchdog has stopped the servo."""

HARDWARE_ERRORS = StatusError.VOLTAGE | StatusError.OVERHEATING | StatusError.OVERLOAD
"""Errors of the servo itself, which may shut it down."""


class Answer(NamedTuple):
    """Status packet of a servo: error byte and data."""

    error: int
    data: bytes = b""


class Setting(NamedTuple):
    """What the registers set.

    Attributes:
        id: Id on the bus.
        baud: Baud rate at which it listens [1/s].
        return_delay: Time from an instruction to the answer [s].
        enabled: Whether the motor is on.
        goal: Goal [rad from the middle].
        speed: Largest speed [rad/s].
    """

    id: int
    baud: float
    return_delay: float
    enabled: bool
    goal: float
    speed: float


class Reading(NamedTuple):
    """State of a servo at its output: angle [rad], speed [rad/s], load, current, supply, heat.

    Attributes:
        position: Angle from the servo's middle [rad].
        velocity: Speed [rad/s].
        load: Output, as a share of the full one.
        current: Current [A].
        temperature: Temperature [°C].
        voltage: Supply [V].
        overloaded: Whether it was at its largest output for too long.
    """

    position: float = 0.0
    velocity: float = 0.0
    load: float = 0.0
    current: float = 0.0
    temperature: float = 25.0
    voltage: float = 12.0
    overloaded: bool = False


@dataclass
class Refusal(Exception):
    """An instruction that a servo refuses."""

    error: StatusError


class EmulatedServo:
    """A servo on the bus.

    Protocol 1.0 has no error for what its manual does not define: writing a read-only register,
    a part of a register, or an address outside of the table is a range error here. Gaps of the
    table read as 0. Position modes are emulated; the operating modes of velocity and PWM hold.

    Args:
        model: The model.
        id_: Id on the bus.
        baud: Baud rate that it is set to [1/s].
        servo: Servo whose law the registers set.

    Attributes:
        memory: The control table.
        law_changed: Whether a setting of the servo's law was written.
    """

    def __init__(self, model: Model, id_: int, *, baud: float, servo: Servo) -> None:
        self.model, self.servo, self.protocol = model, servo, model.protocol
        self.memory = bytearray(model.size)
        self.law_changed = True
        self._kept: Setting | None = None
        self.reading = Reading()
        self._by_address = {r.address: r for r in model.registers.values()}
        for register in model.registers.values():
            self._put(register, register.initial)
        self["id"], self["baud_rate"] = id_, model.baud_value(baud)
        self._latched = NONE
        self._goal: float | None = None
        self._heard = self._now = self._checked = 0.0
        self._start()

    # Registers -----------------------------------------------------------------------------------

    def __getitem__(self, name: str) -> int:
        """Return the value of a register."""
        register = self.model.register(name)
        return register.from_bytes(self.memory[register.address : register.end])

    def __setitem__(self, name: str, value: int) -> None:
        """Set a register, without any check."""
        register = self.model.register(name)
        self._put(register, value)
        if register.writable:
            self._kept = None

    def _put(self, register: Register, value: int) -> None:
        self.memory[register.address : register.end] = register.to_bytes(value)

    def _set_si(self, name: str, value: float) -> None:
        """Set a register that is present to an SI value, within what its bytes hold."""
        register = self.model.registers[name]
        most = (1 << 8 * register.size - register.signed) - 1
        if register.sign_bit:
            most = 1023
        least = -most if register.signed or register.sign_bit else 0
        self._put(register, min(max(register.from_si(value), least), most))

    @property
    def id(self) -> int:
        """Id on the bus."""
        return self._setting().id

    @property
    def baud(self) -> float:
        """Baud rate at which it listens [1/s]."""
        return self._setting().baud

    @property
    def return_delay(self) -> float:
        """Time from an instruction to the answer [s]."""
        return self._setting().return_delay

    # Motion --------------------------------------------------------------------------------------

    @property
    def enabled(self) -> bool:
        """Whether the motor is on."""
        return self._setting().enabled

    @property
    def torque_limit(self) -> float:
        """Largest output, as a share of the full one."""
        if self.protocol == 1:
            return self["torque_limit"] / 1023
        return min(self["pwm_limit"], abs(self["goal_pwm"])) / 885

    def _setting(self) -> Setting:
        """Return what the registers set, which is kept until a register is written."""
        if self._kept is None:
            goal, speed = (self.model.register(name) for name in ("goal_position", "goal_speed"))
            value = self["goal_speed"] % 1024 if self.protocol == 1 else self["goal_speed"]
            delay = self.model.register("return_delay_time")
            self._kept = Setting(
                self["id"],
                self.model.baud_of(self["baud_rate"]),
                delay.to_si(self["return_delay_time"]),
                bool(self["torque_enable"]) and self.torque_limit > 0,
                goal.to_si(self["goal_position"]),
                speed.to_si(value) or math.inf,
            )
        return self._kept

    def law(self) -> Servo:
        """Return the servo with the settings of its registers."""
        servo, limit = self.servo, max(self.torque_limit, 1e-3)
        if self.model.family == "AX":
            return replace(
                servo,
                compliance_margin=(self["cw_compliance_margin"], self["ccw_compliance_margin"]),
                compliance_slope=(self["cw_compliance_slope"], self["ccw_compliance_slope"]),
                punch=self["punch"],
                torque_limit=limit,
            )
        if self.model.family == "MX":
            gain = servo.p_gain * self["p_gain"] / self.model.register("p_gain").initial
            return replace(servo, p_gain=gain, torque_limit=limit)
        return replace(
            servo,
            p_gain=self["position_p_gain"],
            d_gain=self["position_d_gain"],
            torque_limit=limit,
        )

    def advance_goal(self, dt: float) -> float:
        """Return the goal after a time [s], moved on at the set speed [rad from the middle]."""
        *_, enabled, goal, speed = self._setting()
        if not enabled:
            self._goal = None
            return goal
        start = self.reading.position if self._goal is None else self._goal
        self._goal = min(max(goal, start - speed * dt), start + speed * dt)
        return self._goal

    def update(self, reading: Reading, now: float) -> None:
        """Take the state of the motion, and protect the servo.

        Args:
            reading: State of the servo.
            now: Time [s].
        """
        self.reading, self._now = reading, now
        if now >= self._checked + PROTECTION_PERIOD or now < self._checked:
            self._checked = now
            self._protect()
            if self.protocol == 2:
                self._watch(now)

    def _refresh(self) -> None:
        """Write the state of the motion into the registers, which somebody reads."""
        reading = self.reading
        self._set_si("present_position", reading.position)
        self._set_si("present_speed", reading.velocity)
        is_current = "current_limit" in self.model.registers
        self._set_si("present_load", reading.current if is_current else reading.load)
        self._set_si("present_voltage", reading.voltage)
        self._set_si("present_temperature", reading.temperature)
        *_, enabled, goal, _ = self._setting()
        self["moving"] = int(enabled and abs(goal - reading.position) > STILL)
        if "realtime_tick" in self.model.registers:
            self["realtime_tick"] = int(self._now * 1000) % 32768
        if self.protocol == 2:
            self["present_pwm"] = round(885 * reading.load)

    def _watch(self, now: float) -> None:
        """Stop where the bus has been silent for longer than the watchdog's time."""
        limit = self["bus_watchdog"]
        if limit > 0 and self.enabled and now - self._heard > limit * 0.02:
            self["bus_watchdog"] = STOPPED
            self["goal_speed"] = self["profile_acceleration"] = 0
            self._refresh()
            self["goal_position"] = self["present_position"]
            self._kept = None

    def hardware_error(self) -> StatusError:
        """Return the present and latched errors of the servo itself."""
        error, reading = self._latched, self.reading
        names = "min_voltage_limit", "max_voltage_limit"
        low, high = (self.model.register(name).to_si(self[name]) for name in names)
        if not low <= round(reading.voltage, 1) <= high:
            error |= StatusError.VOLTAGE
        if reading.temperature >= self["temperature_limit"]:
            error |= StatusError.OVERHEATING
        return error

    def _protect(self) -> None:
        """Latch an overload, and shut down on the errors of the register ``shutdown``."""
        if self.reading.overloaded and self.enabled:
            self._latched |= StatusError.OVERLOAD
        error, mask = self.hardware_error(), self["shutdown"]
        if self.protocol == 2:
            # Hardware errors stay until the servo is rebooted.
            self._latched |= error
            self["hardware_error_status"] = hardware_byte(error)
        fatal = StatusError(mask) & HARDWARE_ERRORS if self.protocol == 1 else hardware_error(mask)
        if self.enabled and error & fatal:
            if self.protocol == 1:
                self["torque_limit"] = 0
            else:
                self["torque_enable"] = 0
            self.law_changed, self._kept = True, None

    def latch(self, error: StatusError) -> None:
        """Latch a hardware error, as a fault does."""
        self._latched |= error
        self._protect()

    # Power ---------------------------------------------------------------------------------------

    def reboot(self) -> None:
        """Start anew: RAM takes its initial values, and latched errors end."""
        for register in self.model.registers.values():
            if register.address >= self.model.ram and register.writable:
                self._put(register, register.initial)
        self._start()

    def _start(self) -> None:
        """Set what power-on sets from other registers."""
        self._latched, self._goal, self._kept = NONE, None, None
        self._refresh()
        self["goal_position"] = self["present_position"]
        if self.protocol == 1:
            self["torque_limit"] = self["max_torque"]
        else:
            self["goal_pwm"], self["hardware_error_status"] = self["pwm_limit"], 0
        self.law_changed, self._kept = True, None

    # Instructions --------------------------------------------------------------------------------

    def handle(self, packet: Packet, now: float) -> Answer | None:
        """Execute an instruction that is for this servo.

        Instructions for several servos, sync and bulk, come through `read_answer` and `write`.

        Args:
            packet: The instruction, with this servo's id or the broadcast id.
            now: Time [s].

        Returns:
            The answer, or None where the servo does not answer.
        """
        self._heard = now
        is_broadcast = packet.id == BROADCAST
        if not packet.intact:
            return None if is_broadcast else self._answered(StatusError.CHECKSUM, level=2)
        error, data, level = NONE, b"", 2
        try:
            match packet.instruction:
                case Instruction.PING:
                    level = 0
                    if self.protocol == 2:
                        model = self["model_number"].to_bytes(2, "little")
                        data = model + bytes([self["firmware_version"]])
                case Instruction.READ:
                    level = 1
                    data = self._read(packet.parameters)
                case Instruction.WRITE:
                    self._write(packet.parameters)
                case Instruction.REBOOT if self.protocol == 2:
                    self.reboot()
                case _:
                    raise Refusal(StatusError.INSTRUCTION)
        except Refusal as refusal:
            error, data = refusal.error, b""
        if is_broadcast and (packet.instruction != Instruction.PING or self.protocol == 1):
            return None
        return self._answered(error, data, level=level)

    def read_answer(self, address: int, length: int, now: float) -> Answer | None:
        """Return the answer to a sync or bulk read."""
        self._heard = now
        try:
            return self._answered(NONE, self._bytes(address, length), level=1)
        except Refusal as refusal:
            return self._answered(refusal.error, level=1)

    def write(self, address: int, content: bytes, now: float) -> None:
        """Execute the servo's part of a sync or bulk write, which nobody answers."""
        self._heard = now
        try:
            self._check_write(address, content)
        except Refusal:
            return
        self._store(address, content)

    def _answered(self, error: StatusError, data: bytes = b"", *, level: int) -> Answer | None:
        """Return an answer if the status return level permits one."""
        if self["status_return_level"] < level:
            return None
        if self.protocol == 1:
            error |= self.hardware_error()
        elif self["hardware_error_status"]:
            error |= StatusError.ALERT
        return Answer(error_byte(self.protocol, error), data)

    def _read(self, parameters: bytes) -> bytes:
        width = self.protocol
        if len(parameters) != 2 * width:
            raise Refusal(StatusError.RANGE if self.protocol == 1 else StatusError.LENGTH)
        address, length = (int.from_bytes(parameters[k : k + width], "little") for k in (0, width))
        return self._bytes(address, length)

    def _bytes(self, address: int, length: int) -> bytes:
        """Return a part of the control table."""
        if length < 1 or address + length > self.model.size:
            raise Refusal(StatusError.RANGE if self.protocol == 1 else StatusError.ACCESS)
        self._refresh()
        return bytes(self.memory[address : address + length])

    def _write(self, parameters: bytes) -> None:
        width = self.protocol
        if len(parameters) <= width:
            raise Refusal(StatusError.RANGE if self.protocol == 1 else StatusError.LENGTH)
        address, content = int.from_bytes(parameters[:width], "little"), parameters[width:]
        self._check_write(address, content)
        self._store(address, content)

    def _written(self, address: int, content: bytes) -> Iterable[tuple[Register, int]]:
        """Yield the registers that a write reaches, and their new values.

        Raises:
            Refusal: It reaches a part of a register, or an address without one.
        """
        end, first = address + len(content), address
        while address < end:
            register = self._by_address.get(address)
            if register is None:
                raise Refusal(StatusError.RANGE if self.protocol == 1 else StatusError.ACCESS)
            if register.end > end:
                raise Refusal(StatusError.RANGE if self.protocol == 1 else StatusError.LENGTH)
            yield register, register.from_bytes(content[address - first : register.end - first])
            address = register.end

    def _check_write(self, address: int, content: bytes) -> None:
        """Refuse a write that the manual forbids."""
        is_first = self.protocol == 1
        for register, value in list(self._written(address, content)):
            is_rom = register.address < self.model.ram
            locked = self["lock"] if is_first else self["torque_enable"]
            if not register.writable or (is_rom and locked):
                raise Refusal(StatusError.RANGE if is_first else StatusError.ACCESS)
            if register.name == "lock" and self["lock"] and not value:
                raise Refusal(StatusError.RANGE)
            if is_first and register.name == "goal_position" and register.limits:
                low, high = (self[name] for name in register.limits)
                if not low <= value <= high:
                    raise Refusal(StatusError.ANGLE_LIMIT)
            if not register.low <= value <= register.high:
                raise Refusal(StatusError.RANGE)
            if is_first:
                continue
            if register.name in GOALS and self["bus_watchdog"] == STOPPED:
                raise Refusal(StatusError.RANGE)
            if not self._is_within_limits(register, value):
                raise Refusal(StatusError.LIMIT)

    def _is_within_limits(self, register: Register, value: int) -> bool:
        """Return whether a value is within the limits that other registers set."""
        limits = [self[name] for name in register.limits]
        if len(limits) == 2:
            return limits[0] <= value <= limits[1]
        return not limits or abs(value) <= limits[0]

    def _store(self, address: int, content: bytes) -> None:
        """Write bytes that have been checked, and do what the registers cause."""
        names = {register.name for register, _ in self._written(address, content)}
        self._kept = None
        self.memory[address : address + len(content)] = content
        if self.protocol == 1:
            if "goal_position" in names:
                # A goal switches the motor of these series on.
                self["torque_enable"] = 1
            if "torque_limit" in names:
                self._latched &= ~StatusError.OVERLOAD
        self.law_changed |= not names <= {"goal_position", "goal_speed", "led"}
