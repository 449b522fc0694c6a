"""Eqs. 10 and 11 as printed."""

from __future__ import annotations

import numpy as np

from general_robot import upright
from phasmid import dynamics
from phasmid.dynamics.printed import printed_leg_matrices
from phasmid.robot import Robot, load_robot, with_mass_model

# Matrices below 1 kg·m² and torques below 10 N·m are sums of about twenty terms: round-off below
# 20 * 2.2e-16 * 10 = 4e-14.
ENTRY = 1e-12


def _angles(robot: Robot, rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(-np.pi, np.pi, size=(500, len(robot.legs), 3))


def test_the_papers_form_with_every_misprint_mended_is_the_equation_of_motion(
    robot: Robot, rng: np.random.Generator
) -> None:
    robot = upright(with_mass_model(robot, "mid-length"))
    q = _angles(robot, rng)
    pairs = [(robot.arrays, q), *((leg, q[:, i]) for i, leg in enumerate(robot.legs))]
    for legs, angles in pairs:
        paper = printed_leg_matrices(legs, angles, misprints=())
        for ours, true in zip(paper, dynamics.leg_matrices(legs, angles), strict=True):
            np.testing.assert_allclose(ours, true, rtol=0, atol=ENTRY)


def test_with_all_its_misprints_it_is_the_print_to_the_letter(rng: np.random.Generator) -> None:
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
    printed = printed_leg_matrices(leg, q)
    for part, matrix in zip("MBCG", printed, strict=True):
        for index in np.ndindex(matrix.shape[1:]):
            name = part + "".join(str(i + 1) for i in index)
            expected = np.broadcast_to(entries.get(name, 0.0), 100)
            entry = matrix[:, *index]
            np.testing.assert_allclose(entry, expected, rtol=0, atol=1e-15, err_msg=name)
