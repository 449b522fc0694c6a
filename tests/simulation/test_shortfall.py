"""Runs that made less than half of their command: their ending, cause and remedy."""

import re
from dataclasses import replace

import numpy as np
import pytest

from phasmid.control import CommandScript, Player
from phasmid.experiment import Command
from phasmid.motion import plan
from phasmid.recording.channels import WALKING
from phasmid.reporting import summarise
from phasmid.robot import load_robot
from phasmid.scenario import Scenario, load_scenario
from phasmid.simulation import drive, new_run, simulate
from phasmid.simulation.drive import new_drive
from phasmid.simulation.shortfall import CommandFollowing, shortfall_cause

PAPER = load_scenario("paper").replace(duration=2.0)
AX = Scenario().replace(robot="phantomx-ax", drive="ideal-servo", duration=3.0)


def options(reason):
    """The options of a remedy, as fields of a scenario and a velocity."""
    texts = dict(re.findall(r"--([a-z-]+) (-?\d(?:[-\d.,]*\d)?)", reason))
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
    assert summarise(run)["travel"]["distance_share" if slower[0] else "turn_share"] > 0.7


def test_servos_too_slow_for_the_period_get_a_longer_one():
    """At 0.4 rad/s they cannot lift a foot in the robot's own period."""
    ax = load_robot("phantomx-ax")
    servo = replace(ax.servo, rated_no_load_speed=0.4)
    slow = AX.replace(robot=replace(ax, servo=servo), duration=8.0)
    velocity = (0.02, 0.0, 0.0)
    run = drive(slow, commands=Command(velocity=velocity))
    assert run.attrs["ending"] == "SHORT"
    assert abs(summarise(run)["travel"]["distance_share"]) < 1e-6
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
    following = CommandFollowing(None)
    channels = {
        "joint_position": followed * target,
        "joint_position_target": target,
        "body_position": still,
        "body_orientation": np.tile([1.0, 0.0, 0.0, 0.0], (len(time), 1)),
        "velocity_command": np.tile([0.05, 0.0, 0.0], (len(time), 1)),
    }
    following.add(time, channels)
    found, _ = shortfall_cause(AX.build(), following, None, "")
    assert cause in found


@pytest.mark.parametrize(
    "commands",
    [Command(), CommandScript(waypoint=[{"x": 5.0, "y": 0.0}])],
    ids=["stands", "waypoints"],
)
def test_a_run_without_a_commanded_velocity_has_no_share(commands):
    run = drive(AX, commands=commands)
    travel = summarise(run)["travel"]
    assert run.attrs["ending"] == ("COMPLETED" if isinstance(commands, Command) else "INCOMPLETE")
    assert not {"distance_share", "turn_share"} & travel.keys()


def test_a_run_shorter_than_a_cycle_is_not_judged():
    """The gait begins; a robot that lifts its first feet has not failed yet."""
    run = drive(AX.replace(duration=0.5), commands=Command(velocity=(0.6, 0.0, 0.0)))
    assert summarise(run)["travel"]["distance_share"] < 0.5
    assert run.attrs["ending"] == "COMPLETED"


def test_a_command_to_a_robot_that_lies_does_not_count():
    """It gathers its legs and gets up for more than 2 s of 4 s, and walks from then on."""
    scenario = AX.replace(start_posture="packed", duration=4.0)
    run = drive(scenario, commands=Command(velocity=(0.03, 0.0, 0.0)))
    assert np.isin(run["sequence"].values, WALKING).mean() < 0.5
    assert run.attrs["ending"] == "COMPLETED"


def test_a_plan_that_is_played_is_commanded_by_the_plan():
    """On ground without friction the feet step on the spot."""
    scenario = PAPER.replace(robot="phantomx-ax", drive="ideal-servo", friction=0.0)
    run = drive(scenario, Player(plan(scenario)))
    assert run.attrs["ending"] == "SHORT"
    assert abs(summarise(run)["travel"]["distance_share"]) < 0.1


def test_a_command_of_its_own_gait_gets_a_velocity_of_that_gait():
    """A wave lifts one foot at a time: it is slower than the scenario's tripod at its best."""
    run = drive(AX.replace(duration=4.0), commands=Command(velocity=(0.15, 0.0, 0.0), gait="wave"))
    assert run.attrs["ending"] == "SHORT"
    assert "--velocity 0.0" in run.attrs["ending_reason"]


def test_a_robot_that_slides_back_is_told_of_slope_and_friction():
    ground = {"kind": "slope", "slope_deg": 20, "friction": 0.2, "planned_on": "level"}
    run = drive(AX.replace(terrain=ground), commands=Command(velocity=(0.05, 0.0, 0.0)))
    assert run.attrs["ending"] == "SHORT"
    assert "it slides, since the ground is 20° steep and its friction" in run.attrs["ending_reason"]
    fields, _ = options(run.attrs["ending_reason"])
    better = AX.replace(terrain={**ground, **fields})
    run = drive(better, commands=Command(velocity=(0.05, 0.0, 0.0)))
    assert run.attrs["ending"] == "COMPLETED"


def test_a_robot_that_lost_its_legs_is_not_told_to_walk_slower():
    commands = Command(velocity=(0.05, 0.0, 0.0), lost_legs=frozenset({1, 2, 3}))
    reason = drive(AX, commands=commands).attrs["ending_reason"]
    assert "(stands: 3 of 6 legs remain; at least 4 are needed to walk" in reason
    assert "Try" not in reason


def test_feet_that_lift_too_high_for_the_servos_lift_less():
    scenario = AX.replace(step_height_mm=300)
    velocity = Command(velocity=(0.05, 0.0, 0.0))
    fields, _ = options(drive(scenario, commands=velocity).attrs["ending_reason"])
    assert list(fields) == ["step_height_mm"]
    assert drive(AX.replace(**fields), commands=velocity).attrs["ending"] == "COMPLETED"


@pytest.mark.parametrize(
    "changes",
    [{}, {"step_turn_deg": 12}, {"robot": "quadruped", "gait": "crawl", "duration": 2.5}],
    ids=["straight", "arc", "sway"],
)
def test_the_share_of_a_walk_is_that_of_its_summary(changes):
    """What the run adds up block by block is what the summary computes at once."""
    scenario = PAPER.replace(record_interval=0.01, **changes)
    run = new_run(scenario, plan(scenario))
    share = summarise(run.simulate())["travel"]["distance_share"]
    assert run.following.tracking.distance_share == pytest.approx(share, rel=1e-9)


def test_the_share_of_a_drive_is_that_of_its_summary():
    run = new_drive(AX, None, Command(velocity=(0.05, 0.0, 0.2)))
    travel = summarise(run.simulate())["travel"]
    assert run.following.tracking.distance_share == pytest.approx(
        travel["distance_share"], rel=1e-9
    )
    assert run.following.tracking.turn_share == pytest.approx(travel["turn_share"], rel=1e-9)
