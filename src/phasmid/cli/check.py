"""``phasmid check``: check whether a robot or scenario is physically possible."""

from __future__ import annotations

import argparse
import math
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from phasmid.cli.output import print_table, say
from phasmid.cli.remedies import typed
from phasmid.cli.scenario_options import add_import_options, field_arguments, import_options
from phasmid.errors import InvalidInput, plain
from phasmid.units import STANDARD_GRAVITY, plain_number

if TYPE_CHECKING:
    import numpy as np

    from phasmid.forces import ServoVerdict
    from phasmid.formats import Finding, FoundLeg, Imported
    from phasmid.gait import Gait
    from phasmid.robot import Robot, Servo
    from phasmid.scenario import Scenario

OPTIONS = {
    "FILE": "a robot (TOML, URDF, MJCF, STEP) or a scenario file, or a preset",
    "--gait GAIT": "gait of the servo verdict; default: the first of its number of legs, or the "
    "scenario's",
}


WALK = "phasmid walk"
"""Subject of findings on the walk with the settings of the command alone."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_import_options(parser)


def run(options: argparse.Namespace) -> int:
    """Check a file, and return the exit status."""
    from phasmid.formats import import_robot, is_foreign
    from phasmid.robot import preset_names
    from phasmid.scenario import load_scenario
    from phasmid.toml import is_file, read_toml

    source = options.file
    suffix = Path(source).suffix.lower()
    is_robot = source in preset_names() or is_foreign(source)
    if not is_robot and (suffix == ".toml" or is_file(Path(source))):
        raw, _ = read_toml(Path(source))
        is_robot = bool({"legs", "leg", "body"} & set(raw))
    if is_robot:
        imported = import_robot(source, import_options(options), strict=options.strict)
        return _check_robot(imported, options)
    scenario = load_scenario(source)
    return _check_scenario(scenario.replace(gait=options.gait) if options.gait else scenario)


def _check_robot(imported: Imported, options: argparse.Namespace) -> int:
    from phasmid.formats import Severity
    from phasmid.gait import gaits_of
    from phasmid.scenario import load_scenario

    findings, robot = [*imported.findings], imported.robot
    if robot is not None:
        gait, verdict = None, None
        if gaits_of(len(robot.legs)):
            scenario = load_scenario("paper").for_robot(robot)
            scenario = scenario.replace(gait=options.gait) if options.gait else scenario
            gait = scenario.load_gait(len(robot.legs), robot.leg_names)
            if not imported.impossible:
                findings += _plain_walk(scenario, options)
            verdict = _verdict(scenario)
            findings += _too_weak(verdict, scenario)
        _print_robot(robot, imported.legs, verdict, gait)
    _print_findings(findings, options.file)
    count = sum(finding.severity is Severity.IMPOSSIBLE for finding in findings)
    if robot is not None and not count:
        other = any(finding.subject == WALK for finding in findings)
        say("possible, but not with the settings of phasmid walk." if other else "possible.")
        return 0
    counted = "1 finding is" if count == 1 else f"{count} findings are"
    what = f"the robot as described cannot walk: {counted} impossible."
    if robot is None:
        what = imported.impossible[0].sentence
    hint = imported.impossible[0].hint if imported.impossible else ""
    hint = typed(hint, ["check", options.file], Path(options.file).name)
    say(f"phasmid: {InvalidInput(what, hint=hint)}", file=sys.stderr)
    return 2


def _verdict(scenario: Scenario) -> ServoVerdict | None:
    """Return the servo verdict; None if a neutral foot is out of reach, which is a finding.

    Raises:
        InvalidGait: The robot has no such gait.
    """
    from phasmid.errors import Unreachable
    from phasmid.forces import scenario_verdict

    try:
        return scenario_verdict(scenario)
    except Unreachable:
        return None


def _too_weak(verdict: ServoVerdict | None, scenario: Scenario) -> list[Finding]:
    """Return a finding where the servos do not hold, with a gait in which they do."""
    from phasmid.forces import Holding
    from phasmid.formats import Finding, Severity
    from phasmid.gait import gaits_of
    from phasmid.robot.servo_words import servo_label

    if verdict is None or verdict.is_possible:
        return []
    hint = "a stronger servo, a lighter robot, or feet nearer to the hips"
    for name in gaits_of(len(scenario.base_robot().legs)):
        other = _verdict(scenario.replace(gait=name))
        if other is not None and other.holding in (Holding.HOLDS, Holding.LIMITED):
            hint = f"--gait {name}, {hint}"
            break
    what = f"the {servo_label(verdict.servo)} does not hold this robot in the {verdict.gait} gait."
    return [Finding(Severity.IMPOSSIBLE, "servos", what, hint=hint)]


def _plain_walk(scenario: Scenario, options: argparse.Namespace) -> list[Finding]:
    """Return a finding where ``phasmid walk --robot`` needs other settings."""
    from phasmid.errors import PhasmidError
    from phasmid.formats import Finding, Severity
    from phasmid.motion import plan
    from phasmid.simulation import with_time_step

    try:
        with_time_step(scenario, plan(scenario))
    except PhasmidError as error:
        walk = ["walk", "--robot", options.file, *field_arguments(options)]
        walk += ["--gait", options.gait] if options.gait else []
        hint = typed(error.hint, walk)
        # Only an option can follow the command.
        hint = f"phasmid {shlex.join(walk)} {hint}" if hint.startswith("-") else hint
        return [Finding(Severity.SUSPECT, WALK, f"is refused: {error.what}", hint=hint)]
    return []


def _print_verdict(verdict: ServoVerdict | None) -> None:
    for line in () if verdict is None else verdict.lines:
        say(f"  servos: {plain(line)}")


def _print_sources(servo: Servo) -> None:
    """Print which of a servo's numbers are of its data sheet, identified, or assumed."""
    for line in servo.source_lines:
        say(f"  servos: {plain(line)}")


