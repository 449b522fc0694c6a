"""Motion of feet, body and joints: the plan of a walk, and trajectories from files."""

from phasmid.motion.course import LevelCourse, UnevenCourse
from phasmid.motion.curves import Path, blend, join, lift
from phasmid.motion.explanation import (
    PostureExplanation,
    WalkExplanation,
    explain_posture,
    explain_walk,
)
from phasmid.motion.feasibility import USUAL_STRIDE, has_room_for, longest_stride
from phasmid.motion.remedies import plan
from phasmid.motion.trajectory import (
    JointTrajectory,
    Motion,
    SampledMotion,
    SampledTrajectory,
    trajectory_from_text,
)
from phasmid.motion.trajectory_file import load_trajectory
from phasmid.motion.trunk import TrunkMotion, progress, trunk_motion
from phasmid.motion.walk import Walk, evaluate

__all__ = [
    "USUAL_STRIDE",
    "UnevenCourse",
    "JointTrajectory",
    "Motion",
    "LevelCourse",
    "Path",
    "PostureExplanation",
    "SampledMotion",
    "SampledTrajectory",
    "TrunkMotion",
    "Walk",
    "WalkExplanation",
    "blend",
    "evaluate",
    "explain_posture",
    "explain_walk",
    "has_room_for",
    "join",
    "lift",
    "load_trajectory",
    "longest_stride",
    "plan",
    "progress",
    "trajectory_from_text",
    "trunk_motion",
]
