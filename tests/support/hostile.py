"""Names that would run, load or write something wherever they are not taken for mere text."""

from dataclasses import replace

from phasmid.robot import load_robot, robot_to_toml
from phasmid.scenario import load_scenario, scenario_to_toml

NAME = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"

UNSEEN = "\x07\x1b\x9b\u2028\u202e"
"""A bell, two beginnings of commands to a terminal, a line's end, and writing turned around."""

HOSTILE = f"{NAME}{UNSEEN}]0;owned =1+1"

LEG_NAMES = (
    "<script>alert(1)</script>",
    '"><img src=x onerror=alert(2)>',
    "'></script><svg onload=alert(3)>",
    "a & b &lt; ${title} $script",
    '=HYPERLINK("http://x.example","y")',
    "javascript:alert(4)",
)
"""Such as a robot file may hold: letters that cannot be seen are refused there."""


def hostile_files(duration):
    """A scenario's file and its robot's, ``robot.toml``, whose names are such; by their names."""
    robot = load_robot("phantomx-paper")
    legs = tuple(replace(leg, name=name) for leg, name in zip(robot.legs, LEG_NAMES, strict=True))
    servo = replace(robot.servo, name=NAME)
    gait = {"name": HOSTILE, "duty_factor": 0.5, "offsets": (0, 0.5, 0, 0.5, 0, 0.5)}
    scenario = load_scenario("paper").replace(description=HOSTILE, duration=duration, gait=gait)
    return {
        "robot": robot_to_toml(replace(robot, name=NAME, legs=legs, servo=servo)),
        "scenario": scenario_to_toml(scenario, "robot.toml"),
    }


def hostile_walk(recording):
    """A recording whose robot and scenario are named so.

    Args:
        recording: Of the paper's robot; its attributes are changed.
    """
    recording.attrs |= hostile_files(float(recording["time"].values[-1]))
    recording.attrs["servo"] = NAME
    return recording
