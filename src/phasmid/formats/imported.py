"""Result of reading a robot: the robot, findings, and the origin of its parts in the file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.errors import PhasmidError
from phasmid.formats.findings import Finding
from phasmid.robot import Robot, Servo


@dataclass(frozen=True, eq=False)
class LegFacts:
    """Origin of a leg in its file.

    A servo whose angle is the file's φ stands at our joint angle ``signs · φ + offsets``.

    Attributes:
        name: Of the leg.
        joints: The file's names of coxa, femur and tibia joint.
        links: The file's names of the links that became coxa, femur and tibia.
        foot: Where the foot comes from, in words.
        signs: 1 or -1 for each joint, shape (3,).
        offsets: Our angles where the file's are 0 [rad], shape (3,).
        lengths: Of coxa, femur and tibia [m], shape (3,).
        mount_position: Hip in the body frame [m], shape (3,).
        mount_angles: Yaw, pitch and roll of the hip [rad], shape (3,).
        limits: Lowest and highest joint angles of ours [rad], shape (3, 2).
        masses: Of coxa, femur and tibia [kg]; NaN where there is none, shape (3,).
        neutral_foot: In the hip frame [m]; None where it cannot stand, shape (3,).
    """

    name: str
    joints: tuple[str, str, str]
    links: tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]
    foot: str
    signs: Float[np.ndarray, "3"]
    offsets: Float[np.ndarray, "3"]
    lengths: Float[np.ndarray, "3"]
    mount_position: Float[np.ndarray, "3"]
    mount_angles: Float[np.ndarray, "3"]
    limits: Float[np.ndarray, "3 2"]
    masses: Float[np.ndarray, "3"]
    neutral_foot: Float[np.ndarray, "3"] | None


@dataclass(frozen=True, eq=False)
class ImportFacts:
    """Origin of a robot in its file, as far as it was read.

    Attributes:
        name: Of the robot.
        trunk: The file's names of the links that became the trunk.
        legs: The legs, in the robot's order.
        mass: Of all links [kg].
        mass_source: Where masses and inertias come from, in words.
        servo: The servo; None where the file and the options give none.
        servo_source: Where the servo comes from, in words.
        foot_source: Where the neutral feet come from, in words.
    """

    name: str
    trunk: tuple[str, ...]
    legs: tuple[LegFacts, ...]
    mass: float
    mass_source: str
    servo: Servo | None
    servo_source: str
    foot_source: str


@dataclass(frozen=True, eq=False)
class Imported:
    """Result of reading a robot.

    Attributes:
        robot: The robot; None where there can be none.
        findings: Of the reader, the leg finder and the judge.
        error: Why there is no robot; None where there is one.
        facts: Origin of the robot's parts; None where no legs were found.
    """

    robot: Robot | None
    findings: tuple[Finding, ...]
    error: PhasmidError | None = None
    facts: ImportFacts | None = None
