"""Standing up, sitting down, legs by hand and lost legs, around a controller that walks."""

from phasmid.control.sequences.leg_loss import LegFaultDetector, lifted_leg
from phasmid.control.sequences.packed import Packing, packing
from phasmid.control.sequences.sequencer import Sequencer
from phasmid.control.sequences.settings import SequenceSettings
from phasmid.control.sequences.stage import Stage

__all__ = [
    "LegFaultDetector",
    "Packing",
    "SequenceSettings",
    "Sequencer",
    "Stage",
    "lifted_leg",
    "packing",
]
