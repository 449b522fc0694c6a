"""How runs end, and that what was seen until then is kept."""

import signal
from dataclasses import replace

import numpy as np
import pytest

from phasmid.errors import InfeasibleLoad
from phasmid.experiment import Ending
from phasmid.interrupts import StopSignals
from phasmid.motion import plan
from phasmid.recording import load_recording
from phasmid.robot import load_robot
from phasmid.scenario import load_scenario
from phasmid.simulation import Run, simulate, simulate_many
from phasmid.simulation.termination import check_termination
from support.walks import with_servo

PAPER = load_scenario("paper")
LEVEL = PAPER.load_terrain()


def standing(count=10):
    """States of a robot that stands still, (N, 25) and (N, 24)."""
    qpos, qvel = np.zeros((count, 25)), np.zeros((count, 24))
    qpos[:, 2], qpos[:, 3] = 0.1, 1.0
    return qpos, qvel


@pytest.mark.parametrize(
    ("column", "value", "ending"),
    [
        (("qpos", 9), np.nan, Ending.DIVERGED),
        (("qvel", 3), np.inf, Ending.DIVERGED),
        (("qvel", 0), 21.0, Ending.DIVERGED),
        (("qvel", 20), -201.0, Ending.DIVERGED),
        (("qpos", 2), 0.0249, Ending.FELL),
    ],
)
def test_the_first_bad_sample_is_found(column, value, ending):
    # The box is 50 mm high: its underside meets the ground below 25 mm.
    qpos, qvel = standing()
    {"qpos": qpos, "qvel": qvel}[column[0]][7:, column[1]] = value
    trouble = check_termination(load_robot("phantomx-paper"), qpos, qvel, LEVEL)
    assert (trouble.ending, trouble.sample) == (ending, 7)


@pytest.mark.parametrize("axis", [(1.0, 0.0), (0.6, 0.8)], ids=["roll", "both"])
@pytest.mark.parametrize(("degrees", "falls"), [(59.9, False), (60.1, True)])
def test_a_trunk_tilted_past_60_degrees_has_fallen(degrees, falls, axis):
    qpos, qvel = standing()
    half = np.radians(degrees) / 2
    qpos[4:, 2] = 1.0
    qpos[4:, 3:6] = [np.cos(half), *(np.sin(half) * np.array(axis))]
    trouble = check_termination(load_robot("phantomx-paper"), qpos, qvel, LEVEL)
    assert (trouble is not None) == falls


def test_weak_servos_let_the_robot_fall_and_the_run_says_so():
    scenario = PAPER.replace(robot=with_servo(rated_stall_torque=0.2), drive="ideal-servo")
    run = simulate(scenario, plan(scenario))
    assert run.attrs["ending"] == "FELL"
    assert run.attrs["ending_reason"].startswith("The robot fell at ")
    assert run.sizes["time"] < 10_001


def test_a_state_that_is_no_number_ends_the_run_as_diverged():
    run = Run(PAPER, plan(PAPER))
    run.data.qvel[5] = np.nan
    trouble = run.advance()
    assert trouble.ending is Ending.DIVERGED
    # The state in which it was put stays, so that there is something to look at.
    assert run.done == 1


def test_errors_and_warnings_of_the_engine_end_the_run():
    run = Run(PAPER, plan(PAPER))
    run.model.opt.integrator = 99
    failure = run.advance()
    assert failure.ending is Ending.DIVERGED
    assert "the engine reports: mj_step: invalid integrator" in failure.reason
    run = Run(PAPER, plan(PAPER))
    run.advance(until=100)
    run.data.qpos[0] = np.nan
    run.advance()
    assert run._warnings[0].startswith("Nan, Inf or huge value in QPOS")


def test_engines_warn_the_thread_whose_run_it_is_and_nobody_else(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    wild = with_servo(stiffness=1e7, damping=0.0, armature=1e-9, rated_stall_torque=1e7)
    scenario = PAPER.replace(robot=wild, drive="ideal-servo", dt=0.0022)
    good, bad = simulate_many([PAPER.replace(duration=1.0), scenario], workers=2)
    assert (good.attrs["ending"], bad.attrs["ending"]) == ("COMPLETED", "DIVERGED")
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr().err == ""


def test_a_robot_that_cannot_even_stand_has_fallen_at_its_first_sample():
    robot = load_robot("phantomx-paper")
    tall = replace(robot, body=replace(robot.body, size=np.array([0.25, 0.2, 0.21])))
    scenario = PAPER.replace(robot=tall)
    run = simulate(scenario, plan(scenario))
    assert run.attrs["ending"] == "FELL"
    assert run.attrs["ending_reason"].startswith(
        "The robot fell before its first step: the trunk touched the ground."
    )
    assert run.sizes["time"] == 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("log", [None, "run.mcap"])
def test_a_stopped_run_is_no_result_and_its_log_is_kept(log, number, tmp_path):
    def interrupt(done):
        if done > 1.0:
            signal.raise_signal(number)

    path = log and tmp_path / log
    with StopSignals(), pytest.raises(KeyboardInterrupt, match=r"stopped by the user at 1\."):
        simulate(PAPER, plan(PAPER), progress=interrupt, log=path)
    if path:
        run = load_recording(path)
        assert run.attrs["ending"] == "STOPPED"
        assert 1000 < run.sizes["time"] < 1600
        assert np.isfinite(run.joint_torque.values).all()


def test_a_run_that_is_advanced_raises_too_unless_its_caller_looks_at_the_ending():
    def interrupt(done):
        if done > 0.1:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        Run(PAPER, plan(PAPER)).advance(interrupt)
    with StopSignals() as signals:
        # Its exception was swallowed before the run.
        signals.noticed.append(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            Run(PAPER, plan(PAPER)).advance()
    failure = Run(PAPER, plan(PAPER)).advance(interrupted=[signal.SIGINT])
    assert failure is not None
    assert failure.ending is Ending.STOPPED


def test_a_load_that_the_feet_cannot_share_is_refused_before_the_run():
    # Friction of 0.001 is less than swinging the legs asks for (0.03 on this walk).
    scenario = PAPER.replace(force_model="friction-cone", friction=0.001)
    told = []
    with pytest.raises(InfeasibleLoad, match="would slip"):
        simulate(scenario, plan(scenario), progress=told.append)
    assert told == []
