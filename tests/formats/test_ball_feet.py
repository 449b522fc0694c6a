"""Balls at the ends of legs: which one a file's foot is, and what files of robots keep of it."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from phasmid.errors import InvalidRobot
from phasmid.formats import ImportOptions, import_robot, save_robot
from phasmid.kinematics import body_height
from phasmid.robot import load_robot
from support.ball_dog import BALL, ball_dog

MK4 = load_robot("phantomx-mk4")


def read(path, foot=""):
    """A robot of a file and what the reader says of its feet."""
    imported = import_robot(path, ImportOptions(foot=foot))
    assert imported.robot is not None
    said = [f"{f.severity.name} {f.sentence}" for f in imported.findings if "ball" in f.what]
    return imported.robot, said


def tibiae(robot):
    return [leg.tibia.length for leg in robot.legs]


@pytest.mark.parametrize(
    ("foot", "option"),
    [
        (BALL, ""),
        # A capsule ends in half a ball; its other end is at the knee.
        ('<geom type="capsule" size="{radius}" fromto="0 0 0 0 0 -0.2"/>', ""),
        (BALL + '<site name="{{n}}_foot" pos="0 0 -0.2"/>', ""),
        (BALL, "0,0,-0.2"),
        # Feet at the far ends of their balls.
        (BALL + '<site name="{{n}}_foot" pos="0 0 -0.22"/>', ""),
        (BALL, "0,0,-0.22"),
    ],
)
def test_the_ball_about_the_end_of_a_leg_is_its_foot(foot, option, tmp_path):
    path = ball_dog(tmp_path, 0.02, foot)
    text = path.read_text()
    for number in range(4):
        text = text.replace('name="{n}_foot"', f'name="leg{number}_foot"', 1)
    path.write_text(text)
    robot, said = read(path, option)
    assert robot.foot_radius == 0.02
    assert tibiae(robot) == pytest.approx([0.2] * 4, abs=1e-15)
    moved = [sentence for sentence in said if "that centre was taken" in sentence]
    expected = (
        "NOTE legs 1, 2, 3 and 1 more: its foot is 20 mm from the centre of a ball of radius 20 mm"
    )
    assert [text.partition(";")[0] for text in moved] == [expected] * ("-0.22" in foot + option)


def test_feet_far_from_every_ball_are_points(tmp_path):
    """30 mm below the ball's centre, and so 10 mm outside it."""
    robot, _ = read(ball_dog(tmp_path), "0,0,-0.23")
    assert robot.foot_radius == 0.0
    assert tibiae(robot) == pytest.approx([0.23] * 4)


def test_balls_that_differ_become_one_of_their_mean_radius(tmp_path):
    path = ball_dog(tmp_path)
    path.write_text(path.read_text().replace('size="0.02"', 'size="0.024"', 2))
    robot, said = read(path)
    assert robot.foot_radius == pytest.approx(0.022)
    assert [text for text in said if text.startswith("SUSPECT feet")] == [
        "SUSPECT feet: their balls have radii of 20 mm to 24 mm; every foot has the mean, 22 mm, "
        "which places the ground up to 2 mm too high or too low."
    ]


def test_visual_balls_of_a_urdf_count_where_nothing_collides(tmp_path):
    path = tmp_path / "robot.urdf"
    save_robot(replace(MK4, foot_radius=0.009, appearance=None), path)
    text = path.read_text()
    path.write_text(text.replace("<collision", "<visual").replace("</collision", "</visual"))
    robot, _ = read(path)
    assert robot.foot_radius == 0.009
    assert any(
        "its visual spheres and capsules count" in f.what for f in import_robot(path).findings
    )


@pytest.mark.parametrize(
    ("suffix", "radius"),
    # Points in STEP: test_step.py.
    [
        *((suffix, r) for suffix in (".toml", ".urdf", ".xml") for r in (0.0, 0.0123)),
        pytest.param(".step", 0.0123, marks=pytest.mark.slow),
    ],
)
def test_files_keep_balls_and_points(suffix, radius, tmp_path):
    """The small spheres on which points stand in simulators are no part of the robot."""
    robot = replace(MK4, foot_radius=radius, appearance=None)
    path = tmp_path / f"robot{suffix}"
    save_robot(robot, path)
    again = load_robot(path) if suffix == ".toml" else import_robot(path).robot
    assert again.foot_radius == radius
    np.testing.assert_allclose(tibiae(again), tibiae(robot), rtol=1e-12)


def test_an_exported_ball_robot_touches_mujocos_floor_with_all_balls(tmp_path):
    robot = replace(MK4, foot_radius=0.0123)
    save_robot(robot, tmp_path / "robot.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    mujoco.mj_forward(model, data)
    assert data.qpos[2] == pytest.approx(body_height(robot), abs=1e-12)
    for leg in robot.legs:
        ball = data.geom(f"{leg.name}_foot_ball")
        np.testing.assert_allclose(ball.xpos, data.site(f"{leg.name}_foot").xpos, atol=1e-15)
        assert model.geom(f"{leg.name}_foot_ball").size[0] == 0.0123
        assert ball.xpos[2] == pytest.approx(0.0123, abs=1e-12)


@pytest.mark.parametrize("radius", [-0.01, np.nan, np.inf, 0.5])
def test_impossible_balls_are_refused(radius):
    with pytest.raises(InvalidRobot, match="foot radius is"):
        replace(MK4, foot_radius=radius)
