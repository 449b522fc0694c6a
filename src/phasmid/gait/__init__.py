"""Gaits: schedules of stance and swing, a library of them, and their support margins."""

from phasmid.gait.cycle import Sway, least_margin, sway
from phasmid.gait.file import is_gait_file, offsets_in_order, read_gait
from phasmid.gait.gait import Gait, gait_diagram
from phasmid.gait.library import (
    GAIT_NAMES,
    GAITS,
    HEXAPOD_GAITS,
    alternating_gait,
    check_gait_name,
    default_gait,
    gaits_of,
    load_gait,
    wave_gait,
)
from phasmid.gait.limp import Limp, without_legs
from phasmid.gait.search import SearchedGait, best_order
from phasmid.gait.support import shortfall, support_margin

__all__ = [
    "GAITS",
    "GAIT_NAMES",
    "HEXAPOD_GAITS",
    "Gait",
    "Limp",
    "SearchedGait",
    "Sway",
    "alternating_gait",
    "best_order",
    "check_gait_name",
    "default_gait",
    "gait_diagram",
    "gaits_of",
    "is_gait_file",
    "least_margin",
    "load_gait",
    "offsets_in_order",
    "read_gait",
    "shortfall",
    "support_margin",
    "sway",
    "wave_gait",
    "without_legs",
]
