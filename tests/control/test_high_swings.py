"""Swings whose top a leg does not reach beside the body: they are displaced laterally."""

import numpy as np
import pytest

from control.estimation.walker import DT, WAYS, Walker
from phasmid.control.leg_phases import MOST_LATERAL
from phasmid.control.types import Contact, LegPhase

LOW, HIGH = 0.03, 0.08
"""Step heights [m]: a leg of the robot rises 60 mm over its neutral foot and no more."""


def walker_that_steps(height, way="ahead"):
    """Its feet feel nothing; its steps are raised as on rough ground, after the velocity is set."""
    walker = Walker(way, step_height=LOW)
    walker.told[:] = Contact.UNKNOWN
    walker.step()
    walker.engine.reference.step_height = height
    return walker


@pytest.mark.parametrize("way", WAYS)
def test_a_swing_beyond_the_knee_s_reach_is_displaced_laterally(way):
    """Across the way, away from the hip, at most 60 mm; it rises to its full height.

    Middle legs that swing along their own direction stay on their line and are lower, by 20 %.
    """
    walker = walker_that_steps(HIGH, way)
    state, model = walker.state, walker.engine.model
    rises, sides = np.zeros(6), np.zeros(6)
    away = (model.neutral - model.p_body_hip)[:, :2]
    away -= np.outer(away @ walker.way, walker.way)
    for _ in range(round(4.0 / DT)):
        before, speed = state.foot.copy(), state.foot_velocity.copy()
        walker.step()
        # The trapezoid is off by h³ of the third derivative over 12. The lift has 384 height / T³,
        # less than 300 m/s³, and the line less than 700.
        mean = state.clock.time_scale * DT * (speed + state.foot_velocity) / 2
        assert np.abs(state.foot - before - mean).max() < 1000 * DT**3 / 12 + 1e-6
        swings = state.leg_phase == LegPhase.SWING
        rises[swings] = np.maximum(rises[swings], state.foot[swings, 2])
        lateral = state.swing_lateral[swings]
        assert np.abs(lateral @ walker.way).max(initial=0.0) < 1e-9
        assert np.linalg.norm(lateral, axis=1).max(initial=0.0) <= MOST_LATERAL + 1e-9
        side = (lateral * away[swings]).sum(axis=1)
        assert (side > -1e-9).all()
        sides[swings] = np.maximum(sides[swings], side)
    assert (sides > 0.0).sum() == (4 if walker.way[1] else 6)
    # Of the curve 64 (s - s²)³ a sample is within 12 ds² of the top, ds half an update.
    heights = HIGH * np.array([1, 0.8 if walker.way[1] else 1, 1] * 2)
    assert (rises > heights * (1 - 12 * (DT / 2 / 0.5) ** 2)).all()
    assert not any(sentence.startswith("held all") for sentence in walker.said)


def test_a_swing_within_reach_stays_on_its_line():
    walker = walker_that_steps(LOW)
    for _ in range(round(2.0 / DT)):
        walker.step()
        assert not walker.state.swing_lateral.any()
