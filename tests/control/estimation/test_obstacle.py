"""Feet that meet something on their way step over it, and higher on rough ground."""

import numpy as np
import pytest

from control.estimation.walker import DT, ROBOT, Walker
from phasmid.control.engine import LocomotionEngine
from phasmid.control.estimation import EstimatorSettings
from phasmid.control.estimation.estimator import GroundEstimator, write_reference
from phasmid.control.estimation.terrain_adaptation import FORGETTING
from phasmid.control.memory import MEMORY
from phasmid.control.records import record_behind
from phasmid.control.types import Contact, LegPhase
from phasmid.units import STANDARD_GRAVITY

STEP = 0.03


def test_a_foot_that_meets_an_obstacle_draws_back_and_steps_over_it_without_a_jump():
    """Back and up by 10 mm, less the way on which it stops; then a whole step higher."""
    walker = Walker(step_height=STEP)
    walker.told[:] = -1.0
    leg = walker.amid_swing(0.4)
    state, met = walker.state, walker.state.foot[leg].copy()
    highest, drawn, walker.told[leg] = 0.0, None, Contact.OBSTACLE
    while state.leg_phase[leg] != LegPhase.STANCE:
        before, speed = state.foot.copy(), state.foot_velocity.copy()
        walker.step()
        walker.told[:] = -1.0
        # The trapezoid is off by h³ of the third derivative, 1000 m/s³ at most, over 12.
        mean = state.clock.time_scale * DT * (speed + state.foot_velocity) / 2
        assert np.abs(state.foot - before - mean).max() < 1000 * DT**3 / 12 + 1e-6
        if drawn is None and state.manoeuvre[leg] == 0:
            drawn = state.foot[leg] - met
        highest = max(highest, state.foot[leg, 2])
    np.testing.assert_allclose(drawn[[0, 2]], [-0.01, 0.01], atol=1e-3)
    assert highest > STEP + 0.3 * met[2]
    assert state.foot[leg, 2] == pytest.approx(0.0, abs=1e-9)


def test_a_leg_that_does_not_reach_stops_and_the_others_go_on():
    """A foot sent beyond its reach stops in its swing; those that swing with it land as planned."""
    walker = Walker(step_height=STEP)
    walker.told[:] = -1.0
    leg, state = walker.amid_swing(0.72), walker.state
    others = np.flatnonzero(state.leg_phase == LegPhase.SWING)
    others = others[others != leg]
    landings = state.touchdown[others].copy()
    # So late in a swing its landing is no longer chosen.
    outward = state.foot[leg, :2] / np.hypot(*state.foot[leg, :2])
    state.touchdown[leg, :2] += 0.1 * outward
    beyond = state.touchdown[leg].copy()
    walker.until(lambda state: (state.leg_phase[others] == LegPhase.STANCE).all())
    np.testing.assert_allclose(state.foot[others], landings, atol=1e-9)
    assert (beyond - state.foot[leg])[:2] @ outward > 0.02
    assert not any(sentence.startswith("held all") for sentence in walker.said)


class Stage:
    """Writes the reference for feet that stand, or have just hit something, over level ground."""

    def __init__(self, step=STEP):
        self.memory = np.zeros(1, MEMORY)
        GroundEstimator(ROBOT, EstimatorSettings(), DT, self.memory, STANDARD_GRAVITY)
        self.engine = LocomotionEngine(ROBOT, ground_sensing=False, dynamics="none")
        self.reference = self.engine.reference
        self.reference.step_height = step

    def write(self, foot, hits=0):
        """Write the reference for feet at these places, which all have met so many obstacles."""
        memory, state = self.memory.view(np.recarray)[0], self.engine.state
        estimator = memory.estimator
        estimator.feet["contact"][:6], estimator.feet["obstacle_hits"][:6] = Contact.GROUND, hits
        state.foot[:] = foot
        engine = self.engine.memory.view(np.recarray)[0]
        write_reference(
            record_behind(state),
            engine.model,
            record_behind(self.reference),
            estimator,
            memory.estimator_parameters,
        )
        return self.reference


def test_body_and_steps_are_higher_by_the_height_between_the_feet():
    """h + max z - min z - 3 mm, at most h + 50 mm; the body too, as far as the legs reach."""
    foot, stage = np.zeros((6, 3)), Stage()
    # Of soft legs on level ground neither is.
    foot[0, 2] = 0.0029
    reference = stage.write(foot)
    assert (reference.step_height, reference.pose_correction[2]) == (STEP, 0.0)
    foot[0, 2], foot[3, 2] = 0.013, -0.01
    stage.write(foot)
    assert stage.write(foot).step_height == pytest.approx(STEP + 0.02)
    assert 0.0 < stage.reference.pose_correction[2] <= 0.02
    foot[0, 2] = 0.2
    assert stage.write(foot).step_height == pytest.approx(STEP + 0.05)
    assert stage.reference.pose_correction[2] <= 0.05


def test_feet_without_ground_go_down_farther_on_rough_ground():
    """By half the roughness, 50 mm at most."""
    foot, stage = np.zeros((6, 3)), Stage()
    depth = stage.engine.settings.landing_depth
    assert stage.write(foot).landing_depth == depth
    foot[0, 2] = 0.023
    assert stage.write(foot).landing_depth == pytest.approx(depth + 0.01)
    foot[0, 2] = 0.5
    assert stage.write(foot).landing_depth == pytest.approx(depth + 0.05)


def test_roughness_decays():
    """By the share 1 - exp(-0.4 t) in a time t; a commanded step height counts at once."""
    foot, stage = np.zeros((6, 3)), Stage()
    foot[0, 2] = 0.023
    stage.write(foot)
    for _ in range(round(1.0 / DT)):
        stage.write(np.zeros((6, 3)))
    kept = 0.02 * np.exp(-FORGETTING)
    assert stage.reference.step_height == pytest.approx(STEP + kept)
    stage.reference.step_height = 0.05
    assert stage.write(np.zeros((6, 3))).step_height == pytest.approx(0.05 + kept, rel=1e-2)


def test_the_stance_is_narrower_on_rough_ground_and_as_before_on_level_ground():
    """By half the roughness, 30 mm at most, at 20 mm/s and in steps of 1 mm."""
    foot, stage = np.zeros((6, 3)), Stage()
    model = stage.engine.model
    distance = np.hypot(*model.nominal[:, :2].T)
    foot[0, 2] = 0.2
    for _ in range(round(2.0 / DT)):
        stage.write(foot)
    np.testing.assert_allclose(np.hypot(*model.neutral[:, :2].T), distance - 0.03, atol=1e-3)
    for _ in range(round(30.0 / DT)):
        stage.write(np.zeros((6, 3)))
    np.testing.assert_allclose(model.neutral, model.nominal, atol=1e-3)


def test_an_obstacle_is_reported_once():
    """At the update of a new hit, not at those after it; and the ground is looked for above it."""
    foot, stage = np.zeros((6, 3)), Stage()
    assert (stage.write(foot, 1).contact == Contact.OBSTACLE).all()
    reference = stage.write(foot, 1)
    assert (reference.contact == 1).all()
    np.testing.assert_allclose(reference.touchdown_height, 0.02)