def _print_robot(
    robot: Robot, origins: Sequence[FoundLeg], verdict: ServoVerdict | None, gait: Gait | None
) -> None:
    """Print a robot, its servo verdict, and the joints of the file that became its legs."""
    import numpy as np

    from phasmid.errors import PhasmidError
    from phasmid.kinematics import joint_angles
    from phasmid.motion import longest_stride
    from phasmid.robot.servo_words import servo_words
    from phasmid.scenario.tables import StrideTable

    servo, body = robot.servo, robot.body
    say(
        f"robot {plain(robot.name)}: {len(robot.legs)} legs, {robot.mass:.3f} kg "
        f"({robot.mass * STANDARD_GRAVITY:.2f} N), {plain(servo_words(servo.name))} "
        f"({plain_number(servo.stall_torque, 3)} N·m, "
        f"{plain_number(servo.no_load_speed, 3)} rad/s)"
    )
    _print_verdict(verdict)
    _print_sources(servo)
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
            f"  longest step: {ahead} mm ahead, {side} mm sideways, in the "
            f"{plain(gait.name)} gait with a lift of {1000 * StrideTable().step_height:.0f} mm"
        )


def _print_limits(robot: Robot) -> None:
    """Print the joint limits, those of legs that are alike in one line."""
    import numpy as np

    from phasmid.robot import JOINTS

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
    from phasmid.robot import JOINTS

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
        if hint := typed(finding.hint, ["check", file], Path(file).name):
            say(f"  {'':<10} try {plain(hint)}")


def _check_scenario(scenario: Scenario) -> int:
    import numpy as np

    from phasmid.forces import scenario_verdict
    from phasmid.motion import fastest, plan
    from phasmid.robot.servo_words import servo_words
    from phasmid.scenario import idle_fields
    from phasmid.simulation import check_load, with_time_step

    walk = plan(scenario)
    with_time_step(scenario, walk)
    check_load(scenario, walk)
    speed = float(np.abs(walk.qd).max())
    limit, supply = fastest(scenario, walk.robot.servo)
    say(
        f"scenario {scenario.name}: {plain(walk.robot.name)}, {plain(walk.gait.name)} gait, "
        f"{scenario.duration:g} s, {len(walk.time)} samples"
    )
    verdict = scenario_verdict(scenario)
    _print_verdict(verdict)
    _print_sources(walk.robot.servo)
    way = 1000 * (walk.trunk.position[-1] - walk.trunk.position[0])
    say(
        f"  planned way: {way[0]:.1f} mm ahead, {way[1]:.1f} mm to the left, "
        f"{np.degrees(walk.trunk.yaw[-1]):.1f}° turn"
    )
    say(
        f"  fastest joint: {speed:.2f} rad/s; the "
        f"{plain(servo_words(walk.robot.servo.name))} allows {limit:.2f} rad/s{supply}"
    )
    say(f"  smallest support margin: {1000 * float(walk.support_margin.min()):.1f} mm")
    for sentence in idle_fields(scenario):
        say(f"phasmid: note: {plain(sentence)}", file=sys.stderr)
    for finding in _too_weak(verdict, scenario):
        say(f"phasmid: {InvalidInput(finding.what, hint=finding.hint)}", file=sys.stderr)
        return 2
    say("possible.")
    return 0
