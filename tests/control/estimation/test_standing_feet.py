"""Feet that have just landed take on their load, and feet that feel the air look for the ground."""

import numpy as np
import pytest

from phasmid.control import Command, Observation
from phasmid.control.engine import LocomotionEngine
from phasmid.control.types import LegPhase
from phasmid.kinematics import joint_angles
from phasmid.robot import load_robot

ROBOT = load_robot("phantomx-mk4")
DT = 0.005
AHEAD = Command(velocity=(0.05, 0.0, 0.0))


class Walker:
    """An engine that is told what its feet feel, without sensors."""

    def __init__(self):
        self.engine = LocomotionEngine(ROBOT, ground_sensing=False, dynamics="none", period=1.0)
        self.q = joint_angles(ROBOT.arrays, ROBOT.arrays.neutral_foot)
        self.time = 0.0

    def step(self):
        self.time += DT
        self.engine.update(Observation(time=self.time, joint_position=self.q), AHEAD)
        return self.engine.state

    def until(self, happens, most=600):
        for _ in range(most):
            state = self.step()
            if happens(state):
                return state
        raise AssertionError("it did not happen")


def test_a_foot_that_met_the_ground_hanging_low_goes_on_down_by_that():
    """Touched at z with a sag s it ends at z - s: what it does beyond is 0.4 of 12 ms of its speed.

    That speed is 0.1 m/s here at most.
    """
    walker, sag = Walker(), 0.006
    reference = walker.engine.reference
    state = walker.until(lambda s: (s.leg_phase == LegPhase.SWING).any())
    leg = int(np.argmax(state.leg_phase == LegPhase.SWING))
    reference.contact[:] = 0
    walker.until(lambda s: s.swing_elapsed[leg] > 0.9 * s.swing_duration[leg])
    met = state.foot[leg, 2]
    reference.contact[leg], reference.foot_sag[leg] = 1, sag
    walker.until(lambda s: s.leg_phase[leg] == LegPhase.SETTLING)
    reference.contact[:] = -1
    state = walker.until(
        lambda s: (
            s.leg_phase[leg] == LegPhase.STANCE and s.swing_elapsed[leg] >= s.swing_duration[leg]
        )
    )
    assert state.foot[leg, 2] == pytest.approx(met - sag, abs=0.1 * (DT + 0.4 * 0.012))


def test_a_standing_foot_that_feels_the_air_goes_down_until_it_feels_the_ground():
    """Not at once: a foot that has landed bounces; and no more than a press further."""
    walker = Walker()
    reference = walker.engine.reference
    walker.until(lambda s: (s.leg_phase == LegPhase.SWING).any())
    state = walker.engine.state
    leg = int(np.argmax(state.leg_phase == LegPhase.STANCE))
    reference.contact[leg] = 0
    for _ in range(15):
        walker.step()
    assert state.foot[leg, 2] == pytest.approx(0.0, abs=1e-9)
    for _ in range(25):
        walker.step()
    low = state.foot[leg, 2]
    assert low < -0.003
    reference.contact[leg] = 1
    for _ in range(40):
        if walker.step().leg_phase[leg] != LegPhase.STANCE:
            break
        assert state.foot[leg, 2] > low - 0.0051


def test_the_body_goes_on_while_a_foot_looks_for_the_ground():
    """At its speed, to 5 %, for as long as the standing feet reach."""
    walker = Walker()
    reference = walker.engine.reference
    reference.contact[:] = 0
    state = walker.engine.state
    walker.until(lambda s: s.velocity_filter[2, 0] > 0.0499)
    reference.contact[state.leg_phase == LegPhase.STANCE] = 1
    reference.contact[state.leg_phase == LegPhase.SWING] = 0
    walker.until(lambda s: (s.leg_phase == LegPhase.PROBING).any())
    at = state.path[0]
    for _ in range(20):
        walker.step()
    assert (state.leg_phase == LegPhase.PROBING).any()
    assert state.path[0] - at == pytest.approx(20 * DT * 0.05, rel=0.05)


def test_a_foot_steps_nearly_as_high_as_its_leg_reaches():
    """A step too high is lowered by fifths: what is left is at least 0.8 of the highest one had."""
    asked, had = np.linspace(0.05, 0.15, 21), []
    for height in asked:
        walker = Walker()
        state = walker.engine.state
        while not (state.leg_phase == LegPhase.SWING).any():
            walker.engine.reference.step_height = height
            walker.step()
        had.append(state.swing_height[state.leg_phase == LegPhase.SWING].min())
    assert min(had[-5:]) < 0.99 * asked[-5]
    for k in range(1, len(had)):
        assert had[k] >= 0.8 * max(had[: k + 1]) - 1e-9
