"""The driver of a robot on a bus, in virtual time: start, walk, end, faults, log."""

import json
import math
import os
from contextlib import contextmanager
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from phasmid.control import CommandScript, SafetyFilter
from phasmid.control.types import LegPhase
from phasmid.errors import InvalidInput, OutputError
from phasmid.experiment import Command, JointTargets
from phasmid.hardware import (
    DriverSettings,
    Reaction,
    RobotBus,
    default_calibration,
    inspect_servos,
    model,
)
from phasmid.hardware.paced_targets import PacedTargets
from phasmid.hardware.stages import Stage
from phasmid.recording import load_recording
from phasmid.robot import load_robot
from support.virtual_bus import folded, goal_of, new_driver, virtual_bus

RATE = 50.0
WALKS_AT = 6.0
"""Time at which a robot with folded legs has stood up and walks [s]."""

REACTION = 0.2
"""Longest time from the detection of a fault to its reaction on the servos [s]."""

ROBOT = load_robot("phantomx-ax")
WAYPOINT = CommandScript.model_validate({"waypoint": [{"x": 0.1, "y": 0.0}]})


class Still:
    """A controller that holds the first angles, or moves on from the present ones.

    Args:
        way: How far its targets are from the joints at each update [rad].
    """

    def __init__(self, way=0.0):
        self.way, self.seen = way, []

    def reset(self, observation):
        self.q = observation.joint_position

    def update(self, observation, command):
        self.seen.append(observation)
        q = observation.joint_position + self.way if self.way else self.q
        return JointTargets(q, 0 * q)

    def telemetry(self):
        return {"gait_phase": 0.5}


SEEDS = int(os.environ.get("PHASMID_FAULT_SEEDS", "0"))
"""Seeds of each fault; 0: one seed of some faults. `make slow SUITE=bus` takes 20."""


def driven(monkeypatch, *, name="AX-12A", faults=(), seed=0, at=(), duration=1.5, **arguments):
    """Drive a robot with faults, and with actions at times.

    Returns:
        Driver, emulator, report, and the time at which the driver's own begins [s].
    """
    bus_settings = {"name": name, "faults": faults, "seed": seed, "plant": folded(name)}
    begins = []
    with virtual_bus(monkeypatch, **bus_settings) as (*robot, bus, emulator, clock):
        driver = new_driver(*robot, bus, **arguments)
        driver.on_event = lambda time, _: begins.append(clock.now - time)
        for when, action in at:
            clock.at(when, lambda action=action: action(driver, emulator, bus))
        return driver, emulator, driver.drive(duration), begins[0]


def event(report, words):
    """Return the time of the first event with some words [s]."""
    return next(time for time, sentence in report.events if words in sentence)


def check_reactions(driver, emulator, begun, dead=()):
    """Check on the servos that each event was followed by its reaction in time, until the next."""
    time, enabled, goals, position = emulator.traces()
    time, report = time - begun, driver.report
    ends = [*(at for at, _ in report.events[1:]), math.inf]
    for (at, sentence), end in zip(report.events, ends, strict=True):
        rows = (time > at + REACTION) & (time < end)
        if "torque is" in sentence:
            # Servos have confirmed it before it is said.
            assert not np.delete(enabled[time > at], dead, axis=1).any(), sentence
        elif "no goals are written" in sentence and rows.any():
            assert np.ptp(goals[rows], axis=0).max() == 0, sentence
        elif "sits down" in sentence:
            # The servos' own limit of 60°/s counts: feed-forward moves the goals, too. Its register
            # has steps of 0.111 rpm, 0.7°/s.
            way = np.abs(np.diff(position[rows], axis=0)).max(axis=1, initial=0.0)
            speed = (way / np.diff(time[rows])).max(initial=0.0)
            assert speed <= driver.settings.sit_speed + math.radians(0.7)


def goal_speed(time, goals):
    """Return the largest speed of goals, which change once in a period [rad/s]."""
    steps = [goals[k] for k in np.flatnonzero(np.diff(goals, axis=0, prepend=-99).any(axis=1))]
    return max((np.abs(b - a).max() * RATE for a, b in pairwise(steps)), default=0.0)


