"""``phasmid check``: is a robot, walk, posture or foot position possible, and why not?"""

from __future__ import annotations

import argparse
import math
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from phasmid.advice import Holding, ServoVerdict, servo_verdict
from phasmid.cli.feasibility import draw_walk, explain_foot_position, explain_pose, explain_refusal
from phasmid.cli.figures import check_figure_path
from phasmid.cli.options import refuse_given
from phasmid.cli.output import print_table, say
from phasmid.cli.remedies import typed
from phasmid.cli.scenario_options import (
    field_arguments,
    given_fields,
    print_idle,
    scenario_as_named,
    scenario_of,
    scenario_options,
)
from phasmid.errors import InvalidInput, PhasmidError, Unreachable, plain
from phasmid.experiment.course import StrideTable
from phasmid.formats import Finding, FoundLeg, Severity, import_robot
from phasmid.gait import Gait, gaits_of
from phasmid.kinematics import joint_angles
from phasmid.motion import explain_walk, longest_stride, plan
from phasmid.robot import JOINTS, Robot
from phasmid.scenario import Scenario, option_keys
from phasmid.servo import Servo
from phasmid.servo.words import servo_label, servo_words
from phasmid.units import STANDARD_GRAVITY, plain_number

OPTIONS = {
    "--frame FRAME": "axes of --foot-at: body or hip; default: body",
    "--pose X,Y,Z": "a posture: the body moved forward, left, up [m], the feet in their places",
    "--rpy-deg R,P,Y": "roll, pitch and yaw of the posture [°]",
    "--out FILE": "draw the feet that are nearest to a limit, or beyond it: svg, png or pdf",
    "--force": "replace an older picture",
    "--quiet": "print only the findings and the answer",
}

READING = {"robot", "gait"}
"""Fields that ask for a robot alone, with those of reading it."""

WALK = "phasmid walk"
"""Subject of findings on the walk where a robot alone is checked."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "--foot-at",
        nargs=2,
        metavar=("LEG", "X,Y,Z"),
        help="a leg by name or number, and a foot position [m], such as right_front "
        "0.30,-0.12,-0.10",
    )
    scenario_options(parser)


def run(options: argparse.Namespace) -> int:
    """Check a robot, walk, posture or foot position; return the exit status: 2 if impossible."""
    is_posture = options.pose is not None or options.rpy_deg is not None
    if is_posture and options.foot_at is not None:
        raise InvalidInput(
            "--foot-at and a posture are two questions; one of them must go.",
            hint="phasmid check --pose 0,0,0.05",
        )
    if options.foot_at is None:
        refuse_given(options, ("frame",), "needs --foot-at")
    options.frame = options.frame or "body"
    if options.frame not in ("body", "hip"):
        raise InvalidInput(f'--frame is "{plain(options.frame)}"; it must be body or hip.')
    if options.out is not None:
        check_figure_path("--out", Path(options.out), force=options.force)
    if is_posture or options.foot_at is not None:
        scenario = scenario_of(options)
        print_idle(scenario, options, "a posture")
        explain = explain_pose if is_posture else explain_foot_position
        return 0 if explain(scenario, options) else 2
    if given_fields(options).get("robot") is not None:
        return _check_robot(options)
    return _check_walk(scenario_of(options), options)


def _check_robot(options: argparse.Namespace) -> int:
    """Check the robot of the options, and its walk."""
    scenario = scenario_as_named(options)
    source = str(scenario.robot)
    imported = import_robot(source, scenario.robot_import, strict=options.strict)
    findings, verdict, gait = [*imported.findings], None, None
    is_walk = bool(options.scenario or options.out or _fields_of_walk(options))
    if imported.robot is not None:
        scenario = scenario.replace(robot=imported.robot)
        robot = scenario.load_robot()
        if gaits_of(len(robot.legs)):
            gait = scenario.load_gait(len(robot.legs), robot.leg_names)
            if not imported.impossible and not is_walk:
                findings += _plain_walk(scenario, options)
            verdict = _verdict(scenario)
            findings += _too_weak(verdict, scenario)
        if not options.quiet:
            _print_robot(robot, imported.legs, verdict, gait)
    _print_findings(findings, source)
    count = sum(finding.severity is Severity.IMPOSSIBLE for finding in findings)
    if imported.robot is not None and not count:
        if is_walk:
            return _check_walk(scenario, options, has_robot=True)
        print_idle(scenario, options, "a plan")
        other = any(finding.subject == WALK for finding in findings)
        say("possible, but not with the settings of phasmid walk." if other else "possible.")
        return 0
    counted = "1 finding is" if count == 1 else f"{count} findings are"
    what = f"the robot as described cannot walk: {counted} impossible."
    if imported.robot is None:
        what = imported.impossible[0].sentence
    hint = imported.impossible[0].hint if imported.impossible else ""
    hint = typed(hint, ["check", "--robot", source], Path(source).name)
    say(f"phasmid: {InvalidInput(what, hint=hint)}", file=sys.stderr)
    return 2


def _fields_of_walk(options: argparse.Namespace) -> set[str]:
    """Return the fields of the options that concern a walk, and not its robot alone."""
    keys = option_keys()
    return {
        key
        for key in given_fields(options)
        if keys[key][0] not in ("robot_import", "servo") and key not in READING
    }


def _verdict(scenario: Scenario) -> ServoVerdict | None:
    """Return the servo verdict; None if a neutral foot is out of reach, which is a finding.

    Raises:
        InvalidGait: The robot has no such gait.
    """
    try:
        return servo_verdict(scenario)
    except Unreachable:
        return None


def _too_weak(verdict: ServoVerdict | None, scenario: Scenario) -> list[Finding]:
    """Return a finding where the servos do not hold, with a gait in which they do."""
    if verdict is None or verdict.holding is not Holding.DOES_NOT_HOLD:
        return []
    hint = "a stronger servo, a lighter robot, or feet nearer to the hips"
    for name in gaits_of(len(scenario.build().robot.legs)):
        other = _verdict(scenario.replace(gait=name))
        if other is not None and other.holding.is_possible:
            hint = f"--gait {name}, {hint}"
            break
    what = f"the {servo_label(verdict.servo)} does not hold this robot in the {verdict.gait} gait."
    return [Finding(Severity.IMPOSSIBLE, "servos", what, hint=hint)]


def _plain_walk(scenario: Scenario, options: argparse.Namespace) -> list[Finding]:
    """Return a finding where ``phasmid walk --robot`` needs other settings."""
    from phasmid.simulation import with_time_step

    try:
        with_time_step(scenario, plan(scenario))
    except PhasmidError as error:
        walk = ["walk", *field_arguments(options)]
        hint = typed(error.hint, walk)
        # Only an option can follow the command.
        hint = f"phasmid {shlex.join(walk)} {hint}" if hint.startswith("-") else hint
        return [Finding(Severity.SUSPECT, WALK, f"is refused: {error.what}", hint=hint)]
    return []


def _print_servos(verdict: ServoVerdict | None, servo: Servo) -> None:
    """Print the verdict, and which of the servo's numbers are known, identified or assumed."""
    for line in (*(verdict.lines if verdict else ()), *servo.source_lines):
        say(f"  servos: {plain(line)}")


