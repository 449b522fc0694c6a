"""What a controller observes of the simulated robot: the true state, or the sensors' readings."""

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
from phasmid.simulation.loop import Samples
from phasmid.simulation.servo import FIELDS, RUNNING

if TYPE_CHECKING:
    from phasmid.simulation.run import Run

OBSERVED = {
    "joint_position_measured": "joint_position",
    "joint_load_measured": "joint_load",
    "imu_angular_velocity": "angular_velocity",
    "imu_acceleration": "acceleration",
    "imu_orientation": "orientation",
    "foot_normal_force_measured": "foot_normal_force",
    "contact_measured": "contact",
}
"""Measured channels, and their fields of an observation."""


class TrueObservation:
    """Observations without error or delay.

    Angles, velocities, gyro and orientation are those of the instant. Forces, contacts and loads
    are those of the last step. The accelerometer measures the mean over that step.

    Args:
        run: The run whose robot is observed.
    """

    def __init__(self, run: Run) -> None:
        import mujoco

        self._run, self._mujoco, data = run, mujoco, run.data
        legs = len(run.robot.legs)
        self._legs, self._shape = legs, (legs, 3)
        self._arrays = data.qpos, data.qvel, data.sensordata
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
        """Observe the robot before a step.

        Args:
            time: Of the controller's clock [s].
            running: Servos that have not failed, shape (L, 3).
            velocity_before: Of the body one step earlier, world axes [m/s], shape (3,).
        """
        run, legs = self._run, self._legs
        qpos, qvel, sensors = (array.copy() for array in self._arrays)
        contact, orientation = sensors[: 4 * legs].reshape(legs, 4), qpos[3:7]
        if run.ground.faces_up:
            normal_force = contact[:, 3]
        else:
            foot = sensors[4 * legs :].reshape(legs, 3)
            normal = run.ground.normal(foot[:, 0], foot[:, 1])
            normal_force = np.sum(contact[:, 1:] * normal, axis=1)
        if self._duty is None:
            load = run.drive.torque().reshape(self._shape) / run.robot.servo.stall_torque
        else:
            running = running & (self._shutdown == RUNNING)
            load = self._duty.copy()
        specific_force = (qvel[:3] - velocity_before) / run.dt
        specific_force[2] += run.scenario.model.gravity
        acceleration, inverse = np.empty(3), np.empty(4)
        self._mujoco.mju_negQuat(inverse, orientation)
        self._mujoco.mju_rotVecQuat(acceleration, specific_force, inverse)
        return Observation(
            time=time,
            joint_position=qpos[7:].reshape(self._shape),
            joint_velocity=qvel[6:].reshape(self._shape),
            joint_load=load,
            servo_running=running,
            orientation=orientation,
            # MuJoCo keeps a free body's angular velocity in body axes.
            angular_velocity=qvel[3:6],
            acceleration=acceleration,
            contact=contact[:, 0] > 0,
            foot_normal_force=np.maximum(normal_force, 0.0),
        )


class MeasuredObservation:
    """Observations by the scenario's sensors, and with sensor faults.

    A force or a load is read at the end of the step in which it acts, so that a reading arrives
    one time step late at the earliest.

    Args:
        run: The run whose robot is observed.
        faults: Faults of its robot.
    """

    def __init__(self, run: Run, faults: Faults) -> None:
        self._run, self._faults, self._true = run, faults, TrueObservation(run)
        self._stream: SensorStream | None = None
        if run.scenario.sensors.measured == "everything":
            self._stream = SensorStream(run.scenario, run.robot, run.time)
            now = Samples.empty(run.model, run.drive, 1)
            now.write(0, run.data, run.drive)
            self._stream.begin(run_channels(run, now))
        self._frozen: dict[int, dict[str, np.ndarray]] = {}

    def take(self, begin: int, end: int, step: int) -> None:
        """Let the sensors read new samples of the run's buffer.

        Args:
            begin: The first new row of the buffer.
            end: One after the last.
            step: Index of the first row's time step.
        """
        stream, run = self._stream, self._run
        if stream is None:
            return
        for at in range(begin + -step % run.every, end, run.every):
            row = (step + at - begin) // run.every
            if stream.needs(row):
                stream.take(row, run_channels(run, run.buffer.part(slice(at, at + 1))))
            else:
                stream.skip(run.buffer.qvel[at, :3].copy())

    def observe(
        self,
        time: float,
        running: Bool[np.ndarray, "legs 3"],
        velocity_before: Float[np.ndarray, "3"],
    ) -> Observation:
        """Observe the robot before a step; arguments as in `TrueObservation.observe`."""
        true, faulty = self._true.observe(time, running, velocity_before), self._faults.of_sensors
        if self._stream is None and not faulty:
            return true
        if faulty:
            self._freeze(time, true)
        measured = self._measured(time, true)
        if faulty:
            rows = {name: values[None] for name, values in measured.items()}
            rows = self._faults.apply(rows, np.array([time]), self._frozen)
            measured = {name: values[0] for name, values in rows.items()}
        changes: dict[str, Any] = {OBSERVED[name]: value for name, value in measured.items()}
        if self._stream is not None:
            # Most servos do not report a velocity.
            changes["joint_velocity"] = None
        elif true.joint_velocity is not None:
            # The encoder measures the velocity too: one that is stuck measures none.
            position = changes["joint_position"]
            failed = np.where(np.isfinite(position), 0.0, np.nan)
            works = position == true.joint_position
            changes["joint_velocity"] = np.where(works, true.joint_velocity, failed)
        return replace(true, **changes)

    def _measured(self, time: float, true: Observation) -> dict[str, np.ndarray]:
        if self._stream is not None:
            return self._stream.measured(time)
        return {name: getattr(true, field) for name, field in OBSERVED.items()}

    def _freeze(self, time: float, true: Observation) -> None:
        """Keep the readings of sensors that get stuck now."""
        interval = self._run.every * self._run.dt
        for number, fault in enumerate(self._faults.faults):
            if fault.kind == "stuck" and number not in self._frozen and fault.time <= time + 1e-9:
                # As in a recording: at the last of its samples before the fault.
                moment = math.floor(fault.time / interval + 1e-6) * interval
                measured = self._measured(moment, true)
                self._frozen[number] = {name: np.copy(each) for name, each in measured.items()}
