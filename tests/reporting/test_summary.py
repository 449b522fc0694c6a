"""The numbers of a walk whose every signal is known are the known ones."""

import io
import json
import math

import numpy as np
import pytest

import phasmid
from phasmid.advice import servo_verdict
from phasmid.errors import InvalidInput
from phasmid.kinematics import yaw_quaternion
from phasmid.recording import CHANNELS, new_recording
from phasmid.reporting import Source, print_summary, read_run, summarise
from phasmid.reporting.numbers import commanded_way
from phasmid.reporting.steps import SETTLING, away_from_switches
from phasmid.reporting.summary import check_number
from phasmid.reporting.text import head
from phasmid.robot import load_robot


def changed(recording, **channels):
    """The recording with other numbers in some channels."""
    arrays = {str(name): recording[name].values for name in recording} | channels
    attributes = {name: value for name, value in recording.attrs.items() if name != "format"}
    return new_recording(recording["time"].values, arrays, attributes)


def printed(summary, **options):
    text = io.StringIO()
    print_summary(summary, file=text, **options)
    return text.getvalue()


def test_ten_steps_of_forty_millimetres_are_four_hundred(paper_walk):
    way = summarise(paper_walk)["travel"]
    # Sums of ten terms of order 0.1 m: round-off is below 1e-15 each.
    assert way["distance"] == pytest.approx(0.4, abs=1e-12)
    assert way["forward"] == pytest.approx(0.4, abs=1e-12)
    assert way["commanded_distance"] == pytest.approx(0.4, abs=1e-12)
    assert way["commanded_steps"] == pytest.approx(10)
    assert way["mean_speed"] == pytest.approx(0.04, abs=1e-12)
    assert way["sideways_drift"] == pytest.approx(0.0, abs=1e-12)
    assert way["heading_change"] == 0.0
    assert way["body_height_change"] == pytest.approx(0.0, abs=1e-12)


def test_a_commanded_turn_adds_up_step_by_step(short_walk):
    source = read_run(short_walk)
    stride = {"step_turn": math.pi / 8, "step_length": 0.1, "step_sideways": 0.02}
    turning = Source(source.experiment.replace(**stride), source.robot)
    # Four steps of 1 s, each from where the last one left the body, in its axes.
    place = sum((0.1 + 0.02j) * np.exp(1j * math.pi / 8 * step) for step in range(4))
    way = commanded_way(turning, 4.0)
    assert way["turn"] == pytest.approx(math.pi / 2, rel=1e-14)
    assert way["forward"] == pytest.approx(place.real, rel=1e-13)
    assert way["sideways"] == pytest.approx(place.imag, rel=1e-13)
    assert way["distance"] == pytest.approx(4 * math.hypot(0.1, 0.02), rel=1e-14)


def test_the_way_is_seen_from_the_starting_heading(short_walk):
    # Walking along world y with the body turned to it is walking forward.
    position = short_walk["body_position"].values[:, [1, 0, 2]]
    quarter = yaw_quaternion(np.full(len(position), math.pi / 2))
    way = summarise(changed(short_walk, body_position=position, body_orientation=quarter))["travel"]
    assert way["forward"] == pytest.approx(0.16, abs=1e-12)
    assert way["sideways_drift"] == pytest.approx(0.0, abs=1e-12)
    # A heading is counted beyond half a turn.
    turning = yaw_quaternion(np.linspace(0, 3 * math.pi, len(position)))
    way = summarise(changed(short_walk, body_orientation=turning))["travel"]
    assert way["heading_change"] == pytest.approx(3 * math.pi, abs=1e-12)


def test_feet_that_slip_three_millimetres_a_step_are_found(walk):
    recording = walk(duration=4.0, interval=0.01, slip=0.003)
    slip = summarise(recording)["slip"]
    # The last sample of a stance of 100 intervals belongs to the swing: one hundredth is missing.
    assert slip["mean"] == pytest.approx(0.003, rel=0.0101)
    assert slip["largest"] == pytest.approx(0.003, rel=0.0101)
    # Three legs stand four times half a second, in four seconds of half and half: twice each.
    assert slip["steps"] == 12
    # A foot in the air does not slip.
    lifted = changed(recording, contact=np.zeros_like(recording["contact"].values))
    assert summarise(lifted)["slip"]["largest"] == 0.0


