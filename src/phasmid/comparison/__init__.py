"""Logs of real robots beside their replay in simulation."""

from phasmid.comparison.comparison import Comparison, Quantity, compare
from phasmid.comparison.log import RobotLog

__all__ = ["Comparison", "Quantity", "RobotLog", "compare"]
