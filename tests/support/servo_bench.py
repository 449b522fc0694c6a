"""A servo on a test bench: one joint with an inertia, a load, and nothing else."""

from dataclasses import replace

import numpy as np

from phasmid.servo.law import SERVO_STATE, servo_parameters
from phasmid.servo.law_kernels import servo_step


class Bench:
    """One servo whose output carries an inertia [kg m^2] and lifts a load [N m]."""

    def __init__(
        self, servo, dt=1e-3, voltage=12.0, inertia=3e-3, load=0.0, ambient=25.0, delayed=False
    ):
        servo = servo if delayed else replace(servo, delay=0.0)
        self.servo, self.dt, self.inertia, self.load = servo, dt, inertia, load
        servo = replace(servo, supply=voltage, ambient_temperature=ambient)
        self.parameters = servo_parameters(servo, dt)
        self.limits = np.array([[-1e3], [1e3]])
        self.state, self.delayed = np.zeros(1, SERVO_STATE), np.zeros((1, round(servo.delay / dt)))
        self["temperature"] = ambient
        self.angle, self.speed, self.torque = np.zeros(1), np.zeros(1), np.zeros(1)

    def __getitem__(self, name):
        return float(self.state[name][0])

    def __setitem__(self, name, value):
        self.state[name] = value

    def put(self, angle):
        """Place the output and the rotor."""
        self.angle[0] = angle
        self["angle"] = angle

    def step(self, goal, *, blocked=False):
        """One step, as the engine makes it; a blocked output stays where it is."""
        servo_step(
            np.array([goal]),
            self.angle,
            self.speed,
            self.limits,
            self.parameters,
            self.state,
            self.delayed,
            self.torque,
        )
        if not blocked:
            self.speed += self.dt / self.inertia * (self.torque - self.load)
            self.angle += self.dt * self.speed

    def run(self, time, goal, *, blocked=False):
        """Many steps to one goal."""
        for _ in range(round(time / self.dt)):
            self.step(goal, blocked=blocked)
