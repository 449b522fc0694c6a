"""Figures over time: joints, feet, gait, support, friction, power and sensors.

Each function draws runs, cut to the part that is shown, for some legs, numbered from 1. One run
has all its lines; several are compared, with a line each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from phasmid.kinematics import quaternion_rotation
from phasmid.recording.channels import CHANNELS, JOINTS
from phasmid.reporting.numbers import (
    cost_of_transport,
    joint_power,
    margin_over_time,
    torque_and_speed,
    travel,
)
from phasmid.reporting.panels import Axes, Entry, Panels, listed_legs, shade, spans, time_axis
from phasmid.reporting.run import Run, shared_caption, shown_part
from phasmid.reporting.steps import durations
from phasmid.reporting.style import (
    FAINT,
    INK,
    JOINT_COLOURS,
    LACKING_COLOUR,
    LIMIT_COLOUR,
    STANCE_COLOUR,
    Figure,
    Layout,
    darker,
    leg_colour,
    paler,
)

Legs = tuple[int, ...]

DEGREES = float(np.degrees(1.0))


def run_entries(runs: Sequence[Run]) -> list[Entry]:
    """Return a legend's entry for each run."""
    return [(run.label, run.line) for run in runs]


def leg_entries(run: Run, legs: Legs) -> list[Entry]:
    """Return a legend's entry for each leg."""
    return [(run.leg_name(leg), {"color": leg_colour(leg - 1)}) for leg in legs]


@dataclass(frozen=True)
class Quantity:
    """A quantity of joints or feet.

    Attributes:
        title: Title of its figure.
        label: Label of the vertical axis, with the unit.
        channels: The simulated or recorded channel, then the computed one; one suffices.
        scale: Factor from the channel's unit to the figure's.
        computed: Word for the computed channel in the legend.
    """

    title: str
    label: str
    channels: tuple[str, ...]
    scale: float = 1.0
    computed: str = "model"


ANGLES = Quantity(
    "Joint angles",
    "angle [°]",
    ("joint_position", "joint_position_target"),
    DEGREES,
    "planned",
)
TORQUES = Quantity("Joint torques", "torque [N·m]", ("joint_torque", "joint_torque_model"))
FORCES = Quantity("Normal forces", "force [N]", ("foot_normal_force", "foot_normal_force_model"))
SERVO_QUANTITIES = (
    Quantity("Servo output", "output [%]", ("servo_duty",), 100.0),
    Quantity("Servo current", "current [A]", ("servo_current",)),
    Quantity("Servo temperature", "temperature [°C]", ("servo_temperature",)),
)

MODEL_DASH = (0, (3.2, 1.8))


