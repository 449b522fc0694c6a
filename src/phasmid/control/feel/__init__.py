"""What a controller knows of the ground by its senses."""

from phasmid.control.feel.feeling import Feeling, Felt, Intent
from phasmid.control.feel.settings import FeelSettings

__all__ = ["FeelSettings", "Feeling", "Felt", "Intent"]
