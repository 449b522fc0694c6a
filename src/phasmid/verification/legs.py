"""The legs' kinematics against themselves, against Table 1's chain and a complex step."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Complex, Float

from phasmid.kinematics import foot_position, jacobian, joint_angles, leg_frames
from phasmid.robot import Leg, load_robot, preset_names
from phasmid.verification.laboratory import Laboratory
from phasmid.verification.row import Row, reading

STATES = 10_000
"""Random angles per robot."""

SHORT = (0.0, 1e-15, 1e-12, 1e-9, 1e-6)
"""Parts by which a leg may miss full stretch."""


def round_trip(laboratory: Laboratory) -> Iterator[Row]:
    """Foot to angles to foot, and angles to foot to angles, over the workspace of all presets."""
    del laboratory
    there, back, stretched = [], [], []
    for leg in _legs():
        q = _random_angles()
        coxa, femur, tibia = leg.lengths
        r = coxa + femur * np.cos(q[:, 1]) + tibia * np.cos(q[:, 1] + q[:, 2])
        # Near the coxa axis, and where the leg is stretched or folded, the inverse kinematics is
        # ill-conditioned.
        q = q[(r > 0.01) & (np.abs(np.sin(q[:, 2])) > 0.05)]
        p = foot_position(leg, q)
        found = joint_angles(leg, p)
        there.append(np.abs(foot_position(leg, found) - p).max())
        back.append(np.abs(found - q).max() * sum(leg.lengths))
        for short in SHORT:
            up = np.linspace(-1.5, 1.5, 301)
            length = (femur + tibia) * (1 - short)
            far = np.stack([coxa + length * np.cos(up), 0 * up, length * np.sin(up)], axis=-1)
            again = foot_position(leg, joint_angles(leg, far))
            stretched.append(np.abs(again - far).max())
    why = "Sums of a few terms below 0.3 m, each rounded by 3e-17 m: 1e-12 leaves four orders."
    yield reading("FK(IK(p)) - p", np.max(there), 1e-12, why, unit="m")
    yield reading("IK(FK(q)) - q, times the leg's length", np.max(back), 1e-12, why, unit="m")
    yield reading("within 1e-6 of full stretch", np.max(stretched), 1e-12, why, unit="m")


def chain(laboratory: Laboratory) -> Iterator[Row]:
    """Table 1's chain of transforms beside the closed form."""
    del laboratory
    q = _random_angles()
    apart = [
        np.abs(leg_frames(leg, q)[:, 3, :3, 3] - foot_position(leg, q)).max() for leg in _legs()
    ]
    why = "Products of four transforms: fewer than 20 operations on terms below 0.3 m."
    yield reading("foot, all presets", np.max(apart), 1e-14, why, unit="m")


def slopes(laboratory: Laboratory) -> Iterator[Row]:
    """The Jacobian beside the complex step of Table 1's chain, written out here once more."""
    del laboratory
    q, step, apart = _random_angles(), 1e-30, []
    for leg in _legs():
        J = jacobian(leg, q)
        for joint in range(3):
            moved = q + 1j * step * np.eye(3)[joint]
            apart.append(np.abs(_foot(leg, moved).imag / step - J[..., joint]).max())
    why = "A complex step has no truncation; some ten operations on lengths below 0.3 m."
    yield reading("all presets", np.max(apart), 1e-13, why, unit="m")


def _legs() -> list[Leg]:
    return [load_robot(preset).legs[0] for preset in preset_names()]


def _random_angles() -> Float[np.ndarray, "states 3"]:
    """Knee-up angles over the whole range."""
    rng = np.random.default_rng(0)
    return rng.uniform([-3.0, -1.5, -np.pi], [3.0, 1.5, 0.0], (STATES, 3))


def _foot(leg: Leg, q: Complex[np.ndarray, "states 3"]) -> Complex[np.ndarray, "states 3"]:
    """The foot by the product of Table 1's transforms, for complex angles."""
    point = np.array([leg.tibia.length, 0.0, 0.0]) + np.zeros_like(q)
    coxa, femur = leg.coxa.length, leg.femur.length
    for angle, at, upright in ((q[:, 2], femur, 0), (q[:, 1], coxa, 1), (q[:, 0], 0.0, 0)):
        x, y, z = point.T
        c, s = np.cos(angle), np.sin(angle)
        x, y = c * x - s * y + at, s * x + c * y
        # The femur's axis lies level: a quarter turn about x.
        point = np.stack([x, -z, y] if upright else [x, y, z], axis=-1)
    return point
