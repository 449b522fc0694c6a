"""Statements of the paper on the legs' trajectories (Fig. 12)."""

from __future__ import annotations

import numpy as np

from phasmid import kinematics
from phasmid.paper.evidence import Evidence
from phasmid.paper.statement import Finding, Grade, Statement, judged

EXACT = 1e-9
"""Angles [rad], lengths [m] and times [s] that differ by less are equal."""

NOTABLE = 0.1
"""An angle that a reader of Fig. 12 might still see [°]."""

FIRST, SECOND = (0, 2, 4), (1, 3, 5)
"""The two tripods, as indices: legs 1, 3, 5 and 2, 4, 6."""


def inputs(evidence: Evidence) -> Finding:
    """Compare the four inputs with the planned feet."""
    walk, stride = evidence.planned, evidence.scenario.stride
    p = kinematics.body_from_hip(
        walk.robot, kinematics.foot_position(walk.robot.arrays, walk.q[:2001])
    )
    stroke, lift = np.ptp(p[..., 0], axis=0), np.ptp(p[..., 2], axis=0)
    good = np.abs(stroke - 0.040).max() < EXACT and np.abs(lift - 0.030).max() < 1e-6
    return judged(
        good and stride.period == 2.0 and stride.samples == 41,
        f"feet travel {1000 * stroke.mean():.3f} mm and lift {1000 * lift.mean():.3f} mm, "
        f"in a cycle of {stride.period:g} s and {stride.samples} samples",
        "As read here: 40 mm in a half cycle in the body frame, both ends of a cycle sampled.",
        best=Grade.BY_CONSTRUCTION,
    )


def smooth(evidence: Evidence) -> Finding:
    """Largest jump of speed and acceleration at the switches, the limit from both sides."""
    walk = evidence.planned
    switches, h = np.arange(1.0, 9.5, 1.0), 1e-9
    before, after = walk.sample(switches - h), walk.sample(switches + h)
    speed = np.abs(after.qd - before.qd).max()
    acceleration = np.abs(after.qdd - before.qdd).max()
    # Within 2e-9 s a jerk of 1e3 rad/s³ changes the acceleration by 2e-6.
    return judged(
        bool(speed < 1e-6 and acceleration < 1e-5),
        f"at the switches speeds jump by {speed:.0e} rad/s, accelerations by "
        f"{acceleration:.0e} rad/s²",
    )


def first_half(evidence: Evidence) -> Finding:
    """Compare the stance legs of both halves of the cycle with the paper."""
    time, stance = evidence.planned.time, evidence.planned.stance
    first = (time % 2.0) < 1.0 - EXACT
    good = (
        not stance[first][:, FIRST].any()
        and stance[first][:, SECOND].all()
        and stance[~first][:, FIRST].all()
        and not stance[~first][:, SECOND].any()
    )
    share = np.mean(stance[:, FIRST] == ~first[:, None])
    return judged(
        bool(good),
        f"true in {100 * share:.0f} % of {len(time)} samples",
        best=Grade.BY_CONSTRUCTION,
    )


def turned_in_support(evidence: Evidence, stance_law: str) -> np.ndarray:
    """Return how far femur and tibia turn in the first support [°], shape (2,)."""
    walk = evidence.variant(stance_law, "as-given").walk
    standing = walk.stance[:1000, 1]
    angles = walk.q[:1000][standing][:, SECOND, 1:]
    return np.asarray(np.degrees(np.ptp(angles, axis=0)).max(axis=0))


def coxa_only(evidence: Evidence) -> Finding:
    """Measure how far femur and tibia turn in support, under both stance laws."""
    femur, tibia = turned_in_support(evidence, "straight")
    words = turned_in_support(evidence, "coxa-only")
    slip = evidence.variant("coxa-only", "as-given").summary["slip"]["mean"]
    return judged(
        bool(words.max() < NOTABLE),
        f"by the coxa alone femur and tibia turn by {words.max():.0e}°, and feet slip "
        f"{1000 * slip:.1f} mm a step; on a straight line femur {femur:.1f}°, tibia {tibia:.1f}°",
        "A foot moved by the coxa alone follows an arc about the hip; a straight walk without slip "
        "needs all three joints. Both laws can be simulated.",
        best=Grade.HOLDS if max(femur, tibia) < NOTABLE else Grade.WITH_A_LIMIT,
    )


def transfer(evidence: Evidence) -> Finding:
    """Compare the rotation of each joint in a transfer phase."""
    walk = evidence.planned
    swinging = ~walk.stance[:1000, 0]
    turned = np.degrees(np.ptp(walk.q[:1000][swinging][:, FIRST], axis=0)).min(axis=0)
    coxa, femur, tibia = turned
    return judged(
        bool(turned.min() > NOTABLE),
        f"coxa by {coxa:.1f}°, femur by {femur:.1f}°, tibia by {tibia:.1f}°, or more",
    )


def mapping(evidence: Evidence) -> Finding:
    """Compare the feet's places at the start."""
    walk = evidence.planned
    robot, start = walk.robot, walk.q[0]
    p = kinematics.body_from_hip(robot, kinematics.foot_position(robot.arrays, start))
    ahead = 1000 * (p - kinematics.neutral_feet(robot))[:, 0]
    first, second = ahead[list(FIRST)], ahead[list(SECOND)]
    half = 500 * evidence.scenario.stride.step_length
    good = np.abs(first + half).max() < 1e-6 and np.abs(second - half).max() < 1e-6
    return judged(
        good,
        f"legs 1, 3, 5 stand {-first.mean():.0f} mm behind neutral, legs 2, 4, 6 "
        f"{second.mean():.0f} mm ahead",
        "As the mapping is read here.",
        best=Grade.BY_CONSTRUCTION,
    )


def repeats(evidence: Evidence) -> Finding:
    """Difference of the angles one cycle later."""
    q = evidence.planned.q
    miss = np.abs(q[2000:] - q[:-2000]).max()
    return judged(bool(miss < EXACT), f"angles one cycle later differ by {miss:.0e} rad")


def reverses(evidence: Evidence) -> Finding:
    """Leg 2 half a cycle later against leg 5, mirrored."""
    q = evidence.planned.q
    # Leg 2 is leg 5's mirror image: the coxa's sign turns round.
    miss = np.abs(q[1000:, 1] * [-1, 1, 1] - q[:-1000, 4]).max()
    return judged(
        bool(miss < EXACT), f"leg 2 half a cycle later equals leg 5 mirrored, within {miss:.0e} rad"
    )


TRAJECTORY = (
    Statement("Fig 6", "step length 40 mm, height 30 mm, time 2 s, 41 samples", inputs),
    Statement("results", "a polynomial of fifth degree makes the trajectory smooth", smooth),
    Statement(
        "Fig 12", "from 0 to 1 s legs 1, 3, 5 swing and 2, 4, 6 stand, then reversed", first_half
    ),
    Statement("results", "a mapping gives the joint angles from which the gait starts", mapping),
    Statement("Fig 12", "in transfer all three joints move", transfer),
    Statement("Fig 12", "in support only the coxa moves", coxa_only),
    Statement("Fig 12", "the trajectory repeats every 2 s", repeats),
    Statement("Fig 12", "the tripods change roles each half cycle", reverses),
)
"""In the paper's order."""
