"""Velocity and slip of every gait in every direction."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np

import phasmid
from phasmid.control import LocomotionEngine
from phasmid.experiment import Command, Ending
from phasmid.gait import GAITS
from phasmid.reporting.style import JOINT_COLOURS, LIMIT_COLOUR, leg_colour, save_figure, styled
from phasmid.robot import load_robot
from phasmid.scenario import Scenario
from phasmid.simulation import drive

from .study import Case, grouped, markdown
from .tracking import track

ROBOT = "phantomx-ax"
DRIVES = {
    "ideal": ("ideal-servo", "none", "ideal servos"),
    "ideal, with torque": ("ideal-servo", "feed-forward", "ideal servos, feed-forward torque"),
    "AX-12A": ("servo", "none", "AX-12A servos"),
}
"""Drive, dynamics and description of each kind of joints."""

SHARES = (0.5, 0.9)
"""Shares of the largest velocity in the direction."""

START, CYCLES = 1.5, 2
"""Least time of the start [s], and number of whole cycles measured after it."""

ERROR, SLIP = 0.03, 1e-3
"""Limits for ideal servos: error of the mean velocity, slip per step [m]."""


def ways(directions: int = 24) -> list[tuple[str, tuple[float, float, float]]]:
    """Return straight directions all around, two turns, and an arc; yaw in rad/m."""
    angles = [360 * i / directions for i in range(directions)]
    straight = [
        (f"{a:.0f}°", (math.cos(math.radians(a)), math.sin(math.radians(a)), 0.0)) for a in angles
    ]
    # The arc has a radius of 0.4 m.
    others = [("turn left", (0.0, 0.0, 1.0)), ("turn right", (0.0, 0.0, -1.0))]
    return [*straight, *others, ("arc", (1.0, 0.0, 2.5))]


def cases(
    directions: int = 24, gaits: tuple[str, ...] = (), drives: tuple[str, ...] = tuple(DRIVES)
) -> list[Case]:
    """Return every gait, direction, share of the largest velocity and kind of joints."""
    return [
        {"gait": gait, "way": way, "direction": direction, "share": share, "joints": joints}
        for gait in gaits or tuple(GAITS[6])
        for joints in drives
        for way, direction in ways(directions)
        for share in SHARES
    ]


def measure(
    gait: str, way: str, direction: tuple[float, float, float], share: float, joints: str
) -> Case:
    """Walk in one direction."""
    kind, dynamics, _ = DRIVES[joints]
    engine = LocomotionEngine(load_robot(ROBOT), gait=gait, dynamics=dynamics, ground_sensing=False)
    period = float(engine.reference.period)
    largest = engine.largest_velocity(tuple(direction))
    velocity = tuple(share * part for part in largest.velocity)
    duration = math.ceil(10 * (max(START, period) + CYCLES * period)) / 10
    scenario = Scenario().replace(
        robot=ROBOT, drive=kind, duration=duration, record_interval_ms=5, terrain="flat"
    )
    run = drive(scenario, engine, Command(velocity=velocity))
    found: Case = {
        "velocity": velocity,
        "limited_by": largest.reason,
        "ending": run.attrs["ending"],
        "events": [sentence for _, sentence in json.loads(str(run.attrs["events"]))],
    }
    if not Ending[run.attrs["ending"]].is_full_length:
        return found
    tracking = track(run, velocity, period=period, cycles=CYCLES)
    slip = phasmid.summarise(run)["slip"]
    return found | {
        "error": tracking.velocity_error,
        "got": tracking.velocity,
        "slip_mean": slip["mean"],
        "slip_largest": slip["largest"],
    }


def rows(results: list[Case]) -> list[list[str]]:
    """Return a row for each gait and kind of joints."""
    made = []
    for (gait, joints), runs in grouped(results, "gait", "joints").items():
        whole = [run for run in runs if "error" in run]
        errors = [run["error"] for run in whole]
        worst = max(whole, key=lambda run: run["error"], default=None)
        made.append(
            [
                gait,
                joints,
                *(
                    [
                        f"{100 * np.mean(errors):.1f} %",
                        f"{100 * worst['error']:.1f} %",
                        f"{worst['way']}, {100 * worst['share']:.0f} %",
                        f"{1000 * np.mean([run['slip_mean'] for run in whole]):.2f} mm",
                        f"{1000 * max(run['slip_mean'] for run in whole):.2f} mm",
                        f"{1000 * max(run['slip_largest'] for run in whole):.2f} mm",
                    ]
                    if worst
                    else ["–"] * 6
                ),
                f"{len(runs) - len(whole)} of {len(runs)}",
            ]
        )
    return made


def table(results: list[Case]) -> str:
    """Return the table of the page."""
    head = ["gait", "joints", "error, mean", "worst", "where", "slip, mean", "worst direction"]
    return markdown([*head, "largest step", "fell"], rows(results))


def verdict(results: list[Case]) -> str:
    """Return the numbers of walks within the limits, as text."""
    lines = []
    for (joints,), runs in grouped(results, "joints").items():
        whole = [run for run in runs if "error" in run]
        close = sum(run["error"] <= ERROR for run in whole)
        firm = sum(run["slip_mean"] < SLIP for run in whole)
        very = sum(run["slip_largest"] < SLIP for run in whole)
        lines.append(
            f"- {DRIVES[joints][2]}: {close} of {len(runs)} walks keep the commanded velocity "
            f"within 3 %, {firm} slip by less than 1 mm a step on average, {very} in every step; "
            f"{len(runs) - len(whole)} fell."
        )
    return "\n".join(lines)


def draw(results: list[Case], path: str) -> None:
    """Draw the largest velocity in each direction, and the errors."""
    with styled():
        _draw(results, path)


def _draw(results: list[Case], path: str) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 4.4), layout="constrained")
    figure.get_layout_engine().set(w_pad=0.1, h_pad=0.1)
    left = figure.add_subplot(1, 2, 1, projection="polar")
    right = figure.add_subplot(1, 2, 2)
    kinds = list(grouped(results, "joints"))
    for i, ((gait,), runs) in enumerate(grouped(results, "gait").items()):
        some = [
            run
            for run in runs
            if run["way"].endswith("°") and (run["joints"],) == kinds[0] and run["share"] == 0.9
        ]
        angle = np.radians([float(run["way"][:-1]) for run in some])
        speed = [100 * math.hypot(*run["velocity"][:2]) / 0.9 for run in some]
        left.plot([*angle, *angle[:1]], [*speed, *speed[:1]], label=gait, color=leg_colour(i))
        for k, (joints,) in enumerate(kinds):
            errors = [
                100 * run["error"] for run in runs if run["joints"] == joints if "error" in run
            ]
            right.plot(
                np.full(len(errors), i + 0.22 * (k - 1)),
                errors,
                "." if k < 2 else "_",
                color=JOINT_COLOURS[k % 3],
                label=joints if i == 0 else None,
                alpha=0.5,
            )
    left.set_theta_zero_location("N")
    left.set_title("largest velocity [cm/s], forward is up", pad=26)
    names = [gait for (gait,) in grouped(results, "gait")]
    right.set_xticks(range(len(names)), names, rotation=35, ha="right")
    right.axhline(100 * ERROR, color=LIMIT_COLOUR, linewidth=1.0, linestyle="--")
    right.set(ylabel="error of the mean velocity [%]", yscale="log")
    # The style leaves powers of ten unset, as formulas.
    right.yaxis.set_major_formatter("{x:g}")
    right.margins(x=0.04)
    right.legend(loc="lower left", bbox_to_anchor=(-0.02, 1.0), ncols=len(kinds))
    left.legend(loc="center left", bbox_to_anchor=(1.1, 0.5))
    save_figure(figure, Path(path), dpi=100)
