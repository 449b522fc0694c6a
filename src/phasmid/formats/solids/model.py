"""The parametric model: a robot's numbers in, an assembly of solids out.

The trunk is two plates that hold the hips, with spacers and electronics.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial import ConvexHull

from phasmid import kinematics
from phasmid.formats.solids import parts
from phasmid.formats.solids.assembly import (
    ACRYLIC,
    BATTERY,
    BOARD,
    MM,
    NYLON,
    PAINTED,
    Assembly,
    Placed,
    Solid,
)
from phasmid.formats.solids.legs import leg_parts, pose, room, servo
from phasmid.formats.solids.parts import ServoCase, case_of
from phasmid.robot import JOINTS, Robot

THIN = 1.0
"""Hips that stray less than this from one line are taken as standing in it [mm]."""


def build(robot: Robot) -> Assembly:
    """Return the solids of a robot, standing on its neutral feet.

    Raises:
        PhasmidError: build123d is not installed.
    """
    case = case_of(robot.servo, min(room(leg) for leg in robot.legs))
    links = {"body": _trunk(robot, case)}
    poses = {"body": np.eye(4)}
    for leg in robot.legs:
        links_of_leg = leg_parts(leg, case)
        q = kinematics.joint_angles(leg, leg.neutral_foot)
        frames = leg.X_body_hip @ kinematics.leg_frames(leg, q)
        for number, joint in enumerate(JOINTS):
            links[f"{leg.name}.{joint}"] = links_of_leg[joint]
            poses[f"{leg.name}.{joint}"] = frames[number]
    return Assembly(robot.name, links, poses)


def _trunk(robot: Robot, case: ServoCase) -> tuple[Placed, ...]:
    """Parts of the body in its frame: a servo for each hip, two plates, a deck, a battery."""
    w, sheet = case.w, case.sheet
    hips = MM * robot.arrays.p_body_hip
    length, breadth, _ = (MM * float(c) for c in robot.body.size)
    (_, _, bottom), (_, _, top) = MM * robot.body.box
    found = []
    corners = []
    for leg in robot.legs:
        # The case points inwards.
        X = leg.X_body_hip @ pose(turn=math.pi)
        found.append(Placed(f"{leg.name}_servo", servo(case), X))
        corners.append(_corners(X, case.before, case.width, case.depth))
    places = MM * np.concatenate(corners)
    middle = float(hips[:, 2].mean())
    # Between plate and case there is room for the coxa's bracket.
    thick = 0.075 * w
    least = float(np.abs(places[:, 2] - middle).max()) + sheet + 0.04 * w + thick
    floor = middle - min(max(least, middle - float(bottom)), 1.3 * least)
    roof = middle + min(max(least, float(top) - middle), 1.3 * least)
    outline = _hull(hips[:, :2])
    margin = 0.42 * w
    inner = 0.5 * min(length, float(np.ptp(hips[:, 0])) or length)
    across = 0.5 * min(breadth, float(np.ptp(hips[:, 1])) or breadth)
    screws = [tuple(map(float, p)) for p in _screws(robot, w)]
    window = (0.0, 0.0, 0.5 * inner, 0.32 * across)
    windows = [window] if min(window[2:]) > 0.2 * w else []
    plate = Solid(
        "plate",
        parts.plate(tuple(outline), margin, thick, tuple(screws), 0.05 * w, tuple(windows)),
        ACRYLIC,
    )
    found += [
        Placed("lower_plate", plate, pose(z=floor)),
        Placed("upper_plate", plate, pose(z=roof - thick)),
    ]
    gap = roof - floor - 2 * thick
    found += _posts(robot, case, floor + thick, gap)
    battery = (0.95 * inner, 0.42 * across, 0.55 * gap)
    cell = Solid("battery", parts.box(battery, 0.06 * min(battery)), BATTERY)
    found.append(Placed("battery", cell, pose(z=floor + thick)))
    found += _deck(case, outline, roof, thick, (inner, across))
    return tuple(found)


def _corners(X: np.ndarray, before: float, width: float, depth: float) -> np.ndarray:
    box = np.array(
        [
            (x, y, z, 1.0)
            for x in (0.0, before)
            for y in (-width / 2, width / 2)
            for z in (-depth / 2, depth / 2)
        ]
    )
    return (box @ X.T)[:, :3]


def _hull(points: np.ndarray) -> list[tuple[float, float]]:
    """Corners of the convex outline, counter-clockwise."""
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if spread[1] < THIN:
        # Hips in one line still want a plate.
        square = np.array([(-1, -1), (-1, 1), (1, -1), (1, 1)])
        points = np.concatenate([points + THIN * corner for corner in square])
    return [(float(x), float(y)) for x, y in points[ConvexHull(points).vertices]]


def _screws(robot: Robot, w: float) -> np.ndarray:
    """Return places of the plates' screws: four over the case of each hip's servo."""
    case = np.array([(-x, y, 0.0) for x in (0.55 * w, 1.05 * w) for y in (-0.43 * w, 0.43 * w)])
    rows = [MM * leg.mount_position + case @ leg.X_body_hip[:3, :3].T for leg in robot.legs]
    return np.concatenate(rows)[:, :2]


def _posts(robot: Robot, case: ServoCase, floor: float, gap: float) -> list[Placed]:
    """Pillars from plate to plate, behind each hip's servo."""
    post = Solid("post", parts.pillar(0.11 * case.w, round(gap, 6)), NYLON)
    found = []
    for leg in robot.legs:
        inwards = -leg.X_body_hip[:2, 0]
        x, y = MM * leg.mount_position[:2] + inwards * (MM * case.before + 0.22 * case.w)
        found.append(Placed(f"{leg.name}_post", post, pose(float(x), float(y), floor)))
    return found


def _deck(
    case: ServoCase,
    outline: list[tuple[float, float]],
    top: float,
    thick: float,
    room: tuple[float, float],
) -> list[Placed]:
    """Return the upper deck: a plate on posts with the controller, and a sensor at the front."""
    w = case.w
    rise = 0.34 * w
    small = [(0.52 * x, 0.52 * y) for x, y in outline]
    spots = [(0.92 * x, 0.92 * y) for x, y in small]
    deck = Solid(
        "deck", parts.plate(tuple(small), 0.25 * w, thick, tuple(spots), 0.05 * w, ()), PAINTED
    )
    post = Solid("deck_post", parts.pillar(0.09 * w, round(rise, 6)), NYLON)
    found = [Placed("deck", deck, pose(z=top + rise))]
    found += [
        Placed(f"deck_post_{number}", post, pose(x, y, top))
        for number, (x, y) in enumerate(spots, 1)
    ]
    board = (0.55 * room[0], 0.52 * room[1], 0.10 * w)
    card = Solid("controller", parts.box(board, 0.2 * board[2]), BOARD)
    found.append(Placed("controller", card, pose(-0.06 * room[0], 0, top + rise + thick)))
    # A bright sensor marks the front.
    ahead = max(x for x, _ in outline)
    eye = Solid("sensor", parts.box((0.35 * w, 1.3 * w, 0.36 * w), 0.05 * w), NYLON)
    found.append(Placed("sensor", eye, pose(ahead - 0.1 * w, 0, top)))
    return found
