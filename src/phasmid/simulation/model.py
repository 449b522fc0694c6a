"""The MuJoCo model of a robot on the ground."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from phasmid.dynamics import BodyMotion, mass_matrix
from phasmid.experiment import ContactLaw, Experiment, ScenarioLike, built
from phasmid.kinematics import body_height, jacobian, joint_angles, rpy_quaternion
from phasmid.robot import JOINTS, Body, Leg, Link, Robot
from phasmid.simulation.contact import (
    GROUND,
    add_foot_planes,
    add_ground,
    add_points,
    check_flat,
    foot_points,
    point_radius,
    set_contact_law,
    trunk_points,
)

if TYPE_CHECKING:
    import mujoco

JOINT_IMPEDANCE = 0.999
"""Impedance of the constraints that hold prescribed joints."""

NET_FORCE = 3
"""MuJoCo's ``reduce`` code of a contact sensor that sums over all points, in world axes."""

X_AXIS_UP = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
"""Quaternion of a quarter turn about x: from the coxa's frame to the femur's."""


def build_model(scenario: ScenarioLike | Experiment) -> mujoco.MjModel:
    """Build the MuJoCo model of a robot that stands on the ground of a scenario.

    The trunk floats; the frames of the bodies are those of the paper's Table 1; every foot has
    four contact points, each a linear spring and damper: at the corners of a square, or in one
    place as the ball of a foot with a radius.

    Args:
        scenario: The scenario, or its experiment.

    Returns:
        The compiled model. Its sensors are, leg by leg, the number of touching contact points (1)
        and the force of the ground on the foot in world axes [N] (3), then the positions of all
        feet in world axes [m] (L times 3).
    """
    experiment = built(scenario)
    return compile_model(model_specification(experiment), experiment.world.contact)


def compile_model(spec: mujoco.MjSpec, law: ContactLaw) -> mujoco.MjModel:
    """Compile a specification, and set the contact law of its feet and trunk."""
    import mujoco

    model = spec.compile()
    set_contact_law(model, law)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    return model


def foot_mobility(experiment: Experiment) -> Float[np.ndarray, " legs"]:
    """Return MuJoCo's inverse effective mass of each foot at the neutral stance [1/kg], (L,)."""
    model = model_specification(experiment).compile()
    return np.array(
        [model.body(f"{leg.name}.tibia").invweight0[0] for leg in experiment.robot.legs]
    )


def joint_mobility(experiment: Experiment, q: Float[np.ndarray, "legs 3"]) -> float:
    """Return the largest eigenvalue of the joints' part of the inverse mass matrix.

    It is the largest acceleration of the joints per torque on them [rad/s² per N·m].

    Args:
        experiment: Its robot, L legs, and its drive are used, since rotors add inertia.
        q: Joint angles [rad], shape (L, 3).
    """
    import mujoco

    model = model_specification(experiment).compile()
    data, M = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    data.qpos[7:] = q.ravel()
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, M)
    return float(np.linalg.eigvalsh(np.linalg.inv(M)[6:, 6:]).max())


def joint_gains(experiment: Experiment) -> Float[np.ndarray, "2 joints"]:
    """Return stiffness [N·m/rad] and damping [N·m·s/rad] of torque-driven joints, shape (2, 3 L).

    They are the solver's gains times each joint's inertia at the neutral stance: that of its leg
    and its rotor, with a mass at the foot, the robot's share for half of the legs.
    """
    table, robot = experiment.solver, experiment.robot
    feet = np.array([leg.neutral_foot for leg in robot.legs])
    q = joint_angles(robot.arrays, feet)
    own = np.diagonal(mass_matrix(robot, BodyMotion.at_rest(), q))[6:]
    share = 2 * robot.mass / len(robot.legs)
    carried = share * np.sum(jacobian(robot.arrays, q) ** 2, axis=-2).ravel()
    inertia = own + carried + robot.arrays.armature.ravel()
    damping = table.speed_gain
    if damping is None:
        damping = 2 * math.sqrt(table.position_gain)
    return np.stack([table.position_gain * inertia, damping * inertia])


def drive_gains(dt: float) -> tuple[float, float]:
    """Return stiffness [1/s²] and damping [1/s] of the constraints of prescribed joints.

    They are critically damped, and as stiff as a time step of dt [s] resolves.
    """
    return 0.25 / dt**2, 1.0 / dt


