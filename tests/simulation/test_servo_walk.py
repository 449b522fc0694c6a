"""Robots that walk on their own servos, and on joints that are driven by torque."""

import numpy as np
import pytest

from phasmid.errors import InvalidInput
from phasmid.motion import JointTrajectory, plan
from phasmid.reporting import summarise
from phasmid.robot import preset_names
from phasmid.scenario import load_scenario
from phasmid.simulation import simulate
from support.walks import with_servo

PAPER = load_scenario("paper").replace(drive="servo", duration=2.0)


@pytest.mark.parametrize("preset", [name for name in preset_names() if name != "octopod"])
def test_a_robot_walks_on_its_own_servos(preset):
    # As many steps as the plan has; what the servos give way and the feet creep is some per cent,
    # as with the ideal servo; of a quadruped's crawl more.
    crawls = preset == "quadruped"
    changes = {"gait": "crawl", "period": 4.0} if crawls else {}
    scenario = PAPER.replace(robot=preset, duration=4.0, **changes)
    walk = plan(scenario)
    run = simulate(scenario, walk)
    assert run.attrs["ending"] == "COMPLETED"
    asked = float(walk.trunk.position[-1, 0] - walk.trunk.position[0, 0])
    way = float(run.body_position[-1, 0] - run.body_position[0, 0])
    assert way == pytest.approx(asked, rel=0.2 if crawls else 0.1)
    if crawls:
        return
    weight = scenario.load_robot().mass * 9.81
    # Over a whole cycle the feet carry the weight.
    carried = run.foot_normal_force.sum("leg").sel(time=slice(2.0, 4.0)).mean()
    assert float(carried) == pytest.approx(weight, rel=5e-3)


def test_saturation_load_and_heat_are_in_the_summary():
    # Servos that may use 30 % of 9 V. Shares of the time by counting samples, against those by the
    # trapezoidal rule: half a sample at either end, 1/2000.
    scenario = PAPER.replace(voltage=9.0, torque_limit=0.3, period=3.0)
    run = simulate(scenario, plan(scenario))
    servos = summarise(run)["servos"]
    # A fifth of the maker's stall torque heats the winding alike at any supply.
    advised = 0.3
    duty, torque = np.abs(run.servo_duty.values), np.abs(run.joint_torque.values)
    assert np.array(servos["saturated"]) == pytest.approx((duty >= 0.3).mean(0), abs=1e-3)
    assert np.array(servos["above_continuous"]) == pytest.approx(
        (torque > advised).mean(0), abs=1e-3
    )
    warmth = run.servo_temperature.values
    np.testing.assert_array_equal(servos["peak_temperature"], warmth.max(axis=0))
    np.testing.assert_array_equal(servos["final_temperature"], warmth[-1])
    assert servos["voltage"] == 9.0
    assert "shutdown_time" not in servos


def test_a_robot_whose_servos_shut_down_falls_and_says_so():
    # Overheated as soon as they lift anything: no torque, and the trunk comes down.
    scenario = PAPER.replace(robot=with_servo(temperature_limit=25.004, standby_current=0.0))
    run = simulate(scenario, plan(scenario))
    assert run.attrs["ending"] == "FELL"
    reason = run.attrs["ending_reason"]
    assert "servos had shut down: " in reason
    assert "(overheating)" in reason
    assert "the trunk touched the ground" in reason
    down = run.servo_shutdown.values
    assert down[-1, :, 1].sum() >= 3
    assert not (np.diff(down.astype(int), axis=0) < 0).any()
    assert (run.servo_duty.values[1:][down[:-1]] == 0).all()
    found = summarise(run)
    first = np.argmax(down, axis=0) * 1e-3
    expected = np.where(down.any(axis=0), first, np.nan)
    rows = [row or [None] * 3 for row in found["servos"]["shutdown_time"]]
    assert np.array(rows, dtype=float) == pytest.approx(expected, nan_ok=True)
    assert any("shut down at" in sentence for sentence in found["warnings"])


def test_servos_at_full_output_for_too_long_shut_down():
    # A fifth of the output holds the robot on six feet and not on three.
    weak = with_servo(overload_time=0.3)
    scenario = PAPER.replace(robot=weak, torque_limit=0.2, period=3.5)
    run = simulate(scenario, plan(scenario))
    assert "(overload)" in run.attrs["ending_reason"]


@pytest.mark.parametrize(
    ("scenario", "said"),
    [
        (
            PAPER.replace(dt=2e-3),
            "a time step of 0.002 s cannot resolve the gears of the servo AX-12A",
        ),
        # Too long for the contact too: the bound that is told is the one that counts for both.
        (
            PAPER.replace(dt=5e-3),
            "a time step of 0.005 s cannot resolve the gears of the servo AX-12A",
        ),
        (PAPER.replace(robot=with_servo(stall_current=None)), "servo AX-12A has no stall_current"),
    ],
)
def test_a_servo_that_cannot_be_run_is_refused(scenario, said):
    with pytest.raises(InvalidInput, match=said):
        simulate(scenario, plan(scenario))


@pytest.mark.parametrize(
    "robot",
    ["phantomx-paper", "phantomx-mk4", with_servo(armature=0.02)],
    ids=["paper", "mk4", "heavy rotors"],
)
def test_joints_that_are_driven_by_torque_follow_a_walk(robot):
    # The plan's torques are exact but for the ground's give and the load's sharing. With minimum
    # norm of rigid feet, a foot that gives way otherwise leaves at most the torque of its whole
    # load to the springs, 1 N m by 900 /s² times 0.01 kg m²: 0.1 rad. Measured are 0.02 degrees.
    scenario = PAPER.replace(drive="torque", load_transfer=0.05, robot=robot)
    walk = plan(scenario)
    run = simulate(scenario, walk)
    assert run.attrs["ending"] == "COMPLETED"
    error = (run.joint_position - run.joint_position_target).values
    assert np.sqrt(np.mean(error**2)) < np.radians(0.1)
    way = float(run.body_position.values[-1, 0] - run.body_position.values[0, 0])
    asked = walk.trunk.position[-1, 0] - walk.trunk.position[0, 0]
    assert way == pytest.approx(asked, rel=0.02)


def test_a_trajectory_of_joint_angles_cannot_be_driven_by_torque():
    scenario = PAPER.replace(drive="torque", duration=1.0)
    walk = plan(scenario)
    trajectory = JointTrajectory(walk.robot, walk.time[:50], walk.q[:50])
    with pytest.raises(InvalidInput) as caught:
        simulate(scenario, trajectory)
    assert caught.value.what == (
        'drive is "torque" and the joints follow a trajectory without foot '
        "contacts; it must be another drive."
    )
