"""What the servos are set to and fed with."""

from __future__ import annotations

from phasmid.tables import Table


class ServoTable(Table):
    """``[servo]``: settings of the robot's servos; those that are absent are the servo's own."""
