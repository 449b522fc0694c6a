"""Closed-form leg kinematics, frames and workspace."""

from phasmid.kinematics.frames import (
    LinkFrames,
    angular_motion,
    body_from_hip,
    centre_of_mass,
    dh_transform,
    hip_from_body,
    leg_frames,
    link_frames,
    neutral_feet,
    quaternion_rotation,
    quaternion_yaw,
    rotation_rpy,
    rpy_quaternion,
    step_pose,
    step_twist,
    yaw_quaternion,
)
from phasmid.kinematics.leg import foot_position, jacobian, joint_angles, joint_motion
from phasmid.kinematics.workspace import longest_stride, reach, within_reach

__all__ = [
    "LinkFrames",
    "angular_motion",
    "body_from_hip",
    "centre_of_mass",
    "dh_transform",
    "foot_position",
    "hip_from_body",
    "jacobian",
    "joint_angles",
    "joint_motion",
    "leg_frames",
    "link_frames",
    "longest_stride",
    "neutral_feet",
    "quaternion_rotation",
    "quaternion_yaw",
    "reach",
    "rotation_rpy",
    "rpy_quaternion",
    "step_pose",
    "step_twist",
    "within_reach",
    "yaw_quaternion",
]
