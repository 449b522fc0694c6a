"""The loop that leaves Python's lock to other threads, beside the one that does not."""

from __future__ import annotations

import numpy as np
import pytest

from phasmid.motion import plan
from phasmid.scenario import load_scenario
from phasmid.simulation import Run
from phasmid.simulation.run import unlocked_loop

PAPER = load_scenario("paper").replace(duration=0.6)


def both(scenario):
    """A run in either loop."""
    walk = plan(scenario)
    runs = Run(scenario, walk), Run(scenario, walk, beside=True)
    assert [run._unlocked is None for run in runs] == [True, False]
    return runs


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"drive": "ideal-servo"},
        {"drive": "servo", "dt": 0.0005},
        {"terrain": "steps", "record_interval": 0.003},
    ],
)
def test_both_loops_give_the_same_bits(changes):
    # Both make the same operations in the same order, so that no bit may differ: of the walk, of
    # its last sample, which is measured and not stepped, and of what follows a pause.
    plain, unlocked = both(PAPER.replace(**changes))
    for run in (plain, unlocked):
        assert run.advance(until=100) is None
        assert run.advance() is None
    for name in ("qpos", "qvel", "sensors", "torque", "drive"):
        assert getattr(plain.log, name).tobytes() == getattr(unlocked.log, name).tobytes()
    assert plain.state().tobytes() == unlocked.state().tobytes()


def test_both_loops_tell_of_the_same_error_of_the_engine():
    troubles = []
    for run in both(PAPER):
        run.model.opt.integrator = 99
        troubles.append(run.advance())
    assert troubles[0] == troubles[1]
    assert "the engine says: mj_step: invalid integrator" in troubles[0].reason


def test_both_loops_hear_the_same_complaints_of_the_engine():
    heard = []
    for run in both(PAPER):
        run.advance(until=100)
        run.data.qpos[0] = np.nan
        heard.append((run.advance(), run._complaints))
    assert heard[0] == heard[1]
    assert heard[0][1][0].startswith("Nan, Inf or huge value in QPOS")


def test_an_unlocked_loop_begins_no_step_once_it_is_interrupted():
    run = both(PAPER)[1]
    assert run.advance(interrupted=[1]).ending.name == "STOPPED"
    assert run.step == 0


def test_ground_that_follows_the_feet_is_walked_in_the_plain_loop():
    scenario = PAPER.replace(terrain="waves")
    assert Run(scenario, plan(scenario), beside=True)._unlocked is None


def test_without_numba_runs_side_by_side_take_the_plain_loop(monkeypatch):
    monkeypatch.setattr("phasmid.simulation.run.numba", lambda: None)
    assert unlocked_loop() is None
    assert Run(PAPER, plan(PAPER), beside=True)._unlocked is None


def test_runs_take_the_plain_loop_where_the_engine_is_laid_out_otherwise(monkeypatch):
    def missing(*given):
        raise OSError("no library of the engine")

    monkeypatch.setattr("phasmid.simulation.unlocked._new_batch", missing)
    assert Run(PAPER, plan(PAPER), beside=True)._unlocked is None
