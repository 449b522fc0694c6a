"""What emulated servos move: pendulums on a bench, or a simulated robot.

The emulator advances a plant in real time and reads the servos' state from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from jaxtyping import Bool, Float

from phasmid.compiled import compiled
from phasmid.control.sequences import packing
from phasmid.hardware.calibration import ServoCalibration
from phasmid.hardware.emulated_servo import Reading
from phasmid.scenario import Scenario
from phasmid.servo import Servo
from phasmid.servo.law import SERVO_STATE, servo_parameters
from phasmid.servo.law_kernels import Shutdown, servo_step
from phasmid.simulation.run import Run
from phasmid.simulation.start import standing, with_time_step

STEP = 1e-3
"""Time step of a bench [s]."""

INERTIA, GRAVITY_TORQUE = 1e-3, 0.1
"""Pendulum of a bench: 100 g at 0.1 m [kg·m², N·m]."""

SUPPLY = 12.0
"""Supply of a bench [V]."""


class Plant(Protocol):
    """Motion of S servos, whose angles count from their middle.

    Attributes:
        dt: Time step [s].
    """

    dt: float

    def set_law(self, index: int, servo: Servo) -> None:
        """Set law and supply of a servo."""

    def advance(
        self, steps: int, goal: Float[np.ndarray, " servos"], enabled: Bool[np.ndarray, " servos"]
    ) -> None:
        """Advance by time steps towards the goals [rad]; servos that are not enabled are limp."""

    def reading(self, index: int) -> Reading:
        """Return the state of a servo."""

    def heat(self, index: int, temperature: float) -> None:
        """Set the temperature of a servo [°C]."""


@compiled
def _step(
    goal: np.ndarray,
    position: np.ndarray,
    velocity: np.ndarray,
    parameters: np.ndarray,
    servos: np.ndarray,
    delayed: np.ndarray,
    delays: np.ndarray,
    torque: np.ndarray,
) -> None:
    """Advance each servo by one step with its own parameters; compiled."""
    limits = np.array([[-1e3], [1e3]])
    for j in range(len(goal)):
        servo_step(
            goal[j : j + 1],
            position[j : j + 1],
            velocity[j : j + 1],
            limits,
            parameters[j : j + 1],
            servos[j : j + 1],
            delayed[j : j + 1, : delays[j]],
            torque[j : j + 1],
        )


class ServoBank:
    """The law, motor and gears of S servos, each with its own settings.

    Args:
        servos: The servos.
        dt: Time step [s].
        position: Angles at the start [rad], shape (S,).
    """

    def __init__(
        self,
        servos: Sequence[Servo],
        dt: float,
        position: Float[np.ndarray, " servos"],
    ) -> None:
        self.dt, count = dt, len(servos)
        self.state = np.zeros(count, SERVO_STATE)
        self.state["angle"] = position
        self.state["temperature"] = [servo.ambient_temperature for servo in servos]
        self.torque = np.zeros(count)
        self.voltage = np.array([servo.voltage for servo in servos])
        self._delays = np.array([round(servo.delay / dt) for servo in servos])
        self._delayed = np.repeat(position[:, None], self._delays.max(), axis=1)
        self._parameters = np.concatenate([servo_parameters(servo, dt) for servo in servos])

    def set_law(self, index: int, servo: Servo) -> None:
        """Set the settings and the supply of a servo."""
        self._parameters[index] = servo_parameters(servo, self.dt)[0]
        self.voltage[index] = servo.voltage

    def step(
        self,
        goal: Float[np.ndarray, " servos"],
        enabled: Bool[np.ndarray, " servos"],
        position: Float[np.ndarray, " servos"],
        velocity: Float[np.ndarray, " servos"],
    ) -> None:
        """Advance all servos by one step, and set `torque`."""
        code = self.state["shutdown"]
        # A shutdown of the law itself ends with the torque.
        code[~enabled] = Shutdown.TORQUE_OFF
        code[enabled & (code == Shutdown.TORQUE_OFF)] = Shutdown.NONE
        _step(
            goal,
            position,
            velocity,
            self._parameters,
            self.state,
            self._delayed,
            self._delays,
            self.torque,
        )

    def reading(self, index: int, position: float, velocity: float) -> Reading:
        """Return the state of a servo at an angle [rad] and speed [rad/s] of its output."""
        row = self.state[index]
        return Reading(
            position=position,
            velocity=velocity,
            load=float(row["duty"]),
            current=float(row["current"]),
            temperature=float(row["temperature"]),
            voltage=float(self.voltage[index]),
            overloaded=bool(row["shutdown"] == Shutdown.OVERLOAD),
        )

    def heat(self, index: int, temperature: float) -> None:
        """Set the temperature of a servo [°C]."""
        self.state["temperature"][index] = temperature


class Bench:
    """Servos on a bench, each with a pendulum that hangs down at the servo's middle.

    Args:
        servos: The servos.
    """

    def __init__(self, servos: Sequence[Servo]) -> None:
        self.dt = STEP
        self.position, self.velocity = np.zeros((2, len(servos)))
        at_supply = [servo.at(SUPPLY) for servo in servos]
        self._bank = ServoBank(at_supply, STEP, self.position)
        self.set_law, self.heat = self._bank.set_law, self._bank.heat

    def advance(
        self, steps: int, goal: Float[np.ndarray, " servos"], enabled: Bool[np.ndarray, " servos"]
    ) -> None:
        """Advance by time steps towards the goals [rad]."""
        for _ in range(steps):
            self._bank.step(goal, enabled, self.position, self.velocity)
            torque = self._bank.torque - GRAVITY_TORQUE * np.sin(self.position)
            self.velocity += self.dt / INERTIA * torque
            self.position += self.dt * self.velocity

    def reading(self, index: int) -> Reading:
        """Return the state of a servo."""
        return self._bank.reading(index, float(self.position[index]), float(self.velocity[index]))


class SimulatedRobot:
    """A robot in MuJoCo on the ground of a scenario; its joints are driven by servos.

    Its joints stop at their limits, which a limp leg reaches.

    Args:
        scenario: Robot, ground and simulation. The robot begins on its belly with its legs folded,
            where ``start_posture`` is ``packed``, else on its feet.
        calibration: The servos, leg by leg.
    """

    def __init__(self, scenario: Scenario, calibration: Sequence[ServoCalibration]) -> None:
        experiment = scenario.replace(drive="servo").build()
        robot, is_packed = experiment.robot, experiment.solver.start_posture == "packed"
        start = standing(experiment, packing(robot).folded if is_packed else None)
        self.run = Run(with_time_step(experiment, start), start, endless=True)
        self.dt, data = self.run.dt, self.run.data
        self.run.model.jnt_limited[1:] = 1
        self.run.model.jnt_range[1:] = robot.arrays.joint_limits.reshape(-1, 2)
        self._q, self._qd, self._applied = data.qpos[7:], data.qvel[6:], data.qfrc_applied[6:]
        self._sign = np.array([c.direction for c in calibration], dtype=float)
        self._zero = np.array([c.zero for c in calibration])
        self._bank = ServoBank([robot.servo] * len(calibration), self.dt, self.position)
        self.set_law, self.heat = self._bank.set_law, self._bank.heat

    @property
    def position(self) -> Float[np.ndarray, " servos"]:
        """Angles of the servos from their middle [rad]."""
        return self._zero + self._sign * self._q

    def advance(
        self, steps: int, goal: Float[np.ndarray, " servos"], enabled: Bool[np.ndarray, " servos"]
    ) -> None:
        """Advance by time steps towards the goals [rad]."""
        import mujoco

        run = self.run
        for _ in range(steps):
            self._bank.step(goal, enabled, self.position, self._sign * self._qd)
            self._applied[:] = self._sign * self._bank.torque
            if run.foot_ground.varies:
                run.foot_ground.update()
            mujoco.mj_step(run.model, run.data)

    def reading(self, index: int) -> Reading:
        """Return the state of a servo."""
        sign = self._sign[index]
        position = float(self._zero[index] + sign * self._q[index])
        return self._bank.reading(index, position, float(sign * self._qd[index]))
