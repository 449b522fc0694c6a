"""A servo bus in virtual time: the emulator without thread and pseudo-terminal, for exact tests."""

from contextlib import contextmanager

import numpy as np

from phasmid.control.sequences import packing
from phasmid.experiment import Command
from phasmid.hardware import (
    Bus,
    Driver,
    DriverSettings,
    Emulator,
    RobotBus,
    default_calibration,
    make_servos,
    model,
)
from phasmid.hardware.emulated_servo import Reading
from phasmid.hardware.port import READ_TIMEOUT
from phasmid.scenario import load_scenario
from phasmid.simulation.drive import scenario_controller

BAUD = 1_000_000
ROUND_OFF = 1e-6
"""Time by which an advance of the motion comes later than its step [s]."""

CALL = 2e-6
"""Time that a look at the clock takes [s], so that waiting loops end."""


class VirtualTime:
    """The module `time` with a clock that passes only in calls, and moves the emulator."""

    def __init__(self, emulator):
        self.now, self.emulator, self.actions = 0.0, emulator, []

    def monotonic(self):
        self.sleep(CALL)
        return self.now

    perf_counter = monotonic

    def sleep(self, duration):
        end = self.now + duration
        while self.now < end:
            stop = min([self.emulator.next_stop, *(at for at, _ in self.actions)])
            if stop > end:
                self.now = end
                return
            self.now = max(self.now, stop)
            self.emulator.pass_until(self.now)
            for at, action in [one for one in self.actions if one[0] <= self.now]:
                self.actions.remove((at, action))
                action()

    def at(self, when, action):
        """Call an action at a time [s]."""
        self.actions.append((when, action))


class FollowingPlant:
    """Servos that turn to their goals without error, and stay where they are without torque."""

    dt = 5e-3

    def __init__(self, count):
        self.position, self.velocity = np.zeros(count), np.zeros(count)
        self.temperature, self.voltage = np.full(count, 25.0), np.full(count, 12.0)

    def set_law(self, index, servo):
        self.voltage[index] = servo.voltage

    def advance(self, steps, goal, enabled):
        way = np.clip(goal - self.position, -6.0 * steps * self.dt, 6.0 * steps * self.dt)
        self.velocity = np.where(enabled, way, 0.0) / (steps * self.dt)
        self.position = self.position + np.where(enabled, way, 0.0)

    def reading(self, index):
        return Reading(
            position=float(self.position[index]),
            velocity=float(self.velocity[index]),
            temperature=float(self.temperature[index]),
            voltage=float(self.voltage[index]),
        )

    def heat(self, index, temperature):
        self.temperature[index] = temperature


def folded(name="AX-12A"):
    """Return servos that turn to their goals, and begin with the robot's legs folded."""
    robot = load_scenario("paper").replace(robot="phantomx-ax").load_robot()
    plant, rows = FollowingPlant(18), default_calibration(robot, model(name))
    angles = packing(robot).folded.ravel()
    plant.position = np.array([r.zero + r.direction * q for r, q in zip(rows, angles, strict=True)])
    return plant


def goal_of(servo):
    """Return the goal in a servo's register [rad]."""
    return servo.model.register("goal_position").to_si(servo["goal_position"])


class VirtualEmulator(Emulator):
    """The emulator, advanced by `VirtualTime`; keeps what the servos were set to."""

    def __init__(self, servos, plant=None, **arguments):
        super().__init__(servos, plant, **arguments)
        self.buffer, self.history = bytearray(), []

    def _deliver(self, _, data):
        self.buffer += data

    @property
    def next_stop(self):
        """Time of the next event or advance of the motion [s]."""
        event = self._events[0][0] if self._events else np.inf
        return min(event, self._simulated + self.plant.dt + ROUND_OFF)

    def pass_until(self, now):
        while self._events and self._events[0][0] <= now:
            self._happen()
        if now - self._simulated > self.plant.dt:
            self._advance(now)
            state = [(one.enabled, goal_of(one), one.reading.position) for one in self.servos]
            self.history.append((self._simulated, *np.array(state, dtype=float).T))

    def traces(self):
        """Return times (N,), enabled (N, S), goals and positions [rad], (N, S)."""
        return tuple(np.array(column) for column in zip(*self.history, strict=True))


