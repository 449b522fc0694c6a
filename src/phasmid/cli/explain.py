"""``phasmid explain``: why a foot position, a posture or a walk is impossible, and the nearest."""

from __future__ import annotations

import argparse
import math
import shlex
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

from phasmid.cli.output import print_table, say
from phasmid.cli.plot import check_figure_path, write_figure
from phasmid.cli.progress import announce_compilation
from phasmid.cli.remedies import typed
from phasmid.cli.result_folder import result_folder
from phasmid.cli.scenario_options import SCENARIO, add_field_options, scenario_of
from phasmid.errors import InvalidInput, plain

if TYPE_CHECKING:
    import numpy as np
    from jaxtyping import Float

    from phasmid.kinematics import FootExplanation
    from phasmid.robot import Robot
    from phasmid.scenario import Scenario

OPTIONS = {
    **SCENARIO,
    "--frame FRAME": ("axes of the foot position: body or hip; default: body", "body"),
    "--pose X,Y,Z": "displacement of the body forward, left, up [m], the feet in their places",
    "--rpy-deg R,P,Y": "roll, pitch and yaw of the body [°], the feet in their places",
    "--out FILE": "the picture: svg, png or pdf; default: results/NAME/explanation.svg",
    "--force": "replace an older picture",
    "--quiet": "print only the verdict",
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "--foot-at",
        nargs=2,
        metavar=("LEG", "X,Y,Z"),
        help="a leg by name or number, and a foot position [m], such as right_front "
        "0.30,-0.12,-0.10",
    )
    add_field_options(parser)


def run(options: argparse.Namespace) -> int:
    """Print an explanation and draw it; return the exit status: 1 where it is impossible."""
    is_posture = options.pose is not None or options.rpy_deg is not None
    if is_posture and options.foot_at is not None:
        raise InvalidInput(
            "--foot-at and a posture are two questions; one of them must go.",
            hint="phasmid explain --pose 0,0,0.05",
        )
    if options.frame not in ("body", "hip"):
        raise InvalidInput(f'--frame is "{plain(options.frame)}"; it must be body or hip.')
    if options.out is not None:
        check_figure_path("--out", Path(options.out), force=options.force)
    explain = _walk
    if is_posture:
        explain = _posture
    elif options.foot_at is not None:
        explain = _foot
    return explain(scenario_of(options), options)


def _foot(scenario: Scenario, options: argparse.Namespace) -> int:
    """Explain one foot position."""
    from phasmid.kinematics import explain_foot

    robot = scenario.load_robot()
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
    words = ["explain", plain(leg.name), text]
    _draw(robot, [foot], f"A foot position of {leg.name}", options, scenario, words)
    return 0 if foot.is_possible else 1


def _posture(scenario: Scenario, options: argparse.Namespace) -> int:
    """Explain a posture of the body over the neutral feet."""
    import numpy as np

    from phasmid.motion import explain_posture

    robot = scenario.load_robot()
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
    words = ["explain", *([f"pose-{options.pose}"] if options.pose else [])]
    words += [f"rpy-deg-{options.rpy_deg}"] if options.rpy_deg else []
    _draw(robot, feet, "A posture over the neutral feet", options, scenario, words)
    return 0 if found.is_possible else 1


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


def _walk(scenario: Scenario, options: argparse.Namespace) -> int:
    """Explain the walk of a scenario."""
    import numpy as np

    from phasmid.motion import explain_walk, fastest
    from phasmid.motion.feasibility import stride_words

    found, robot = explain_walk(scenario), scenario.load_robot()
    say(plain(found.sentence))
    gait = scenario.load_gait(len(robot.legs), robot.leg_names)
    if not options.quiet and found.walk is not None:
        walk = found.walk
        limit, supply = fastest(scenario, robot.servo)
        say(f"Fastest joint: {np.abs(walk.qd).max():.2f} of {limit:.2f} rad/s{supply}")
        say(f"Support margin: {1000 * walk.support_margin.min():.1f} mm at least")
    elif not options.quiet:
        if found.feet:
            say("\nFarthest out of reach:")
            _print_feet(found.feet, options)
        say()
        if found.stride is None:
            hint = typed(found.refusal.hint, ["explain"]) if found.refusal else ""
            say("No step length is possible with this gait, period and stance.")
            say(f"  try  {plain(hint)}" if hint else "")
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
    if found.feet:
        title = f"A {plain(gait.name)} walk, step {stride_words(scenario.stride.step)}"
        _draw(robot, found.feet, title, options, scenario, ["explain"])
    return 0 if found.is_possible else 1


def _numbers(flag: str, text: str, hint: str) -> Float[np.ndarray, "3"]:
    """Return the three numbers of an option."""
    import numpy as np

    from phasmid.cli.scenario_options import number_or_text

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
    import numpy as np

    from phasmid.robot import JOINTS

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
    import numpy as np

    from phasmid.kinematics import foot_position, foot_violations
    from phasmid.kinematics.workspace import usable_limits

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
    import numpy as np

    length, sideways, turn = np.trunc([1000 * step[0], 1000 * step[1], 10 * np.degrees(step[2])])
    texts = [f"--step-length-mm {length:g}"]
    texts += [f"--step-sideways-mm {sideways:g}"] * bool(step[1])
    return " ".join(texts + [f"--step-turn-deg {turn / 10:g}"] * bool(step[2]))


def _draw(
    robot: Robot,
    feet: Sequence[FootExplanation],
    title: str,
    options: argparse.Namespace,
    scenario: Scenario,
    words: Sequence[str],
) -> None:
    """Draw the explanation of feet into the file of the options."""
    from phasmid.reporting.explanation_figure import explanation_figure

    path = _picture(options, scenario, words)
    joint, room = feet[0].margin
    note = f"nearest limit: {feet[0].leg.name}.{joint}, {math.degrees(room):.1f}° away"
    if not feet[0].is_possible:
        note = f"{feet[0].leg.name}: nearest possible foot {1000 * feet[0].distance:.1f} mm away"
    write_figure(explanation_figure(robot, feet, title, [robot.name, note]), [path])
    if not options.quiet:
        say(f"\nWritten to {plain(str(path))}")


def _picture(options: argparse.Namespace, scenario: Scenario, words: Sequence[str]) -> Path:
    """Return the file of the options, or one in the next free result folder."""
    folder = result_folder(options, scenario, words)
    return folder if options.out else folder / "explanation.svg"
