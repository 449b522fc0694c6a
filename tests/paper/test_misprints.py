"""Each line of the table of misprints: the printed form fails its test, the right one passes."""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from pages import derivation
from pages.derivation import ANGLES, GRAVITY, LENGTHS, LINKS
from phasmid.dynamics import BodyMotion, inverse_dynamics
from phasmid.dynamics.printed import (
    EQ_10,
    UNIT_AS_PRINTED,
    LegMisprint,
    printed_leg_matrices,
    printed_leg_torque,
)
from phasmid.errors import InvalidRobot
from phasmid.kinematics import foot_position
from phasmid.kinematics.printed import KinematicMisprint, printed_body_rotation, printed_leg_pose
from phasmid.paper.misprints import MISPRINTS, Proof
from phasmid.paper.states import random_states, walk_states
from phasmid.units import STANDARD_GRAVITY

MENDED = frozenset()


def rows(*proofs):
    chosen = [row for row in MISPRINTS if row.proof in proofs]
    assert chosen
    return pytest.mark.parametrize("row", chosen, ids=[row.name for row in chosen])


def test_each_misprint_stands_in_the_table_alone_once_and_in_its_equation():
    alone = [next(iter(row.switches)) for row in MISPRINTS if len(row.switches) == 1]
    assert sorted(alone) == sorted([*map(str, KinematicMisprint), *map(str, LegMisprint)])
    together = {row.name: len(row.switches) for row in MISPRINTS if len(row.switches) > 1}
    assert together == {"eqs-3-to-9": 6, "eq-10": 13, "eq-10-as-fed": 14}


@rows(Proof.EQUATION_OF_MOTION, Proof.LOADED_FOOT)
def test_the_recursion_over_the_robot_gives_the_right_torques_only(row):
    # Torques below 20 N·m are sums of some hundred terms: 100 * 2.2e-16 * 20 = 4e-13; the charter
    # asks for 1e-10. A misprint costs 1e-3 N·m or more.
    s = random_states()
    force = s.foot_force if row.proof is Proof.LOADED_FOOT else np.zeros_like(s.foot_force)
    in_world = np.einsum("lij,tlj->tli", s.robot.arrays.R_body_hip, force)
    body = BodyMotion.at_rest()
    expected = inverse_dynamics(
        s.robot, body, s.q, s.qd, s.qdd, foot_force=in_world, gravity=STANDARD_GRAVITY
    ).joint_torque

    def gap(switches):
        motion = (s.robot.arrays, s.q, s.qd, s.qdd)
        torque = printed_leg_torque(
            *motion, foot_force=force, misprints=switches, gravity=STANDARD_GRAVITY
        )
        return float(np.abs(torque - expected).max())

    assert gap(MENDED) < 1e-10
    assert gap(row.switches) > 1e-3


@pytest.fixture(scope="module")
def lagrange():
    """Entries of Eq. 10 by Lagrange's equations, as functions of angles and the leg's numbers."""
    matrices = derivation.mid_length(derivation.lagrange())
    numbers = [*LENGTHS, GRAVITY, *(k.mass for k in LINKS)]
    numbers += [k.inertia[i, i] for k in LINKS for i in range(3)]
    return {
        f"{name}{i + 1}{j + 1}": sp.lambdify([*ANGLES, *numbers], part[i, j])
        for name, part in zip("mbc", matrices[:3], strict=True)
        for i in range(3)
        for j in range(3)
    }


