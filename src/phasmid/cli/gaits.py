"""``phasmid gaits``: the gaits of a robot with support margins and largest speeds."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

from phasmid.cli.options import Number
from phasmid.cli.output import print_table, say
from phasmid.cli.scenario_options import add_import_options, import_options
from phasmid.errors import plain

if TYPE_CHECKING:
    from phasmid.gait import Gait
    from phasmid.robot import Robot

LARGEST_FRACTION = 24
"""Denominator up to which a phase is shown as a fraction."""

OPTIONS = {
    "--robot ROBOT": ("a preset or a file; default: phantomx-paper", "phantomx-paper"),
    "--step-length-mm MM": Number("way of the body while a foot stands", -10_000, 10_000, 40),
    "--lost 1,2,...": "legs that are lost: how it walks on",
    "--diagram": "draw gait diagrams",
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_import_options(parser)
    parser.add_argument(
        "gaits", nargs="*", metavar="GAIT", help="names or gait files (.toml); default: all"
    )


def run(options: argparse.Namespace) -> int:
    """List gaits, and return the exit status."""
    from phasmid.cli.walk import leg_numbers
    from phasmid.formats import load_robot
    from phasmid.gait import gaits_of, least_margin, load_gait, without_legs
    from phasmid.kinematics import centre_of_mass, joint_angles, neutral_feet
    from phasmid.motion import longest_stride

    robot = load_robot(options.robot, import_options(options))
    step = options.step_length_mm / 1000
    lost = leg_numbers(options.lost, robot, "--lost") or ()
    count, names = len(robot.legs), robot.leg_names
    feet = neutral_feet(robot)[:, :2]
    com = centre_of_mass(robot, joint_angles(robot.arrays, robot.arrays.neutral_foot))[:2]
    gaits = [load_gait(name, count, names) for name in options.gaits]
    heads = ["gait", "duty", "lifts at", "sway", "feet", "margin"]
    rows = [[*heads, *(["shift ahead, left"] if lost else ["step", "speed"])]]
    legs = [leg for leg in range(1, count + 1) if leg not in lost]
    shown = []
    for gait in gaits or gaits_of(count).values():
        if lost:
            limp = without_legs(gait, lost, feet, com, step=(step, 0.0, 0.0))
            last = [", ".join(f"{1000 * way + 0.0:.1f}" for way in limp.shift) + " mm"]
            shown.append(limp.gait)
            margin = limp.margin
        else:
            margin = least_margin(gait, feet, com, (step, 0.0, 0.0))
            longest = longest_stride(robot, gait, supported=True)
            last = [f"{math.floor(1000 * longest)}"]
            last.append(f"{1000 * _fastest(robot, gait):.0f}")
            shown.append(gait)
        rows.append([*_cells(shown[-1], margin), *last])
    say(f"{plain(robot.name)}: {len(robot.legs)} legs, a step of {1000 * step:g} mm ahead")
    others = "" if lost else "; longest step [mm] and highest speed [mm/s] ahead"
    say(f"least margin of support [mm]{others}\n")
    print_table(rows)
    for gait in shown if options.diagram or options.gaits else ():
        _print_diagram(gait, legs, names)
    return 0


def _fastest(robot: Robot, gait: Gait) -> float:
    """Return the largest forward speed [m/s]."""
    from phasmid.control.engine import LocomotionEngine

    return LocomotionEngine(robot, gait=gait).largest_velocity((1.0, 0.0, 0.0)).velocity[0]


def _cells(gait: Gait, margin: float) -> list[str]:
    """Return the cells of a gait with its least support margin [m]."""
    import numpy as np

    ends = np.append(gait.events, 1.0)
    down = gait.stance((ends[1:] + ends[:-1]) / 2).sum(axis=1)
    few, most = int(down.min()), int(down.max())
    return [
        plain(gait.name),
        _fraction(gait.duty_factor),
        " ".join(_fraction(float(offset)) for offset in gait.offsets),
        f"{gait.sway:g}" if gait.sway else "-",
        f"{few}" if few == most else f"{few} to {most}",
        f"{1000 * margin:.1f}" if math.isfinite(margin) else "none",
    ]


def _fraction(number: float) -> str:
    """Return a phase as a fraction with a small denominator, or as a decimal."""
    near = Fraction(number).limit_denominator(LARGEST_FRACTION)
    return str(near) if abs(float(near) - number) < 1e-12 else f"{number:.3f}"


def _print_diagram(gait: Gait, legs: Sequence[int], leg_names: Sequence[str]) -> None:
    from phasmid.gait import gait_diagram

    names = [f"{leg} {plain(leg_names[leg - 1]).replace('_', ' ')}" for leg in legs]
    width = max(map(len, names))
    say(f"\n{plain(gait.name)}: one cycle, █ on the ground, · in the air")
    for name, line in zip(names, gait_diagram(gait), strict=True):
        say(f"  {name.ljust(width)}  {line}")
