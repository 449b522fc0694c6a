"""What is measured of the robot, as its sensors tell it: rate, delay, steps, noise."""

from phasmid.sensors.measurement import measured_channels, sense

__all__ = ["measured_channels", "sense"]
