"""Estimation of contact, ground and attitude from the robot's sensors."""

from phasmid.control.estimation.settings import EstimatorSettings

__all__ = ["EstimatorSettings"]
