"""Plans of crawling, tilted and uneven robots."""

import math
from dataclasses import replace

import numpy as np
import pytest

from phasmid.errors import InfeasibleWalk
from phasmid.gait import sway
from phasmid.kinematics import neutral_feet
from phasmid.motion import plan, progress, trunk_motion
from phasmid.robot import with_neutral_foot
from phasmid.scenario import load_scenario
from support.walks import tilted_robot

PAPER = load_scenario("paper")
TILTED = tilted_robot()


def test_a_sway_goes_about_the_path_and_ends_where_it_began():
    walk = plan(PAPER.replace(robot="quadruped", gait="crawl", duration=4.0))
    start, end = walk.sample(np.array([0.0, 4.0])).trunk.position
    # Two cycles of 40 mm / 0.85 each.
    assert end - start == pytest.approx([0.08 / 0.85, 0, 0], abs=1e-12)
    # The feet of a side add up to two waves 0.15 of a cycle apart, those of the other to as much:
    # aside the body moves by 0.1 · 2 · 2 cos(0.15 π) of a foot's distance, less the samples' gaps.
    aside = walk.trunk.position[:, 1]
    most = 0.4 * math.cos(0.15 * math.pi) * abs(neutral_feet(walk.robot)[0, 1])
    assert 0.99 * most < np.abs(aside).max() <= most + 1e-12
    # On an arc it is that of the gait in the body's own axes.
    walk = plan(PAPER.replace(robot="quadruped", gait="crawl", step_turn_deg=12, period=4.0))
    stride, time = walk.experiment.course.stride, walk.time
    path = trunk_motion(stride.step, 0.0, progress(walk.gait, stride, time))
    away = walk.trunk.position - path.position
    aside = np.einsum("tji,tj->ti", walk.trunk.rotation, away)[:, :2]
    expected = sway(walk.gait, neutral_feet(walk.robot), stride.period, time)[0]
    assert np.abs(aside - expected).max() < 1e-12


@pytest.mark.parametrize("angle", [30.0, 137.0])
def test_a_robot_turned_in_its_frame_walks_alike_in_the_turned_direction(angle):
    # All mounts and the trunk turned by one angle about z is the same machine; led along the turned
    # direction its joints move the same, within the round-off of the inverse.
    robot, c, s = tilted_robot(), math.cos(math.radians(angle)), math.sin(math.radians(angle))
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])

    def turned(leg):
        yaw = leg.mount_yaw + math.radians(angle)
        return replace(leg, mount_position=R @ leg.mount_position, mount_yaw=yaw)

    body = replace(robot.body, com=R @ robot.body.com, inertia=R @ robot.body.inertia @ R.T)
    other = replace(robot, body=body, legs=tuple(turned(leg) for leg in robot.legs))
    ours = plan(PAPER.replace(robot=robot, step_length=0.04))
    theirs = plan(PAPER.replace(robot=other, step_length=0.04 * c, step_sideways=0.04 * s))
    assert np.abs(ours.q - theirs.q).max() < 1e-12
    assert np.abs(ours.qdd - theirs.qdd).max() < 1e-9


def test_a_stance_is_as_wide_and_high_as_told_in_the_bodys_axes():
    # Whatever the tilt, seen from above and along the body's vertical; 1e-15 m is round-off.
    robot = tilted_robot()
    for radius, height in ((0.14, 0.09), (None, 0.11), (0.16, None), (None, None)):
        feet = neutral_feet(with_neutral_foot(robot, radius, height)) - robot.arrays.p_body_hip
        assert np.hypot(*feet[:, :2].T) == pytest.approx([radius or 0.15] * 6, abs=1e-15)
        assert feet[:, 2] == pytest.approx([-(height or 0.1)] * 6, abs=1e-15)


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        (
            {"robot": TILTED, "stance_law": "coxa-only"},
            "leg right_front cannot stand by its coxa alone: that axis leans by 21.5°, and would",
        ),
        (
            {"robot": "quadruped", "gait": "crawl", "stance_law": "coxa-only"},
            'gait "crawl" sways the body, which a stance by the coxae alone cannot.',
        ),
        (
            {"robot": TILTED, "step_length_mm": 400},
            "step of 400 mm is too much for right_rear: the foot would be 289.4 mm from the femur",
        ),
        (
            {"robot": "quadruped", "gait": {"name": "crawl", "sway": 0.0}, "step_length_mm": -40},
            "at phase 0.00 the centre of mass is 6.1 mm outside the support polygon.",
        ),
    ],
)
def test_a_walk_that_an_odd_robot_cannot_make_is_told_why(changes, what):
    with pytest.raises(InfeasibleWalk) as caught:
        plan(PAPER.replace(**changes))
    assert caught.value.what.startswith(what)
