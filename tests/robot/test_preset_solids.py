"""The quadruped's and the octopod's links against the solids that their files name."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest

from phasmid.robot import load_robot

ALUMINIUM, RUBBER = 2.7e3, 1.1e3
"""Densities [kg/m³]."""


class Solid(NamedTuple):
    """Mass, centre of mass and principal moments about it, in the link's axes."""

    mass: float
    centre: np.ndarray
    inertia: np.ndarray


def box(mass, size, x, y=0.0, z=0.0):
    a, b, c = np.square(size)
    return Solid(mass, np.array([x, y, z]), mass / 12 * np.diag([b + c, a + c, a + b]))


def plates(size, x, side):
    """Two aluminium plates on both sides of the link; side is a vector to the middle of one."""
    mass = ALUMINIUM * math.prod(size)
    return [box(mass, size, x, *(sign * np.array(side))) for sign in (1, -1)]


def tube(length, outer, inner):
    mass = ALUMINIUM * math.pi / 4 * (outer**2 - inner**2) * length
    square = (outer**2 + inner**2) / 4
    across = mass * (3 * square + length**2) / 12
    return Solid(mass, np.array([length / 2, 0, 0]), np.diag([mass * square / 2, across, across]))


def ball(width, x):
    mass = RUBBER * math.pi / 6 * width**3
    return Solid(mass, np.array([x, 0, 0]), 0.1 * mass * width**2 * np.eye(3))


def joined(parts):
    mass = sum(part.mass for part in parts)
    centre = sum(part.mass * part.centre for part in parts) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        d = part.centre - centre
        inertia += part.inertia + part.mass * (d @ d * np.eye(3) - np.outer(d, d))
    return Solid(mass, centre, inertia)


@pytest.mark.parametrize(
    ("preset", "servo", "weight"),
    [
        ("quadruped", (0.0465, 0.0285, 0.034), 0.0572),
        ("octopod", (0.050, 0.032, 0.040), 0.0559),
    ],
)
def test_links_weigh_what_their_solids_do(preset, servo, weight):
    # The files' numbers have six digits.
    leg = load_robot(preset).legs[0]
    coxa, femur, tibia = leg.lengths
    length, width, depth = servo
    thin, thick = 0.003, 0.004
    expected = [
        # The femur's servo lies on its side: its axis is the coxa's y.
        [
            *plates((coxa, depth, thick), coxa / 2, (0.0, (width + thick) / 2)),
            box(weight, (length, depth, width), coxa - length / 4),
        ],
        [
            *plates((femur, width, thin), femur / 2, (0.0, (depth + thin) / 2)),
            box(weight, (length, width, depth), femur - length / 4),
        ],
        [
            *plates((0.04, width, thick), 0.01, (0.0, (depth + thick) / 2)),
            tube(tibia, 0.012, 0.008),
            ball(0.024, tibia),
        ],
    ]
    for link, parts in zip(leg.links, expected, strict=True):
        whole = joined(parts)
        assert link.mass == pytest.approx(whole.mass, rel=1e-5)
        assert link.com == pytest.approx(whole.centre, rel=1e-5, abs=1e-12)
        np.testing.assert_allclose(link.inertia, whole.inertia, rtol=1e-5, atol=1e-12)


def test_legs_are_numbered_around_the_body():
    # Right legs from front to rear, then left ones from rear to front: angles of the hips fall.
    for preset, count in (("quadruped", 4), ("octopod", 8)):
        robot = load_robot(preset)
        assert len(robot.legs) == count
        assert robot.leg_names[0] == "right_front"
        assert robot.leg_names[-1] == "left_front"
        x, y, _ = robot.arrays.p_body_hip.T
        around = np.unwrap(np.arctan2(y, x))
        assert (np.diff(around) < 0).all()
        mirror = robot.arrays.p_body_hip[::-1] * [1, -1, 1]
        np.testing.assert_array_equal(robot.arrays.p_body_hip, mirror)
