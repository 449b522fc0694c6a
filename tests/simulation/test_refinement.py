"""What the time step costs."""

import numpy as np
import pytest

from phasmid.cli import main
from phasmid.motion import plan
from phasmid.recording import load_recording
from phasmid.reporting import summarise
from phasmid.scenario import load_scenario
from phasmid.simulation import simulate, time_step_refinement

PAPER = load_scenario("paper").replace(duration=1.0)


def test_the_difference_is_that_of_two_runs():
    # By hand: rms difference over rms of the run at half the step, at common instants.
    found = time_step_refinement(PAPER, plan(PAPER))
    coarse = simulate(PAPER, plan(PAPER))
    halved = PAPER.replace(dt=0.0005, record_interval=0.0005)
    fine = simulate(halved, plan(halved)).isel(time=slice(None, None, 2))
    assert fine.time.values == pytest.approx(coarse.time.values, abs=1e-12)
    for name, value in (
        ("foot_normal_force", found.normal_force),
        ("joint_torque", found.joint_torque),
    ):
        square = ((coarse[name].values - fine[name].values) ** 2).sum()
        assert value == pytest.approx(np.sqrt(square / (fine[name].values ** 2).sum()), rel=1e-12)
    apart = coarse.body_position.values - fine.body_position.values
    assert found.way == pytest.approx(np.sqrt((apart**2).sum(axis=1)).max(), rel=1e-12)
    assert (found.time_step, found.duration) == (0.001, 1.0)


def test_the_summary_quotes_it_where_it_was_asked_for(tmp_path, capsys):
    call = ["walk", "--duration", "1", "--no-figures"]
    assert main([*call, "--out", str(tmp_path / "with"), "--check-time-step"]) == 0
    assert "Time step        1 ms against half of it" in capsys.readouterr().out
    told = summarise(load_recording(tmp_path / "with" / "recording.nc"))["time_step_refinement"]
    assert told == vars(time_step_refinement(PAPER, plan(PAPER)))
    assert main([*call, "--out", str(tmp_path / "without")]) == 0
    assert "Time step" not in capsys.readouterr().out
    recording = load_recording(tmp_path / "without" / "recording.nc")
    assert "time_step_refinement" not in summarise(recording)
