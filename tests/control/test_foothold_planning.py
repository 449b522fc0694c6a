"""Footholds, swings and body height that are planned on a height map."""

import numpy as np
import pytest

from phasmid.control import LocomotionEngine
from phasmid.control.estimation import EstimatorSettings
from phasmid.control.foothold_planning import (
    FOOT_CLEARANCE,
    SPACING,
    TRUNK_CLEARANCE,
    WINDOW,
)
from phasmid.control.terrain_map import CELL
from phasmid.experiment import Command, Observation
from phasmid.kinematics import neutral_feet
from phasmid.robot import load_robot

ROBOT = load_robot("phantomx-mk4")
HEIGHT = 0.1
PLACES = [w.ravel() for w in np.meshgrid(*[np.arange(-0.45, 0.45, 0.005) + 0.002] * 2)]


def seeing(height):
    """Return an engine at rest that has seen the ground, a function of x and y in odom."""
    engine = LocomotionEngine(
        ROBOT, terrain_map="points", estimator=EstimatorSettings(depth_delay=0.0, motion_lag=0.0)
    )
    points = np.column_stack([*PLACES, height(*PLACES) - HEIGHT])
    readings = {"joint_position": engine.state.q.copy(), "contact": np.ones(6, dtype=bool)}
    engine.reset(Observation(time=0.0, **readings))
    for k in range(2):
        engine.update(Observation(time=0.005 * k, ground_points=points, **readings), Command())
    return engine


def test_on_level_ground_feet_step_to_their_neutral_places():
    """At rest the neutral place costs nothing; the body rises for nothing."""
    engine = seeing(lambda x, y: 0.0 * x)
    footholds = engine.state.next_foothold
    np.testing.assert_allclose(footholds[:, :2], engine.model.neutral[:, :2], atol=SPACING / 2)
    np.testing.assert_allclose(footholds[:, 2], 0.0, atol=1e-3)
    lowest = HEIGHT - ROBOT.body.size[2] / 2 - TRUNK_CLEARANCE
    assert engine.reference.least_rise == pytest.approx(-lowest, abs=1e-3)


def test_feet_keep_away_from_holes():
    """A trench under the front feet: they land beside it, a cell and more from its edges."""
    place = float(neutral_feet(ROBOT)[0, 0])
    engine = seeing(lambda x, y: np.where(np.abs(x - place) < 0.025, -0.1, 0.0))
    for leg in (0, 5):
        x, _, z = engine.state.next_foothold[leg]
        assert z == pytest.approx(0.0, abs=1e-3)
        assert abs(x - place) > 0.025 + CELL
        assert abs(x - place) <= WINDOW * SPACING + SPACING


def test_swings_clear_what_lies_on_their_way():
    """A wall of 40 mm between two places: the middle of the swing is above it."""
    engine = seeing(lambda x, y: 0.0 * x)
    assert engine.reference.swing_height.max() <= FOOT_CLEARANCE / (64 * (0.25 * 0.75) ** 3) + 1e-3
    wall = seeing(lambda x, y: np.where(np.hypot(x, y) > 0.215, 0.04, 0.0))
    assert wall.reference.swing_height.max() >= 0.04


def test_the_trunk_clears_a_block_beneath_it():
    """The least height is that of the block, plus clearance and depth of the trunk."""
    block = 0.06
    engine = seeing(lambda x, y: np.where(np.hypot(x, y) < 0.05, block, 0.0))
    needed = block + ROBOT.body.size[2] / 2 + TRUNK_CLEARANCE - HEIGHT
    assert engine.reference.least_rise == pytest.approx(needed, abs=2e-3)


def test_ground_that_is_not_known_is_not_planned_on():
    engine = seeing(lambda x, y: np.where(x > 0, np.nan, 0.0))
    assert np.isnan(engine.state.next_foothold[[0, 5]]).all()
    assert np.isfinite(engine.state.next_foothold[[2, 3]]).all()


@pytest.mark.parametrize("points", [None, np.zeros((0, 3)), np.full((5, 3), np.nan)])
def test_without_new_ground_points_the_feet_alone_sense_the_ground(points):
    """The plan lasts 0.5 s, then nothing of it is left, with one event; a reading plans again.

    Readings of a covered sensor hold no points.
    """
    engine = seeing(lambda x, y: np.where(np.hypot(x, y) > 0.215, 0.04, 0.0))
    joints = {"joint_position": engine.state.q.copy(), "contact": np.ones(6, dtype=bool)}
    readings = joints | {"ground_points": points}
    for time in (0.3, 0.5, 0.6):
        assert np.isfinite(engine.state.next_foothold).any()
        engine.update(Observation(time=time, **readings), Command())
    assert np.isnan(engine.state.next_foothold).all()
    assert (engine.reference.swing_height == 0.0).all()
    assert engine.reference.least_rise == -np.inf
    engine.update(Observation(time=0.7, **readings), Command())
    lost = "no ground points arrive; the feet alone sense the ground"
    assert [sentence for _, sentence in engine.events].count(lost) == 1
    engine.update(
        Observation(
            time=0.8, ground_points=np.column_stack([*PLACES, 0 * PLACES[0] - HEIGHT]), **joints
        ),
        Command(),
    )
    assert np.isfinite(engine.state.next_foothold).any()


def test_a_depth_sensor_that_never_sends_points_is_reported():
    engine = LocomotionEngine(ROBOT, terrain_map="points")
    readings = {"joint_position": engine.state.q.copy(), "contact": np.ones(6, dtype=bool)}
    engine.reset(Observation(time=0.0, **readings))
    for time in (0.3, 0.6, 0.9):
        engine.update(Observation(time=time, **readings), Command())
    sentences = [sentence for _, sentence in engine.events]
    assert sentences.count("no ground points arrive; the feet alone sense the ground") == 1
