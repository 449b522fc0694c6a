"""Logs of simulated robots whose servos were changed by known amounts, and what compare finds."""

from dataclasses import replace

import numpy as np
import pytest

import phasmid
from identification.synthetic_bench import write_csv
from phasmid.cli import main
from phasmid.control.player import Player
from phasmid.errors import InvalidInput
from phasmid.experiment import Command
from phasmid.identification.bootstrap import BlockBootstrap
from phasmid.identification.replays import Replayer, command_knots
from phasmid.identification.robot_log import RobotLog, log_of_recording

SCENARIO = phasmid.load_scenario("paper").replace(
    robot="phantomx-ax", drive="servo", period=1, duration=2, record_interval=0.01
)
ROBOT = SCENARIO.load_robot()
TICK = ROBOT.servo.resolution
DELAY = ROBOT.servo.delay


def log_of(**changes):
    """Recording of the walk with changed servos; joints are read in ticks, as by an AX-12A."""
    servo = replace(ROBOT.servo, **changes)
    scenario = SCENARIO.replace(robot=replace(ROBOT, servo=servo))
    run = phasmid.simulate(scenario, phasmid.plan(scenario))
    run["joint_position"].values[:] = np.round(run["joint_position"].values / TICK) * TICK
    return run


def write_walk(path, run, **columns):
    """The log of a walk as CSV."""
    target, position = run["joint_position_target"].values, run["joint_position"].values
    write_csv(path, ROBOT, run["time"].values, target, position, **columns)


@pytest.fixture(scope="module")
def unchanged():
    return log_of()


def contains(quantity, difference):
    return quantity.interval[0] <= difference <= quantity.interval[1]


def test_the_log_of_the_same_robot_differs_by_nothing_within_its_intervals(unchanged):
    found = phasmid.compare(unchanged, SCENARIO)
    for name in ("latency", "stiffness", "backlash", "friction", "distance"):
        assert contains(found[name], 0.0), found[name]
    # Friction holds part of the posture in which a replay starts: a tenth of a tick at the feet.
    assert abs(found["sag of the body"].difference) < 0.1 * TICK * 0.15
    # What remains is the reading in ticks, of uniform error: a tick over the root of 12.
    assert found.error == pytest.approx(TICK / np.sqrt(12), rel=0.1)
    assert found.largest_cause is None
    assert "No cause stands out" in found.sentence


def test_delay_stiffness_and_backlash_are_found_together_from_a_csv_file(here):
    run = log_of(delay=DELAY + 0.015, gain_scale=0.8, backlash=np.radians(1))
    # One joint is read every other time, as on a bus without a common read.
    run["joint_position"].values[::2, 0, 1] = np.nan
    way = 1000 * run["body_position"].values[:, 0]
    write_walk(here / "robot.csv", run, distance_mm=way, voltage_v=np.full(len(way), 12.0))
    found = phasmid.compare("robot.csv", SCENARIO)
    # The required 10 % of what was set.
    assert found["latency"].robot == pytest.approx(DELAY + 0.015, rel=0.1)
    stiffness = found["stiffness"]
    assert stiffness.robot / stiffness.simulation == pytest.approx(0.8, rel=0.1)
    assert found.servo.gain_scale == pytest.approx(0.8, rel=0.1)
    # A bound of the maker's resolution: backlash shows in a tick or two of the readings.
    assert found["backlash"].robot == pytest.approx(np.radians(1), abs=TICK)
    assert found["sag of the body"].difference > 0
    # The shares of the causes and of the rest are all of the error.
    shares = [each.share for each in found.quantities if each.share is not None]
    assert sum(shares) + found.rest_share == pytest.approx(1)
    assert found.rest_share < 0.1
    assert found.rest < 0.5 * found.error
    assert found.largest_cause.name == "latency"
    assert "delay_ms = 2" in found.sentence
    assert found["distance"].robot == pytest.approx(1e-3 * (way[-1] - way[0]))
    # Not in the log: absent, not zero.
    names = {each.name for each in found.quantities}
    assert not {"roll, mean", "pitch, mean", "temperature"} & names


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "name", "value", "others"),
    [
        ({"gain_scale": 0.8}, "stiffness", 0.8, ("latency",)),
        ({"backlash": np.radians(2)}, "backlash", np.radians(2), ()),
    ],
)
def test_a_single_change_is_found_and_is_the_largest_cause(changes, name, value, others):
    found = phasmid.compare(log_of(**changes), SCENARIO)
    cause = found[name]
    scale = cause.simulation if name == "stiffness" else 1.0
    assert cause.robot / scale == pytest.approx(value, rel=0.1 if name != "backlash" else 0.25)
    assert found.largest_cause is cause
    for other in others:
        # A change of one parameter is not taken for another: less than 5 % of its own value.
        assert found[other].difference == pytest.approx(0, abs=0.05 * found[other].simulation)


@pytest.mark.slow
def test_delay_and_stiffness_are_found_where_a_controller_holds_its_targets():
    servo = replace(ROBOT.servo, delay=DELAY + 0.015, gain_scale=0.8)
    scenario = SCENARIO.replace(robot=replace(ROBOT, servo=servo), record_interval=0.005)
    player = Player(phasmid.plan(scenario))
    found = phasmid.compare(phasmid.drive(scenario, player, Command(), rate=50), SCENARIO)
    assert found["latency"].robot == pytest.approx(DELAY + 0.015, rel=0.1)
    assert found.servo.gain_scale == pytest.approx(0.8, rel=0.1)


