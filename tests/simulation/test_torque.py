"""Joints that are driven by torque."""

from __future__ import annotations

import numpy as np
import pytest

import phasmid
from phasmid.errors import InvalidInput
from phasmid.motion import JointTrajectory


def walk(**changes):
    scenario = phasmid.load_scenario("paper").replace(
        drive="torque", duration=2.0, load_transfer=0.05, **changes
    )
    return scenario, phasmid.simulate(scenario, phasmid.plan(scenario))


@pytest.mark.parametrize("robot", ["phantomx-paper", "phantomx-mk4"])
def test_joints_that_are_driven_by_torque_follow_a_walk(robot: str) -> None:
    # The plan's torques are exact but for the ground's give and the load's sharing. With minimum
    # norm of rigid feet, a foot that gives way otherwise leaves at most the torque of its whole
    # load to the springs, 1 N m by 900 /s² times 0.01 kg m²: 0.1 rad. Measured are 0.003 rad.
    scenario, run = walk(robot=robot)
    assert run.attrs["ending"] == "COMPLETED"
    error = (run.joint_position - run.joint_position_target).values
    assert np.sqrt(np.mean(error**2)) < np.radians(0.1)
    way = float(run.body_position.values[-1, 0] - run.body_position.values[0, 0])
    planned = phasmid.plan(scenario).trunk.position
    assert way == pytest.approx(planned[-1, 0] - planned[0, 0], rel=0.02)


def test_a_trajectory_of_joint_angles_cannot_be_driven_by_torque() -> None:
    scenario = phasmid.load_scenario("paper").replace(drive="torque", duration=1.0)
    plan = phasmid.plan(scenario)
    trajectory = JointTrajectory(plan.robot, plan.time[:50], plan.q[:50])
    with pytest.raises(InvalidInput) as caught:
        phasmid.simulate(scenario, trajectory)
    assert caught.value.what == (
        'drive is "torque" and the joints follow a trajectory without foot '
        "contacts; it must be another drive."
    )
