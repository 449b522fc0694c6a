"""The engine's model of a robot on the ground, built from the robot's own numbers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from phasmid.dynamics import BodyMotion, mass_matrix
from phasmid.kinematics import jacobian, joint_angles, neutral_feet
from phasmid.robot import JOINTS, Leg, Robot
from phasmid.scenario import Scenario
from phasmid.simulation.contact import (
    CONTACT_POINTS,
    add_belly,
    add_foot,
    belly_name,
    friction_hardness,
    point_name,
    set_contact,
)
from phasmid.simulation.ground import GROUND, add_ground, add_tangents, check_flat

if TYPE_CHECKING:
    import mujoco

JOINT_IMPEDANCE = 0.999
"""How hard the engine holds prescribed joints; the rest is numerical softness."""

NET_FORCE = 3
"""The engine's code for a contact sensor that sums over all points, in world axes."""

X_AXIS_UP = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
"""Quaternion of a quarter turn about x: from the coxa's frame to the femur's."""


def build_model(robot: Robot, scenario: Scenario) -> mujoco.MjModel:
    """Build the engine's model of a robot standing on the scenario's ground.

    The trunk floats; the bodies' frames are those of Table 1; every foot has four contact points
    at the corners of a square that lies flat when the foot is at its neutral place. Contact is a
    linear spring and damper per point.

    Args:
        robot: The robot, L legs.
        scenario: Its contact, terrain, drive, gravity and time step are used.

    Returns:
        The compiled model; its sensors are, leg by leg, the contact points that touch (1) and the
        force of the ground on the foot in world axes (3), then the feet's positions (L times 3).
    """
    import mujoco

    spec = _specification(robot, scenario)
    model = spec.compile()
    # The spring's constants are scaled by the engine's own measure of each foot's mobility,
    # which is known only after a first compilation.
    for leg, mobility in zip(robot.legs, _mobility(model, robot), strict=True):
        points = [point_name(leg, i) for i in range(CONTACT_POINTS)]
        set_contact(spec, points, scenario, float(mobility))
    if scenario.simulation.can_lie:
        points = [belly_name(i) for i in range(CONTACT_POINTS)]
        set_contact(spec, points, scenario, float(model.body("trunk").invweight0[0]))
    model = spec.compile()
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    return model


def foot_mobility(robot: Robot, scenario: Scenario) -> Float[np.ndarray, " legs"]:
    """How easily each foot gives way at the neutral stance, the engine's measure [1/kg], (L,).

    Args:
        robot: The robot, L legs.
        scenario: Its drive counts, whose rotors are inert.
    """
    return _mobility(_specification(robot, scenario).compile(), robot)


def joint_mobility(robot: Robot, scenario: Scenario, q: Float[np.ndarray, "legs 3"]) -> float:
    """Largest acceleration of the joints per torque on them [rad/s² per N·m].

    It is the largest eigenvalue of the joints' part of the inverse mass matrix.

    Args:
        robot: The robot, L legs.
        scenario: Its drive counts, whose rotors are inert.
        q: Joint angles [rad], shape (L, 3).
    """
    import mujoco

    model = _specification(robot, scenario).compile()
    data, M = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    data.qpos[7:] = q.ravel()
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, M)
    return float(np.linalg.eigvalsh(np.linalg.inv(M)[6:, 6:]).max())


def _mobility(model: mujoco.MjModel, robot: Robot) -> Float[np.ndarray, " legs"]:
    return np.array([model.body(f"{leg.name}.tibia").invweight0[0] for leg in robot.legs])


def _specification(robot: Robot, scenario: Scenario) -> mujoco.MjSpec:
    import mujoco

    spec = mujoco.MjSpec()
    spec.modelname = robot.name
    spec.compiler.degree = False
    spec.option.timestep = scenario.simulation.dt
    spec.option.gravity = [0.0, 0.0, -scenario.model.gravity]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    # Dense: the sparse Newton Hessian of MuJoCo 4.0.0 is wrong, and 24 degrees of freedom are few.
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    spec.option.impratio = friction_hardness(scenario)
    friction = add_ground(spec, scenario)
    height = -float(neutral_feet(robot)[:, 2].mean())
    trunk = spec.worldbody.add_body(name="trunk", pos=[0.0, 0.0, height])
    trunk.add_freejoint(name="trunk")
    _set_inertia(trunk, robot.body.mass, robot.body.com, robot.body.inertia)
    if scenario.simulation.can_lie:
        check_flat(scenario)
        add_belly(trunk, robot, friction)
    for leg in robot.legs:
        _add_leg(spec, trunk, leg, robot, scenario, friction)
    add_tangents(spec, robot, scenario)
    _add_sensors(spec, robot)
    return spec


