"""What a controller knows of the ground by its senses."""

from phasmid.control.feel.settings import FeelSettings

__all__ = ["FeelSettings"]
