"""Runs that made less than half of their command: their ending, cause and remedy."""

import re
from dataclasses import replace

import numpy as np
import pytest

from phasmid.control import Command, CommandScript
from phasmid.motion import plan
from phasmid.reporting import summarise
from phasmid.robot import load_robot
from phasmid.scenario import Scenario, load_scenario
from phasmid.simulation import drive, simulate
from phasmid.simulation.shortfall import Following, shortfall_reason

PAPER = load_scenario("paper").replace(duration=2.0)
AX = Scenario().replace(robot="phantomx-ax", drive="ideal-servo", duration=3.0)


def options(reason):
    """The options of a remedy, as fields of a scenario and a velocity."""
    texts = dict(re.findall(r"--([a-z-]+) ([-\d.,]+\d)", reason))
    velocity = (
        tuple(map(float, texts.pop("velocity", "").split(","))) if "velocity" in texts else ()
    )
    return {name.replace("-", "_"): float(text) for name, text in texts.items()}, velocity


def test_a_walk_whose_feet_stay_on_the_ground_falls_short():
    scenario = PAPER.replace(step_height=0.0)
    run = simulate(scenario, plan(scenario))
    assert run.attrs["ending"] == "SHORT"
    fields, _ = options(run.attrs["ending_reason"])
    assert list(fields) == ["step_height_mm"]
    better = PAPER.replace(**fields)
    assert simulate(better, plan(better)).attrs["ending"] == "COMPLETED"


def test_a_walk_on_ice_names_the_friction():
    scenario = PAPER.replace(friction=0.0, drive="ideal-servo", robot="phantomx-ax", duration=4.0)
    run = simulate(scenario, plan(scenario))
    assert run.attrs["ending"] == "SHORT"
    assert "friction of 0." in run.attrs["ending_reason"]
    fields, _ = options(run.attrs["ending_reason"])
    better = scenario.replace(**fields)
    assert simulate(better, plan(better)).attrs["ending"] == "COMPLETED"


@pytest.mark.parametrize("velocity", [(0.6, 0.0, 0.0), (0.0, 0.0, 4.0)])
def test_a_command_that_no_gait_can_follow_gets_one_that_can_be_followed(velocity):
    run = drive(AX, commands=Command(velocity=velocity))
    assert run.attrs["ending"] == "SHORT"
    assert "% of that for feasible (" in run.attrs["ending_reason"]
    fields, slower = options(run.attrs["ending_reason"])
    assert not fields
    run = drive(AX, commands=Command(velocity=slower))
    assert run.attrs["ending"] == "COMPLETED"
    assert summarise(run)["travel"]["way_share" if slower[0] else "turn_share"] > 0.7


def test_servos_too_slow_for_the_period_get_a_longer_one():
    """At 0.4 rad/s they cannot lift a foot in the robot's own period."""
    ax = load_robot("phantomx-ax")
    slow = AX.replace(robot=replace(ax, servo=replace(ax.servo, no_load_speed=0.4)), duration=8.0)
    velocity = (0.02, 0.0, 0.0)
    run = drive(slow, commands=Command(velocity=velocity))
    assert run.attrs["ending"] == "SHORT"
    assert abs(summarise(run)["travel"]["way_share"]) < 1e-6
    fields, slower = options(run.attrs["ending_reason"])
    assert list(fields) == ["period"]
    better = slow.replace(**fields, duration=2 * fields["period"])
    run = drive(better, commands=Command(velocity=slower or velocity))
    assert run.attrs["ending"] == "COMPLETED"


@pytest.mark.parametrize(
    ("followed", "cause"), [(0.1, "its joints do not follow"), (0.9, "slip or are held up")]
)
def test_joints_that_do_not_follow_are_told_from_feet_that_slip(followed, cause):
    """A body at rest, whose joints make a share of their commanded motion."""
    time = np.linspace(0.0, 2.0, 101)
    target = np.sin(2 * np.pi * time)[:, None, None] * np.ones((6, 3))
    still = np.zeros((len(time), 3))
    following = Following(None)
    channels = {
        "joint_position": followed * target,
        "joint_position_target": target,
        "body_position": still,
        "body_orientation": np.tile([1.0, 0.0, 0.0, 0.0], (len(time), 1)),
        "velocity_command": np.tile([0.05, 0.0, 0.0], (len(time), 1)),
    }
    following.add(time, channels)
    assert cause in shortfall_reason(AX, following, None, "")


@pytest.mark.parametrize(
    "commands",
    [
        Command(),
        CommandScript(waypoint=[{"x": 5.0, "y": 0.0}]),
    ],
    ids=["stands", "waypoints"],
)
def test_a_run_without_a_commanded_velocity_has_no_share(commands):
    run = drive(AX, commands=commands)
    travel = summarise(run)["travel"]
    assert run.attrs["ending"] != "SHORT"
    assert not {"way_share", "turn_share"} & travel.keys()


def test_a_run_shorter_than_a_cycle_is_not_judged():
    """The gait begins; a robot that lifts its first feet has not failed yet."""
    run = drive(AX.replace(duration=0.5), commands=Command(velocity=(0.05, 0.0, 0.0)))
    assert run.attrs["ending"] == "COMPLETED"


def test_the_share_of_a_log_is_that_of_its_ending():
    """What the run adds up block by block is what the summary computes at once."""
    run = drive(AX, commands=Command(velocity=(0.6, 0.0, 0.0)))
    share = summarise(run)["travel"]["way_share"]
    assert f"made {100 * share:.1f} % of the commanded way" in run.attrs["ending_reason"]