# Start and end ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["AX-12A", "MX-28", "XL430-W250"])
def test_a_robot_stands_up_slowly_walks_and_lies_limp_at_the_end(monkeypatch, name):
    driver, emulator, report, begin = driven(monkeypatch, name=name)
    assert report.ending is None
    assert [sentence.split(" ", 2)[2] for _, sentence in report.events] == [
        "stands up.",
        "walks.",
        "sits down.",
        "limits are lowered.",
        "is off.",
    ]
    assert report.walked == pytest.approx(1.5, abs=1.5 / RATE)
    time, enabled, goals, position = emulator.traces()
    time = time - begin
    begun, walks = report.events[0][0], report.events[1][0]
    # Goals are rounded to steps of a servo: half a step more at each end of a period.
    step = driver.robot.bus.models[1].register("goal_position").scale
    rises = (time > 0.05) & (time < walks)
    assert goal_speed(time[rises], goals[rises]) <= math.radians(30) + step * RATE
    assert np.ptp(goals[(time > 0.05) & (time < begun)], axis=0).max() == 0
    moved = position[time > 0][0] - position[time < begun][-1]
    assert np.abs(moved).max() <= step
    # Output limits are written to one servo after the other, a round in 0.2 s.
    lowered = event(report, "limits are lowered") + driver.settings.ramp_time - 0.2
    assert enabled[(time > begun) & (time < lowered)].all()
    assert not enabled[-1].any()


def test_the_output_rises_and_falls_gradually(monkeypatch):
    limits = []

    def watch(driver, emulator, bus):
        limits.append(emulator.servos[0].torque_limit)

    driven(monkeypatch, at=[(0.4 + 0.1 * k, watch) for k in range(200)])
    changes = np.sign(np.diff(limits))
    turn = np.flatnonzero(changes < 0)[0]
    # Each ramp takes 1 s: some ten of the looks fall on it.
    assert not (changes[:turn] < 0).any()
    assert (changes[:turn] > 0).sum() >= 8
    assert not (changes[turn:] > 0).any()
    assert (changes[turn:] < 0).sum() >= 8


def test_goals_stay_within_the_limits_of_robot_and_calibration(monkeypatch):
    _, emulator, *_ = driven(monkeypatch, controller=Still(5.0), duration=1.0)
    _, _, goals, _ = emulator.traces()
    rows = default_calibration(ROBOT, model("AX-12A"))
    to_si = model("AX-12A").register("goal_position").to_si
    for row, column in zip(rows, goals.T, strict=True):
        assert to_si(row.range_min) <= column[200:].min()
        assert column[200:].max() <= to_si(row.range_max)


def test_paced_targets_pass_the_controllers_path_at_a_limited_speed():
    path = np.cumsum(np.array([0.0, 0.1, 0.05, 0.3, 0.0, 0.02, 0.0, 0.0]))
    updates = iter(path[1:])
    paced = PacedTargets(np.array([[path[0]]]), 0.02, lambda: np.array([[next(updates)]]))
    passed = [paced.advance(1.0)[0, 0] for _ in range(25)]
    assert np.diff(passed, prepend=0.0).max() <= 0.02 + 1e-12
    # Where the speed suffices, an update takes a period: the last two targets.
    assert passed[-1] == pytest.approx(path[-1])


def test_commands_begin_when_the_robot_stands_and_their_end_lets_it_sit(monkeypatch):
    times = []

    def command(time, observation):
        times.append(time)
        return Command((0.03, 0.0, 0.0)) if time < 1.0 else None

    _, _, report, _ = driven(monkeypatch, commands=command, duration=math.inf)
    assert times[0] == pytest.approx(1 / RATE)
    assert report.walked == pytest.approx(1.0, abs=2.5 / RATE)
    assert report.ending is None


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"commands": WAYPOINT}, "waypoints need the robot's place"),
        ({"rate": 0.0}, "rate is 0; it must be a finite number greater than 0"),
        ({"rate": math.inf}, "rate is inf"),
        ({"controller": SafetyFilter(Still(), ROBOT)}, "lets no robot stand up or sit down"),
    ],
)
def test_what_no_drive_can_follow_is_refused(monkeypatch, changes, words):
    with virtual_bus(monkeypatch) as (*robot, bus, _, _), pytest.raises(InvalidInput, match=words):
        new_driver(*robot, bus, **changes)


