"""What measures the robot, and how well."""

from __future__ import annotations

from phasmid.tables import Table


class SensorsTable(Table):
    """``[sensors]``: rate, delay and noise of what measures the robot."""
