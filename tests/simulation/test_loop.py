"""The loop around the engine's step: errors, complaints, lost constraints, interruption."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from phasmid.motion import plan
from phasmid.scenario import load_scenario
from phasmid.simulation import Run

PAPER = load_scenario("paper").replace(duration=0.3)


@pytest.fixture
def run():
    """A run of the paper's walk."""
    return Run(PAPER, plan(PAPER))


def test_an_error_of_the_engine_ends_the_run(run):
    run.model.opt.integrator = 99
    trouble = run.advance()
    assert trouble.ending.name == "DIVERGED"
    assert "the engine reports: mj_step: invalid integrator" in trouble.reason


def test_a_warning_of_the_engine_ends_the_run(run):
    run.advance(until=100)
    run.data.qpos[0] = np.nan
    run.advance()
    assert run._warnings[0].startswith("Nan, Inf or huge value in QPOS")


def test_an_interrupted_run_begins_no_step(run):
    assert run.advance(interrupted=[1]).ending.name == "STOPPED"
    assert run.step == 0


@pytest.mark.parametrize("left_out", ["mjDSBL_CONSTRAINT", "mjDSBL_EQUALITY"])
def test_a_run_ends_where_the_engine_leaves_out_constraints(run, left_out):
    # Of 18 joints none, or 12 of the feet's contacts in their place: no force is read beyond.
    run.advance(until=50)
    run.model.opt.disableflags |= int(getattr(mujoco.mjtDisableBit, left_out))
    trouble = run.advance()
    lost = "the engine left out constraints that hold joints, whose torques are therefore unknown"
    assert lost in trouble.reason
    assert run.step == 50
