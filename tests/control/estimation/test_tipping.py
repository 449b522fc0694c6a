"""A body that tips over: the feet in the air land at once, and none lifts."""

import numpy as np
import pytest

from control.estimation.test_obstacle import Stage
from control.estimation.walker import DT, Walker
from phasmid.control.estimation.estimator import ROUGH_TIPPING, TIPPING
from phasmid.control.leg_phases import LANDING_SPEED, LANDING_TIME
from phasmid.control.types import Contact, LegPhase


@pytest.mark.parametrize("share", [0.1, 0.4, 0.6])
def test_feet_in_the_air_land_at_once_and_none_lifts_while_the_body_tips(share):
    walker = Walker()
    leg, state, reference = walker.amid_swing(share), walker.state, walker.engine.reference
    height, reference.tips = state.foot[leg, 2], 1
    # A foot that touches nothing goes on to its landing depth.
    down = height + walker.engine.settings.landing_depth
    time = max(1.875 * down / LANDING_SPEED, LANDING_TIME)
    for _ in range(round(time / DT) + 3):
        before, speed = state.foot.copy(), state.foot_velocity.copy()
        walker.step()
        mean = state.clock.time_scale * DT * (speed + state.foot_velocity) / 2
        # As in a swing; a foot stops at contact from 0.4 m/s in 12 ms, which is as abrupt.
        settles = (state.leg_phase == LegPhase.SETTLING) | (state.leg_phase == LegPhase.STANCE)
        allowed = np.where(settles, LANDING_SPEED * DT, 1000 * DT**3 / 12 + 1e-6)
        assert (np.abs(state.foot - before - mean) <= allowed[:, None]).all()
    phases, *_ = walker.walk(1.0)
    assert (phases == LegPhase.STANCE).all()
    reference.tips = 0
    walker.walk(1.5)
    assert (state.leg_phase == LegPhase.SWING).any()
    assert state.velocity_filter[2, 0] > 0.02


def test_a_foot_that_has_hardly_lifted_stands_where_it_is():
    walker = Walker()
    walker.told[:] = Contact.GROUND
    leg, state = walker.amid_swing(0.0), walker.state
    place = state.foot[leg].copy()
    walker.engine.reference.tips = 1
    walker.walk(0.05)
    assert state.leg_phase[leg] == LegPhase.STANCE
    np.testing.assert_allclose(state.foot[leg], place, atol=1e-4)


@pytest.mark.parametrize(("high", "roughness"), [(0.0, 0.0), (0.023, 0.02), (0.4, 0.05)])
def test_on_rough_ground_a_body_may_tilt_farther_before_it_tips(high, roughness):
    """0.09 rad, and 0.01 rad more for each 10 mm of roughness up to 50 mm."""
    stage, foot = Stage(), np.zeros((6, 3))
    foot[0, 2] = high
    levelling = stage.memory.view(np.recarray)[0].estimator.levelling
    limit = TIPPING + ROUGH_TIPPING * roughness
    levelling.tilt = limit - 1e-3
    assert stage.write(foot).tips == 0
    levelling.tilt = limit + 1e-3
    assert stage.write(foot).tips == 1
