"""A picture of the robot walking, drawn without a graphics card."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid import kinematics
from phasmid.errors import InvalidInput
from phasmid.recording import Recording
from phasmid.reporting.camera import View
from phasmid.reporting.machine import arrow_mesh, body_pose, ribbon, robot_mesh
from phasmid.reporting.panels import Axes, drive_words
from phasmid.reporting.picture import picture
from phasmid.reporting.shapes import Mesh, cylinder, joined
from phasmid.reporting.source import Source, attribute, channel, finite_part, plain, read_source
from phasmid.reporting.steps import intervals
from phasmid.reporting.style import FAINT, Figure, leg_colour, styled

DPI = 150
AZIMUTH, ELEVATION = math.radians(-56.0), math.radians(27.0)
FORCE_COLOUR = "#e8590c"
FORCE_LENGTH = 1.2
"""Length of an arrow that bears the whole weight, in spans of the robot's hips."""


def can_be_drawn(recording: Recording) -> bool:
    """Whether the recording tells the robot's pose."""
    names = {str(name) for name in finite_part(recording).data_vars}
    posed = {"body_position", "body_orientation"} <= names
    return posed and bool(names & {"joint_position", "joint_position_target"})


def walk_picture(recording: Recording) -> Figure:
    """The robot in mid-walk, its feet's way behind it, and under it which legs stand when.

    Args:
        recording: With the body's pose and joint angles, seen or planned.

    Raises:
        InvalidInput: The recording lacks them.
    """
    source, recording = read_source(recording), finite_part(recording)
    return draw_robot(recording, telling_moment(recording, source), gait=True)


def telling_moment(recording: Recording, source: Source) -> float:
    """A time in the middle of the walk at which swinging feet are high [s]."""
    time = np.asarray(recording["time"].values)
    feet = channel(recording, "foot_position")
    middle = (time[0] + time[-1]) / 2
    near = np.flatnonzero(np.abs(time - middle) <= source.scenario.stride.period / 2)
    if feet is None or len(near) == 0:
        return float(middle)
    height = np.nan_to_num(feet[near, :, 2].sum(axis=1), nan=-np.inf)
    return float(time[near[np.argmax(height)]])


def draw_robot(
    recording: Recording, time: float, *, gait: bool = False, trail: float | None = None
) -> Figure:
    """The robot at one moment, with the forces on its feet.

    Args:
        recording: With the body's pose and joint angles, seen or planned.
        time: Of the nearest recorded sample [s].
        gait: Whether a diagram under the picture shows which legs stand when.
        trail: Time over which the feet's way is shown [s]; two cycles by default.

    Raises:
        InvalidInput: The recording lacks the body's pose or joint angles.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as NewFigure

    source, recording = read_source(recording), finite_part(recording)
    gait = gait and "stance" in recording.data_vars
    times = np.asarray(recording["time"].values)
    now = int(np.argmin(np.abs(times - time)))
    if trail is None:
        trail = 2 * source.scenario.stride.period
    wide, tall = 10.0, 5.4
    strip = 0.55 + 0.145 * len(source.robot.legs) if gait else 0.0
    size = (int(wide * DPI), int(tall * DPI))
    solid, flat, view, largest = _scene(recording, source, now, trail, size)
    with styled():
        figure = NewFigure(figsize=(wide, tall + strip), dpi=DPI)
        FigureCanvasAgg(figure)
        axis = figure.add_axes((0, strip / (tall + strip), 1, tall / (tall + strip)))
        axis.imshow(picture(solid, flat, view), interpolation="none", aspect="auto")
        axis.set_axis_off()
        _label_legs(axis, recording, source, view, now)
        top: dict[str, Any] = {"va": "top", "ha": "left", "transform": axis.transAxes}
        title = f"{plain(source.robot.name)}, {plain(source.gait.name)} gait"
        axis.text(0.025, 0.96, title, fontsize=14, fontweight="bold", **top)
        axis.text(
            0.025,
            0.905,
            _about(recording, source, times[now], largest),
            fontsize=8.5,
            color=FAINT,
            linespacing=1.5,
            **top,
        )
        if gait:
            place = (0.075, 0.40 / (tall + strip), 0.89, (strip - 0.52) / (tall + strip))
            _gait_diagram(figure.add_axes(place), recording, source, now)
    return figure


def _about(recording: Recording, source: Source, time: float, largest: float) -> str:
    stride = source.scenario.stride
    lines = [drive_words(recording, source), f"t = {time:.2f} s"]
    lines[1] += f" · step {1000 * stride.step_length:.4g} mm · grid 100 mm"
    if largest > 0:
        seen = "foot_force" in recording.data_vars
        what = "ground on foot" if seen else f"{attribute(recording, 'force_model')} forces"
        lines.append(f"arrows: {what}, {largest:.3g} N the longest")
    return "\n".join(lines)


def _pose(recording: Recording, now: int) -> tuple[np.ndarray, np.ndarray]:
    """Pose of the body and joint angles."""
    position = channel(recording, "body_position")
    orientation = channel(recording, "body_orientation")
    angles = channel(recording, "joint_position")
    if angles is None:
        angles = channel(recording, "joint_position_target")
    if position is None or orientation is None or angles is None:
        lacking = "joint_position" if angles is None else "body_position and body_orientation"
        raise InvalidInput(f"the recording has no {lacking}; this picture needs it.")
    return body_pose(position[now], orientation[now]), angles[now]


def _scene(
    recording: Recording, source: Source, now: int, trail: float, size: tuple[int, int]
) -> tuple[Mesh, Mesh, View, float]:
    """The robot, its trails and arrows, the camera, and the largest force [N]."""
    X_world_body, q = _pose(recording, now)
    solid = robot_mesh(source.robot, q, X_world_body)
    view = _view(solid, X_world_body, size)
    span = float(np.ptp(source.robot.arrays.p_body_hip[:, :2], axis=0).max())
    marks = _trails(recording, now, trail, view, 0.012 * span)
    force = channel(recording, "foot_force")
    force = channel(recording, "foot_force_model") if force is None else force
    feet = channel(recording, "foot_position")
    largest = 0.0
    if force is not None and feet is not None:
        sizes = np.linalg.norm(force[now], axis=-1)
        largest = float(sizes.max())
        for foot, vector, amount in zip(feet[now], force[now], sizes, strict=True):
            if amount > 0.01 * source.weight:
                arrow = vector / source.weight * FORCE_LENGTH * span
                marks.append(arrow_mesh(foot, arrow, 0.010 * span, FORCE_COLOUR))
    return solid, joined([*marks, _nothing()]), view, largest


def _nothing() -> Mesh:
    return Mesh(np.zeros((0, 3, 3)), np.zeros((0, 3)))


def _view(solid: Mesh, X_world_body: np.ndarray, size: tuple[int, int]) -> View:
    """A camera before the robot's right side that holds all of it."""
    yaw = math.atan2(X_world_body[1, 0], X_world_body[0, 0])
    a, e = yaw + AZIMUTH, ELEVATION
    back = np.array([math.cos(a) * math.cos(e), math.sin(a) * math.cos(e), math.sin(e)])
    right = np.array([-math.sin(a), math.cos(a), 0.0])
    axes = np.stack([right, np.cross(back, right), back])
    points = solid.corners.reshape(-1, 3)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = float(np.linalg.norm(points - middle, axis=1).max())
    view = View(middle + 5.0 * radius * back, axes, 1.0, size, (0.0, 0.0))
    # The picture is enlarged and shifted until the robot fills what the words leave free.
    seen = view.project(points)[:, :2]
    low, high = seen.min(axis=0), seen.max(axis=0)
    width, height = size
    focal = float(min(0.80 * width / (high - low)[0], 0.78 * height / (high - low)[1]))
    centre = focal * (low + high) / 2
    shift = (0.53 * width - float(centre[0]), 0.54 * height - float(centre[1]))
    return View(view.eye, axes, focal, size, shift)


