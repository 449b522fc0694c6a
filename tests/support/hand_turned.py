"""A robot on emulated servos whose joints a test turns, as a user does by hand."""

import time

import numpy as np

from phasmid.hardware import Emulator, make_servos, model
from phasmid.hardware.emulated_servo import Reading

BAUD = 1_000_000

PATIENCE = 0.25
"""Latency for which clients wait [s]: the answers come at once, unless the machine is busy."""


class HandTurned:
    """Servos behind known directions and zeros, which stay where they are turned to.

    Args:
        robot: The robot.
        servo_model: Name of the servos' model.
        seed: Of directions and zeros.
    """

    dt = 1e-3

    def __init__(self, robot, servo_model, seed=0):
        rng, limits = np.random.default_rng(seed), robot.arrays.joint_limits.reshape(-1, 2)
        self.scale = model(servo_model).register("present_position").scale
        self.direction = rng.choice([-1, 1], len(limits))
        # The middles of joints and servos differ by up to 10 degrees, no whole number of steps.
        shift = np.radians(rng.uniform(-10, 10, len(limits)))
        self.zero = shift - self.direction * limits.mean(axis=1)
        self.position = self.zero.copy()

    def advance(self, *_):
        pass

    set_law = heat = advance

    def reading(self, index):
        return Reading(position=float(self.position[index]))


class Bench:
    """An emulator of such a robot.

    Args:
        robot: The robot.
        servo_model: Name of the servos' model.
        faults: Faults of the bus.
    """

    def __init__(self, robot, servo_model="AX-12A", faults=()):
        self.plant = HandTurned(robot, servo_model)
        servos = make_servos(servo_model, range(1, len(self.plant.zero) + 1), baud=BAUD)
        for servo in servos:
            servo["return_delay_time"] = 0
        self.emulator = Emulator(servos, self.plant, faults=faults)
        self.reads = 0
        last, handle = servos[-1], servos[-1].handle

        def counted(packet, now):
            self.reads += 1
            return handle(packet, now)

        last.handle = counted

    def __enter__(self):
        self.emulator.start()
        return self

    def __exit__(self, *_):
        self.emulator.close()

    def turn(self, angles):
        """Turn all joints to angles [rad]; return when the servos' tables hold them."""
        plant = self.plant
        plant.position = plant.zero + plant.direction * np.ravel(angles)
        readings = lambda: [servo.reading.position for servo in self.emulator.servos]  # noqa: E731
        until(lambda: readings() == list(plant.position))

    def turn_watched(self, angles):
        """Turn all joints; return when a client that reads all servos has seen it."""
        self.turn(angles)
        # The second read of the last servo from now ends a round that began after the turn.
        seen = self.reads
        until(lambda: self.reads >= seen + 2)


def until(condition, within=60.0):
    end = time.monotonic() + within
    while not condition():
        assert time.monotonic() < end, "the other side does not answer"
        time.sleep(1e-3)
