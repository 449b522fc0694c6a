"""MuJoCo model of a robot that learns, and its motor at fast fidelity."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import mujoco
import numpy as np

from phasmid.errors import InvalidInput
from phasmid.experiment import Experiment
from phasmid.kinematics import joint_angles
from phasmid.learning.terrain import Terrain
from phasmid.robot import JOINTS, Robot
from phasmid.servo.law import output_per_tick, servo_parameters
from phasmid.simulation.contact import CONTACT_POINTS, point_name
from phasmid.simulation.model import compile_model, model_specification
from phasmid.simulation.start import step_limit

FAST_STEP, FULL_STEP = 0.004, 0.001
"""Time step of each fidelity [s]."""

FOOT_RADIUS = 0.005
"""Radius of the sphere of a foot at fast fidelity [m]."""

PAYLOAD_SIDE = 0.05
"""Side of the cube on the trunk whose mass is the payload's [m]."""

BASE = 0.1
"""Thickness of the ground below its lowest point [m]."""

LEAST_PAYLOAD = 1e-6
"""Mass of the cube where there is no payload [kg]."""


class Motor(NamedTuple):
    """A servo whose torque follows the position error in proportion, at the output.

    Attributes:
        gain: Torque per position error [N·m/rad].
        stall: Largest torque at standstill, without friction [N·m].
        damping: Torque of the counter voltage and viscous friction per speed [N·m·s/rad].
        friction: Coulomb friction [N·m].
        load_loss: Friction per torque of the motor.
        armature: Inertia of the rotor [kg·m²].
        delay: Time from a target to the servo's answer [s].
    """

    gain: float
    stall: float
    damping: float
    friction: float
    load_loss: float
    armature: float
    delay: float


def robot_motor(robot: Robot) -> Motor:
    """Return the motor of a robot's servos.

    It has the numbers of the servo's own law where its stall current is known, without margin,
    punch, backlash and gear spring; else those of the ideal servo. Ratios of joints that differ
    are left out: the servo of an imported robot has the least torque and speed of all joints.
    """
    servo = robot.servo
    if servo.stall_current is None:
        damping = servo.stall_torque / servo.no_load_speed
        return Motor(
            servo.stiffness,
            servo.stall_torque,
            damping,
            servo.friction,
            0.0,
            servo.armature,
            0.0,
        )
    p = servo_parameters(servo, FAST_STEP)[0]
    stall = float(p["constant"] * p["voltage"] / p["resistance"])
    per_tick = output_per_tick(replace(servo, punch=0.0))
    return Motor(
        gain=float(stall * per_tick / p["tick"]),
        stall=float(stall * p["most"]),
        damping=float(p["constant"] ** 2 / p["resistance"] + p["viscous"]),
        friction=float(p["coulomb"]),
        load_loss=float(p["load_loss"]),
        armature=servo.armature,
        delay=servo.delay,
    )


def longest_full_step(experiment: Experiment) -> float:
    """Return the longest time step at full fidelity [s], at most `FULL_STEP`."""
    if not experiment.robot.has_equal_servos:
        raise InvalidInput(
            "the servos of the joints differ; full fidelity has one law for all of them.",
            hint='fidelity = "fast"',
        )
    legs = experiment.robot.arrays
    neutral = joint_angles(legs, legs.neutral_foot)
    return min(FULL_STEP, step_limit(experiment.replace(drive="servo"), neutral)[0])


def learning_model(
    experiment: Experiment, terrain: Terrain, *, full: bool, dt: float
) -> mujoco.MjModel:
    """Build the model of a robot with L legs.

    Args:
        experiment: Its robot, contact and gravity are used.
        terrain: The ground, one height field.
        full: Whether feet and contact law are those of `phasmid.simulation.build_model`; else they
            are those of `fast_specification`.
        dt: Time step [s].

    Returns:
        The model, with the sensors of `phasmid.simulation.build_model`, and a cube ``payload`` on
        the trunk.
    """
    if full:
        experiment = experiment.replace(dt=dt, drive="servo")
        spec = model_specification(experiment)
        _add_ground_and_payload(spec, experiment.robot, terrain)
        return compile_model(spec, experiment.world.contact)
    model = fast_specification(experiment.replace(dt=dt), terrain).compile()
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    return model


def fast_specification(experiment: Experiment, terrain: Terrain) -> mujoco.MjSpec:
    """Describe a robot at fast fidelity.

    Each foot is one sphere with MuJoCo's own contact, the friction cone is a pyramid, and the
    joints carry rotor and damping of the motor; arguments as of `learning_model`.
    """
    experiment = experiment.replace(drive="servo", contact_law="mujoco")
    spec, robot = model_specification(experiment), experiment.robot
    _add_ground_and_payload(spec, robot, terrain)
    spec.option.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL
    motor = robot_motor(robot)
    for leg in robot.legs:
        for i in range(CONTACT_POINTS):
            spec.delete(spec.geom(point_name(leg.name, i)))
        spec.body(f"{leg.name}.tibia").add_geom(
            name=f"{leg.name}.foot",
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[robot.foot_radius or FOOT_RADIUS, 0.0, 0.0],
            pos=leg.tibia.end,
            mass=0.0,
            condim=3,
            friction=[experiment.world.terrain.coefficient, 0.005, 0.0001],
            priority=1,
            contype=0,
            conaffinity=1,
        )
        for joint in JOINTS:
            hinge = spec.joint(f"{leg.name}.{joint}")
            hinge.armature, hinge.damping[0] = motor.armature, motor.damping
    return spec


def _add_ground_and_payload(spec: mujoco.MjSpec, robot: Robot, terrain: Terrain) -> None:
    if np.ptp(terrain.heights) > 0:
        _add_height_field(spec, terrain)
    place = robot.body.box_points(np.array([0.0, 0.0, 1.0]))
    place[2] += PAYLOAD_SIDE / 2
    payload = spec.body("trunk").add_body(name="payload", pos=place)
    payload.explicitinertial = True
    payload.mass = LEAST_PAYLOAD
    payload.inertia = [LEAST_PAYLOAD * PAYLOAD_SIDE**2 / 6] * 3


def _add_height_field(spec: mujoco.MjSpec, terrain: Terrain) -> None:
    """Replace the ground by a height field."""
    for geom in list(spec.worldbody.geoms):
        spec.delete(geom)
    heights, low = terrain.heights, float(terrain.heights.min())
    rows, columns = heights.shape
    size = (np.array([rows, columns]) - 1) * terrain.cell / 2
    # MuJoCo's rows run along y.
    field = spec.add_hfield(name="terrain", nrow=columns, ncol=rows)
    field.size = [*size, float(np.ptp(heights)), BASE]
    field.userdata = ((heights - low) / np.ptp(heights)).T.ravel()
    spec.worldbody.add_geom(
        name="terrain",
        type=mujoco.mjtGeom.mjGEOM_HFIELD,
        hfieldname="terrain",
        pos=[0.0, 0.0, low],
    )
