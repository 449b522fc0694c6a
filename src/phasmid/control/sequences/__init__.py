"""Posture sequences and manual legs: a controller around the one that walks."""

from phasmid.control.sequences.posture import Packing, packing
from phasmid.control.sequences.sequencer import Sequencer, Stage

__all__ = ["Packing", "Sequencer", "Stage", "packing"]
