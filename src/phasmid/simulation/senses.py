"""What a controller is told of the simulated robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float

from phasmid.control import Observation
from phasmid.simulation.servo import FIELDS

if TYPE_CHECKING:
    from phasmid.simulation.run import Run


class TrueSenses:
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
        self._legs = len(run.robot.legs)
        self._gravity = run.scenario.model.gravity
        self._stall = run.robot.servo.stall_torque
        self._own = run.scenario.simulation.drive == "servo"
        self._away = np.zeros(4)

    def observe(
        self,
        time: float,
        running: Bool[np.ndarray, "legs 3"],
        velocity_before: Float[np.ndarray, "3"],
    ) -> Observation:
        """The robot as it is before a step.

        Args:
            time: On the controller's clock [s].
            running: Which servos answer, shape (L, 3).
            velocity_before: Of the body a step earlier, world axes [m/s], shape (3,).
        """
        run, legs, data = self._run, self._legs, self._run.data
        rows = data.sensordata[: 4 * legs].reshape(legs, 4)
        force = rows[:, 1:]
        if run.ground.is_level:
            normal_force = force[:, 2].copy()
        else:
            foot = data.sensordata[4 * legs : 7 * legs].reshape(legs, 3)
            normal = run.ground.normal(foot[:, 0], foot[:, 1])
            normal_force = np.sum(force * normal, axis=1)
        if self._own:
            load = run.drive.state.reshape(len(FIELDS), legs, 3)[FIELDS.index("duty")].copy()
        else:
            load = run.drive.torque().reshape(legs, 3) / self._stall
        orientation = data.qpos[3:7].copy()
        return Observation(
            time=time,
            joint_position=data.qpos[7:].reshape(legs, 3).copy(),
            joint_velocity=data.qvel[6:].reshape(legs, 3).copy(),
            joint_load=load,
            servo_running=running,
            orientation=orientation,
            # The engine keeps a free body's angular velocity in its own axes.
            angular_velocity=data.qvel[3:6].copy(),
            acceleration=self._specific_force(orientation, velocity_before),
            contact=rows[:, 0] > 0,
            foot_normal_force=normal_force,
        )

    def _specific_force(self, orientation: np.ndarray, velocity_before: np.ndarray) -> np.ndarray:
        """By the accelerometer, body axes [m/s²]."""
        force = (self._run.data.qvel[:3] - velocity_before) / self._run.dt
        force[2] += self._gravity
        told = np.empty(3)
        self._engine.mju_negQuat(self._away, orientation)
        self._engine.mju_rotVecQuat(told, force, self._away)
        return told
