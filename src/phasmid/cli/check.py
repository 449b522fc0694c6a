"""``phasmid check``: check whether a robot or scenario is physically possible."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from phasmid.cli.robot_options import add_import_options, import_options
from phasmid.errors import InvalidInput, plain
from phasmid.units import plain_number

if TYPE_CHECKING:
    from collections.abc import Callable

    from phasmid.forces import ServoVerdict
    from phasmid.formats import Imported
    from phasmid.motion import Walk
    from phasmid.robot import Robot
    from phasmid.scenario import Scenario


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "file",
        metavar="FILE",
        help="a robot (TOML, URDF, MJCF, STEP) or a scenario file, or a preset",
    )
    parser.add_argument(
        "--gait",
        metavar="GAIT",
        help="gait of the servo verdict; default: the first of its number of "
        "legs, or the scenario's",
    )
    parser.add_argument("--json", action="store_true", help="print the robot's numbers as JSON")
    parser.add_argument(
        "--write-sidecar",
        action="store_true",
        help="write a first guess of FILE.toml, with the values missing in a STEP file",
    )
    parser.add_argument("--force", action="store_true", help="replace an older sidecar")
    add_import_options(parser)


def run(options: argparse.Namespace) -> int:
    """Check a file, and return the exit status."""
    from phasmid.formats import import_robot, is_foreign, load_scenario
    from phasmid.robot import preset_names
    from phasmid.toml import is_file, read_toml

    source = options.file
    suffix = Path(source).suffix.lower()
    if options.write_sidecar:
        return _write_sidecar(Path(source), force=options.force)
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


def _write_sidecar(path: Path, *, force: bool) -> int:
    from phasmid.formats.step_in import sidecar_of
    from phasmid.formats.step_out import first_guess
    from phasmid.recording.file import write_whole

    sidecar = sidecar_of(path)
    if sidecar.exists() and not force:
        raise InvalidInput(f"{sidecar} exists; nothing was written.", hint="--force")
    write_whole(sidecar, first_guess(path).encode("utf-8"))
    print(f"Written to {plain(str(sidecar))}: correct it, then phasmid check {plain(str(path))}")
    return 0


def _check_robot(imported: Imported, gait: str | None, *, as_json: bool) -> int:
    from phasmid.formats import describe

    found = describe(imported)
    if found["possible"] and imported.robot is not None:
        found["findings"] += _plain_walk(imported.robot)
    robot = imported.robot
    verdict = None if robot is None else _verdict(robot, gait)
    if robot is not None and verdict is not None:
        found["servo_verdict"] = verdict.as_dict()
        found["findings"] += _too_weak(verdict, len(robot.legs), lambda name: _verdict(robot, name))
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


def _verdict(robot: Robot, gait: str | None) -> ServoVerdict | None:
    """Return the servo verdict; None if the robot cannot stand at all.

    Raises:
        InvalidGait: The robot has no such gait.
    """
    from phasmid.errors import Unreachable
    from phasmid.forces import servo_verdict
    from phasmid.gait import gaits_of, load_gait

    legs = len(robot.legs)
    name = gait or next(iter(gaits_of(legs)), None)
    if name is None:
        return None
    chosen = load_gait(name, legs, robot.leg_names)
    try:
        return servo_verdict(robot, chosen)
    except Unreachable:
        # A neutral foot out of reach is a finding already.
        return None


def _too_weak(
    verdict: ServoVerdict, legs: int, verdict_in: Callable[[str], ServoVerdict | None]
) -> list[dict[str, str]]:
    """Return a finding where the servos do not hold, with a gait in which they do.

    Args:
        verdict: Of the gait that was chosen.
        legs: Number of legs.
        verdict_in: The verdict by a gait's name.
    """
    from phasmid.forces import Holding
    from phasmid.gait import gaits_of

    if verdict.is_possible:
        return []
    hint = "a stronger servo, a lighter robot, or feet nearer to the hips"
    for name in gaits_of(legs):
        other = verdict_in(name)
        if other is not None and other.holding in (Holding.HOLDS, Holding.LIMITED):
            hint = f"--gait {name}, {hint}"
            break
    what = f"the {verdict.servo} does not hold this robot in the {verdict.gait} gait."
    finding = {"severity": "impossible", "subject": "servos", "what": what, "where": ""}
    return [finding | {"hint": hint}]


def _plain_walk(robot: Robot) -> list[dict[str, str]]:
    """Return a finding where ``phasmid walk --robot`` needs other settings."""
    from phasmid.errors import PhasmidError
    from phasmid.gait import gaits_of
    from phasmid.motion import plan
    from phasmid.scenario import load_scenario
    from phasmid.simulation import check_time_step

    gaits = gaits_of(len(robot.legs))
    if not gaits:
        return []
    try:
        scenario = load_scenario("paper")
        scenario = scenario.replace(robot=robot, gait=next(iter(gaits)))
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
    width = max(len(leg["name"]) for leg in robot["legs"])
    for number, leg in enumerate(robot["legs"], 1):
        lengths = " / ".join(plain_number(length) for length in leg["lengths_mm"])
        hip = ", ".join(plain_number(round(x, 6) + 0.0) for x in leg["hip_mm"])
        left = sum(leg["lateral_offsets_mm"])
        side = "left" if left > 0 else "right"
        beside = f", foot {plain_number(abs(left))} mm to its {side}" if left else ""
        turned = [
            f"{name} {plain_number(leg[f'{name}_deg'])}°" for name in ("yaw", "pitch", "roll")
        ]
        turned = [words for words in turned if words.startswith("yaw") or not words.endswith(" 0°")]
        neutral = leg["neutral_deg"]
        at = f", neutral at {', '.join(f'{a:.1f}' for a in neutral)}°" if neutral else ""
        masses = " / ".join(f"{mass:.1f}" for mass in leg["masses_g"])
        print(
            f"  {number} {plain(leg['name']):<{width}} {lengths} mm{beside}, hip at ({hip}) mm, "
            f"{', '.join(turned)}{at}, {masses} g"
        )
        if "file" in leg:
            print(f"    {'':<{width}} {_origin(leg['file'])}")
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
        shift = (
            f" {'+' if offset > 0 else '−'} {plain_number(abs(offset))}°"
            if abs(offset) > 5e-4
            else ""
        )
        joints.append(f"{plain(name)} ({'φ' if sign > 0 else '−φ'}{shift})")
    return f"is {', '.join(joints)}"


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
    for line in _on_terrain(scenario, walk):
        print(f"  {line}")
    for sentence in idle_fields(scenario):
        print(f"phasmid: note: {plain(sentence)}", file=sys.stderr)
    if not verdict.is_possible:
        (finding,) = _too_weak(
            verdict,
            len(walk.robot.legs),
            lambda name: scenario_verdict(scenario.replace(gait=name)),
        )
        print(f"phasmid: {InvalidInput(finding['what'], hint=finding['hint'])}", file=sys.stderr)
        return 2
    print("possible.")
    return 0


def _on_terrain(scenario: Scenario, walk: Walk) -> list[str]:
    """Return lines about a walk on terrain; none on level ground."""
    import numpy as np

    from phasmid.motion import Course

    ground, planned = scenario.load_terrain(), scenario.planned_terrain()
    kind = scenario.terrain.kind
    if isinstance(walk.course, Course):
        height, steepest = walk.trunk.position[:, 2], np.degrees(np.abs(walk.trunk.attitude))
        roll, pitch, _ = steepest.max(axis=0)
        return [
            f"terrain {kind}, known to the planner: the trunk rises by "
            f"{1000 * (height[-1] - height[0]):.1f} mm, pitches by {pitch:.1f}° and rolls by "
            f"{roll:.1f}° at most",
            f"  {walk.course.moved} of {int(walk.course.counted.sum())} footholds are moved to a "
            "better place",
        ]
    if ground.is_level == planned.is_level and ground.patches == planned.patches:
        return []
    return [f"terrain {kind}, which the planner takes for level"]
