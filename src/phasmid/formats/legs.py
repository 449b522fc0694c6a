"""Legs from chains of three hinges: order, names, frames of Table 1, zero angles and limits."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidRobot
from phasmid.formats.chains import Chain
from phasmid.formats.feet import PRINTED, Foot
from phasmid.formats.findings import Findings
from phasmid.formats.tree import rpy_of
from phasmid.robot import HEXAPOD_LEGS, JOINTS
from phasmid.robot.link import LONGEST_LENGTH
from phasmid.units import plain_number

SNAPPED = math.radians(1.0)
"""Axes this far from parallel or square are corrected: files with five digits of pi/2 are 0.02°
off, the slack of hobby servos is 0.25° to 0.5°; 1° moves a foot 200 mm away by 3.5 mm."""

LEVELLED = math.radians(0.1)
"""Coxa axes this near the vertical are made vertical."""

OFFSET = 0.02
"""Feet nearer to the leg's plane than this part of the leg's length are moved into it: at half its
reach the foot is then 2° off its direction, of the order of the servos' play. Others give the leg
lateral offsets."""

ASIDE = math.radians(60.0)
"""Angle of a coxa beyond which its leg's own direction is another than that of its zero [rad]."""

SHORTEST = 1e-4
"""Least length of femur and tibia; axes of coxa and femur that are nearer than this meet [m]."""

UPRIGHT = 0.5
"""Cosine of 60°: coxa axes that lean further are horizontal."""

MIDDLE = 1e-3
"""Hips within this of the plane between left and right belong to neither side [m]."""

QUADRUPED_LEGS = ("right_front", "right_rear", "left_rear", "left_front")
"""Names of four legs, two on each side, in phasmid's order."""

OCTOPOD_LEGS = (
    *("right_front", "right_front_middle", "right_rear_middle", "right_rear"),
    *("left_rear", "left_rear_middle", "left_front_middle", "left_front"),
)
"""Names of eight legs, four on each side, in phasmid's order."""


@dataclass(frozen=True, eq=False)
class FoundLeg:
    """A leg of a file in phasmid's terms.

    A servo at the file's angle φ is at the joint angle ``signs · φ + offsets``.

    Attributes:
        name: Name of the leg.
        chain: Its three hinges.
        foot: Source of the foot, in words.
        position: Hip, in the trunk or later in the body frame [m], shape (3,).
        angles: Yaw, pitch and roll of the hip [rad], shape (3,).
        X_trunk_links: Poses of the frames of Table 1 in the trunk at file angles 0,
            shape (3, 4, 4).
        lengths: Coxa, femur and tibia [m], shape (3,).
        lateral_offsets: Coxa, femur and tibia, to the left [m], shape (3,).
        signs: 1 or -1 for each joint, shape (3,).
        offsets: Joint angles at file angles 0 [rad], shape (3,).
        limits: Lowest and highest joint angles [rad], shape (3, 2).
        radius: Radius of the ball about its foot [m]; 0: a point.
    """

    name: str
    chain: Chain
    foot: str
    position: Float[np.ndarray, "3"]
    angles: Float[np.ndarray, "3"]
    X_trunk_links: Float[np.ndarray, "3 4 4"]
    lengths: Float[np.ndarray, "3"]
    lateral_offsets: Float[np.ndarray, "3"]
    signs: Float[np.ndarray, "3"]
    offsets: Float[np.ndarray, "3"]
    limits: Float[np.ndarray, "3 2"]
    radius: float = 0.0

    @property
    def joints(self) -> tuple[str, ...]:
        """The file's names of coxa, femur and tibia joint."""
        return tuple(joint.name for joint in self.chain.joints)


def names_in_order(hips: Float[np.ndarray, "legs 3"]) -> list[tuple[str, int]]:
    """Return name and index of each leg in the robot's order, by the hips in the trunk [m].

    Right legs from front to rear, then left legs from rear to front, which is the paper's order.
    A leg in the middle of the front is first, one in the middle of the rear between both sides.
    """
    x, y = hips[:, 0] - hips[:, 0].mean(), hips[:, 1] - hips[:, 1].mean()
    by_x = [int(i) for i in np.argsort(-x, kind="stable")]
    right = [i for i in by_x if y[i] < -MIDDLE]
    left = [i for i in reversed(by_x) if y[i] > MIDDLE]
    middle = [i for i in by_x if abs(y[i]) <= MIDDLE]
    front, rear = [i for i in middle if x[i] >= 0], [i for i in middle if x[i] < 0]
    order = [*front, *right, *rear, *left]
    for known in (HEXAPOD_LEGS, QUADRUPED_LEGS, OCTOPOD_LEGS):
        if 2 * len(right) == 2 * len(left) == len(order) == len(known):
            return list(zip(known, order, strict=True))
    names = [
        name if len(group) == 1 and name in ("front", "rear") else f"{name}_{number}"
        for name, group in (("front", front), ("right", right), ("rear", rear), ("left", left))
        for number, _ in enumerate(group, 1)
    ]
    return list(zip(names, order, strict=True))


