"""Picture of the robot at one moment of a recording, with the forces on its feet.

The engine's renderer draws it; without OpenGL it is a stick figure.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import closing
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid import kinematics
from phasmid.recording import Recording
from phasmid.reporting.camera import View, camera_axes, fitted_view
from phasmid.reporting.panels import Axes, time_axis
from phasmid.reporting.renderer import SceneRenderer, Segment, opengl_lack
from phasmid.reporting.robot_mesh import body_pose, robot_corners
from phasmid.reporting.run import Run, Source, read_run, short
from phasmid.reporting.style import (
    DEFAULT_LAYOUT,
    FAINT,
    INK,
    NORMAL_WIDTH,
    Figure,
    Layout,
    leg_colour,
    new_figure,
    styled,
)
from phasmid.reporting.time_figures import Legs, draw_bars
from phasmid.robot import Appearance
from phasmid.terrain import Ground

DPI = 166
"""Pixels per inch of the picture at the default width; at any other it has as many pixels."""

ELEVATION = math.radians(27.0)
AZIMUTH, UNEVEN_AZIMUTH = math.radians(-56.0), math.radians(-118.0)
"""Directions from the robot to the camera; uneven ground is seen from behind, against its steps."""

FILL, UNEVEN_FILL = 0.74, 0.60
"""Shares of the picture that the robot takes on level and on uneven ground."""

SQUARE = 0.1
"""Side of the squares on the ground [m]."""

FORCE_COLOUR, FORCE_TEXT = "#e8590c", "#a33c05"
FORCE_LENGTH = 1.2
"""Length of an arrow of the whole weight, in spans of the robot's hips."""


def walk_figure(runs: Sequence[Run], legs: Legs, layout: Layout) -> Figure:
    """Draw `walk_picture` of one run, with all legs."""
    del legs
    return walk_picture(runs[0].recording, layout=layout)


def walk_picture(
    recording: Recording, appearance: Appearance | None = None, layout: Layout = DEFAULT_LAYOUT
) -> Figure:
    """Draw the robot in mid-walk, the paths of its feet and, underneath, its gait.

    Args:
        recording: Recording with the body's pose and joint angles, simulated or planned.
        appearance: The robot's meshes, where they do not come with phasmid.
        layout: Width and caption.

    Raises:
        InvalidInput: The pose is not recorded.
    """
    moment = mid_walk_swing_time(read_run(recording))
    return draw_robot(recording, moment, gait=True, appearance=appearance, layout=layout)


def mid_walk_swing_time(run: Run) -> float:
    """Return the time at which the feet are highest in sum, in the cycle mid-walk [s]."""
    time, feet = run.time, run.channel("foot_position")
    middle = (time[0] + time[-1]) / 2
    near = np.flatnonzero(np.abs(time - middle) <= run.experiment.course.stride.period / 2)
    if feet is None or len(near) == 0:
        return float(middle)
    x, y, z = np.moveaxis(feet[near], -1, 0)
    height = z - run.experiment.world.terrain.height(x, y)
    return float(time[near[np.argmax(np.nan_to_num(height.sum(axis=1), nan=-np.inf))]])


def draw_robot(
    recording: Recording,
    time: float,
    *,
    gait: bool = False,
    appearance: Appearance | None = None,
    layout: Layout = DEFAULT_LAYOUT,
) -> Figure:
    """Draw the robot at one moment, with the forces on its feet.

    Args:
        recording: Recording with the body's pose and joint angles, simulated or planned.
        time: Time of the nearest recorded sample [s].
        gait: Draw a gait diagram under the picture.
        appearance: The robot's meshes, where they do not come with phasmid.
        layout: Width and caption.

    Raises:
        InvalidInput: The body's pose or the joint angles are not recorded.
    """
    run = read_run(recording, appearance)
    position, orientation, angles = run.pose("this picture")
    now = int(np.argmin(np.abs(run.time - time)))
    wide, scale, dpi = layout.inches, layout.type_scale, DPI * NORMAL_WIDTH / layout.width
    tall, gait = 0.54 * wide, gait and run.has("stance")
    strip = scale * (0.66 + 0.145 * len(run.robot.legs)) if gait else 0.0
    size = (round(wide * dpi), round(tall * dpi))
    X_world_body, q = body_pose(position[now], orientation[now]), angles[now]
    view = _view(run, X_world_body, q, size)
    paths = _foot_paths(run, now)
    joints = _joint_positions(run, X_world_body, q)
    with styled(scale):
        figure = new_figure(wide, tall + strip, dpi)
        axis = figure.add_axes((0, strip / (tall + strip), 1, tall / (tall + strip)))
        axis.set_axis_off()
        axis.set(xlim=(0, size[0]), ylim=(size[1], 0))
        if opengl_lack() is None:
            picture = _rendered(run, view, X_world_body, q, paths)
            axis.imshow(picture, extent=(0, *size, 0), aspect="auto", interpolation="none")
        else:
            _draw_stick_figure(axis, run, view, joints, paths)
        _draw_forces(axis, run, view, now)
        for leg, (x, y) in enumerate(view.project(joints[:, KNEE] + [0, 0, 0.13 * run.hip_span])):
            bold = {"color": leg_colour(leg), "fontweight": "bold", "fontsize": "large"}
            _write_outlined(axis, x, y, str(leg + 1), ha="center", **bold)
        if layout.title:
            _write_caption(axis, run, now)
        if gait:
            left, below = scale * 1.35 / wide, scale * 0.48 / (tall + strip)
            height = (strip - scale * 0.56) / (tall + strip)
            _draw_gait(figure.add_axes((left, below, 0.965 - left, height)), run, now)
    return figure


