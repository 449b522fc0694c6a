"""Servos of which it is not known yet whether they are lost."""

import numpy as np

from phasmid import load_robot
from phasmid.control import Observation
from phasmid.control.sequences import SequenceSettings
from phasmid.control.sequences.lameness import Lameness
from phasmid.control.sequences.leg_loss import ANSWER_TIME, DOUBT_TIME
from phasmid.control.sequences.stance import neutral_stance
from sequence_runs import Still

ROBOT = load_robot("phantomx-ax")
HOME = neutral_stance(ROBOT).q


class Catching(Still):
    """A walking controller that counts how often its feet are caught."""

    caught = 0

    def catch(self):
        self.caught += 1


def test_feet_are_caught_once_for_each_doubt():
    """A servo that is slow to answer, and no other, must not keep all feet on the ground."""
    walker = Catching()
    lameness = Lameness(walker, ROBOT, SequenceSettings())
    lameness.reset(0.0)
    silent = np.ones(HOME.shape, dtype=bool)
    silent[2, 1] = False
    middle = (DOUBT_TIME + ANSWER_TIME) / 2
    for doubt in (1, 2):
        begin = doubt * 10.0
        lameness.notice(Observation(begin, HOME, servo_running=np.ones(HOME.shape, dtype=bool)))
        for part in (0.5 * DOUBT_TIME, middle, 0.9 * ANSWER_TIME):
            lameness.notice(Observation(begin + part, HOME, servo_running=silent))
        assert walker.caught == doubt