def found_leg(number: int, name: str, chain: Chain, foot: Foot, findings: Findings) -> FoundLeg:
    """Find a chain's frames, lengths, angles and limits.

    Raises:
        InvalidRobot: Axes are not parallel or square, or a length is impossible.
    """
    axis = chain.axes[0]
    if abs(axis[2]) >= UPRIGHT:
        leg = _leg(number, name, chain, foot, math.copysign(1.0, axis[2]))
    else:
        # A horizontal coxa axis has no upper end: the end for which knees bend up is taken.
        leg = _leg(number, name, chain, foot, 1.0)
        if float(np.mean(leg.limits[2])) > 0:
            leg = _leg(number, name, chain, foot, -1.0)
    return _adjusted(leg, number, findings)


def _leg(number: int, name: str, chain: Chain, foot: Foot, up: float) -> FoundLeg:
    """Place the frames of Table 1 in a chain; `up` is the sign of the coxa axis that is up."""
    X_tibia = chain.poses[2]
    p_foot = X_tibia[:3, :3] @ foot.point + X_tibia[:3, 3]
    a1, a2, a3 = chain.axes
    p1, p2, p3 = chain.poses[:, :3, 3]
    z1 = up * a1
    _refuse_skew(chain, number)

    # The femur's axis square to the coxa's, and the tibia's like it.
    across = a2 - (a2 @ z1) * z1
    across /= np.linalg.norm(across)
    out = np.cross(across, z1)
    p_hip = p1 + ((p2 - p1) @ z1) * z1
    coxa = float((p2 - p_hip) @ out)
    if abs(coxa) < SHORTEST:
        # The axes meet: the foot decides which direction is outward.
        out, coxa = out if (p_foot - p_hip) @ out >= 0 else -out, 0.0
    elif coxa < 0:
        out, coxa = -out, -coxa
    # Right-handed with x out and z up; hinges of Table 1 turn about -y.
    y1 = np.cross(z1, out)
    plane = np.array([out, z1])
    hip_femur = plane @ (p2 - p_hip) * [1, 0]
    if not coxa:
        hip_femur = np.zeros(2)
    knee, tip = plane @ (p3 - p_hip) - hip_femur, plane @ (p_foot - p_hip) - hip_femur
    lengths = np.array([coxa, np.hypot(*knee), np.hypot(*(tip - knee))])
    _check_lengths(number, chain, lengths, float(np.linalg.norm(p_hip)))
    left = float((p_foot - p_hip) @ y1)

    e2, e3 = math.atan2(knee[1], knee[0]), math.atan2(tip[1] - knee[1], tip[0] - knee[0])
    signs = np.array([up, -math.copysign(1.0, a2 @ y1), -math.copysign(1.0, a3 @ y1)])
    # If the file's zero is not within the coxa's limits, the hip is turned and not the leg.
    turned = float(up * _middle(chain))
    c, s = math.cos(turned), math.sin(turned)
    x0 = c * out + s * y1
    offsets = np.array([-turned, e2, math.remainder(e3 - e2, 2 * math.pi)])
    links = [_pose(p_hip, out, y1, z1)]
    for angle, (x, z) in zip((e2, e3), (hip_femur, hip_femur + knee), strict=True):
        c, s = math.cos(angle), math.sin(angle)
        origin = p_hip + x * out + z * z1 + left * y1
        links.append(_pose(origin, c * out + s * z1, -s * out + c * z1, -y1))
    return FoundLeg(
        name,
        chain,
        foot.source,
        p_hip,
        rpy_of(np.column_stack([x0, np.cross(z1, x0), z1]))[::-1],
        np.array(links),
        lengths,
        # Positions of frames along parallel axes have no meaning: the coxa has all of the offset.
        np.array([left, 0.0, 0.0]),
        signs,
        offsets,
        _limits(chain, signs, offsets),
        foot.radius,
    )


def _pose(origin: np.ndarray, *axes: np.ndarray) -> np.ndarray:
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = np.column_stack(axes), origin
    return X


def _refuse_skew(chain: Chain, number: int) -> None:
    a1, a2, a3 = chain.axes
    square = math.degrees(math.asin(min(1.0, abs(a1 @ a2))))
    tilt = math.degrees(_angle_between(a2, a3))
    apart, differ = plain_number(90 - square, 3), plain_number(tilt, 3)
    for joint, angle, what in (
        (1, square, f"coxa and femur axes are {apart}° apart; this model needs them square."),
        (2, tilt, f"femur and tibia axes differ by {differ}°; this model needs them parallel."),
    ):
        if angle > math.degrees(SNAPPED):
            raise InvalidRobot(f"leg {number}: {what}", where=chain.joints[joint].where)