def _view(source: Source, X_world_body: np.ndarray, q: np.ndarray, size: tuple[int, int]) -> View:
    """Return a camera at the robot's right side that holds all of it."""
    level = source.experiment.world.terrain.is_level
    yaw = math.atan2(X_world_body[1, 0], X_world_body[0, 0])
    axes = camera_axes(yaw + (AZIMUTH if level else UNEVEN_AZIMUTH), ELEVATION)
    corners = robot_corners(source.robot, q, X_world_body)
    share = FILL if level else UNEVEN_FILL
    return fitted_view(corners, axes, size, (share, share))


def _write_caption(axis: Axes, run: Run, now: int) -> None:
    """Write title and caption into the picture's corner."""
    step = 1000 * run.experiment.course.stride.step_length
    lines = [
        run.drive_words,
        f"t = {run.time[now]:.2f} s · step {step:.4g} mm · squares {1000 * SQUARE:g} mm",
    ]
    if run.ending_words:
        lines.append(run.ending_words)
    if run.experiment.world.kind != "flat":
        lines.insert(0, f"terrain: {run.experiment.world.kind}")
    if run.normal_force is not None:
        what = f"{short(run.attribute('force_model'))} forces"
        what = "ground on foot" if run.has("foot_force") else what
        largest = _newtons(run.normal_force[now].max())
        lines.append(f"arrows: {what}, at most {largest}")
    title = f"{short(run.robot.name)}, {short(run.gait.name)} gait"
    corner: dict[str, Any] = {"va": "top", "transform": axis.transAxes}
    axis.text(0.02, 0.97, title, fontsize="large", fontweight="bold", **corner)
    axis.text(0.02, 0.91, "\n".join(lines), fontsize="small", color=FAINT, **corner)


def _newtons(force: float) -> str:
    if force < 0.05:
        return "0 N"
    return f"{force:#.3g} N" if force < 99.95 else f"{force:.0f} N"


def _foot_paths(run: Run, now: int) -> list[np.ndarray]:
    """Return the path of each foot in the last two cycles [m]."""
    feet = run.channel("foot_position")
    if feet is None:
        return []
    start = int(np.searchsorted(run.time, run.time[now] - 2 * run.experiment.course.stride.period))
    rows = np.unique(np.linspace(start, now, 120).astype(int))
    return list(np.moveaxis(feet[rows], 1, 0))


def _rendered(
    run: Run, view: View, X_world_body: np.ndarray, q: np.ndarray, paths: Sequence[np.ndarray]
) -> np.ndarray:
    """Return the robot on its ground, with foot paths as rods."""
    radius = 0.006 * run.hip_span
    segments: list[Segment] = [
        (start, end, radius, leg_colour(leg))
        for leg, path in enumerate(paths)
        for start, end in pairwise(path)
    ]
    terrain, place = run.experiment.world.terrain, X_world_body[None, :2, 3]
    with closing(SceneRenderer(run.robot, terrain, place, view, SQUARE)) as renderer:
        return renderer.picture(view, X_world_body, q, segments)


KNEE = 3


