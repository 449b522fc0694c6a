"""``phasmid gaits``: the gaits of a robot with support margins and largest speeds."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from phasmid.cli.output import print_table, say
from phasmid.cli.scenario_options import SCENARIO, print_idle, scenario_of, scenario_options
from phasmid.cli.walk import leg_numbers
from phasmid.errors import plain
from phasmid.gait import Gait, gait_diagram, gaits_of, least_margin, without_legs
from phasmid.kinematics import centre_of_mass, joint_angles, neutral_feet
from phasmid.motion import longest_stride
from phasmid.motion.feasibility import stride_words
from phasmid.scenario import Scenario
from phasmid.scenario.tables import GaitTable

LARGEST_FRACTION = 24
"""Denominator up to which a phase is shown as a fraction."""

OPTIONS = {
    "--lost 1,2,...": "legs that are lost: how the robot walks on without them",
    "--diagram": "draw the gait diagrams of all gaits",
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.set_defaults(quiet=False)
    scenario_options(parser, SCENARIO.format("phantomx-paper and a step of 40 mm"))


def run(options: argparse.Namespace) -> int:
    """List gaits, and return the exit status."""
    scenario = scenario_of(options, default=None)
    print_idle(scenario, options, "the list of gaits")
    experiment = scenario.build()
    robot, stride = experiment.robot, experiment.course.stride
    step = (stride.step_length, stride.step_sideways, stride.step_turn)
    lost = leg_numbers(options.lost, robot, "--lost") or ()
    count, names = len(robot.legs), robot.leg_names
    feet = neutral_feet(robot)[:, :2]
    com = centre_of_mass(robot, joint_angles(robot.arrays, robot.arrays.neutral_foot))[:2]
    # The gait of the scenario alone, if it names one.
    own = None if scenario.gait == GaitTable() else experiment.course.gait
    heads = ["gait", "duty", "lifts at", "sway", "feet", "margin"]
    rows = [[*heads, *(["shift ahead, left"] if lost else ["step", "speed"])]]
    legs = [leg for leg in range(1, count + 1) if leg not in lost]
    shown = []
    for gait in gaits_of(count).values() if own is None else [own]:
        if lost:
            limp = without_legs(gait, lost, feet, com, step=step)
            last = [", ".join(f"{1000 * way + 0.0:.1f}" for way in limp.shift) + " mm"]
            shown.append(limp.gait)
            margin = limp.margin
        else:
            margin = least_margin(gait, feet, com, step)
            longest = longest_stride(robot, gait, stride, supported=True)
            last = [f"{math.floor(1000 * longest)}"]
            last.append(f"{1000 * _fastest(scenario, gait):.0f}")
            shown.append(gait)
        rows.append([*_cells(shown[-1], margin), *last])
    ahead = " ahead" if stride.step_length > 0 and not any(step[1:]) else ""
    words = stride_words(stride.step)
    say(f"{plain(robot.name)}: {len(robot.legs)} legs, a step of {words}{ahead}")
    others = "" if lost else "; longest step [mm] and highest speed [mm/s] ahead"
    say(f"least margin of support [mm]{others}\n")
    print_table(rows)
    for gait in shown if options.diagram or own is not None else ():
        _print_diagram(gait, legs, names)
    return 0


def _fastest(scenario: Scenario, gait: Gait) -> float:
    """Return the largest forward speed [m/s]; without a period in the scenario by the engine's."""
    from phasmid.control.engine import LocomotionEngine

    stride = scenario.stride
    engine = LocomotionEngine(
        scenario.build().robot, gait=gait, period=stride.period, step_height=stride.step_height
    )
    return engine.largest_velocity((1.0, 0.0, 0.0)).velocity[0]


def _cells(gait: Gait, margin: float) -> list[str]:
    """Return the cells of a gait with its least support margin [m]."""
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
    names = [f"{leg} {plain(leg_names[leg - 1]).replace('_', ' ')}" for leg in legs]
    width = max(map(len, names))
    say(f"\n{plain(gait.name)}: one cycle, █ on the ground, · in the air")
    for name, line in zip(names, gait_diagram(gait), strict=True):
        say(f"  {name.ljust(width)}  {line}")
