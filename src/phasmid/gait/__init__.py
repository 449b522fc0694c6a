"""Which legs stand, when: gaits, a library of them, and the support they give."""

from phasmid.gait.gait import Gait
from phasmid.gait.library import GAITS, HEXAPOD_GAITS, check_gait_name, load_gait
from phasmid.gait.support import support_margin
from phasmid.gait.sway import Sway, sway

__all__ = [
    "GAITS",
    "HEXAPOD_GAITS",
    "Gait",
    "Sway",
    "check_gait_name",
    "load_gait",
    "support_margin",
    "sway",
]
