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
from phasmid.reporting.layout import NORMAL_WIDTH, layout, points
from phasmid.reporting.machine import body_pose, ribbon, robot_mesh
from phasmid.reporting.picture import picture
from phasmid.reporting.shapes import Mesh, cylinder, joined
from phasmid.reporting.sheet import Axes, drive_words, short
from phasmid.reporting.source import Source, attribute, channel, finite_part, read_source
from phasmid.reporting.steps import intervals
from phasmid.reporting.style import FAINT, Figure, leg_colour, shrunk, styled
from phasmid.robot import Appearance

WIDTH, DPI = 10.0, 120
"""Width of the picture unless another is set [inches], and its pixels per inch at that width."""

AZIMUTH, ELEVATION = math.radians(-56.0), math.radians(27.0)
UNEVEN_AZIMUTH = math.radians(-118.0)
"""From where uneven ground is seen: from behind, whence stairs show their risers."""

UNEVEN_SHARE = 0.78
"""Size of the robot over that on level ground, so that more of uneven ground is seen."""

FORCE_COLOUR, FORCE_TEXT = "#e8590c", "#a33c05"
FORCE_LENGTH = 1.2
"""Length of an arrow that bears the whole weight, in spans of the robot's hips."""

ENDINGS = {"FELL": "fell", "DIVERGED": "diverged", "STOPPED": "stopped", "CUT": "cut off"}
"""How a recording ended that was not completed, for the caption."""


def can_be_drawn(recording: Recording) -> bool:
    """Whether the recording tells the robot's pose."""
    names = {str(name) for name in finite_part(recording).data_vars}
    posed = {"body_position", "body_orientation"} <= names
    return posed and bool(names & {"joint_position", "joint_position_target"})


def walk_picture(recording: Recording, appearance: Appearance | None = None) -> Figure:
    """The robot in mid-walk, its feet's way behind it, and under it which legs stand when.

    Args:
        recording: With the body's pose and joint angles, seen or planned.
        appearance: The robot's meshes, where they do not come with phasmid.

    Raises:
        InvalidInput: The recording lacks them.
    """
    source, recording = read_source(recording), finite_part(recording)
    moment = telling_moment(recording, source)
    return draw_robot(recording, moment, gait=True, appearance=appearance)


def telling_moment(recording: Recording, source: Source) -> float:
    """A time in the middle of the walk at which swinging feet are high [s]."""
    time = np.asarray(recording["time"].values)
    feet = channel(recording, "foot_position")
    middle = (time[0] + time[-1]) / 2
    near = np.flatnonzero(np.abs(time - middle) <= source.scenario.stride.period / 2)
    if feet is None or len(near) == 0:
        return float(middle)
    x, y, z = np.moveaxis(feet[near], -1, 0)
    height = np.nan_to_num(
        (z - source.scenario.load_terrain().height(x, y)).sum(axis=1), nan=-np.inf
    )
    return float(time[near[np.argmax(height)]])


