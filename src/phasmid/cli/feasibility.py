"""Why a foot position, a posture or a walk is impossible, and the nearest possible one."""

from __future__ import annotations

import argparse
import math
import shlex
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np
from jaxtyping import Float

from phasmid.cli.figures import write_figure
from phasmid.cli.output import print_table, say
from phasmid.cli.progress import announce_compilation
from phasmid.cli.scenario_options import number_or_text
from phasmid.errors import InvalidInput, plain
from phasmid.kinematics import FootExplanation, explain_foot, foot_position, foot_violations
from phasmid.kinematics.workspace import usable_limits
from phasmid.motion import WalkExplanation, explain_posture
from phasmid.motion.feasibility import stride_words
from phasmid.robot import JOINTS, Robot
from phasmid.scenario import Scenario


def explain_foot_position(scenario: Scenario, options: argparse.Namespace) -> bool:
    """Explain one foot position; return whether it is possible."""
    robot = scenario.build().robot
    name, text = options.foot_at
    leg = robot.leg(int(name) if name.isdecimal() and name.isascii() else name)
    place = _numbers("--foot-at LEG", text, "0.30,-0.12,-0.10")
    X = leg.X_body_hip
    wanted = place if options.frame == "hip" else (place - X[:3, 3]) @ X[:3, :3]
    foot = explain_foot(leg, wanted)
    say(plain(foot.sentence))
    if not options.quiet:
        say(f"\nWanted, in {options.frame} axes: ({_millimetres(foot.wanted, foot, options)}) mm")
        _print_feet([foot], options)
        _print_angles([foot])
        possible = _rounded(foot, options.frame)
        if possible is not None:
            typed_place = ",".join(f"{x:.4f}" for x in possible.tolist())
            frame = " --frame hip" if options.frame == "hip" else ""
            say(f"  try  --foot-at {shlex.quote(plain(name))} {typed_place}{frame}")
    _draw(robot, [foot], f"A foot position of {leg.name}", options)
    return foot.is_possible


def explain_pose(scenario: Scenario, options: argparse.Namespace) -> bool:
    """Explain a posture of the body over the neutral feet; return whether it is possible."""
    robot = scenario.build().robot
    shift = _numbers("--pose", options.pose or "0,0,0", "0,0,0.05")
    tilt = _numbers("--rpy-deg", options.rpy_deg or "0,0,0", "0,20,0")
    found = explain_posture(robot, np.concatenate([shift, np.radians(tilt)]))
    say(plain(found.sentence))
    if not options.quiet:
        if found.obstacles:
            say()
            _print_feet(found.obstacles, options)
        nearest = found
        if not found.is_possible:
            share = math.floor(1000 * found.share) / 1000
            place = ", ".join(f"{1000 * x:z.1f}" for x in share * shift)
            angles = ", ".join(f"{angle:z.1f}" for angle in share * tilt)
            nearest = explain_posture(robot, share * found.pose)
            say(f"\nLargest share: ({place}) mm, ({angles})°; {nearest.margin_words}")
        _print_angles(nearest.feet)
        if not found.is_possible and nearest.is_possible and share > 0:
            say(f"  try  {_posture_options(share * shift, share * tilt)}")
        say(f"Trunk over the ground: {1000 * found.clearance:.1f} mm")
        if math.isfinite(found.support_margin):
            say(f"Support margin: {1000 * found.support_margin:.1f} mm")
        _print_controller(robot, found.pose)
    first = [*found.obstacles, found.tightest][0]
    feet = [first, *(foot for foot in found.feet if foot is not first)]
    _draw(robot, feet, "A posture over the neutral feet", options)
    return found.is_possible


def _print_controller(robot: Robot, pose: Float[np.ndarray, "6"]) -> None:
    """Print which share of a posture the locomotion engine takes, within its margins."""
    from phasmid.control import LocomotionEngine
    from phasmid.control.records import MAX_LEGS

    if len(robot.legs) > MAX_LEGS:
        return
    announce_compilation()
    share, reason = LocomotionEngine(robot).largest_pose_share(pose)
    why = "" if share == 1 else f": {plain(reason)}"
    say(f"The controller, which keeps margins, takes {100 * share:.1f} % of it{why}")


def explain_refusal(found: WalkExplanation, options: argparse.Namespace) -> None:
    """Print where the feet of a refused walk leave their reach, and its longest possible step."""
    gait = found.experiment.course.gait
    if options.quiet:
        return
    if found.feet:
        say("Farthest out of reach:")
        _print_feet(found.feet, options)
    if found.stride is None:
        say("No step length is possible with this gait, period and stance.")
    else:
        seconds = gait.duty_factor * found.stride.period
        step = found.stride.step
        speed = 1000 * math.hypot(step[0], step[1]) / seconds
        rate = abs(math.degrees(step[2])) / seconds
        words = [f"{speed:.1f} mm/s"] * (speed > 0) + [f"{rate:.1f} °/s"] * (rate > 0)
        longest = stride_words(step, down=True)
        say(f"Longest possible step: {longest}, which is {' and '.join(words)}")
        if found.limit:
            say(f"A longer one is impossible: {plain(found.limit)}.")
        say(f"  try  {_step_options(step)}")


def draw_walk(found: WalkExplanation, options: argparse.Namespace) -> None:
    """Draw the feet of a walk that are nearest to a limit, or farthest beyond it."""
    if found.feet:
        course = found.experiment.course
        title = f"A {plain(course.gait.name)} walk, step {stride_words(course.stride.step)}"
        _draw(found.experiment.robot, found.feet, title, options)


