"""Figures over time: joints, feet, gait, support, friction, power, residuals and sensors.

Each function draws runs, cut to the part that is shown, for some legs, numbered from 1. One run
has all its lines; several are compared, with a line each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from phasmid.gait import support_margin
from phasmid.kinematics import quaternion_rotation
from phasmid.recording.channels import CHANNELS, JOINTS
from phasmid.reporting.numbers import (
    SHORTEST_DISTANCE,
    centre_of_mass,
    drawn_power,
    torque_and_speed,
    travel,
)
from phasmid.reporting.panels import (
    Axes,
    Entry,
    Panels,
    listed_legs,
    name_panel,
    shade,
    spans,
    time_axis,
)
from phasmid.reporting.run import Run, shared_caption, shown_part
from phasmid.reporting.steps import SETTLING, away_from_switches, durations
from phasmid.reporting.style import (
    FAINT,
    INK,
    JOINT_COLOURS,
    LACKING_COLOUR,
    LIMIT_COLOUR,
    POWER_COLOURS,
    STANCE_COLOUR,
    Figure,
    darker,
    layout,
    leg_colour,
    paler,
    points,
    shrink,
    thin,
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

COXA_APART = ("coxa", "femur and tibia")
"""Panels of each leg's angles: the coxa turns by some degrees, the others by ten times as much."""


def quantity_figure(runs: Sequence[Run], legs: Legs, note: str, quantity: Quantity) -> Figure:
    """Draw a quantity of one run, simulated and computed, or of several runs."""
    return (_quantity_of_run if len(runs) == 1 else _quantity_of_runs)(runs, legs, note, quantity)


def _quantity_of_run(runs: Sequence[Run], legs: Legs, note: str, quantity: Quantity) -> Figure:
    run = runs[0]
    # Shape (N, legs, lines of a leg).
    seen, computed = (
        values if values is None else quantity.scale * values.reshape(*values.shape[:2], -1)
        for values in (run.channel(name) for name in (*quantity.channels, "")[:2])
    )
    title = quantity.title
    if quantity is ANGLES and seen is None:
        title = "Planned joint angles"
    notes = {
        TORQUES: [run.model_words],
        FORCES: [run.model_words, f"weight {run.weight:.4g} N"],
    }.get(quantity, [])
    if quantity in SERVO_QUANTITIES:
        notes = [f"{run.scenario.servo.supply(run.robot.servo):g} V"]
    columns = COXA_APART if quantity is ANGLES else ("",)
    drawing = Panels(
        f"{title} of {listed_legs(legs)}",
        [*run.caption, *notes, note],
        [1.65] * len(legs),
        columns=len(columns),
        share_y="col",
        space=0.24,
    )
    stance = run.channel("stance")
    for leg, row in zip(legs, drawing.rows, strict=True):
        colours = (leg_colour(leg - 1),) if quantity is FORCES else JOINT_COLOURS
        for joint, colour in enumerate(colours):
            of = (slice(None), leg - 1, joint)
            pair = (None if seen is None else seen[of], None if computed is None else computed[of])
            _draw_pair(row[min(joint, len(row) - 1)], run.time, pair, colour)
        for axis, part in zip(row, columns, strict=True):
            named = run.leg_title(leg) if axis is row[0] else ""
            if part and layout().is_narrow:
                named = named.split(",")[0]
            name_panel(axis, ": ".join(filter(None, (named, part))))
            if stance is not None:
                shade(axis, run.time, stance[:, leg - 1], STANCE_COLOUR)
        row[0].set_ylabel(quantity.label)
    for axis in row:
        shaded = axis is row[0] and stance is not None
        time_axis(axis, run.time, "shaded: stance" if shaded else "")
    drawing.figure.align_ylabels(drawing.axes[:: len(columns)])
    labels: list[Entry] = []
    if quantity is not FORCES:
        labels = [(name, {"color": c}) for name, c in zip(JOINTS, JOINT_COLOURS, strict=True)]
    if quantity not in SERVO_QUANTITIES:
        name = "simulated" if run.is_simulated else "recorded"
        labels.append((quantity.computed if seen is None else name, {"color": FAINT}))
        if seen is not None and computed is not None:
            dashed = {"color": INK, "linestyle": MODEL_DASH}
            labels.append((f"{quantity.computed} (darker)", dashed))
    return drawing.add_legend(labels)


