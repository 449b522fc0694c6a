"""What a robot is about while it stands up, walks or sits down."""

from __future__ import annotations

from enum import Enum


class Stage(Enum):
    """What the robot is about; the value is told in channel ``sequence``."""

    LYING = 0
    GETTING_UP = 1
    STANDING = 2
    STOPPING = 3
    LIFTING = 4
    MANUAL_LEG = 5
    GATHERING = 6