def test_waypoints_are_followed_by_the_estimated_state_of_the_body(monkeypatch, tmp_path):
    """Servos turn to their goals, so that the robot is where its engine has it, within 10 mm.

    Readings are late by up to two periods of 20 ms, 2 mm at 50 mm/s, and each of the steps may add
    half an encoder's step of 5 mrad on 0.2 m.
    """
    script = WAYPOINT
    level = {"angular_velocity": np.zeros(3), "acceleration": np.array([0.0, 0.0, 9.80665])}
    with virtual_bus(monkeypatch, name="AX-12A", plant=folded()) as (*robot, bus, _, _):
        robot[0] = robot[0].replace(body_state="estimated")
        with pytest.raises(InvalidInput, match="inertial sensor"):
            new_driver(*robot, bus, commands=script)

        def sensors():
            phase = driver.controller.controller.walker.state.leg_phase
            return level | {"contact": phase == LegPhase.STANCE}

        log = tmp_path / "a.mcap"
        driver = new_driver(*robot, bus, commands=script, sensors=sensors, log=log)
        report = driver.drive(20.0)
        walked = driver.controller.controller.walker.state.path
    assert report.ending is None
    assert report.walked < 15.0
    place = load_recording(log)["body_position_estimated"].values[-1]
    assert place[:2] == pytest.approx(walked[:2], abs=0.01)
    assert np.hypot(*(place[:2] - [0.1, 0.0])) < script.follow.reached + 1e-3


# Faults -------------------------------------------------------------------------------------------


def stop(reaction):
    return lambda driver, emulator, bus: driver.stop(reaction)


def low_supply(driver, emulator, bus):
    emulator.plant.voltage[:] = 6.1


W = f"at {WALKS_AT:g} s"
FAULTS = {
    "1 % lost": (["lost 0.01"], [], "the robot walks"),
    "all late": ([f"late 1 by 300 ms {W}"], [], "no goals are written"),
    "gap": ([f"lost 1 {W} for 0.4 s"], [], "no goals are written"),
    "two overloads": ([f"5 overload {W}", f"8 overload {W}"], [], "servos that do not run"),
    "phantom": ([f"5 phantom {W}"], [], "is off"),
    "wrong id": ([f"5 answers as 6 {W}"], [], "its leg is lost"),
    "brown-out": ([f"brown-out to 5 V {W} for 0.5 s"], [], "servos have restarted"),
    "no supply": ([f"brown-out to 5 V {W}"], [], "no goals are written"),
    "supply comes back": ([f"brown-out to 5 V {W} for 4 s"], [], "torque off is sent"),
    "supply lost while sitting": (
        [f"brown-out to 5 V at {WALKS_AT + 1.0:g} s for 4 s"],
        [],
        "no goals are written",
    ),
    "sit": ([], [(WALKS_AT, stop(Reaction.SIT))], "stopped by the user: the robot sits"),
    "limp": ([], [(WALKS_AT, stop(Reaction.LIMP))], "stopped by the user: torque off is sent"),
}
"""Faults beside those of test_torque_truth.py."""

SHORT = "1 % lost", "gap", "brown-out", "supply comes back", "supply lost while sitting", "limp"


@pytest.mark.parametrize("seed", range(max(SEEDS, 1)))
@pytest.mark.parametrize("fault", FAULTS if SEEDS else SHORT)
def test_a_fault_ends_in_its_reaction(monkeypatch, fault, seed):
    faults, at, words = FAULTS[fault]
    driver, emulator, report, begun = driven(monkeypatch, faults=faults, at=at, seed=seed)
    event(report, words)
    check_reactions(driver, emulator, begun)
    assert not emulator.traces()[1][-1].any()


def test_a_walk_on_five_legs_after_an_overload_ends_as_a_whole_one(monkeypatch):
    _, emulator, report, _ = driven(monkeypatch, faults=[f"5 overload {W}"], duration=3.0)
    assert report.ending is None
    assert report.walked == pytest.approx(3.0, abs=1.5 / RATE)
    time, enabled, _, _ = emulator.traces()
    assert not enabled[time > WALKS_AT + 0.3][:, 4].any()


