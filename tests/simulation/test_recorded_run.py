"""Runs that are recorded to a log, repeated, continued, and made side by side."""

import signal
import warnings

import numpy as np
import pytest

from phasmid import replay, simulate_many
from phasmid.errors import FailedRuns, InvalidInput
from phasmid.forces import analyse
from phasmid.forces.analysis import model_channels
from phasmid.motion import plan
from phasmid.recording import DamagedRecording, load_recording
from phasmid.scenario import load_scenario
from phasmid.simulation import Run, new_run, simulate
from phasmid.simulation.model_reference import CHANNELS
from support.walks import with_servo

PAPER = load_scenario("paper").replace(duration=1.2)
SLOW = {"voltage": 9.0, "robot": with_servo(control_period=4e-3)}
UNEVEN = {"planned_on": "level", "step_length_mm": 80, "period": 1.0, "terrain_start_mm": 260}
SIMULATIONS = {
    "prescribed": {},
    "ideal-servo": {"drive": "ideal-servo", "gait": "ripple", "record_interval": 0.004},
    # Rotors, heat, timers and the phase of the control period are all part of the run's state.
    "servo": {"drive": "servo", **SLOW},
    # The next step depends on pose, twist and plan alone.
    "simscape": {"contact_law": "simscape"},
    # Planes and friction of the feet follow from the state alone.
    "rough": {"terrain": "rough", **UNEVEN},
    "ice": {"terrain": "ice", **UNEVEN},
}


def bits(recording):
    """All numbers of a recording, as bytes."""
    return {name: recording[name].values.tobytes() for name in [*recording, "time"]}


@pytest.mark.parametrize("drive", ["prescribed", "ideal-servo"])
def test_a_run_through_a_log_gives_the_bits_of_one_in_memory(tmp_path, drive):
    scenario = PAPER.replace(drive=drive, record_interval=0.003, measured="everything")
    walk = plan(scenario)
    memory = simulate(scenario, walk)
    file = simulate(scenario, walk, log=tmp_path / "walk.mcap")
    assert file.identical(memory)
    assert "imu_acceleration" in file
    assert [p.name for p in tmp_path.iterdir()] == ["walk.mcap"]


def test_a_second_interrupt_ends_the_run_at_once_and_its_log_is_readable(tmp_path, monkeypatch):
    # A second one that follows within this time is only noted.
    monkeypatch.setattr("phasmid.interrupts.REPEAT_TIME", 0.0)

    def interrupt(done):
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        simulate(PAPER, plan(PAPER), log=tmp_path / "walk.mcap", progress=interrupt)
    with pytest.warns(DamagedRecording, match="is cut off"):
        assert load_recording(tmp_path / "walk.mcap").attrs["ending"] == "CUT"


