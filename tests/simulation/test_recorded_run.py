"""Runs that are recorded to a log, repeated, continued, and made side by side."""

import signal
import threading
import warnings

import numpy as np
import pytest

from phasmid import replay, simulate_many
from phasmid.errors import FailedRuns, InvalidInput
from phasmid.forces import analyse
from phasmid.forces.analysis import model_channels
from phasmid.motion import plan
from phasmid.recording import DamagedRecording, load_recording, save_recording
from phasmid.scenario import load_scenario, scenario_to_toml
from phasmid.simulation import Run, WalkExperiment, new_run, simulate
from phasmid.simulation.model_reference import CHANNELS
from walks import with_servo

PAPER = load_scenario("paper").replace(duration=1.2)
DRIVES = ("prescribed", "ideal-servo")
SLOW = {"voltage": 9.0, "robot": with_servo(control_period=4e-3)}
UNEVEN = {"planned_on": "level", "step_length_mm": 80, "period": 1.0, "terrain_start_mm": 260}
SIMULATIONS = {
    "prescribed": {},
    "ideal-servo": {"drive": "ideal-servo"},
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


@pytest.mark.parametrize("drive", DRIVES)
def test_a_run_through_a_log_gives_the_bits_of_one_in_memory(tmp_path, drive):
    scenario = PAPER.replace(drive=drive, record_interval=0.003, measured="everything")
    walk = plan(scenario)
    memory = simulate(scenario, walk)
    file = simulate(scenario, walk, log=tmp_path / "walk.mcap")
    assert file.identical(memory)
    assert "imu_acceleration" in file
    assert [p.name for p in tmp_path.iterdir()] == ["walk.mcap"]


def test_an_interrupted_run_is_whole_in_its_log(tmp_path):
    def interrupt(done):
        if done > 0.6:
            signal.raise_signal(signal.SIGINT)

    trouble = WalkExperiment(PAPER, plan(PAPER)).record(tmp_path / "walk.mcap", progress=interrupt)
    assert trouble.ending.name == "STOPPED"
    recording = load_recording(tmp_path / "walk.mcap")
    assert recording.attrs["ending_reason"] == trouble.sentence
    assert 600 < recording.sizes["time"] < 1200
    whole = simulate(PAPER, plan(PAPER)).isel(time=slice(0, recording.sizes["time"]))
    assert bits(recording) == bits(whole)


def test_a_second_interrupt_ends_the_run_at_once_and_its_log_is_readable(tmp_path):
    def interrupt(done):
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        WalkExperiment(PAPER, plan(PAPER)).record(tmp_path / "walk.mcap", progress=interrupt)
    with pytest.warns(DamagedRecording, match="is cut off"):
        assert load_recording(tmp_path / "walk.mcap").attrs["ending"] == "CUT"


def test_the_state_that_ends_a_run_is_its_last_sample(tmp_path):
    scenario = PAPER.replace(robot=with_servo(stall_torque=0.2), drive="ideal-servo")
    walk = plan(scenario)
    run = Run(scenario, walk)
    # Put low above the ground with servos that cannot hold it: it comes down within the run.
    run.failure = None
    run.data.qpos[2] = 0.08
    trouble = run.advance()
    assert trouble.ending.name == "FELL"
    last, before = run.log["qpos"][run.done - 1], run.log["qpos"][run.done - 2]
    # The box is 50 mm high and nearly level: its underside is on the ground below 25 mm.
    w, x, y, z = last[3:7]
    up = np.abs([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
    assert last[2] < walk.robot.body.size / 2 @ up < before[2] + 1e-3
    at = run.time[run.done - 1]
    assert trouble.reason.startswith(f"at {at:.3f} s, the recording's last sample: the trunk")


def test_samples_after_the_last_number_are_dropped_and_the_sentence_says_where():
    run = Run(PAPER, plan(PAPER))
    run.advance(until=700)
    run.data.qvel[5] = np.nan
    trouble = run.advance()
    assert run.done == 700
    assert trouble.reason.startswith("at 0.700 s, after the recording's last sample at 0.699 s: ")


@pytest.mark.parametrize("changes", SIMULATIONS.values(), ids=SIMULATIONS)
def test_a_saved_state_goes_on_to_the_same_bits(tmp_path, changes):
    scenario = PAPER.replace(**changes)
    walk = plan(scenario)
    whole = simulate(scenario, walk)
    run = new_run(scenario, walk)
    run.advance(until=777)
    assert run.done == 777
    np.save(tmp_path / "state.npy", run.state())
    state = np.load(tmp_path / "state.npy", allow_pickle=False)
    rest = simulate(scenario, walk, start=state)
    assert bits(rest) == bits(whole.isel(time=slice(777, None)))
    # And it is repeated from what it says of itself.
    assert replay(rest).equal


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda s: s[:-1], "start has shape"),
        (lambda s: s * np.nan, "finite numbers"),
        (lambda s: np.r_[5000.0, s[1:]], "start is at step 5000; it must be one of 0 to 1200"),
        (lambda s: np.r_[0.5, s[1:]], "start is at step 0.5"),
    ],
)
def test_what_is_no_state_of_the_run_is_refused(spoil, words):
    walk = plan(PAPER)
    state = Run(PAPER, walk).state()
    with pytest.raises(InvalidInput, match=words):
        simulate(PAPER, walk, start=spoil(state))


