"""The summary as text for a terminal."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator
from typing import IO, Any

import numpy as np

from phasmid.errors import InvalidInput, plain
from phasmid.kinematics import share_words
from phasmid.reporting.checks import largest_joint
from phasmid.reporting.summary import Summary
from phasmid.servo.words import servo_words

WIDTH = 80
"""Largest width of the tables [columns]."""

LABEL_WIDTH = 17
"""Width of a label [columns]."""

ABSENT = "-"

MOST_EVENTS = 5
"""Events of a controller, and waypoints, that are printed."""


def print_summary(
    summary: Summary, *, legs: tuple[int, ...] | None = None, file: IO[str] | None = None
) -> None:
    """Print the numbers of `summarise`, about a screen of them.

    Args:
        summary: Result of `summarise`, or the content of a ``summary.json``.
        legs: Leg numbers, from 1; by default all.
        file: Destination; by default standard output. Without a terminal there is no colour.

    Raises:
        InvalidInput: There is no such leg.
    """
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    names = [plain(name) for name in summary["robot"]["legs"]]
    shown = tuple(range(1, len(names) + 1)) if legs is None else legs
    for number in shown:
        if not 1 <= number <= len(names):
            raise InvalidInput(f"there is no leg {number}; legs are 1 to {len(names)}.")
    console = Console(file=file, highlight=False, markup=False)
    width = min(console.width, WIDTH)
    for line in textwrap.wrap(headline(summary), width):
        console.print(Text(line, style="bold"))
    ended = str(summary["run"].get("ending", ABSENT))
    style = "bold green" if ended == "COMPLETED" else "bold yellow"
    for part in (head(summary), facts(summary)):
        for label, fact in part:
            lines = textwrap.wrap(fact, max(width - LABEL_WIDTH, 20))
            for first, line in zip([label, *[""] * len(lines)], lines, strict=False):
                text = Text(first.ljust(LABEL_WIDTH), style="cyan").append(line, style="default")
                if first == "Walked?":
                    text.highlight_words([ended], style)
                console.print(text)
        console.print()

    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="cyan")
    both = len(summary.get("normal_force", {})) == 2
    heads = ("normal [N]", "slip", "coxa", "femur", "tibia")
    units = ("sim / model" if both else "mean", "[mm]", *["peak / rms"] * 3)
    rows = [
        [f"{number} {names[number - 1].replace('_', ' ')}", *leg_row(summary, number - 1)]
        for number in shown
    ]
    # A long name is broken between words, never a number.
    table.add_column("leg", min_width=max(len(word) for row in rows for word in row[0].split()))
    for column, title in enumerate(heads, 1):
        least = max(len(row[column]) for row in rows)
        table.add_column(title, justify="right", no_wrap=True, min_width=least)
    table.add_row("", *units, style="dim")
    for row in rows:
        table.add_row(*row)
    console.print(table, width=width)
    for line in textwrap.wrap(note(summary), width, break_on_hyphens=False):
        console.print(Text(line, style="dim"))
    warnings = summary.get("warnings", ())
    # A single one is in the head already.
    for warning in warnings if len(warnings) > 1 else ():
        for line in textwrap.wrap(
            plain(warning), width, initial_indent="! ", subsequent_indent="  "
        ):
            console.print(Text(line, style="bold yellow"))


def headline(summary: Summary) -> str:
    """Return title and kind of the run, on one line."""
    kind = summary["run"].get("kind", "recording")
    return plain(f"{summary['run']['title']} · {'analysis' if kind == 'model' else kind}")


def head(summary: Summary) -> Iterator[tuple[str, str]]:
    """Yield label and text of the first five lines."""
    run, warnings = summary["run"], summary.get("warnings", ())
    ended, reason = run.get("ending", "no end recorded"), run.get("ending_reason", "")
    told = f" ({ended})" if ended == "COMPLETED" or not reason else f". {ended}: {reason}"
    yield "Walked?", plain(f"{_share(summary)}{told}")
    yield "How far?", _distance(summary)
    verdict = summary.get("servo_verdict", {}).get("lines") or ("not judged",)
    for label, line in zip(["Servos hold?", *[""] * len(verdict)], verdict, strict=False):
        yield label, plain(str(line))
    yield "Model agrees?", _agreement(summary)
    more = f" And {len(warnings) - 1} more, at the end." if len(warnings) > 1 else ""
    yield "Warnings", plain(f"{warnings[0]}{more}") if warnings else "none"


def _share(summary: Summary) -> str:
    """Return the share of what was commanded that the robot did."""
    run, way = summary["run"], summary.get("travel", {})
    if run.get("waypoints"):
        reached = sum(place.get("reached") is not None for place in run["waypoints"])
        return f"{reached} of {len(run['waypoints'])} waypoints"
    if run.get("kind") == "model":
        return "Planned, not simulated"
    if run.get("follows") == "trajectory":
        return "A trajectory commands no velocity"
    words = share_words(way.get("distance_share"), way.get("turn_share"))
    if words or "distance" not in way:
        return words or "Not recorded"
    return "Nothing was commanded"


def _distance(summary: Summary) -> str:
    """Return how far the body went, beside the command where there is one."""
    way = summary.get("travel", {})
    commanded = way.get("commanded_distance")
    if "distance" not in way:
        if commanded is None:
            return "not recorded"
        return f"{_mm(commanded)} commanded, in {way['commanded_steps']:.3g} steps"
    line = _mm(way["distance"])
    if commanded is not None and summary["run"].get("follows") != "trajectory":
        line += f", commanded {_mm(commanded)}"
    return line + (f"; {1000 * way['mean_speed']:.1f} mm/s" if "mean_speed" in way else "")


def _agreement(summary: Summary) -> str:
    """Return the model's rms differences from the simulation as shares of the simulated values."""
    parts = []
    for words, name, reference in (
        ("torques", "torque", "rms"),
        ("normal forces", "normal_force", "mean_in_stance"),
    ):
        difference = summary.get("model_against_simulation", {}).get(name, {}).get("rms")
        values = summary.get(name, {}).get("simulation", {}).get(reference)
        if difference is None or values is None:
            continue
        pairs = np.array([np.array(difference, float).ravel(), np.array(values, float).ravel()])
        squares = (pairs[:, np.isfinite(pairs).all(axis=0)] ** 2).sum(axis=1)
        if squares[1] > 0:
            share = float(np.sqrt(squares[0] / squares[1]))
            parts.append(f"{words} {100 * share:.{0 if share > 0.095 else 1}f} %")
    if not parts:
        return "not compared: this run has no model"
    return f"rms difference of {', of '.join(parts)}"


