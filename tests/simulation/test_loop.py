"""The loop that leaves Python's lock to other threads, beside the one that does not."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from phasmid.motion import plan
from phasmid.robot import load_servo
from phasmid.scenario import load_scenario
from phasmid.simulation import Run
from phasmid.simulation.run import unlocked_loop
from phasmid.simulation.servo import NUMBERS, servo_numbers

PAPER = load_scenario("paper").replace(duration=0.6)


def both(scenario):
    """A run in either loop."""
    walk = plan(scenario)
    runs = Run(scenario, walk), Run(scenario, walk, beside=True)
    assert [run.unlocked is None for run in runs] == [True, False]
    return runs


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"drive": "ideal-servo"},
        {"drive": "torque"},
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
    assert Run(scenario, plan(scenario), beside=True).unlocked is None


def test_without_numba_runs_side_by_side_take_the_plain_loop(monkeypatch):
    monkeypatch.setattr("phasmid.simulation.run.numba", lambda: None)
    assert unlocked_loop() is None
    assert Run(PAPER, plan(PAPER), beside=True).unlocked is None


def test_runs_take_the_plain_loop_where_the_engine_is_laid_out_otherwise(monkeypatch):
    def missing(*given):
        raise OSError("no library of the engine")

    monkeypatch.setattr("phasmid.simulation.unlocked._new_batch", missing)
    assert Run(PAPER, plan(PAPER), beside=True).unlocked is None


def in_a_process_of_its_own(text: str) -> str:
    """What a script prints, which might crash."""
    script = (
        """
import ctypes, sys
import mujoco
from phasmid.motion import plan
from phasmid.scenario import load_scenario
from phasmid.simulation import Run
from phasmid.simulation.run import unlocked_loop
PAPER = load_scenario('paper').replace(duration=0.3)
def both(scenario):
    walk = plan(scenario)
    return Run(scenario, walk), Run(scenario, walk, beside=True)
"""
        + text
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        check=False,
        capture_output=True,
        text=True,
        cwd=Path(__file__).parents[2],
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


LOST = "the engine left out constraints that hold joints, whose torques are therefore unknown"


@pytest.mark.parametrize("left_out", ["mjDSBL_CONSTRAINT", "mjDSBL_EQUALITY"])
def test_both_loops_end_where_the_engine_leaves_out_constraints(left_out):
    # Of 18 joints none, or 12 of the feet's contacts in their place: no force is read beyond.
    said = in_a_process_of_its_own(f"""
for run in both(PAPER):
    run.advance(until=50)
    run.model.opt.disableflags |= int(mujoco.mjtDisableBit.{left_out})
    print(run.advance(), run.step)
""").splitlines()
    assert said[0] == said[1]
    assert LOST in said[0]
    assert said[0].endswith(" 50")


def test_places_in_the_engines_state_are_found_or_refused():
    said = in_a_process_of_its_own("""
from phasmid.simulation import unlocked
run = both(PAPER)[1]
data = run.data
place = unlocked._place_of(data.efc_force.ctypes.data, data._address)
read = ctypes.c_int64.from_address(place).value
print(read == data.efc_force.ctypes.data)
for name in ("ne", "nefc"):
    at = data._address + unlocked._offset_of(name)
    print(ctypes.c_int32.from_address(at).value == getattr(data, name))
for address in (0, 12345):
    try:
        unlocked._place_of(address, data._address)
    except OSError as error:
        print(error)
""").splitlines()
    assert said == ["True"] * 3 + ["the engine's state is laid out in another way"] * 2


@pytest.mark.parametrize(("package", "library"), [("4.1.0", 4001000), ("4.0.1", 4001000)])
def test_an_engine_of_another_version_is_refused_before_it_is_touched(
    package, library, monkeypatch
):
    from phasmid.simulation import known_engine

    known_engine.check_engine()
    monkeypatch.setattr(mujoco, "__version__", package)
    monkeypatch.setattr(mujoco, "mj_version", lambda: library)
    with pytest.raises(ImportError, match="laid out in another way"):
        known_engine.check_engine()


@pytest.mark.parametrize(
    "change",
    [
        "mujoco.__version__ = '4.1.0'",
        "sys.modules['numba.core.ccallback'] = None",
        "import numba.extending; numba.extending.intrinsic = None",
        "import numba.core.ccallback as c; c.CFunc.compile = lambda self: int([])",
    ],
)
def test_runs_take_the_plain_loop_where_the_machine_code_cannot_be_had(change):
    # None of these may reach a user: without the loop there is the plain one.
    said = in_a_process_of_its_own(f"""
{change}
print(unlocked_loop(), Run(PAPER, plan(PAPER), beside=True).unlocked)
""")
    assert said == "None None\n"


def test_a_servo_has_as_many_numbers_as_the_machine_code_reads():
    servo = load_servo("AX-12A")
    assert servo_numbers(servo, 1e-3, 12.0, 20.0).shape == (NUMBERS,)
