"""A simulated run with prescribed joints under the paper's contact law."""

from __future__ import annotations

import math
from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np
from jaxtyping import Float, Shaped

from phasmid.dynamics import BodyMotion, inverse_dynamics
from phasmid.errors import InvalidInput
from phasmid.kinematics import quaternion_rotation
from phasmid.motion import SampledMotion
from phasmid.robot import Robot
from phasmid.scenario import Scenario
from phasmid.simulation.contact import POINT_RADIUS
from phasmid.simulation.drives import Drive, Setpoints
from phasmid.simulation.run import BLOCK_STEPS, Run
from phasmid.simulation.simscape.legs import leg_rows
from phasmid.simulation.simscape.trunk import Constants, advance
from phasmid.simulation.start import longest_time_step, start_offset
from phasmid.terrain import Blocky
from phasmid.terrain.ground import upright

SUBSTEP = 1 / 12
"""A substep as a share of the longest time step that resolves the contact. On the paper's walk the
normal forces are then within 0.003 N rms of those of very small ones."""

EDGE = 1e-3
"""Change of the ground's height under a foot in one step that makes an edge [m]. The planes under a
foot that slips at 1 m/s over a curve of 20 mm radius differ by 0.03 mm in a step of 1 ms."""

CHUNK = 32
"""Steps between two checks for Ctrl-C."""


