"""``phasmid gaits``: the gaits of a robot with support margins and largest speeds."""

from __future__ import annotations

import argparse
import json
import math
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

from phasmid.errors import InvalidInput, plain

if TYPE_CHECKING:
    from phasmid.gait import Gait
    from phasmid.robot import Robot

LARGEST_FRACTION = 24
"""Denominator up to which a phase is shown as a fraction."""

LARGEST_NUMBER = 10_000
"""No option of this command has a larger value: steps of ten metres."""


class Row(NamedTuple):
    """A gait and its properties.

    Attributes:
        gait: The gait.
        legs: Numbers of its legs, from 1.
        margin: Least support margin of a cycle [m].
        shift: Shift of the body where legs are lost: forward, left [m].
        speed: Largest forward speed [m/s]; None: not computed.
        reason: Limiting constraint of the speed.
    """

    gait: Gait
    legs: tuple[int, ...]
    margin: float
    shift: tuple[float, float] | None
    speed: float | None
    reason: str


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "gaits", nargs="*", metavar="GAIT", help="names or gait files (.toml); default: all"
    )
    parser.add_argument(
        "--robot", default="phantomx-paper", help="a preset or a file; default: phantomx-paper"
    )
    parser.add_argument(
        "--step-length-mm", metavar="MM", default="40", help="way of the body while a foot stands"
    )
    parser.add_argument("--lost", metavar="1,2,...", help="legs that are lost: how it walks on")
    parser.add_argument("--diagram", action="store_true", help="draw gait diagrams")
    parser.add_argument("--json", action="store_true", help="print the same as JSON")


def run(options: argparse.Namespace) -> int:
    """List gaits, and return the exit status."""
    from phasmid.cli.walk import leg_numbers
    from phasmid.formats import load_robot

    robot = load_robot(options.robot)
    step = _number("--step-length-mm", options.step_length_mm) / 1000
    rows = _rows(options, robot, step, leg_numbers(options.lost, robot, "--lost") or ())
    if options.json:
        print(json.dumps([_as_dict(row) for row in rows], indent=2, ensure_ascii=False))
        return 0
    print(f"{plain(robot.name)}: {len(robot.legs)} legs, a step of {1000 * step:g} mm ahead\n")
    _print_table(rows)
    if options.diagram or options.gaits:
        for row in rows:
            _print_diagram(row, robot)
    return 0


def _number(option: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) <= LARGEST_NUMBER:
        raise InvalidInput(f'{option} is "{text}"; it must be a number up to {LARGEST_NUMBER:g}.')
    return value


def _rows(
    options: argparse.Namespace, robot: Robot, step: float, lost: tuple[int, ...]
) -> list[Row]:
    from phasmid.gait import gaits_of, least_margin, load_gait, without_legs
    from phasmid.kinematics import centre_of_mass, joint_angles, neutral_feet

    count, names = len(robot.legs), [leg.name for leg in robot.legs]
    feet = neutral_feet(robot)[:, :2]
    com = centre_of_mass(robot, joint_angles(robot.arrays, robot.arrays.neutral_foot))[:2]
    way = (step, 0.0, 0.0)
    chosen = [load_gait(name, count, names) for name in options.gaits]
    if not chosen:
        chosen = list(gaits_of(count).values())
    if lost:
        limps = [without_legs(gait, lost, feet, com, step=way) for gait in chosen]
        return [Row(a.gait, a.legs, a.margin, a.shift, None, "") for a in limps]
    all_legs = tuple(range(1, count + 1))
    rows = []
    for gait in chosen:
        speed, reason = _fastest(robot, gait)
        rows.append(Row(gait, all_legs, least_margin(gait, feet, com, way), None, speed, reason))
    return rows


def _fastest(robot: Robot, gait: Gait) -> tuple[float | None, str]:
    """Return the largest forward speed and its limiting constraint."""
    from phasmid.control.engine import LocomotionEngine

    limit = LocomotionEngine(robot, gait=gait).largest_velocity((1.0, 0.0, 0.0))
    return limit.velocity[0], limit.reason


def _feet_down(gait: Gait) -> tuple[int, int]:
    import numpy as np

    ends = np.append(gait.events, 1.0)
    standing = gait.stance((ends[1:] + ends[:-1]) / 2).sum(axis=1)
    return int(standing.min()), int(standing.max())


def _as_dict(row: Row) -> dict[str, Any]:
    found: dict[str, Any] = {
        "name": row.gait.name,
        "legs": list(row.legs),
        "duty_factor": row.gait.duty_factor,
        "offsets": [float(offset) for offset in row.gait.offsets],
        "sway": row.gait.sway,
        "feet_down": list(_feet_down(row.gait)),
        "least_margin_m": row.margin if math.isfinite(row.margin) else None,
    }
    if row.shift is not None:
        found["body_shift_m"] = list(row.shift)
    if row.speed is not None:
        found |= {"largest_speed_m_per_s": row.speed, "limited_by": row.reason}
    return found


def _print_table(rows: list[Row]) -> None:
    heads = ["gait", "duty", "lifts at", "sway", "feet down", "margin"]
    lost = any(row.shift is not None for row in rows)
    heads += ["shift ahead, left"] if lost else ["largest speed"]
    lines = [heads]
    for row in rows:
        few, most = _feet_down(row.gait)
        cells = [
            plain(row.gait.name),
            _fraction(row.gait.duty_factor),
            " ".join(_fraction(float(offset)) for offset in row.gait.offsets),
            f"{row.gait.sway:g}" if row.gait.sway else "-",
            f"{few}" if few == most else f"{few} to {most}",
            f"{1000 * row.margin:.1f} mm" if math.isfinite(row.margin) else "none",
        ]
        if row.shift is not None:
            cells.append(", ".join(f"{1000 * way + 0.0:.1f}" for way in row.shift) + " mm")
        elif row.speed is not None:
            cells.append(f"{1000 * row.speed:.0f} mm/s")
        lines.append(cells)
    widths = [max(len(line[i]) for line in lines) for i in range(len(heads))]
    for line in lines:
        print(
            "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        )


def _fraction(number: float) -> str:
    """Return a phase as a fraction with a small denominator, or as a decimal."""
    near = Fraction(number).limit_denominator(LARGEST_FRACTION)
    return str(near) if abs(float(near) - number) < 1e-12 else f"{number:.3f}"


def _print_diagram(row: Row, robot: Robot) -> None:
    from phasmid.gait import gait_diagram

    names = [f"{leg} {plain(robot.legs[leg - 1].name).replace('_', ' ')}" for leg in row.legs]
    width = max(map(len, names))
    print(f"\n{plain(row.gait.name)}: one cycle, █ on the ground, · in the air")
    for name, line in zip(names, gait_diagram(row.gait), strict=True):
        print(f"  {name.ljust(width)}  {line}")
