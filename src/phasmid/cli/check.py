"""``phasmid check``: is this robot or scenario possible, and if not, why not."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from phasmid.motion import Walk
    from phasmid.robot import Robot
    from phasmid.scenario import Scenario


def run(options: argparse.Namespace) -> int:
    """Check the file that the options name; returns the exit status."""
    from phasmid.robot import load_robot, preset_names
    from phasmid.scenario import load_scenario
    from phasmid.toml import read_toml

    source = options.file
    if source in preset_names():
        return _check_robot(load_robot(source))
    if Path(source).suffix == ".toml" or Path(source).exists():
        raw, _ = read_toml(Path(source))
        if {"legs", "leg", "body"} & set(raw):
            return _check_robot(load_robot(source))
    return _check_scenario(load_scenario(source))


def _check_robot(robot: Robot) -> int:
    import numpy as np

    from phasmid.errors import InfeasibleWalk
    from phasmid.kinematics import joint_angles, longest_stride
    from phasmid.units import STANDARD_GRAVITY

    print(
        f"robot {robot.name}: {len(robot.legs)} legs, {robot.mass:.3f} kg "
        f"({robot.mass * STANDARD_GRAVITY:.2f} N), servo {robot.servo.name}"
    )
    print(f"  body {1000 * robot.body.mass:.1f} g")
    for number, leg in enumerate(robot.legs, 1):
        lengths = " / ".join(f"{1000 * length:.4g}" for length in leg.lengths)
        q = np.degrees(joint_angles(leg, leg.neutral_foot))
        x, y, z = 1000 * leg.mount_position
        turns = {"pitch": np.degrees(leg.mount_pitch), "roll": np.degrees(leg.mount_roll)}
        tilt = "".join(f", {name} {turn:.4g}°" for name, turn in turns.items() if turn)
        print(
            f"  {number} {leg.name:<13} {lengths} mm, hip at ({x:.4g}, {y:.4g}, {z:.4g}) mm{tilt}, "
            f"neutral at {', '.join(f'{a:.1f}' for a in q)}°, "
            f"{' / '.join(f'{1000 * link.mass:.1f}' for link in leg.links)} g"
        )
    ahead, side = longest_stride(robot), longest_stride(robot, np.pi / 2)
    print(f"  longest stride: {1000 * ahead:.0f} mm ahead, {1000 * side:.0f} mm sideways")
    if ahead <= 0:
        raise InfeasibleWalk(
            "the neutral feet cannot be reached within the joint limits.",
            hint="another neutral_foot_mm, or wider joint_limits",
        )
    print("possible.")
    return 0


def _check_scenario(scenario: Scenario) -> int:
    import numpy as np

    from phasmid.motion import plan
    from phasmid.scenario import idle_fields
    from phasmid.simulation import check_load, check_time_step

    walk = plan(scenario)
    check_time_step(scenario, walk.robot)
    check_load(scenario, walk)
    speed = float(np.abs(walk.qd).max())
    print(
        f"scenario {scenario.name}: {walk.robot.name}, {walk.gait.name} gait, "
        f"{scenario.duration:g} s, {len(walk.time)} samples"
    )
    way = 1000 * (walk.trunk.position[-1] - walk.trunk.position[0])
    print(
        f"  planned way: {way[0]:.1f} mm ahead, {way[1]:.1f} mm to the left, "
        f"{np.degrees(walk.trunk.yaw[-1]):.1f}° turn"
    )
    print(
        f"  fastest joint: {speed:.2f} rad/s; the servo {walk.robot.servo.name} allows "
        f"{walk.robot.servo.no_load_speed:.2f} rad/s"
    )
    print(f"  smallest support margin: {1000 * float(walk.support_margin.min()):.1f} mm")
    for line in _on_terrain(scenario, walk):
        print(f"  {line}")
    for sentence in idle_fields(scenario):
        print(f"phasmid: note: {sentence}", file=sys.stderr)
    print("possible.")
    return 0


def _on_terrain(scenario: Scenario, walk: Walk) -> list[str]:
    """What a walk does on its terrain, where that is not level ground."""
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
