"""Robot files: what is read, what is written, and what bad ones are told."""

import math
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest

from phasmid.errors import InvalidInput, InvalidRobot
from phasmid.robot import HEXAPOD_LEGS, load_robot, preset_names, robot_to_toml

SIN_54, COS_54 = np.sin(np.radians(54)), np.cos(np.radians(54))

PAPER = (resources.files("phasmid.robot") / "presets" / "phantomx-paper.toml").read_text("utf-8")


def said(tmp_path, text):
    with pytest.raises(InvalidInput) as caught:
        loaded(tmp_path, text)
    return caught.value


def loaded(tmp_path, text):
    path = tmp_path / "my.toml"
    path.write_text(text, encoding="utf-8")
    return load_robot(path)


def on_leg(line, leg="right_front"):
    """The paper's robot with one more line in the table of one leg."""
    return PAPER.replace(f"[legs.{leg}]", f"[legs.{leg}]\n{line}")


def swap(old, new):
    assert old in PAPER
    return PAPER.replace(old, new, 1)


def test_the_papers_robot_is_table_2_completed_to_26_newton():
    robot = load_robot("phantomx-paper")
    assert robot.mass * 9.81 == pytest.approx(26, abs=1e-12)
    assert robot.leg_names == HEXAPOD_LEGS
    assert robot.servo.name == "AX-12A"
    for leg in robot.legs:
        assert leg.lengths == pytest.approx([0.052, 0.082, 0.140], abs=0)
        assert [link.mass for link in leg.links] == pytest.approx(
            [21.931e-3, 120.017e-3, 73.685e-3]
        )
        assert leg.tibia.com == pytest.approx([75.816e-3, -1.747e-3, -21.392e-3])
        # g mm^2 is 1e-9 kg m^2; the products are entries of the tensor, sign as printed.
        assert leg.tibia.inertia[0, 2] == pytest.approx(254.103e-9)
        assert np.diag(leg.femur.inertia) == pytest.approx([19819.5e-9, 127028.3e-9, 120839.4e-9])
        assert leg.neutral_foot == pytest.approx([0.150, 0, -0.100], abs=0)
    mounts = {
        leg.name: (*leg.mount_position[:2], math.degrees(leg.mount_yaw)) for leg in robot.legs
    }
    assert mounts["right_front"] == pytest.approx((0.1248, -0.06164, -45))
    assert mounts["right_middle"] == pytest.approx((0, -0.1034, -90))
    assert mounts["left_rear"] == pytest.approx((-0.1248, 0.06164, 135))
    # Solid box of 250 x 200 x 50 mm: m/12 (b^2 + c^2).
    body = robot.body
    assert body.inertia[0, 0] == pytest.approx(body.mass / 12 * (0.2**2 + 0.05**2))


@pytest.mark.parametrize("preset", preset_names())
def test_a_robot_written_and_read_again_has_the_same_numbers(preset, tmp_path):
    text = robot_to_toml(load_robot(preset))
    assert robot_to_toml(loaded(tmp_path, text)) == text


def test_a_hip_is_turned_by_its_yaw_then_its_pitch_then_its_roll(tmp_path):
    # X_body_hip = Rz(yaw) Ry(pitch) Rx(roll); a pitch lowers x, a roll raises y.
    robot = loaded(tmp_path, on_leg("pitch_deg = 20\nroll_deg = -10"))
    leg = robot.legs[0]
    y, p, r = (math.radians(a) for a in (-45, 20, -10))
    Rz = [[math.cos(y), -math.sin(y), 0], [math.sin(y), math.cos(y), 0], [0, 0, 1]]
    Ry = [[math.cos(p), 0, math.sin(p)], [0, 1, 0], [-math.sin(p), 0, math.cos(p)]]
    Rx = [[1, 0, 0], [0, math.cos(r), -math.sin(r)], [0, math.sin(r), math.cos(r)]]
    assert np.abs(leg.X_body_hip[:3, :3] - np.array(Rz) @ Ry @ Rx).max() < 1e-15
    assert leg.X_body_hip[2, 0] == pytest.approx(-math.sin(math.radians(20)), abs=1e-15)
    assert leg.X_body_hip[2, 1] < 0
    assert np.array_equal(robot.legs[1].X_body_hip[2, :3], [0, 0, 1])
    again = loaded(tmp_path, robot_to_toml(robot)).legs[0]
    assert np.array_equal(again.X_body_hip, leg.X_body_hip)
    assert (again.mount_pitch, again.mount_roll) == (leg.mount_pitch, leg.mount_roll)