def _set_inertia(
    body: mujoco.MjsBody,
    mass: float,
    com: Float[np.ndarray, "3"],
    inertia: Float[np.ndarray, "3 3"],
) -> None:
    body.explicitinertial = True
    body.mass = mass
    body.ipos = com
    i = inertia
    body.fullinertia = [i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]


def _add_leg(
    spec: mujoco.MjSpec,
    trunk: mujoco.MjsBody,
    leg: Leg,
    robot: Robot,
    scenario: Scenario,
    friction: list[float],
) -> None:
    import mujoco

    parent = trunk
    poses = (
        (leg.mount_position, _mount_quaternion(leg)),
        (leg.coxa.end, X_AXIS_UP),
        (leg.femur.end, (1.0, 0.0, 0.0, 0.0)),
    )
    servo, drive = robot.servo, scenario.simulation.planned_drive
    driven = drive in {"ideal-servo", "torque"}
    gains = iter(joint_gains(robot, scenario).T[3 * robot.legs.index(leg) :])
    for joint, link, (position, quaternion) in zip(JOINTS, leg.links, poses, strict=True):
        name = f"{leg.name}.{joint}"
        body = parent.add_body(name=name, pos=position, quat=quaternion)
        _set_inertia(body, link.mass, link.com, link.inertia)
        body.add_joint(
            name=name,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=[0.0, 0.0, 1.0],
            armature=servo.armature if driven else 0.0,
            frictionloss=servo.friction if driven else 0.0,
        )
        if driven:
            actuator = spec.add_actuator(name=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=name)
            if drive == "torque":
                stiffness, damping = (float(gain) for gain in next(gains))
                actuator.set_to_motor()
                actuator.biastype = mujoco.mjtBias.mjBIAS_AFFINE
                actuator.biasprm[1], actuator.biasprm[2] = -stiffness, -damping
            else:
                actuator.set_to_position(kp=servo.stiffness, kv=servo.damping)
            actuator.forcelimited = True
            actuator.forcerange = [-servo.stall_torque, servo.stall_torque]
        elif drive == "prescribed":
            _prescribe(spec, name, scenario.simulation.dt)
        parent = body
    add_foot(parent, leg, scenario.contact.tip_width, friction)


def joint_gains(robot: Robot, scenario: Scenario) -> Float[np.ndarray, "2 joints"]:
    """Stiffness [N·m/rad] and damping [N·m·s/rad] of joints that are driven by torque, (2, 3 L).

    They are the scenario's gains times each joint's inertia: that of its leg and its rotor at the
    neutral stance, with a mass at the foot, the robot's share for half of the legs.

    Args:
        robot: The robot, L legs.
        scenario: Its gains are used.
    """
    legs, table = len(robot.legs), scenario.simulation
    feet = np.array([leg.neutral_foot for leg in robot.legs])
    q = joint_angles(robot.arrays, feet)
    own = np.diagonal(mass_matrix(robot, BodyMotion.at_rest(), q))[6:]
    carried = 2 * robot.mass / legs * np.sum(jacobian(robot.arrays, q) ** 2, axis=-2).ravel()
    inertia = own + carried + robot.servo.armature
    damping = table.speed_gain
    if damping is None:
        damping = 2 * math.sqrt(table.position_gain)
    return np.stack([table.position_gain * inertia, damping * inertia])


def _mount_quaternion(leg: Leg) -> tuple[float, float, float, float]:
    """The hip's rotation in the body, Rz(yaw) Ry(pitch) Rx(roll), as (w, x, y, z)."""
    (cz, sz), (cy, sy), (cx, sx) = (
        (math.cos(angle / 2), math.sin(angle / 2))
        for angle in (leg.mount_yaw, leg.mount_pitch, leg.mount_roll)
    )
    return (
        cz * cy * cx + sz * sy * sx,
        cz * cy * sx - sz * sy * cx,
        cz * sy * cx + sz * cy * sx,
        sz * cy * cx - cz * sy * sx,
    )


def _prescribe(spec: mujoco.MjSpec, joint: str, dt: float) -> None:
    """Hold a joint at an angle that is set anew at each step."""
    import mujoco

    stiffness, damping = drive_gains(dt)
    equality = spec.add_equality(
        name=joint, type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT, name1=joint
    )
    equality.solref = [-stiffness, -damping]
    equality.solimp = [JOINT_IMPEDANCE, JOINT_IMPEDANCE, 0.001, 0.5, 2.0]


def drive_gains(dt: float) -> tuple[float, float]:
    """Stiffness [1/s²] and damping [1/s] with which prescribed joints correct their error.

    Critically damped, and as quick as a step of dt [s] resolves.
    """
    return 0.25 / dt**2, 1.0 / dt


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
