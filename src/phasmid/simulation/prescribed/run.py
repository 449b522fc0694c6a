"""The run of a walk in the simulator of prescribed joints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid import dynamics
from phasmid.dynamics import BodyMotion
from phasmid.errors import InvalidInput
from phasmid.kinematics import quaternion_rotation
from phasmid.motion import SampledMotion
from phasmid.robot import Robot
from phasmid.scenario import Scenario
from phasmid.simulation.contact import CONTACT_POINTS, POINT_RADIUS
from phasmid.simulation.joint_drive import Memoryless, Setpoints
from phasmid.simulation.prescribed.legs import (
    AXIS,
    LEG,
    LEGS,
    TIP,
    TURNING,
    Legs,
    joints_of,
    leg_rows,
)
from phasmid.simulation.prescribed.trunk import advance
from phasmid.simulation.run import WATCH_STEPS, Run
from phasmid.simulation.samples import Samples
from phasmid.simulation.start import raised
from phasmid.simulation.time_step import longest_time_step
from phasmid.terrain import Blocky
from phasmid.terrain.ground import upright

SUBSTEP = 1 / 12
"""A substep as a share of the longest time step that resolves the contact. On the paper's walk the
normal forces are then within 0.003 N rms of those of very small ones."""

EDGE = 1e-3
"""A change of the ground's height under a foot in one step above which it is an edge [m]. Slopes
and curves change less: the planes under a foot that slips at 1 m/s over a curve of 20 mm radius
differ by 0.03 mm in a step of 1 ms."""

CHUNK = 32
"""Steps between two chances for Ctrl-C."""


@dataclass(frozen=True)
class _Widths:
    """How many numbers a sample has, under the engine's names."""

    nq: int
    nv: int
    nsensordata: int


class _Planned(Memoryless):
    """Joints that do what is planned, and remember nothing."""

    def command(self, target: Float[np.ndarray, " joints"]) -> None:
        """Nothing: the rows of the legs say it all."""
        del target

    def fail(self, joint: int) -> None:
        """Refused: nobody asks this simulator's joints to fail."""
        raise NotImplementedError(joint)

    def torque(self) -> Float[np.ndarray, " joints"]:
        """None: torques are found after the motion."""
        return np.empty(0)

    def targets(self, wanted: Setpoints, dt: float) -> Float[np.ndarray, "samples joints"]:
        """Planned angles, shape (N, 3 L) [rad]."""
        del dt
        return wanted.q.reshape(len(wanted.q), -1)


