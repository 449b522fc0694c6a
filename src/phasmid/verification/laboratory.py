"""Where the rows are measured: shared walks, the robot on the bench, and small bodies."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from phasmid.dynamics import BodyMotion
from phasmid.errors import PhasmidError
from phasmid.experiment import Ending
from phasmid.kinematics import quaternion_rotation
from phasmid.motion import plan
from phasmid.recording import Recording
from phasmid.robot import Robot
from phasmid.scenario import Scenario, load_scenario
from phasmid.simulation import Run, build_model, simulate

if TYPE_CHECKING:
    import mujoco


class CannotMeasure(PhasmidError):
    """An experiment that did not come to its end."""


def walked(scenario: Scenario, *, to_the_end: bool = True) -> Recording:
    """Simulate the walk of a scenario.

    Args:
        scenario: The experiment.
        to_the_end: Whether a walk that ends early is of no use.

    Raises:
        CannotMeasure: It ended early.
    """
    recording = simulate(scenario, plan(scenario))
    if to_the_end and not Ending[recording.attrs["ending"]].is_full_length:
        raise CannotMeasure(str(recording.attrs["ending_reason"]))
    return recording


class Laboratory:
    """The paper's robot and walk, on the bench and in the engine.

    Attributes:
        scenario: The basis of all experiments.
    """

    def __init__(self, scenario: Scenario | None = None) -> None:
        self.scenario = load_scenario("paper") if scenario is None else scenario
        self._walks: dict[str, Recording] = {}

    def walk(self, *, to_the_end: bool = True, **changes: Any) -> Recording:
        """Return the simulated walk with these changes; made once.

        Raises:
            CannotMeasure: It ended early.
        """
        key = repr(sorted(changes.items()))
        if key not in self._walks:
            self._walks[key] = walked(self.scenario.replace(**changes), to_the_end=to_the_end)
        return self._walks[key]

    def standing(self, **changes: Any) -> Run:
        """Return the robot at rest on its neutral feet, joints held.

        A new one at each call: experiments push it about.
        """
        scenario = self.scenario.replace(**{"step_length": 0.0, "step_height": 0.0, **changes})
        return Run(scenario, plan(scenario))


INTEGRATORS = ("semi-implicit", "RK4")
"""The project's, implicit in velocities and semi-implicit Euler where no force depends on these,
and the engine's Runge-Kutta method of fourth order."""

OPTIONS = ("timestep", "integrator", "solver", "cone", "jacobian", "impratio", "tolerance")
"""Settings of the engine that a small body takes from the robot's model."""


def compiled(
    spec: mujoco.MjSpec, scenario: Scenario, *, integrator: str, dt: float
) -> mujoco.MjModel:
    """Compile a small body with the robot's settings and gravity, and a time step [s]."""
    model, reference = spec.compile(), build_model(scenario.load_robot(), scenario)
    for name in OPTIONS:
        setattr(model.opt, name, getattr(reference.opt, name))
    model.opt.gravity[:] = reference.opt.gravity
    return with_integrator(model, integrator, dt)


def with_integrator(model: mujoco.MjModel, integrator: str, dt: float) -> mujoco.MjModel:
    """Change a model's integrator and time step [s], and return it."""
    import mujoco

    if integrator == "RK4":
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    model.opt.timestep = dt
    return model


def hold(run: Run, steps: int) -> Iterator[int]:
    """Step a robot that holds its joints where its walk begins; yields after each step."""
    import mujoco

    target = run.walk.q[0].ravel()
    for k in range(steps):
        run.drive.command(target)
        mujoco.mj_step(run.model, run.data)
        yield k


def contact_points(robot: Robot) -> int:
    """Return how many points carry a robot on all its feet: four a foot, as in the paper."""
    return 4 * len(robot.legs)


class Touch(NamedTuple):
    """The points that touch the ground, P of them.

    Attributes:
        leg: Index of each one's leg, shape (P,).
        position: World axes [m], shape (P, 3).
        force: Of the ground on the foot, world axes [N], shape (P, 3).
        depth: How far it has sunk in [m], shape (P,).
        normal: Of the ground, world axes, shape (P, 3).
        velocity: Of the foot's material there, world axes [m/s], shape (P, 3).
    """

    leg: Int[np.ndarray, " points"]
    position: Float[np.ndarray, "points 3"]
    force: Float[np.ndarray, "points 3"]
    depth: Float[np.ndarray, " points"]
    normal: Float[np.ndarray, "points 3"]
    velocity: Float[np.ndarray, "points 3"]


def touching(robot: Robot, model: mujoco.MjModel, data: mujoco.MjData) -> Touch:
    """Return the engine's contacts, point by point."""
    import mujoco

    tibias = {model.body(f"{leg.name}.tibia").id: i for i, leg in enumerate(robot.legs)}
    count = data.ncon
    leg = np.zeros(count, dtype=int)
    position, force, normal, velocity = (np.zeros((count, 3)) for _ in range(4))
    depth = np.zeros(count)
    local, slope = np.zeros(6), np.zeros((3, model.nv))
    for i in range(count):
        contact = data.contact[i]
        bodies = [int(model.geom_bodyid[geom]) for geom in contact.geom]
        # The engine gives the force on the second of the two.
        side = 1.0 if bodies[1] in tibias else -1.0
        foot = bodies[1] if side > 0 else bodies[0]
        axes = contact.frame.reshape(3, 3)
        mujoco.mj_contactForce(model, data, i, local)
        mujoco.mj_jac(model, data, slope, None, contact.pos, foot)
        leg[i], position[i], depth[i] = tibias[foot], contact.pos, -contact.dist
        force[i], normal[i] = side * local[:3] @ axes, side * axes[0]
        velocity[i] = slope @ data.qvel
    return Touch(leg, position, force, depth, normal, velocity)


def trunk_motion(data: mujoco.MjData) -> BodyMotion:
    """Return the trunk's pose, velocity and acceleration in the engine, in world axes."""
    rotation = quaternion_rotation(data.qpos[3:7].copy())
    # The engine turns a free body about its own axes.
    return BodyMotion(
        position=data.qpos[:3].copy(),
        rotation=rotation,
        velocity=data.qvel[:3].copy(),
        angular_velocity=rotation @ data.qvel[3:6],
        acceleration=data.qacc[:3].copy(),
        angular_acceleration=rotation @ data.qacc[3:6],
    )


def joint_state(data: mujoco.MjData) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles, speeds and accelerations of the joints, each of shape (L, 3)."""
    rows = data.qpos[7:], data.qvel[6:], data.qacc[6:]
    q, qd, qdd = (row.reshape(-1, 3).copy() for row in rows)
    return q, qd, qdd
