"""The members with limits: against a second solver, conditions of the optimum, by hand."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from forces.loads import cost_matrices, equations, random_load, reference, wrench_of
from phasmid.forces import (
    FrictionCone,
    JointLoad,
    MinimumNorm,
    MinimumTorque,
    SmallestLargestLoad,
    WeightedMinimumNorm,
    share_load,
)

LIMITED = ("friction-cone", "smallest-largest-load")
CASES = [(4, 4), (6, 3), (6, 5), (8, 6)]
"""Legs, and how many of them stand."""


def contact_forces(contacts, force):
    return np.einsum("nlij,nli->nlj", contacts.axes, force)


@pytest.mark.parametrize(("legs", "standing"), CASES)
def test_the_friction_cone_s_forces_are_those_of_a_second_solver(legs, standing):
    # Both solve the same strictly convex second-order cone programme: clarabel to a gap of 1e-13
    # of a cost of 1e2, so that its forces are right to about sqrt(1e-11) / 10; ours to 1e-10.
    contacts, wrench, _, _ = random_load(25, legs, standing, seed=10 * legs + standing)
    force = share_load(contacts, wrench, "friction-cone")
    plain = share_load(contacts, wrench, "minimum-norm")
    assert np.abs(force - plain).max(axis=(1, 2)).max() > 1e-2  # The limits count.
    for i in range(25):
        assert force[i] == pytest.approx(reference(contacts, wrench, i), abs=1e-6)


COSTS = (WeightedMinimumNorm(4.0), MinimumTorque(0.05), MinimumTorque(1e-3))


def limited(joints, truth):
    """The same joints' load with limits a little above what a known solution needs."""
    tight = 1.05 * np.abs(joints.with_ground(truth)) + 0.02
    return JointLoad(joints.jacobian, joints.torque, tight)


@pytest.mark.parametrize(("legs", "standing"), CASES)
@pytest.mark.parametrize("name", LIMITED)
def test_no_force_pulls_or_leaves_its_cone(name, legs, standing):
    # Cones are met to 1e-11 of a load of some tens of newtons; the wrench to round-off.
    contacts, wrench, _, _ = random_load(200, legs, standing, seed=legs + standing)
    force = share_load(contacts, wrench, name)
    normal, first, second = np.moveaxis(contact_forces(contacts, force), -1, 0)
    assert normal.min() > -1e-9
    assert (np.hypot(first, second) - contacts.friction * normal).max() < 1e-9
    assert np.abs(wrench_of(contacts.feet, force) - wrench).max() < 1e-9


@pytest.mark.parametrize("standing", [4, 5, 6])
def test_the_largest_load_is_the_smallest_possible(standing):
    # Against the linear programme over cones of a second solver; ours may exceed it by the square
    # of the other cost's weight, 1e-4.
    contacts, wrench, _, _ = random_load(25, 6, standing, seed=standing)
    force = share_load(contacts, wrench, "smallest-largest-load")
    normal = contact_forces(contacts, force)[..., 0]
    with np.errstate(invalid="ignore"):
        ours = np.nanmax(np.where(contacts.stance, normal / contacts.share, np.nan), axis=1)
    for i in range(25):
        least = reference(contacts, wrench, i, largest=True)
        assert least * (1 - 1e-6) < ours[i] < least * (1 + 1e-6)


@pytest.mark.parametrize(
    ("model", "count", "standing", "friction", "seed"),
    [
        (FrictionCone(), 4000, 4, 0.6, 1),
        (FrictionCone(MinimumTorque()), 1000, 6, 0.05, 10),
        (SmallestLargestLoad(), 300, 6, 0.05, 4),
    ],
    ids=str,
)
def test_no_load_that_can_be_given_is_refused(model, count, standing, friction, seed):
    # Every load is made of admissible forces; some of the optima lie at tips of cones, where the
    # direction of a force means nothing, and near flat ones.
    contacts, wrench, joints, _ = random_load(
        count, 6, standing, friction=friction, tilt=0.3, seed=seed, full=True
    )
    force = share_load(contacts, wrench, model, joints=joints)
    assert np.isfinite(force).all()