def test_normal_forces_add_up_to_the_weight_over_whole_cycles(walk):
    recording = walk(duration=5.0, interval=0.01)
    force = recording["foot_normal_force"].values.copy()
    force[recording["time"].values > 4.0 + 1e-6] = 1000.0
    found = summarise(changed(recording, foot_normal_force=force))["normal_force"]
    # The signal is the weight in every sample, and the model 2 % more.
    assert found["simulation"]["sum_over_weight"] == pytest.approx(1.0, rel=1e-12)
    assert found["simulation"]["cycles"] == 2
    assert found["model"]["sum_over_weight"] == pytest.approx(1.02, rel=1e-12)
    force = summarise(walk(duration=4.0, interval=0.01))["normal_force"]["simulation"]
    assert force["mean_in_stance"] == pytest.approx([26 / 3] * 6, rel=1e-9)


def test_touching_in_swing_counts_only_away_from_the_switches(short_walk):
    time, force = short_walk["time"].values, short_walk["foot_normal_force"].values.copy()
    # Leg 1 swings from 0 to 1 s: 7 N just after the lift, 0.5 N amid the swing.
    force[np.abs(time - 0.05) < 0.02, 0] = 7.0
    force[np.abs(time - 0.50) < 0.02, 0] = 0.5
    found = summarise(changed(short_walk, foot_normal_force=force))["normal_force"]["simulation"]
    assert found["largest_in_swing"] == 0.5


def test_torques_are_given_with_their_share_of_stall(short_walk):
    stall = load_robot("phantomx-paper").servo.stall_torque
    time = short_walk["time"].values
    torque = np.zeros((len(time), 6, 3))
    torque[:, 1, 1] = -0.5 * stall * np.sin(2 * np.pi * time / 2.0)
    found = summarise(changed(short_walk, joint_torque=torque))["torque"]["simulation"]
    assert found["peak"][1][1] == pytest.approx(0.5 * stall, rel=1e-12)
    assert found["peak_over_stall"][1][1] == pytest.approx(0.5, rel=1e-12)
    # Two whole periods of 401 samples: the mean square is a half, but for the double end point.
    assert found["rms"][1][1] == pytest.approx(0.5 * stall / math.sqrt(2), rel=1 / 400)
    # |sin| > 2/5 for 1 - 2 asin(0.4)/pi of the time, of one joint in eighteen.
    share = (1 - 2 * math.asin(0.4) / math.pi) / 18
    assert found["share_above_continuous"] == pytest.approx(share, abs=8 / 401 / 18)


def test_the_model_differs_by_what_was_put_in(short_walk):
    compared = summarise(short_walk)["model_against_simulation"]
    np.testing.assert_allclose(compared["torque"]["rms"], 0.01, rtol=1e-9)
    np.testing.assert_allclose(compared["torque"]["rms_mid_stance"], 0.01, rtol=1e-9)
    # Two hundredths of a third of the weight, in half of the samples.
    np.testing.assert_allclose(
        compared["normal_force"]["rms"], 0.02 * 26 / 3 / math.sqrt(2), rtol=0.02
    )


def test_positive_work_and_cost_of_transport(short_walk):
    samples = short_walk.sizes["time"]
    torque, speed = np.zeros((samples, 6, 3)), np.ones((samples, 6, 3))
    torque[:, 0, 0], torque[:, 1, 0] = 0.5, -0.5
    found = summarise(changed(short_walk, joint_torque=torque, joint_velocity=speed))["energy"]
    # One joint drives with 0.5 W for 4 s; the one that brakes gives nothing back.
    assert found["work"] == pytest.approx(2.0, rel=1e-12)
    assert found["cost_of_transport"] == pytest.approx(2.0 / (26 * 0.16), rel=1e-9)
    # A robot that goes nowhere has none.
    still = summarise(changed(short_walk, body_position=np.zeros((samples, 3))))["energy"]
    assert "work" in still
    assert "cost_of_transport" not in still


