"""A robot that is written as a tree and read again is the same robot."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from formats.trees import block
from general_robot import general_robot
from phasmid.formats import (
    Severity,
    extension_of,
    import_robot,
    robot_from_tree,
    save_robot,
    tree_of,
)
from phasmid.robot import Appearance, Leg, Robot, load_robot, preset_names

ROUND_OFF = 1e-12
"""A dozen products and sums of numbers up to 4, each rounded to 2e-16 of its size."""


def differences(a: Any, b: Any, path: str = "") -> list[str]:
    """Fields of two robots that differ by more than round-off, by name."""
    found: list[str] = []
    for field in fields(a):
        x, y, name = getattr(a, field.name), getattr(b, field.name), f"{path}{field.name}"
        if isinstance(x, Appearance):
            continue
        if isinstance(x, tuple) and is_dataclass(x[0]):
            for i, (one, other) in enumerate(zip(x, y, strict=True)):
                found += differences(one, other, f"{name}[{i}].")
        elif is_dataclass(x):
            found += differences(x, y, f"{name}.")
        elif isinstance(x, str) or x is None:
            found += [name] * (x != y)
        elif not np.allclose(x, y, rtol=0, atol=ROUND_OFF):
            found.append(name)
    return found


ROBOTS = [*map(load_robot, preset_names()), general_robot()]


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_robot_comes_back_from_its_tree_in_every_field(robot: Robot) -> None:
    imported = robot_from_tree(tree_of(robot, extension_of(robot)))
    assert imported.error is None
    assert imported.robot is not None
    assert not differences(robot, imported.robot)
    assert not [f for f in imported.findings if f.severity is Severity.IMPOSSIBLE]


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_robot_comes_back_from_an_mjcf_file_in_every_field(robot: Robot, tmp_path: Path) -> None:
    save_robot(robot, tmp_path / "robot.xml")
    imported = import_robot(tmp_path / "robot.xml")
    assert imported.error is None
    assert imported.robot is not None
    assert not differences(robot, imported.robot)
    assert not [f for f in imported.findings if f.severity is Severity.IMPOSSIBLE]


def random_robot(seed: int) -> Robot:
    """Four to eight legs unlike each other, hips turned at random, as far as legs may be."""
    rng = np.random.default_rng(seed)
    base = general_robot()
    legs = []
    for i in range(int(rng.integers(4, 9))):
        coxa, femur, tibia = (
            replace(link, length=float(link.length * rng.uniform(0.7, 1.3)))
            for link in base.legs[int(rng.integers(5))].links
        )
        low = rng.uniform(-3, -1, 3)
        legs.append(
            Leg(
                f"leg {i} of {seed}",
                coxa,
                femur,
                tibia,
                mount_position=rng.uniform(-0.3, 0.3, 3),
                mount_yaw=rng.uniform(-2 * np.pi, 2 * np.pi),
                neutral_foot=np.array([coxa.length + femur.length, 0.01, -tibia.length]),
                joint_limits=np.stack([low, low + rng.uniform(1, 3, 3)], axis=1),
                femur_bend=rng.uniform(-2, 2),
                tibia_bend=rng.uniform(-2, 2),
                mount_pitch=rng.uniform(-np.pi, np.pi),
                mount_roll=rng.uniform(-np.pi, np.pi),
            )
        )
    settings = {
        field.name: rng.uniform(0.5, 1) * getattr(base.servo, field.name)
        for field in fields(base.servo)
        if isinstance(getattr(base.servo, field.name), float)
    }
    servo = replace(base.servo, name='a "servo"', **settings)
    return replace(
        base, name=f"näme {seed}", legs=tuple(legs), servo=servo, description='two\nlines "quoted"'
    )


@pytest.mark.parametrize("seed", range(20))
def test_any_robot_comes_back_from_its_tree_in_every_field(seed: int) -> None:
    """Also with hips upside down, and angles of more than half a turn."""
    robot = random_robot(seed)
    imported = robot_from_tree(tree_of(robot, extension_of(robot)))
    assert imported.error is None
    assert imported.robot is not None
    assert not differences(robot, imported.robot)


def test_a_look_comes_back_with_its_links() -> None:
    shape = block((0.0, -0.01, -0.01), (0.05, 0.01, 0.01))
    robot = general_robot()
    parts = {"body": (shape,), "leg_2.femur": (shape, shape)}
    robot = replace(robot, appearance=Appearance.of(parts))
    imported = robot_from_tree(tree_of(robot, extension_of(robot)))
    assert imported.robot is not None
    look = imported.robot.appearance
    assert look is not None
    assert {name: len(found) for name, found in look.parts.items()} == {"body": 1, "leg_2.femur": 2}
    for found in look.parts["leg_2.femur"]:
        np.testing.assert_allclose(found.vertices, shape.vertices, atol=1e-15)


def refusal(extension: str) -> str:
    imported = robot_from_tree(tree_of(general_robot(), extension))
    assert imported.robot is None
    assert imported.error is not None
    return str(imported.error)


def test_extensions_of_strangers_are_bounded_and_checked() -> None:
    good = extension_of(general_robot())
    assert refusal("x" * 200_000).startswith(
        "its phasmid extension has 200000 characters; the limit is 100000."
    )
    assert refusal("a = [").startswith("its phasmid extension line 1: ")
    assert "nested too deeply." in refusal("a = " + "[" * 9000)
    assert refusal("run = 1\n" + good).startswith(
        'unknown key "run".\n  in   its phasmid extension'
    )
    assert refusal(good.replace("stall_torque = 1.5", "stall_torque = nan")).startswith(
        "servo AX-12A: stall_torque is nan; it must be a finite number, greater than 0."
    )
    assert refusal(good.replace("neutral_foot = [", "neutral_foot = [inf, ", 1)).startswith(
        "legs.leg_0.neutral_foot is "
    )


def test_an_extension_of_other_legs_is_left_out_and_told() -> None:
    robot = load_robot("phantomx-ax")
    tree = tree_of(robot, extension_of(robot).replace('"left_rear_coxa"', '"elsewhere"'))
    imported = robot_from_tree(tree)
    assert imported.robot is not None
    assert imported.robot.leg_names == robot.leg_names
    assert imported.robot.servo == robot.servo
    (told,) = [f for f in imported.findings if f.severity is Severity.SUSPECT]
    assert "elsewhere" in told.what
    assert told.what.endswith("what it says of legs was ignored.")
