"""How the ground shares the load, and what a walk needs."""

from phasmid.forces.analysis import analyse
from phasmid.forces.minimum_norm import minimum_norm

__all__ = ["analyse", "minimum_norm"]