def _distance_from_the_optimum(contacts, force, sample, H, c, joints):
    """How far forces within the limits may be from the optimum [N].

    At the optimum H F / share - c = Aᵀ λ + Σ ν d over the limits that hold with equality, ν >= 0,
    where A is the equilibrium and d how a limit's room grows with the force: μ n - t for a foot at
    its cone, t being the direction of the tangential force, and ± a column of J for a joint at its
    torque. With F = W y and H / share = W⁻ᵀ W⁻¹ the cost is ½ y · y and so curved by 1: y is as
    near to its optimum as what no multipliers explain of its gradient is long, and F no farther
    than W times that.
    """
    feet = np.flatnonzero(contacts.share[sample] > 0)
    gradient = np.zeros((len(feet), 3))
    balance = equations(contacts.feet[sample, feet]).T.reshape(-1, 3, 6)
    columns, longest = [], 0.0
    for j, i in enumerate(feet):
        F, n, mu = force[sample, i], contacts.normals[sample, i], contacts.friction[sample, i]
        own = H[sample, i] / contacts.share[sample, i]
        W = np.linalg.inv(np.linalg.cholesky(own)).T
        longest = max(longest, np.linalg.norm(W, 2))
        gradient[j] = W.T @ (own @ F - c[sample, i])
        balance[j] = W.T @ balance[j]
        J, tau, limit = (v[sample, i] for v in (joints.jacobian, joints.torque, joints.limit))
        torque, normal = tau - J.T @ F, F @ n
        tangential = F - normal * n
        size = np.linalg.norm(tangential)
        at_limit = [
            np.sign(torque[k]) * J[:, k] for k in np.flatnonzero(abs(torque) > limit - 1e-8)
        ]
        if mu * normal - size < 1e-8:
            at_limit.append(mu * n - tangential / size)
        for room in at_limit:
            column = np.zeros((len(feet), 3))
            column[j] = W.T @ room / np.linalg.norm(W.T @ room)
            columns.append(column.ravel())
    balance = balance.reshape(-1, 6)
    basis = np.column_stack([balance / np.linalg.norm(balance, axis=0), *columns])
    lower = np.concatenate([np.full(6, -np.inf), np.zeros(len(columns))])
    fit = lsq_linear(basis, gradient.ravel(), bounds=(lower, np.inf), method="bvls", tol=1e-15)
    return longest * np.linalg.norm(basis @ fit.x - gradient.ravel())


def _off_their_tips(contacts, force):
    """Samples all of whose feet are loaded: the tip of a cone has no one direction."""
    normal = np.sum(force * contacts.normals, axis=-1)
    return np.flatnonzero(((normal > 1e-6) | ~contacts.stance).all(axis=1))


@pytest.mark.parametrize("torques", ["free", "limited"])
@pytest.mark.parametrize(
    ("cost", "count", "standing", "seed"),
    [
        # Sample 179 of seed 1002 reaches its cone in the last programme only.
        (MinimumNorm(), 500, 6, 1002),
        *((cost, 150, 5, 1) for cost in COSTS),
    ],
    ids=str,
)
def test_no_multipliers_are_wanting_at_the_optimum(cost, count, standing, seed, torques):
    # Row 22 of the physics charter: 1e-9 N. A lever of 1 mm leaves some forces a cost of 1e-6 F²
    # only: there y, right to 1e-11 of some 10 N, is multiplied by 1000 to be a force.
    contacts, wrench, joints, truth = random_load(count, 6, standing, seed=seed, full=count > 150)
    joints = limited(joints, truth) if torques == "limited" else joints
    force = share_load(contacts, wrench, FrictionCone(cost), joints=joints)
    H, c = cost_matrices(cost, contacts, joints)
    plain = _off_their_tips(contacts, force)
    assert len(plain) > 0.8 * count
    far = [_distance_from_the_optimum(contacts, force, i, H, c, joints) for i in plain]
    assert max(far) < (1e-7 if cost == MinimumTorque(1e-3) else 1e-9)
    # Some sample is at its limits: without them it would be elsewhere.
    free = share_load(contacts, wrench, cost, joints=joints)
    assert np.abs(force - free).max() > 0.1
