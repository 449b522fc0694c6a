"""A body that tips over: the feet in the air land at once, and none lifts."""

import numpy as np
import pytest

from control.estimation.test_obstacle import Stage
from control.estimation.walker import DT, Walker
from phasmid.control.estimation.estimator import ROUGH_TIPPING, TIPPING
from phasmid.control.leg_phases import LANDING_SPEED, LANDING_TIME
from phasmid.control.types import Contact, LegPhase
from phasmid.experiment import Command


@pytest.mark.parametrize("share", [0.1, 0.4, 0.6])
def test_feet_in_the_air_land_at_once_and_none_lifts_while_the_body_tips(share):
    walker = Walker()
    leg, state, reference = walker.amid_swing(share), walker.state, walker.engine.reference
    height, reference.tipping = state.foot[leg, 2], 1
    # A foot that touches nothing goes on to its landing depth.
    down = height + walker.engine.settings.landing_depth
    time = max(1.875 * down / LANDING_SPEED, LANDING_TIME)
    for _ in range(round(time / DT) + 3):
        before, speed = state.foot.copy(), state.foot_velocity.copy()
        walker.step()
        mean = state.clock.time_scale * DT * (speed + state.foot_velocity) / 2
        # The trapezoid is off by h³ of the third derivative over 12: less than 1000 m/s³ in the
        # air. A foot that stops at contact has 60 v / T² with T of 12 ms, and ends within a step.
        in_air = np.isin(state.leg_phase, (LegPhase.SWING, LegPhase.PROBING))
        stops = LANDING_SPEED * DT / 2
        allowed = np.where(in_air, 1000 * DT**3 / 12 + 1e-6, stops)
        assert (np.abs(state.foot - before - mean) <= allowed[:, None]).all()
    phases, *_ = walker.walk(1.0)
    assert (phases == LegPhase.STANCE).all()
    reference.tipping = 0
    walker.walk(1.5)
    assert (state.leg_phase == LegPhase.SWING).any()
    assert state.velocity_filter[2, 0] > 0.02


def test_a_foot_that_has_hardly_lifted_stands_where_it_is():
    walker = Walker()
    walker.told[:] = Contact.GROUND
    leg, state = walker.amid_swing(0.0), walker.state
    place = state.foot[leg].copy()
    walker.engine.reference.tipping = 1
    walker.walk(0.05)
    assert state.leg_phase[leg] == LegPhase.STANCE
    np.testing.assert_allclose(state.foot[leg], place, atol=1e-4)


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_a_lost_leg_goes_on_folding_and_lifts_only_after_the_body_tips(share):
    """It changes its phase once at most, not at every update."""
    walker = Walker()
    leg, state, reference = walker.amid_swing(share), walker.state, walker.engine.reference
    lost = leg if share else int(np.argmax(state.leg_phase == LegPhase.STANCE))
    walker.command = Command(velocity=(0.02, 0.0, 0.0), lost_legs=frozenset({lost + 1}))
    walker.step()
    reference.tipping = 1
    phases, *_ = walker.walk(1.0)
    assert (np.diff(phases[:, lost]) != 0).sum() <= (1 if share else 0)
    reference.tipping = 0
    walker.until(lambda s: s.leg_phase[lost] == LegPhase.HELD)


@pytest.mark.parametrize(("high", "roughness"), [(0.0, 0.0), (0.023, 0.02), (0.4, 0.05)])
def test_on_rough_ground_a_body_may_tilt_farther_before_it_tips(high, roughness):
    """0.09 rad, and 0.01 rad more for each 10 mm of roughness up to 50 mm."""
    stage, foot = Stage(), np.zeros((6, 3))
    foot[0, 2] = high
    levelling = stage.memory.view(np.recarray)[0].estimator.levelling
    limit = TIPPING + ROUGH_TIPPING * roughness
    levelling.tilt = limit - 1e-3
    assert stage.write(foot).tipping == 0
    levelling.tilt = limit + 1e-3
    assert stage.write(foot).tipping == 1
