"""Our robots in MuJoCo, with the mass of every link as given."""

from __future__ import annotations

import mujoco
import numpy as np

from phasmid.robot import Body, Link, Robot


def mujoco_model(robot: Robot, *, free: bool) -> mujoco.MjModel:
    """The robot with its trunk free, or fixed in the world; site i is the foot of leg i."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.gravity = [0.0, 0.0, -9.81]
    trunk = _add_body(spec.worldbody, robot.body, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0])
    if free:
        trunk.add_freejoint()
    for leg in robot.legs:
        parent, at = trunk, list(leg.mount_position)
        # The frames of Table 1: the mount, then the quarter turn about x before the femur.
        mount = np.empty(4)
        mujoco.mju_euler2Quat(mount, [leg.mount_yaw, leg.mount_pitch, leg.mount_roll], "zyx")
        turns = (
            mount,
            [np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0],
            [1.0, 0.0, 0.0, 0.0],
        )
        for link, turn in zip(leg.links, turns, strict=True):
            parent = _add_body(parent, link, at, turn)
            parent.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, 1.0])
            at = link.end
        parent.add_site(pos=at)
    return spec.compile()


def _add_body(
    parent: mujoco.MjsBody, part: Body | Link, pos: list[float], quat: list[float]
) -> mujoco.MjsBody:
    body = parent.add_body(pos=pos, quat=quat)
    tensor = part.inertia
    body.explicitinertial = True
    body.mass, body.ipos = part.mass, part.com
    body.fullinertia = [*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2]]
    return body