def test_legs_of_a_hexapod_are_numbered_alike_in_whatever_order_they_are_declared(tmp_path):
    head, *legs = PAPER.split("\n[legs.")
    text = head + "".join(f"\n[legs.{leg}\n" for leg in reversed(legs))
    assert robot_to_toml(loaded(tmp_path, text)) == robot_to_toml(load_robot("phantomx-paper"))


def test_legs_are_numbered_around_the_body():
    # Right legs from front to rear, then left ones from rear to front: angles of the hips fall.
    for preset, count in (("quadruped", 4), ("octopod", 8)):
        robot = load_robot(preset)
        assert len(robot.legs) == count
        assert robot.leg_names[0] == "right_front"
        assert robot.leg_names[-1] == "left_front"
        x, y, _ = robot.arrays.p_body_hip.T
        around = np.unwrap(np.arctan2(y, x))
        assert (np.diff(around) < 0).all()
        mirror = robot.arrays.p_body_hip[::-1] * [1, -1, 1]
        np.testing.assert_array_equal(robot.arrays.p_body_hip, mirror)


# Lengths, and place and yaw of the right front hip, as the firmware has them; masses as published
# or, for the Freenove, as the sum of its file's estimates.
@pytest.mark.parametrize(
    ("preset", "lengths_mm", "hip_mm", "yaw_deg", "mass"),
    [
        # Corner legs at 54 degrees from athwart, 94 mm from the middle.
        ("freenove-big", [33, 90, 110], [94 * SIN_54, -94 * COS_54], -36, 1.86),
        # 18 servos of 55 g, 600 g of PLA, and 410 g that the file lists.
        ("markwtech", [51, 65, 121], [110.4, -58.4], -45, 18 * 0.055 + 0.6 + 0.41),
        # 4.60 lb.
        ("lynxmotion-ch3r", [29, 57, 141], [119, -69], -30, 4.60 * 0.45359237),
    ],
)
def test_kits_have_the_published_numbers(preset, lengths_mm, hip_mm, yaw_deg, mass):
    robot = load_robot(preset)
    for leg in robot.legs:
        assert leg.lengths * 1000 == pytest.approx(lengths_mm, rel=1e-12)
    leg = robot.legs[0]
    # The files give hundredths of millimetres, and the weight four digits.
    assert leg.mount_position[:2] * 1000 == pytest.approx(hip_mm, abs=0.005)
    assert np.degrees(leg.mount_yaw) == pytest.approx(yaw_deg, abs=1e-9)
    assert robot.mass == pytest.approx(mass, rel=5e-4)


def test_a_leg_may_have_its_own_lengths_and_units(tmp_path):
    legs = loaded(tmp_path, on_leg("femur_cm = 9\ntibia = 0.15")).legs
    assert legs[0].lengths == pytest.approx([0.052, 0.09, 0.15], abs=1e-15)
    assert legs[1].lengths == pytest.approx([0.052, 0.082, 0.14], abs=1e-15)


def test_other_numbers_of_legs_are_welcome_where_the_file_says_so(tmp_path):
    text = PAPER.replace("[legs.right_middle]\nmount_mm = [0, -103.4, 0]\nyaw_deg = -90\n", "")
    text = text.replace("[legs.left_middle]\nmount_mm = [0, 103.4, 0]\nyaw_deg = 90\n", "")
    robot = loaded(tmp_path, text.replace("total_weight", "leg_count = 4\ntotal_weight"))
    assert robot.leg_names == ("right_front", "right_rear", "left_rear", "left_front")