@pytest.mark.parametrize("failing", ["commands", "controller"])
def test_a_failing_controller_lowers_the_robot_and_raises_its_error(monkeypatch, failing):
    def fail(*_):
        raise ArithmeticError("a user's own")

    class Failing(Still):
        def update(self, observation, command):
            return (fail if driver.stage is Stage.WALK else super().update)(observation, command)

    given = {"commands": fail, "controller": Failing()}
    with virtual_bus(monkeypatch, plant=folded()) as (*robot, bus, emulator, _):
        driver = new_driver(*robot, bus, **{failing: given[failing]})
        with pytest.raises(ArithmeticError):
            driver.drive(3.0)
        event(driver.report, "the controller failed")
        assert not emulator.traces()[1][-1].any()


def test_a_fault_after_a_stop_by_the_user_counts(monkeypatch):
    at = [(WALKS_AT, stop(Reaction.SIT)), (WALKS_AT + 0.5, low_supply)]
    _, _, report, _ = driven(monkeypatch, at=at)
    assert report.ending.ending.name == "ABORTED"
    assert "is 6.1 V, after a stop by the user at" in report.ending.sentence


def test_a_driver_that_hung_sends_torque_off_and_no_goal(monkeypatch):
    """The guard switches the torque off after 3.5 s; a goal switches an AX-12A on again."""
    replace_guard(monkeypatch, lambda: True)
    with virtual_bus(monkeypatch, plant=folded()) as (*robot, bus, emulator, clock):
        hangs = [5.0]

        def command(time, observation):
            if time > 1.0 and hangs:
                clock.sleep(hangs.pop())
            return Command((0.03, 0.0, 0.0))

        driver = new_driver(*robot, bus, commands=command, settings=DriverSettings())
        report = driver.drive(3.0)
    hung = event(report, "the driver hung for 5.0 s: torque off is sent")
    assert event(report, "the torque is off") - hung < 0.5
    assert report.ending.ending.name == "ABORTED"
    assert not emulator.traces()[1][-1].any()


def test_a_robot_on_a_bus_that_falls_silent_again_and_again_sits_down(monkeypatch):
    gaps = [f"lost 1 at {WALKS_AT + 1.5 * k:g} s for 0.3 s" for k in range(3)]
    _, _, report, _ = driven(monkeypatch, faults=gaps, duration=30.0)
    assert report.walked < 10.0
    event(report, "servos answer again: the robot sits down")
    assert "3 times in 10 s" in report.ending.sentence


def test_a_joint_that_does_not_follow_is_named_when_the_robot_stands(monkeypatch):
    plant = folded()
    advance = plant.advance

    def block_one(steps, goal, enabled):
        advance(steps, np.where(np.arange(18) == 4, plant.position, goal), enabled)

    plant.advance = block_one
    with virtual_bus(monkeypatch, plant=plant) as (*robot, bus, _, _):
        report = new_driver(*robot, bus).drive(1.0)
    event(report, "joints are away from their goals: right_middle.femur")


def test_an_x_servo_that_restarts_switches_all_torque_off(monkeypatch):
    def restart(driver, emulator, bus):
        emulator.servos[6].reboot()

    at = [(WALKS_AT, restart)]
    driver, emulator, report, begun = driven(monkeypatch, name="XL430-W250", at=at)
    # One servo is looked at in 0.1 s at least, 18 in 1.8 s.
    assert event(report, "has restarted") + begun < WALKS_AT + 2.0
    check_reactions(driver, emulator, begun)
    assert not emulator.traces()[1][-1].any()


def replace_guard(monkeypatch, alive):
    """Replace the second process by one that only answers whether it is alive."""

    @contextmanager
    def guard(bus, ids, hold, silence):
        del bus, ids, hold, silence
        yield SimpleNamespace(alive=alive, has_acted=lambda: False, is_confirmed=False, pid=0)

    monkeypatch.setattr("phasmid.hardware.driver.torque_off_after_exit", guard)


def test_the_robot_sits_down_after_the_process_that_guards_it_has_ended(monkeypatch):
    replace_guard(monkeypatch, lambda: len(driver.report.events) < 2)
    with virtual_bus(monkeypatch, plant=folded()) as (*robot, bus, emulator, clock):
        driver = new_driver(*robot, bus, settings=DriverSettings())
        report = driver.drive(3.0)
        clock.sleep(1.0)
    event(report, "has ended or hangs: the robot sits down")
    assert report.ending.ending.name == "ABORTED"
    assert not emulator.traces()[1][-1].any()