def quantity_figure(runs: Sequence[Run], legs: Legs, layout: Layout, quantity: Quantity) -> Figure:
    """Draw a quantity, a row of panels for each leg.

    A single run has the joints' lines in one panel, simulated and computed; of several, each joint
    has a panel with a line for each run. The angles of the coxa, which turns by some degrees, have
    a panel of their own.
    """
    alone, run = len(runs) == 1, runs[0]
    groups: tuple[tuple[int, ...], ...] = ((0, 1, 2),) if alone else ((0,), (1,), (2,))
    if quantity is FORCES:
        groups = ((0,),)
    elif quantity is ANGLES and alone:
        groups = ((0,), (1, 2))
    used = [[name for name in quantity.channels if one.has(name)] for one in runs]
    drawing = Panels(
        layout,
        [1.6 if alone else 1.3] * len(legs),
        columns=len(groups),
        share_y="col" if quantity is ANGLES else True,
    )
    stance = run.channel("stance") if alone else None
    for leg, row in zip(legs, drawing.rows, strict=True):
        for axis, joints in zip(row, groups, strict=True):
            words = [run.leg_title(leg, layout)] if axis is row[0] else []
            words += [" and ".join(JOINTS[j] for j in joints)] if len(groups) > 1 else []
            axis.set_title(": ".join(words))
            if stance is not None:
                shade(axis, run.time, stance[:, leg - 1], STANCE_COLOUR)
            for one, names in zip(runs, used, strict=True):
                for name in names if alone else names[:1]:
                    values = one.recording[name].values
                    values = quantity.scale * values.reshape(*values.shape[:2], -1)
                    for joint in joints:
                        colour = leg_colour(leg - 1) if quantity is FORCES else JOINT_COLOURS[joint]
                        line = _line(colour, name == names[0], len(names)) if alone else one.line
                        # A single sample makes no line.
                        mark = "o" if len(one.time) == 1 else ""
                        axis.plot(one.time, values[:, leg - 1, joint], marker=mark, **line)
        row[0].set_ylabel(quantity.label)
    for axis in row:
        shaded = axis is row[0] and stance is not None
        time_axis(axis, run.time, "shaded: stance" if shaded else "")
    title = quantity.title
    if quantity is ANGLES and not any(one.has("joint_position") for one in runs):
        title = "Planned joint angles"
    notes = _conditions(runs, quantity, [names[0] for names in used])
    return drawing.complete(
        f"{title} of {listed_legs(legs)}",
        [*shared_caption(runs), *notes],
        _quantity_entries(run, quantity, used[0]) if alone else run_entries(runs),
        columns=0 if alone else 1,
    )


def _conditions(runs: Sequence[Run], quantity: Quantity, used: Sequence[str]) -> list[str]:
    """Return what a figure's subtitle says of its quantity."""
    run = runs[0]
    if len(runs) > 1:
        return [" or ".join(dict.fromkeys(CHANNELS[name].long_name for name in used))]
    if quantity in SERVO_QUANTITIES:
        return [f"{run.robot.servo.voltage:g} V"]
    weight = f"weight {run.weight:.4g} N" if quantity is FORCES else ""
    return [run.model_words if quantity is not ANGLES else "", weight]


def _line(colour: str, is_first: bool, count: int) -> dict[str, Any]:
    """Return the look of a line, or of the computed one dashed and darker on top of it."""
    if is_first:
        return {"color": colour, "linewidth": 1.9 if count > 1 else 1.5}
    return {"color": darker(colour), "linewidth": 1.1, "linestyle": MODEL_DASH}


def _quantity_entries(run: Run, quantity: Quantity, used: Sequence[str]) -> list[Entry]:
    """Return the legend of a single run: joints, then simulated and computed lines."""
    entries: list[Entry] = []
    if quantity is not FORCES:
        entries = [(name, {"color": c}) for name, c in zip(JOINTS, JOINT_COLOURS, strict=True)]
    if len(quantity.channels) > 1:
        seen = "simulated" if run.is_simulated else "recorded"
        is_seen = used[0] == quantity.channels[0]
        entries.append((seen if is_seen else quantity.computed, {"color": FAINT}))
    if len(used) > 1:
        dashed = {"color": INK, "linestyle": MODEL_DASH}
        entries.append((f"{quantity.computed} (darker)", dashed))
    return entries


def gait_diagram(runs: Sequence[Run], legs: Legs, layout: Layout) -> Figure:
    """Draw bars of each leg's planned stance and, narrower and darker, of its contact."""
    run = runs[0]
    drawing = Panels(layout, [0.27 * len(legs) + 0.3], left=1.35)
    draw_bars(drawing.axes[0], run, legs)
    time_axis(drawing.axes[0], run.time)
    entries: list[Entry] = [
        (words, {"color": colour, "linewidth": 6.0})
        for name, words, colour in (
            ("stance", "planned stance", paler(FAINT)),
            ("contact", "recorded contact", FAINT),
        )
        if run.has(name)
    ]
    return drawing.complete("Gait diagram", [*run.caption, _agreement(run, legs)], entries)