class SimscapeRun(Run):
    """A walk with prescribed joints under the contact law of the paper's library.

    Samples are those of MuJoCo: positions, velocities, the feet's forces and positions, torques.

    Attributes:
        constants: Of robot, contact law and integration.
        pose: Position and quaternion of the body frame (7).
        twist: Velocity in world axes and angular velocity in body axes (6).
        planes: Ground under each leg, as of `trunk.contact`; updated before each step on uneven
            ground, but not over an edge that a foot has not cleared.
        acceleration: Linear and angular acceleration of the body frame, world axes, of the buffer.
    """

    simulator = "phasmid, prescribed joints"

    def _set_up(self) -> None:
        scenario, robot, contact = self.scenario, self.robot, self.scenario.contact
        check_prescribed(scenario)
        legs = len(robot.legs)
        # Widths of a sample, under MuJoCo's names.
        self.model = SimpleNamespace(nq=7 + 3 * legs, nv=6 + 3 * legs, nsensordata=7 * legs)
        # The joints' motion is in the rows of the legs.
        self.drive = Drive()
        self._tip_torque = np.zeros((BLOCK_STEPS, legs, 3))
        self.acceleration = np.zeros((BLOCK_STEPS, 6))
        self._is_uneven = bool(self.ground.patches) or not self.ground.is_level
        self.planes = np.zeros((legs, 5))
        self.constants = Constants(
            dt=self.dt,
            substeps=substeps(scenario, robot),
            mass=robot.mass,
            weight=(0.0, 0.0, -robot.mass * scenario.model.gravity),
            stiffness=contact.stiffness,
            damping=contact.law_damping,
            kinetic=contact.kinetic_friction,
            threshold=contact.friction_threshold,
            # No two points of a foot are farther apart than the square's diagonal.
            size=1.5 * contact.tip_width,
        )

    def _physics(self) -> Float[np.ndarray, " physics"]:
        # With the planes, since a foot may be beyond the edge of its own.
        return np.concatenate([self.pose, self.twist, self.planes.ravel()])

    def _set_physics(self, state: Float[np.ndarray, " physics"]) -> None:
        self.pose[:], self.twist[:] = state[:7], state[7:13]
        self.planes[:] = state[13:].reshape(self.planes.shape)

    def _planned_targets(self, start: int, stop: int) -> Shaped[np.ndarray, " samples"]:
        walk = self.walk.sample(np.arange(start, stop + 1) * self.dt)
        return self._leg_rows(Setpoints(walk.q, walk.qd, walk.qdd))

    def _still(self, start: SampledMotion, count: int) -> Shaped[np.ndarray, " samples"]:
        q = np.repeat(start.q, count + 1, axis=0)
        return self._leg_rows(Setpoints(q, np.zeros_like(q), np.zeros_like(q)))

    def _leg_rows(self, joints: Setpoints) -> Shaped[np.ndarray, " samples"]:
        return leg_rows(self.robot, joints, self.scenario.contact.tip_width, self.dt)

    def _place(self, start: SampledMotion) -> None:
        self.pose = np.concatenate([start.trunk.position[0], start.trunk.quaternion[0]])
        self.pose[2] += start_offset(self.scenario, start)
        self.twist = np.zeros(6)
        self._advance(self._still(start, 1), last=True)
        self.first = self.buffer[:1].copy()

    def _set_going(self, start: SampledMotion) -> None:
        if self.ground.is_level:
            self.pose[:2] = start.trunk.position[0, :2]
        self.twist[:3] = start.trunk.velocity[0]
        self.twist[3:] = start.trunk.rotation[0].T @ start.trunk.angular_velocity[0]

    def _advance(
        self,
        targets: Shaped[np.ndarray, " samples"],
        *,
        at: int = 0,
        last: bool = False,
        interrupted: Sequence[int] = (),
    ) -> int:
        """Make one step per row of the legs, and return the number of steps made."""
        assert at == 0
        count, log, made = len(targets), self.buffer, 0
        log["qpos"][:count, 7:] = targets["q"].reshape(count, -1)
        log["qvel"][:count, 6:] = targets["qd"].reshape(count, -1)
        chunk = 1 if self._is_uneven else CHUNK
        while made < count and not interrupted:
            part = slice(made, min(made + chunk, count))
            if made == 0 or self._is_uneven:
                self._update_planes(targets[made])
            advance(
                targets["trunk"][part],
                targets["legs"][part],
                self.constants,
                last and part.stop == count,
                self.planes,
                self.pose,
                self.twist,
                log["qpos"][part],
                log["qvel"][part],
                log["sensors"][part],
                self._tip_torque[part],
                self.acceleration[part],
            )
            made = part.stop
        self._compute_torque(targets[:made])
        return made

    def _update_planes(self, row: np.record) -> None:
        """Set the plane under each foot to the ground's tangent plane at the foot.

        Beyond an edge a foot keeps its plane while it is below that plane or the new one: a plane
        that jumped would throw it up with the spring's force on the whole step.
        """
        old, R = self.planes, quaternion_rotation(self.pose[3:])
        x, y, _ = (self.pose[:3] + row["legs"]["tip"] @ R.T).T
        height, slope = self.ground.surface(x, y)
        new = np.empty_like(old)
        new[:, :3] = upright(slope)
        new[:, 3] = np.sum(new[:, :3] * np.stack([x, y, height], axis=-1), axis=-1)
        new[:, 4] = self.ground.friction(x, y)
        # Before the first step there are no planes.
        if old[:, 2].all():
            present = (old[:, 3] - old[:, 0] * x - old[:, 1] * y) / old[:, 2]
            points = row["legs"]["points"][..., 0]
            lowest = (self.pose[2] + points @ R[2]).min(axis=1) - POINT_RADIUS
            kept = (np.abs(height - present) > EDGE) & (lowest < np.maximum(height, present))
            new[kept, :4] = old[kept, :4]
        self.planes[:] = new

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
            gravity=self.scenario.model.gravity,
        ).joint_torque
        log["torque"][good] = (torque - self._tip_torque[good]).reshape(-1, 3 * legs)


def check_prescribed(scenario: Scenario) -> None:
    """Refuse scenarios that this simulator cannot run.

    Raises:
        InvalidInput: The drive is another, or feet may run into the risers of steps, which the
            planes under them do not have.
    """
    if scenario.terrain.planned_on == "level" and isinstance(scenario.load_terrain().shape, Blocky):
        raise InvalidInput(
            f'terrain is "{scenario.terrain.kind}", and the plan takes it for level; under '
            'contact_law = "simscape" the plan must follow it, since its simulator has no upright '
            "faces.",
            hint='planned_on = "terrain", or contact_law = "spring-damper"',
        )
    drive = scenario.simulation.planned_drive
    if drive != "prescribed":
        raise InvalidInput(
            f'drive is "{drive}"; under contact_law = "simscape" it must be "prescribed", since '
            "its simulator has no other drive.",
            hint='drive = "prescribed", or contact_law = "spring-damper"',
        )


def substeps(scenario: Scenario, robot: Robot) -> int:
    """Return the number of substeps of a time step."""
    return math.ceil(scenario.simulation.dt / (SUBSTEP * longest_time_step(scenario, robot)))
