"""A simulated run with prescribed joints under the paper's contact law."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
from jaxtyping import Float, Shaped

from phasmid.dynamics import BodyMotion, inverse_dynamics
from phasmid.errors import InvalidInput
from phasmid.experiment import Experiment
from phasmid.kinematics import quaternion_rotation
from phasmid.motion import SampledMotion
from phasmid.simulation.contact import point_radius
from phasmid.simulation.drives import Drive, Setpoints
from phasmid.simulation.run import BLOCK_STEPS, Run
from phasmid.simulation.simscape.legs import leg_rows
from phasmid.simulation.simscape.trunk import Constants, advance
from phasmid.simulation.start import longest_time_step, start_offset

SUBSTEP = 1 / 12
"""A substep as a share of the longest time step that resolves the contact. On the paper's walk the
normal forces are then within 0.003 N rms of those of very small ones."""


class SimscapeRun(Run):
    """A walk with prescribed joints under the contact law of the paper's library.

    Samples are those of MuJoCo: positions, velocities, the feet's forces and positions, torques.

    Attributes:
        law: The contact law with the robot's numbers.
        constants: Of robot, contact law and integration.
        pose: Position and quaternion of the body frame (7).
        twist: Velocity in world axes and angular velocity in body axes (6).
        acceleration: Linear and angular acceleration of the body frame, world axes, of the buffer.
    """

    simulator = "phasmid, prescribed joints"

    def _set_up(self) -> None:
        experiment, robot = self.experiment, self.robot
        self.law = experiment.world.contact
        check_simscape(experiment)
        legs = len(robot.legs)
        # Widths of a sample, under MuJoCo's names.
        self.model = SimpleNamespace(nq=7 + 3 * legs, nv=6 + 3 * legs, nsensordata=7 * legs)
        # The joints' motion is in the rows of the legs.
        self.drive = Drive()
        self._tip_torque = np.zeros((BLOCK_STEPS, legs, 3))
        self.acceleration = np.zeros((BLOCK_STEPS, 6))
        self.constants = Constants(
            dt=self.dt,
            substeps=substeps(experiment),
            mass=robot.mass,
            weight=(0.0, 0.0, -robot.mass * experiment.world.gravity),
            stiffness=self.law.stiffness,
            damping=self.law.damping,
            static=experiment.world.terrain.coefficient,
            kinetic=min(self.law.kinetic_friction, experiment.world.terrain.coefficient),
            threshold=self.law.friction_threshold,
            # No two points of a foot are farther apart than the square's diagonal.
            size=1.5 * self.law.tip_width,
            radius=point_radius(robot, self.law),
        )

    def _physics(self) -> Float[np.ndarray, " physics"]:
        return np.concatenate([self.pose, self.twist])

    def _set_physics(self, state: Float[np.ndarray, " physics"]) -> None:
        self.pose[:], self.twist[:] = state[:7], state[7:]

    def _planned_targets(self, start: int, stop: int) -> Shaped[np.ndarray, " samples"]:
        walk = self.walk.sample(np.arange(start, stop + 1) * self.dt)
        return self._leg_rows(Setpoints(walk.q, walk.qd, walk.qdd))

    def _still(self, start: SampledMotion, count: int) -> Shaped[np.ndarray, " samples"]:
        q = np.repeat(start.q, count + 1, axis=0)
        return self._leg_rows(Setpoints(q, np.zeros_like(q), np.zeros_like(q)))

    def _leg_rows(self, joints: Setpoints) -> Shaped[np.ndarray, " samples"]:
        return leg_rows(self.robot, joints, self.law, self.dt)

    def _place(self, start: SampledMotion) -> None:
        self.pose = np.concatenate([start.trunk.position[0], start.trunk.quaternion[0]])
        self.pose[2] += start_offset(self.experiment, start)
        self.twist = np.zeros(6)
        self._advance(self._still(start, 1), last=True)
        self.first = self.buffer[:1].copy()

    def _set_going(self, start: SampledMotion) -> None:
        self.pose[:2] = start.trunk.position[0, :2]
        self.twist[:3] = start.trunk.velocity[0]
        self.twist[3:] = start.trunk.rotation[0].T @ start.trunk.angular_velocity[0]

    def _advance(
        self, targets: Shaped[np.ndarray, " samples"], *, at: int = 0, last: bool = False
    ) -> int:
        """Make one step per row of the legs, and return the number of steps made."""
        del at
        count, log = len(targets), self.buffer
        log["qpos"][:count, 7:] = targets["q"].reshape(count, -1)
        log["qvel"][:count, 6:] = targets["qd"].reshape(count, -1)
        advance(
            targets["trunk"],
            targets["legs"],
            self.constants,
            last,
            self.pose,
            self.twist,
            log[:count],
            self._tip_torque[:count],
            self.acceleration[:count],
        )
        self._compute_torque(targets)
        return count

    def _compute_torque(self, rows: Shaped[np.ndarray, " samples"]) -> None:
        """Compute the joint torques of the motion under the feet's forces by inverse dynamics."""
        log, (count, legs, _) = self.buffer, rows["q"].shape
        log["torque"][:count] = np.nan
        state = np.hstack([log["qpos"][:count], log["qvel"][:count], self.acceleration[:count]])
        finite = np.isfinite(state).all(axis=1)
        good = slice(0, count if finite.all() else int(np.argmin(finite)))
        R = quaternion_rotation(log["qpos"][good, 3:7])
        body = BodyMotion(
            position=log["qpos"][good, :3],
            rotation=R,
            velocity=log["qvel"][good, :3],
            angular_velocity=(R @ log["qvel"][good, 3:6, None])[..., 0],
            acceleration=self.acceleration[good, :3],
            angular_acceleration=self.acceleration[good, 3:],
        )
        torque = inverse_dynamics(
            self.robot,
            body,
            *(rows[name][good] for name in ("q", "qd", "qdd")),
            foot_force=log["sensors"][good, : 4 * legs].reshape(-1, legs, 4)[..., 1:],
            gravity=self.experiment.world.gravity,
        ).joint_torque
        log["torque"][good] = (torque - self._tip_torque[good]).reshape(-1, 3 * legs)


def check_simscape(experiment: Experiment) -> None:
    """Refuse experiments that this simulator cannot run.

    Raises:
        InvalidInput: The drive is another, or the ground is not level and alike everywhere.
    """
    ground, drive = experiment.world.terrain, experiment.solver.planned_drive
    if ground.patches or not ground.is_level:
        raise InvalidInput(
            f'terrain is "{experiment.world.kind}"; under contact_law = "simscape" it must be '
            "level ground without patches, since its simulator has no other.",
            hint='terrain = "flat", or contact_law = "spring-damper"',
        )
    if drive != "prescribed":
        raise InvalidInput(
            f'drive is "{drive}"; under contact_law = "simscape" it must be "prescribed", since '
            "its simulator has no other drive.",
            hint='drive = "prescribed", or contact_law = "spring-damper"',
        )


def substeps(experiment: Experiment) -> int:
    """Return the number of substeps of a time step."""
    return math.ceil(experiment.solver.time_step / (SUBSTEP * longest_time_step(experiment)))