@pytest.mark.parametrize("misprint", sorted(EQ_10))
def test_a_misprint_of_eq_10_changes_the_entry_it_is_named_for_and_no_other(misprint, lagrange):
    # Entries below 0.1 kg·m², sums of twenty terms: 20 * 2.2e-16 * 0.1 = 4e-16. The smallest
    # misprint of an entry, the sign of I_zz1, makes 2e-5.
    leg = random_states().robot.legs[0]
    moments = np.concatenate([np.diag(link.inertia) for link in leg.links])
    numbers = [*map(float, leg.lengths), 9.81, *(k.mass for k in leg.links), *map(float, moments)]
    q = np.random.default_rng(4).uniform(-np.pi, np.pi, (200, 3))
    printed = printed_leg_matrices(leg, q, misprints={misprint}, gravity=STANDARD_GRAVITY)
    wrong = set()
    for name, function in lagrange.items():
        part, i, j = name[0].upper(), int(name[1]) - 1, int(name[2]) - 1
        gap = np.abs(getattr(printed, part)[:, i, j] - function(*q.T, *numbers)).max()
        assert gap < 1e-15 or gap > 1e-5, name
        if gap > 1e-5:
            wrong.add(name)
    assert wrong == {misprint.split("-")[0]}


@rows(Proof.RIGID_BODY)
def test_no_link_can_have_the_inertias_of_table_2_as_printed(row):
    # A radius of gyration below a thousandth of the length: the mass would sit on one point.
    assert row.switches == {"table-2-unit"}
    for link in walk_states().robot.legs[0].links:
        radius = np.sqrt(np.linalg.eigvalsh(link.inertia)[-1] / link.mass)
        assert 0.1 < radius / link.length < 1.0
        assert radius * np.sqrt(UNIT_AS_PRINTED) / link.length < 1e-3
        with pytest.raises(InvalidRobot, match="gyration radius"):
            replace(link, inertia=UNIT_AS_PRINTED * link.inertia)


@rows(Proof.CHAIN)
def test_the_chain_of_frames_ends_at_the_foot_for_the_right_transforms_only(row):
    # X_01 X_12 X_23 X_34 against the foot in closed form: lengths below 0.3 m, a dozen products.
    s = random_states()
    assert row.error(s, MENDED).max() < 1e-15 * 12
    assert row.error(s, row.switches).min() > 1e-3


@rows(Proof.ROTATION)
def test_rotations_are_orthonormal_for_the_right_matrices_only(row):
    # Rᵀ R = 1, a few units in the last place.
    angles = random_states().attitude.T

    def gap(switches):
        if KinematicMisprint.BODY_ROTATION in row.switches:
            R = printed_body_rotation(*angles, misprints=switches)
        else:
            hips = np.zeros((*angles[2].shape, 3))
            R = printed_leg_pose(hips, angles[2], misprints=switches)[..., :3, :3]
        return float(np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max())

    assert gap(MENDED) < 1e-15
    assert gap(row.switches) > 0.5


@rows(Proof.ROUND_TRIP)
def test_the_foot_comes_back_for_the_right_joint_angles_only(row):
    # FK(IK(p)) = p. The arc cosine multiplies round-off by 1/sin of the knee's bend. Stretched
    # knees are beyond the limits, and of 12000 folded ones the nearest is 1e-5 rad away or more:
    # 2.2e-16 / 1e-5 * 0.22 m = 5e-12 m. Where the print gives no angle, it fails as well.
    s = random_states()
    right, printed = row.error(s, MENDED), row.error(s, row.switches)
    assert right.max() < 1e-11
    assert np.nanmax(printed) > 0.1


def test_the_sign_of_eq_11_costs_nothing_in_swing_and_twice_the_feet_in_stance():
    # Largest 2 |Jᵀ F|; for a foot straight ahead its femur carries F_z (r - Lc) and a little.
    s = walk_states()
    r = np.hypot(*np.moveaxis(foot_position(s.robot.arrays, s.q)[..., :2], -1, 0))
    least = 2 * (s.foot_force[..., 2] * (r - s.robot.arrays.lengths[:, 0])).max()
    cost = next(row for row in MISPRINTS if row.name == "eq-11-sign").cost()
    assert cost.swing.largest < 1e-12
    assert 0.8 * least < cost.stance.largest < 1.5 * least