@pytest.mark.parametrize("kind", [*DRIVES, "simscape"])
def test_a_recording_is_repeated_from_its_own_header_bit_by_bit(tmp_path, kind):
    changes = {"gait": "ripple", "step_length_mm": 31, "record_interval": 0.004}
    scenario = PAPER.replace(**SIMULATIONS[kind], **changes)
    recording = simulate(scenario, plan(scenario))
    save_recording(recording, tmp_path / "a.nc")
    found = replay(tmp_path / "a.nc")
    assert found.equal
    assert str(found) == "equal: 301 samples of 18 channels, bit by bit."


def test_a_replay_tells_where_the_first_bit_differs_and_which_versions(tmp_path):
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
    WalkExperiment(PAPER, plan(PAPER)).record(path)
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
        PAPER.replace(step_length_mm=20),
        PAPER.replace(drive="servo", dt=0.0005, duration=0.3),
        PAPER.replace(drive="servo", duration=0.5, **SLOW),
        PAPER.replace(terrain="steps", duration=0.3),
        PAPER.replace(terrain="waves", duration=0.3),
        PAPER.replace(step_turn_deg=10, record_interval=0.007, duration=0.3),
    ]
    told = []
    many = simulate_many(
        [scenarios[0], (scenarios[1], plan(scenarios[1])), *scenarios[2:]],
        workers=3,
        progress=told.append,
    )
    assert told == list(range(1, 10))
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
    with pytest.raises(InvalidInput, match="workers is 0"):
        simulate_many([PAPER], workers=0)
    assert simulate_many([]) == []


def test_the_engine_complains_to_the_thread_whose_run_it_is(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    wild = with_servo(stiffness=1e7, damping=0.0, armature=0.0, stall_torque=1e7)
    scenario = PAPER.replace(robot=wild, drive="ideal-servo", dt=0.0022)
    good, bad = simulate_many([PAPER, scenario], workers=2)
    assert bad.sizes["time"] >= 1
    assert (good.attrs["ending"], bad.attrs["ending"]) == ("COMPLETED", "DIVERGED")
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr().err == ""


def test_a_run_in_another_thread_needs_no_signals():
    done = []
    thread = threading.Thread(target=lambda: done.append(simulate(PAPER, plan(PAPER))))
    thread.start()
    thread.join()
    assert done[0].attrs["ending"] == "COMPLETED"


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"force_model": "friction-cone", "torque_limits": "counted", "load_transfer": 0.01},
        {"terrain": "waves"},
    ],
)
def test_the_model_has_the_same_bits_whichever_samples_are_computed_together(changes):
    # A log is filled block by block, and a replay or a state may begin and end anywhere.
    scenario = PAPER.replace(**changes)
    walk, time = plan(scenario), np.arange(1201) * 0.001
    whole = model_channels(scenario, walk.sample(time))
    for block in (1, 7, 512):
        for first in range(0, 1201 if block == 512 else 70, block):
            part = slice(first, first + block)
            for name, values in model_channels(scenario, walk.sample(time[part])).items():
                assert values.tobytes() == whole[name][part].tobytes()


@pytest.fixture
def asked(monkeypatch):
    """How many samples the model was asked for, call by call."""
    counts = []

    def counted(scenario, walk):
        counts.append(len(walk.q))
        return model_channels(scenario, walk)

    monkeypatch.setattr("phasmid.simulation.model_reference.model_channels", counted)
    return counts


def test_a_run_asks_the_model_for_each_sample_of_a_cycle_once(tmp_path, asked):
    # Two cycles of 1000 steps of 1 ms each, and the end; the figures of the first serve the second.
    scenario = PAPER.replace(duration=2, period=1)
    WalkExperiment(scenario, plan(scenario)).record(tmp_path / "walk.mcap")
    assert asked == [1000]
    asked.clear()
    simulate(scenario.replace(duration=0.3), plan(scenario))
    assert asked == [301]


@pytest.mark.parametrize(
    "changes", [{"step_turn_deg": 10}, {"terrain": "waves"}, {"period": 0.9995}]
)
def test_a_run_asks_the_model_for_no_sample_twice(asked, changes):
    # These cycles are not alike in the world, or are no whole number of samples.
    scenario = PAPER.replace(**{"duration": 1.2, "period": 1.2} | changes)
    walk = plan(scenario)
    told = simulate(scenario, walk)
    assert max(asked) <= 1024
    assert sum(asked) == 1201
    right = model_channels(scenario, walk.sample(told["time"].values))
    for name in CHANNELS:
        assert told[name].values.tobytes() == right[name].tobytes(), name


