"""Measured channels of the robot's own sensors: rate, delay, resolution, noise."""

from phasmid.simulation.sensors.measurement import sense

__all__ = ["sense"]
