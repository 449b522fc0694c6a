"""``phasmid check``: check whether a robot or scenario is physically possible."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from phasmid.cli.robot_options import add_import_options, import_options
from phasmid.cli.tables import print_table
from phasmid.errors import InvalidInput, plain
from phasmid.units import plain_number

if TYPE_CHECKING:
    from phasmid.forces import ServoVerdict
    from phasmid.formats import Imported
    from phasmid.scenario import Scenario

OPTIONS = {
    "FILE": "a robot (TOML, URDF, MJCF, STEP) or a scenario file, or a preset",
    "--gait GAIT": "gait of the servo verdict; default: the first of its number of legs, or the "
    "scenario's",
    "--json": "print the robot's numbers as JSON",
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_import_options(parser)


def run(options: argparse.Namespace) -> int:
    """Check a file, and return the exit status."""
    from phasmid.formats import import_robot, is_foreign, load_scenario
    from phasmid.robot import preset_names
    from phasmid.toml import is_file, read_toml

    source = options.file
    suffix = Path(source).suffix.lower()
    is_robot = source in preset_names() or is_foreign(source)
    if not is_robot and (suffix == ".toml" or is_file(Path(source))):
        raw, _ = read_toml(Path(source))
        is_robot = bool({"legs", "leg", "body"} & set(raw))
    if is_robot:
        imported = import_robot(source, import_options(options), strict=options.strict)
        return _check_robot(imported, options.gait, as_json=options.json)
    if options.json:
        raise InvalidInput("--json is for robots; this is a scenario.")
    scenario = load_scenario(source)
    return _check_scenario(scenario.replace(gait=options.gait) if options.gait else scenario)


def _check_robot(imported: Imported, gait: str | None, *, as_json: bool) -> int:
    from phasmid.formats import describe
    from phasmid.gait import gaits_of
    from phasmid.scenario import load_scenario

    found = describe(imported)
    robot, verdict = imported.robot, None
    if robot is not None:
        first = gait or next(iter(gaits_of(len(robot.legs))), None)
        scenario = load_scenario("paper").replace(robot=robot)
        scenario = scenario.replace(gait=first) if first else scenario
        if found["possible"] and first:
            found["findings"] += _plain_walk(scenario)
        verdict = _verdict(scenario) if first else None
        if verdict is not None:
            found["servo_verdict"] = verdict.as_dict()
            found["findings"] += _too_weak(verdict, scenario)
            found["possible"] &= verdict.is_possible
    if as_json:
        print(json.dumps(found, indent=2))
    else:
        if found["robot"]:
            _print_robot(found["robot"], verdict)
        _print_findings(found["findings"])
    if found["possible"]:
        if not as_json:
            print("possible.")
        return 0
    count = sum(finding["severity"] == "impossible" for finding in found["findings"])
    counted = "1 finding is" if count == 1 else f"{count} findings are"
    what = f"it cannot walk as it is: {counted} impossible."
    if imported.robot is None:
        what = imported.impossible[0].sentence
    hint = imported.impossible[0].hint if imported.impossible else ""
    print(f"phasmid: {InvalidInput(what, hint=hint)}", file=sys.stderr)
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


def _too_weak(verdict: ServoVerdict, scenario: Scenario) -> list[dict[str, str]]:
    """Return a finding where the servos do not hold, with a gait in which they do."""
    from phasmid.forces import Holding
    from phasmid.gait import gaits_of

    if verdict.is_possible:
        return []
    hint = "a stronger servo, a lighter robot, or feet nearer to the hips"
    for name in gaits_of(len(scenario.base_robot().legs)):
        other = _verdict(scenario.replace(gait=name))
        if other is not None and other.holding in (Holding.HOLDS, Holding.LIMITED):
            hint = f"--gait {name}, {hint}"
            break
    what = f"the {verdict.servo} does not hold this robot in the {verdict.gait} gait."
    finding = {"severity": "impossible", "subject": "servos", "what": what, "where": ""}
    return [finding | {"hint": hint}]


def _plain_walk(scenario: Scenario) -> list[dict[str, str]]:
    """Return a finding where ``phasmid walk --robot`` needs other settings."""
    from phasmid.errors import PhasmidError
    from phasmid.motion import plan
    from phasmid.simulation import check_time_step

    try:
        check_time_step(scenario, plan(scenario))
    except PhasmidError as error:
        finding = {"subject": "the paper's walk", "what": f"it needs other settings: {error.what}"}
        # Only an option can follow the command.
        hint = f"phasmid walk {error.hint}" if error.hint.startswith("-") else error.hint
        return [{"severity": "note", "where": "", "hint": hint, **finding}]
    return []


def _print_verdict(verdict: ServoVerdict | None) -> None:
    for line in () if verdict is None else verdict.lines:
        print(f"  servos: {plain(line)}")


def _print_robot(robot: dict[str, Any], verdict: ServoVerdict | None) -> None:
    servo, body = robot["servo"], robot["body"]
    print(
        f"robot {plain(robot['name'])}: {len(robot['legs'])} legs, {robot['mass_g'] / 1000:.3f} kg "
        f"({robot['weight_n']:.2f} N), servo {plain(servo['name'])} "
        f"({plain_number(servo['stall_torque_nm'], 3)} N·m, "
        f"{plain_number(servo['no_load_speed_rad_per_s'], 3)} rad/s)"
    )
    _print_verdict(verdict)
    size = " × ".join(plain_number(side) for side in body["size_mm"])
    print(f"  body {body['mass_g']:.1f} g, {size} mm")
    rows = [
        ["leg", "lengths mm", "left mm", "hip mm", "yaw, pitch, roll °", "neutral °", "masses g"]
    ]
    for number, leg in enumerate(robot["legs"], 1):
        rows.append(
            [
                f"{number} {plain(leg['name'])}",
                " / ".join(plain_number(length) for length in leg["lengths_mm"]),
                plain_number(sum(leg["lateral_offsets_mm"])),
                ", ".join(plain_number(round(x, 6) + 0.0) for x in leg["hip_mm"]),
                ", ".join(plain_number(leg[f"{angle}_deg"]) for angle in ("yaw", "pitch", "roll")),
                ", ".join(f"{angle:.1f}" for angle in leg["neutral_deg"] or ()),
                " / ".join(f"{mass:.1f}" for mass in leg["masses_g"]),
            ]
        )
    print_table(rows)
    for number, leg in enumerate(robot["legs"], 1):
        if "file" in leg:
            print(f"  leg {number} is {_origin(leg['file'])}")
    limits = robot["legs"][0]["limits_deg"]
    if all(leg["limits_deg"] == limits for leg in robot["legs"]):
        found = (
            f"{joint} {plain_number(low)}° to {plain_number(high)}°"
            for joint, (low, high) in limits.items()
        )
        print(f"  joint limits: {', '.join(found)}")
    stride = robot["longest_stride_mm"]
    ahead, side = stride["ahead"], stride["sideways"]
    print(f"  longest stride: {ahead:.0f} mm ahead, {side:.0f} mm sideways")


def _origin(file: dict[str, Any]) -> str:
    """Return the file's joints of a leg, and its angles in terms of the file's φ."""
    joints = []
    for name, sign, offset in zip(file["joints"], file["signs"], file["offsets_deg"], strict=True):
        shift = f" {offset:+.4g}°" if abs(offset) > 5e-4 else ""
        joints.append(f"{plain(name)} ({'φ' if sign > 0 else '−φ'}{shift})")
    return ", ".join(joints)


def _print_findings(findings: list[dict[str, str]]) -> None:
    """Print findings, the worst first."""
    order = ("impossible", "suspect", "note")
    for finding in sorted(findings, key=lambda finding: order.index(finding["severity"])):
        subject, what = plain(finding["subject"]), plain(finding["what"])
        about = "" if not subject or what.startswith(subject) else f"{subject}: "
        where = f" ({plain(finding['where'])})" if finding["where"] else ""
        print(f"  {finding['severity']:<10} {about}{what}{where}")
        if finding["hint"]:
            print(f"  {'':<10} try {plain(finding['hint'])}")


def _check_scenario(scenario: Scenario) -> int:
    import numpy as np

    from phasmid.forces import scenario_verdict
    from phasmid.motion import fastest, plan
    from phasmid.scenario import idle_fields
    from phasmid.simulation import check_load, check_time_step

    walk = plan(scenario)
    check_time_step(scenario, walk)
    check_load(scenario, walk)
    speed = float(np.abs(walk.qd).max())
    limit, supply = fastest(scenario, walk.robot.servo)
    print(
        f"scenario {scenario.name}: {plain(walk.robot.name)}, {plain(walk.gait.name)} gait, "
        f"{scenario.duration:g} s, {len(walk.time)} samples"
    )
    verdict = scenario_verdict(scenario)
    _print_verdict(verdict)
    way = 1000 * (walk.trunk.position[-1] - walk.trunk.position[0])
    print(
        f"  planned way: {way[0]:.1f} mm ahead, {way[1]:.1f} mm to the left, "
        f"{np.degrees(walk.trunk.yaw[-1]):.1f}° turn"
    )
    print(
        f"  fastest joint: {speed:.2f} rad/s; the servo {plain(walk.robot.servo.name)} allows "
        f"{limit:.2f} rad/s{supply}"
    )
    print(f"  smallest support margin: {1000 * float(walk.support_margin.min()):.1f} mm")
    for sentence in idle_fields(scenario):
        print(f"phasmid: note: {plain(sentence)}", file=sys.stderr)
    for finding in _too_weak(verdict, scenario):
        print(f"phasmid: {InvalidInput(finding['what'], hint=finding['hint'])}", file=sys.stderr)
        return 2
    print("possible.")
    return 0