def _agreement(run: Run, legs: Legs) -> str:
    """Return the share of the time, over these legs, in which contact and stance are equal."""
    stance, contact = run.channel("stance"), run.channel("contact")
    if stance is None or contact is None:
        return ""
    share = durations(run.time) / durations(run.time).sum()
    equal = float(share @ (stance == contact)[:, [leg - 1 for leg in legs]].mean(axis=1))
    return f"contact {100 * equal:.1f} % as planned"


def draw_bars(axis: Axes, run: Run, legs: Legs) -> None:
    """Draw the bars of legs, numbered from 1, in a panel."""
    for name, height in (("stance", 0.76), ("contact", 0.34)):
        down = run.channel(name)
        if down is None:
            continue
        for row, leg in enumerate(legs):
            colour = leg_colour(leg - 1)
            axis.broken_barh(
                spans(run.time, down[:, leg - 1]),
                (row - height / 2, height),
                color=paler(colour) if name == "stance" else colour,
                linewidth=0,
            )
    axis.set_ylim(len(legs) - 0.5, -0.5)
    axis.set_yticks(np.arange(len(legs)), [run.leg_name(leg) for leg in legs])
    for label, leg in zip(axis.get_yticklabels(), legs, strict=True):
        label.set_color(leg_colour(leg - 1))
    axis.tick_params(axis="y", length=0)
    axis.grid(visible=False, axis="y")
    axis.spines["left"].set_visible(False)


STANDING = {"contact": "feet in contact", "stance": "feet in planned stance"}


def support_figure(runs: Sequence[Run], legs: Legs, layout: Layout) -> Figure:
    """Draw the distance of the centre of mass from the edge of the support polygon.

    All legs count. A single run has a line of its contacts and one of its planned stance.
    """
    del legs
    alone, entries, reference = len(runs) == 1, [], set()
    drawing = Panels(layout, [2.6])
    axis = drawing.axes[0]
    for run in runs:
        known = [name for name in STANDING if run.has(name)]
        for number, name in enumerate(known if alone else known[:1]):
            margin, what = margin_over_time(run, name)
            reference.add(what)
            line = run.line
            if alone:
                line = {"color": JOINT_COLOURS[2 * number], "linestyle": ("-", MODEL_DASH)[number]}
            defined = np.where(np.isfinite(margin), 1000 * margin, np.nan)
            axis.plot(run.time, defined, **line)
            entries.append((STANDING[name] if alone else run.label, line))
            if number == 0:
                first = margin
    undefined = ~np.isfinite(first) & alone
    shade(axis, runs[0].time, undefined, LACKING_COLOUR)
    axis.axhline(0.0, color=LIMIT_COLOUR, linewidth=1.0)
    axis.set_ylabel("margin [mm]")
    time_axis(axis, runs[0].time, "shaded: fewer than three feet" if undefined.any() else "")
    least = _least_margin(runs[0], first) if alone else ""
    notes = [*shared_caption(runs), f"of the {' or the '.join(sorted(reference))}", least]
    return drawing.complete("Support margin", notes, entries, columns=0 if alone else 1)


def _least_margin(run: Run, margin: np.ndarray) -> str:
    finite = np.where(np.isfinite(margin), margin, np.inf)
    at = int(np.argmin(finite))
    if not np.isfinite(finite[at]):
        return "never three feet on the ground"
    while_three = "" if np.isfinite(margin).all() else " while three feet stand"
    return f"least {1000 * margin[at]:.1f} mm at {run.time[at]:.2f} s{while_three}"


LEAST_LOAD = 0.02
"""Share of the weight below which a foot has no demand: the ratio of two forces near zero, as at
touchdown, is meaningless."""

LIMIT_LINE: dict[str, Any] = {
    "color": LIMIT_COLOUR,
    "linewidth": 1.1,
    "linestyle": (0, (5, 1.6)),
}


