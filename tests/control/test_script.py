"""Scripts return the command at each time, and refuse invalid files."""

import numpy as np
import pytest

import phasmid
from phasmid.control import CommandScript, load_script
from phasmid.control.script import commands_to_text, script_from_text
from phasmid.control.waypoints import WaypointFollower
from phasmid.errors import InvalidInput
from phasmid.experiment import Command, LegCommand, Posture
from phasmid.gait import Gait
from phasmid.scenario import Scenario

STEPS = """
[[command]]
time_s = 1
ahead_mm_per_s = 50
gait = "wave"

[[command]]
time_ms = 3000
turn_deg_per_s = 18
shift_mm = [0, 0, 10]
"""


def test_a_command_holds_until_the_next_and_absent_keys_keep_their_values(tmp_path):
    (tmp_path / "a.toml").write_text(STEPS)
    script = load_script(tmp_path / "a.toml")
    assert script.at(0.999) == Command()
    assert script.at(1.0) == script.at(2.999) == Command(velocity=(0.05, 0, 0), gait="wave")
    after = script.at(3.0)
    assert after.velocity == pytest.approx((0.05, 0.0, np.radians(18)))
    assert after.pose == (0.0, 0.0, 0.01, 0.0, 0.0, 0.0)
    assert after.gait == "wave"
    assert script.at(1e5) == after
    # Velocities may be interpolated between commands.
    script = script_from_text('format = 1\nbetween = "linear"\nduration_s = 4\n' + STEPS)
    assert script.at(2.0).velocity == pytest.approx((0.05, 0.0, np.radians(9)))
    assert script.at(2.0).pose[2] == pytest.approx(0.005)
    assert script.at(4.0) is not None
    assert script.at(4.001) is None


def test_the_text_of_a_script_keeps_commands_to_the_bit():
    commands = [
        Command(velocity=(0.1 / 3, -1e-17, 0.7), pose=(0.01, 0, 0, 0.1, 0, 1 / 7)),
        Command(posture=Posture.PACKED, period=1 / 3, step_height=0.02),
        Command(gait=Gait("own", 0.75, (0.0, 0.25, 0.5, 0.75), 0.5), lost_legs=frozenset({2})),
        Command(legs={3: LegCommand(foot=(0.1, 0.2, -0.1)), 1: LegCommand(joints=(0, 0.1, 0.2))}),
    ]
    given = [(0.005 * i, command) for i, command in enumerate(commands)]
    again = script_from_text(commands_to_text(given, duration=2 / 3))
    assert again.duration == 2 / 3
    # A script cannot return to the settings of the controller.
    assert again.at(0.0) == commands[0]
    assert again.at(0.005).posture is Posture.PACKED
    assert again.at(0.01).gait == commands[2].gait
    assert dict(again.at(0.015).legs) == dict(commands[3].legs)


def body(velocity, pose, dt):
    x, y, yaw = pose
    ahead, left, turn = velocity
    c, s = np.cos(yaw), np.sin(yaw)
    return x + dt * (c * ahead - s * left), y + dt * (s * ahead + c * left), yaw + dt * turn


def test_a_lost_leg_that_the_robot_does_not_have_is_refused():
    script = script_from_text(
        "format = 1\ncommand = [{time = 0.0, lost_legs = [2]}, {time = 1.0, lost_legs = [9]}]"
    )
    with pytest.raises(InvalidInput, match="command 2: lost_legs has 9; the robot has legs 1 to 6"):
        phasmid.drive(Scenario(), commands=script)


def test_waypoints_are_reached_in_order_with_their_headings():
    # A body that follows commands at once, from any place and heading.
    places = [{"x": 0.3, "y": 0.0}, {"x": 0.3, "y": 0.2, "heading_deg": 150}, {"x": 0.0, "y": 0.2}]
    script = CommandScript(waypoint=places, follow={"reached_mm": 20, "aligned_deg": 3})
    follower, pose, way = WaypointFollower(script), (1.0, 2.0, 0.5), []
    c, s = np.cos(0.5), np.sin(0.5)
    goals = [(1 + c * p.x - s * p.y, 2 + s * p.x + c * p.y) for p in script.waypoint]
    headings = {}
    for step in range(20_000):
        command = follower.command(0.01 * step, pose)
        headings.setdefault(len(follower.reached), pose[2])
        if command is None:
            break
        speed = np.hypot(*command.velocity[:2])
        assert speed <= script.follow.speed + 1e-12
        assert abs(command.velocity[2]) <= script.follow.turn_speed
        way.append(pose)
        pose = body(command.velocity, pose, 0.01)
        if speed > 0:
            # It walks straight at the next waypoint, whatever its heading.
            goal = goals[len(follower.reached)]
            before, after = (np.hypot(x - goal[0], y - goal[1]) for x, y, _ in (way[-1], pose))
            assert before - after > 0.99 * 0.01 * speed
    assert step < 19_999
    for goal in goals:
        near = np.linalg.norm(np.array(way)[:, :2] - goal, axis=1)
        assert near.min() < 0.02 + 0.01 * script.follow.speed
    # It goes on from the second waypoint in that one's heading.
    off = headings[2] - 0.5 - np.radians(150)
    assert abs(np.remainder(off + np.pi, 2 * np.pi) - np.pi) < np.radians(4)


@pytest.mark.parametrize(
    ("name", "text", "what"),
    [
        ("a.toml", "[[command]]\nahaed = 5", 'unknown key "ahaed" in command[0].'),
        (
            "a.toml",
            "[[command]]\ntime_s = 2\n[[command]]\ntime_s = 2",
            "command 2: time 2 s does not follow 2 s.",
        ),
        (
            "a.toml",
            "[[command]]\nahead_m_per_s = 50",
            "command[0].ahead is 50 m/s; it must be 10 or less.",
        ),
        (
            "a.toml",
            "[[command]]\nturn = nan",
            "command[0].turn is nan; it must be a finite number.",
        ),
        (
            "a.toml",
            'between = "steps"',
            "the script has no command and no waypoint; it must have one of the two.",
        ),
        (
            "a.toml",
            "[[command]]\n[[waypoint]]\nx = 1\ny = 0",
            "the script has both commands and waypoints; it must have one of the two.",
        ),
        ("a.toml", "[[waypoint]]\nx = 1", "waypoint[0].y is missing."),
        ("a.csv", "", "is no script of commands; it must be a .toml file."),
    ],
)
def test_invalid_scripts_are_refused_in_one_sentence(tmp_path, name, text, what):
    (tmp_path / name).write_text(text)
    with pytest.raises(InvalidInput) as caught:
        load_script(tmp_path / name)
    assert caught.value.what.endswith(what)
    assert name in f"{caught.value.where} {caught.value.what}"