def _draw_pair(
    axis: Axes,
    time: np.ndarray,
    pair: tuple[np.ndarray | None, np.ndarray | None],
    colour: str,
) -> None:
    """Draw the simulated line, and the computed one darker and dashed on top."""
    seen, computed = pair
    # A single sample makes no line.
    mark: dict[str, Any] = {"marker": "o" if len(time) == 1 else ""}
    if seen is not None:
        width = 1.5 if computed is None else 1.9
        axis.plot(*thin(time, seen), color=colour, linewidth=width, **mark)
    if computed is not None and seen is None:
        axis.plot(*thin(time, computed), color=colour, **mark)
    elif computed is not None:
        mark |= {"color": darker(colour), "linewidth": 1.1, "linestyle": MODEL_DASH}
        axis.plot(*thin(time, computed), **mark)


def _quantity_of_runs(runs: Sequence[Run], legs: Legs, note: str, quantity: Quantity) -> Figure:
    used = [run.first_channel(quantity.channels) for run in runs]
    kinds = " or ".join(CHANNELS[name].long_name for name in quantity.channels if name in used)
    found = [run.recording[name].values for run, name in zip(runs, used, strict=True)]
    # Shape (N, legs, panels of a row).
    lines = [values.reshape(*values.shape[:2], -1) for values in found]
    columns = lines[0].shape[2]
    drawing = Panels(
        f"{quantity.title} of {listed_legs(legs)}",
        [*shared_caption(runs), kinds, note],
        [1.4 if columns > 1 else 1.5] * len(legs),
        columns=columns,
        space=0.13,
    )
    for leg, row in zip(legs, drawing.rows, strict=True):
        for joint, axis in enumerate(row):
            if columns == 1:
                name_panel(axis, runs[0].leg_title(leg))
            elif layout().is_narrow:
                name_panel(axis, (f"leg {leg} · " if joint == 0 else "") + JOINTS[joint], 8.5)
            else:
                name_panel(axis, f"{runs[0].leg_name(leg)} · {JOINTS[joint]}", 8.5)
            for run, values in zip(runs, lines, strict=True):
                axis.plot(*thin(run.time, quantity.scale * values[:, leg - 1, joint]), **run.line)
        row[0].set_ylabel(quantity.label)
    for axis in row:
        time_axis(axis, runs[0].time)
        if columns > 1 and not layout().is_narrow:
            axis.locator_params(axis="x", nbins=5)
    drawing.figure.align_ylabels(drawing.axes[::columns])
    return drawing.add_legend(run_entries(runs), columns=1)


def gait_diagram(runs: Sequence[Run], legs: Legs, note: str) -> Figure:
    """Draw bars of each leg's planned stance and, narrower and darker, of its contact."""
    alone = len(runs) == 1
    notes = [*shared_caption(runs), _agreement(runs[0], legs) if alone else "", note]
    height = 0.27 * len(legs) + 0.35
    drawing = Panels("Gait diagram", notes, [height] * len(runs), left=0.19, share_y=False)
    for axis, run in zip(drawing.axes, runs, strict=True):
        draw_bars(axis, run, legs)
        if not alone:
            name_panel(axis, " · ".join(filter(None, (run.label, _agreement(run, legs)))))
    time_axis(drawing.axes[-1], runs[0].time)
    entries: list[Entry] = [
        (words, {"color": colour, "linewidth": 6.0})
        for name, words, colour in (
            ("stance", "planned stance", paler(FAINT)),
            ("contact", "recorded contact", FAINT),
        )
        if any(run.has(name) for run in runs)
    ]
    return drawing.add_legend(entries)


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
        shrink(label, 0.9 * float(axis.bbox.x0), least=points(5.0))
    axis.tick_params(axis="y", length=0)
    axis.grid(visible=False, axis="y")
    axis.spines["left"].set_visible(False)


STANDING = {"contact": "feet in contact", "stance": "feet in planned stance"}


