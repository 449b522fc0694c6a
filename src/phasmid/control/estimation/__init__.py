"""What a controller knows of the ground by its senses."""

from phasmid.control.estimation.settings import EstimatorSettings

__all__ = ["EstimatorSettings"]
