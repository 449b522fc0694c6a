"""Where the rows are measured: shared walks, the robot on the bench, and small bodies."""

from typing import NamedTuple

import mujoco
import numpy as np

from phasmid.dynamics import BodyMotion
from phasmid.experiment import Ending
from phasmid.kinematics import quaternion_rotation
from phasmid.motion import plan
from phasmid.scenario import load_scenario
from phasmid.simulation import Run, build_model


class Bench:
    """The paper's robot and walk, on the bench and in the engine.

    Attributes:
        scenario: The basis of all experiments.
        change: Called with each model of the engine: introduces an error into the physics.
    """

    def __init__(self, scenario=None, change=lambda model: None):
        self.scenario, self.change = scenario or load_scenario("paper"), change
        self._walk = None

    def model(self, scenario):
        """Return the engine's model of a scenario's robot."""
        model = build_model(scenario)
        self.change(model)
        return model

    def run(self, scenario):
        """Return the run of a scenario's walk, before its first step."""
        run = Run(scenario, plan(scenario))
        self.change(run.model)
        return run

    def record(self, scenario):
        """Return the recording of a scenario's whole walk."""
        recording = self.run(scenario).simulate()
        assert Ending[recording.attrs["ending"]].is_full_length, recording.attrs["ending_reason"]
        return recording

    def walk(self):
        """Return the recording of the paper's walk, made once."""
        if self._walk is None:
            self._walk = self.record(self.scenario)
        return self._walk

    def standing(self, **changes):
        """Return a new robot at rest on its neutral feet, joints held."""
        return self.run(self.scenario.replace(step_length=0.0, step_height=0.0, **changes))


INTEGRATORS = ("semi-implicit", "RK4")
"""The project's, implicit in velocities and semi-implicit Euler where no force depends on these,
and the engine's Runge-Kutta method of fourth order."""

# Settings of the engine that a small body takes from the robot's model.
OPTIONS = ("timestep", "integrator", "solver", "cone", "jacobian", "impratio", "tolerance")


def compiled(spec, bench, *, integrator, dt):
    """Compile a small body with the robot's settings and gravity, and a time step [s]."""
    model, reference = spec.compile(), bench.model(bench.scenario)
    for name in OPTIONS:
        setattr(model.opt, name, getattr(reference.opt, name))
    model.opt.gravity[:] = reference.opt.gravity
    return with_integrator(model, integrator, dt)


def with_integrator(model, integrator, dt):
    """Change a model's integrator and time step [s], and return it."""
    if integrator == "RK4":
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    model.opt.timestep = dt
    return model


def hold(run, steps):
    """Step a robot that holds its joints where its walk begins; yields after each step."""
    target = run.walk.q[0].ravel()
    for k in range(steps):
        run.drive.command(target)
        mujoco.mj_step(run.model, run.data)
        yield k


def contact_points(robot):
    """Return how many points carry a robot on all its feet: four a foot, as in the paper."""
    return 4 * len(robot.legs)


class Touch(NamedTuple):
    """The P points that touch the ground; vectors of shape (P, 3) in world axes.

    Attributes:
        leg: Index of each one's leg, shape (P,).
        position: [m].
        force: Of the ground on the foot [N].
        depth: Into the ground [m], shape (P,).
        normal: Of the ground.
        velocity: Of the foot's material there [m/s].
    """

    leg: np.ndarray
    position: np.ndarray
    force: np.ndarray
    depth: np.ndarray
    normal: np.ndarray
    velocity: np.ndarray


def touching(robot, model, data):
    """Return the engine's contacts, point by point."""
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


def trunk_motion(data):
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


def joint_state(data):
    """Angles, speeds and accelerations of the joints, each of shape (L, 3)."""
    rows = data.qpos[7:], data.qvel[6:], data.qacc[6:]
    q, qd, qdd = (row.reshape(-1, 3).copy() for row in rows)
    return q, qd, qdd
