"""Calibration of a robot whose joints are turned by hand: offsets, directions and ranges."""

import math
import sys

import numpy as np
import pytest

from phasmid.errors import InvalidInput
from phasmid.hardware import Bus, BusError, load_calibration, model, save_calibration
from phasmid.hardware.calibrator import Calibrator, Sweep, check_pose, first_pose, pose_angles
from phasmid.robot import load_robot, preset_names
from support.hand_turned import BAUD, PATIENCE, Bench

posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
TURN = math.radians(15)


@pytest.fixture(params=["AX-12A", "MX-28", "XL430-W250"])
def pair(request):
    """A hand-turned robot and its calibrator."""
    pytest.importorskip("dynamixel_sdk")
    robot = load_robot("phantomx-ax")
    with Bench(robot, request.param) as bench:
        protocol = model(request.param).protocol
        with Bus(bench.emulator.port, BAUD, protocol, latency=PATIENCE) as bus:
            yield bench, Calibrator(bus, robot)


def swept(bench, calibrator, start, *stops):
    """Return the motion from a start through stops [rad]."""
    bench.turn(start)
    sweep = Sweep(calibrator.positions())
    for stop in stops:
        bench.turn(stop)
        sweep.extend(calibrator.positions())
    return sweep


@posix
@pytest.mark.parametrize("pose", ["square", "neutral"])
def test_offsets_directions_and_ranges_are_recovered(pair, pose, tmp_path):
    """Behind random directions and zeros, from positions that are whole register steps.

    A position is rounded by half a step, and so is the offset: together one step. The end of a
    range has half a step more.
    """
    bench, calibrator = pair
    robot, plant = calibrator.robot, bench.plant
    step, angles = plant.scale, pose_angles(robot, pose)
    bench.turn(angles)
    calibrator.measure_pose(angles)
    limits = robot.arrays.joint_limits
    rest = limits.mean(axis=-1)
    sweep = swept(bench, calibrator, rest, rest + TURN, rest - TURN / 3)
    assert calibrator.set_directions(sweep, range(18)) == []
    # The first leg goes beyond its limits, the others stop before them.
    stops = limits + np.radians([20, -20])
    stops[0] = limits[0] + np.radians([-8, 8])
    sweep = swept(bench, calibrator, rest, stops[..., 0], stops[..., 1])
    assert calibrator.still(sweep) == []
    rows = calibrator.calibration(sweep)

    assert [row.direction for row in rows] == list(plant.direction)
    assert [row.id for row in rows] == list(range(1, 19))
    np.testing.assert_allclose([row.zero for row in rows], plant.zero, atol=1.001 * step)
    found = np.array([row.joint_range for row in rows]).reshape(6, 3, 2)
    np.testing.assert_allclose(found[1:], stops[1:], atol=1.501 * step)
    np.testing.assert_allclose(found[0], limits[0], atol=1.001 * step)
    assert np.all(found[..., 0] >= limits[..., 0] - 1e-9)
    assert np.all(found[..., 1] <= limits[..., 1] + 1e-9)
    assert calibrator.narrow(rows) == list(range(3, 18))
    save_calibration(tmp_path / "robot.toml", rows, robot.name)
    assert load_calibration(tmp_path / "robot.toml", robot) == rows


@posix
def test_only_the_torque_is_written_and_it_is_off(pair):
    bench, calibrator = pair
    servos, rom = bench.emulator.servos, calibrator.model.ram
    before = [bytes(servo.memory[:rom]) for servo in servos]
    for servo in servos:
        calibrator.bus.write(servo.id, "torque_enable", 1)
    calibrator.release()
    assert not any(servo["torque_enable"] for servo in servos)
    calibrator.measure_pose(pose_angles(calibrator.robot, "square"))
    assert [bytes(servo.memory[:rom]) for servo in servos] == before


@posix
def test_turns_that_are_small_or_both_ways_are_listed(pair):
    """10 degrees show a direction, unless more than half of that comes the other way."""
    bench, calibrator = pair
    rest = calibrator.robot.arrays.joint_limits.mean(axis=-1).ravel()
    there, back = (np.zeros(18) for _ in range(2))
    there[:4] = np.radians([9, 11, 20, 20])
    back[2:4] = np.radians([9, 11])
    sweep = swept(bench, calibrator, rest, rest + there, rest - back)
    assert calibrator.set_directions(sweep, range(5)) == [0, 3, 4]
    assert calibrator.still(sweep) == [0, *range(4, 18)]


@posix
def test_a_joint_turned_outside_its_limits_is_named(pair):
    bench, calibrator = pair
    angles = pose_angles(calibrator.robot, "square")
    bench.turn(angles)
    calibrator.measure_pose(angles)
    calibrator.set_directions(swept(bench, calibrator, angles, angles + TURN), range(18))
    stops = calibrator.robot.arrays.joint_limits.copy()
    stops[0, 0] = np.radians([80, 95])
    sweep = swept(bench, calibrator, stops[..., 0], stops[..., 1])
    with pytest.raises(InvalidInput, match=r"right_front.coxa was turned from 80.*limits, -75° to"):
        calibrator.calibration(sweep)


@posix
def test_servos_that_are_missing_or_differ_are_named():
    pytest.importorskip("dynamixel_sdk")
    robot = load_robot("phantomx-ax")
    with (
        Bench(robot, faults=["2 dead", "18 dead"]) as bench,
        Bus(bench.emulator.port, BAUD, 1, latency=PATIENCE) as bus,
    ):
        names = r"right_front.femur \(id 2\), left_front.tibia \(id 18\) on"
        with pytest.raises(BusError, match=f"no servo answers for {names}"):
            Calibrator(bus, robot)
        ids = [1, 19, *range(3, 18), 20]
        bench.emulator.servo(2)["id"] = 19
        bench.emulator.servo(18)["id"] = 20
        bench.emulator.servo(5)["model_number"] = model("AX-18A").number
        bench.emulator.servo(6)["model_number"] = 999
        words = r"AX-12A \(.*\); AX-18A \(right_middle.femur\); unknown model 999 \(right_middle.t"
        with pytest.raises(InvalidInput, match=words):
            Calibrator(bus, robot, ids)


def test_each_preset_has_a_pose_within_its_limits():
    poses = {name: first_pose(load_robot(name)) for name in preset_names()}
    for name, pose in poses.items():
        check_pose(load_robot(name), pose)
    assert poses["phantomx-ax"] == "square"
    assert poses["phantomx-mk4"] == "zero"
    with pytest.raises(InvalidInput, match=r"right_front.tibia is at 0°, outside its limits"):
        check_pose(load_robot("phantomx-ax"), "zero")