def test_servos_hold_the_measured_angles_even_if_packets_are_lost(monkeypatch):
    for seed in range(5):
        with virtual_bus(monkeypatch, plant=folded(), seed=seed) as (_, robot, rows, bus, emu, _):
            joints = RobotBus(bus, robot, rows)
            joints.read_all()
            for servo in emu.servos:
                # An old goal, far from the present angle.
                servo["goal_position"] = 400
            emu.faults.add("lost 0.05", emu.faults.time)
            for k in range(18):
                joints.hold(k, math.radians(30))
            step = joints.bus.models[1].register("goal_position").scale
            for servo, row, q in zip(emu.servos, rows, joints.position.flat, strict=True):
                assert abs(row.joint_angle(goal_of(servo)) - q) <= step
                speed = servo.model.register("goal_speed").to_si(servo["goal_speed"])
                assert speed == pytest.approx(math.radians(30), abs=0.012)
                assert servo["torque_limit"] == 0
                assert servo["torque_enable"] == 1


def test_heat_begins_with_the_measured_temperature(monkeypatch):
    plant = folded()
    plant.temperature[:] = 50.0
    with virtual_bus(monkeypatch, plant=plant) as (*robot, bus, _, _):
        report = new_driver(*robot, bus).drive(1.0)
    assert report.hottest == 50.0
    assert report.hottest_predicted >= 49.0


def test_a_lost_link_of_a_steering_client_stops_the_robot(monkeypatch):
    commanded = []

    def velocity():
        return (0.05, 0.0, 0.0) if len(commanded) < 300 else None

    with virtual_bus(monkeypatch, plant=folded()) as (*robot, bus, _, _):
        driver = new_driver(*robot, bus, velocity=(0.06, 0.0, 0.0))
        driver.override = velocity
        driver.watch = lambda _, channels: commanded.append(channels["velocity_command"][0, 0])
        driver.drive(4.0)
    assert 0.05 in commanded
    assert 0.06 not in commanded
    assert commanded[-1] == 0.0


@pytest.mark.parametrize(
    "setting", [{"hold_time": v} for v in (-1.0, math.nan, math.inf)] + [{"after_exit": "sleep"}]
)
def test_settings_are_checked(setting):
    with pytest.raises(InvalidInput, match=next(iter(setting))):
        DriverSettings(**setting)


# Readings -----------------------------------------------------------------------------------------


def test_angles_that_no_servo_can_reach_in_time_are_not_believed(monkeypatch):
    with virtual_bus(monkeypatch, plant=folded()) as (_, robot, calibration, bus, emulator, _):
        joints = RobotBus(bus, robot, calibration)
        joints.read_all()
        before = joints.position.copy()
        emulator.faults.add("5 phantom", emulator.faults.time)
        for _ in range(400):
            joints.read(0.0)
        # A random angle is believed where it is within 10° plus what the servo turns: no farther.
        assert np.abs(joints.position - before).max() < math.radians(20)
        assert joints.running.all()


def test_a_short_answer_to_an_earlier_request_is_not_taken(monkeypatch):
    """A late answer with fewer bytes than were requested is that of another request."""
    with virtual_bus(monkeypatch, plant=folded()) as (_, _, _, bus, emulator, _):
        # An answer is awaited for 12 ms; the second request is lost.
        for text in "late 1 by 20 ms for 0.01 s", "lost 1 at 0.012 s for 0.01 s":
            emulator.faults.add(text, emulator.faults.time)
        bus.read_all([1], ["torque_limit"])
        before = bus.traffic.damaged
        assert bus.read_all([1], ["torque_enable", "present_temperature"])[1] is None
        assert bus.traffic.damaged == before + 1


# Inspection ---------------------------------------------------------------------------------------


def inspected(monkeypatch, *, name="AX-12A", change=None, rate=RATE, **settings):
    with virtual_bus(monkeypatch, name=name, plant=folded(name), **settings) as parts:
        _, robot, calibration, bus, emulator, _ = parts
        if change is not None:
            change(emulator, calibration)
        return inspect_servos(bus, robot, calibration, rate)


