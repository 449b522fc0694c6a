"""The closed form of one leg against its derivation in symbols, entry by entry."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from phasmid import derivation, dynamics
from phasmid.derivation.symbolic import ANGLES, GRAVITY, LENGTHS, LINKS
from phasmid.dynamics.matrices import in_plane
from phasmid.robot import Leg, Robot

# Torques below 10 N·m, as in row 10 of the physics charter; entries are sums of some hundred
# terms, so that round-off stays below 100 * 2.2e-16 * 10 = 2e-13.
TORQUE = 1e-10

ENTRIES = [
    *((part, i, j) for part in range(3) for i in range(3) for j in range(3)),
    *((3, i, 0) for i in range(3)),
]
NAMES = [f"{'MBCG'[part]}{i + 1}{j + 1}" for part, i, j in ENTRIES]
Derived = list[Callable[..., np.ndarray]]


def _symbols() -> list[sp.Symbol]:
    symbols = [*LENGTHS, GRAVITY]
    for link in LINKS:
        upper = [link.inertia[i, j] for i in range(3) for j in range(i, 3)]
        symbols += [link.mass, *link.com, *upper]
    return symbols


def _numbers(leg: Leg) -> list[float]:
    upper = np.triu_indices(3)
    # In symbols a lateral offset is a part of the centres of mass.
    com = [k.com for k in leg.links] - in_plane(leg)
    masses = [[k.mass, *c, *k.inertia[upper]] for k, c in zip(leg.links, com, strict=True)]
    return [*map(float, leg.lengths), 9.81, *(float(n) for link in masses for n in link)]


@pytest.fixture(scope="module")
def general() -> Derived:
    """Each entry as a function of the angles and the leg's numbers, by Lagrange's equations."""
    parts = derivation.lagrange()
    entries = [parts[part][i, j] for part, i, j in ENTRIES]
    return [sp.lambdify([*ANGLES, *_symbols()], entry) for entry in entries]


def _compare(leg: Leg, derived: Derived, rng: np.random.Generator) -> None:
    q = rng.uniform(-np.pi, np.pi, size=(10_000, 3))
    # The derivation knows upright hips only.
    upright = replace(leg, mount_pitch=0.0, mount_roll=0.0)
    matrices, numbers = dynamics.leg_matrices(upright, q), _numbers(leg)
    for name, (part, i, j), function in zip(NAMES, ENTRIES, derived, strict=True):
        entry = matrices.G[:, i] if part == 3 else matrices[part][:, i, j]
        expected = np.broadcast_to(function(*q.T, *numbers), len(q))
        np.testing.assert_allclose(entry, expected, rtol=0, atol=TORQUE, err_msg=name)


def test_each_of_the_30_entries_is_that_of_lagranges_equations(
    robot: Robot, rng: np.random.Generator, general: Derived
) -> None:
    for leg in (robot.legs[0], robot.legs[-1]):
        _compare(leg, general, rng)


def test_every_entry_that_can_move_a_joint_does(general: Derived, rng: np.random.Generator) -> None:
    # Else two zeros would agree: of 30 entries 21 are not identically zero.
    values = rng.uniform(0.5, 1.5, size=3 + len(_symbols()))
    assert sum(abs(float(entry(*values))) > 1e-6 for entry in general) == 9 + 4 + 6 + 2