def test_what_the_recording_lacks_is_absent(walk):
    analysis = walk(
        duration=4.0,
        interval=0.05,
        kind="model",
        drop=[name for name in CHANNELS if not name.endswith(("_target", "_model", "stance"))],
    )
    summary = summarise(analysis)
    assert set(summary["torque"]) == {"model"}
    assert set(summary["normal_force"]) == {"model"}
    assert summary["speed"]["channel"] == "joint_velocity_target"
    assert summary["energy"]["channel"] == "joint_torque_model"
    assert "cost_of_transport" not in summary["energy"]
    assert {"slip", "support", "model_against_simulation"}.isdisjoint(summary)
    assert {name for name in summary["travel"] if not name.startswith("commanded")} == set()
    text = printed(summary)
    assert "analysis" in text
    assert "nan" not in text


def test_a_run_that_diverged_is_judged_by_its_finite_part(short_walk):
    torque = short_walk["joint_torque"].values.copy()
    torque[-3:] = np.nan
    position = short_walk["body_position"].values.copy()
    position[-1] = np.inf
    summary = summarise(changed(short_walk, joint_torque=torque, body_position=position))
    assert summary["run"]["samples_not_finite"] == 3
    assert summary["run"]["duration"] == pytest.approx(3.97)
    json.dumps(summary, allow_nan=False)
    assert "the last 3 not finite" in printed(summary)
    torque[:] = np.nan
    summary = summarise(changed(short_walk, joint_torque=torque))
    assert set(summary["torque"]) == {"model"}


@pytest.mark.parametrize("value", [1e13, 1e160, -1e308])
def test_values_that_no_robot_reaches_count_as_infinite(short_walk, value):
    """Warnings are errors here, so that no sum of squares may overflow."""
    for name in (name for name in short_walk if short_walk[name].dtype.kind == "f"):
        values = short_walk[name].values.copy()
        values[-3:] = value
        summary = summarise(changed(short_walk, **{name: values}))
        assert summary["run"]["samples_not_finite"] == 3
        assert printed(summary)


def test_a_log_of_years_is_summed_up_in_no_more_chords_than_samples(short_walk):
    time = short_walk["time"].values * 1e8
    arrays = {str(name): short_walk[name].values for name in short_walk}
    attributes = {key: value for key, value in short_walk.attrs.items() if key != "format"}
    assert summarise(new_recording(time, arrays, attributes))["travel"]["distance"] > 0


def test_a_recording_without_its_robot_is_refused(short_walk):
    bare = new_recording(np.arange(3.0), {}, {"scenario": "x"})
    with pytest.raises(InvalidInput, match="has no robot"):
        summarise(bare)
    damaged = new_recording(np.arange(3.0), {}, {"scenario": "=", "robot": "name = 'x'"})
    with pytest.raises(InvalidInput, match="recording's scenario line 1: "):
        summarise(damaged)
    attributes = {name: value for name, value in short_walk.attrs.items() if name != "format"}
    four = new_recording(np.arange(3.0), {"foot_normal_force": np.zeros((3, 4))}, attributes)
    with pytest.raises(InvalidInput, match="the recording has 4 legs; the robot"):
        summarise(four)


def test_a_printed_summary_fits_a_screen(paper_walk):
    lines = printed(summarise(paper_walk)).splitlines()
    # The sentences on the servos are as long as they are; one line of them counts.
    first, after = (
        next(i for i, line in enumerate(lines) if line.startswith(label))
        for label in ("Servos hold?", "Model agrees?")
    )
    assert len(lines) - (after - first - 1) <= 35
    assert max(map(len, lines)) <= 80
    assert all(line == line.rstrip() for line in lines)
    text = "\n".join(lines)
    assert "\x1b" not in text
    for piece in (
        "COMPLETED",
        "400.00 mm, commanded 400.00 mm; 40.0 mm/s",
        "26.000 N, weight 26.000 N (100.00 %)",
        "servo AX-12A",
        "prescribed drive",
        "minimum-norm",
        "6 left front",
    ):
        assert piece in " ".join(text.split())