def support_figure(runs: Sequence[Run], legs: Legs, note: str) -> Figure:
    """Draw the distance of the centre of mass from the edge of the support polygon.

    All legs count. A single run has a line of its contacts and one of its planned stance.
    """
    del legs
    alone = len(runs) == 1
    margins = [
        {
            name: margin_over_time(run, name)
            for name in [n for n in STANDING if run.has(n)][: 2 if alone else 1]
        }
        for run in runs
    ]
    of_what = sorted({next(iter(found.values()))[1] for found in margins})
    margin = next(iter(margins[0].values()))[0]
    least = _least_margin(runs[0], margin) if alone else ""
    notes = [*shared_caption(runs), f"of the {' or the '.join(of_what)}", least, note]
    drawing = Panels("Support margin", notes, [2.7])
    axis = drawing.axes[0]
    labels: list[Entry] = []
    for run, found in zip(runs, margins, strict=True):
        for number, (name, (values, _)) in enumerate(found.items()):
            look: dict[str, Any] = {"color": JOINT_COLOURS[2 * number]}
            look["linestyle"] = ("-", MODEL_DASH)[number]
            line = look if alone else run.line
            known = np.where(np.isfinite(values), 1000 * values, np.nan)
            axis.plot(*thin(run.time, known), **line)
            labels.append((STANDING[name], line))
    undefined = ~np.isfinite(margin) & alone
    shade(axis, runs[0].time, undefined, LACKING_COLOUR)
    axis.axhline(0.0, color=LIMIT_COLOUR, linewidth=1.0)
    axis.set_ylabel("margin [mm]")
    time_axis(axis, runs[0].time, "shaded: fewer than three feet" if undefined.any() else "")
    return drawing.add_legend(labels if alone else run_entries(runs), columns=0 if alone else 1)


def margin_over_time(run: Run, standing: str) -> tuple[np.ndarray, str]:
    """Return the static stability margin of every sample.

    Args:
        run: A run with feet and the body's position.
        standing: Channel of the stance feet: ``contact`` or ``stance``.

    Returns:
        Margin [m], shape (N,), minus infinity where fewer than three feet stand, or all in a
        line; and its reference point: the centre of mass or, where the joint angles or the pose are
        not recorded, the body's origin.
    """
    feet, down = (run.recording[name].values for name in ("foot_position", standing))
    centre, what = centre_of_mass(run), "centre of mass"
    if centre is None:
        centre, what = run.recording["body_position"].values, "body's origin"
    return support_margin(feet[..., :2], down, centre[..., :2]), what


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


