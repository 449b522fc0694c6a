"""What a controller is told of the simulated robot."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float

from phasmid.control import Observation
from phasmid.sensors.measurement import SensorStream
from phasmid.simulation.channels import run_channels
from phasmid.simulation.faults import Faults
from phasmid.simulation.samples import Samples
from phasmid.simulation.servo import FIELDS, RUNNING

if TYPE_CHECKING:
    from phasmid.simulation.run import Run


class TrueObservation:
    """Senses without error or delay.

    Angles, speeds and the inertial sensor's readings are those of the instant; forces, contacts and
    loads those of the step that led to it, as no later ones have happened. The accelerometer tells
    the mean over that step.

    Args:
        run: The run whose robot is observed.
    """

    def __init__(self, run: Run) -> None:
        import mujoco

        self._run, self._engine = run, mujoco
        legs, data = len(run.robot.legs), run.data
        self._gravity = run.scenario.model.gravity
        self._stall, self._shape = run.robot.servo.stall_torque, (legs, 3)
        self._away = np.zeros(4)
        # Views of the engine's memory, which stays: it takes long to make a new one.
        self._q, self._qd = (part.reshape(legs, 3) for part in (data.qpos[7:], data.qvel[6:]))
        self._orientation, self._rate = data.qpos[3:7], data.qvel[3:6]
        self._velocity = data.qvel[:3]
        rows = data.sensordata[: 4 * legs].reshape(legs, 4)
        self._touch, self._force = rows[:, 0], rows[:, 1:]
        self._foot = data.sensordata[4 * legs : 7 * legs].reshape(legs, 3)
        self._upright = run.ground.faces_up
        self._duty: np.ndarray | None = None
        if run.scenario.simulation.drive == "servo":
            rows = run.drive.state.reshape(-1, legs, 3)
            self._duty, self._shutdown = (rows[FIELDS.index(k)] for k in ("duty", "shutdown"))

    def observe(
        self,
        time: float,
        running: Bool[np.ndarray, "legs 3"],
        velocity_before: Float[np.ndarray, "3"],
    ) -> Observation:
        """The robot as it is before a step.

        Args:
            time: On the controller's clock [s].
            running: Which servos have not died, shape (L, 3).
            velocity_before: Of the body a step earlier, world axes [m/s], shape (3,).
        """
        if self._upright:
            normal_force = np.maximum(self._force[:, 2], 0.0)
        else:
            normal = self._run.ground.normal(self._foot[:, 0], self._foot[:, 1])
            normal_force = np.maximum(np.sum(self._force * normal, axis=1), 0.0)
        if self._duty is not None:
            running = running & (self._shutdown == RUNNING)
            load = self._duty.copy()
        else:
            load = self._run.drive.torque().reshape(self._shape) / self._stall
        orientation = self._orientation.copy()
        return Observation(
            time=time,
            joint_position=self._q.copy(),
            joint_velocity=self._qd.copy(),
            joint_load=load,
            servo_running=running,
            orientation=orientation,
            # The engine keeps a free body's angular velocity in its own axes.
            angular_velocity=self._rate.copy(),
            acceleration=self._specific_force(orientation, velocity_before),
            contact=self._touch > 0,
            foot_normal_force=normal_force,
        )

    def _specific_force(self, orientation: np.ndarray, velocity_before: np.ndarray) -> np.ndarray:
        """By the accelerometer, body axes [m/s²]."""
        force = (self._velocity - velocity_before) / self._run.dt
        force[2] += self._gravity
        told = np.empty(3)
        self._engine.mju_negQuat(self._away, orientation)
        self._engine.mju_rotVecQuat(told, force, self._away)
        return told


OBSERVED = {
    "joint_position_measured": "joint_position",
    "joint_load_measured": "joint_load",
    "imu_angular_velocity": "angular_velocity",
    "imu_acceleration": "acceleration",
    "imu_orientation": "orientation",
    "foot_normal_force_measured": "foot_normal_force",
    "contact_measured": "contact",
}
"""Channels of measurements, and where an observation has them."""


class MeasuredObservation:
    """Senses as the scenario's sensors tell them, and with faults.

    A force or a load is read at the end of the step in which it acts, so that a reading arrives a
    time step after its moment at the earliest.

    Args:
        run: The run whose robot is observed.
        faults: Of its robot.
    """

    def __init__(self, run: Run, faults: Faults) -> None:
        self._run, self._faults = run, faults
        self._true = TrueObservation(run)
        self._stream: SensorStream | None = None
        if run.scenario.sensors.measured == "everything":
            self._stream = SensorStream(run.scenario, run.robot, run.time)
            self._stream.begin(self._seen_now())
        self._frozen: dict[int, dict[str, np.ndarray]] = {}

    @property
    def are_true(self) -> bool:
        """Whether they tell the truth, at once."""
        return self._stream is None and not self._faults.of_sensors

    def _seen_now(self) -> dict[str, np.ndarray]:
        """Channels of the robot at rest, before the first step."""
        run = self._run
        now = Samples.empty(run.model, run.drive, 1)
        now.write(0, run.data, run.drive)
        return run_channels(run, now, {})

    def take(self, begin: int, end: int, step: int) -> None:
        """Let the sensors read what has happened.

        Args:
            begin: The first of the buffer's samples that is new.
            end: The one after the last.
            step: Index of the first's time step.
        """
        stream, run = self._stream, self._run
        if stream is None:
            return
        for at in range(begin + -step % run.every, end, run.every):
            row = (step + at - begin) // run.every
            if stream.needs(row):
                sample = run.buffer.part(slice(at, at + 1))
                stream.take(row, run_channels(run, sample, {}))
            else:
                stream.skip(run.buffer.qvel[at, :3].copy())

    def observe(
        self,
        time: float,
        running: Bool[np.ndarray, "legs 3"],
        velocity_before: Float[np.ndarray, "3"],
    ) -> Observation:
        """What the controller is told; arguments as in `TrueObservation.observe`."""
        true = self._true.observe(time, running, velocity_before)
        spoilt = self._faults.of_sensors
        if self._stream is None and not spoilt:
            return true
        if spoilt:
            self._freeze(time, true)
        told = self._told(time, true)
        if spoilt:
            rows = {name: values[None] for name, values in told.items()}
            rows = self._faults.spoil(rows, np.array([time]), self._frozen)
            told = {name: values[0] for name, values in rows.items()}
        changes: dict[str, Any] = {OBSERVED[name]: value for name, value in told.items()}
        if self._stream is not None:
            # Most servos tell no speed.
            changes["joint_velocity"] = None
        elif spoilt and true.joint_velocity is not None:
            # A speed is told by the encoder too.
            moves = changes["joint_position"] == true.joint_position
            off = np.where(np.isfinite(changes["joint_position"]), 0.0, np.nan)
            changes["joint_velocity"] = np.where(moves, true.joint_velocity, off)
        return replace(true, **changes)

    def _told(self, time: float, true: Observation) -> dict[str, np.ndarray]:
        if self._stream is not None:
            return self._stream.measured(time)
        return {name: getattr(true, field) for name, field in OBSERVED.items()}

    def _freeze(self, time: float, true: Observation) -> None:
        """Keep what sensors tell that get stuck now."""
        interval = self._run.every * self._run.dt
        for number, fault in enumerate(self._faults.faults):
            if fault.kind != "stuck" or number in self._frozen or fault.time > time + 1e-9:
                continue
            # As a recording has it: at the last of its samples before the fault.
            moment = math.floor(fault.time / interval + 1e-6) * interval
            self._frozen[number] = {
                name: np.copy(value) for name, value in self._told(moment, true).items()
            }