def test_home_angles_may_stand_for_the_neutral_foot(tmp_path):
    leg = loaded(tmp_path, on_leg("home_deg = [0, 0, -90]")).legs[0]
    # Level femur, hanging tibia: 52 + 82 mm out, 140 mm down.
    assert leg.neutral_foot == pytest.approx([0.134, 0, -0.140], abs=1e-15)


SERVO = 'servo = "AX-12A"'
COXA = "inertia_g_mm2 = { xx = 8633.6, yy = 9496.5, zz = 9496.5, xy = -0.04, xz = 0.04, yz = 0 }"
INERTIA = "inertia_g_mm2 = { xx = 31076.2, yy = 233156, zz = 210833, xy = -1.832, xz = 254.103"
TINY = "inertia_g_mm2 = { xx = 0.0086, yy = 0.0095, zz = 0.0095 }"
NO_BODY = "inertia_g_mm2 = { xx = 1e5, yy = 1e5, zz = 3e5"
COM, JOINT = "com_mm = [75.816, -1.747, -21.392]", "joint right_front.tibia: "
LEFT_REAR = "[legs.left_rear]\nmount_mm = [-124.8, 61.64, 0]\nyaw_deg = 135\n"
IN_QUOTES = swap("femur_mm = 82", 'femur_mm = "82"')
TWICE = "femur_mm = 82\nfemur_mm = 83"
LINE = on_leg(TWICE).splitlines().index("femur_mm = 83") + 1


def named(name):
    return swap('name = "phantomx-paper"', f'name = "{name}"')


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (on_leg("femur_mm = -82"), "leg right_front: femur is -82 mm; it must be finite"),
        (on_leg("femur_m = 82"), "leg right_front: femur is 82 m; lengths above 2 m are"),
        (on_leg("femur_mm = inf"), "leg right_front: femur is inf; it must be a finite"),
        ("legs = 3", "leg and legs must be tables."),
        ("[legs]\na = 1", "legs.a must be a table."),
        (IN_QUOTES, 'leg.femur is "82"; it must be a number.'),
        (swap(COXA, TINY), "link coxa: inertia 9.5e-12 kg m^2 gives a gyration radius of 0.021 mm"),
        (swap(INERTIA, NO_BODY), "link tibia: principal moments 0.0001, 0.0001, 0.0003 kg m^2 can"),
        (swap("mass_g = 73.685", "mass_g = 0"), "link tibia: mass is 0 kg; it must be greater"),
        (
            swap(LEFT_REAR, ""),
            "robot: 5 legs given; a hexapod has 6. Missing: left_rear. leg_count",
        ),
        (
            swap("mount_mm = [0, -103.4, 0]", "mount_mm = [124.8, -61.64, 0]"),
            "legs right_front and right_middle share the hip position (0.1248, -0.06164, 0) m.",
        ),
        (on_leg("joint_limits.tibia = [-75, 60]"), f"{JOINT}its limits reach 75 rad, 11.9 turns;"),
        (on_leg("joint_limits.tibia_deg = [60, -60]"), f"{JOINT}lower limit 60° is above upper li"),
        (
            on_leg("home_deg = [0, 110, -110]", "left_rear"),
            "joint left_rear.femur: home 110° is outside [-100°, 100°].",
        ),
        (on_leg("neutral_foot_mm = [-150, 0, -100]"), "leg right_front: neutral foot lies -150 mm"),
        (on_leg("strength = [1, 0, 1]"), "legs.right_front.strength[1] is 0; it must be grea"),
        (on_leg("friction_ratio = [1, -1, 1]"), "legs.right_front.friction_ratio[1] is -1; it mus"),
        (on_leg("femurr_mm = 8"), 'unknown key "femurr_mm" in legs.right_front. "femur_mm"'),
        (on_leg(TWICE), f'my.toml line {LINE}: key "femur_mm" is given twice.'),
        (on_leg("femur_mm = 82\nfemur_cm = 8"), 'key "femur" is given twice, as "femur_cm" and'),
        (
            swap(COM, "com_m = [3.0, 0, 0]"),
            "link tibia: centre of mass lies 3 m from a 0.14 m link",
        ),
        (swap(SERVO, "servo = {}"), "servo.name is missing. name = ..."),
        (swap(SERVO, 'servo = "AX-12"'), 'no servo called "AX-12". "AX-12A"'),
        (named(" a"), 'name is " a"; it must be a plain name. 1 to 64 printable characters,'),
    ],
)
def test_an_impossible_robot_is_told_why(tmp_path, text, what):
    error = said(tmp_path, text)
    assert f"{error.what} {error.hint}".startswith(what)
    assert "my.toml" in f"{error.where} {error.what}"
    assert error.exit_status == 2


