"""What holds a robot at rest, against the model's own way for whole walks."""

import numpy as np
import pytest

from general_robot import general_robot
from phasmid import load_scenario
from phasmid.dynamics import BodyMotion, inverse_dynamics
from phasmid.errors import InfeasibleLoad
from phasmid.forces import FORCE_MODELS, holding_forces
from phasmid.kinematics import body_from_hip, foot_position, joint_angles, rotation_rpy
from phasmid.terrain import Flat, Ground

ROBOT = general_robot()
POSITION = np.array([0.3, -0.2, 0.4])
ROTATION = rotation_rpy(np.array([0.05]), np.array([-0.08]), np.array([0.7]))[0]
Q = joint_angles(ROBOT.arrays, ROBOT.arrays.neutral_foot)
FEET = POSITION + body_from_hip(ROBOT, foot_position(ROBOT.arrays, Q)) @ ROTATION.T
GROUND = Ground(Flat(), 1.0)
ALL = np.ones(len(ROBOT.legs), dtype=bool)


def held(stance, force_model="minimum-norm"):
    scenario = load_scenario("paper").replace(force_model=force_model)
    return holding_forces(scenario, ROBOT, POSITION, ROTATION, Q, FEET, stance, GROUND)


@pytest.mark.parametrize("force_model", FORCE_MODELS)
def test_forces_bear_the_robot_and_torques_are_those_of_inverse_dynamics(force_model):
    # Some hundred newtons and sums of some twenty products: round-off of 1e-12, the share's own
    # tolerance 1e-9 of the load.
    found = held(ALL, force_model)
    body, still = BodyMotion.at_rest(POSITION, ROTATION), np.zeros_like(Q)
    torque, wrench = inverse_dynamics(
        ROBOT, body, Q, still, still, foot_force=found.force, gravity=9.81
    )
    assert found.force.sum(axis=0) == pytest.approx([0, 0, 9.81 * ROBOT.mass], abs=1e-7)
    assert found.torque == pytest.approx(torque, abs=1e-8)
    assert wrench == pytest.approx(np.zeros(6), abs=1e-7)


def test_feet_in_the_air_bear_nothing_and_too_few_feet_hold_nothing():
    stance = ALL.copy()
    stance[1] = False
    assert not held(stance).force[1].any()
    with pytest.raises(InfeasibleLoad):
        held(np.arange(len(ALL)) < 2)
