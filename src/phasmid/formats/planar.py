"""A chain of three hinges as a planar leg: frames of Table 1, lengths and roundings."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidRobot
from phasmid.formats.chains import Chain
from phasmid.formats.findings import Finding, Severity
from phasmid.robot import JOINTS
from phasmid.robot.link import LONGEST_LENGTH
from phasmid.units import plain_number

SNAPPED = math.radians(1.0)
"""Axes this far from parallel or square are set right: files with five digits of pi/2 are 0.02°
off, the slack of hobby servos is 0.25° to 0.5°; 1° moves a foot 200 mm away by 3.5 mm."""

LEVELLED = math.radians(0.1)
"""Coxa axes this near the vertical are made vertical."""

PRINTED = 1e-9
"""Angles below this are round-off, without a note [rad]."""

OFFSET = 0.02
"""Feet nearer to the leg's plane than this part of the leg's length are moved into it: at half its
reach the foot then stands 2° off the direction of its coxa joint, of the order of the
servos' play. Others give the leg lateral offsets."""

SHORTEST = 1e-4
"""Least length of femur and tibia; axes of coxa and femur that are nearer than this meet [m]."""


@dataclass(frozen=True, eq=False)
class Planar:
    """A leg at joint angles 0 of the file.

    Attributes:
        X_trunk_hip: Pose of the hip frame in the trunk, shape (4, 4).
        X_trunk_links: Poses of the frames of Table 1 in the trunk, shape (3, 4, 4).
        lengths: Of coxa, femur and tibia [m], shape (3,).
        lateral_offsets: Of coxa, femur and tibia, to the left [m], shape (3,).
        signs: 1 or -1 for each joint: whether the file's angle grows with ours, shape (3,).
        offsets: Our angle where the file's is 0 [rad], shape (3,).
        findings: Roundings.
    """

    X_trunk_hip: Float[np.ndarray, "4 4"]
    X_trunk_links: Float[np.ndarray, "3 4 4"]
    lengths: Float[np.ndarray, "3"]
    lateral_offsets: Float[np.ndarray, "3"]
    signs: Float[np.ndarray, "3"]
    offsets: Float[np.ndarray, "3"]
    findings: tuple[Finding, ...]


