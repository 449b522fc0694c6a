"""Servos that do not answer, and are not known to be lost yet."""

import numpy as np

from phasmid import load_robot
from phasmid.control import Command, Observation, Sequencer
from phasmid.control.sequences.leg_loss import DOUBT_TIME, LOSS_TIME
from phasmid.control.sequences.stance import neutral_stance
from sequence_runs import Still

ROBOT = load_robot("phantomx-ax")
HOME = neutral_stance(ROBOT).q


class Catching(Still):
    """A walking controller that counts how often its swing legs are landed."""

    caught = 0

    def catch(self):
        self.caught += 1


def test_swing_legs_are_landed_once_for_each_doubt():
    """A servo that is slow to answer, and no other, must not keep all feet on the ground."""
    walker = Catching()
    sequencer = Sequencer(walker, ROBOT)
    sequencer.reset(Observation(0.0, HOME))
    running = np.ones(HOME.shape, dtype=bool)
    silent = running.copy()
    silent[2, 1] = False
    middle = (DOUBT_TIME + LOSS_TIME) / 2
    for doubt in (1, 2):
        begin = doubt * 10.0
        sequencer.update(Observation(begin, HOME, servo_running=running), Command())
        for part in (0.5 * DOUBT_TIME, middle, 0.9 * LOSS_TIME):
            sequencer.update(Observation(begin + part, HOME, servo_running=silent), Command())
        assert walker.caught == doubt
