"""Driven runs of phasmid's own controllers are made again from their recordings, bit by bit."""

import json

import pytest

from phasmid import drive, load_recording, load_scenario, plan, replay, report, summarise
from phasmid.control import (
    Command,
    CommandScript,
    LocomotionEngine,
    Player,
    SafetyFilter,
    SafetySettings,
    Sequencer,
)
from phasmid.errors import InvalidInput

pytestmark = pytest.mark.usefixtures("compiled_engine")

PAPER = load_scenario("paper").replace(duration=1.5, period=1.0)
SCRIPT = CommandScript(
    between="linear", command=[{"time": 0.2, "ahead": 0.05}, {"time": 1.0, "turn": 0.3}]
)


@pytest.mark.parametrize(
    ("changes", "commands", "faults"),
    [
        ({}, SCRIPT, []),
        (
            {"drive": "servo", "measured": "everything"},
            SCRIPT,
            ["right_middle.tibia dead at 0.5 s", "imu dead at 0.7 s"],
        ),
        ({}, CommandScript(waypoint=[{"x": 0.02, "y": 0.01}]), []),
        ({"start_posture": "packed"}, CommandScript(command=[{"posture": "standing"}]), []),
        ({}, lambda t, o: None if t > 1.03 else Command(velocity=(t / 20, 0.0, 0.0)), []),
    ],
    ids=["script", "faults", "places", "getting up", "function"],
)
def test_a_driven_recording_is_enough_to_run_it_again_to_the_bit(
    tmp_path, changes, commands, faults
):
    drive(PAPER.replace(**changes), None, commands, faults=faults, log=tmp_path / "run.mcap")
    again = replay(tmp_path / "run.mcap")
    assert again.equal, str(again)


def test_a_played_walk_is_run_again_too():
    scenario = PAPER.replace(duration=0.5)
    assert replay(drive(scenario, Player(plan(scenario)))).equal


def test_an_engine_within_sequences_and_safety_of_ones_own_is_run_again_too():
    robot, settings = PAPER.load_robot(), SafetySettings(command_time=0.1)
    engine = LocomotionEngine(robot, step_height=0.02)
    controller = SafetyFilter(Sequencer(engine, robot), robot, settings)
    script = CommandScript(command=[{"ahead": 0.05}])
    run = drive(PAPER.replace(duration=0.5), controller, script)
    assert replay(run).equal
    bare = drive(PAPER.replace(duration=0.5), LocomotionEngine(robot, step_height=0.02), script)
    assert json.loads(run.attrs["controller_around"])[0]["command_time"] == 0.1
    assert "controller_around" not in bare.attrs


def test_a_controller_of_ones_own_cannot_be_run_again_from_a_recording():
    class Own(Player):
        pass

    scenario = PAPER.replace(duration=0.1)
    run = drive(scenario, Own(plan(scenario)))
    with pytest.raises(InvalidInput, match=r"was driven by .*Own, which a recording does not hold"):
        replay(run)


def test_a_driven_run_is_reported_with_what_was_asked_and_got(tmp_path):
    scenario = PAPER.replace(duration=3.0, drive="prescribed")
    run = drive(scenario, commands=Command(velocity=(0.05, 0.0, 0.1)))
    told = summarise(run)["velocity"]
    assert told["commanded"] == pytest.approx([0.05, 0.0, 0.1])
    # It starts from rest at 0.6 m/s²: within 0.1 s of 3 s it is as fast as it was asked to be.
    assert told["actual"] == pytest.approx(told["commanded"], rel=0.06, abs=1e-3)
    folder = report(run, tmp_path / "run", figures=True)
    assert (folder / "report.html").exists()
    again = load_recording(folder)
    assert again.attrs["commands"] == (folder / "commands.toml").read_text("utf-8")