def test_held_targets_count_in_the_middle_of_their_hold():
    # Commands at 50 Hz of a ramp, held in a log at 200 Hz: the mean target is 10 ms late.
    time = np.arange(401) * 0.005
    ramp = 0.1 * np.floor(time / 0.02 + 1e-9) * 0.02
    target = np.repeat(ramp, 18).reshape(-1, 6, 3)
    knots, targets = command_knots(RobotLog("held", time, target, target, {}))
    assert np.allclose(targets[1:, 0, 0], 0.1 * (knots[1:] - 0.01), rtol=0, atol=1e-9)


def test_intervals_of_correlated_errors_hold_in_most_repetitions():
    # First-order noise of 50 ms in 200 logs of 8 s at 100 Hz. At a coverage of 95 % fewer than
    # 180 have a probability of 0.1 %; ten blocks leave it a little below.
    rng, hits = np.random.default_rng(1), 0
    time, kept = np.arange(801) * 0.01, np.exp(-0.2)
    for _ in range(200):
        noise = rng.standard_normal(len(time))
        for k in range(1, len(time)):
            noise[k] = kept * noise[k - 1] + np.sqrt(1 - kept**2) * noise[k]
        terms = np.column_stack([noise, np.ones_like(noise)])
        mean, half = BlockBootstrap(time).estimate(terms, lambda s: s[..., :1] / s[..., 1:])
        hits += abs(mean[0]) <= half[0]
    assert 180 <= hits <= 199


def test_a_replay_has_the_servo_of_the_fit_also_where_the_scenario_names_one(unchanged):
    log = log_of_recording(unchanged, "walk", ROBOT)
    soft = replace(ROBOT.servo, gain_scale=0.5)
    given, named = (
        Replayer(log, scenario).replay(soft).at(0.0).position
        for scenario in (SCENARIO, SCENARIO.replace(servo="AX-12A"))
    )
    np.testing.assert_array_equal(named, given)


def test_a_replay_carries_the_payload_of_the_scenario_once():
    scenario = SCENARIO.replace(payload=0.5)
    run = phasmid.simulate(scenario, phasmid.plan(scenario))
    log = log_of_recording(run, "walk", scenario.load_robot())
    replayed = Replayer(log, scenario).replay(ROBOT.servo).at(0.0)
    # Targets between samples are interpolated, hence the tick.
    error = np.abs(replayed.position - log.position)[log.time > 0.5]
    assert error.max() < TICK


def test_the_command_prints_a_table_and_writes_its_figures(here, unchanged, capsys):
    phasmid.save_recording(unchanged.isel(time=slice(160)), "walk.nc")
    assert main(["identify", "--compare", "walk.nc", "--robot", "phantomx-ax", "--out", "out"]) == 0
    out = capsys.readouterr().out
    table = out.split("\n\n")[1]
    assert max(map(len, table.splitlines())) <= 80
    for words in ("latency [ms]", "stiffness", "sag of the body [mm]", "distance [mm]"):
        assert words in out
    files = {"angles.svg", "comparison.json", "errors.svg", "spectrum.svg"}
    assert {file.name for file in (here / "out").iterdir()} == files
    assert main(["identify", "--compare", "walk.nc", "--robot", "phantomx-ax", "--out", "out"]) == 2
    assert "exists; nothing was written" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: "", "log lacks 37 columns: time, right_front.coxa.target"),
        (lambda text: text.replace("coxa.target", "coxa.targat"), '"right_front.coxa.target"'),
        (lambda text: text.replace("coxa.target_deg", "coxa.target_mm"), "its unit is no angle"),
        (lambda text: text.replace("target_deg", "target_rad"), "log has joint targets up to 1"),
        (lambda text: "\n".join(text.splitlines()[:100]), "log lasts 0.98 s; a comparison needs"),
        (lambda text: text.replace("\n10,", "\n0,"), "log row 2: time 0 s does not follow 0 s"),
        (lambda text: text.replace("\n10,", "\nsoon,"), 'column time_ms: "soon" is not a number'),
    ],
)
def test_a_bad_csv_file_gets_one_sentence(here, unchanged, capsys, change, words):
    write_walk(here / "log.csv", unchanged)
    text = (here / "log.csv").read_text()
    (here / "log.csv").write_text(change(text))
    assert main(["identify", "--compare", "log.csv", "--robot", "phantomx-ax"]) == 2
    message = capsys.readouterr().err
    assert words in message
    assert "in   log.csv" in message


def test_a_log_without_motion_or_of_another_robot_gets_one_sentence(here, unchanged, capsys):
    still = unchanged.copy(deep=True)
    still["joint_position_target"].values[:] = still["joint_position_target"].values[:1]
    with pytest.raises(InvalidInput, match="no joint target moves by more than 0°"):
        phasmid.compare(still, SCENARIO)
    with pytest.raises(InvalidInput, match="6 legs; quadruped has 4"):
        phasmid.compare(unchanged, SCENARIO.replace(robot="quadruped", gait="crawl"))
    assert main(["identify", "--compare", "absent.csv"]) == 2
    assert "log absent.csv does not exist" in capsys.readouterr().err
