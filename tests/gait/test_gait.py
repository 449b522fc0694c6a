"""Gaits: who stands when, and whether that holds the robot up."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from phasmid.errors import InvalidGait
from phasmid.gait import GAITS, HEXAPOD_GAITS, Gait, load_gait, support_margin, sway
from phasmid.kinematics import centre_of_mass, joint_angles, neutral_feet
from phasmid.robot import load_robot
from support.walks import WALKS


@pytest.mark.parametrize("gait", HEXAPOD_GAITS.values(), ids=lambda g: g.name)
def test_legs_lift_at_their_offsets_and_stand_for_the_duty_factor(gait):
    # Midpoints of 36 000 equal parts; no event falls on one, so the count is exact.
    phase = (np.arange(36_000) + 0.5) / 36_000
    assert gait.stance(phase).mean(axis=0) == pytest.approx([gait.duty_factor] * 6, abs=1e-12)
    for leg, offset in enumerate(gait.offsets):
        assert not gait.stance(np.array(float(offset)))[leg]
        assert gait.stance(np.array(offset - 1e-6))[leg]


@pytest.mark.parametrize(("preset", "name"), WALKS)
def test_every_gait_holds_every_preset_up(preset, name):
    robot = load_robot(preset)
    gait = load_gait(name, len(robot.legs))
    q = joint_angles(robot.arrays, robot.arrays.neutral_foot)
    phase = (np.arange(3600) + 0.5) / 3600
    neutral = neutral_feet(robot)
    feet = np.broadcast_to(neutral[:, :2], (3600, len(robot.legs), 2))
    com = centre_of_mass(robot, q)[:2] + sway(gait, neutral, 1.0, phase).way
    # Three feet of four leave less to stand on than three of six.
    least = 0.02 if len(robot.legs) == 4 else 0.03
    assert support_margin(feet, gait.stance(phase), com).min() > least


@pytest.mark.parametrize("gaits", GAITS.values())
def test_the_usual_gait_of_so_many_legs_is_its_own_mirror_image_half_a_cycle_later(gaits):
    # Legs are numbered around the body, so that the mirror image of the first is the last. What
    # turns the robot to one side in a half of the cycle turns it back in the other.
    offsets = np.array(next(iter(gaits.values())).offsets)
    half = (offsets[::-1] - offsets + 0.5) % 1.0
    np.testing.assert_allclose((half + 0.5) % 1.0, 0.5, rtol=0, atol=1e-15)


def test_the_sway_is_the_mean_of_waves_away_from_each_foot():
    # One foot alone at (4, 0), the others' offsets symmetric: with feet on a square of half side a
    # lifted in turn around it, the way is a circle of 2 sway sqrt(2) a, away from the foot amid its
    # swing; speed and acceleration are its derivatives, 2 pi / T and its square.
    gait, a, period = Gait("round", 5 / 6, (0, 3 / 4, 2 / 4, 1 / 4), sway=0.1), 0.2, 3.0
    feet = a * np.array([[1, -1], [-1, -1], [-1, 1], [1, 1.0]])
    amid = period * (np.array(gait.offsets) + 1 / 12)
    way, speed, acceleration = sway(gait, feet, period, amid)
    np.testing.assert_allclose(way, -0.2 * feet, rtol=0, atol=1e-15)
    rate = 2 * np.pi / period
    np.testing.assert_allclose(acceleration, -(rate**2) * way, rtol=0, atol=1e-14)
    assert np.hypot(*speed.T) == pytest.approx([0.2 * np.sqrt(2) * a * rate] * 4, abs=1e-15)
    step = 1e-6
    ahead, behind = (sway(gait, feet, period, amid + h).way for h in (step, -step))
    np.testing.assert_allclose((ahead - behind) / (2 * step), speed, rtol=0, atol=1e-9)


FOR_EIGHT = '"tetrapod" (known: tetrapod, wave, ripple, metachronal)'


@pytest.mark.parametrize(
    ("name", "legs", "what", "hint"),
    [
        ("tripod", 8, 'gait "tripod" has no meaning for 8 legs; it is one of 6 legs.', FOR_EIGHT),
        (
            "alternating",
            6,
            'gait "alternating" has no meaning for 6 legs; it is one of',
            '"tripod"',
        ),
        ("tripode", 6, 'no gait called "tripode".', '"tripod" (known: tripod, wave, ripple, amb'),
        ("trot", 4, 'no gait called "trot".', '"crawl"'),
    ],
)
def test_an_unknown_gait_is_answered_with_those_that_there_are(name, legs, what, hint):
    with pytest.raises(InvalidGait) as caught:
        load_gait(name, legs)
    assert caught.value.what.startswith(what)
    assert caught.value.hint.startswith(hint)


@pytest.mark.parametrize("amount", [-0.1, 0.6, np.nan])
def test_a_sway_beyond_the_feet_is_refused(amount):
    with pytest.raises(InvalidGait, match=r"gait.sway is .*; it must be at least 0 and at most"):
        Gait("mine", 5 / 6, (0, 3 / 4, 2 / 4, 1 / 4), sway=amount)


def test_the_hint_for_a_gait_that_falls_does_hold():
    offsets = (0, 2 / 6, 4 / 6, 1 / 6, 5 / 6, 3 / 6)
    with pytest.raises(InvalidGait) as caught:
        Gait("custom", 0.4, offsets)
    hinted = float(caught.value.hint.split()[2])
    assert Gait("custom", hinted, offsets).stance(np.linspace(0, 1, 7200)).sum(axis=1).min() >= 3


def hull_margin(feet, point):
    """Signed distance of a point from the convex hull of feet."""
    hull = ConvexHull(feet)
    inside = -(hull.equations[:, :2] @ point + hull.equations[:, 2]).max()
    if inside >= 0:
        return inside
    corners = feet[hull.vertices]
    along = np.roll(corners, -1, axis=0) - corners
    share = np.clip(((point - corners) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
    return -np.linalg.norm(point - corners - share[:, None] * along, axis=1).min()


@pytest.mark.parametrize("legs", [4, 5, 6, 8])
def test_the_margin_is_the_distance_from_the_convex_hull(legs):
    # Feet within 0.4 m: a few products rounded by 1e-16, divided by lengths of edges over 1e-3 m.
    rng = np.random.default_rng(legs)
    feet = rng.uniform(-0.4, 0.4, (200, legs, 2))
    stance = rng.random((200, legs)) < 0.7
    com = rng.uniform(-0.4, 0.4, (200, 2))
    found = support_margin(feet, stance, com)
    for k in range(200):
        if stance[k].sum() < 3:
            assert found[k] == -np.inf
        else:
            wanted = hull_margin(feet[k, stance[k]], com[k])
            assert found[k] == pytest.approx(wanted, rel=0, abs=1e-12)


def test_feet_on_a_line_have_no_margin_and_feet_in_one_place_count_once():
    line = np.array([[0.0, 0], [1, 0], [2, 0], [5, 5]])
    assert support_margin(line, np.array([True, True, True, False]), np.zeros(2)) == -np.inf
    twice = np.array([[0.0, 0], [4, 0], [0, 3], [0, 0]])
    # The incircle of that triangle has radius 1 about (1, 1).
    margin = support_margin(twice, np.ones(4, dtype=bool), np.ones(2))
    assert margin == pytest.approx(1.0, abs=1e-15)


def test_stance_and_centre_of_mass_broadcast_over_the_samples():
    feet = np.zeros((2, 3, 4, 2)) + np.array([[1.0, 1], [-1, 1], [-1, -1], [1, -1]])
    margin = support_margin(feet, np.ones(4, dtype=bool), np.array([0.25, 0.0]))
    np.testing.assert_array_equal(margin, np.full((2, 3), 0.75))
