"""Our robots in Pinocchio, the independent rigid-body library of tests and benchmarks."""

import numpy as np
import pinocchio as pin

from phasmid.units import STANDARD_GRAVITY

QUARTER_TURN = pin.rpy.rpyToMatrix(np.pi / 2, 0.0, 0.0)
"""From the axes of the coxa to those of the femur (Table 1's alpha)."""


def pinocchio_model(robot):
    """The robot with its trunk free.

    Joints come in the order of the robot's legs, coxa first; frame ``foot_i`` is the foot of
    leg i, counted from 0.
    """
    model = _empty(robot.name)
    trunk = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "trunk")
    model.appendBodyToJoint(trunk, _inertia(robot.body), pin.SE3.Identity())
    for i, leg in enumerate(robot.legs):
        _add_leg(model, leg, trunk, pin.SE3(leg.X_body_hip), str(i))
    return model


def pinocchio_leg(leg):
    """One leg whose hip frame is the world."""
    model = _empty(leg.name)
    _add_leg(model, leg, 0, pin.SE3.Identity(), "0")
    return model


def free_state(body, q, qd, qdd):
    """Configurations (N, 7 + 3L), velocities and accelerations (N, 6 + 3L) of a free robot.

    A free joint's quaternion is x, y, z, w; its velocity is that of the body frame's origin and
    the turning, both in body axes, and its acceleration is the change of these numbers.
    """
    count = q.shape[0]
    lead = (count,)
    R = np.broadcast_to(body.rotation, (*lead, 3, 3))
    quaternion = np.array([pin.Quaternion(matrix).coeffs() for matrix in R])
    v, w, a, dw = (
        np.einsum("nji,nj->ni", R, np.broadcast_to(u, (*lead, 3)))
        for u in (
            body.velocity,
            body.angular_velocity,
            body.acceleration,
            body.angular_acceleration,
        )
    )
    position = np.broadcast_to(body.position, (*lead, 3))
    rows = (
        (position, quaternion, q.reshape(count, -1)),
        (v, w, qd.reshape(count, -1)),
        (a - np.cross(w, v), dw, qdd.reshape(count, -1)),
    )
    configuration, velocity, acceleration = (np.concatenate(row, axis=1) for row in rows)
    return configuration, velocity, acceleration


def foot_loads(model, configuration, foot_force):
    """The ``fext`` of ``pin.rnea`` for forces on the feet (L, 3), given in world axes."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, configuration)
    loads = [pin.Force.Zero() for _ in range(model.njoints)]
    for i, force in enumerate(foot_force):
        foot = model.getFrameId(f"foot_{i}")
        joint = model.frames[foot].parentJoint
        on_foot = pin.Force(data.oMf[foot].rotation.T @ force, np.zeros(3))
        loads[joint] = loads[joint] + model.frames[foot].placement.act(on_foot)
    return loads


def _empty(name):
    model = pin.Model()
    model.name = name
    model.gravity.linear = np.array([0.0, 0.0, -STANDARD_GRAVITY])
    return model


def _add_leg(model, leg, parent, X_parent_hip, name):
    axis = pin.JointModelRZ()
    placements = (
        X_parent_hip,
        pin.SE3(QUARTER_TURN, leg.coxa.end),
        pin.SE3(np.eye(3), leg.femur.end),
    )
    for link, placement in zip(leg.links, placements, strict=True):
        parent = model.addJoint(parent, axis, placement, f"{link.name}_{name}")
        model.appendBodyToJoint(parent, _inertia(link), pin.SE3.Identity())
    tip = pin.SE3(np.eye(3), leg.tibia.end)
    model.addFrame(pin.Frame(f"foot_{name}", parent, 0, tip, pin.FrameType.OP_FRAME))


def _inertia(part):
    return pin.Inertia(part.mass, np.array(part.com), np.array(part.inertia))
