"""The paper's walk, analysed: what its text says of forces and torques."""

import dataclasses

import numpy as np
import pytest

from phasmid.dynamics import BodyMotion, inverse_dynamics
from phasmid.errors import InfeasibleLoad, InvalidInput
from phasmid.forces import analyse
from phasmid.kinematics import rotation_rpy
from phasmid.motion import plan
from phasmid.scenario import load_scenario

PAPER = load_scenario("paper")


def analysed(**changes):
    scenario = PAPER.replace(**changes)
    return analyse(scenario, plan(scenario))


def test_the_feet_carry_the_weight_at_every_instant():
    # The trunk neither rises nor falls; the swinging legs' vertical acceleration adds
    # 2 x 0.2 kg x 5 m/s^2 at most, and nothing in the quasi-static model.
    total = analysed(body_acceleration="quasi-static").foot_normal_force_model.sum("leg")
    assert np.abs(total.values - 26).max() < 1e-9
    mean = float(analysed().foot_normal_force_model.sum("leg")[:200].mean())
    assert mean == pytest.approx(26, rel=1e-3)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"force_model": "minimum-norm", "friction": 0.3}, ""),
        ({"force_model": "weighted-minimum-norm", "tangential_weight": 4}, "tangential weight 4"),
        ({"force_model": "minimum-torque"}, ""),
        (
            {"force_model": "friction-cone", "friction": 0.3, "torque_limits": "counted"},
            "friction 0.3, torque limits",
        ),
        (
            {"force_model": "smallest-largest-load", "load_transfer": 0.1},
            "friction 0.7, transfer 0.1 s",
        ),
    ],
)
def test_every_member_carries_the_walk_and_is_named_with_its_options(changes, words):
    # Level ground: all normal forces together are the weight, whatever shares them. 1e-9 as above.
    run = analysed(**changes, body_acceleration="quasi-static", duration=2)
    assert np.abs(run.foot_normal_force_model.sum("leg").values - 26).max() < 1e-9
    name = changes["force_model"]
    assert run.attrs["force_model"] == (f"{name} ({words})" if words else name)


def test_torques_are_those_of_a_second_inverse_dynamics_with_the_forces():
    # tau = tau0 - J^T F, and F among the loads of the recursion: two ways to the same torque of
    # 1 N·m, each of a few hundred roundings.
    walk = plan(PAPER)
    run, trunk = analyse(PAPER, walk), walk.trunk
    zero = np.zeros(len(walk.time))
    body = BodyMotion(
        position=trunk.position,
        rotation=rotation_rpy(zero, zero, trunk.yaw),
        velocity=trunk.velocity,
        angular_velocity=np.stack([zero, zero, trunk.attitude_rate[:, 2]], axis=-1),
        acceleration=trunk.acceleration,
        angular_acceleration=np.stack([zero, zero, trunk.attitude_acceleration[:, 2]], axis=-1),
    )
    again, wrench = inverse_dynamics(
        walk.robot, body, walk.q, walk.qd, walk.qdd, foot_force=run.foot_force_model.values
    )
    assert np.abs(again - run.joint_torque_model.values).max() < 1e-12
    # And the trunk needs nothing more: the forces give the whole wrench.
    assert np.abs(wrench).max() < 1e-9


def test_the_members_agree_on_normal_forces_and_differ_in_tangential_ones():
    # Three feet on level ground leave no choice in the normals, 1e-9; the squeeze is free.
    minimum, torque = analysed(), analysed(force_model="minimum-torque")
    apart = np.abs(minimum.foot_force_model.values - torque.foot_force_model.values)
    assert apart[..., 2].max() < 1e-9
    assert apart[..., :2].max() > 1
    assert np.sum(torque.joint_torque_model.values**2) < np.sum(
        0.5 * minimum.joint_torque_model.values**2
    )


def steps(interval, **changes):
    """Largest change of any model torque from one fine sample to the next, over a switch."""
    scenario = PAPER.replace(**changes)
    walk = plan(scenario).sample(np.arange(0.7, 1.3, interval))
    return np.abs(np.diff(analyse(scenario, walk).joint_torque_model.values, axis=0)).max()


@pytest.mark.parametrize("name", ["minimum-norm", "minimum-torque", "friction-cone"])
def test_with_a_load_transfer_torques_do_not_jump_and_without_they_do(name):
    # A continuous torque changes by its rate times the interval: a tenth of the interval, a tenth
    # of the change. A jump stays.
    ramp = {"force_model": name, "load_transfer": 0.2}
    assert steps(1e-4, **ramp) == pytest.approx(steps(1e-3, **ramp) / 10, rel=0.05)
    assert steps(1e-4, **ramp) < 2e-3
    assert steps(1e-4, force_model=name) > 0.5


def test_torque_limits_are_refused_with_a_model_that_knows_none():
    with pytest.raises(InvalidInput) as caught:
        analysed(torque_limits="counted")
    error = caught.value
    assert error.what == (
        'torque_limits is "counted" and minimum-norm has no limits; it must be "ignored", '
        "or the force model one with limits."
    )
    assert (error.where, error.hint) == ("model.torque_limits", 'force_model = "friction-cone"')


def test_ice_is_too_smooth_for_a_walk_that_accelerates():
    with pytest.raises(InfeasibleLoad) as caught:
        analysed(force_model="friction-cone", friction=0.001)
    error = caught.value
    assert error.limit == "friction"
    assert error.what.startswith(f"sample {error.index[0]} at ")
    assert "right_middle, left_rear and left_front standing" in error.what


def test_servos_that_are_too_weak_are_named():
    robot = PAPER.load_robot()
    weak = dataclasses.replace(robot.servo, stall_torque=0.3)
    scenario = PAPER.replace(
        robot=dataclasses.replace(robot, servo=weak),
        force_model="friction-cone",
        torque_limits="counted",
    )
    with pytest.raises(InfeasibleLoad) as caught:
        analyse(scenario, plan(scenario))
    assert caught.value.limit == "torque"
    assert "right_middle.femur" in caught.value.culprits
    assert "the limit is 0.3 N·m" in caught.value.what
