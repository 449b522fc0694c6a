"""Robot files as people have them are read, and each number that was not used is told at once."""

import math

import numpy as np
import pytest

from formats.urdf_hexapod import BOX, LEGS, LIMIT, hexapod, saved
from phasmid.errors import InvalidRobot
from phasmid.formats import ImportOptions, Severity, import_robot, load_robot
from phasmid.gait import gaits_of
from phasmid.kinematics import joint_angles, neutral_feet, trunk_clearance
from phasmid.motion import longest_stride, plan
from phasmid.robot import HEXAPOD_LEGS
from phasmid.scenario import load_scenario

TRIPOD = gaits_of(6)["tripod"]


def read(folder, text, **options):
    return import_robot(saved(folder, text), ImportOptions(**options))


def robot_of(folder, text, **options):
    imported = read(folder, text, **options)
    assert imported.robot is not None, imported.findings
    return imported.robot


def told(imported, severity, words):
    return [f.sentence for f in imported.findings if f.severity is severity and words in f.sentence]


def with_limit(lower, upper):
    return f'<limit lower="{lower}" upper="{upper}" effort="2.2" velocity="6"/>'


@pytest.mark.parametrize(
    ("limit", "severity", "words"),
    [
        (with_limit(-9.5, 9.5), "note", "limits -9.5 to 9.5 rad are a turn or more and no stops;"),
        (with_limit(-6.283185307, 6.283185307), "note", "are a turn or more and no stops; ±180°"),
        ('<limit effort="2.2" velocity="6"/>', "note", "no limits in the file; ±180° was assumed."),
        (with_limit(-1e9, 1e9), "note", "no limits in the file; ±180° was assumed."),
        (with_limit(-90, 90), "suspect", "rad are 14 turns; ±180° was assumed."),
        (with_limit(-90, 90), "suspect", "-1.571 to 1.571 in the file, if these are degrees"),
        (with_limit(0, 0), "impossible", "limits 0 to 0 rad let it not move. --joint-limit-deg 90"),
    ],
)
def test_limits_that_are_no_stops_are_told_with_a_remedy(limit, severity, words, tmp_path):
    imported = read(tmp_path, hexapod(limit))
    found = [f for f in imported.findings if f.severity.value == severity]
    assert [f.subject for f in found if words in f"{f.what} {f.hint}"]
    if severity != "impossible":
        np.testing.assert_array_equal(imported.robot.arrays.joint_limits[..., 1], np.pi)


def test_an_option_gives_the_stops_that_a_file_leaves_out(tmp_path):
    """In angles of the file: the tibia's zero is 1.2 rad below the femur's line."""
    for limit in (with_limit(0, 0), '<limit effort="2.2" velocity="6"/>'):
        robot = robot_of(tmp_path, hexapod(limit), joint_limit=math.pi / 2)
        quarter = math.pi / 2
        wanted = [[-quarter, quarter], [-quarter, quarter], [-quarter - 1.2, quarter - 1.2]]
        np.testing.assert_allclose(robot.legs[0].joint_limits, wanted, atol=1e-12)


def test_a_joint_that_follows_another_is_suspect_by_name(tmp_path):
    one = '<child link="left_rear_tibia"/>'
    text = hexapod().replace(one, f'{one}<mimic joint="left_rear_femur_joint"/>')
    (sentence,) = told(read(tmp_path, text), Severity.SUSPECT, "follows another joint")
    assert sentence.startswith("joint left_rear_tibia_joint: ")


def test_efforts_speeds_and_limits_that_differ_are_seen(tmp_path):
    other = LIMIT.replace("2.2", "4.4").replace('velocity="6"', 'velocity="5"')
    head, tail = hexapod().split("left_front_tibia_joint")
    imported = read(tmp_path, f"{head}left_front_tibia_joint{tail.replace(LIMIT, other)}")
    (sentence,) = told(imported, Severity.NOTE, "the joints differ")
    assert "effort 2.2 to 4.4 N·m (each joint keeps its own)" in sentence
    assert "speed 5 to 6 rad/s (each joint keeps its own)" in sentence


def test_all_findings_come_at_once(tmp_path):
    """Masses, servo, limits and a mesh: four faults of four kinds, in one round."""
    text = hexapod(LIMIT.replace("2.2", "0"))
    text = text.replace('<mass value="0.06"/>', '<mass value="0"/>')
    text = text.replace(BOX, '<mesh filename="/there/a.stl"/>')
    text = text.replace(LIMIT.replace("2.2", "0"), with_limit(0, 0).replace("2.2", "0"), 1)
    imported = read(tmp_path, text)
    assert imported.robot is None
    assert sorted(f.what for f in imported.impossible) == [
        "limits 0 to 0 rad let it not move.",
        "moves but has no mass.",
        "the joints have no effort, so their servos are not known.",
    ]
    assert told(imported, Severity.SUSPECT, "a.stl")


@pytest.mark.parametrize("lengths", [(0.05, 0.08, 0.13), (0.04, 0.1, 0.1), (0.05, 0.08, 0.07)])
@pytest.mark.parametrize("half", [math.radians(90), math.radians(60)])
def test_the_chosen_stance_has_room_for_a_step(half, lengths, tmp_path):
    """±90° are the limits of every hobby servo."""
    text = hexapod(with_limit(-half, half), lengths)
    imported = read(tmp_path, text)
    assert imported.robot is not None
    assert longest_stride(imported.robot, TRIPOD) >= 0.04
    assert longest_stride(imported.robot, TRIPOD, direction=math.pi / 2) >= 0.04
    plan(load_scenario("paper").for_robot(imported.robot))
    assert told(imported, Severity.NOTE, "a step of 40 mm and a lift of 30 mm keep")


