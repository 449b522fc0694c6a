"""The judge names what no body, joint or servo can be, with the number that shows it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from formats.trees import block, with_link
from phasmid.formats import Severity, judge_robot, robot_from_tree, tree_of
from phasmid.robot import load_robot, preset_names
from phasmid.robot.inertial import Inertial

MK4 = replace(load_robot("phantomx-mk4"), appearance=None)
TREE = tree_of(MK4)
COXA, TIBIA = "left_front_coxa_link", "left_front_tibia_link"


def of(mass, com, moments):
    return Inertial(mass, np.array(com, dtype=float), np.diag(moments).astype(float))


@pytest.mark.parametrize("preset", preset_names())
def test_the_judge_has_nothing_against_the_presets(preset):
    robot = load_robot(preset)
    assert {finding.severity for finding in judge_robot(robot)} <= {Severity.NOTE}
    severities = {finding.severity for finding in robot_from_tree(tree_of(robot)).findings}
    assert severities <= {Severity.NOTE}


def bar(mass, com, moments):
    """The Mark IV with a tibia that is a bar of 131 × 20 × 20 mm."""
    shape = block((0, -0.01, -0.01), (MK4.legs[0].tibia.length, 0.01, 0.01))
    return with_link(TREE, TIBIA, inertial=of(mass, com, moments), parts=(shape,))


# A bar of 172 g: m/12 (b² + c²), m/12 (a² + b²).
MASS, BAR = 0.1718, (1.15e-5, 2.51e-4, 2.51e-4)


AT_CENTRE = (0.065, 0, 0)


@pytest.mark.parametrize(
    ("tree", "said"),
    [
        (bar(MASS, AT_CENTRE, BAR), ""),
        (
            bar(MASS, AT_CENTRE, tuple(1e3 * m for m in BAR)),
            f"impossible link {TIBIA}: inertia 0.25 kg m^2 gives a gyration radius of 1 200 mm for",
        ),
        (bar(MASS, (0.16, 0, 0), BAR), f"suspect link {TIBIA}: centre of mass is 29.1 mm"),
        (
            bar(MASS, AT_CENTRE, (1.15e-5, 2.51e-3, 2.51e-3)),
            f"suspect link {TIBIA}: inertia 0.00251 kg m² with 171.8 g gives a gyration radius of",
        ),
        (
            with_link(TREE, COXA, inertial=of(0.5, (0, 0, 0), (2e-4,) * 3)),
            "suspect leg right_front: is not the mirror image of leg left_front: the coxas' masses",
        ),
    ],
)
def test_an_impossible_or_unlikely_number_is_named(tree, said):
    imported = robot_from_tree(tree)
    found = [f for f in imported.findings if f.severity is not Severity.NOTE]
    assert (imported.robot is None) == said.startswith("impossible")
    told = [f"{f.severity.value} {f.sentence}" for f in found]
    assert told[0].startswith(said) if said else not told


def test_masses_that_were_copied_are_suspect():
    tree = TREE
    for part in ("coxa", "femur", "tibia"):
        for side in ("left", "right"):
            link = f"{side}_front_{part}_link"
            tree = with_link(tree, link, inertial=of(MASS, (0.04, 0, 0), BAR))
    (found,) = [f for f in robot_from_tree(tree).findings if f.severity is Severity.SUSPECT]
    assert found.sentence == (
        "legs 1, 6: coxa, femur and tibia all have 171.8 g; unlike parts must have masses of "
        "their own."
    )


def test_a_robot_must_stand_over_its_feet():
    """A robot that topples on feet that phasmid assumed is not impossible."""
    body = replace(MK4.body, com=np.array([0, 1.5, 0]), size=np.full(3, 2.0), inertia=np.eye(3))
    robot = replace(MK4, body=body)
    for read, severity in ((False, Severity.IMPOSSIBLE), (True, Severity.SUSPECT)):
        found = [f.severity for f in judge_robot(robot, read=read) if f.subject == "robot"]
        assert found == [severity]


def changed(legs=("left_rear",), **fields):
    made = [replace(leg, **fields) if leg.name in legs else leg for leg in MK4.legs]
    return replace(MK4, legs=tuple(made))


def with_range(row, low, high):
    limits = MK4.legs[0].joint_limits.copy()
    limits[row] = np.radians([low, high])
    return {"joint_limits": limits}


def with_servo(**numbers):
    return replace(MK4, servo=replace(MK4.servo, **numbers))


REAR = MK4.leg("left_rear")


LONGER = replace(REAR.tibia, length=REAR.tibia.length + 0.02)
ASIDE = REAR.mount_position + np.array([0.01, 0, 0])


@pytest.mark.parametrize(
    ("robot", "said"),
    [
        (changed(mount_yaw=math.radians(-135)), "leg left_rear: points across the body: its hip"),
        (
            changed(
                tibia=LONGER, mount_position=ASIDE, mount_yaw=REAR.mount_yaw - math.radians(10)
            ),
            "leg right_rear: is not the mirror image of leg left_rear: the hips' places differ by "
            "10 mm; their directions differ by 10°; the tibias' lengths differ by 20 mm.",
        ),
        (changed(("right_front",), **with_range(2, -60, 0)), "joint right_front.tibia: stands at"),
        # Times of the weight at a leg's length: 1000 N·m over 31.6 N times 0.246 m.
        (
            with_servo(rated_stall_torque=1000.0),
            "servos: effort 1000 N·m would lift 129 such robots",
        ),
        (with_servo(rated_no_load_speed=100.0), "servos: speed is 100 rad/s; the limit is"),
    ],
)
def test_what_is_suspect_of_a_robot_is_told(robot, said):
    (found,) = (f for f in judge_robot(robot) if f.sentence.startswith(said))
    assert found.severity is not Severity.NOTE
