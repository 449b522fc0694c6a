"""Ground, period and thresholds follow a robot's weight and leg length."""

import math
from functools import cache

import numpy as np
import pytest

from phasmid.cli import main
from phasmid.motion import plan
from phasmid.reporting import summarise
from phasmid.robot import load_robot, robot_to_toml
from phasmid.robot.similarity import REFERENCE_LENGTH, REFERENCE_WEIGHT, Scale, scale_of
from phasmid.scenario import Scenario, load_scenario
from phasmid.simulation import longest_time_step, simulate
from phasmid.units import STANDARD_GRAVITY
from support.walks import scaled_robot

AX = load_robot("phantomx-ax")


def numbers(law):
    return law.stiffness, law.damping, law.friction_damping, law.tip_width, law.point_radius


def test_the_reference_is_the_preset_whose_numbers_are_the_round_ones():
    weight, length = AX.mass * STANDARD_GRAVITY / 6, AX.arrays.lengths.sum(axis=1).mean()
    # The constants have five and three digits; ratios are rounded to four.
    assert (REFERENCE_WEIGHT, REFERENCE_LENGTH) == pytest.approx((weight, length), rel=2e-5)
    scenario = Scenario(robot="phantomx-ax")
    assert numbers(scenario.build().world.contact) == (1e4, 30.0, 500.0, 0.004, 0.0005)
    assert scenario.replace(contact_law="simscape").build().world.contact.damping == 100.0
    assert scenario.build().course.stride.period == 2.0
    scale = scenario.build().scale
    assert (scenario.sensors.touching_force(scale), scenario.sensors.force_noise(scale)) == (
        0.5,
        0.1,
    )


@pytest.mark.parametrize("factor", [0.3, 3.0])
def test_numbers_follow_weight_and_length(factor):
    # Lengths times f and weights times f³: stiffness w/l times f², damping w/√l times f^2.5, times
    # the root. Ratios are rounded to four digits, periods to 10 ms.
    robot = scaled_robot(AX, factor)
    scenario = Scenario(robot=robot)
    shares = np.divide(numbers(scenario.build().world.contact), (1e4, 30.0, 500.0, 0.004, 0.0005))
    assert shares == pytest.approx([factor**2, factor**2.5, factor**2.5, factor, factor], rel=2e-3)
    assert scenario.build().course.stride.period == pytest.approx(2 * math.sqrt(factor), abs=0.005)
    assert scenario.sensors.touching_force(scenario.build().scale) == pytest.approx(
        0.5 * factor**3, rel=1e-3
    )


def test_neither_payload_nor_the_moon_changes_the_ground():
    scenario = Scenario(robot="phantomx-ax")
    loaded = scenario.replace(payload=1.5, gravity=1.62)
    assert loaded.load_robot().mass == pytest.approx(AX.mass + 1.5)
    assert loaded.build().world.contact == scenario.build().world.contact


def test_given_numbers_are_used_as_they_are_and_the_paper_has_those_of_phantomx_ax():
    robot = scaled_robot(AX, 3.0)
    given = {"stiffness": 2e4, "damping": 40.0, "friction_damping": 700.0, "tip_width": 0.01}
    law = Scenario(robot=robot, contact=given).build().world.contact
    assert numbers(law)[:4] == (2e4, 40.0, 700.0, 0.01)
    paper = load_scenario("paper")
    assert numbers(paper.build().world.contact) == (1e4, 30.0, 500.0, 0.004, 0.0005)
    assert paper.build().course.stride.period == 2.0
    other = paper.for_robot(robot)
    other, own = other.build(), Scenario(robot=robot).build()
    assert (other.world, other.course.stride.period) == (own.world, own.course.stride.period)
    assert paper.for_robot("phantomx-paper") == paper
    assert scale_of(robot) == Scale(27.0, 3.0)


@cache
def walked(factor):
    """Way over the commanded one, slip over leg length, torques over weight times leg length."""
    robot = scaled_robot(AX, factor)
    scenario = Scenario(robot=robot).replace(step_length=0.04 * factor, step_height=0.03 * factor)
    # Two cycles of 2000 steps each.
    dt = scenario.build().course.stride.period / 2000
    scenario = scenario.replace(
        dt=dt, duration=2 * scenario.build().course.stride.period, record_interval=dt
    )
    assert dt < longest_time_step(scenario.build())
    recording = simulate(scenario, plan(scenario))
    summary = summarise(recording)
    assert summary["warnings"] == []
    length, weight = robot.arrays.lengths[0].sum(), robot.mass * STANDARD_GRAVITY
    torque = np.array(summary["torque"]["simulation"]["rms"]) / (weight * length)
    way = summary["travel"]
    return way["distance_share"], summary["slip"]["mean"] / length, torque


@pytest.mark.parametrize("factor", [0.3, 3.0, 5.0])
def test_similar_robots_walk_alike_on_the_ground_of_their_size(factor):
    # Froude: with lengths times f, masses times f³, times times √f all forces follow the weight.
    # Periods are rounded to 10 ms, at most 0.5 % of 1.1 s, and accelerations with them by 1 %.
    way, slip, torque = walked(factor)
    expected_way, expected_slip, expected_torque = walked(1.0)
    assert way == pytest.approx(expected_way, rel=0.02)
    assert slip == pytest.approx(expected_slip, rel=0.02)
    assert np.abs(torque - expected_torque).max() < 0.02 * expected_torque.max()
    assert torque.max() == pytest.approx(expected_torque.max(), rel=0.02)


@pytest.mark.parametrize("factor", [0.45, 3.0])
def test_a_small_and_a_large_robot_of_a_file_walk_without_an_option(factor, tmp_path, capsys):
    # 0.24 kg and 72 kg; with the contact of 2.65 kg the small one needs steps of 0.15 ms, and the
    # large one's swinging legs touch the ground with more than a tenth of its weight.
    file = tmp_path / "robot.toml"
    file.write_text(robot_to_toml(scaled_robot(AX, factor)), encoding="utf-8")
    options = ["--duration", "4", "--no-figures", "--out", str(tmp_path / "run")]
    assert main(["walk", "--robot", str(file), *options]) == 0
    assert "Warnings         none" in capsys.readouterr().out