def test_a_stance_without_room_has_the_longest_stride_and_is_suspect(tmp_path):
    """Legs that reach 60 mm cannot lift by 30 mm on a step of 40 mm within ±25°."""
    half = math.radians(25)
    imported = read(tmp_path, hexapod(with_limit(-half, half), (0.01, 0.02, 0.03)))
    assert imported.robot is not None
    stride = longest_stride(imported.robot, TRIPOD)
    assert stride < 0.04
    (sentence,) = told(imported, Severity.SUSPECT, "no stance within the joint limits has room")
    assert sentence.endswith(f"here it is {1000 * stride:.0f} mm.")


def test_one_sided_coxae_stand_in_the_middle_of_their_range(tmp_path):
    """A coxa of -5° to 75° has no room for a step at its zero, and at 35° it has."""
    coxa = with_limit(math.radians(-5), math.radians(75))
    text = hexapod()
    for name in LEGS:
        head, tail = text.split(f'name="{name}_coxa_joint"')
        text = f'{head}name="{name}_coxa_joint"{tail.replace(LIMIT, coxa, 1)}'
    robot = robot_of(tmp_path, text)
    q = joint_angles(robot.arrays, robot.arrays.neutral_foot)
    np.testing.assert_allclose(q[:, 0], math.radians(35), atol=1e-12)


def test_the_feet_stand_below_a_deep_trunk(tmp_path):
    box = '<origin xyz="0 0 0.05"/><geometry><box size="0.23 0.15 0.4"/>'
    robot = robot_of(tmp_path, hexapod().replace(f"<geometry>{BOX}", box))
    np.testing.assert_allclose(robot.body.box[:, 2], [-0.15, 0.25], atol=1e-12)
    height = -float(neutral_feet(robot)[:, 2].mean())
    assert trunk_clearance(robot, height, np.zeros(6)) >= 0.02
    assert longest_stride(robot, TRIPOD) >= 0.04


def test_a_trunk_below_all_feet_is_the_reason(tmp_path):
    text = hexapod().replace(BOX, '<box size="0.23 0.15 0.6"/>')
    with pytest.raises(InvalidRobot, match="the trunk reaches below the feet in every stance"):
        load_robot(saved(tmp_path, text))


@pytest.mark.parametrize(("axis", "turn"), [("y", 90), ("-x", 180), ("-y", -90)])
def test_names_against_the_axis_are_told_and_the_option_turns_the_robot(axis, turn, tmp_path):
    text = hexapod(turn=math.radians(turn))
    imported = read(tmp_path, text)
    (found,) = [f for f in imported.findings if f.severity is Severity.SUSPECT]
    assert f"say that {axis} points forward; x was taken." in found.what
    assert found.hint == f"--forward {axis}"
    turned, plain = read(tmp_path, text, forward=axis), robot_of(tmp_path, hexapod())
    assert not told(turned, Severity.SUSPECT, "forward")
    assert turned.robot.leg_names == HEXAPOD_LEGS
    assert [leg.joints[0].removesuffix("_coxa_joint") for leg in turned.legs] == [*HEXAPOD_LEGS]
    hips, own = turned.robot.arrays.p_body_hip, plain.arrays.p_body_hip
    np.testing.assert_allclose(hips, own, atol=1e-12)


NAMES = {
    "dogs": ("FR", "MR", "RR", "RL", "ML", "FL"),
    "hind": ("RF", "RM", "RH", "LH", "LM", "LF"),
    "camel": ("frontRight", "midRight", "backRight", "backLeft", "midLeft", "frontLeft"),
    "numbers": ("R1", "R2", "R3", "L3", "L2", "L1"),
}


@pytest.mark.parametrize("names", NAMES.values(), ids=NAMES)
@pytest.mark.parametrize("turn", [0, 180])
def test_names_of_many_kinds_are_understood(names, turn, tmp_path):
    text = hexapod(turn=math.radians(turn))
    for own, name in zip(LEGS, names, strict=True):
        text = text.replace(own, name)
    found = told(read(tmp_path, text), Severity.SUSPECT, "say that -x points forward")
    assert len(found) == (turn == 180)


SHIN = '<link name="{}_tibia">'
ROD = '<visual><origin xyz="0.08 0 0"/><geometry><box size="0.16 0.02 0.02"/></geometry></visual>'


def test_a_foot_s_frame_in_mid_shin_is_not_the_foot(tmp_path):
    """Exporters of drawings give all parts of a leg one frame: shapes reach 160 mm, it 130."""
    text = hexapod()
    for name in LEGS:
        text = text.replace(SHIN.format(name), SHIN.format(name) + ROD)
    imported = read(tmp_path, text)
    np.testing.assert_allclose(imported.robot.arrays.lengths[:, 2], 0.16, rtol=1e-9)
    (sentence,) = told(imported, Severity.SUSPECT, "was not taken for the foot")
    assert "is 130 mm from the tibia's axis, and its shapes reach to 160 mm" in sentence
    named = robot_of(tmp_path, text, foot="_foot")
    np.testing.assert_allclose(named.arrays.lengths[:, 2], 0.13, rtol=1e-9)