def test_the_first_lines_answer_what_a_person_asks(paper_walk, walk):
    summary = summarise(paper_walk)
    # 0.03 N·m of 0.3 and 0.04 N·m of 0.4 are a tenth each, and so is the root of their squares.
    summary["torque"]["simulation"]["rms"] = [[0.3, 0.4, 0.0]] * 6
    summary["model_against_simulation"]["torque"]["rms"] = [[0.03, 0.04, 0.0]] * 6
    summary["model_against_simulation"]["normal_force"]["rms"] = None
    summary["servo_verdict"] = {"lines": ["HOLDS: a joint needs 0.2 N·m.", "More of it."]}
    summary["warnings"] = ["Feet slip.", "It tips."]
    lines = printed(summary).splitlines()
    assert lines[:8] == [
        "phantomx-paper · tripod gait · simulation",
        "Walked?          100.0 % of the commanded distance (COMPLETED)",
        "How far?         400.00 mm, commanded 400.00 mm; 40.0 mm/s",
        "Servos hold?     HOLDS: a joint needs 0.2 N·m.",
        "                 More of it.",
        "Model agrees?    rms difference of torques 10 %",
        "Warnings         Feet slip. And 1 more, at the end.",
        "",
    ]
    assert lines[-2:] == ["! Feet slip.", "! It tips."]
    alone = walk(duration=1.0)
    alone = alone.drop_vars([name for name in alone.data_vars if str(name).endswith("_model")])
    summary = summarise(alone)
    summary["servo_verdict"] = {}
    quiet = printed(summary).splitlines()
    assert quiet[3:6] == [
        "Servos hold?     not judged",
        "Model agrees?    not compared: this run has no model",
        "Warnings         none",
    ]


def test_the_verdict_on_the_servos_is_that_of_the_runs_experiment(short_walk):
    verdict = servo_verdict(read_run(short_walk).experiment).as_dict()
    found = summarise(short_walk)["servo_verdict"]
    # What is unknown or infinite is left out.
    assert found["lines"] == verdict["lines"]
    assert found["least_margin"] == verdict["least_margin"]
    assert found.items() <= verdict.items()
    # The stance of a trajectory is unknown.
    attributes = {name: value for name, value in short_walk.attrs.items() if name != "format"}
    channels = {name: short_walk[name].values for name in short_walk.data_vars}
    played = new_recording(short_walk.time.values, channels, attributes | {"trajectory": "a.csv"})
    assert not summarise(played).get("servo_verdict")


def test_a_printed_summary_can_be_of_some_legs(short_walk):
    summary = summarise(short_walk)
    assert summary["warnings"] == []
    text = printed(summary, legs=(2,))
    assert "!" not in text
    assert "2 right middle" in text
    assert "1 right front" not in text
    with pytest.raises(InvalidInput, match="there is no leg 9; legs are 1 to 6"):
        printed(summary, legs=(1, 9))


def test_names_cannot_steer_the_terminal(short_walk):
    evil = "\x1b[2J\x07bad\u202e"
    text = printed(
        summarise(short_walk.assign_attrs(ending="FELL", ending_reason=evil, servo=evil))
    )
    assert "bad" in text
    assert not {"\x1b", "\x07", "\u202e"} & set(text)


def test_what_the_robot_cannot_do_is_said_at_the_end(walk):
    recording = walk(duration=4.0, interval=0.01, slip=0.012)
    servo = load_robot("phantomx-paper").servo
    force = recording["foot_normal_force"].values.copy()
    # Leg 1 swings from 0 to 1 s.
    force[50, 0] = 13.8
    torque, speed = np.zeros((401, 6, 3)), np.zeros((401, 6, 3))
    torque[7, 2, 1], speed[7, 2, 1] = -1.13 * servo.stall_torque, 1.5 * servo.no_load_speed
    position = recording["body_position"].values + np.array([0.5, 0.0, 0.0])
    told = {"foot_normal_force": force, "joint_torque": torque, "joint_velocity": speed}
    summary = summarise(changed(recording, **told, body_position=position))
    margin = summary["support"]["least_margin"]
    # A slip of 12 mm, but for the hundredth that the last sample of a stance takes.
    assert summary["warnings"] == [
        "The largest torque is 113 % of the AX-12A's stall torque: "
        "these servos cannot make this walk.",
        "The fastest joint turns at 150 % of the AX-12A's no-load speed: "
        "these servos cannot make this walk.",
        f"The centre of mass leaves the support polygon by {-1000 * margin:.1f} mm: "
        "the robot tips.",
        "Feet slip 11.9 mm a step on average.",
        "Swinging legs touch the ground: up to 13.8 N outside 80 ms of the switches.",
    ]
    lines = printed(summary).splitlines()
    assert max(map(len, lines)) <= 80
    first = next(k for k, line in enumerate(lines) if line.startswith("! "))
    assert all(line.startswith(("! ", "  ")) for line in lines[first:])
    assert sum(line.startswith("! ") for line in lines) == 5


