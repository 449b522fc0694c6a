"""A robot that is written as a tree and read again is the same robot."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from general_robot import general_robot
from phasmid.formats import (
    Severity,
    extension_of,
    import_robot,
    robot_from_tree,
    save_robot,
    tree_of,
)
from phasmid.robot import Appearance, Robot, load_robot, preset_names

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