def _trails(recording: Recording, now: int, trail: float, view: View, width: float) -> list[Mesh]:
    """The ways of the feet until now, and a disc where each foot stood."""
    feet, stance = channel(recording, "foot_position"), channel(recording, "stance")
    times = np.asarray(recording["time"].values)
    if feet is None:
        return []
    start = int(np.searchsorted(times, times[now] - trail))
    chosen = np.unique(np.linspace(start, now, 240).astype(int))
    marks = []
    for leg in range(feet.shape[1]):
        if len(chosen) > 1:
            marks.append(ribbon(feet[chosen, leg], view.eye, width, leg_colour(leg)))
        for first, stop in [] if stance is None else intervals(stance[start : now + 1, leg]):
            place: Float[np.ndarray, "3"] = feet[start + first : start + stop, leg].mean(axis=0)
            ends = place, place + np.array([0.0, 0.0, 0.0008])
            marks.append(cylinder(*ends, (1.8 * width, 1.8 * width), leg_colour(leg), sides=20))
    return marks


def _label_legs(axis: Axes, recording: Recording, source: Source, view: View, now: int) -> None:
    """Numbers of the legs over their knees."""
    from matplotlib.patheffects import withStroke

    X_world_body, q = _pose(recording, now)
    span = float(np.ptp(source.robot.arrays.p_body_hip[:, :2], axis=0).max())
    knees = []
    for limb, angles in zip(source.robot.legs, q, strict=True):
        X_body_knee = limb.X_body_hip @ kinematics.leg_frames(limb, angles)[2]
        knees.append((X_world_body @ X_body_knee)[:3, 3] + [0.0, 0.0, 0.13 * span])
    spots = np.array(knees)
    for leg, (across, down, _) in enumerate(view.project(spots)):
        axis.text(
            across,
            down,
            str(leg + 1),
            color=leg_colour(leg),
            fontsize=13,
            fontweight="bold",
            ha="center",
            va="center",
            path_effects=[withStroke(linewidth=3, foreground="white")],
        )


def _gait_diagram(axis: Axes, recording: Recording, source: Source, now: int) -> None:
    """Which legs stand, over four cycles about the moment."""
    times = np.asarray(recording["time"].values)
    stance: Any = channel(recording, "stance")
    reach = 2 * source.scenario.stride.period
    first, last = np.searchsorted(times, [times[now] - reach, times[now] + reach + 1e-9])
    count = stance.shape[1]
    for leg in range(count):
        bars = []
        for start, stop in intervals(stance[first:last, leg]):
            until = times[min(first + stop, last - 1, len(times) - 1)]
            bars.append((times[first + start], until - times[first + start]))
        axis.broken_barh(bars, (leg - 0.36, 0.72), color=leg_colour(leg), linewidth=0)
    axis.axvline(times[now], color=FORCE_COLOUR, linewidth=1.6)
    axis.set_ylim(count - 0.5, -0.5)
    axis.set_yticks(range(count), [f"leg {leg + 1}" for leg in range(count)])
    for label, leg in zip(axis.get_yticklabels(), range(count), strict=True):
        label.set_color(leg_colour(leg))
    axis.tick_params(axis="y", length=0)
    axis.grid(visible=False, axis="y")
    axis.spines["left"].set_visible(False)
    if last - first > 1:
        axis.set_xlim(times[first], times[last - 1])
    axis.set_xlabel("time [s]   (bars: stance)", labelpad=1)
