"""How feet, body and joints travel: curves, steps, and the plan of a walk."""

from phasmid.motion.curves import Path, blend, join, lift
from phasmid.motion.trunk import TrunkMotion, progress, trunk_motion
from phasmid.motion.walk import Walk, plan

__all__ = [
    "Path",
    "TrunkMotion",
    "Walk",
    "blend",
    "join",
    "lift",
    "plan",
    "progress",
    "trunk_motion",
]
