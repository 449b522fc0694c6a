"""Feet that meet something on their way step over it, and higher on rough ground."""

import numpy as np
import pytest

from phasmid.control import Command, Observation
from phasmid.control.engine import LocomotionEngine
from phasmid.control.estimation import EstimatorSettings
from phasmid.control.estimation.estimator import GroundEstimator, write_reference
from phasmid.control.memory import MEMORY
from phasmid.control.types import Contact, LegPhase
from phasmid.kinematics import joint_angles
from phasmid.robot import load_robot

ROBOT = load_robot("phantomx-mk4")
DT, STEP = 0.005, 0.03


def test_a_foot_that_meets_an_obstacle_lifts_anew_without_a_jump():
    """Half the way of another swing lies a step over the middle of where it was and lands."""
    engine = LocomotionEngine(ROBOT, ground_sensing=False, dynamics="none", step_height=STEP)
    q = joint_angles(ROBOT.arrays, ROBOT.arrays.neutral_foot)
    state, leg, hit, highest, swung = engine.state, None, None, 0.0, 0
    before, speed = state.foot.copy(), state.foot_velocity.copy()
    for k in range(400):
        engine.update(
            Observation(time=k * DT, joint_position=q), Command(velocity=(0.05, 0.0, 0.0))
        )
        slow = state.clock.time_scale
        # The trapezoid is off by h³ of the third derivative, 1000 m/s³ at most, over 12.
        mean = slow * DT * (speed + state.foot_velocity) / 2
        assert np.abs(state.foot - before - mean).max() < 1000 * DT**3 / 12 + 1e-6
        before, speed = state.foot.copy(), state.foot_velocity.copy()
        swings = state.leg_phase == LegPhase.SWING
        if hit is None and swings.any():
            leg = int(np.argmax(swings))
            if state.swing_elapsed[leg] > 0.4 * state.swing_duration[leg]:
                hit = state.foot[leg, 2]
                engine.reference.contact[leg] = Contact.OBSTACLE
                continue
        engine.reference.contact[:] = -1
        if hit is not None:
            highest = max(highest, state.foot[leg, 2])
            swung += 1
            if state.leg_phase[leg] == LegPhase.STANCE:
                break
    assert highest > STEP + 0.3 * hit
    assert state.leg_phase[leg] == LegPhase.STANCE
    assert state.foot[leg, 2] == pytest.approx(0.0, abs=1e-9)
    assert swung * DT > 0.45


class Stage:
    """Writes the reference for feet that stand, or have just hit something, over level ground."""

    def __init__(self, step=STEP, least_roughness=0.0):
        settings = EstimatorSettings(least_roughness=least_roughness)
        self.memory = np.zeros(1, MEMORY)
        GroundEstimator(ROBOT, settings, DT, self.memory)
        self.engine = LocomotionEngine(ROBOT, ground_sensing=False, dynamics="none")
        self.reference = self.engine.reference
        self.reference.step_height = step

    def write(self, foot, hits=0):
        """Write the reference for feet at these places, which all have met so many obstacles."""
        memory, state = self.memory.view(np.recarray)[0], self.engine.state
        estimator = memory.estimator
        estimator.feet["contact"][:6], estimator.feet["obstacle_hits"][:6] = Contact.GROUND, hits
        state.foot[:] = foot
        write_reference(state, self.reference, estimator, memory.estimator_parameters)
        return self.reference


def test_steps_are_higher_by_half_the_height_between_the_feet():
    """h + (max z - min z)/2, at most 2 h; and h again on level ground, or what is asked anew."""
    foot, stage = np.zeros((6, 3)), Stage()
    foot[0, 2], foot[3, 2] = 0.01, -0.01
    stage.write(foot)
    assert stage.write(foot).step_height == pytest.approx(STEP + 0.01)
    foot[0, 2] = 0.2
    assert stage.write(foot).step_height == pytest.approx(2 * STEP)
    stage.reference.step_height = 0.05
    assert stage.write(np.zeros((6, 3))).step_height == pytest.approx(0.05)


def test_the_body_is_higher_by_half_the_height_between_the_feet():
    """Of 50 mm at most."""
    foot = np.zeros((6, 3))
    foot[0, 2], foot[3, 2] = 0.01, -0.01
    assert Stage().write(foot).pose_correction[2] == pytest.approx(0.01)
    foot[0, 2] = 0.2
    assert Stage().write(foot).pose_correction[2] == pytest.approx(0.025)


def test_feet_of_soft_legs_on_level_ground_change_neither_step_nor_body():
    stage, foot = Stage(least_roughness=0.003), np.zeros((6, 3))
    foot[0, 2] = 0.0029
    reference = stage.write(foot)
    assert (reference.step_height, reference.pose_correction[2]) == (STEP, 0.0)


def test_a_foot_draws_back_from_an_obstacle_before_it_steps_over_it():
    """By 10 mm, less the way on which it still stops; and up."""
    engine = LocomotionEngine(ROBOT, ground_sensing=False, dynamics="none", step_height=STEP)
    q = joint_angles(ROBOT.arrays, ROBOT.arrays.neutral_foot)
    state, leg, met = engine.state, None, None
    for k in range(400):
        engine.update(
            Observation(time=k * DT, joint_position=q), Command(velocity=(0.05, 0.0, 0.0))
        )
        engine.reference.contact[:] = -1
        if met is None and (state.leg_phase == LegPhase.SWING).any():
            leg = int(np.argmax(state.leg_phase == LegPhase.SWING))
            if state.swing_elapsed[leg] > 0.4 * state.swing_duration[leg]:
                met = state.foot[leg].copy()
                engine.reference.contact[leg] = Contact.OBSTACLE
        elif met is not None and state.manoeuvre[leg] == 0.0:
            break
    assert state.leg_phase[leg] == LegPhase.SWING
    assert state.foot[leg, 0] == pytest.approx(met[0] - 0.01, abs=1e-3)
    assert state.foot[leg, 2] == pytest.approx(met[2] + 0.01, abs=1e-3)


def test_an_obstacle_is_reported_once():
    """At the update of a new hit, not at those after it; and the ground is looked for above it."""
    foot, stage = np.zeros((6, 3)), Stage()
    assert (stage.write(foot, 1).contact == Contact.OBSTACLE).all()
    reference = stage.write(foot, 1)
    assert (reference.contact == 1).all()
    np.testing.assert_allclose(reference.touchdown_height, 0.02)
