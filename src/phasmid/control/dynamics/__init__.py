"""What torques the commanded motion takes, whether the ground and the servos can give them."""

from phasmid.control.dynamics.effort import Effort, EffortSettings, FeedForward, load_shares

__all__ = ["Effort", "EffortSettings", "FeedForward", "load_shares"]
