"""The closed form of one leg (Eqs. 10 and 11): derivation in symbols, and the printed equations."""

from dataclasses import replace

import numpy as np
import sympy as sp

from pages import derivation
from pages.derivation import ANGLES, GRAVITY, LENGTHS, LINKS
from phasmid import dynamics
from phasmid.dynamics.matrices import in_plane
from phasmid.dynamics.printed import printed_leg_matrices
from phasmid.robot import load_robot
from phasmid.units import STANDARD_GRAVITY

# Row 10 of the physics charter. Torques are below 10 N·m and entries sums of some hundred terms,
# so that round-off stays below 100 * 2.2e-16 * 10 = 2e-13.
TORQUE = 1e-10


def test_each_entry_is_that_of_lagranges_equations(rng, robot):
    # The derivation's hips are upright; a lateral offset is a part of the centres of mass.
    leg = replace(robot.legs[-1], mount_pitch=0.0, mount_roll=0.0)
    symbols, numbers = [*LENGTHS, GRAVITY], [*leg.lengths, 9.81]
    for symbol, link, centre in zip(LINKS, leg.links, in_plane(leg), strict=True):
        upper = np.triu_indices(3)
        entries = [symbol.inertia[i, j] for i, j in zip(*upper, strict=True)]
        symbols += [symbol.mass, *symbol.com, *entries]
        numbers += [link.mass, *(link.com - centre), *link.inertia[upper]]
    q = rng.uniform(-np.pi, np.pi, size=(10_000, 3))
    moving = 0
    for ours, derived in zip(
        dynamics.leg_matrices(leg, q, gravity=STANDARD_GRAVITY), derivation.lagrange(), strict=True
    ):
        functions = [sp.lambdify([*ANGLES, *symbols], entry) for entry in derived]
        expected = [np.broadcast_to(f(*q.T, *numbers), len(q)) for f in functions]
        np.testing.assert_allclose(ours.reshape(len(q), -1).T, expected, rtol=0, atol=TORQUE)
        moving += sum(entry != 0 for entry in derived)
    # Of 30 entries, those that are not identically zero.
    assert moving == 9 + 4 + 6 + 2


def test_the_matrices_add_up_to_the_leg_torque(robot, rng):
    # Eq. 10: torque = M q" + B [q' q'] + C [q'²] + G.
    shape = (1000, len(robot.legs), 3)
    q = rng.uniform(-np.pi, np.pi, size=shape)
    qd, qdd = 5 * rng.normal(size=shape), 20 * rng.normal(size=shape)
    w1, w2, w3 = np.moveaxis(qd, -1, 0)
    M, B, C, torque = dynamics.leg_matrices(robot.arrays, q, gravity=STANDARD_GRAVITY)
    for matrix, by in ((M, qdd), (B, np.stack([w1 * w2, w1 * w3, w2 * w3], -1)), (C, qd**2)):
        torque = torque + (matrix @ by[..., None])[..., 0]
    expected = dynamics.leg_torque(robot.arrays, q, qd, qdd, gravity=STANDARD_GRAVITY)
    np.testing.assert_allclose(torque, expected, rtol=0, atol=TORQUE)


def test_with_all_its_misprints_it_is_the_print_to_the_letter(rng):
    # The paper's terms in the paper's order, with θ3 = -q3; a missing plus is a product.
    leg = load_robot("phantomx-paper").legs[0]
    q = rng.uniform(-np.pi, np.pi, size=(100, 3))
    t2, t3, g = q[:, 1], -q[:, 2], 9.81
    (L1, L2, L3), (m1, m2, m3) = leg.lengths, (link.mass for link in leg.links)
    (_, _, zz1), (xx2, yy2, zz2), (xx3, yy3, zz3) = (np.diag(k.inertia) for k in leg.links)
    sin, cos = np.sin, np.cos
    m23 = zz3 + L3 * m3 * (L3 / 4 + L2 * cos(t3) / 2)
    g3 = g * L3 * m3 * cos(t2 - t3) / 2
    entries = {
        "M11": xx2 + xx3 / 2 + yy3 / 2 - zz1 + (yy2 - xx2) * cos(t2) ** 2
        + cos(2 * t2 - 2 * t3) / 2 * (yy3 - xx3 + L3**2 * m3 / 8) + L3**2 * m3 / 8
        + L1**2 * (m1 / 4 + m2 + m3) + L1 * L2 * cos(t2) * (m2 + m3)
        + L3 * m3 * (L2 * cos(t3) / 2 + L1 * cos(t2 - t3)),
        "M22": zz2 + L2**2 * (m2 / 4 + m3) + L3 * m3 * (L3 / 4 + L2 * cos(t3)),
        "M23": m23,
        "M32": m23,
        "M33": zz3 + L3**2 * m3 / 4,
        "B11": sin(2 * t2) / 2 * (xx2 - yy2 - L2**2 * m2 / 4 - L2**2 * m3)
        + sin(2 * t2 - 2 * t3) / 2 * (xx3 - yy3 - L3**2 * m3 / 4)
        - L1 * L2 * sin(t2) * (m2 / 2 + m3)
        - L3 * m3 / 2 * (L1 * sin(t2 - t3) + L2 * sin(2 * t2 - t3)),
        "B12": sin(2 * t2 - 2 * t3) * (xx3 - xx3 - L3**2 * m3 / 4)
        - L3 * m3 * (L2 * sin(t3) / 2 + L1 * sin(t2 - t3) + L2 * sin(2 * t2 - t3) / 2),
        "B23": L2 * L3 * m3 * sin(t3),
        "C21": sin(2 * t2) / 2 * (yy2 - xx2 * L2**2 * m2 / 4 + L2**2 * m3)
        + sin(2 * t2 - 2 * t3) / 2 * (yy3 - xx3 + L3**2 * m3 / 4) + L2 * L3 * m3 * sin(t3) / 2
        + L3 * m3 / 2 * (L1 * sin(t2 - t3) + L2 * sin(2 * t2 - t3))
        + L1 * L2 * sin(t2) * (m3 + m2 / 2),
        "C23": L2 * L3 * m3 * sin(t3),
        "C31": sin(2 * t2 - 2 * t3) / 2 * (yy3 - xx3 + L3**2 * m3 / 4)
        + L3 * m3 / 2 * (
            L1 * sin(t2 - t3) * L2 * sin(2 * t2 - t3) / 2 - L2 * sin(t3) / 2
        ),
        "C32": -L2 * L3 * m3 * sin(t3) / 2,
        "G2": g * L2 * m2 * cos(t2) / 2 + g * L2 * m3 * cos(t2) + g3,
        "G3": g3,
    }  # fmt: skip
    printed = printed_leg_matrices(leg, q, gravity=STANDARD_GRAVITY)
    for part, matrix in zip("MBCG", printed, strict=True):
        for index in np.ndindex(matrix.shape[1:]):
            name = part + "".join(str(i + 1) for i in index)
            expected = np.broadcast_to(entries.get(name, 0.0), 100)
            entry = matrix[:, *index]
            np.testing.assert_allclose(entry, expected, rtol=0, atol=1e-15, err_msg=name)