def test_the_state_that_ends_a_run_is_its_last_sample(tmp_path):
    scenario = PAPER.replace(robot=with_servo(rated_stall_torque=0.2), drive="ideal-servo")
    walk = plan(scenario)
    run = Run(scenario, walk)
    # Put low above the ground with servos that cannot hold it: it comes down within the run.
    run.failure = None
    run.data.qpos[2] = 0.08
    failure = run.advance()
    assert failure.ending.name == "FELL"
    last, before = run.log["qpos"][run.done - 1], run.log["qpos"][run.done - 2]
    # The box is 50 mm high and nearly level: its underside is on the ground below 25 mm.
    w, x, y, z = last[3:7]
    up = np.abs([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
    assert last[2] < walk.robot.body.size / 2 @ up < before[2] + 1e-3
    at = run.time[run.done - 1]
    assert failure.reason.startswith(f"at {at:.3f} s, the recording's last sample: the trunk")


def test_samples_after_the_last_number_are_dropped_and_the_sentence_says_where():
    run = Run(PAPER, plan(PAPER))
    run.advance(until=700)
    run.data.qvel[5] = np.nan
    failure = run.advance()
    assert run.done == 700
    assert failure.reason.startswith("at 0.700 s, after the recording's last sample at 0.699 s: ")


@pytest.mark.parametrize("changes", SIMULATIONS.values(), ids=SIMULATIONS)
def test_a_saved_state_goes_on_to_the_same_bits_and_both_are_repeated(tmp_path, changes):
    scenario = PAPER.replace(**changes)
    walk = plan(scenario)
    whole = simulate(scenario, walk)
    run = new_run(scenario, walk)
    run.advance(until=777)
    np.save(tmp_path / "state.npy", run.state())
    state = np.load(tmp_path / "state.npy", allow_pickle=False)
    rest = simulate(scenario, walk, start=state)
    assert run.done + rest.sizes["time"] == whole.sizes["time"]
    assert bits(rest) == bits(whole.isel(time=slice(run.done, None)))
    found = replay(rest)
    assert found.equal
    channels = len(whole.data_vars)
    samples = whole.sizes["time"]
    assert str(replay(whole)) == f"equal: {samples} samples of {channels} channels, bit by bit."


@pytest.mark.parametrize(
    "spoil",
    [lambda s: s[:-1], lambda s: s * np.nan, lambda s: np.r_[1201.0, s[1:]]],
    ids=["short", "nan", "late"],
)
def test_what_is_no_state_of_the_run_is_refused(spoil):
    walk = plan(PAPER)
    state = Run(PAPER, walk).state()
    with pytest.raises(InvalidInput, match=r"is no state of a run of this walk; .* from 0 to 1200"):
        simulate(PAPER, walk, start=spoil(state))


def test_a_replay_tells_where_the_first_bit_differs_and_which_versions():
    recording = simulate(PAPER, plan(PAPER)).assign_attrs(mujoco_version="3.9")
    torque = recording.joint_torque.values
    torque[800, 2, 1] = np.nextafter(torque[800, 2, 1], np.inf)
    recording.joint_velocity.values[900] = 0.0
    found = replay(recording)
    assert (found.difference.channel, found.difference.sample) == ("joint_torque", 800)
    assert found.difference.time == 0.8
    assert found.difference.recorded == torque[800, 2, 1]
    assert set(found.versions) == {"mujoco_version"}
    assert str(found).startswith("different: joint_torque at sample 800 (0.8 s) is ")
    assert str(found).endswith("3.9 then.")


def test_a_log_that_was_cut_off_is_repeated_as_far_as_it_goes(tmp_path):
    path = tmp_path / "walk.mcap"
    simulate(PAPER, plan(PAPER), log=path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DamagedRecording)
        assert replay(path).equal


def test_what_was_not_simulated_is_not_repeated():
    with pytest.raises(InvalidInput, match="only a simulation can be run again"):
        replay(analyse(PAPER, plan(PAPER)))


def test_runs_side_by_side_give_the_bits_of_runs_one_by_one():
    scenarios = [
        PAPER,
        PAPER.replace(gait="wave"),
        PAPER.replace(drive="ideal-servo"),
        PAPER.replace(drive="servo", dt=0.0005, duration=0.3),
        PAPER.replace(drive="servo", duration=0.5, **SLOW),
        PAPER.replace(terrain="waves", duration=0.3),
        PAPER.replace(step_turn_deg=10, record_interval=0.007, duration=0.3),
    ]
    counts = []
    many = simulate_many(
        [scenarios[0], (scenarios[1], plan(scenarios[1])), *scenarios[2:]],
        workers=3,
        progress=counts.append,
    )
    assert counts == list(range(1, 8))
    for scenario, recording in zip(scenarios, many, strict=True):
        assert recording.identical(simulate(scenario, plan(scenario)))


def test_a_run_that_is_refused_is_named_and_the_others_are_kept():
    bad = PAPER.replace(name="far", step_length_mm=400)
    with pytest.raises(FailedRuns) as caught:
        simulate_many([PAPER, bad, PAPER], workers=2)
    assert caught.value.what.startswith("run 2 of 3 (far): ")
    assert list(caught.value.errors) == [1]
    first, refused, last = caught.value.recordings
    assert refused is None
    assert first.identical(last)
    absent = PAPER.replace(name="absent", robot="absent.toml")
    with pytest.raises(FailedRuns, match=r"run 1 of 2 \(absent\): ") as caught:
        simulate_many([absent, PAPER])
    assert caught.value.recordings[1].identical(first)
    with pytest.raises(InvalidInput, match="workers is 0"):
        simulate_many([PAPER], workers=0)
    assert simulate_many([]) == []


def test_ctrl_c_ends_all_runs_side_by_side():
    def interrupt(done):
        raise KeyboardInterrupt

    # The second run would take half a minute; it ends within a block of steps.
    long = PAPER.replace(duration=1000, record_interval=0.1)
    with pytest.raises(KeyboardInterrupt):
        simulate_many([PAPER, long], workers=2, progress=interrupt)


@pytest.mark.parametrize(
    "changes", [{"duration": 4}, {"step_turn_deg": 10, "duration": 3}, {"period": 0.9995}], ids=str
)
def test_the_model_beside_a_run_is_that_of_its_instants(changes):
    # One cycle may serve all, seen from the body. Times of up to 4 s have a round-off of 4e-16 s,
    # joint speeds stay below 10 rad/s and their changes below 1e3 rad/s2 and 1e5 rad/s3, and an
    # angle's round-off passes through sums of some tens of terms: 1e-9 of the largest number.
    scenario = PAPER.replace(**changes)
    walk = plan(scenario)
    run = simulate(scenario, walk)
    right = model_channels(scenario.build(), walk.sample(run["time"].values))
    for name in CHANNELS:
        scale = np.abs(right[name]).max()
        assert np.abs(run[name].values.astype(float) - right[name]).max() <= 1e-9 * scale, name