def _print_robot(
    robot: Robot, origins: Sequence[FoundLeg], verdict: ServoVerdict | None, gait: Gait | None
) -> None:
    """Print a robot, its servo verdict, and the joints of the file that became its legs."""
    servo, body = robot.servo, robot.body
    say(
        f"robot {plain(robot.name)}: {len(robot.legs)} legs, {robot.mass:.3f} kg "
        f"({robot.mass * STANDARD_GRAVITY:.2f} N), {plain(servo_words(servo.name))} "
        f"({plain_number(servo.stall_torque, 3)} N·m, "
        f"{plain_number(servo.no_load_speed, 3)} rad/s{servo.supply_words})"
    )
    _print_servos(verdict, servo)
    centre = np.round(1000 * body.box_centre, 2)
    about = f" about ({_listed(centre)}) mm" if centre.any() else ""
    say(f"  body {1000 * body.mass:.1f} g, {_listed(1000 * body.size, ' × ')} mm{about}")
    frames = [["leg", "lengths mm", "hip mm", "yaw, pitch, roll °"]]
    poses = [["leg", "left mm", "neutral °", "masses g"]]
    for number, leg in enumerate(robot.legs, 1):
        name = f"{number} {plain(leg.name)}"
        mount = np.degrees([leg.mount_yaw, leg.mount_pitch, leg.mount_roll])
        hip = np.round(1000 * leg.mount_position, 6)
        frames.append([name, _listed(1000 * leg.lengths, " / "), _listed(hip), _listed(mount)])
        try:
            neutral = np.degrees(joint_angles(leg, leg.neutral_foot))
        except PhasmidError:
            # A foot out of reach is a finding.
            neutral = np.empty(0)
        left = plain_number(1000 * leg.lateral_offsets.sum())
        masses = " / ".join(f"{1000 * link.mass:.1f}" for link in leg.links)
        poses.append([name, left, ", ".join(f"{angle:.1f}" for angle in neutral), masses])
    print_table(frames)
    print_table(poses)
    for number, origin in enumerate(origins, 1):
        say(f"  leg {number}: {_origin(origin)}")
    _print_limits(robot)
    if gait is not None:
        ahead, side = (
            longest_stride(robot, gait, direction=way, supported=True) for way in (0.0, np.pi / 2)
        )
        ahead, side = math.floor(1000 * ahead), math.floor(1000 * side)
        say(
            f"  longest step: {ahead} mm forward, {side} mm sideways, in the "
            f"{plain(gait.name)} gait with a lift of {1000 * StrideTable().step_height:.0f} mm"
        )


