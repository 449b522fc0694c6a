"""Statements of the paper on the robot's structure, frames and kinematics."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from phasmid import kinematics
from phasmid.errors import InfeasibleWalk
from phasmid.formats import load_robot, save_robot
from phasmid.motion import longest_stride, plan
from phasmid.paper.evidence import Evidence
from phasmid.paper.statement import Finding, Grade, Statement, judged, length
from phasmid.robot import Robot
from phasmid.scenario import Scenario

STATES = 10_000
"""Random states per leg on which equations are compared."""

LINKS = (52.0, 82.0, 140.0)
"""Lengths of coxa, femur and tibia in the paper's tables [mm]."""

EXACT = 1e-12
"""Two ways to a length [m] agree if they differ by less: some thousand round-offs of 1e-16 m."""


def joint_count(evidence: Evidence) -> Finding:
    """Joints of the robot."""
    joints = evidence.robot.arrays.lengths.size
    legs = len(evidence.robot.legs)
    number = f"{joints} joints, {joints // legs} a leg"
    return judged(joints == 18 and legs == 6, number, best=Grade.BY_CONSTRUCTION)


def directions(evidence: Evidence) -> Finding:
    """Longest steps and fastest walks ahead, sideways and around."""
    robot = evidence.robot
    gait = evidence.planned.gait
    ahead, side = (longest_stride(robot, gait, direction=a) for a in (0.0, np.pi / 2))
    turn = _largest_turn(evidence)
    radius = float(np.linalg.norm(kinematics.neutral_feet(robot)[:, :2], axis=1).mean())
    speeds = [
        half / 2 / _shortest_step(evidence, **{field: half / 2})
        for field, half in (("step_length", ahead), ("step_sideways", side), ("step_turn", turn))
    ]
    forwards = ahead > side and speeds[0] > speeds[1]
    around = ahead > turn * radius and speeds[0] > speeds[2] * radius
    return judged(
        forwards,
        f"longest step {1000 * ahead:.0f} mm ahead, {1000 * side:.0f} mm sideways, "
        f"{np.degrees(turn):.0f}° around, in which feet travel {1000 * turn * radius:.0f} mm; "
        f"speeds with half of these steps and the servos at full speed "
        f"{1000 * speeds[0]:.0f} mm/s, {1000 * speeds[1]:.0f} mm/s, {np.degrees(speeds[2]):.0f}°/s",
        "Confirmed for forward against sideways walking. Turning has no common measure with "
        "these; by the travel of the feet it is the most flexible.",
        best=Grade.HOLDS if around else Grade.WITH_A_LIMIT,
    )


def _largest_turn(evidence: Evidence) -> float:
    """Largest turn of one step on the spot that can be planned, to 0.1 degrees [rad]."""
    # Slow enough that only reach counts.
    slow = evidence.scenario.replace(step_length=0.0, period=100.0)
    return _largest(lambda turn: slow.replace(step_turn=turn), np.pi, np.radians(0.1))


def _shortest_step(evidence: Evidence, **step: float) -> float:
    """Shortest time of such a step that the servos' speed allows, to 1 ms [s]."""
    still = evidence.scenario.replace(step_length=0.0).replace(**step)
    pace = _largest(lambda pace: still.replace(period=1 / pace), 20.0, 1e-3)
    return still.load_gait().duty_factor / pace


def _largest(scenario: Callable[[float], Scenario], most: float, step: float) -> float:
    """Return the largest value whose scenario can be planned."""
    low, high = step, most
    while high - low > step:
        middle = (low + high) / 2
        try:
            plan(scenario(middle))
        except InfeasibleWalk:
            high = middle
        else:
            low = middle
    return low


def axes(evidence: Evidence) -> Finding:
    """Angles between the joints' axes."""
    leg = evidence.robot.legs[0]
    q = np.random.default_rng(6).uniform(-np.pi, np.pi, (STATES, 3))
    coxa, femur, tibia = np.moveaxis(kinematics.leg_frames(leg, q)[:, :3, :3, 2], 1, 0)
    crossed = np.abs(np.sum(coxa * femur, axis=1)).max()
    parallel = np.linalg.norm(np.cross(femur, tibia), axis=1).max()
    return judged(
        bool(max(crossed, parallel) < EXACT),
        f"femur and tibia axes are parallel within {np.degrees(parallel):.0e}°, the coxa axis is "
        f"perpendicular to them within {np.degrees(crossed):.0e}°",
        best=Grade.BY_CONSTRUCTION,
    )