def friction_figure(runs: Sequence[Run], legs: Legs, layout: Layout) -> Figure:
    """Draw tangential over normal force of each stance foot, and the coefficient of friction."""
    found = [friction_demand(run) for run in runs]
    alone, run = len(runs) == 1, runs[0]
    columns = 2 if len(legs) > 1 else 1
    drawing = Panels(layout, [1.35] * -(-len(legs) // columns), columns=columns)
    stance = run.channel("stance") if alone else None
    for axis, leg in zip(drawing.axes, legs, strict=False):
        axis.set_title(run.leg_title(leg, layout))
        if stance is not None:
            shade(axis, run.time, stance[:, leg - 1], STANCE_COLOUR)
        for one, (demand, limit) in zip(runs, found, strict=True):
            line = {"color": leg_colour(leg - 1)} if alone else one.line
            axis.plot(one.time, demand[:, leg - 1], **line)
            axis.plot(one.time, limit[:, leg - 1], **LIMIT_LINE)
    for row in drawing.rows:
        row[0].set_ylabel("demand [1]")
    for axis in drawing.axes[len(legs) :]:
        axis.set_visible(False)
    for axis in drawing.axes[: len(legs)][-columns:]:
        time_axis(axis, run.time)
        axis.tick_params(labelbottom=True)
    drawing.axes[0].set_ylim(bottom=0.0)
    entries: list[Entry] = run_entries(runs)
    if alone:
        words = "tangential over normal force" + ("" if run.has("foot_force") else " of the model")
        entries = [(words, {"color": leg_colour(0)})]
    entries.append(("coefficient of friction", LIMIT_LINE))
    if stance is not None:
        entries.append(("planned stance", {"color": STANCE_COLOUR, "linewidth": 6.0}))
    threshold = f"stances under at least {LEAST_LOAD * run.weight:.2g} N" if alone else ""
    return drawing.complete(
        f"Friction demand of {listed_legs(legs)}",
        [*shared_caption(runs), threshold],
        entries,
        columns=0 if alone else 1,
    )


def friction_demand(run: Run) -> tuple[np.ndarray, np.ndarray]:
    """Return tangential over normal force on stance feet, and the coefficient of friction.

    Args:
        run: A run with foot positions and forces, recorded or of the model.

    Returns:
        Demand, NaN where the foot does not stand or its normal force is below `LEAST_LOAD` of the
        weight; static coefficient of friction under each foot; both of shape (N, L).

    Raises:
        InvalidInput: The normal force is not recorded.
    """
    force, normal, standing = run.foot_force, run.normal_force, run.channel("stance", "contact")
    if force is None or normal is None or standing is None:
        raise run.absent(("foot_normal_force",), "the friction demand")
    # Round-off may leave less than zero.
    tangential = np.sqrt(np.maximum(np.sum(force**2, axis=-1) - normal**2, 0.0))
    loaded = standing & (normal >= LEAST_LOAD * run.weight)
    demand = np.where(loaded, tangential / np.where(loaded, normal, 1.0), np.nan)
    x, y, _ = np.moveaxis(run.recording["foot_position"].values, -1, 0)
    return demand, run.experiment.world.terrain.friction(x, y)


POWER_LINES: dict[str, Entry] = {
    "given": ("given: Σ max(τω, 0)", {"color": "#004488"}),
    "friction": ("friction of the servos", {"color": "#228833", "linestyle": "--"}),
    "electrical": ("electrical, from the supply", {"color": "#d9a21b"}),
}
"""Label and look of each kind of power."""


def power_figure(runs: Sequence[Run], legs: Legs, layout: Layout) -> Figure:
    """Draw the power of all joints together and, under it, its integral since the start.

    A single run has a line of every kind of power; several have that of their positive power.
    Energy counts from the start of the whole runs.
    """
    del legs
    parts, note = shown_part(runs)
    alone, entries, costs = len(runs) == 1, [], []
    drawing = Panels(replace(layout, note=note), [1.9, 1.9], share_y=False)
    for run, whole in zip(parts, runs, strict=True):
        rows = np.searchsorted(whole.time, run.time)
        way = travel(whole).get("distance")
        kinds = joint_power(whole)
        for name, power in kinds.items():
            energy = cumulative_trapezoid(power, whole.time, initial=0)
            transport = cost_of_transport(whole, float(energy[-1]), way)
            cost = "unknown" if transport is None else f"{transport:.2f}"
            label, line = POWER_LINES[name]
            if name in ("given", "electrical"):
                costs.append(f"{cost} ({'mechanical' if name == 'given' else name})")
            if not alone:
                if name != "given":
                    continue
                line, label = run.line, f"{run.label} · mechanical cost of transport {cost}"
            for axis, values in zip(drawing.axes, (power, energy), strict=True):
                axis.plot(run.time, values[rows], **line)
            entries.append((label, line))
    given = "" if alone else " given"
    drawing.axes[0].set_ylabel(f"power{given} [W]")
    drawing.axes[1].set_ylabel(f"energy{given} [J]")
    time_axis(drawing.axes[1], parts[0].time)
    cost = f"cost of transport {', '.join(costs)}" if alone else ""
    model = " by the model" if torque_and_speed(runs[0])[2].endswith("_model") else ""
    return drawing.complete(
        f"Power and energy of all joints{model}",
        [*shared_caption(parts), cost],
        entries,
        columns=0 if alone else 1,
    )


LEG, FEMUR, Y, Z = 0, 1, 1, 2

SENSORS: tuple[tuple[str, str, str, tuple[int, ...], float], ...] = (
    ("femur [°]", "joint_position_measured", "joint_position", (LEG, FEMUR), DEGREES),
    ("femur load [1]", "joint_load_measured", "servo_duty", (LEG, FEMUR), 1.0),
    ("foot [N]", "foot_normal_force_measured", "foot_normal_force", (LEG,), 1.0),
    ("gyro y [°/s]", "imu_angular_velocity", "body_angular_velocity", (Y,), DEGREES),
    ("acc. z [m/s²]", "imu_acceleration", "", (Z,), 1.0),
)
"""Label, measured and true channel, index of the value that is drawn, and its scale."""

SENSOR_CHANNELS = tuple(measured for _, measured, *_ in SENSORS)
"""Measured channels that are drawn; one suffices."""

TRUE_LINE: dict[str, Any] = {"color": "#b9bec7", "linewidth": 2.4}
MEASURED_LINE: dict[str, Any] = {"color": darker(JOINT_COLOURS[1]), "linewidth": 1.0}


def sensor_figure(runs: Sequence[Run], legs: Legs, layout: Layout) -> Figure:
    """Draw measured over true values of leg 1 and the body in the last cycle of one run."""
    del legs
    last = float(runs[0].time[-1])
    run = runs[0].between(last - runs[0].experiment.course.stride.period, last)
    panels = [row for row in SENSORS if run.has(row[1])]
    drawing = Panels(layout, [1.1] * len(panels), share_y=False, left=0.95)
    for axis, (label, measured, true, index, scale) in zip(drawing.axes, panels, strict=True):
        values, orientation = run.channel(true), run.channel("body_orientation")
        if true == "body_angular_velocity" and values is not None and orientation is not None:
            # A gyroscope measures in body axes.
            values = np.einsum("tji,tj->ti", quaternion_rotation(orientation), values)
        place: Any = (slice(None), *index)
        if values is not None:
            axis.plot(run.time, scale * values[place], **TRUE_LINE)
        # A reading stands until the next one arrives.
        reading = scale * run.recording[measured].values[place]
        axis.step(run.time, reading, where="post", **MEASURED_LINE)
        axis.set_ylabel(label)
    time_axis(drawing.axes[-1], run.time)
    title = "Measured and true values, last cycle, leg 1 and body"
    return drawing.complete(title, run.caption, [("true", TRUE_LINE), ("measured", MEASURED_LINE)])