def draw_robot(
    recording: Recording,
    time: float,
    *,
    gait: bool = False,
    trail: float | None = None,
    appearance: Appearance | None = None,
) -> Figure:
    """The robot at one moment, with the forces on its feet.

    Args:
        recording: With the body's pose and joint angles, seen or planned.
        time: Of the nearest recorded sample [s].
        gait: Whether a diagram under the picture shows which legs stand when.
        trail: Time over which the feet's way is shown [s]; two cycles by default.
        appearance: The robot's meshes, where they do not come with phasmid.

    Raises:
        InvalidInput: The recording lacks the body's pose or joint angles.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as NewFigure

    from phasmid.reporting.raster import Raster

    source, recording = read_source(recording, appearance), finite_part(recording)
    gait = gait and "stance" in recording.data_vars
    times = np.asarray(recording["time"].values)
    now = int(np.argmin(np.abs(times - time)))
    if trail is None:
        trail = 2 * source.scenario.stride.period
    page = layout()
    wide = WIDTH if page.width == NORMAL_WIDTH else page.width
    # However wide it is, the picture has as many pixels.
    tall, dpi = 0.54 * wide, DPI * WIDTH / wide
    # Of whole pixels, so that those of the picture above it are those of the file.
    strip = points(0.55 + 0.145 * len(source.robot.legs))
    strip = round(strip * dpi) / dpi if gait else 0.0
    size = (round(wide * dpi), round(tall * dpi))
    with styled():
        figure = NewFigure(figsize=(wide, tall + strip), dpi=dpi)
        FigureCanvasAgg(figure)
        axis = figure.add_axes((0, strip / (tall + strip), 1, tall / (tall + strip)))
        axis.set_axis_off()
        axis.set(xlim=(0, size[0]), ylim=(size[1], 0))
        lowest = _words(axis, recording, source, now) if page.title else (0.0, 0.0)
        solid, view = _solid(recording, source, now, size)
        marks = _trails(recording, source, now, trail, view, lowest)
        terrain = source.scenario.load_terrain()
        seen = picture(solid, joined([*marks, _nothing()]), view, terrain)
        Raster(axis, np.rint(255 * seen).astype(np.uint8))
        _draw_forces(axis, recording, source, view, now)
        _label_legs(axis, recording, source, view, now)
        if gait:
            left, below = points(0.75) / wide, points(0.40) / (tall + strip)
            height = (strip - points(0.52)) / (tall + strip)
            place = (left, below, 0.965 - left, height)
            _gait_diagram(figure.add_axes(place), recording, source, now)
    return figure


def _words(axis: Axes, recording: Recording, source: Source, now: int) -> tuple[float, float]:
    """Write title and caption; returns their right and lower edge, in pixels of the picture."""
    top: dict[str, Any] = {"va": "top", "ha": "left", "transform": axis.transAxes}
    words = f"{short(source.robot.name)}, {short(source.gait.name)} gait"
    title = axis.text(0.025, 0.96, words, fontsize=points(14), fontweight="bold", **top)
    shrunk(title, 0.95 * float(axis.bbox.width), least=points(9.0))
    stride, time = source.scenario.stride, float(recording["time"].values[now])
    lines = [drive_words(recording, source), f"t = {time:.2f} s"]
    lines[1] += f" · step {1000 * stride.step_length:.4g} mm · grid 100 mm"
    ending = ENDINGS.get(attribute(recording, "ending"))
    if ending:
        lines.append(f"{ending} at {float(recording['time'].values[-1]):.2f} s")
    if source.scenario.terrain.kind != "flat":
        lines.insert(0, f"terrain: {source.scenario.terrain.kind}")
    forces = _forces(recording, now)
    if forces is not None:
        seen = "foot_force" in recording.data_vars
        what = "ground on foot" if seen else f"{short(attribute(recording, 'force_model'))} forces"
        lines.append(f"arrows: {what}; {_newtons(forces[2].max())} the largest normal force")
    # A line in heights of the picture.
    line_height = points(12.6) / 72 * float(axis.figure.dpi) / float(axis.bbox.height)
    low = 0.96 - 1.7 * line_height
    edges = [title.get_window_extent()]
    for line in lines:
        text = axis.text(0.025, low, line, fontsize=points(8.5), color=FAINT, **top)
        shrunk(text, 0.38 * float(axis.bbox.width), least=points(6.0))
        low -= line_height
        edges.append(text.get_window_extent())
    box = axis.bbox
    scale = axis.get_xlim()[1] / float(box.width)
    right = max(float(edge.x1 - box.x0) for edge in edges)
    below = max(float(box.y1 - edge.y0) for edge in edges)
    return scale * right, scale * below


def _forces(recording: Recording, now: int) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Places of the feet [m], forces on them and their normal parts [N]; seen, or the model's."""
    feet = channel(recording, "foot_position")
    for ending in ("", "_model"):
        force = channel(recording, f"foot_force{ending}")
        if force is not None and feet is not None:
            normal = channel(recording, f"foot_normal_force{ending}")
            return feet[now], force[now], force[now][:, 2] if normal is None else normal[now]
    return None


def _newtons(force: float) -> str:
    if force < 0.05:
        return "0 N"
    return f"{force:#.3g} N" if force < 99.95 else f"{force:.0f} N"


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


def _solid(
    recording: Recording, source: Source, now: int, size: tuple[int, int]
) -> tuple[Mesh, View]:
    """The robot, and the camera before it."""
    X_world_body, q = _pose(recording, now)
    solid = robot_mesh(source.robot, q, X_world_body)
    if source.scenario.load_terrain().is_level:
        return solid, _view(solid, X_world_body, size, AZIMUTH)
    return solid, _view(solid, X_world_body, size, UNEVEN_AZIMUTH, UNEVEN_SHARE)


def _span(source: Source) -> float:
    """The longer side of the rectangle of the hips [m], by which marks are sized."""
    return float(np.ptp(source.robot.arrays.p_body_hip[:, :2], axis=0).max())


def _nothing() -> Mesh:
    return Mesh(np.zeros((0, 3, 3)), np.zeros((0, 3)))