def lengths(evidence: Evidence) -> Finding:
    """Compare the link lengths with Tables 1 and 2."""
    coxa, femur, tibia = lengths_mm = 1000 * evidence.robot.legs[0].lengths
    return judged(
        bool(np.abs(lengths_mm - LINKS).max() < 1e-9),
        f"{coxa:g}, {femur:g} and {tibia:g} mm",
        best=Grade.BY_CONSTRUCTION,
    )


def chain(evidence: Evidence) -> Finding:
    """Compare the chain of Table 1 with the closed form."""
    leg = evidence.robot.legs[0]
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (STATES, 3))
    foot = kinematics.leg_frames(leg, q)[:, 3, :3, 3]
    miss = np.abs(foot - kinematics.foot_position(leg, q)).max()
    return judged(
        bool(miss < EXACT),
        f"chain and closed form differ by {length(miss)} on {STATES} states",
        "After the correction of entry (1,4) of Eq. 1 and row 3 of Eq. 2.",
        best=Grade.CORRECTED,
    )


def foot_frame(evidence: Evidence) -> Finding:
    """Measure the angle of frame 4 to frame 3, and the distance of frame 1 from frame 0."""
    leg = evidence.robot.legs[0]
    q = np.random.default_rng(2).uniform(-np.pi, np.pi, (STATES, 3))
    frames = kinematics.leg_frames(leg, q)
    turn = np.abs(frames[:, 3, :3, :3] - frames[:, 2, :3, :3]).max()
    away = np.linalg.norm(frames[:, 0, :3, 3], axis=-1).max()
    return judged(
        turn == 0 and away == 0,
        f"frame 4 is not turned against frame 3 (0 within {turn:.0f}), frame 1 is {length(away)} "
        "from frame 0",
        "Frame 1 shares frame 0's origin; it coincides with it at θ1 = 0 only.",
        best=Grade.WITH_A_LIMIT,
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
        f"foot placed within {length(miss)} on {len(p)} points",
        "As printed, Eqs. 3-9 place it elsewhere: see the misprints.",
        best=Grade.CORRECTED,
    )


def body_shape(evidence: Evidence) -> Finding:
    """Symmetry of the hips left and right, front and rear."""
    hips = evidence.robot.arrays.p_body_hip
    mirrored = [hips * sign for sign in ([1, -1, 1], [-1, 1, 1])]
    miss = max(
        float(np.linalg.norm(hips[:, None] - other[None], axis=-1).min(axis=1).max())
        for other in mirrored
    )
    return judged(miss < EXACT, f"hips mirror each other within {length(miss)}")


def from_cad(evidence: Evidence) -> Finding:
    """Measure the robot that comes back from a STEP assembly of it, with its sidecar."""
    if find_spec("build123d") is None:
        return Finding("nothing: the extra cad, which reads STEP, is absent", Grade.NOT_TESTED)
    robot = evidence.robot
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.step"
        save_robot(robot, path)
        imported = load_robot(path)
    joints = imported.arrays.lengths.size
    miss = _largest_gap(robot, imported, ("lengths", "p_body_hip", "mass", "com", "inertia"))
    return judged(
        joints == robot.arrays.lengths.size and miss < EXACT,
        f"a STEP file and the file beside it give {len(imported.legs)} legs and {joints} joints; "
        f"all numbers agree within {miss:.0e}",
        "STEP contains no joints, densities or servos; the file beside it does.",
        best=Grade.WITH_A_LIMIT,
    )


def _largest_gap(robot: Robot, other: Robot, names: tuple[str, ...]) -> float:
    """Largest difference of two robots' arrays, in SI units."""
    pairs = ((getattr(robot.arrays, name), getattr(other.arrays, name)) for name in names)
    return max(float(np.abs(ours - theirs).max()) for ours, theirs in pairs)


STRUCTURE = (
    Statement("structure", "the hexapod has eighteen joints, three a leg", joint_count),
    Statement("structure", "six legs lie symmetrically on two sides", body_shape),
    Statement(
        "structure", "it is fast and flexible forwards, less so sideways and turning", directions
    ),
    Statement("Tables 1, 2", "links are 52, 82 and 140 mm long", lengths),
    Statement("Table 1, Eqs 1-2", "the frames of Table 1 give the pose of the foot", chain),
    Statement(
        "Fig 3", "frame 1 coincides with frame 0, and frame 4 is parallel to frame 3", foot_frame
    ),
    Statement("kinematics", "femur and tibia turn about parallel axes", axes),
    Statement("Eqs 3-9", "the angles that place a foot follow in closed form", inverse),
    Statement(
        "Figs 7-8", "the CAD model is converted to the multibody model automatically", from_cad
    ),
)
"""In the paper's order."""