def test_numbers_of_joints_are_those_of_the_servo_as_supplied_times_their_ratios(tmp_path):
    robot = loaded(tmp_path, on_leg("speed_ratio = [1, 1, 0.5]\nfriction_ratio = [0, 1, 2]"))
    assert not robot.has_equal_servos
    assert load_robot("phantomx-paper").has_equal_servos
    for servo in (robot.servo, robot.servo.at(9.0)):
        arrays = replace(robot, servo=servo).arrays
        np.testing.assert_array_equal(arrays.no_load_speed[0] / servo.no_load_speed, [1, 1, 0.5])
        np.testing.assert_array_equal(arrays.friction[0], np.array([0, 1, 2]) * servo.friction)
        assert (arrays.stall_torque == servo.stall_torque).all()
        assert (arrays.armature == servo.armature).all()
    for name, value, must in (("speed_ratio", 0.0, "above 0"), ("armature_ratio", -1.0, "0 or m")):
        with pytest.raises(InvalidRobot, match=f"leg right_front: {name} is {value:g}; .* {must}"):
            replace(robot.legs[0], **{name: np.array([1.0, value, 1.0])})


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("coxa_mm = 52", "coxa_mm = -52", "coxa_mm = -52"),
        ("mass_g = 120.017", "mass_g = 0", "[leg.links.femur]"),
        ("femur_mm = 82", "femur_mm = 82\nfemurr_mm = 82", "femurr_mm = 82"),
    ],
)
def test_what_is_wrong_in_the_shared_leg_is_told_with_its_own_line(tmp_path, old, new, line):
    text = swap(old, new)
    assert said(tmp_path, text).where == f"my.toml, line {text.splitlines().index(line) + 1}"


def test_lines_are_found_in_time_that_grows_with_the_file(tmp_path):
    # A line of brackets and spaces in a text made the search cubic once; it would not end here.
    text = PAPER.replace(
        "description = ", 'x = """\n[' + " " * 100_000 + '\n"""\ndescription = ', 1
    )
    assert said(tmp_path, text).what == 'unknown key "x".'


@pytest.mark.parametrize("name", ["\N{CRICKET}", "a.b", 'quote " and \\', "x" * 64])
def test_any_printable_name_is_written_and_read_again(tmp_path, name):
    robot = load_robot("phantomx-paper")
    legs = (replace(robot.legs[0], name=name), *robot.legs[1:])
    text = robot_to_toml(replace(robot, name=name, description=f"{name}\n\t\x7f", legs=legs))
    again = loaded(tmp_path, text)
    assert (again.name, again.legs[0].name) == (name, name)
    assert again.description == f"{name}\n\t\x7f"


def test_what_is_no_file_or_no_name_is_refused(tmp_path):
    for name in ("x" * 300, "a\0.toml", "/dev/null", "."):
        with pytest.raises(InvalidInput):
            load_robot(name)
    for name in ("", "a ", "a\\u0000b", "a\\u001b[31m", "x" * 65):
        error = said(tmp_path, named(name))
        assert error.what.endswith("it must be a plain name.")
        assert str(error).replace("\n", "").isprintable()
    with pytest.raises(InvalidInput) as caught:
        load_robot("phantomx-papr")
    assert str(caught.value) == 'no robot called "phantomx-papr".\n  try  "phantomx-paper"'