def _view(
    solid: Mesh,
    X_world_body: np.ndarray,
    size: tuple[int, int],
    azimuth: float,
    share: float = 1.0,
) -> View:
    """A camera before the robot's right side that holds all of it."""
    yaw = math.atan2(X_world_body[1, 0], X_world_body[0, 0])
    a, e = yaw + azimuth, ELEVATION
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
    focal = share * float(min(0.80 * width / (high - low)[0], 0.78 * height / (high - low)[1]))
    centre = focal * (low + high) / 2
    shift = (0.53 * width - float(centre[0]), 0.54 * height - float(centre[1]))
    return View(view.eye, axes, focal, size, shift)


def _trails(
    recording: Recording,
    source: Source,
    now: int,
    trail: float,
    view: View,
    words: tuple[float, float],
) -> list[Mesh]:
    """The ways of the feet until now, and a disc where each foot stood.

    Each way begins where it last came into the picture, or from behind the words in its corner.
    """
    feet, stance = channel(recording, "foot_position"), channel(recording, "stance")
    times = np.asarray(recording["time"].values)
    if feet is None:
        return []
    width = 0.012 * _span(source)
    start = int(np.searchsorted(times, times[now] - trail))
    seen = view.project(feet[start : now + 1])
    free = _inside(seen, view, words)
    marks = []
    for leg in range(feet.shape[1]):
        hidden = np.flatnonzero(~free[:, leg])
        first = start + (int(hidden[-1]) + 1 if len(hidden) else 0)
        if first < now:
            chosen = np.unique(np.linspace(first, now, 240).astype(int))
            marks.append(ribbon(feet[chosen, leg], view.eye, width, leg_colour(leg)))
        for begin, stop in [] if stance is None else intervals(stance[first : now + 1, leg]):
            place: Float[np.ndarray, "3"] = feet[first + begin : first + stop, leg].mean(axis=0)
            ends = place, place + np.array([0.0, 0.0, 0.0008])
            marks.append(cylinder(*ends, (1.8 * width, 1.8 * width), leg_colour(leg), sides=20))
    return marks


def _inside(seen: np.ndarray, view: View, words: tuple[float, float]) -> np.ndarray:
    """Which projected points lie well in the picture and clear of the words in its corner."""
    (width, height), gap = view.size, 0.02 * view.size[0]
    across, down = seen[..., 0], seen[..., 1]
    within = (across > gap) & (across < width - gap) & (down > gap) & (down < height - gap)
    return within & ~((across < words[0] + gap) & (down < words[1] + gap))


def _draw_forces(axis: Axes, recording: Recording, source: Source, view: View, now: int) -> None:
    """Arrows from the feet, over everything, and the normal force beside each foot that bears."""
    from matplotlib.patches import FancyArrow
    from matplotlib.patheffects import withStroke

    forces = _forces(recording, now)
    if forces is None:
        return
    stance = channel(recording, "stance")
    pixel = view.size[0] / 1000
    for leg, (foot, force, normal) in enumerate(zip(*forces, strict=True)):
        tip = foot + force / source.weight * FORCE_LENGTH * _span(source)
        (x, y), (to_x, to_y) = view.project(np.stack([foot, tip]))[:, :2]
        bears = float(np.linalg.norm(force)) > 0.01 * source.weight
        if bears:
            shape: dict[str, Any] = {
                "width": 5.0 * pixel,
                "head_width": 14.0 * pixel,
                "head_length": min(16.0 * pixel, 0.6 * math.hypot(to_x - x, to_y - y)),
                "length_includes_head": True,
            }
            look: dict[str, Any] = {"facecolor": FORCE_COLOUR, "edgecolor": "white"}
            arrow = FancyArrow(x, y, to_x - x, to_y - y, linewidth=1.0, **look, **shape)
            axis.add_patch(arrow)
            # A dot tells where the foot is that the body hides.
            axis.plot(x, y, "o", color=FORCE_COLOUR, markersize=5, markeredgecolor="white")
        if bears or (stance is not None and stance[now, leg]):
            axis.text(
                x + 10 * pixel,
                y + 4 * pixel,
                _newtons(normal),
                color=FORCE_TEXT,
                fontsize=points(8.5),
                va="center",
                path_effects=[withStroke(linewidth=2.5, foreground="white")],
            )


def _label_legs(axis: Axes, recording: Recording, source: Source, view: View, now: int) -> None:
    """Numbers of the legs over their knees."""
    from matplotlib.patheffects import withStroke

    X_world_body, q = _pose(recording, now)
    span = _span(source)
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
            fontsize=points(13),
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