def _angle_between(a: np.ndarray, b: np.ndarray) -> float:
    """Angle between two lines [rad]."""
    return math.atan2(float(np.linalg.norm(np.cross(a, b))), abs(float(a @ b)))


def _check_lengths(number: int, chain: Chain, lengths: np.ndarray, hip: float) -> None:
    hint = 'foot = "0,0,-0.13", changed to where it touches'
    ends = (("femur and tibia axes", ""), ("tibia axis and foot", hint))
    for length, (between, hint) in zip(lengths[1:], ends, strict=True):
        if length < SHORTEST:
            what = (
                f"leg {number}: {between} are {plain_number(1000 * length, 2)} mm apart; they must "
                f"be {1000 * SHORTEST:g} mm or more."
            )
            raise InvalidRobot(what, where=chain.joints[2].where, hint=hint)
    for name, length in zip((*JOINTS, "hip's distance"), (*lengths, hip), strict=True):
        if not length <= LONGEST_LENGTH:
            what = (
                f"leg {number}: its {name} measures {plain_number(length)} m; lengths above "
                f"{LONGEST_LENGTH:g} m are refused."
            )
            where = chain.joints[0].where
            raise InvalidRobot(what, where=where, hint="give all lengths in metres")


def _middle(chain: Chain) -> float:
    """Return the coxa's angle in the file at which its leg points along the hip's x."""
    coxa = chain.joints[0]
    if coxa.home is not None and abs(coxa.home) > ASIDE and coxa.lower < coxa.home < coxa.upper:
        return coxa.home
    if coxa.kind == "continuous" or coxa.lower < 0 < coxa.upper:
        return 0.0
    if math.isfinite(coxa.lower) and math.isfinite(coxa.upper):
        return (coxa.lower + coxa.upper) / 2
    # Beyond the one end as far as the usual legs turn.
    return coxa.lower + ASIDE if math.isfinite(coxa.lower) else coxa.upper - ASIDE


def _limits(chain: Chain, signs: np.ndarray, offsets: np.ndarray) -> Float[np.ndarray, "3 2"]:
    """Convert limits to joint angles.

    A range of more than a turn is one turn; a range without an end ends there at half a turn.
    """
    limits = np.empty((3, 2))
    for row, joint, sign, offset in zip(limits, chain.joints, signs, offsets, strict=True):
        ends = sorted((sign * joint.lower + offset, sign * joint.upper + offset))
        bounded = [math.isfinite(end) for end in ends]
        if joint.kind != "continuous" and bounded[0] != bounded[1]:
            end = math.remainder(ends[bounded.index(True)], 2 * math.pi)
            row[:] = (end, math.pi) if bounded[0] else (-math.pi, end)
            if row[0] < row[1]:
                continue
        if joint.kind == "continuous" or not ends[1] - ends[0] < 2 * math.pi:
            row[:] = -math.pi, math.pi
            continue
        # Angles are in (-pi, pi]; a range about another turn's angle is moved there.
        turns = round((ends[0] + ends[1]) / 2 / (2 * math.pi))
        row[:] = [end - 2 * math.pi * turns for end in ends]
    return limits


def _adjusted(leg: FoundLeg, number: int, findings: Findings) -> FoundLeg:
    """Fit a leg that nearly fits: foot in its plane, coxa axis vertical; and note by how much."""
    left, z = leg.lateral_offsets[0], leg.X_trunk_links[0, :3, 2]
    square, length = leg.X_trunk_links[0, :3, 1], float(leg.lengths.sum())
    tilt = math.atan2(math.hypot(z[0], z[1]), z[2])
    turned = max(_angle_between(axis, square) for axis in leg.chain.axes[1:])
    done = []
    if abs(left) <= OFFSET * length:
        links = leg.X_trunk_links.copy()
        links[1:, :3, 3] -= left * square
        leg = replace(leg, lateral_offsets=np.zeros(3), X_trunk_links=links)
        if abs(left) > PRINTED:
            moved = plain_number(1000 * abs(left), 2)
            done.append(f"its foot is {moved} mm off the leg's plane and was moved into it")
    if tilt <= LEVELLED:
        leg = replace(leg, angles=leg.angles * [1, 0, 0])
        turned = max(tilt, turned)
    if turned > PRINTED:
        done.append(
            f"its axes were turned by up to {plain_number(math.degrees(turned), 2)}° to be "
            f"vertical, square or parallel, which moves the foot by up to "
            f"{plain_number(1000 * length * turned, 2)} mm"
        )
    if done:
        findings.note(f"leg {number}", f"{'; '.join(done)}.", leg.chain.joints[0].where)
    return leg
