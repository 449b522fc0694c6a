"""Measured channels of the robot's own sensors: rate, delay, resolution, noise."""

from phasmid.sensors.measurement import sense

__all__ = ["sense"]
