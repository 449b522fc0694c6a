"""What the paper says of the robot's structure, frames and kinematics."""

from __future__ import annotations

import numpy as np

from phasmid import kinematics
from phasmid.errors import InfeasibleWalk
from phasmid.motion import plan
from phasmid.paper.evidence import Evidence
from phasmid.paper.statement import Finding, Grade, Statement, judged

STATES = 10_000
"""Random states per leg on which equations are compared."""

EXACT = 1e-12
"""Two ways to a length [m] agree if they differ by less: some thousand round-offs of 1e-16 m."""


def joint_count(evidence: Evidence) -> Finding:
    """Joints of the robot."""
    joints = evidence.scenario.load_robot().arrays.lengths.size
    return judged(joints == 18, f"{joints} joints, {joints // 6} a leg")


def directions(evidence: Evidence) -> Finding:
    """Longest strides ahead and sideways, and the largest turn."""
    robot = evidence.robot
    ahead, side = (kinematics.longest_stride(robot, a) for a in (0.0, np.pi / 2))
    turn = _largest_turn(evidence)
    radius = np.linalg.norm(kinematics.neutral_feet(robot)[:, :2], axis=1).mean()
    feet = turn * radius
    grade = Grade.FAILS if ahead <= side else Grade.WITH_A_LIMIT if ahead <= feet else Grade.HOLDS
    return Finding(
        f"longest step {1000 * ahead:.0f} mm ahead, {1000 * side:.0f} mm sideways, "
        f"{np.degrees(turn):.0f}° of turning (feet travel {1000 * feet:.0f} mm)",
        grade,
        "It does sideways; on the spot the feet find more room than ahead."
        if grade is Grade.WITH_A_LIMIT
        else "",
    )


def _largest_turn(evidence: Evidence) -> float:
    """Largest turn of one step on the spot that can be planned, to 0.1 degrees [rad]."""
    # Slow enough that only reach counts.
    slow = evidence.scenario.replace(step_length=0.0, period=100.0)
    low, high = 0.0, np.pi
    while high - low > np.radians(0.1):
        middle = (low + high) / 2
        try:
            plan(slow.replace(step_turn=middle))
        except InfeasibleWalk:
            high = middle
        else:
            low = middle
    return low


def chain(evidence: Evidence) -> Finding:
    """The chain of Table 1 against the closed form."""
    leg = evidence.robot.legs[0]
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (STATES, 3))
    foot = kinematics.leg_frames(leg, q)[:, 3, :3, 3]
    miss = np.abs(foot - kinematics.foot_position(leg, q)).max()
    return judged(
        bool(miss < EXACT),
        f"chain and closed form differ by {miss:.0e} m on {STATES} states",
        "Once entry (1,4) of Eq. 1 and row 3 of Eq. 2 are put right.",
    )


def foot_frame(evidence: Evidence) -> Finding:
    """Whether frame 4 is parallel to frame 3, and frame 1 lies in frame 0."""
    leg = evidence.robot.legs[0]
    q = np.random.default_rng(2).uniform(-np.pi, np.pi, (STATES, 3))
    frames = kinematics.leg_frames(leg, q)
    turn = np.abs(frames[:, 3, :3, :3] - frames[:, 2, :3, :3]).max()
    away = np.linalg.norm(frames[:, 0, :3, 3], axis=-1).max()
    return judged(
        turn == 0 and away == 0,
        f"frame 4 turned against frame 3 by {turn:.0f}, frame 1 away from frame 0 by {away:.0f} m",
        "Frame 1 shares frame 0's origin; it coincides with it at θ1 = 0 only.",
    )


def inverse(evidence: Evidence) -> Finding:
    """Round trip of the corrected inverse kinematics."""
    leg = evidence.robot.legs[0]
    rng = np.random.default_rng(3)
    q = rng.uniform([-1.5, -1.5, -3.0], [1.5, 1.5, -0.1], (STATES, 3))
    p = kinematics.foot_position(leg, q)
    # The closed form reaches outwards from the coxa axis.
    p = p[kinematics.foot_position(leg, q * [0, 1, 1])[:, 0] > 1e-3]
    miss = np.abs(kinematics.foot_position(leg, kinematics.joint_angles(leg, p)) - p).max()
    return judged(
        bool(miss < EXACT),
        f"foot placed within {miss:.0e} m on {len(p)} points",
        "As corrected. As printed, Eqs. 3-9 place it elsewhere: see the misprints.",
    )


def body_shape(evidence: Evidence) -> Finding:
    """Symmetry of the hips left and right, front and rear."""
    hips = evidence.robot.arrays.p_body_hip
    mirrored = [hips * sign for sign in ([1, -1, 1], [-1, 1, 1])]
    miss = max(
        float(np.linalg.norm(hips[:, None] - other[None], axis=-1).min(axis=1).max())
        for other in mirrored
    )
    return judged(miss < EXACT, f"hips mirror each other within {miss:.0e} m")


def from_cad(_: Evidence) -> Finding:
    """Conversion of a CAD assembly."""
    return Finding("0 CAD files read", Grade.NOT_TESTED, "phasmid reads no CAD files yet.")


STRUCTURE = (
    Statement("structure", "the hexapod has eighteen joints, three a leg", joint_count),
    Statement("structure", "six legs lie symmetrically on two sides", body_shape),
    Statement(
        "structure", "it is quick and agile forwards, less so sideways and in turning", directions
    ),
    Statement("Table 1, Eqs 1-2", "the frames of Table 1 give the pose of the foot", chain),
    Statement("Fig 3", "frame 1 lies in frame 0, and frame 4 is parallel to frame 3", foot_frame),
    Statement("Eqs 3-9", "the angles that place a foot follow in closed form", inverse),
    Statement("Figs 7-8", "the CAD model becomes the multibody model by itself", from_cad),
)
"""In the paper's order."""
