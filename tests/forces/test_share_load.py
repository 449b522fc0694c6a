"""The members without limits: equilibrium, conditions of the optimum, statics by hand."""

import numpy as np
import pytest

from forces.loads import cost_matrices, equations, random_load, wrench_of
from phasmid.errors import InvalidInput
from phasmid.forces import (
    FORCE_MODELS,
    Contacts,
    JointLoad,
    MinimumTorque,
    SmallestLargestLoad,
    WeightedMinimumNorm,
    force_model,
    share_load,
)

FEET = np.array([[0.2, -0.2, -0.1], [-0.2, -0.2, -0.1], [-0.2, 0.2, -0.1], [0.2, 0.2, -0.1]])
UNLIMITED = ("minimum-norm", "weighted-minimum-norm", "minimum-torque")


@pytest.mark.parametrize(("legs", "standing"), [(4, 3), (6, 4), (6, 6), (8, 6)])
@pytest.mark.parametrize("name", FORCE_MODELS)
def test_every_member_gives_the_wrench(name, legs, standing):
    # Sums of 1e2 N·m at most, round-off 1e-14 of it, times the condition of the 6 x 6 system,
    # below 1e4 after one refinement.
    contacts, wrench, joints, _ = random_load(60, legs, standing, seed=legs + standing)
    force = share_load(contacts, wrench, name, joints=joints)
    assert np.abs(wrench_of(contacts.feet, force) - wrench).max() < 1e-9
    assert np.abs(force[contacts.share == 0]).max(initial=0.0) == 0


@pytest.mark.parametrize("name", UNLIMITED)
def test_the_cost_rises_only_out_of_the_equations(name):
    # Optimal: H F / share - c is a combination of the six equations' rows, A^T lambda; so what of
    # it lies in their null space is 0. Gradients are some newtons; 1e-9 as for the equations.
    contacts, wrench, joints, _ = random_load(60, 6, 5, seed=3)
    force = share_load(contacts, wrench, name, joints=joints)
    H, c = cost_matrices(force_model(name), contacts, joints)
    for i in range(60):
        on = contacts.share[i] > 0
        slope = (H[i] @ force[i][..., None])[..., 0][on] / contacts.share[i][on, None] - c[i][on]
        A = equations(contacts.feet[i][on])
        multipliers = np.linalg.lstsq(A.T, slope.ravel(), rcond=None)[0]
        assert np.abs(A.T @ multipliers - slope.ravel()).max() < 1e-9


def test_three_feet_on_an_incline_share_a_weight_by_the_lever_rule():
    # Slope of 20 deg about x, feet at (0.3, -0.2), (-0.3, -0.2), (0, 0.2) along it, the centre of
    # mass 0.1 above amid them: in the slope's axes the weight is W (0, -sin, -cos). Moments about
    # the line of the first two feet, 0.4 from the third: N3 0.4 = W (0.2 cos - 0.1 sin).
    a, W, h = np.radians(20), 26.0, 0.1
    turn = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    plane = np.array([[0.3, -0.2, -h], [-0.3, -0.2, -h], [0, 0.2, -h]])
    contacts = Contacts(plane @ turn.T, np.ones(3), turn[:, 2])
    wrench = np.array([0, 0, W, 0, 0, 0])
    N3 = W * (0.2 * np.cos(a) - h * np.sin(a)) / 0.4
    expected = [(W * np.cos(a) - N3) / 2] * 2 + [N3]
    # Three feet leave the normals no choice on a plane: all members agree. 26 N, round-off 1e-14.
    for model in FORCE_MODELS[:2] + FORCE_MODELS[3:]:
        force = share_load(contacts, wrench, model)
        assert force @ turn[:, 2] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("name", FORCE_MODELS)
def test_a_foot_s_force_goes_to_nothing_with_its_share(name):
    # F_i = share_i H_i^-1 (...): proportional to the share where that is small.
    contacts, wrench, joints, _ = random_load(10, 6, 6, seed=9, full=True)
    sizes = []
    for small in (1e-6, 1e-7, 1e-8):
        share = np.array(contacts.share)
        share[:, 2] = small
        some = Contacts(contacts.feet, share, contacts.normals, 3.0)
        force = share_load(some, wrench, name, joints=joints)
        sizes.append(np.abs(force[:, 2]).max())
    assert sizes[1] == pytest.approx(sizes[0] / 10, rel=0.05)
    assert sizes[2] == pytest.approx(sizes[1] / 10, rel=0.05)


@pytest.mark.parametrize(
    ("make", "what"),
    [
        (lambda: Contacts(FEET, np.full(4, 1.5)), "share is 1.5 to 1.5; it must be between 0 and"),
        (lambda: Contacts(FEET, np.ones(4), np.zeros(3)), "a normal is (0, 0, 0); it must point"),
        (lambda: WeightedMinimumNorm(0.0), "tangential_weight is 0; it must be between 1e-06"),
        (lambda: force_model("friction-come"), 'no force model is called "friction-come".'),
        (
            lambda: share_load(Contacts(FEET, np.ones(4)), np.ones(6), "minimum-torque"),
            "minimum-torque needs the load of the joints.",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(make, what):
    with pytest.raises(InvalidInput) as caught:
        make()
    assert caught.value.what.startswith(what)


def stretched(joints):
    """The same joints' load with every leg stretched: one force of each needs no torque."""
    U, sizes, Vh = np.linalg.svd(joints.jacobian)
    flat = sizes * [1.0, 1.0, 0.0]
    return JointLoad(U * flat[..., None, :] @ Vh, joints.torque)


@pytest.mark.parametrize(
    ("model", "tolerance"),
    [
        (MinimumTorque(1e-5), 1e-12),
        (WeightedMinimumNorm(1e6), 1e-9),
        (SmallestLargestLoad(), 1e-10),
    ],
    ids=str,
)
def test_a_sample_s_forces_do_not_depend_on_its_neighbours(model, tolerance):
    # Each sample is solved alone, by the same operations: nothing but the order of sums may
    # differ, 1e-16 of some 10 N times the equations' condition, and with little slack a hundred
    # times that. J has rank 2; a lever of 10 um makes the cost's condition 1e8, and the root of it,
    # 1e4, that of the equations. The last sample has no feet and no load.
    contacts, wrench, joints, _ = random_load(40, 6, 4, seed=7)
    joints = stretched(joints)
    alone = share_load(contacts, wrench, model, joints=joints)
    assert np.abs(wrench_of(contacts.feet, alone) - wrench).max() < 1e-9
    share = np.array(contacts.share)
    share[-1], wrench[-1] = 0.0, 0.0
    beside = Contacts(contacts.feet, share, contacts.normals, contacts.friction)
    together = share_load(beside, wrench, model, joints=joints)
    assert np.abs(together[-1]).max() == 0
    assert np.abs(together[:-1] - alone[:-1]).max() < tolerance