@pytest.mark.parametrize("name", ["AX-12A", "XL430-W250"])
def test_a_sound_robot_has_no_refusal(monkeypatch, name):
    found = inspected(monkeypatch, name=name)
    assert found.refusals == []
    assert len(found.rows) == 18


def test_a_slow_bus_is_named(monkeypatch):
    found = inspected(monkeypatch, name="XL430-W250", latency=16e-3, rate=1000.0)
    assert any("latency_timer" in note and "16 ms" in note for note in found.notes)
    assert any("1000 are wanted" in sentence for sentence in found.refusals)


def set_register(id_, name, value):
    def change(emulator, calibration):
        emulator.servo(id_)[name] = value

    return change


def turn_away(emulator, calibration):
    emulator.plant.position[4] += 2.0
    emulator.pass_until(emulator.next_stop + 0.02)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (set_register(7, "id", 99), "servo 7 (right_rear.coxa): no answer"),
        (set_register(7, "temperature_limit", 28), "its limit is 28"),
        (set_register(7, "min_voltage_limit", 125), "reports voltage"),
        (set_register(7, "shutdown", 4), "does not shut down on overload"),
        (set_register(7, "status_return_level", 1), "status_return_level must be 2"),
        (set_register(7, "max_position_limit", 0), "wheel mode"),
        (set_register(7, "model_number", 29), "is an MX-28"),
        (turn_away, "its calibration is wrong"),
    ],
)
def test_what_does_not_fit_is_refused(monkeypatch, change, words):
    found = inspected(monkeypatch, change=change)
    assert any(words in sentence for sentence in found.refusals), found.refusals


# Log ----------------------------------------------------------------------------------------------


def test_the_log_is_a_recording_of_what_was_sent_and_read(monkeypatch, tmp_path):
    driver, emulator, _, begun = driven(monkeypatch, log=tmp_path / "a.mcap")
    recording = load_recording(tmp_path / "a.mcap")
    time, _, goals, position = emulator.traces()
    assert recording.attrs["kind"] == "robot"
    assert json.loads(recording.attrs["events"])[-1][1] == "the torque is off."
    zero = np.array([row.zero for row in default_calibration(driver.robot.robot, model("AX-12A"))])
    logged = recording["time"].values + begun
    step = model("AX-12A").register("goal_position").scale
    # A goal arrives within the time of its packet, 1 ms, and the plant's step of 5 ms.
    rows = np.searchsorted(time, logged[5:-80] + 0.012)
    sent = recording["joint_position_target"].values.reshape(len(logged), -1)[5:-80]
    assert np.abs(goals[rows] - zero - sent).max() <= 0.5 * step + 1e-9
    read = recording["joint_position_time"].values.reshape(len(logged), -1)[5:-80]
    angle = recording["joint_position_measured"].values.reshape(len(logged), -1)[5:-80]
    for k in range(18):
        at = read[:, k] + begun
        # Within the last period some row of the motion had this angle, to a step.
        rows = np.searchsorted(time, at)[:, None] - np.arange(6)
        near = np.abs(position[rows, k] - zero[k] - angle[:, k, None]).min(axis=1)
        assert near.max() <= step


@pytest.mark.parametrize(
    ("name", "words"), [("a" * 300 + ".mcap", "name"), ("file/a.mcap", "folder"), ("a.mcap", "GB")]
)
def test_a_log_is_refused_before_the_torque(monkeypatch, tmp_path, name, words):
    (tmp_path / "file").touch()
    if words == "GB":
        monkeypatch.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=1e6))
    with virtual_bus(monkeypatch, plant=folded()) as (*robot, bus, emulator, _):
        driver = new_driver(*robot, bus, log=tmp_path / name)
        with pytest.raises(OutputError, match=words):
            driver.drive(3.0)
        assert not emulator.traces()[1].any()


def test_other_sensors_reach_the_controller_and_the_log(monkeypatch, tmp_path):
    controller = Still()
    level = np.array([1.0, 0.0, 0.0, 0.0])
    driven(
        monkeypatch,
        controller=controller,
        duration=0.5,
        log=tmp_path / "a.mcap",
        sensors=lambda: {"orientation": level},
    )
    recording = load_recording(tmp_path / "a.mcap")
    assert any(one.orientation is level for one in controller.seen)
    assert (recording["imu_orientation"].values == level).all()