def _joint_positions(source: Source, X_world_body: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return hip, coxa, femur, tibia and foot of each leg in the world [m], shape (L, 5, 3)."""
    frames = [
        leg.X_body_hip @ np.concatenate([np.eye(4)[None], kinematics.leg_frames(leg, angles)])
        for leg, angles in zip(source.robot.legs, q, strict=True)
    ]
    return np.asarray((X_world_body @ np.array(frames))[..., :3, 3])


def _draw_stick_figure(
    axis: Axes,
    source: Source,
    view: View,
    joints: np.ndarray,
    paths: Sequence[np.ndarray],
) -> None:
    """Draw ground, foot paths and the robot's links as lines."""
    _draw_grid(axis, source.experiment.world.terrain, view)
    for leg, path in enumerate(paths):
        axis.plot(*view.project(path).T, color=leg_colour(leg), linewidth=1.4)
    # Painted from the farthest leg to the nearest; the trunk lies between.
    depth = (joints[:, -1] - view.middle) @ view.axes[2]
    line: dict[str, Any] = {"marker": "o", "markersize": 6, "markeredgecolor": "white"}
    for leg, p_world_leg in enumerate(joints):
        line |= {"color": leg_colour(leg), "zorder": 4 if depth[leg] > 0 else 2.5}
        axis.plot(*view.project(p_world_leg).T, linewidth=4, **line)
    around = np.argsort(np.arctan2(*(source.robot.arrays.p_body_hip[:, :2].T[::-1])))
    hips = view.project(joints[around, 0])
    axis.fill(*hips.T, facecolor="#7d8796", edgecolor=INK, linewidth=2, zorder=3)


def _draw_grid(axis: Axes, terrain: Ground, view: View) -> None:
    """Draw the ground as lines at the distance of `SQUARE`."""
    count = math.ceil(view.distance / 2.5 / SQUARE)
    middle = np.round(view.middle[:2] / SQUARE)
    along = np.linspace(-count, count, 121)
    for k in range(-count, count + 1):
        aside = np.full(along.shape, float(k))
        for line in ((along, aside), (aside, along)):
            x, y = SQUARE * (middle[:, None] + line)
            seen = view.project(np.stack([x, y, terrain.height(x, y)], axis=-1))
            axis.plot(*seen.T, color="#dde1e7", linewidth=0.8, zorder=1)


def _draw_forces(axis: Axes, run: Run, view: View, now: int) -> None:
    """Draw arrows at the feet, and the normal force beside each stance foot."""
    feet, force, normal = run.channel("foot_position"), run.foot_force, run.normal_force
    if feet is None or force is None or normal is None:
        return
    stance = run.channel("stance")
    draw_force_arrows(axis, run, view, feet[now], force[now], [FORCE_COLOUR] * len(feet[now]))
    for leg, (x, y) in enumerate(view.project(feet[now])):
        loaded = np.linalg.norm(force[now, leg]) > 0.01 * run.weight
        if loaded or (stance is not None and stance[now, leg]):
            newtons, aside = _newtons(normal[now, leg]), 0.01 * view.size[0]
            _write_outlined(axis, x + aside, y, newtons, color=FORCE_TEXT, fontsize="small")


def _write_outlined(axis: Axes, x: float, y: float, words: str, **look: Any) -> None:
    """Write words with a white outline."""
    from matplotlib.patheffects import withStroke

    outline = [withStroke(linewidth=2.5, foreground="white")]
    axis.text(x, y, words, va="center", zorder=7, path_effects=outline, **look)


def draw_force_arrows(
    axis: Axes,
    source: Source,
    view: View,
    feet: Float[np.ndarray, "legs 3"],
    force: Float[np.ndarray, "legs 3"],
    colours: Sequence[str],
) -> list[Any]:
    """Draw forces above 1 % of the weight as arrows over a picture.

    Args:
        axis: Axes in pixels of the picture.
        source: Robot and experiment.
        view: The camera.
        feet: Positions in the world [m], shape (L, 3).
        force: Forces in world axes [N], shape (L, 3).
        colours: Colour of each arrow.

    Returns:
        The patches drawn.
    """
    from matplotlib.patches import Circle, FancyArrow

    pixel = view.size[0] / 1000
    tips = view.project(feet + force / source.weight * FORCE_LENGTH * source.hip_span)
    width: dict[str, Any] = {"width": 5.0 * pixel, "head_width": 14.0 * pixel, "linewidth": 1.0}
    drawn: list[Any] = []
    for start, way, size, colour in zip(
        view.project(feet),
        tips - view.project(feet),
        np.linalg.norm(force, axis=1),
        colours,
        strict=True,
    ):
        if size <= 0.01 * source.weight:
            continue
        look: dict[str, Any] = {"facecolor": colour, "edgecolor": "white", "zorder": 6}
        shape = width | {"head_length": min(16.0 * pixel, 0.6 * math.hypot(*way))}
        (x, y), (dx, dy) = start, way
        arrow = FancyArrow(x, y, dx, dy, length_includes_head=True, **shape, **look)
        # The dot marks a foot hidden behind the body.
        drawn += [axis.add_patch(arrow), axis.add_patch(Circle(start, 4.5 * pixel, **look))]
    return drawn


def _draw_gait(axis: Axes, run: Run, now: int) -> None:
    """Draw the gait diagram over four cycles around the moment."""
    reach = 2 * run.experiment.course.stride.period
    part = run.between(run.time[now] - reach, run.time[now] + reach)
    draw_bars(axis, part, tuple(range(1, len(run.robot.legs) + 1)))
    axis.axvline(run.time[now], color=FORCE_COLOUR, linewidth=1.6)
    time_axis(axis, part.time, "pale: planned stance, dark: contact")
