"""A leg of solids: brackets, servos, blades and a foot, from the numbers of the leg."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from phasmid.cad import parts
from phasmid.cad.assembly import MM, Placed, Solid
from phasmid.cad.material import ALUMINIUM, PAINTED, RUBBER, SERVO, Material
from phasmid.cad.servo_case import ServoCase
from phasmid.robot import Leg

SHEET = 0.055
"""Thickness of bent brackets, in widths of a servo."""


class Workshop:
    """Makes each distinct part once.

    Attributes:
        case: The servo's case.
        w: Width of the servo [mm], by which parts are sized.
        sheet: Thickness of brackets [mm].
    """

    def __init__(self, case: ServoCase) -> None:
        self.case = case
        self.w = MM * case.width
        self.sheet = SHEET * self.w
        self._made: dict[tuple[Any, ...], Solid] = {}

    def part(
        self,
        name: str,
        make: Callable[..., Any],
        *measures: Any,
        of: Material,
        mass: float | None = None,
        **more: Any,
    ) -> Solid:
        """Return the part of these measures, made once."""
        key = (name, make, *measures, *sorted(more.items()))
        if key not in self._made:
            self._made[key] = Solid(name, make(*measures, **more), of, mass)
        return self._made[key]

    def servo(self) -> Solid:
        """Return the servo with the mass of its data sheet."""
        return self.part("servo", parts.servo, self.case, of=SERVO, mass=self.case.mass)

    def bracket(self, name: str, reach: float, *, start: float = 0.0) -> Solid:
        """Return a bracket around a servo; measures in millimetres."""
        reach, start = round(reach, 6), round(start, 6)
        return self.part(
            name, parts.bracket, self.case, reach, self.sheet, start=start, of=ALUMINIUM
        )


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


def leg_parts(leg: Leg, shop: Workshop) -> Mapping[str, tuple[Placed, ...]]:
    """Parts of coxa, femur and tibia, each in its link's frame.

    The coxa is two brackets back to back. Where the femur is long enough for two servos it
    holds both, as the paper's masses imply; in a shorter one the knee's servo sits in the tibia.
    """
    femur = MM * leg.femur.length
    both = femur >= 2 * MM * shop.case.before + 2 * shop.sheet
    knee = () if both else (Placed("knee_servo", shop.servo(), pose(turn=-leg.tibia_bend)),)
    return {
        "coxa": _coxa(leg, shop),
        "femur": _femur_of_two(femur, shop) if both else _femur_of_one(femur, shop),
        "tibia": (*knee, *_tibia(leg, shop, holds_servo=not both)),
    }


def _reach(distance: float, shop: Workshop) -> float:
    """Return the distance of a bracket's web from its axis, at most the given one [mm]."""
    least = MM * shop.case.clearance + 2 * shop.sheet
    return float(np.clip(distance, min(least, distance), 1.25 * least))


def _coxa(leg: Leg, shop: Workshop) -> tuple[Placed, ...]:
    length = MM * leg.coxa.length
    reach = _reach(length / 2, shop)
    bracket = shop.bracket("coxa_bracket", reach)
    flipped = pose(length, turn=math.pi) @ pose(turn=math.pi / 2, axis="x")
    found = [Placed("hip_bracket", bracket, pose()), Placed("femur_bracket", bracket, flipped)]
    gap = length - 2 * reach
    if gap > 1e-6:
        spar = shop.part(
            "coxa_beam", parts.beam, round(gap, 6), 0.4 * shop.w, 0.4 * shop.w, of=ALUMINIUM
        )
        found.append(Placed("coxa_beam", spar, pose(reach)))
    return tuple(found)


def _femur_of_two(length: float, shop: Workshop) -> tuple[Placed, ...]:
    """Two servos back to back, held by two straps."""
    servo, w = shop.servo(), shop.w
    edge = 0.9 * MM * shop.case.behind
    strap = shop.part(
        "femur_strap", parts.strap, round(length - 2 * edge, 6), 0.75 * w, shop.sheet, of=PAINTED
    )
    upper = pose(edge, 0.5 * w, 0, -math.pi / 2, "x")
    lower = pose(edge, -0.5 * w, 0, math.pi / 2, "x")
    found = [
        Placed("femur_servo", servo, pose()),
        Placed("knee_servo", servo, pose(length, turn=math.pi)),
        Placed("upper_strap", strap, upper),
        Placed("lower_strap", strap, lower),
    ]
    gap = length - 2 * MM * shop.case.before
    if gap > 0.15 * w:
        spar = shop.part("femur_beam", parts.beam, round(gap, 6), 0.5 * w, 0.5 * w, of=PAINTED)
        found.append(Placed("femur_beam", spar, pose(MM * shop.case.before)))
    return tuple(found)


def _femur_of_one(length: float, shop: Workshop) -> tuple[Placed, ...]:
    """Return the parts of the femur: servo, a cup around its far end, and a bracket to the knee."""
    before = MM * shop.case.before
    web = before + shop.sheet
    reach = _reach(length - web, shop)
    found = [
        Placed("femur_servo", shop.servo(), pose()),
        Placed("femur_cup", shop.bracket("femur_cup", web, start=0.6 * before), pose()),
        Placed("knee_bracket", shop.bracket("knee_bracket", reach), pose(length, turn=math.pi)),
    ]
    gap = length - web - reach
    if gap > 1e-6:
        spar = shop.part(
            "femur_beam", parts.beam, round(gap, 6), 0.5 * shop.w, 0.6 * shop.w, of=PAINTED
        )
        found.append(Placed("femur_beam", spar, pose(web)))
    return tuple(found)


def _tibia(leg: Leg, shop: Workshop, *, holds_servo: bool) -> tuple[Placed, ...]:
    """Return the parts of the tibia: a bracket, two blades from its web, and the rubber foot."""
    w, sheet, length = shop.w, shop.sheet, MM * leg.tibia.length
    bend = leg.tibia_bend if holds_servo else 0.0
    if holds_servo:
        before = MM * shop.case.before
        web = before + sheet
        held = Placed(
            "tibia_cup", shop.bracket("tibia_cup", web, start=0.6 * before), pose(turn=-bend)
        )
    else:
        web = _reach(0.3 * length, shop)
        held = Placed("tibia_bracket", shop.bracket("tibia_bracket", web), pose())
    # The blades go from the web's middle to where the foot begins.
    radius = 0.19 * w
    root = np.array([math.cos(bend), -math.sin(bend)]) * web
    way = np.array([length, 0.0]) - root
    turn, far = math.atan2(way[1], way[0]), float(np.hypot(*way))
    tip = min(0.8 * w, 0.4 * far)
    span, thick = round(far - 0.55 * tip, 6), 3 * sheet
    cheek = shop.part("tibia_blade", parts.blade, span, 0.95 * w, thick, of=PAINTED)
    X = pose(float(root[0]), float(root[1]), turn=turn)
    foot = shop.part("foot", parts.foot, round(tip, 6), radius, of=RUBBER)
    return (
        held,
        Placed("left_blade", cheek, X @ pose(z=0.6 * radius)),
        Placed("right_blade", cheek, X @ pose(z=-0.6 * radius - thick)),
        Placed("foot", foot, X @ pose(far - round(tip, 6))),
    )
