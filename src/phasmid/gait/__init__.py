"""Which legs stand, when: gaits, a library of them, and the support they give."""

from phasmid.gait.cycle import least_margin
from phasmid.gait.diagram import gait_diagram
from phasmid.gait.file import is_gait_file, offsets_in_order, read_gait
from phasmid.gait.forms import alternating_gait, gait_of_phases, gait_of_steps, wave_gait
from phasmid.gait.gait import Gait
from phasmid.gait.library import GAITS, HEXAPOD_GAITS, check_gait_name, gaits_of, load_gait
from phasmid.gait.limp import Limp, without_legs
from phasmid.gait.pace import Pace, choose_gait, choose_pace, choose_period
from phasmid.gait.search import Ordered, best_order
from phasmid.gait.support import margin_at, shortfall, support_margin
from phasmid.gait.sway import Sway, sway

__all__ = [
    "GAITS",
    "HEXAPOD_GAITS",
    "Gait",
    "Limp",
    "Ordered",
    "Pace",
    "Sway",
    "alternating_gait",
    "best_order",
    "check_gait_name",
    "choose_gait",
    "choose_pace",
    "choose_period",
    "gait_diagram",
    "gait_of_phases",
    "gait_of_steps",
    "gaits_of",
    "is_gait_file",
    "least_margin",
    "load_gait",
    "margin_at",
    "offsets_in_order",
    "read_gait",
    "shortfall",
    "support_margin",
    "sway",
    "wave_gait",
    "without_legs",
]