def friction_figure(runs: Sequence[Run], legs: Legs, note: str) -> Figure:
    """Draw tangential over normal force of each stance foot, and the coefficient of friction."""
    found = [friction_demand(run) for run in runs]
    alone = len(runs) == 1
    threshold = f"stances under at least {LEAST_LOAD * runs[0].weight:.2g} N"
    columns = 2 if len(legs) > 1 else 1
    drawing = Panels(
        f"Friction demand of {listed_legs(legs)}",
        [*shared_caption(runs), threshold if alone else "", note],
        [1.45] * -(-len(legs) // columns),
        columns=columns,
        space=0.10,
    )
    stance = runs[0].channel("stance") if alone else None
    highest = 0.0
    for number, (axis, leg) in enumerate(zip(drawing.axes, legs, strict=False)):
        name_panel(axis, runs[0].leg_title(leg))
        if stance is not None:
            shade(axis, runs[0].time, stance[:, leg - 1], STANCE_COLOUR)
        for run, (demand, limit) in zip(runs, found, strict=True):
            line = {"color": leg_colour(leg - 1)} if alone else run.line
            axis.plot(*thin(run.time, demand[:, leg - 1]), **line)
            axis.plot(*thin(run.time, limit[:, leg - 1]), **LIMIT_LINE)
            largest = np.nanmax(demand[:, leg - 1], initial=0.0)
            highest = max(highest, float(limit.max()), float(largest))
        first = number % columns == 0
        if first:
            axis.set_ylabel("demand [1]")
        if number >= len(legs) - columns:
            shaded = first and stance is not None
            time_axis(axis, runs[0].time, "shaded: stance" if shaded else "")
            axis.xaxis.set_tick_params(labelbottom=True)
    for axis in drawing.axes[len(legs) :]:
        axis.set_visible(False)
    drawing.axes[0].set_ylim(0.0, 1.12 * highest)
    limits: Entry = ("coefficient of friction", LIMIT_LINE)
    if not alone:
        return drawing.add_legend([*run_entries(runs), limits], columns=1)
    words = "tangential over normal force" + ("" if runs[0].has("foot_force") else " of the model")
    return drawing.add_legend([(words, {"color": leg_colour(0)}), limits])


def friction_demand(run: Run) -> tuple[np.ndarray, np.ndarray]:
    """Return tangential over normal force on stance feet, and the coefficient of friction.

    Args:
        run: A run with foot forces, recorded or of the model.

    Returns:
        Demand, NaN where the foot does not stand or its normal force is below `LEAST_LOAD` of the
        weight; static coefficient of friction under each foot; both of shape (N, L).

    Raises:
        InvalidInput: The normal force is not known on ground that is not level.
    """
    name = run.first_channel(("foot_force", "foot_force_model"))
    force = run.recording[name].values
    standing = run.recording[run.first_channel(("stance", "contact"))].values
    ground, feet = run.scenario.load_terrain(), run.channel("foot_position")
    normal = run.channel(name.replace("foot_force", "foot_normal_force"))
    if normal is None:
        normal = force[..., 2]
        if feet is None and not ground.is_level:
            raise run.absent(("foot_normal_force",), "on this ground the demand")
        if feet is not None and not ground.is_level:
            normal = np.einsum("tlk,tlk->tl", force, ground.normal(feet[..., 0], feet[..., 1]))
    # Round-off may leave less than zero.
    tangential = np.sqrt(np.maximum(np.sum(force**2, axis=-1) - normal**2, 0.0))
    loaded = standing & (normal >= LEAST_LOAD * run.weight)
    demand = np.where(loaded, tangential / np.where(loaded, normal, 1.0), np.nan)
    if feet is None:
        limit = np.full(demand.shape, run.scenario.terrain.friction)
    else:
        limit = ground.friction(feet[..., 0], feet[..., 1])
    return demand, limit


POWER_LINES: dict[str, tuple[str, Any]] = {
    "net": ("net: Σ τω", "-"),
    "given": ("given: Σ max(τω, 0)", (0, (5, 1.6))),
    "absolute": ("absolute: Σ |τω|", (0, (2, 1.4))),
    "electrical": ("electrical, from the supply", "-"),
}
"""Label and dash of each kind of power."""

COSTS = ("given", "electrical")
"""Kinds of power whose cost of transport the subtitle states."""


@dataclass(frozen=True, eq=False)
class Power:
    """Power of all joints together.

    Attributes:
        name: A key of `POWER_LINES`.
        power: Power of each sample [W], shape (N,).
        energy: Its integral by the trapezoidal rule [J], shape (N,).
        cost_of_transport: Energy over weight and distance; None where the distance is unknown or 0.
    """

    name: str
    power: np.ndarray
    energy: np.ndarray
    cost_of_transport: float | None

    @property
    def cost(self) -> str:
        """Cost of transport in words."""
        return "unknown" if self.cost_of_transport is None else f"{self.cost_of_transport:.2f}"


def power_figure(runs: Sequence[Run], legs: Legs, note: str) -> Figure:
    """Draw the power of all joints together and, under it, its integral since the start.

    A single run has a line of every kind of power; several have that of their positive power.
    Energy counts from the start of the whole runs.
    """
    del legs
    parts, note = shown_part(runs)
    found = [power_of(run) for run in runs]
    alone = len(parts) == 1
    model = " by the model" if torque_and_speed(runs[0])[2].endswith("_model") else ""
    costs = [f"{kind.cost} ({kind.name})" for kind in found[0] if kind.name in COSTS]
    cost = f"cost of transport {', '.join(costs)}" if alone else ""
    title = f"Power and energy of all joints{model}"
    notes = [*shared_caption(parts), cost, note]
    drawing = Panels(title, notes, [2.1, 1.9], share_y=False, gap=0.12)
    labels: list[Entry] = []
    for run, whole, kinds in zip(parts, runs, found, strict=True):
        rows = np.searchsorted(whole.time, run.time)
        for kind, colour in zip(kinds, POWER_COLOURS, strict=False):
            label, dash = POWER_LINES[kind.name]
            line = {"color": colour, "linestyle": dash, "linewidth": 1.3}
            if not alone:
                if kind.name != "given":
                    continue
                line, label = run.line, f"{run.label} · cost of transport {kind.cost}"
            for axis, values in zip(drawing.axes, (kind.power, kind.energy), strict=True):
                axis.plot(*thin(run.time, values[rows]), **line)
            labels.append((label, line))
    given = "" if alone else " given"
    drawing.axes[0].set_ylabel(f"power{given} [W]")
    drawing.axes[1].set_ylabel(f"energy{given} [J]")
    time_axis(drawing.axes[1], parts[0].time)
    drawing.figure.align_ylabels(drawing.axes)
    return drawing.add_legend(labels, columns=0 if alone else 1)


def power_of(run: Run) -> list[Power]:
    """Return each kind of power of joints and servos of a whole run.

    Returns:
        ``net``, the sum over joints of torque times speed; ``given``, that of the positive parts,
        as braking recovers nothing; ``absolute``, that of the magnitudes; and with recorded servo
        currents ``electrical``, the positive part of output times supply voltage times current.

    Raises:
        InvalidInput: A channel is absent.
    """
    tau, qd, _ = torque_and_speed(run)
    way = travel(run).get("distance") or 0.0
    work, drawn = tau * qd, drawn_power(run)
    kinds = {"net": work, "given": np.maximum(work, 0.0), "absolute": np.abs(work)}
    if drawn is not None:
        kinds["electrical"] = drawn
    found = []
    for name, values in kinds.items():
        power = values.sum(axis=(1, 2))
        means = (power[1:] + power[:-1]) / 2 * np.diff(run.time)
        energy = np.concatenate([[0.0], np.cumsum(means)])
        cost = float(energy[-1]) / (run.weight * way) if way >= SHORTEST_DISTANCE else None
        found.append(Power(name, power, energy, cost))
    return found


def residuals_figure(runs: Sequence[Run], legs: Legs, note: str) -> Figure:
    """Draw normal forces and joint torques of the model less the simulated ones.

    A single run has a line for each leg; several have the rms over these legs.
    """
    chosen = [leg - 1 for leg in legs]
    found = [[values[:, chosen] for values in residuals(run)] for run in runs]
    calm = [_calm(run) for run in runs]
    alone = len(runs) == 1
    if not alone:
        found = [[np.sqrt(np.mean(v**2, axis=1, keepdims=True)) for v in rows] for rows in found]
    models = {run.model_words for run in runs}
    title = f"Model less simulation, {listed_legs(legs) if alone else 'rms over the feet'}"
    notes = [*shared_caption(runs), *(models if len(models) == 1 else []), note]
    drawing = Panels(title, notes, [1.35] * 4, share_y=False, gap=0.26, left=0.13)
    names = ["normal force", *(f"{joint} torque" for joint in JOINTS)]
    for row, (axis, name) in enumerate(zip(drawing.axes, names, strict=True)):
        axis.set_ylabel("force [N]" if row == 0 else "torque [N·m]")
        for run, values, quiet in zip(runs, found, calm, strict=True):
            if not alone:
                axis.plot(*thin(run.time, values[row][:, 0]), **run.line)
                continue
            shade(axis, run.time, ~quiet, STANCE_COLOUR)
            for leg, line in zip(chosen, values[row].T, strict=True):
                colour, away = leg_colour(leg), np.where(quiet, line, np.nan)
                axis.plot(*thin(run.time, line), color=paler(colour), linewidth=0.8)
                axis.plot(*thin(run.time, away), color=colour, linewidth=1.2)
        # The axis is limited to values away from switches.
        lines = [np.abs(values[row]) for values in found]
        most = max(float(line.max(initial=0.0)) for line in lines)
        still = max(float(line[q].max(initial=0.0)) for line, q in zip(lines, calm, strict=True))
        words = ""
        if 0.0 < 3 * still < most:
            axis.set_ylim(-1.6 * still if alone else 0.0, 1.6 * still)
            unit = "N" if row == 0 else "N·m"
            cut = "" if layout().is_narrow else " are cut off"
            words = f"   (impacts up to {most:.2g} {unit}{cut})"
        name_panel(axis, name + words)
    shaded = alone and runs[0].has("stance")
    words = f"shaded: {1000 * SETTLING:g} ms around the switches of legs" if shaded else ""
    time_axis(drawing.axes[-1], runs[0].time, words)
    drawing.figure.align_ylabels(drawing.axes)
    if alone:
        return drawing.add_legend(leg_entries(runs[0], legs), columns=3)
    return drawing.add_legend(run_entries(runs), columns=1)


RESIDUAL_CHANNELS = (
    "foot_normal_force",
    "foot_normal_force_model",
    "joint_torque",
    "joint_torque_model",
)


def residuals(run: Run) -> list[np.ndarray]:
    """Return normal forces [N] of the model less the simulated ones, then torques [N·m].

    Returns:
        Four arrays of shape (N, L): normal force, coxa, femur, tibia.
    """
    seen, model, tau, tau_model = (run.recording[name].values for name in RESIDUAL_CHANNELS)
    return [model - seen, *np.moveaxis(tau_model - tau, -1, 0)]


def _calm(run: Run) -> np.ndarray:
    """Return the samples away from the switches of all legs; all without a recorded stance."""
    stance = run.channel("stance")
    if stance is None:
        return np.ones(len(run.time), dtype=bool)
    return np.asarray(np.all(away_from_switches(run.time, stance), axis=1))


SENSOR_CHANNELS = (
    "joint_position_measured",
    "joint_load_measured",
    "foot_normal_force_measured",
    "imu_angular_velocity",
    "imu_acceleration",
)
"""Measured channels that are drawn; one suffices."""

TRUE_LINE: dict[str, Any] = {"color": "#b9bec7", "linewidth": 2.4}
MEASURED_LINE: dict[str, Any] = {"color": darker(JOINT_COLOURS[1]), "linewidth": 1.0}

LEG, FEMUR, Y, Z = 0, 1, 1, 2


def sensor_figure(runs: Sequence[Run], legs: Legs, note: str) -> Figure:
    """Draw measured over true values of leg 1 and the body in the last cycle of one run."""
    del legs, note
    last = float(runs[0].time[-1])
    run = runs[0].between(last - runs[0].scenario.stride.period, last)
    spin, orientation = run.channel("body_angular_velocity"), run.channel("body_orientation")
    if spin is not None and orientation is not None:
        spin = np.einsum("tji,tj->ti", quaternion_rotation(orientation), spin)
    femur, foot = (slice(None), LEG, FEMUR), (slice(None), LEG)
    position, load, normal = (
        run.channel(n) for n in ("joint_position", "servo_duty", "foot_normal_force")
    )
    panels = [
        (label, scale * measured[index], None if true is None else scale * true[index])
        for label, measured, true, index, scale in zip(
            ("femur [°]", "femur load [1]", "foot [N]", "gyro y [°/s]", "acc. z [m/s²]"),
            map(run.channel, SENSOR_CHANNELS),
            (position, load, normal, spin, None),
            (femur, femur, foot, (slice(None), Y), (slice(None), Z)),
            (DEGREES, 1.0, 1.0, DEGREES, 1.0),
            strict=True,
        )
        if measured is not None
    ]
    drawing = Panels(
        "Measured and true values, last cycle, leg 1 and body",
        run.caption,
        [1.1] * len(panels),
        share_y=False,
        left=0.13,
        right=0.965,
        gap=0.2,
    )
    for axis, (label, measured, true) in zip(drawing.axes, panels, strict=True):
        if true is not None:
            axis.plot(*thin(run.time, true), **TRUE_LINE)
        # A reading stands until the next one arrives.
        axis.step(run.time, measured, where="post", **MEASURED_LINE)
        axis.set_ylabel(label)
    time_axis(drawing.axes[-1], run.time)
    drawing.figure.align_ylabels(drawing.axes)
    return drawing.add_legend([("true", TRUE_LINE), ("measured", MEASURED_LINE)])