@pytest.mark.parametrize("share", [0.23, 0.8, 1.2, -0.5])
def test_a_completed_walk_that_left_its_way_is_warned_of(short_walk, share):
    # Four steps of 40 mm: within a step the pace may differ by 0.15 of it, 4 % of the way, so
    # that more than 14 % counts.
    position = short_walk["body_position"].values * np.array([share, 1.0, 1.0])
    lost = changed(short_walk, body_position=position)
    lost.attrs["ending"] = "COMPLETED"
    walked = f"The robot walked {100 * share:.0f} % of its commanded distance"
    sentence = f"{walked}: it does not follow its plan."
    summary = summarise(lost)
    assert sentence in summary["warnings"]
    assert dict(head(summary))["Walked?"].startswith(
        f"{100 * share:.1f} % of the commanded distance ("
    )
    for attributes in ({"ending": "FELL"}, {"trajectory": "any"}):
        told = lost.assign_attrs(attributes)
        assert not any(
            "of its commanded distance" in sentence for sentence in summarise(told)["warnings"]
        )


def test_a_driven_robot_that_does_not_get_on_is_warned_of(short_walk):
    """It walks to and fro across its way, as one before a hole: the distance is no progress."""
    position = short_walk["body_position"].values * np.array([0.1, 1.0, 1.0])
    position[:, 1] += 0.08 * np.sin(2 * np.pi * short_walk["time"].values / 4)
    lost = changed(short_walk, body_position=position)
    lost.attrs |= {"ending": "COMPLETED", "controller": "any"}
    summary = summarise(lost)
    assert "The robot walked 10 % of its commanded distance." in summary["warnings"]
    assert summary["travel"]["distance"] > 0.2


def test_a_walk_that_ends_just_before_a_switch_is_judged_as_one_that_ends_on_it():
    """Feet touch down some milliseconds before the switch at 2 s, the last sample or later.

    Away from switches swing feet carry nothing, and model and simulation differ by contact
    vibrations alone, 0.03 N; touchdowns that count as swing make it 0.5 N.
    """
    scenario = phasmid.load_scenario("paper")
    for duration in (1.97, 1.995, 2.0):
        part = scenario.replace(duration=duration)
        walk = phasmid.plan(part)
        summary = summarise(phasmid.simulate(part, walk))
        assert summary["normal_force"]["simulation"]["largest_in_swing"] == 0.0, duration
        assert max(summary["model_against_simulation"]["normal_force"]["rms"]) < 0.1, duration
        assert summary.get("warnings", []) == [], duration


def test_too_few_standing_feet_are_warned_of(short_walk):
    none = np.zeros_like(short_walk["stance"].values)
    told = summarise(changed(short_walk, stance=none))["warnings"]
    assert any("fewer than three feet stand" in sentence for sentence in told)


def test_samples_near_a_switch_are_those_of_the_definition():
    rng = np.random.default_rng(1)
    time = np.cumsum(rng.choice([0.01, 0.02, 0.005], 400))
    stance = np.repeat(rng.random((40, 3)) < 0.5, 10, axis=0)
    found = away_from_switches(time, stance)
    for leg in range(3):
        switches = [0, *(k for k in range(1, 400) if stance[k, leg] != stance[k - 1, leg]), 399]
        for k in range(400):
            away = all(abs(time[k] - time[switch]) >= SETTLING - 1e-9 for switch in switches)
            assert found[k, leg] == away
    assert 0.05 < found.mean() < 0.95


def test_every_single_number_of_a_summary_may_be_a_metric():
    """`check_number` knows the numbers of a plan and of a simulation of the paper's robot."""

    def numbers(summary, place=""):
        for key, value in summary.items():
            if isinstance(value, dict):
                yield from numbers(value, f"{place}{key}.")
            elif isinstance(value, int | float):
                yield f"{place}{key}"

    scenario = phasmid.Scenario(duration=2.0)
    walk = phasmid.plan(scenario)
    runs = {
        "plan": phasmid.analyse(scenario, walk),
        "simulate": phasmid.simulate(scenario, walk),
    }
    for kind, recording in runs.items():
        for name in numbers(summarise(recording)):
            check_number(name, kind)
