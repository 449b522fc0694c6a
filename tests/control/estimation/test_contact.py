"""Contact of the feet, and sensors that die, stick, flicker and lie."""

import numpy as np
import pytest

from phasmid.control.estimation.contact import detect_contact, detect_sensor_faults
from phasmid.control.estimation.state import SensorEvent
from support.estimation_records import new_parameters, new_state

DT = 0.005
LEGS = 2
SWING = 60
"""Updates of a swing, and of a stance: 0.3 s."""


class Feet:
    """Two feet that walk in turn over level ground, with sensors that tell what a test says."""

    def __init__(self, present=(True, True, False, False)):
        self.parameters = new_parameters(
            dt=DT,
            contact_on=(0.5, 1.5, 1.5, 1.5),
            contact_off=(0.5, 0.7, 0.7, 0.7),
            leg_count=LEGS,
        )
        self.state = new_state()
        self.state.used[:] = present
        self.events = []

    @property
    def hits(self):
        return self.state.feet["obstacle_hits"][:LEGS].tolist()

    def update(self, reading, standing, progress):
        feet = self.state.feet[:LEGS]
        feet["sensors"]["reading"][:] = np.transpose(reading)
        feet["standing"][:], feet["swing_progress"][:] = standing, progress
        detect_sensor_faults(self.state, self.parameters)
        detect_contact(self.state, self.parameters)
        event = feet["sensors"]["event"]
        self.events += [(int(s), int(i), int(event[i, s])) for s, i in np.argwhere(event.T)]
        event[:] = 0
        return feet["contact"].copy()

    def step(self, first, late=0):
        """A swing and a stance of the first foot; the codes and what was true.

        Args:
            first: What sensors 0 and 1 of it tell of (share of swing or None, whether it touches).
            late: Updates by which the ground is found late or, below 0, early.
        """
        codes, truth = [], []
        for k in range(2 * SWING):
            stands = k >= SWING
            down = k >= SWING + late
            share = 0.0 if stands else k / SWING
            switch, force = first(None if stands else share, down)
            reading = np.full((4, LEGS), np.nan)
            reading[:2] = [[switch, not stands], [force, 0.0 if stands else 8.0]]
            codes.append(self.update(reading, [stands, not stands], [share, 1 - share])[0])
            truth.append(down)
        return np.array(codes), np.array(truth)


def honest(share, down):
    return float(down), 8.0 * down


@pytest.mark.parametrize("late", [-20, -5, 0, 10])
def test_contact_follows_early_and_late_touchdown_at_once_and_lift_off(late):
    feet = Feet()
    feet.step(honest)
    codes, truth = feet.step(honest, late)
    np.testing.assert_array_equal(codes[5:], truth[5:])
    # The release is detected after 15 ms, three updates.
    np.testing.assert_array_equal(codes[:3], [1, 1, 0])


def test_forces_between_the_thresholds_change_nothing():
    feet = Feet(present=(False, True, False, False))
    contact = [
        feet.update([[0] * 2, [f] * 2, [0] * 2, [0] * 2], [True, True], [0, 0])[0]
        for f in (1.0, 1.6, 1.0, 0.8, 0.6, 1.0, 1.0, 1.0, 1.0, 1.4)
    ]
    assert contact == [0, 1, 1, 1, 1, 1, 0, 0, 0, 0]


def test_a_flickering_switch_is_distrusted_and_heals():
    feet, random = Feet(present=(True, False, False, False)), np.random.default_rng(2)
    feet.step(honest)
    for _ in range(4):
        feet.step(lambda share, down: (float(random.random() < 0.5), 0.0))
    assert feet.events == [(0, 0, SensorEvent.FLICKERING)]
    for _ in range(10):
        codes, truth = feet.step(honest)
    assert feet.events[1:] == [(0, 0, SensorEvent.RECOVERED)]
    np.testing.assert_array_equal(codes[5:], truth[5:])


@pytest.mark.parametrize(("begin", "end", "hits"), [(0.2, 0.3, 1), (0.14, 0.2, 0)])
def test_a_stumble_is_a_hit_and_a_bounce_of_a_foot_that_leaves_is_none(begin, end, hits):
    """Soft legs leave the ground late: before a quarter of the swing a touch is no hit."""
    feet = Feet(present=(True, False, False, False))
    feet.step(honest)
    for k in range(30):
        share = k / SWING
        feet.update([[begin < share < end, 1], *np.zeros((3, 2))], [False, True], [share, 0])
    assert feet.hits == [hits, 0]
    feet.update([[1, 1], *np.zeros((3, 2))], [True, True], [0, 0])
    feet.update([[1, 1], *np.zeros((3, 2))], [False, True], [0, 0])
    assert feet.hits[0] == 0
