"""Mounts of the legs on the trunk: order, names, hips, and the body's frame."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.formats.extension import LegExtension
from phasmid.formats.findings import Finding, Severity
from phasmid.formats.planar import LEVELLED, PRINTED
from phasmid.kinematics import rotation_rpy
from phasmid.robot import HEXAPOD_LEGS

MIDDLE = 1e-3
"""Hips within this of the plane between left and right belong to neither side [m]."""

QUADRUPED_LEGS = ("right_front", "right_rear", "left_rear", "left_front")
"""Names of four legs, two on each side, in this project's order."""

NOWHERE = 1e-15
"""Coordinates below this are round-off [m]."""

SAME = 1e-9
"""Rotations whose entries differ by no more than this are one."""


@dataclass(frozen=True, eq=False)
class Mount:
    """Mount of a leg on the body.

    Attributes:
        position: Hip in the body frame [m], shape (3,).
        angles: Yaw, pitch and roll of the hip frame [rad], shape (3,).
    """

    position: Float[np.ndarray, "3"]
    angles: Float[np.ndarray, "3"]

    @property
    def R_level_hip(self) -> Float[np.ndarray, "3 3"]:
        """The hip's tilt, without its yaw, shape (3, 3)."""
        _, pitch, roll = self.angles
        return hip_rotation((0.0, float(pitch), float(roll)))


def names_in_order(hips: Float[np.ndarray, "legs 3"]) -> list[tuple[str, int]]:
    """Order and name legs by the positions of their hips.

    Right legs from front to rear, then left legs from rear to front, which is the paper's order;
    a leg amid the front comes first, one amid the rear between right and left.

    Args:
        hips: In the trunk, x forward and y left [m], shape (L, 3).

    Returns:
        Name of each leg and its index among the hips, in the robot's order.
    """
    x, y = hips[:, 0] - hips[:, 0].mean(), hips[:, 1] - hips[:, 1].mean()
    by_x = [int(i) for i in np.argsort(-x, kind="stable")]
    right = [i for i in by_x if y[i] < -MIDDLE]
    left = [i for i in reversed(by_x) if y[i] > MIDDLE]
    middle = [i for i in by_x if abs(y[i]) <= MIDDLE]
    front, rear = [i for i in middle if x[i] >= 0], [i for i in middle if x[i] < 0]
    order = [*front, *right, *rear, *left]
    if len(order) == 6 and len(right) == len(left) == 3:
        return list(zip(HEXAPOD_LEGS, order, strict=True))
    if len(order) == 4 and len(right) == len(left) == 2:
        return list(zip(QUADRUPED_LEGS, order, strict=True))
    names = [
        name if len(group) == 1 and name in ("front", "rear") else f"{name}_{number}"
        for name, group in (("front", front), ("right", right), ("rear", rear), ("left", left))
        for number, _ in enumerate(group, 1)
    ]
    return list(zip(names, order, strict=True))


def mount_of(
    X_body_hip: Float[np.ndarray, "4 4"], said: LegExtension | None = None
) -> tuple[Mount, float]:
    """Return a hip's position and angles.

    Many triples of angles turn alike; of those the extension's is taken where it is one of them,
    otherwise the one whose pitch is within a quarter turn.

    Args:
        X_body_hip: The hip frame in the body, shape (4, 4).
        said: The leg's table in an extension.

    Returns:
        The mount, and by how much its axis was tilted to make it vertical [rad], 0 for not.
    """
    R, position = X_body_hip[:3, :3], X_body_hip[:3, 3]
    # A middle that rounding left beside 0.
    position = np.where(np.abs(position) < NOWHERE, 0.0, position)
    if said is not None:
        angles = np.array([said.yaw, said.pitch, said.roll])
        if np.abs(hip_rotation((said.yaw, said.pitch, said.roll)) - R).max() <= SAME:
            return Mount(position, angles), 0.0
    tilt = math.atan2(math.hypot(R[0, 2], R[1, 2]), R[2, 2])
    if tilt <= LEVELLED:
        yaw = math.atan2(R[1, 0], R[0, 0])
        return Mount(position, np.array([yaw, 0.0, 0.0])), tilt if tilt > PRINTED else 0.0
    level = math.hypot(R[0, 0], R[1, 0])
    pitch = math.atan2(-R[2, 0], level)
    if level < SAME:
        # The hip's x is vertical: yaw and roll turn about one line, and yaw takes it all.
        return Mount(position, np.array([math.atan2(-R[0, 1], R[1, 1]), pitch, 0.0])), 0.0
    yaw, roll = math.atan2(R[1, 0], R[0, 0]), math.atan2(R[2, 1], R[2, 2])
    return Mount(position, np.array([yaw, pitch, roll])), 0.0


def hip_rotation(angles: Iterable[float]) -> Float[np.ndarray, "3 3"]:
    """R_body_hip of a hip's yaw, pitch and roll [rad], shape (3, 3)."""
    yaw, pitch, roll = map(np.asarray, angles)
    return rotation_rpy(roll, pitch, yaw)


def body_frame(
    hips: Float[np.ndarray, "legs 3"], findings: list[Finding]
) -> Float[np.ndarray, "4 4"]:
    """The body's frame in the trunk: its axes, its origin amid the coxa axes.

    Args:
        hips: In the trunk [m], shape (L, 3).
        findings: Receives a note that the origin was moved.
    """
    X = np.eye(4)
    middle = hips.mean(axis=0)
    if np.linalg.norm(middle) > PRINTED:
        X[:3, 3] = middle
        shown = ", ".join(f"{round(1000 * float(c), 2) + 0.0:.2f}" for c in middle)
        findings.append(
            Finding(
                Severity.NOTE,
                "body",
                f"its origin was moved by ({shown}) mm, amid the coxa axes.",
            )
        )
    return X
