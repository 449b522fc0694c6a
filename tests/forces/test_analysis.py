"""The paper's walk, analysed: what its text says of forces and torques."""

import numpy as np
import pytest

from phasmid.forces import analyse
from phasmid.motion import plan
from phasmid.scenario import load_scenario

PAPER = load_scenario("paper")


def analysed(**changes):
    scenario = PAPER.replace(**changes)
    return analyse(scenario, plan(scenario))


def test_the_feet_carry_the_weight_at_every_instant():
    # The trunk neither rises nor falls; the swinging legs' vertical acceleration adds
    # 2 x 0.2 kg x 5 m/s^2 at most, and nothing in the quasi-static model.
    total = analysed(body_acceleration="quasi-static").foot_normal_force_model.sum("leg")
    assert np.abs(total.values - 26).max() < 1e-9
    mean = float(analysed().foot_normal_force_model.sum("leg")[:200].mean())
    assert mean == pytest.approx(26, rel=1e-3)


def test_swinging_legs_carry_nothing():
    run = analysed()
    assert np.abs(run.foot_force_model.values[~run.stance.values]).max() == 0


def test_the_middle_foot_of_each_tripod_carries_more_than_the_other_two():
    # The paper's claim, from 0.2 s to 0.8 s of each half cycle.
    run = analysed()
    force = run.foot_normal_force_model.values
    for start, middle, others in ((0, 1, (3, 5)), (20, 4, (0, 2))):
        amid = force[start + 4 : start + 17]
        for other in others:
            assert (amid[:, middle] > amid[:, other]).all()


def test_statics_by_hand_give_the_share_of_the_middle_foot():
    # Feet 2, 4, 6 at mid-stance: y = -253.4, 167.706 (both), the centre of mass at y0. Moments
    # about the line of feet 4 and 6: N2 = W (167.706 - y0) / (167.706 + 253.4).
    from phasmid.kinematics import centre_of_mass

    scenario = PAPER.replace(body_acceleration="quasi-static")
    walk = plan(scenario)
    run = analyse(scenario, walk)
    y0 = float(centre_of_mass(walk.robot, walk.q)[10, 1])
    corner = 0.06164 + 0.150 * np.sqrt(0.5)
    share = 26 * (corner - y0) / (corner + 0.2534)
    # QUALITY of statics: 1e-9 relative; the body is level, so heights do not enter.
    assert float(run.foot_normal_force_model[10, 1]) == pytest.approx(share, rel=1e-9)


def test_the_walk_repeats_every_two_seconds():
    torque = analysed().joint_torque_model.values
    assert np.abs(torque[:40] - torque[40:80]).max() < 1e-9


def test_the_scenario_that_is_analysed_is_the_one_that_is_given():
    # One plan serves both; only the mechanics differ.
    walk, still = plan(PAPER), PAPER.replace(body_acceleration="quasi-static")
    assert analyse(still, walk).joint_torque_model.equals(
        analyse(still, plan(still)).joint_torque_model
    )


@pytest.mark.parametrize(
    "changes",
    [
        {"stance_law": "coxa-only"},
        {"mounts": "perpendicular"},
        {"stance_timing": "constant-speed"},
        {"body_acceleration": "quasi-static"},
        {"mass_model": "mid-length"},
        {"curve": "cubic-spline"},
    ],
    ids=str,
)
def test_each_variant_of_the_paper_changes_the_torques(changes):
    base, other = (
        analysed().joint_torque_model.values,
        analysed(**changes).joint_torque_model.values,
    )
    assert np.abs(base - other).max() > 1e-4
