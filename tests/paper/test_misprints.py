"""Each line of the table of misprints: the printed form fails its test, the right one passes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from phasmid import derivation
from phasmid.derivation.symbolic import ANGLES, GRAVITY, LENGTHS, LINKS
from phasmid.dynamics import BodyMotion, inverse_dynamics, kinetic_energy, potential_energy
from phasmid.dynamics.printed import (
    EQ_10,
    UNIT_AS_PRINTED,
    LegMisprint,
    printed_leg_matrices,
    printed_leg_torque,
)
from phasmid.errors import InvalidRobot
from phasmid.forces import analyse
from phasmid.kinematics import foot_position
from phasmid.kinematics.printed import (
    KinematicMisprint,
    printed_body_rotation,
    printed_leg_pose,
)
from phasmid.motion import plan
from phasmid.paper.misprints import MISPRINTS, Misprint, Proof
from phasmid.paper.states import random_states, walk_states
from phasmid.scenario import load_scenario

MENDED: frozenset[str] = frozenset()


def rows(*proofs: Proof) -> pytest.MarkDecorator:
    chosen = [row for row in MISPRINTS if row.proof in proofs]
    assert chosen
    return pytest.mark.parametrize("row", chosen, ids=[row.name for row in chosen])


def test_each_misprint_stands_in_the_table_alone_and_once() -> None:
    alone = [next(iter(row.switches)) for row in MISPRINTS if len(row.switches) == 1]
    assert sorted(alone) == sorted([*map(str, KinematicMisprint), *map(str, LegMisprint)])
    assert len({row.name for row in MISPRINTS}) == len(MISPRINTS)


def test_the_equations_as_they_stand_hold_all_their_misprints() -> None:
    together = {row.name: row.switches for row in MISPRINTS if len(row.switches) > 1}
    assert {name: len(switches) for name, switches in together.items()} == {
        "eqs-3-to-9": 6,
        "eq-10": 13,
        "eq-10-as-fed": 14,
    }
    assert together["eq-10"] == EQ_10


class _Swing:
    """A smooth made-up motion of all legs of the robot at rest, with its exact derivatives."""

    def __init__(self) -> None:
        rng = np.random.default_rng(5)
        self.robot = walk_states().robot
        shape = (len(self.robot.legs), 3)
        self.size, self.rate = rng.uniform(0.3, 1.0, shape), rng.uniform(2.0, 4.0, shape)
        self.start, self.middle = rng.uniform(-3.0, 3.0, (2, *shape))

    def __call__(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        s, r, phase = self.size, self.rate, self.start + self.rate * t[:, None, None]
        return self.middle + s * np.sin(phase), s * r * np.cos(phase), -s * r**2 * np.sin(phase)

    def energy(self, t: np.ndarray) -> np.ndarray:
        q, qd, _ = self(t)
        body = BodyMotion.at_rest()
        return kinetic_energy(self.robot, body, q, qd) + potential_energy(self.robot, body, q)

    def foot(self, t: np.ndarray) -> np.ndarray:
        return foot_position(self.robot.arrays, self(t)[0])


def _rate(f: Callable[[np.ndarray], np.ndarray], t: np.ndarray) -> np.ndarray:
    """Central difference of eighth order, step 5 ms."""
    weights, h = (4 / 5, -1 / 5, 4 / 105, -1 / 280), 0.005
    return sum(w * (f(t + k * h) - f(t - k * h)) for k, w in enumerate(weights, 1)) / h


def _power_gap(switches: frozenset[str], force: np.ndarray) -> float:
    """Largest difference of power and rate of energy, as a part of the largest power."""
    swing, t = _Swing(), np.linspace(0.0, 2.0, 30)
    torque = printed_leg_torque(swing.robot.arrays, *swing(t), foot_force=force, misprints=switches)
    power = np.sum(torque * swing(t)[1] + force * _rate(swing.foot, t), axis=(1, 2))
    rate = _rate(swing.energy, t)
    return float(np.abs(power - rate).max() / np.abs(rate).max())


@rows(Proof.EQUATION_OF_MOTION, Proof.LOADED_FOOT)
def test_power_is_the_rate_of_energy_for_the_right_torques_only(row: Misprint) -> None:
    # τ·q' + F·v = d(KE + PE)/dt, the energies by recursion over the links. The fastest parts of
    # the energy turn at about 20 rad/s: truncation (20 * 0.005)^8 / 630 = 2e-11 of them at worst,
    # round-off 2e-16 * 5 J / 0.005 s = 2e-13 W of some watts. The least of the misprints, the sign
    # of I_zz1, is 2e-5 of an m11 of some 1e-3 kg·m²: above 1e-3.
    loaded = row.proof is Proof.LOADED_FOOT
    force = np.full((6, 3), 5.0) if loaded else np.zeros((6, 3))
    right, printed = (_power_gap(s, force) for s in (MENDED, row.switches))
    assert right < 1e-10
    assert printed > 1e-3


@rows(Proof.EQUATION_OF_MOTION, Proof.LOADED_FOOT)
def test_the_recursion_over_the_robot_gives_the_right_torques_only(row: Misprint) -> None:
    # Torques below 20 N·m are sums of some hundred terms: 100 * 2.2e-16 * 20 = 4e-13; the charter
    # asks for 1e-10. A misprint costs 1e-3 N·m or more.
    s = random_states()
    force = s.foot_force if row.proof is Proof.LOADED_FOOT else np.zeros_like(s.foot_force)
    in_world = np.einsum("lij,tlj->tli", s.robot.arrays.R_body_hip, force)
    body = BodyMotion.at_rest()
    expected = inverse_dynamics(s.robot, body, s.q, s.qd, s.qdd, foot_force=in_world).joint_torque

    def gap(switches: frozenset[str]) -> float:
        motion = (s.robot.arrays, s.q, s.qd, s.qdd)
        torque = printed_leg_torque(*motion, foot_force=force, misprints=switches)
        return float(np.abs(torque - expected).max())

    assert gap(MENDED) < 1e-10
    assert gap(row.switches) > 1e-3


@pytest.fixture(scope="module")
def lagrange() -> dict[str, Callable[..., float]]:
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
def test_a_misprint_of_eq_10_changes_the_entry_it_is_named_for_and_no_other(
    misprint: LegMisprint, lagrange: dict[str, Callable[..., float]]
) -> None:
    # Entries below 0.1 kg·m², sums of twenty terms: 20 * 2.2e-16 * 0.1 = 4e-16. The smallest
    # misprint of an entry, the sign of I_zz1, makes 2e-5.
    leg = random_states().robot.legs[0]
    moments = np.concatenate([np.diag(link.inertia) for link in leg.links])
    numbers = [*map(float, leg.lengths), 9.81, *(k.mass for k in leg.links), *map(float, moments)]
    q = np.random.default_rng(4).uniform(-np.pi, np.pi, (200, 3))
    printed = printed_leg_matrices(leg, q, misprints={misprint})
    wrong = set()
    for name, function in lagrange.items():
        part, i, j = name[0].upper(), int(name[1]) - 1, int(name[2]) - 1
        gap = np.abs(getattr(printed, part)[:, i, j] - function(*q.T, *numbers)).max()
        assert gap < 1e-15 or gap > 1e-5, name
        if gap > 1e-5:
            wrong.add(name)
    assert wrong == {misprint.split("-")[0]}


@rows(Proof.RIGID_BODY)
def test_no_link_can_have_the_inertias_of_table_2_as_printed(row: Misprint) -> None:
    # A radius of gyration below a thousandth of the length: the mass would sit on one point.
    assert row.switches == {"table-2-unit"}
    for link in walk_states().robot.legs[0].links:
        radius = np.sqrt(np.linalg.eigvalsh(link.inertia)[-1] / link.mass)
        assert 0.1 < radius / link.length < 1.0
        assert radius * np.sqrt(UNIT_AS_PRINTED) / link.length < 1e-3
        with pytest.raises(InvalidRobot, match="gyration radius"):
            replace(link, inertia=UNIT_AS_PRINTED * link.inertia)


@rows(Proof.CHAIN)
def test_the_chain_of_frames_ends_at_the_foot_for_the_right_transforms_only(row: Misprint) -> None:
    # X_01 X_12 X_23 X_34 against the foot in closed form: lengths below 0.3 m, a dozen products.
    s = random_states()
    assert row.error(s, MENDED).max() < 1e-15 * 12
    assert row.error(s, row.switches).min() > 1e-3


@rows(Proof.ROTATION)
def test_rotations_are_orthonormal_for_the_right_matrices_only(row: Misprint) -> None:
    # Rᵀ R = 1, a few units in the last place.
    angles = random_states().attitude.T

    def gap(switches: frozenset[str]) -> float:
        if KinematicMisprint.BODY_ROTATION in row.switches:
            R = printed_body_rotation(*angles, misprints=switches)
        else:
            hips = np.zeros((*angles[2].shape, 3))
            R = printed_leg_pose(hips, angles[2], misprints=switches)[..., :3, :3]
        return float(np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max())

    assert gap(MENDED) < 1e-15
    assert gap(row.switches) > 0.5


@rows(Proof.ROUND_TRIP)
def test_the_foot_comes_back_for_the_right_joint_angles_only(row: Misprint) -> None:
    # FK(IK(p)) = p. The arc cosine multiplies round-off by 1/sin of the knee's bend. Stretched
    # knees are beyond the limits, and of 12000 folded ones the nearest is 1e-5 rad away or more:
    # 2.2e-16 / 1e-5 * 0.22 m = 5e-12 m. Where the print gives no angle, it fails as well.
    s = random_states()
    right, printed = row.error(s, MENDED), row.error(s, row.switches)
    assert right.max() < 1e-11
    assert np.nanmax(printed) > 0.1


def _cost(name: str) -> tuple[float, float]:
    row = next(row for row in MISPRINTS if row.name == name)
    cost = row.cost()
    return cost.swing.largest, cost.stance.largest


def test_the_feet_of_the_walk_carry_its_weight() -> None:
    # Σ F = m g at the start, where all is at rest; feet in the air carry nothing. Round-off of
    # some hundred terms below 26 N: 100 * 2.2e-16 * 26 = 6e-13.
    s = walk_states()
    assert s.foot_force[0, :, 2].sum() == pytest.approx(26.0, abs=1e-11)
    assert np.abs(s.foot_force[~s.stance]).max() < 1e-12


def test_the_forces_of_the_walk_are_turned_into_hip_axes() -> None:
    # f_world = R_body_hip f_hip while the body keeps its heading; a few units in the last place.
    s = walk_states()
    scenario = load_scenario("paper").replace(mass_model="mid-length")
    in_world = analyse(scenario, plan(scenario)).foot_force_model.values
    for i, leg in enumerate(s.robot.legs):
        turned = s.foot_force[:, i] @ leg.X_body_hip[:3, :3].T
        np.testing.assert_allclose(turned, in_world[:, i], rtol=0, atol=1e-13)
    assert np.abs(in_world[..., :2]).max() > 0.1


def test_the_lost_height_of_eq_2_is_the_height_of_the_hip_over_the_foot() -> None:
    # 100 mm in stance, and never more while feet are lifted.
    swing, stance = _cost("eq-2-height")
    assert stance == pytest.approx(0.100, abs=1e-12)
    assert swing <= 0.100 + 1e-12


def test_a_foot_above_the_ground_instead_of_below_the_hip_is_twice_its_height_away() -> None:
    swing, stance = _cost("eq-7-height")
    assert stance == pytest.approx(0.200, abs=1e-9)
    assert swing <= 0.200 + 1e-9


def test_the_sign_of_eq_11_costs_nothing_in_swing_and_twice_the_feet_in_stance() -> None:
    # Largest 2 |Jᵀ F|; for a foot straight ahead its femur carries F_z (r - Lc) and a little.
    s = walk_states()
    r = np.hypot(*np.moveaxis(foot_position(s.robot.arrays, s.q)[..., :2], -1, 0))
    least = 2 * (s.foot_force[..., 2] * (r - s.robot.arrays.lengths[:, 0])).max()
    swing, stance = _cost("eq-11-sign")
    assert swing < 1e-12
    assert 0.8 * least < stance < 1.5 * least


def test_feeding_the_angle_of_eq_9_into_eq_10_is_the_worst_of_its_misuses() -> None:
    worst = _cost("theta-3-as-fed")[0]
    others = [_cost(row.name)[0] for row in MISPRINTS if row.switches <= EQ_10]
    assert worst > 20 * max(others)


def test_random_states_keep_to_their_ranges() -> None:
    s = random_states()
    lower, upper = s.robot.arrays.joint_limits[0].T
    assert (s.q[..., 1:] >= lower[1:]).all()
    assert (s.q[..., 1:] <= upper[1:]).all()
    ahead = foot_position(s.robot.arrays, s.q * [0.0, 1.0, 1.0])[..., 0]
    assert ahead.min() > 1e-3
    assert s.q.shape == (2000, 6, 3)
    assert np.abs(s.qd).max() <= 6.0
    assert np.abs(s.qdd).max() <= 60.0