class VirtualPort:
    """The port of `phasmid.hardware.port`, on the emulator."""

    def __init__(self, clock, emulator, baud):
        self.clock, self.emulator, self.baudrate = clock, emulator, baud
        self.patience, self.is_open, self.is_using, self._deadline = 0.05, True, False, 0.0
        self.ser, self.lost = self, False

    def fileno(self):
        return -1

    def closePort(self):
        self.is_open = False

    def reopen(self):
        self._check()

    def getBaudRate(self):
        return self.baudrate

    def clearPort(self):
        self.emulator.buffer.clear()

    def writePort(self, packet):
        self._check()
        self.emulator._accept(bytes(packet), self.baudrate, self.clock.now)
        return len(packet)

    def readPort(self, length):
        self._check()
        end = self.clock.now + READ_TIMEOUT
        while len(self.emulator.buffer) < length and self.clock.now < end:
            self.clock.sleep(
                min(end, max(self.emulator.next_stop, self.clock.now + CALL)) - self.clock.now
            )
        data = bytes(self.emulator.buffer[:length])
        del self.emulator.buffer[:length]
        return data

    def _check(self):
        if self.lost:
            from phasmid.hardware.bus import PortLost

            self.is_using = False
            raise PortLost("virtual", "no such device")

    def setPacketTimeout(self, packet_length):
        del packet_length
        self._deadline = self.clock.now + self.patience

    def setPacketTimeoutMillis(self, msec):
        self._deadline = self.clock.now + msec / 1000

    def isPacketTimeout(self):
        return self.clock.monotonic() > self._deadline

    def drain(self, silence):
        self.clock.sleep(silence)
        self.emulator.buffer.clear()


@contextmanager
def virtual_bus(monkeypatch, *, name="AX-12A", faults=(), seed=0, plant=None, latency=1e-3):
    """Yield a bus on an emulated robot's servos, the emulator and the clock."""
    scenario = load_scenario("paper").replace(robot="phantomx-ax", drive="servo")
    robot = scenario.load_robot()
    servos = make_servos(name, range(1, 19), baud=BAUD)
    for servo in servos:
        servo["return_delay_time"] = 0
    plant = plant or FollowingPlant(len(servos))
    emulator = VirtualEmulator(servos, plant, latency=latency, faults=faults, seed=seed)
    clock = VirtualTime(emulator)
    for module in ("bus", "robot_bus", "driver", "protection", "torque_off"):
        monkeypatch.setattr(f"phasmid.hardware.{module}.time", clock)
    monkeypatch.setattr(
        "phasmid.hardware.port.Port",
        lambda path, baud, exclusive: VirtualPort(clock, emulator, baud),
    )
    calibration = default_calibration(robot, model(name))
    with Bus("virtual", BAUD, model(name).protocol, latency=latency) as bus:
        bus.scan(range(1, 19))
        yield scenario, robot, calibration, bus, emulator, clock


def new_driver(scenario, robot, calibration, bus, *, velocity=(0.06, 0.0, 0.0), **arguments):
    """Return a driver with the locomotion engine, whose process needs no guard."""
    rate = arguments.pop("rate", 50.0)
    settings = arguments.pop("settings", DriverSettings(after_exit="hold"))
    controller = arguments.pop("controller", None)
    controller = controller or scenario_controller(scenario, rate, ground_sensing=False)
    return Driver(
        RobotBus(bus, robot, calibration),
        scenario,
        controller,
        arguments.pop("commands", Command(velocity)),
        rate=rate,
        settings=settings,
        **arguments,
    )
