"""Is a description possible."""

from __future__ import annotations

from phasmid.formats.findings import Finding
from phasmid.robot import Robot


def judge_robot(robot: Robot) -> tuple[Finding, ...]:
    return ()
