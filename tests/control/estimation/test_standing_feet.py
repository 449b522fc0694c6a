"""Feet that have just landed take on their load, and feet that feel the air look for the ground."""

import numpy as np
import pytest

from control.estimation.walker import DT, Walker
from phasmid.control.types import LegPhase


@pytest.fixture
def walker():
    """Its feet feel nothing unless they are told to."""
    found = Walker()
    found.told[:] = -1.0
    return found


def test_a_foot_that_met_the_ground_hanging_low_goes_on_down_by_that(walker):
    """Touched at z with a sag s it ends at z - s: what it does beyond is 0.4 of 12 ms of its speed.

    That speed is 0.1 m/s here at most.
    """
    sag = 0.006
    leg = walker.amid_swing(0.0)
    walker.told[:] = 0.0
    state = walker.until(lambda s: s.swing_elapsed[leg] > 0.9 * s.swing_duration[leg])
    met = state.foot[leg, 2]
    walker.told[leg], walker.engine.reference.foot_sag[leg] = 1.0, sag
    walker.until(lambda s: s.leg_phase[leg] == LegPhase.SETTLING)
    walker.told[:] = -1.0
    walker.until(lambda s: s.leg_phase[leg] == LegPhase.STANCE)
    walker.until(lambda s: s.swing_elapsed[leg] >= s.swing_duration[leg])
    assert state.foot[leg, 2] == pytest.approx(met - sag, abs=0.1 * (DT + 0.4 * 0.012))


def test_a_standing_foot_that_feels_the_air_goes_down_until_it_feels_the_ground(walker):
    """Not at once: a foot that has landed bounces; and no more than a press further."""
    walker.amid_swing(0.0)
    leg = int(np.argmax(walker.state.leg_phase == LegPhase.STANCE))
    walker.told[leg] = 0.0
    walker.walk(15 * DT)
    assert walker.state.foot[leg, 2] == pytest.approx(0.0, abs=1e-9)
    walker.walk(25 * DT)
    low = walker.state.foot[leg, 2]
    assert low < -0.003
    walker.told[leg] = 1.0
    phase, foot, *_ = walker.walk(40 * DT)
    stands = np.cumprod(phase[:, leg] == LegPhase.STANCE).astype(bool)
    assert foot[stands, leg, 2].min() > low - 0.0051


def test_the_body_goes_on_while_a_foot_looks_for_the_ground(walker):
    """At its speed, to 5 %, for as long as the standing feet reach."""
    walker.told[:] = 0.0
    state = walker.until(lambda s: s.velocity_filter[2, 0] > 0.0499)
    walker.told[:] = np.where(state.leg_phase == LegPhase.STANCE, 1.0, 0.0)
    walker.until(lambda s: s.leg_phase == LegPhase.PROBING)
    at = state.path[0]
    walker.walk(20 * DT)
    assert (state.leg_phase == LegPhase.PROBING).any()
    assert state.path[0] - at == pytest.approx(20 * DT * 0.05, rel=0.05)
