"""Observations of the simulated robot: the true state, or the sensors' readings."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float

from phasmid.experiment import Observation
from phasmid.recording.channels import OBSERVED
from phasmid.servo.law_kernels import Shutdown
from phasmid.simulation.channels import sample_channels
from phasmid.simulation.faults import Faults
from phasmid.simulation.loop import present_sample
from phasmid.simulation.sensors.depth import DepthSensor
from phasmid.simulation.sensors.measurement import SensorStream
from phasmid.simulation.sensors.models import INVERSE, ROUNDING, robot_sensors
from phasmid.simulation.servo_drive import ServoDrive

if TYPE_CHECKING:
    from phasmid.simulation.run import Run


class Observer:
    """Observes the simulated robot, without error or by the scenario's sensors, and with faults.

    Without error or delay, angles, velocities, gyro and orientation are those of the instant.
    Forces, contacts and loads are those of the last step. The accelerometer measures the mean over
    that step. A sensor reads a force or a load at the end of the step in which it acts, so that a
    reading arrives one time step late at the earliest.

    Args:
        run: The run whose robot is observed.
        faults: Faults of its robot.
    """

    def __init__(self, run: Run, faults: Faults) -> None:
        self._run, self._faults = run, faults
        self._shutdown = None
        if isinstance(run.drive, ServoDrive):
            self._shutdown = run.drive.servos.reshape(-1, 3)["shutdown"]
        self._streams: list[SensorStream] = []
        self._interval, self._velocity = run.every * run.dt, np.zeros(3)
        if run.experiment.sensors.measured == "everything":
            first = sample_channels(run, present_sample(run.model, run.data, run.drive))
            first["body_acceleration"] = np.zeros((1, 3))
            sensors = robot_sensors(run.experiment)
            self._streams = [SensorStream(sensor, self._interval, first) for sensor in sensors]
        self._frozen: dict[int, dict[str, np.ndarray]] = {}
        self._depth: DepthSensor | None = None
        if run.experiment.sensors.depth != "none":
            self._depth = DepthSensor(run.experiment.sensors, run.robot, run.ground)
        # Number of depth readings, and the times at which they arrive.
        self._depth_readings, self._points = 0, deque[tuple[float, np.ndarray]]()

    def take(self, begin: int, end: int, step: int) -> None:
        """Let the sensors read new samples of the run's buffer.

        Args:
            begin: The first new row of the buffer.
            end: One after the last.
            step: Index of the first row's time step.
        """
        if not self._streams:
            return
        every, buffer = self._run.every, self._run.buffer
        last = (step + end - begin - 1) // every
        velocity = buffer["qvel"][:, :3]
        for row in range(-(-step // every), last + 1):
            at = begin + row * every - step
            streams = [stream for stream in self._streams if stream.next_row == row]
            if streams:
                channels = sample_channels(self._run, buffer[at : at + 1])
                interval = row * self._interval - (row - 1) * self._interval
                change = velocity[at] - self._velocity if row else np.zeros(3)
                channels["body_acceleration"] = change[None] / interval
                for stream in streams:
                    stream.take(channels)
            self._velocity = velocity[at].copy()

    def observe(
        self,
        time: float,
        works: Bool[np.ndarray, "legs 3"],
        velocity_before: Float[np.ndarray, "3"],
    ) -> Observation:
        """Observe the robot before a step.

        Args:
            time: Of the controller's clock [s].
            works: Servos that have not failed, shape (L, 3).
            velocity_before: Of the body one step earlier, world axes [m/s], shape (3,).
        """
        observation = self._observe(time, works, velocity_before)
        if self._depth is None:
            return observation
        return replace(observation, ground_points=self._ground_points(time, self._depth))

    def _observe(
        self,
        time: float,
        works: Bool[np.ndarray, "legs 3"],
        velocity_before: Float[np.ndarray, "3"],
    ) -> Observation:
        """Return the observation without the depth sensor; arguments as in `observe`."""
        running = (
            works.copy() if self._shutdown is None else works & (self._shutdown == Shutdown.NONE)
        )
        true = None
        if not self._streams:
            true = self._true(time, running, velocity_before)
            if not self._faults.of_sensors:
                return true
        measured = self._measured(time, true)
        if self._faults.of_sensors:
            self._freeze(time, true)
            rows = {name: values[None] for name, values in measured.items()}
            rows = self._faults.apply(rows, np.array([time]), self._frozen)
            measured = {name: values[0] for name, values in rows.items()}
        fields: dict[str, Any] = {OBSERVED[name]: value for name, value in measured.items()}
        if true is None:
            # Most servos do not report a velocity.
            return Observation(time=time, servo_running=running, **fields)
        assert true.joint_velocity is not None
        # The encoder measures the velocity too: one that is stuck measures none.
        position = fields["joint_position"]
        failed = np.where(np.isfinite(position), 0.0, np.nan)
        sound = position == true.joint_position
        fields["joint_velocity"] = np.where(sound, true.joint_velocity, failed)
        return replace(true, **fields)

    def _ground_points(self, time: float, sensor: DepthSensor) -> np.ndarray | None:
        """Read the depth sensor if a reading is due [s]; return the newest that arrives now."""
        sampling = sensor.sampling
        if time >= self._depth_readings / sampling.rate - ROUNDING:
            self._depth_readings = math.floor((time + ROUNDING) * sampling.rate) + 1
            self._points.append((time + sampling.delay, sensor.read(self._run.data.qpos[:7])))
        points = None
        while self._points and self._points[0][0] <= time + ROUNDING:
            points = self._points.popleft()[1]
        return points

    def _true(
        self,
        time: float,
        running: Bool[np.ndarray, "legs 3"],
        velocity_before: Float[np.ndarray, "3"],
    ) -> Observation:
        """Return the observation without error or delay."""
        import mujoco

        run, data, legs = self._run, self._run.data, len(self._run.robot.legs)
        # Copies, since the controller may keep them.
        qpos, qvel, sensors = data.qpos.copy(), data.qvel.copy(), data.sensordata.copy()
        contact, orientation = sensors[: 4 * legs].reshape(legs, 4), qpos[3:7]
        if run.ground.faces_up:
            normal_force = contact[:, 3]
        else:
            foot = sensors[4 * legs :].reshape(legs, 3)
            normal = run.ground.normal(foot[:, 0], foot[:, 1])
            normal_force = np.sum(contact[:, 1:] * normal, axis=1)
        specific_force = (qvel[:3] - velocity_before) / run.dt
        specific_force[2] += run.experiment.world.gravity
        acceleration = np.empty(3)
        mujoco.mju_rotVecQuat(acceleration, specific_force, orientation * INVERSE)
        return Observation(
            time=time,
            joint_position=qpos[7:].reshape(legs, 3),
            joint_velocity=qvel[6:].reshape(legs, 3),
            joint_load=run.drive.output().reshape(legs, 3),
            servo_running=running,
            orientation=orientation,
            # MuJoCo keeps a free body's angular velocity in body axes.
            angular_velocity=qvel[3:6],
            acceleration=acceleration,
            contact=contact[:, 0] > 0,
            foot_normal_force=np.maximum(normal_force, 0.0),
        )

    def _measured(self, time: float, true: Observation | None) -> dict[str, np.ndarray]:
        if self._streams:
            return {name: x for each in self._streams for name, x in each.measured(time).items()}
        return {name: getattr(true, field) for name, field in OBSERVED.items()}

    def _freeze(self, time: float, true: Observation | None) -> None:
        """Keep the readings of sensors that get stuck now."""
        interval = self._interval
        for number, fault in enumerate(self._faults.faults):
            if fault.kind == "stuck" and number not in self._frozen and fault.time <= time + 1e-9:
                # As in a recording: at the last of its samples before the fault.
                moment = math.floor(fault.time / interval + 1e-6) * interval
                measured = self._measured(moment, true)
                self._frozen[number] = {name: np.copy(each) for name, each in measured.items()}
