"""Gaits: who stands when, and whether that holds the robot up."""

import numpy as np
import pytest

from phasmid.errors import InvalidGait
from phasmid.gait import HEXAPOD_GAITS, Gait, load_gait, support_margin
from phasmid.kinematics import centre_of_mass, joint_angles, neutral_feet
from phasmid.robot import load_robot, preset_names


@pytest.mark.parametrize("gait", HEXAPOD_GAITS.values(), ids=lambda g: g.name)
def test_each_foot_stands_for_the_duty_factor_of_the_cycle(gait):
    # Midpoints of 36 000 equal parts; no event falls on one, so the count is exact.
    phase = (np.arange(36_000) + 0.5) / 36_000
    assert gait.stance(phase).mean(axis=0) == pytest.approx([gait.duty_factor] * 6, abs=1e-12)


@pytest.mark.parametrize("gait", HEXAPOD_GAITS.values(), ids=lambda g: g.name)
def test_legs_lift_at_the_phases_of_the_table(gait):
    for leg, offset in enumerate(gait.offsets):
        assert not gait.stance(np.array(float(offset)))[leg]
        assert gait.stance(np.array(offset - 1e-6))[leg]


@pytest.mark.parametrize(
    ("name", "feet"), [("tripod", 3), ("wave", 5), ("ripple", 4), ("amble", 4)]
)
def test_as_many_feet_stand_as_the_gait_promises(name, feet):
    phase = np.linspace(0, 1, 1001)[:-1] + 1e-4
    assert (load_gait(name).stance(phase).sum(axis=1) == feet).all()


@pytest.mark.parametrize("preset", preset_names())
@pytest.mark.parametrize("gait", HEXAPOD_GAITS.values(), ids=lambda g: g.name)
def test_every_gait_holds_every_preset_up(preset, gait):
    robot = load_robot(preset)
    q = joint_angles(robot.arrays, robot.arrays.neutral_foot)
    phase = (np.arange(3600) + 0.5) / 3600
    feet = np.broadcast_to(neutral_feet(robot)[:, :2], (3600, 6, 2))
    com = np.broadcast_to(centre_of_mass(robot, q)[:2], (3600, 2))
    assert support_margin(feet, gait.stance(phase), com).min() > 0.03


def test_tripods_are_legs_135_and_246():
    stance = load_gait("tripod").stance(np.array([0.25, 0.75]))
    assert stance.tolist() == [
        [False, True, False, True, False, True],
        [True, False, True, False, True, False],
    ]


def test_margin_of_a_square_is_the_distance_to_its_nearest_side():
    # Corners (+-1, +-1), centre of mass at (0.25, 0): nearest side x = 1; then outside at x = 1.5.
    feet = np.array([[1.0, 1], [-1, 1], [-1, -1], [1, -1]])[None]
    stance = np.ones((1, 4), dtype=bool)
    assert support_margin(feet, stance, np.array([[0.25, 0.0]])) == pytest.approx([0.75])
    assert support_margin(feet, stance, np.array([[1.5, 0.0]])) == pytest.approx([-0.5])
    # Beyond a corner it is the distance of the corner.
    assert support_margin(feet, stance, np.array([[2.0, 2.0]])) == pytest.approx([-np.sqrt(2)])


def test_lifting_a_foot_of_a_square_leaves_the_diagonal_as_the_edge():
    # The triangle's side runs through the centre: (0.25, 0) lies 0.25/sqrt(2) outside or inside.
    feet = np.array([[1.0, 1], [-1, 1], [-1, -1], [1, -1]])[None]
    com = np.array([[0.25, 0.0]])
    without = support_margin(feet, np.array([[False, True, True, True]]), com)
    assert without == pytest.approx([-0.25 / np.sqrt(2)])
    without = support_margin(feet, np.array([[True, True, False, True]]), com)
    assert without == pytest.approx([0.25 / np.sqrt(2)])


def test_two_feet_and_feet_on_a_line_do_not_hold():
    feet = np.array([[0.0, 0], [1, 0], [2, 0], [5, 5]])[None]
    com = np.array([[1.0, 0.0]])
    assert support_margin(feet, np.array([[True, True, True, False]]), com) == -np.inf
    assert support_margin(feet, np.array([[True, True, False, False]]), com) == -np.inf


@pytest.mark.parametrize(
    ("duty", "offsets", "message", "hint"),
    [
        (  # G1
            1.4,
            (0, 0.5, 0, 0.5, 0, 0.5),
            "gait.duty_factor is 1.4; it must be greater than 0 and less than 1.",
            "duty_factor = 0.5, the tripod gait of the paper",
        ),
        (  # G2
            0.3,
            (0, 0.5, 0, 0.5, 0, 0.5),
            'gait "custom" leaves 0 to 3 feet on the ground, 0 at phase 0.10; '
            "at least 3 are needed.",
            "duty_factor = 0.5 or more",
        ),
        (  # G4
            0.5,
            (0, 0.5, 1.7, 0.5, 0, 0.5),
            "gait.offsets[2] is 1.7; offsets are phases in [0, 1).",
            "",
        ),
    ],
)
def test_a_gait_that_cannot_be_says_why(duty, offsets, message, hint):
    with pytest.raises(InvalidGait) as caught:
        Gait("custom", duty, offsets)
    assert caught.value.what == message
    assert caught.value.hint == hint


def test_the_hint_for_a_gait_that_falls_does_hold():
    offsets = (0, 2 / 6, 4 / 6, 1 / 6, 5 / 6, 3 / 6)
    with pytest.raises(InvalidGait) as caught:
        Gait("custom", 0.4, offsets)
    hinted = float(caught.value.hint.split()[2])
    assert Gait("custom", hinted, offsets).stance(np.linspace(0, 1, 7200)).sum(axis=1).min() >= 3


def test_an_unknown_gait_is_answered_with_the_nearest():  # G10
    with pytest.raises(InvalidGait) as caught:
        load_gait("tripode")
    assert caught.value.what == 'no gait called "tripode".'
    assert caught.value.hint == '"tripod" (known: tripod, wave, ripple, amble)'