def facts(summary: Summary) -> Iterator[tuple[str, str]]:
    """Yield label and text of each line above the table; unknown ones are left out."""
    way, run = summary.get("travel", {}), summary["run"]
    line, longest = f"{run['duration']:g} s", run["planned_duration"]
    if longest - run["duration"] > 1e-9:
        at_most = "waypoints" in run
        line += f" of at most {longest:.4g} s" if at_most else f" of {longest:g} s planned"
    line += f", {run['samples']} samples"
    if "samples_not_finite" in run:
        line += f", the last {run['samples_not_finite']} not finite"
    yield "Duration", line
    if "sideways_drift" in way:
        yield "Sideways", f"{_mm(way['sideways_drift'], sign=True)} drift (left is +)"
    yield from _story(summary)
    if "heading_change" in way:
        line = f"{_degrees(way['heading_change'])} turned"
        if "commanded_turn" in way:
            line += f", {_degrees(way['commanded_turn'])} commanded"
        yield "Heading", f"{line}; largest tilt {math.degrees(way['largest_tilt']):.2f}°"
    if "body_height_change" in way:
        line = f"{_mm(way['body_height_change'], sign=True)} from start to end"
        yield "Body height", f"{line}, {_mm(way['body_height_range'])} between lowest and highest"
    if "least_margin" in summary.get("support", {}):
        yield "Support", f"{_mm(summary['support']['least_margin'])} margin at the least"
    if "state_estimate" in summary:
        estimate = summary["state_estimate"]
        line = f"{_mm(estimate['position_error'])} off at the end"
        if "position_drift" in estimate:
            line += f", {100 * estimate['position_drift']:.2f} % of the distance"
        yield "State estimate", f"{line}; velocity {1000 * estimate['velocity_error']:.1f} mm/s rms"
    if "slip" in summary:
        slip = summary["slip"]
        yield "Foot slip", f"{_mm(slip['mean'])} a step on average, {_mm(slip['largest'])} at most"
    yield from _loads(summary)
    yield from _servos(summary)


