"""The reach of a leg by its bounds, without angles, equals that by its joint angles."""

from dataclasses import replace

import numpy as np
import pytest

from phasmid.control.engine import LocomotionEngine
from phasmid.control.reach import (
    AT_ENOUGH,
    AT_PLANNED,
    ENOUGH,
    PLANNED,
    is_within,
    joint_limit_margin,
    reach_bounds,
)
from phasmid.robot import load_robot, preset_names

ROUND_OFF = 1e-10
"""Of margins, which are angles over 0.02 rad, or less where joints hardly turn. Angles have a
round-off of 1e-15 times the leg's conditioning, which is below 1e3 at the margin of stretch."""


def engine_of(name, **settings):
    robot = beside_its_plane() if name == "offset" else load_robot(name)
    return LocomotionEngine(robot, ground_sensing=False, dynamics="none", **settings)


def beside_its_plane():
    """The quadruped with feet 30 and 50 mm beside their legs' planes."""
    robot, legs = load_robot("quadruped"), []
    for leg, left in zip(robot.legs, (-0.03, -0.05, 0.05, 0.03), strict=True):
        foot = leg.neutral_foot + np.array([0.0, left, 0.0])
        legs.append(replace(leg, coxa=replace(leg.coxa, lateral_offset=left), neutral_foot=foot))
    return replace(robot, legs=tuple(legs))


def compare(model, count=2000):
    """Compare both at random places; return how many are within, by each share."""
    far = model.lengths[:, :3].sum(axis=1).max()
    places = np.random.default_rng(1).uniform(-far, far, (count, 3))
    within, q = np.zeros(2, int), np.empty(3)
    for leg in range(len(model.lengths)):
        for p in places:
            margin = joint_limit_margin(model, leg, p, q)
            for at, share in ((AT_PLANNED, PLANNED), (AT_ENOUGH, ENOUGH)):
                found = is_within(model, at, leg, *p)
                within[at] += found
                assert found == (margin >= share) or abs(margin - share) < ROUND_OFF, (leg, p)
    return within


@pytest.mark.parametrize("name", [*preset_names(), "offset"])
def test_a_place_is_within_where_its_angles_keep_the_margins(name):
    engine = engine_of(name)
    planned, enough = compare(engine.model)
    # Wider margins leave less.
    assert 100 < planned < enough


@pytest.mark.parametrize("joint", range(3))
@pytest.mark.parametrize(
    ("low", "high"), [(-9, 9), (-3.3, 0.5), (-0.5, 3.3), (-0.1, 0.05), (0.3, 1.2), (-2.9, -1)]
)
def test_wide_and_narrow_ranges_of_joints(joint, low, high):
    """Up to three turns, beyond half a turn to one side, narrow, and on one side of zero."""
    # A coxa's range that is not even about zero tells to which side the foot's plane lies.
    engine = engine_of("offset" if joint == 0 else "phantomx-ax", joint_margin=0.1)
    model = engine.model
    limits = model.limits.copy()
    limits[:, joint] = low, high
    reach = reach_bounds(model.lengths, limits, model.stretch, model.joint_margin)
    model.limits[:], model.reach[:] = limits, reach
    within = compare(model, count=500)
    # A knee bends to one side alone, and by 0.4 rad where the leg is stretched to 0.98.
    none = joint == 2 and low > -0.6
    assert within[AT_PLANNED] == 0 if none else (within > 0).all()


def test_a_leg_without_a_margin_of_stretch_reaches_up_to_its_length():
    engine = engine_of("phantomx-ax", stretch=1.0, joint_margin=0.0)
    assert (compare(engine.model) > 100).all()
