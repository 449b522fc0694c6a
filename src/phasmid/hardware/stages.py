"""Stages of a drive on a bus, their longest times, and the report of a drive."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum

from phasmid.experiment.ending import Failure

LONGEST_RAMP = 4.0
"""Longest time for the confirmation of all output limits, after `DriverSettings.ramp_time` [s]."""

LONGEST_RISE = 60.0
"""Longest time for standing up [s]."""

WALK_STRETCH = 2.0
"""Longest time for walking, as a multiple of its duration. The controller's time is slower than
real time where joints are too slow."""

WALK_EXCESS = 10.0
"""Longest time for walking beyond this multiple [s]: five holds."""

MOST_HOLDS = 3
"""Number of holds within `HOLD_WINDOW` after which the robot sits down: the bus is not steady."""

HOLD_WINDOW = 10.0
"""Time in which holds are counted [s]. With 5 % of lost packets one comes by chance in 40 minutes:
all five readings of 0.1 s are lost."""

STEADY_TIME = 0.2
"""Time for which servos must answer again before the robot goes on [s]."""


class Stage(Enum):
    """Stage of a drive: what the driver commands. Only `OFF` states what the servos confirm."""

    RAMP = "the output limits are raised"
    RISE = "the robot stands up"
    WALK = "the robot walks"
    HOLD = "no goals are written"
    SIT = "the robot sits down"
    RELEASE = "the output limits are lowered"
    OFF = "the torque is off"


MOVING = Stage.RAMP, Stage.RISE, Stage.WALK, Stage.SIT
"""Stages in which goals are written."""


@dataclass
class DriveReport:
    """What happened during a drive.

    Attributes:
        ending: What ended it early; None where it was completed.
        unconfirmed: Names of the servos that have not confirmed that their torque is off.
        events: Times since the beginning [s] and sentences.
        ticks: Number of ticks.
        late: Ticks that began more than 5 ms late.
        worst_delay: Longest delay of a tick [s].
        walked: Time for which the robot walked [s].
        reading_rate: Readings of each servo a second [1/s].
        hottest: Highest measured temperature [°C].
        hottest_predicted: Highest computed one [°C].
        lowest_voltage: Lowest measured supply [V].
        lost: Answers that were lost or damaged.
        answers: Intact answers.
    """

    ending: Failure | None = None
    unconfirmed: list[str] = field(default_factory=list)
    events: list[tuple[float, str]] = field(default_factory=list)
    ticks: int = 0
    late: int = 0
    worst_delay: float = 0.0
    walked: float = 0.0
    reading_rate: float = 0.0
    hottest: float = -math.inf
    hottest_predicted: float = -math.inf
    lowest_voltage: float = math.inf
    lost: int = 0
    answers: int = 0