def planar(
    chain: Chain,
    p_trunk_foot: Float[np.ndarray, "3"],
    number: int,
    z_trunk_hip: Float[np.ndarray, "3"],
    zero: float = 0.0,
) -> Planar:
    """Lay the frames of Table 1 into a chain.

    Args:
        chain: The three hinges.
        p_trunk_foot: The foot in the trunk at joint angles 0 [m], shape (3,).
        number: The leg's number in the robot, for messages.
        z_trunk_hip: Which way along the coxa axis is up, in the trunk, shape (3,).
        zero: The file's angle of the coxa joint at which the leg points along its hip's x [rad].

    Raises:
        InvalidRobot: Axes are not parallel or square.
    """
    findings: list[Finding] = []
    subject = f"leg {number}"
    a1, a2, a3 = chain.axes
    p1, p2, p3 = chain.poses[:, :3, 3]
    place = chain.joints[1].where
    z1 = a1 * (1.0 if a1 @ z_trunk_hip >= 0 else -1.0)
    _refuse_skew(subject, "coxa and femur", math.asin(min(1.0, abs(a1 @ a2))), place, square=True)
    tilt = math.atan2(float(np.linalg.norm(np.cross(a2, a3))), abs(float(a2 @ a3)))
    _refuse_skew(subject, "femur and tibia", tilt, chain.joints[2].where, square=False)

    # The femur's axis square to the coxa's, and the tibia's like it.
    across = a2 - (a2 @ z1) * z1
    across /= np.linalg.norm(across)
    out = np.cross(across, z1)
    height = (p2 - p1) @ z1
    p_hip = p1 + height * z1
    coxa = float((p2 - p_hip) @ out)
    if abs(coxa) < SHORTEST:
        # The axes meet: the foot decides which way is out.
        out, coxa = out if (p_trunk_foot - p_hip) @ out >= 0 else -out, 0.0
    elif coxa < 0:
        out, coxa = -out, -coxa
    # Right-handed with x out and z up; hinges of Table 1 turn about -y.
    y1 = np.cross(z1, out)

    def in_plane(p: np.ndarray) -> np.ndarray:
        return np.array([(p - p_hip) @ out, (p - p_hip) @ z1])

    knee, foot = in_plane(p3) - [coxa, 0.0], in_plane(p_trunk_foot) - [coxa, 0.0]
    femur, tibia = float(np.hypot(*knee)), float(np.hypot(*(foot - knee)))
    lengths = np.array([coxa, femur, tibia])
    for length, ends in ((femur, "femur and tibia axes"), (tibia, "tibia axis and foot")):
        if length < SHORTEST:
            raise InvalidRobot(
                f"{subject}: {ends} are {plain_number(1000 * length, 2)} mm apart; they must be "
                f"{1000 * SHORTEST:g} mm or more.",
                where=chain.joints[2].where,
                hint="--foot names the link at the foot" if "foot" in ends else "",
            )
    far = {**dict(zip(JOINTS, lengths, strict=True)), "hip": float(np.linalg.norm(p_hip))}
    for name, length in far.items():
        if not length <= LONGEST_LENGTH:
            what = "is off the trunk by" if name == "hip" else "measures"
            raise InvalidRobot(
                f"{subject}: its {name} {what} {plain_number(length)} m; lengths above "
                f"{LONGEST_LENGTH:g} m are refused.",
                where=chain.joints[0].where,
                hint="give all lengths in metres",
            )
    left = float((p_trunk_foot - p_hip) @ y1)
    if abs(left) <= OFFSET * lengths.sum():
        _note_offset(findings, subject, abs(left), place)
        left = 0.0
    # Positions of frames along parallel axes have no meaning: the coxa has all of the offset.
    lateral_offsets = np.array([left, 0.0, 0.0])
    _note_skew(findings, subject, chain, across, lengths)

    e2 = math.atan2(knee[1], knee[0])
    e3 = math.atan2(foot[1] - knee[1], foot[0] - knee[0])
    signs = np.array(
        [math.copysign(1.0, a1 @ z1), -math.copysign(1.0, a2 @ y1), -math.copysign(1.0, a3 @ y1)]
    )
    # Where the file's zero is not the leg's middle, the hip is turned and not the leg.
    turned = float(signs[0]) * zero
    c, s = math.cos(turned), math.sin(turned)
    x0 = c * out + s * y1
    offsets = np.array([-turned if zero else 0.0, e2, _wrapped(e3 - e2)])

    hip = _pose(p_hip, x0, np.cross(z1, x0), z1)
    links = [_pose(p_hip, out, y1, z1)]
    origins = (
        p_hip + coxa * out + left * y1,
        p_hip + (coxa + knee[0]) * out + knee[1] * z1 + left * y1,
    )
    for angle, origin in zip((e2, e3), origins, strict=True):
        c, s = math.cos(angle), math.sin(angle)
        links.append(_pose(origin, c * out + s * z1, -s * out + c * z1, -y1))
    return Planar(hip, np.array(links), lengths, lateral_offsets, signs, offsets, tuple(findings))


def _pose(origin: np.ndarray, *axes: np.ndarray) -> np.ndarray:
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = np.column_stack(axes), origin
    return X


def _wrapped(angle: float) -> float:
    """An angle in (-pi, pi]."""
    return angle - 2 * math.pi * math.ceil((angle - math.pi) / (2 * math.pi))


def _refuse_skew(subject: str, names: str, angle: float, where: str, *, square: bool) -> None:
    if angle <= SNAPPED:
        return
    shown = math.degrees(angle)
    what = (
        f"{names} axes are {plain_number(90 - shown, 3)}° apart; this model needs them square."
        if square
        else f"{names} axes differ by {plain_number(shown, 3)}°; this model needs them parallel."
    )
    raise InvalidRobot(f"{subject}: {what}", where=where)


def _note_skew(
    findings: list[Finding],
    subject: str,
    chain: Chain,
    across: np.ndarray,
    lengths: np.ndarray,
) -> None:
    """Note by how much axes were turned, and how far that moves the foot at most."""
    arms = (float(lengths[1] + lengths[2]), float(lengths[2]))
    for name, axis, arm, joint in zip(
        JOINTS[1:], chain.axes[1:], arms, chain.joints[1:], strict=True
    ):
        angle = math.atan2(float(np.linalg.norm(np.cross(axis, across))), abs(float(axis @ across)))
        if angle < PRINTED:
            continue
        findings.append(
            Finding(
                Severity.NOTE,
                subject,
                f"{name} axis was turned by {plain_number(math.degrees(angle), 2)}° to fit the "
                f"leg's plane, which moves the foot by {plain_number(1000 * arm * angle, 2)} mm at "
                "most.",
                where=joint.where,
            )
        )


def _note_offset(findings: list[Finding], subject: str, offset: float, where: str) -> None:
    """Note that a foot was moved into its leg's plane."""
    if offset > PRINTED:
        findings.append(
            Finding(
                Severity.NOTE,
                subject,
                f"its foot stands {plain_number(1000 * offset, 2)} mm off the leg's plane "
                f"and was moved into it.",
                where=where,
            )
        )