class TrunkRun(Run):
    """A walk with prescribed joints under the contact law of the paper's library.

    The log is that of the engine: positions, speeds, the feet's forces and places, torques.

    Attributes:
        pose: Position and quaternion of the body frame (7).
        twist: Velocity in world axes and angular velocity in body axes (6).
        planes: The ground under each leg, as of `trunk.ground`; on uneven ground laid anew before
            each step, but not over an edge that a foot has not cleared.
        acceleration: Of the body frame's origin and of its turning, world axes, at the samples of
            the buffer.
        simulator: What makes the steps.
    """

    simulator = "phasmid, prescribed joints"

    def _set_up(self) -> None:
        """Lay out what is integrated."""
        scenario, robot = self.scenario, self.robot
        check_prescribed(scenario)
        legs = len(robot.legs)
        self.model = _Widths(7 + 3 * legs, 6 + 3 * legs, 7 * legs)
        self.drive = _Planned()
        self.turns = np.zeros((WATCH_STEPS, 3 * legs))
        self.acceleration = np.zeros((WATCH_STEPS, 6))
        self.substeps = substeps(scenario, robot)
        self.weight = np.array([0.0, 0.0, -robot.mass * scenario.model.gravity])
        contact = scenario.contact
        self.uneven = bool(self.ground.patches) or not self.ground.is_level
        self.planes = np.zeros((legs, 5))
        self.law = np.array(
            [
                contact.stiffness,
                contact.law_damping,
                contact.kinetic_friction,
                contact.friction_threshold,
                POINT_RADIUS,
                # No two points of a foot are farther apart than the square's diagonal.
                1.5 * contact.tip_width,
            ]
        )

    def _physics(self) -> Float[np.ndarray, " physics"]:
        """Pose and twist, and the planes, since a foot may be beyond the edge of its own."""
        return np.concatenate([self.pose, self.twist, self.planes.ravel()])

    def _set_physics(self, state: Float[np.ndarray, " physics"]) -> None:
        """Set pose, twist and planes."""
        self.pose[:], self.twist[:] = state[:7], state[7:13]
        self.planes[:] = state[13:].reshape(self.planes.shape)

    def _planned_targets(self, start: int, stop: int) -> Float[np.ndarray, "samples width"]:
        walk = self.walk.sample(np.arange(start, stop + 1) * self.dt)
        joints = Legs(walk.q, walk.qd, walk.qdd)
        return leg_rows(self.robot, joints, self.scenario.contact.tip_width, self.dt)

    def _place(self, start: SampledMotion) -> None:
        """Put the robot where the plan starts."""
        self.pose = np.concatenate([start.trunk.position[0], start.trunk.quaternion[0]])
        self.pose[2] += raised(self.scenario, start)
        self.twist = np.zeros(6)
        self._advance(self._still(start, 1), last=True)
        self.first = Samples.empty(self.model, self.drive, 1)
        self.first.put(0, self.buffer.part(slice(0, 1)))

    def _still(self, start: SampledMotion, count: int) -> Float[np.ndarray, "samples width"]:
        """Legs that stand still as they start, for a number of steps."""
        q = np.repeat(start.q, count + 1, axis=0)
        zero = np.zeros_like(q)
        joints = Legs(q, zero, zero)
        return leg_rows(self.robot, joints, self.scenario.contact.tip_width, self.dt)

    def _set_going(self, start: SampledMotion) -> None:
        """Give the robot at rest the place and the speeds with which the plan starts."""
        if self.ground.is_level:
            self.pose[:2] = start.trunk.position[0, :2]
        self.twist[:3] = start.trunk.velocity[0]
        self.twist[3:] = start.trunk.rotation[0].T @ start.trunk.angular_velocity[0]

    def _advance(
        self,
        targets: Float[np.ndarray, "samples width"],
        *,
        at: int = 0,
        last: bool = False,
        interrupted: Sequence[int] = (),
    ) -> int:
        """Make a step in each row of the legs; what was there goes into the buffer's start."""
        assert at == 0
        count, log, made = len(targets), self.buffer, 0
        joints = joints_of(targets, len(self.robot.legs))
        log.qpos[:count, 7:] = joints.q.reshape(count, -1)
        log.qvel[:count, 6:] = joints.qd.reshape(count, -1)
        chunk = 1 if self.uneven else CHUNK
        while made < count and not interrupted:
            part = slice(made, min(made + chunk, count))
            if made == 0 or self.uneven:
                self._follow(targets[made])
            advance(
                targets[part],
                self.dt,
                self.substeps,
                last and part.stop == count,
                self.robot.mass,
                self.weight,
                self.planes,
                self.law,
                self.pose,
                self.twist,
                log.qpos[part],
                log.qvel[part],
                log.sensors[part],
                self.turns[part],
                self.acceleration[part],
            )
            made = part.stop
        self._find_torque(Legs(*(each[:made] for each in joints)))
        return made

    def _follow(self, row: Float[np.ndarray, " width"]) -> None:
        """Lay the ground under each foot as its tangent plane, where the foot is now.

        Beyond an edge a foot keeps the plane that it had while it is below that one or the new
        one: a plane that jumped would throw it up with the spring's force on the whole step.
        """
        legs = len(self.planes)
        parts = row[LEGS : LEGS + LEG * legs].reshape(legs, LEG)
        R = quaternion_rotation(self.pose[3:])
        x, y, _ = (self.pose[:3] + parts[:, TIP:AXIS] @ R.T).T
        height, slope = self.ground.surface(x, y)
        new = np.empty_like(self.planes)
        new[:, :3] = upright(slope)
        new[:, 3] = np.sum(new[:, :3] * np.stack([x, y, height], axis=-1), axis=-1)
        new[:, 4] = self.ground.friction(x, y)
        # Before the first step there are no planes, and no friction of theirs counts.
        if self.planes[:, 2].all():
            old = self.planes
            present = (old[:, 3] - old[:, 0] * x - old[:, 1] * y) / old[:, 2]
            points = parts[:, :TURNING].reshape(legs, CONTACT_POINTS, 3, 4)[..., 0]
            lowest = (self.pose[2] + points @ R[2]).min(axis=1) - POINT_RADIUS
            kept = (np.abs(height - present) > EDGE) & (lowest < np.maximum(height, present))
            new[kept, :4] = old[kept, :4]
        self.planes[:] = new

    def _find_torque(self, joints: Legs) -> None:
        """Torques that the motion takes under the feet's forces, by inverse dynamics."""
        log, (count, legs, _) = self.buffer, joints.q.shape
        log.torque[:count] = np.nan
        state = np.hstack([log.qpos[:count], log.qvel[:count], self.acceleration[:count]])
        finite = np.isfinite(state).all(axis=1)
        good = count if finite.all() else int(np.argmin(finite))
        rotation = quaternion_rotation(log.qpos[:good, 3:7])
        body = BodyMotion(
            position=log.qpos[:good, :3],
            rotation=rotation,
            velocity=log.qvel[:good, :3],
            angular_velocity=(rotation @ log.qvel[:good, 3:6, None])[..., 0],
            acceleration=self.acceleration[:good, :3],
            angular_acceleration=self.acceleration[:good, 3:],
        )
        force = log.sensors[:good, : 4 * legs].reshape(good, legs, 4)[..., 1:]
        needed = dynamics.inverse_dynamics(
            self.robot,
            body,
            *(each[:good] for each in joints),
            foot_force=force,
            gravity=self.scenario.model.gravity,
        )
        log.torque[:good] = needed.joint_torque.reshape(good, 3 * legs) - self.turns[:good]


def check_prescribed(scenario: Scenario) -> None:
    """Refuse what the simulator of prescribed joints cannot do.

    Raises:
        InvalidInput: The drive is another, or feet may run into the faces of steps, which the
            planes under them do not have.
    """
    if scenario.terrain.planned_on == "level" and isinstance(scenario.load_terrain().shape, Blocky):
        raise InvalidInput(
            f'terrain is "{scenario.terrain.kind}" and the plan takes it for level; under '
            'contact_law = "simscape" the plan must know it, since that law\'s simulator knows no '
            "upright faces.",
            hint='planned_on = "terrain", or contact_law = "spring-damper"',
        )
    drive = scenario.simulation.planned_drive
    if drive != "prescribed":
        raise InvalidInput(
            f'drive is "{drive}"; under contact_law = "simscape" it must be "prescribed", since '
            "that law's simulator knows no other joints.",
            hint='drive = "prescribed", or contact_law = "spring-damper"',
        )


def substeps(scenario: Scenario, robot: Robot) -> int:
    """Parts in which a time step is integrated.

    Args:
        scenario: Its contact and time step are used.
        robot: The robot.
    """
    return math.ceil(scenario.simulation.dt / (SUBSTEP * longest_time_step(scenario, robot)))
