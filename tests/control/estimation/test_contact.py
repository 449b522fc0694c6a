"""Which feet feel the ground, and sensors that die, stick, flicker and lie."""

import numpy as np
import pytest

from phasmid.control.estimation import contact
from phasmid.control.estimation.contact import detect_contact, detect_sensor_faults

DT = 0.005
LEGS = 2
SWING = 60
"""Updates of a swing, and of a stance: 0.3 s."""


class Feet:
    """Two feet that walk in turn over level ground, with sensors that tell what a test says."""

    def __init__(self, present=(True, True, False, False), touch_time=0.0, release_time=0.015):
        self.present = np.array(present)
        self.threshold = np.array([[0.5, 0.5], [1.5, 0.7], [1.5, 0.7], [1.5, 0.7]])
        self.settings = np.array([touch_time, release_time, 0.35, 0.5, 0.1])
        self.sensors, self.legs = np.zeros((LEGS, 4, 10)), np.zeros((LEGS, 5))
        self.legs[:, contact.WAS_STANDING], self.legs[:, contact.CODE] = 1.0, -1.0
        self.code, self.news = np.zeros(LEGS, dtype=np.int64), np.zeros((4, LEGS), dtype=np.int64)
        self.told = []

    def update(self, reading, standing, progress):
        standing = np.array(standing)
        detect_sensor_faults(standing, 2.0, self.sensors, self.legs, self.news)
        detect_contact(
            DT,
            np.array(reading, dtype=float),
            self.threshold,
            self.present,
            standing,
            np.array(progress, dtype=float),
            self.settings,
            self.sensors,
            self.legs,
            self.code,
            self.news,
        )
        self.told += [(int(s), int(i), int(self.news[s, i])) for s, i in np.argwhere(self.news)]
        self.news[:] = 0
        return self.code.copy()

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


def test_feet_are_told_as_they_touch_and_as_they_leave():
    feet = Feet()
    feet.step(honest)
    codes, truth = feet.step(honest)
    np.testing.assert_array_equal(codes[5:], truth[5:])
    # The release is believed after 15 ms, three updates.
    np.testing.assert_array_equal(codes[:3], [1, 1, 0])


@pytest.mark.parametrize("late", [-20, -5, 10])
def test_early_and_late_ground_is_told_at_once(late):
    feet = Feet()
    feet.step(honest)
    codes, _ = feet.step(honest, late)
    assert codes[SWING + late] == 1
    assert codes[SWING + late - 1] == 0


def test_forces_between_the_thresholds_change_nothing():
    feet = Feet(present=(False, True, False, False))
    told = [
        feet.update([[0] * 2, [f] * 2, [0] * 2, [0] * 2], [True, True], [0, 0])[0]
        for f in (1.0, 1.6, 1.0, 0.8, 0.6, 1.0, 1.0, 1.0, 1.0, 1.4)
    ]
    assert told == [0, 1, 1, 1, 1, 1, 0, 0, 0, 0]


def test_noise_about_one_threshold_is_no_flicker():
    """1.1 N half-way between, noise of 0.1 N: four deviations to either side."""
    feet, random = Feet(present=(False, True, False, False)), np.random.default_rng(1)
    feet.update([[0] * 2, [5.0] * 2, [0] * 2, [0] * 2], [True, True], [0, 0])
    for _ in range(1000):
        f = 1.1 + 0.1 * np.clip(random.standard_normal(2), -3.9, 3.9)
        assert feet.update([[0] * 2, f, [0] * 2, [0] * 2], [True, True], [0, 0])[0] == 1


def test_a_dead_switch_is_told_once_and_the_force_is_heard():
    feet = Feet()
    feet.step(honest)
    codes, truth = feet.step(lambda share, down: (np.nan, 8.0 * down))
    np.testing.assert_array_equal(codes[25:], truth[25:])
    assert feet.told == [(0, 0, contact.DEAD)]
    feet.step(honest)
    assert feet.told[1:] == [(0, 0, contact.HEALED)]


def test_all_sensors_dead_leave_the_plan():
    feet = Feet()
    feet.step(honest)
    codes, _ = feet.step(lambda share, down: (np.nan, np.nan))
    # For 0.1 s the last word stands.
    assert set(codes[21:]) == {-1}


def test_a_switch_stuck_on_never_ends_a_swing_and_is_doubted_after_two():
    feet = Feet(present=(True, False, False, False))
    feet.step(honest)
    for n in range(4):
        codes, _ = feet.step(lambda share, down: (1.0, 0.0))
        late_swing = codes[round(0.36 * SWING) : SWING]
        assert set(late_swing) == {-1}, "trust the plan, never the stuck switch"
        doubted = [told for told in feet.told if told[:2] == (0, 0)]
        # Judged at the lift after the step.
        assert len(doubted) == (n >= 2)
    assert doubted == [(0, 0, contact.STUCK_ON)]


def test_a_stuck_switch_hands_over_to_the_force_in_the_same_swing():
    feet = Feet()
    feet.step(honest)
    codes, truth = feet.step(lambda share, down: (1.0, 8.0 * down), late=-10)
    np.testing.assert_array_equal(codes[25:], truth[25:])


def test_a_switch_that_never_feels_the_ground_is_doubted():
    feet = Feet(present=(True, False, False, False))
    feet.step(honest)
    for _ in range(4):
        codes, _ = feet.step(lambda share, down: (0.0, 0.0))
    assert feet.told == [(0, 0, contact.STUCK_OFF)]
    assert set(codes[2:]) == {-1}


def test_a_flickering_switch_is_doubted_and_heals():
    feet, random = Feet(present=(True, False, False, False)), np.random.default_rng(2)
    feet.step(honest)
    for _ in range(4):
        feet.step(lambda share, down: (float(random.random() < 0.5), 0.0))
    assert feet.told == [(0, 0, contact.FLICKERS)]
    for _ in range(10):
        codes, truth = feet.step(honest)
    assert feet.told[1:] == [(0, 0, contact.HEALED)]
    np.testing.assert_array_equal(codes[5:], truth[5:])


def test_a_stumble_early_in_the_swing_is_a_hit():
    feet = Feet(present=(True, False, False, False))
    feet.step(honest)
    for k in range(30):
        share = k / SWING
        feet.update([[0.2 < share < 0.3, 1], *np.zeros((3, 2))], [False, True], [share, 0])
    assert feet.legs[0, contact.HITS] == 1.0
    assert feet.legs[1, contact.HITS] == 0.0
    feet.update([[1, 1], *np.zeros((3, 2))], [True, True], [0, 0])
    feet.update([[1, 1], *np.zeros((3, 2))], [False, True], [0, 0])
    assert feet.legs[0, contact.HITS] == 0.0


def test_a_foot_that_bounces_as_it_leaves_has_met_nothing():
    """Soft legs leave the ground late: before a quarter of the swing a touch is no hit."""
    feet = Feet(present=(True, False, False, False))
    feet.step(honest)
    for k in range(30):
        share = k / SWING
        feet.update([[0.14 < share < 0.2, 1], *np.zeros((3, 2))], [False, True], [share, 0])
    assert feet.legs[0, contact.HITS] == 0.0
