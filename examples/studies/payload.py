"""Metric of payload.toml."""


def warming(recording):
    """Return by how much the warmest servo has warmed during the run [K]."""
    temperature = recording["servo_temperature"].values
    return float((temperature[-1] - temperature[0]).max())
