"""Figure of an explanation: a leg in its plane with its reach, and all legs from above."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.kinematics import FootExplanation, joint_angles, leg_frames
from phasmid.kinematics.workspace import arc, plane_outline, usable_limits
from phasmid.reporting.panels import Axes, Entry, Panels
from phasmid.reporting.style import (
    FAINT,
    INK,
    LIMIT_COLOUR,
    Figure,
    Layout,
    leg_colour,
    paler,
    styled,
)
from phasmid.robot import Leg, Robot

BODY_COLOUR = "#dde1e7"
WANTED: dict[str, Any] = {
    "color": LIMIT_COLOUR,
    "linestyle": "",
    "marker": "x",
    "markersize": 7,
    "markeredgewidth": 2.0,
    "zorder": 6,
}
NEAREST: dict[str, Any] = {
    "color": INK,
    "linestyle": "",
    "marker": "o",
    "markersize": 7,
    "markerfacecolor": "white",
    "markeredgewidth": 1.6,
    "zorder": 5,
}
NEEDED: dict[str, Any] = {
    "color": LIMIT_COLOUR,
    "linewidth": 1.3,
    "linestyle": (0, (3, 1.6)),
    "zorder": 4.2,
}


@styled()
def explanation_figure(
    robot: Robot, feet: Sequence[FootExplanation], title: str, notes: Sequence[str] = ()
) -> Figure:
    """Draw what keeps feet from their positions.

    The left panel is the plane of the first leg, the right one the robot in body axes from above.
    The reach is that of the knee-up leg within its joint limits. Each leg stands at its possible
    foot position nearest to the wanted one, which is drawn in the left panel as if turned into the
    leg's plane.

    Args:
        robot: The robot, L legs.
        feet: Foot positions of some of its legs, the most important first, one at least; other
            legs are drawn at their neutral feet.
        title: Title of the figure.
        notes: Parts of its subtitle.
    """
    drawing = Panels(Layout(), [3.9], columns=2, share_x=False, share_y=False)
    side, above = drawing.axes
    _draw_side(side, robot, feet[0])
    _draw_above(above, robot, feet)
    entries: list[Entry] = [("reach", {"color": paler(FAINT), "linewidth": 7})]
    if all(foot.is_possible for foot in feet):
        entries.append(("wanted foot, possible", NEAREST))
    else:
        entries += [("wanted foot", WANTED), ("nearest possible foot", NEAREST)]
    if any(map(_is_reached, feet)):
        entries.append(("leg beyond its limits", NEEDED))
    return drawing.complete(title, notes, entries)


def _is_reached(foot: FootExplanation) -> bool:
    """Return whether angles beyond the joint limits reach a foot position."""
    return not foot.is_possible and bool(np.isfinite(foot.q).all())


def _joints(leg: Leg, q: Float[np.ndarray, "3"]) -> Float[np.ndarray, "4 3"]:
    """Return the axes of coxa, femur and tibia, and the foot, in the hip frame [m]."""
    return np.asarray(leg_frames(leg, q)[:, :3, 3])


def _draw_side(axis: Axes, robot: Robot, foot: FootExplanation) -> None:
    """Draw a leg in its plane: distance from the coxa axis and height over the hip [mm]."""
    leg = foot.leg
    colour = leg_colour(robot.leg_names.index(leg.name))
    limits = [tuple(pair) for pair in usable_limits(leg).tolist()]
    axis.fill(*(1000 * plane_outline(leg, *limits[1:])).T, color=paler(FAINT), linewidth=0)

    def in_plane(points: np.ndarray, turn: float) -> np.ndarray:
        out = np.cos(turn) * points[..., 0] + np.sin(turn) * points[..., 1]
        return 1000 * np.stack([out, points[..., 2]], axis=-1)

    offset = float(leg.lateral_offsets.sum())
    out = np.sqrt(max(float(foot.wanted[:2] @ foot.wanted[:2]) - offset**2, 0.0))
    place = 1000 * np.array([out, foot.wanted[2]])
    if np.isfinite(foot.nearest_q).all():
        standing = in_plane(_joints(leg, foot.nearest_q), foot.nearest_q[0])
        axis.plot(*standing.T, color=colour, linewidth=4, marker="o", markersize=6, zorder=4)
        axis.plot(*np.stack([place, standing[-1]]).T, color=INK, linewidth=0.9, zorder=4.5)
        axis.plot(*standing[-1], **NEAREST)
    if _is_reached(foot):
        axis.plot(*in_plane(_joints(leg, foot.q), foot.q[0]).T, **NEEDED)
    if not foot.is_possible:
        axis.plot(*place, **WANTED)
    axis.set_title(f"{leg.name.replace('_', ' ')}, in the leg's plane")
    axis.set_xlabel("from the coxa axis [mm]")
    axis.set_ylabel("along the coxa axis [mm]" if leg.is_tilted else "above the hip [mm]")
    axis.set_aspect("equal", adjustable="datalim")
    axis.margins(0.06)


def _draw_above(axis: Axes, robot: Robot, feet: Sequence[FootExplanation]) -> None:
    """Draw the robot from above in body axes [mm]; legs out of reach stand out."""
    (back, right, _), (front, left, _) = 1000 * robot.body.box
    corners = [(back, right), (front, right), (front, left), (back, left)]
    axis.fill(*np.transpose(corners), color=BODY_COLOUR, linewidth=0, zorder=1)
    explained = {foot.leg.name: foot for foot in feet}
    for number, leg in enumerate(robot.legs):
        R, hip = leg.X_body_hip[:3, :3], leg.X_body_hip[:3, 3]

        def seen(points: np.ndarray, R: np.ndarray = R, hip: np.ndarray = hip) -> np.ndarray:
            return np.asarray(1000 * (points @ R.T + hip)[..., :2])

        foot = explained.get(leg.name)
        stands_out = foot is not None and (foot is feet[0] or not foot.is_possible)
        q = joint_angles(leg, leg.neutral_foot) if foot is None else foot.nearest_q
        colour = leg_colour(number) if stands_out else "#b4bac4"
        if stands_out:
            axis.fill(*seen(_seen_reach(leg)).T, color=paler(FAINT), linewidth=0, zorder=0.5)
        if np.isfinite(q).all():
            line = seen(_joints(leg, q))
            look: dict[str, Any] = {"linewidth": 4, "marker": "o", "markersize": 5}
            axis.plot(*line.T, color=colour, zorder=4 if stands_out else 3, **look)
            if foot is not None and stands_out:
                axis.plot(*np.stack([seen(foot.wanted), line[-1]]).T, color=INK, linewidth=0.9)
                axis.plot(*line[-1], **NEAREST)
        if foot is not None and not foot.is_possible:
            if _is_reached(foot):
                axis.plot(*seen(_joints(leg, foot.q)).T, **NEEDED)
            axis.plot(*seen(foot.wanted), **WANTED)
    axis.set_title("from above, in body axes")
    axis.set_xlabel("x, forward [mm]")
    axis.set_ylabel("y, left [mm]")
    axis.set_aspect("equal", adjustable="datalim")
    axis.margins(0.06)


def _seen_reach(leg: Leg) -> Float[np.ndarray, "points 3"]:
    """Return the edge of a leg's reach, projected along the coxa axis, in the hip frame [m]."""
    coxa, femur, tibia = (tuple(pair) for pair in usable_limits(leg).tolist())
    out = plane_outline(leg, femur, tibia)[:, 0]
    turn = arc(*coxa)
    circle = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=-1)
    return np.concatenate([out.max() * circle, out.min() * circle[::-1]])