def _numbers(flag: str, text: str, hint: str) -> Float[np.ndarray, "3"]:
    """Return the three numbers of an option."""
    parts = [number_or_text(part) for part in text.split(",")]
    if len(parts) != 3 or any(
        isinstance(part, str) or not math.isfinite(part) or abs(part) > LARGEST for part in parts
    ):
        raise InvalidInput(
            f'{flag} is "{plain(text)}"; it must be three numbers with commas between.',
            hint=f"{flag} {hint}",
        )
    return np.array(parts, dtype=float)


LARGEST = 1000.0
"""Largest number of an option [m, °]."""


def _millimetres(
    hip_foot: Float[np.ndarray, "3"], foot: FootExplanation, options: argparse.Namespace
) -> str:
    """Return a foot position in the axes of the options [mm]."""
    X = foot.leg.X_body_hip
    shown = hip_foot if options.frame == "hip" else X[:3, :3] @ hip_foot + X[:3, 3]
    return ", ".join(f"{1000 * x:z.0f}" for x in shown)


def _print_feet(feet: Sequence[FootExplanation], options: argparse.Namespace) -> None:
    """Print one row per violated limit of each foot, and the nearest possible position."""
    rows = [["leg", "needs", "limits", "beyond", f"nearest, {options.frame} mm", "away"]]
    for foot in feet:
        nearest = [_millimetres(foot.nearest, foot, options), f"{1000 * foot.distance:.1f} mm"]
        name = plain(foot.leg.name)
        for violation in foot.violations:
            factor, unit, digits = 1000.0, " mm", 0
            if violation.is_angle:
                factor, unit, digits = math.degrees(1.0), "°", 1
            needed, low, high, excess = (
                factor * value
                for value in (
                    violation.needed,
                    violation.lowest,
                    violation.highest,
                    violation.excess,
                )
            )
            limits = f"{low:.4g} to {high:.4g}{unit}"
            if math.isinf(high):
                limits = f"from {low:.4g}{unit}"
            needs = f"{violation.what} {needed:.{digits}f}{unit}"
            rows.append([name, needs, limits, f"{excess:.1f}{unit}", *nearest])
            name, nearest = "", ["", ""]
    if rows[1:]:
        print_table(rows)


def _print_angles(feet: Sequence[FootExplanation]) -> None:
    """Print the joint angles of each foot, or of the nearest possible position."""
    rows = [
        [plain(foot.leg.name), *(f"{angle:z.1f}°" for angle in np.degrees(foot.nearest_q))]
        for foot in feet
        if np.isfinite(foot.nearest_q).all()
    ]
    if rows:
        at = "" if all(foot.is_possible for foot in feet) else " at the nearest position"
        say(f"\nJoint angles{at}:")
        print_table([["leg", *JOINTS], *rows], right=(1, 2, 3))


def _rounded(foot: FootExplanation, frame: str) -> Float[np.ndarray, "3"] | None:
    """Return a possible position near the nearest one in tenths of a millimetre, in a frame [m].

    None where the wanted one is possible, or the joint limits permit no position.
    """
    if foot.is_possible or not np.isfinite(foot.nearest).all():
        return None
    leg, (low, high) = foot.leg, usable_limits(foot.leg).T
    X = np.eye(4) if frame == "hip" else leg.X_body_hip
    # In a corner of the workspace no rounded position is possible: farther from the limits one is.
    for room in np.radians([0.0, 0.1, 0.2, 0.5, 1.0, 2.0]):
        q = np.clip(foot.nearest_q, np.minimum(low + room, high), np.maximum(high - room, low))
        p = 1e4 * (X[:3, :3] @ foot_position(leg, q) + X[:3, 3])
        for corner in product(*zip(np.floor(p), np.ceil(p), strict=True)):
            rounded = np.array(corner) / 1e4
            if not foot_violations(leg, (rounded - X[:3, 3]) @ X[:3, :3]):
                return rounded
    return None


def _posture_options(shift: Float[np.ndarray, "3"], tilt: Float[np.ndarray, "3"]) -> str:
    """Return the options of a posture [m, °]."""
    given = (("--pose", shift), ("--rpy-deg", tilt))
    return " ".join(
        f"{flag} {','.join(f'{x:z.6g}' for x in values)}" for flag, values in given if values.any()
    )


def _step_options(step: Float[np.ndarray, "3"]) -> str:
    """Return the options of a step [m, m, rad], rounded down."""
    length, sideways, turn = np.trunc([1000 * step[0], 1000 * step[1], 10 * np.degrees(step[2])])
    texts = [f"--step-length-mm {length:g}"]
    texts += [f"--step-sideways-mm {sideways:g}"] * bool(step[1])
    return " ".join(texts + [f"--step-turn-deg {turn / 10:g}"] * bool(step[2]))


def _draw(
    robot: Robot, feet: Sequence[FootExplanation], title: str, options: argparse.Namespace
) -> None:
    """Draw the explanation of feet into the file of the options, if they name one."""
    if options.out is None:
        return
    from phasmid.reporting.explanation_figure import explanation_figure

    joint, room = feet[0].margin
    note = f"nearest limit: {feet[0].leg.name}.{joint}, {math.degrees(room):.1f}° away"
    if not feet[0].is_possible:
        note = f"{feet[0].leg.name}: nearest possible foot {1000 * feet[0].distance:.1f} mm away"
    figure = explanation_figure(robot, feet, title, [robot.name, note])
    write_figure(figure, [Path(options.out)])
    if not options.quiet:
        say(f"\nWritten to {plain(options.out)}")