def _print_limits(robot: Robot) -> None:
    """Print the joint limits, those of legs that are alike in one line."""
    legs: dict[str, list[str]] = {}
    for number, leg in enumerate(robot.legs, 1):
        found = (
            f"{joint} {plain_number(low)}° to {plain_number(high)}°"
            for joint, (low, high) in zip(
                JOINTS, np.round(np.degrees(leg.joint_limits), 6).tolist(), strict=True
            )
        )
        legs.setdefault(", ".join(found), []).append(str(number))
    for limits, numbers in legs.items():
        of = f" of leg{'s' if len(numbers) > 1 else ''} {', '.join(numbers)}"
        say(f"  joint limits{of if len(legs) > 1 else ''}: {limits}")


def _listed(numbers: np.ndarray, separator: str = ", ") -> str:
    return separator.join(plain_number(number + 0.0) for number in numbers.tolist())


def _origin(leg: FoundLeg) -> str:
    """Return a leg's angles in terms of those of the file's joints."""
    angles = []
    for own, name, sign, offset in zip(JOINTS, leg.joints, leg.signs, leg.offsets, strict=True):
        shift = f" {'+' if offset > 0 else '−'} {abs(math.degrees(offset)):.4g}°"
        minus = "−" if sign < 0 else ""
        angles.append(f"{own} = {minus}{plain(name)}{shift if abs(offset) > 1e-5 else ''}")
    return ", ".join(angles)


def _print_findings(findings: Sequence[Finding], file: str) -> None:
    """Print findings, the worst first."""
    order = ("impossible", "suspect", "note")
    for finding in sorted(findings, key=lambda finding: order.index(finding.severity.value)):
        where = f" ({plain(finding.where)})" if finding.where else ""
        say(f"  {finding.severity.value:<10} {plain(finding.sentence)}{where}")
        if hint := typed(finding.hint, ["check", "--robot", file], Path(file).name):
            say(f"  {'':<10} try {plain(hint)}")


def _check_walk(scenario: Scenario, options: argparse.Namespace, *, has_robot: bool = False) -> int:
    """Check the walk of a scenario.

    Args:
        scenario: The scenario, with its robot.
        options: Those of the command line.
        has_robot: Whether robot and servos were checked before.
    """
    from phasmid.simulation import check_load, with_time_step

    found = explain_walk(scenario)
    walk = found.walk
    if walk is None:
        explain_refusal(found, options)
        draw_walk(found, options)
        assert found.refusal is not None
        raise found.refusal
    with_time_step(scenario, walk)
    check_load(scenario, walk)
    verdict = None if has_robot else servo_verdict(scenario)
    if not options.quiet:
        say(
            f"scenario {scenario.name}: {plain(walk.robot.name)}, {plain(walk.gait.name)} gait, "
            f"{scenario.duration:g} s, {len(walk.time)} samples"
        )
        if not has_robot:
            _print_servos(verdict, walk.robot.servo)
        speeds, limits = np.abs(walk.qd).max(axis=0), walk.robot.arrays.no_load_speed
        fastest = np.unravel_index(np.argmax(speeds / limits), limits.shape)
        speed, allowed = float(speeds[fastest]), float(limits[fastest])
        servo = walk.robot.servo
        way = 1000 * (walk.trunk.position[-1] - walk.trunk.position[0])
        say(
            f"  planned displacement: {way[0]:.1f} mm forward, {way[1]:.1f} mm to the left, "
            f"{np.degrees(walk.trunk.yaw[-1]):.1f}° turn"
        )
        say(
            f"  fastest joint: {speed:.2f} rad/s; the "
            f"{plain(servo_words(servo.name))} allows {allowed:.2f} "
            f"rad/s{servo.supply_words}"
        )
        say(f"  smallest support margin: {1000 * float(walk.support_margin.min()):.1f} mm")
        joint, room = found.feet[0].margin
        say(
            f"  joint nearest to its limit: {plain(found.feet[0].leg.name)}.{joint}, "
            f"{np.degrees(room):.1f}° away"
        )
    draw_walk(found, options)
    print_idle(scenario, options, "a plan")
    for finding in _too_weak(verdict, scenario):
        say(f"phasmid: {InvalidInput(finding.what, hint=finding.hint)}", file=sys.stderr)
        return 2
    say("possible.")
    return 0
