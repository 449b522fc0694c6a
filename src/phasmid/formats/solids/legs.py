"""A leg of solids: brackets, servos, blades and a foot, from the numbers of the leg."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from phasmid.formats.solids import parts
from phasmid.formats.solids.assembly import ALUMINIUM, MM, PAINTED, RUBBER, SERVO, Placed, Solid
from phasmid.formats.solids.parts import ServoCase
from phasmid.robot import Leg


def _bracket(name: str, case: ServoCase, reach: float, *, start: float = 0.0) -> Solid:
    """Return a bracket around a servo; measures in millimetres."""
    return Solid(name, parts.bracket(case, round(reach, 6), start=round(start, 6)), ALUMINIUM)


def servo(case: ServoCase) -> Solid:
    """Return the servo with the mass of its data sheet."""
    return Solid("servo", parts.servo(case), SERVO, case.mass)


def room(leg: Leg) -> float:
    """Return the largest scale of an AX-12 that leaves room for a leg's links."""
    coxa, femur, tibia = (float(length) for length in leg.lengths)
    return min(max(coxa, 0.2 * femur) / 0.044, femur / 0.061, tibia / 0.075)


def pose(x: float = 0, y: float = 0, z: float = 0, turn: float = 0, axis: str = "z") -> np.ndarray:
    """Return a pose in a link's frame: a place [mm], and a turn [rad] about an axis of the link."""
    c, s = math.cos(turn), math.sin(turn)
    X = np.eye(4)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    X[i, i], X[i, j], X[j, i], X[j, j] = c, -s, s, c
    X[:3, 3] = np.array([x, y, z]) / MM
    return X


def leg_parts(leg: Leg, case: ServoCase) -> Mapping[str, tuple[Placed, ...]]:
    """Parts of coxa, femur and tibia, each in its link's frame.

    The coxa is two brackets back to back. Where the femur is long enough for two servos it
    holds both, as the paper's masses imply; in a shorter one the knee's servo sits in the tibia.
    """
    femur = MM * leg.femur.length
    both = femur >= 2 * MM * case.before + 2 * case.sheet
    knee = () if both else (Placed("knee_servo", servo(case), pose(turn=-leg.tibia_bend)),)
    return {
        "coxa": _coxa(leg, case),
        "femur": _femur_of_two(femur, case) if both else _femur_of_one(femur, case),
        "tibia": (*knee, *_tibia(leg, case, holds_servo=not both)),
    }


def _reach(distance: float, case: ServoCase) -> float:
    """Return the distance of a bracket's web from its axis, at most the given one [mm]."""
    least = MM * case.clearance + 2 * case.sheet
    return float(np.clip(distance, min(least, distance), 1.25 * least))


def _coxa(leg: Leg, case: ServoCase) -> tuple[Placed, ...]:
    length = MM * leg.coxa.length
    reach = _reach(length / 2, case)
    bracket = _bracket("coxa_bracket", case, reach)
    flipped = pose(length, turn=math.pi) @ pose(turn=math.pi / 2, axis="x")
    found = [Placed("hip_bracket", bracket, pose()), Placed("femur_bracket", bracket, flipped)]
    gap = length - 2 * reach
    if gap > 1e-6:
        spar = Solid("coxa_beam", parts.beam(round(gap, 6), 0.4 * case.w, 0.4 * case.w), ALUMINIUM)
        found.append(Placed("coxa_beam", spar, pose(reach)))
    return tuple(found)


def _femur_of_two(length: float, case: ServoCase) -> tuple[Placed, ...]:
    """Two servos back to back, held by two straps."""
    motor, w = servo(case), case.w
    edge = 0.9 * MM * case.behind
    strap = Solid(
        "femur_strap", parts.strap(round(length - 2 * edge, 6), 0.75 * w, case.sheet), PAINTED
    )
    upper = pose(edge, 0.5 * w, 0, -math.pi / 2, "x")
    lower = pose(edge, -0.5 * w, 0, math.pi / 2, "x")
    found = [
        Placed("femur_servo", motor, pose()),
        Placed("knee_servo", motor, pose(length, turn=math.pi)),
        Placed("upper_strap", strap, upper),
        Placed("lower_strap", strap, lower),
    ]
    gap = length - 2 * MM * case.before
    if gap > 0.15 * w:
        spar = Solid("femur_beam", parts.beam(round(gap, 6), 0.5 * w, 0.5 * w), PAINTED)
        found.append(Placed("femur_beam", spar, pose(MM * case.before)))
    return tuple(found)


def _femur_of_one(length: float, case: ServoCase) -> tuple[Placed, ...]:
    """Return the parts of the femur: servo, a cup around its far end, and a bracket to the knee."""
    before = MM * case.before
    web = before + case.sheet
    reach = _reach(length - web, case)
    found = [
        Placed("femur_servo", servo(case), pose()),
        Placed("femur_cup", _bracket("femur_cup", case, web, start=0.6 * before), pose()),
        Placed("knee_bracket", _bracket("knee_bracket", case, reach), pose(length, turn=math.pi)),
    ]
    gap = length - web - reach
    if gap > 1e-6:
        spar = Solid("femur_beam", parts.beam(round(gap, 6), 0.5 * case.w, 0.6 * case.w), PAINTED)
        found.append(Placed("femur_beam", spar, pose(web)))
    return tuple(found)


def _tibia(leg: Leg, case: ServoCase, *, holds_servo: bool) -> tuple[Placed, ...]:
    """Return the parts of the tibia: a bracket, two blades from its web, and the rubber foot."""
    w, sheet, length = case.w, case.sheet, MM * leg.tibia.length
    bend = leg.tibia_bend if holds_servo else 0.0
    if holds_servo:
        before = MM * case.before
        web = before + sheet
        held = Placed(
            "tibia_cup", _bracket("tibia_cup", case, web, start=0.6 * before), pose(turn=-bend)
        )
    else:
        web = _reach(0.3 * length, case)
        held = Placed("tibia_bracket", _bracket("tibia_bracket", case, web), pose())
    # The blades go from the web's middle to where the foot begins.
    radius = 0.19 * w
    root = np.array([math.cos(bend), -math.sin(bend)]) * web
    way = np.array([length, 0.0]) - root
    turn, far = math.atan2(way[1], way[0]), float(np.hypot(*way))
    tip = min(0.8 * w, 0.4 * far)
    span, thick = round(far - 0.55 * tip, 6), 3 * sheet
    cheek = Solid("tibia_blade", parts.blade(span, 0.95 * w, thick), PAINTED)
    X = pose(float(root[0]), float(root[1]), turn=turn)
    foot = Solid("foot", parts.foot(round(tip, 6), radius), RUBBER)
    return (
        held,
        Placed("left_blade", cheek, X @ pose(z=0.6 * radius)),
        Placed("right_blade", cheek, X @ pose(z=-0.6 * radius - thick)),
        Placed("foot", foot, X @ pose(far - round(tip, 6))),
    )
