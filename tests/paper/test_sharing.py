"""Internal forces: what statics leaves open."""

from __future__ import annotations

import numpy as np

from phasmid.paper.sharing import _internal_forces


def test_internal_forces_add_up_to_nothing() -> None:
    # Force and moment of each basis vector vanish; unit vectors and feet below 1 m: 1e-14.
    feet = np.random.default_rng(0).normal(scale=0.2, size=(20, 4, 3))
    basis = _internal_forces(feet)
    assert basis.shape == (20, 12 - 6, 12)
    forces = basis.reshape(20, 6, 4, 3)
    assert np.abs(forces.sum(axis=2)).max() < 1e-14
    assert np.abs(np.cross(feet[:, None], forces).sum(axis=2)).max() < 1e-14
    unit = np.einsum("nij,nkj->nik", basis, basis)
    np.testing.assert_allclose(unit, np.broadcast_to(np.eye(6), unit.shape), atol=1e-14)


def test_three_feet_on_level_ground_squeeze_level() -> None:
    # Two forces that cancel act along the line between their feet, which is level.
    feet = np.random.default_rng(1).normal(scale=0.2, size=(20, 3, 3))
    feet[..., 2] = -0.1
    basis = _internal_forces(feet)
    assert basis.shape == (20, 3, 9)
    assert np.abs(basis[..., 2::3]).max() < 1e-14