def _story(summary: Summary) -> Iterator[tuple[str, str]]:
    """Yield the waypoints, mean velocities, faults and first events of a driven run."""
    run, velocity = summary["run"], summary.get("velocity", {})
    places, events = run.get("waypoints", []), run.get("events", [])
    for number, place in enumerate(places[:MOST_EVENTS], 1):
        time = place.get("reached")
        done = "not reached" if time is None else f"reached at {time:.2f} s"
        yield f"Waypoint {number}", f"({place['x']:g}, {place['y']:g}) m {done}"
    if len(places) > MOST_EVENTS:
        yield "", f"{len(places) - MOST_EVENTS} more waypoints are in summary.json"
    labels = {"commanded": "Velocity command", "feasible": "  feasible", "actual": "  actual"}
    for name, label in labels.items():
        if name in velocity:
            vx, vy, wz = velocity[name]
            way = f"{1000 * vx:+.1f} mm/s forward, {1000 * vy:+.1f} mm/s to the left"
            yield label, f"{way}, {math.degrees(wz):+.2f}°/s, on average"
    for fault in run.get("faults", ()):
        yield "Fault", plain(str(fault))
    for time, sentence in events[:MOST_EVENTS]:
        yield "Event", f"{time:.2f} s: {plain(str(sentence))}"
    if len(events) > MOST_EVENTS:
        yield "", f"{len(events) - MOST_EVENTS} more events are in summary.json"


def _loads(summary: Summary) -> Iterator[tuple[str, str]]:
    """Yield forces, torques, speed and work; the model's where none was simulated."""
    at, force = _at_supply(summary), _seen(summary, "normal_force")
    if "mean_sum" in force:
        line = (
            f"sum {force['mean_sum']:.3f} N, weight {summary['robot']['weight']:.3f} N "
            f"({100 * force['sum_over_weight']:.2f} %)"
        )
        if "largest_in_swing" in force:
            line += f"; swing up to {force['largest_in_swing']:.3g} N"
        yield "Normal forces", line
    elif force:
        yield "Normal forces", f"up to {force['largest']:.3g} N"
    torque = _seen(summary, "torque")
    if torque:
        yield (
            "Largest torque",
            f"{torque['largest']:.3f} N·m, {100 * torque['largest_over_stall']:.0f} % of stall{at}"
            f"; {100 * torque['share_above_continuous']:.1f} % of samples above continuous",
        )
    if "speed" in summary:
        speed = summary["speed"]
        yield (
            "Fastest joint",
            f"{speed['largest']:.2f} rad/s, "
            f"{100 * speed['largest_over_no_load']:.0f} % of the servo's no-load speed{at}",
        )
    if "energy" in summary:
        energy = summary["energy"]
        line = f"{energy['work']:.3g} J positive, {energy['mean_power']:.3g} W"
        if "cost_of_transport" in energy:
            line += f"; mechanical cost of transport {energy['cost_of_transport']:.3g}"
        yield "Joint work", line
        if "friction_work" in energy:
            yield "Servo friction", f"{energy['friction_work']:.3g} J lost in motors and gears"
        if "electrical_energy" in energy:
            drawn = f"{energy['electrical_energy']:.3g} J, {energy['electrical_power']:.3g} W"
            yield "Electrical", f"{drawn} drawn by the motors"