def test_a_long_run_in_a_log_keeps_few_figures(asked, tmp_path, monkeypatch):
    # Two blocks where one is kept: each is computed for the check, and again in its turn.
    monkeypatch.setattr("phasmid.simulation.model_reference.KEPT_BLOCKS", 1)
    scenario = PAPER.replace(duration=1.5, terrain="waves")
    walk = plan(scenario)
    WalkExperiment(scenario, walk).record(tmp_path / "walk.mcap")
    assert sum(asked) == 2 * 1501
    assert bits(load_recording(tmp_path / "walk.mcap")) == bits(simulate(scenario, walk))


def test_one_cycle_of_the_model_serves_all_but_for_round_off():
    # Seen from the body all cycles are alike. Times of up to 4 s have a round-off of 4e-16 s, joint
    # speeds stay below 10 rad/s and their changes below 1e3 rad/s2 and 1e5 rad/s3, and an angle's
    # round-off passes through sums of some tens of terms: hence 1e-9 of the largest number.
    scenario = PAPER.replace(duration=4)
    walk = plan(scenario)
    told = simulate(scenario, walk)
    right = model_channels(scenario, walk.sample(told["time"].values))
    for name in CHANNELS:
        scale = np.abs(right[name]).max()
        assert np.abs(told[name].values.astype(float) - right[name]).max() <= 1e-9 * scale, name


def test_a_replay_of_a_few_samples_asks_the_model_for_no_more(asked):
    scenario = PAPER.replace(duration=3, terrain="waves")
    recording = simulate(scenario, plan(scenario)).isel(time=slice(0, 5))
    asked.clear()
    assert replay(recording).equal
    assert asked == [5]


@pytest.mark.parametrize("terrain", ["flat", "waves"])
def test_a_replay_of_a_few_samples_plans_no_more(monkeypatch, terrain):
    scenario = PAPER.replace(duration=30, terrain=terrain)
    walk = plan(scenario.replace(duration=0.1))
    recording = simulate(scenario.replace(duration=0.1), walk)
    recording.attrs["scenario"] = scenario_to_toml(scenario, "robot.toml")
    planned = []

    def counted(scenario):
        planned.append(scenario.duration)
        return plan(scenario)

    monkeypatch.setattr("phasmid.simulation.rerun.plan", counted)
    assert replay(recording).equal
    assert planned == [pytest.approx(0.101, abs=1e-12)]


def test_ctrl_c_while_a_run_is_prepared_ends_it_at_once(monkeypatch):
    def interrupt(scenario, walk):
        signal.raise_signal(signal.SIGINT)
        raise AssertionError("it went on")

    monkeypatch.setattr("phasmid.simulation.model_reference.model_channels", interrupt)
    with pytest.raises(KeyboardInterrupt):
        simulate(PAPER, plan(PAPER))


def test_a_run_that_is_stopped_does_not_settle():
    run = Run(PAPER, plan(PAPER), interrupted=[1])
    assert run.failure.ending.name == "STOPPED"
    assert not run.data.qvel.any()


def test_a_start_after_the_last_recorded_step_is_refused():
    # 1200 steps, of which each 7th is recorded: the last is 171 * 7 = 1197.
    scenario = PAPER.replace(record_interval=0.007)
    walk = plan(scenario)
    state = Run(scenario, walk).state()
    assert Run(scenario, walk, start=np.r_[1197.0, state[1:]]).time.tolist() == [171 * 0.007]
    with pytest.raises(InvalidInput, match="at step 1198; it must be one of 0 to 1197"):
        Run(scenario, walk, start=np.r_[1198.0, state[1:]])


def test_a_run_that_fails_in_any_way_leaves_the_others(monkeypatch):
    right = WalkExperiment.simulate

    def failing(experiment, **options):
        if experiment.scenario.name == "bad":
            raise ZeroDivisionError("division by zero")
        return right(experiment, **options)

    monkeypatch.setattr(WalkExperiment, "simulate", failing)
    with pytest.raises(FailedRuns) as caught:
        simulate_many([PAPER.replace(name="bad"), PAPER], workers=1)
    assert caught.value.what == "run 1 of 2 (bad): ZeroDivisionError: division by zero."
    assert caught.value.recordings[0] is None
    assert caught.value.recordings[1].attrs["ending"] == "COMPLETED"


def test_ctrl_c_ends_all_runs_side_by_side():
    def interrupt(done):
        raise KeyboardInterrupt

    # The second run would take half a minute; it ends within a block of steps.
    long = PAPER.replace(duration=1000, record_interval=0.1)
    with pytest.raises(KeyboardInterrupt):
        simulate_many([PAPER, long], workers=2, progress=interrupt)