def model_specification(experiment: Experiment) -> mujoco.MjSpec:
    """Describe an experiment's robot on its ground, without the contact law of its feet."""
    import mujoco

    law, robot = experiment.world.contact, experiment.robot
    spec = mujoco.MjSpec()
    spec.modelname = robot.name
    spec.compiler.degree = False
    spec.option.timestep = experiment.solver.time_step
    spec.option.gravity = [0.0, 0.0, -experiment.world.gravity]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    # Dense: the sparse Newton Hessian of MuJoCo 4.0.0 is wrong, and 24 degrees of freedom are few.
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    spec.option.impratio = law.friction_hardness
    friction = add_ground(spec, experiment)
    trunk = spec.worldbody.add_body(name="trunk", pos=[0.0, 0.0, body_height(robot)])
    trunk.add_freejoint(name="trunk")
    set_inertia(trunk, robot.body)
    if experiment.solver.can_lie:
        check_flat(experiment)
        add_points(trunk, "trunk", trunk_points(robot, law), law.point_radius, friction)
    gains = joint_gains(experiment).T.reshape(-1, 3, 2)
    for leg, leg_gains in zip(robot.legs, gains, strict=True):
        _add_leg(spec, trunk, leg, leg_gains, robot, experiment, law, friction)
    add_foot_planes(spec, experiment)
    _add_sensors(spec, robot)
    return spec


def set_inertia(body: mujoco.MjsBody, link: Link | Body) -> None:
    """Set mass, centre of mass and inertia of a body."""
    body.explicitinertial = True
    body.mass, body.ipos, i = link.mass, link.com, link.inertia
    body.fullinertia = [i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]


def _add_leg(
    spec: mujoco.MjSpec,
    trunk: mujoco.MjsBody,
    leg: Leg,
    gains: Float[np.ndarray, "3 2"],
    robot: Robot,
    experiment: Experiment,
    law: ContactLaw,
    friction: list[float],
) -> None:
    import mujoco

    parent, mount = trunk, np.array([leg.mount_roll, leg.mount_pitch, leg.mount_yaw])
    poses = (
        (leg.mount_position, rpy_quaternion(*mount[:, None])[0]),
        (leg.coxa.end, X_AXIS_UP),
        (leg.femur.end, (1.0, 0.0, 0.0, 0.0)),
    )
    servo, drive, arrays = robot.servo, experiment.solver.planned_drive, robot.arrays
    numbers = [arrays.strength, arrays.stall_torque, arrays.armature, arrays.friction]
    own = np.stack(numbers, axis=-1)[robot.legs.index(leg)].tolist()
    is_motor = drive in {"ideal-servo", "torque"}
    for joint, link, (position, quaternion), (stiffness, damping), of_joint in zip(
        JOINTS, leg.links, poses, gains.tolist(), own, strict=True
    ):
        ratio, largest, armature, dry = of_joint
        name = f"{leg.name}.{joint}"
        body = parent.add_body(name=name, pos=position, quat=quaternion)
        set_inertia(body, link)
        body.add_joint(
            name=name,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=[0.0, 0.0, 1.0],
            armature=armature if is_motor else 0.0,
            frictionloss=dry if is_motor else 0.0,
        )
        if is_motor:
            actuator = spec.add_actuator(name=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=name)
            if drive == "torque":
                actuator.set_to_motor()
                actuator.biastype = mujoco.mjtBias.mjBIAS_AFFINE
                actuator.biasprm[1], actuator.biasprm[2] = -stiffness, -damping
            else:
                actuator.set_to_position(kp=ratio * servo.stiffness, kv=ratio * servo.damping)
            actuator.forcelimited = True
            actuator.forcerange = [-largest, largest]
        elif drive == "prescribed":
            _prescribe(spec, name, experiment.solver.time_step)
        parent = body
    parent.add_site(name=f"{leg.name}.foot", pos=leg.tibia.end)
    points, radius = foot_points(robot, leg, law), point_radius(robot, law)
    add_points(parent, leg.name, points, radius, friction)


def _prescribe(spec: mujoco.MjSpec, joint: str, dt: float) -> None:
    """Hold a joint by an equality constraint at an angle that is set before each step."""
    import mujoco

    stiffness, damping = drive_gains(dt)
    equality = spec.add_equality(
        name=joint, type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT, name1=joint
    )
    equality.solref = [-stiffness, -damping]
    equality.solimp = [JOINT_IMPEDANCE, JOINT_IMPEDANCE, 0.001, 0.5, 2.0]


def _add_sensors(spec: mujoco.MjSpec, robot: Robot) -> None:
    import mujoco

    fields = (mujoco.mjtConDataField.mjCONDATA_FOUND, mujoco.mjtConDataField.mjCONDATA_FORCE)
    found_and_force = sum(1 << int(field) for field in fields)
    for leg in robot.legs:
        spec.add_sensor(
            name=f"{leg.name}.contact",
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            objtype=mujoco.mjtObj.mjOBJ_BODY,
            objname=GROUND,
            reftype=mujoco.mjtObj.mjOBJ_BODY,
            refname=f"{leg.name}.tibia",
            intprm=[found_and_force, NET_FORCE, 1],
        )
    for leg in robot.legs:
        spec.add_sensor(
            name=f"{leg.name}.foot",
            type=mujoco.mjtSensor.mjSENS_FRAMEPOS,
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            objname=f"{leg.name}.foot",
        )