def _seen(summary: Summary, section: str) -> dict[str, Any]:
    """Return the simulated numbers of a section, or else the model's; empty without both."""
    kinds = summary.get(section, {})
    found: dict[str, Any] = kinds.get("simulation") or kinds.get("model") or {}
    return found


def _servos(summary: Summary) -> Iterator[tuple[str, str]]:
    """Yield output and temperature of servos that move the joints by their own law."""
    servos = summary.get("servos")
    if not servos:
        return
    line = f"{servos['voltage']:g} V; "
    share, joint = largest_joint(summary, "saturated")
    line += f"at full output {100 * share:.1f} % of the time" if share else "never at full output"
    line += f" ({joint})" if share else ""
    if "above_continuous" in servos:
        share, joint = largest_joint(summary, "above_continuous")
        line += f", above continuous torque {100 * share:.0f} %" + (f" ({joint})" if share else "")
    warmest, joint = largest_joint(summary, "peak_temperature")
    yield "Servos", f"{line}, at most; warmest {warmest:.0f} °C ({joint})"


def leg_row(summary: Summary, leg: int) -> list[str]:
    """Return normal force [N], slip [mm] and torques [N·m] of a leg, counted from 0."""
    means = [kind.get("mean_in_stance") for kind in summary.get("normal_force", {}).values()]
    slips = summary.get("slip", {}).get("mean_by_leg")
    torque, joints = _seen(summary, "torque"), [ABSENT] * 3
    if torque:
        pairs = zip(torque["peak"][leg], torque["rms"][leg], strict=True)
        joints = [f"{peak:.3f} / {rms:.3f}" for peak, rms in pairs]
    return [
        " / ".join(_newtons(mean and mean[leg]) for mean in means) or ABSENT,
        f"{1000 * slips[leg]:.2f}" if slips and slips[leg] is not None else ABSENT,
        *joints,
    ]


def _newtons(force: float | None) -> str:
    """Return a force in at most four columns where it is below 10 kN, so that two fit the table."""
    if force is None:
        return ABSENT
    size = abs(force)
    return f"{force:.{2 if size < 9.995 else 1 if size < 99.95 else 0}f}"


def note(summary: Summary) -> str:
    """Return the notes on the table."""
    run, robot, torque = summary["run"], summary["robot"], summary.get("torque", {})
    sentences = []
    if "normal_force" in summary:
        sentences.append("Normal forces are means over all of stance.")
    if "slip" in summary:
        sentences.append("Slip is per step.")
    if torque:
        source = "of the model"
        if "simulation" in torque:
            source = f"simulated, {run['drive']} drive" if run.get("drive") else "as recorded"
            source += f", {run['contact_law']} contact" if run.get("contact_law") else ""
        stall = f"stall {robot['stall_torque']:.4g} N·m{_at_supply(summary)}"
        model = run.get("force_model") if "model" in torque else ""
        sentences.append(
            f"Torques in N·m, {source}; {servo_words(robot['servo'])}, {stall}"
            f"{f'; model forces: {model}' if model else ''}."
        )
    return plain(" ".join(sentences))


def _at_supply(summary: Summary) -> str:
    """Return the supply voltage of the servos in words, where it counts."""
    supply = summary["robot"].get("supply")
    return "" if supply is None else f" at {supply:g} V"


def _degrees(value: float) -> str:
    return f"{round(math.degrees(value), 2) + 0.0:+.2f}°"


def _mm(value: float, *, sign: bool = False) -> str:
    # Round-off would otherwise print as a drift of -0.00 mm.
    shown = round(1000 * value, 2) + 0.0
    return f"{shown:+.2f} mm" if sign else f"{shown:.2f} mm"
