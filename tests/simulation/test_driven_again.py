"""Driven runs of phasmid's own controllers are made again from their recordings, bit by bit."""

import pytest

from phasmid import drive, load_scenario, plan, replay
from phasmid.control import CommandScript, LocomotionEngine, Player
from phasmid.errors import InvalidInput
from phasmid.experiment import Command
from phasmid.simulation.drive import scenario_controller

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


@pytest.mark.parametrize(
    "controller",
    [
        lambda: Player(plan(PAPER)),
        lambda: LocomotionEngine(PAPER.load_robot(), step_height=0.02, gait="ripple"),
        lambda: scenario_controller(PAPER, 200.0, acceleration=0.3),
    ],
    ids=["player", "engine", "engine in safety"],
)
def test_phasmids_controllers_are_made_again_with_their_settings(controller):
    script = CommandScript(command=[{"ahead": 0.05}])
    assert replay(drive(PAPER.replace(duration=0.5), controller(), script)).equal


def test_a_controller_of_ones_own_cannot_be_run_again_from_a_recording():
    class Own(Player):
        pass

    scenario = PAPER.replace(duration=0.1)
    run = drive(scenario, Own(plan(scenario)))
    with pytest.raises(InvalidInput, match=r"was driven by .*Own, which a recording does not hold"):
        replay(run)
