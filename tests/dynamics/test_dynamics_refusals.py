"""What dynamics and kinematics say to a caller whose arguments do not fit."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

NO_LEG = "it must be a Leg or the arrays of a robot's legs.\n  try  robot.arrays, or robot.legs[0]"
NO_ROBOT = 'it must be a Robot.\n  try  phasmid.load_robot("phantomx-paper")'
NO_BODY = "it must be a BodyMotion.\n  try  dynamics.BodyMotion.at_rest()"
NUMBER = "it must be one finite number."
REAL = "is no array of real numbers; it must be one."

REFUSALS = {
    "dynamics.leg_torque(leg, q[:, :2], q, q)": "q has shape (10, 2); it must end in 3.",
    "dynamics.leg_torque(leg, q[0, :2], q, q)": "q has shape (2,); it must end in 3.",
    "dynamics.leg_torque(leg, np.zeros(4), q, q)": "q has shape (4,); it must end in 3.",
    "dynamics.leg_torque(leg, q.T, q, q)": "q has shape (3, 10); it must end in 3.",
    "dynamics.leg_matrices(leg, q.T)": "q has shape (3, 10); it must end in 3.",
    "dynamics.leg_torque(leg, q, q, 0.0)": "qdd has shape (); it must end in 3.",
    "dynamics.leg_torque(leg, q, q[:4], q)": (
        "the leading axes are q (10,), qd (4,), qdd (10,); they must broadcast together."
    ),
    "dynamics.leg_torque(leg, q, q, q, foot_force=[0, 10])": (
        "foot_force has shape (2,); it must end in 3."
    ),
    "dynamics.leg_torque(robot.arrays, q, q, q)": (
        "the leading axes are q (10,), qd (10,), qdd (10,); "
        "they must broadcast together with the legs' (6,)."
    ),
    "dynamics.leg_torque(leg, q + 1j, q, q)": f"q {REAL}",
    "dynamics.leg_matrices(leg, 'abc')": f"q {REAL}",
    "dynamics.leg_matrices(leg, [[1, 2, 3], [4]])": f"q {REAL}",
    "dynamics.leg_torque(robot, q, q, q)": f"leg is of type Robot; {NO_LEG}",
    "dynamics.leg_torque(None, q, q, q)": f"leg is None; {NO_LEG}",
    "dynamics.leg_torque(robot, q, q, q, form='as-printed')": f"leg is of type Robot; {NO_LEG}",
    "dynamics.leg_matrices(q, leg)": f"leg is an array of shape (10, 3); {NO_LEG}",
    "dynamics.leg_matrices(leg, q, gravity='x')": f"gravity is x; {NUMBER}",
    "dynamics.leg_matrices(leg, q, gravity=None)": f"gravity is None; {NUMBER}",
    "dynamics.leg_torque(leg, q, q, q, gravity=q)": (
        f"gravity is an array of shape (10, 3); {NUMBER}"
    ),
    "dynamics.leg_torque(leg, q, q, q, gravity=np.inf)": f"gravity is inf; {NUMBER}",
    "printed_leg_torque(leg, q, q, q, gravity=np.nan)": f"gravity is nan; {NUMBER}",
    "printed_leg_torque(leg, q, q[:4], q)": (
        "the leading axes are q (10,), qd (4,), qdd (10,); they must broadcast together."
    ),
    "printed_leg_matrices(leg, q, misprints='b11-half')": (
        'misprints is the one text "b11-half"; it must be a collection of names.\n'
        '  try  ["b11-half"]'
    ),
    "printed_leg_matrices(leg, q, misprints=LegMisprint.B11_HALF)": (
        'misprints is the one text "b11-half"; it must be a collection of names.\n'
        '  try  ["b11-half"]'
    ),
    "printed_leg_matrices(leg, q, misprints=3)": (
        'misprints is 3; it must be a collection of names.\n  try  ["table-2-unit"]'
    ),
    "printed_joint_angles(leg, q, misprints=[3])": (
        'no misprint called "3"; it must be one of eq-1-offset, eq-2-height, body-rotation, '
        "eq-3-quadrant, eq-4-distance, eq-5-quadrant, eq-6-root, eq-7-height, eq-8-root."
    ),
    "printed_dh_transform(q, q, q, q[:4])": (
        "the leading axes are alpha (10, 3), a (10, 3), d (10, 3), theta (4, 3); "
        "they must broadcast together."
    ),
    "kinematics.dh_transform(q, 'a', q, q)": f"a {REAL}",
    "printed_leg_pose(q, q[:4, 0])": (
        "the leading axes are p_body_hip (10,), yaw (4,); they must broadcast together."
    ),
    "printed_leg_pose(q[:, :2], 0.0)": "p_body_hip has shape (10, 2); it must end in 3.",
    "printed_body_rotation(q, q, q[:4])": (
        "the leading axes are roll (10, 3), pitch (10, 3), yaw (4, 3); "
        "they must broadcast together."
    ),
    "kinematics.rotation_rpy(q, q, None)": f"yaw {REAL}",
    "kinematics.quaternion_rotation(q)": "quaternion has shape (10, 3); it must end in 4.",
    "kinematics.foot_position(robot, q)": f"leg is of type Robot; {NO_LEG}",
    "kinematics.joint_angles(None, q)": f"leg is None; {NO_LEG}",
    "kinematics.jacobian(leg, q + 1j)": f"q {REAL}",
    "kinematics.joint_motion(leg, q, q, q[:4])": (
        "the leading axes are q (10,), v_hip_foot (10,), a_hip_foot (4,); "
        "they must broadcast together."
    ),
    "kinematics.leg_frames(robot.arrays, q)": (
        "leg is of type LegArrays; it must be a Leg.\n  try  robot.legs[0]"
    ),
    "kinematics.link_frames(robot, q)": "q has shape (10, 3); it must end in 6, 3.",
    "kinematics.centre_of_mass(leg, Q)": f"robot is of type Leg; {NO_ROBOT}",
    "kinematics.body_from_hip(robot, q)": "p_hip has shape (10, 3); it must end in 6, 3.",
    "kinematics.within_reach(robot, q)": "p_hip_feet has shape (10, 3); it must end in 6, 3.",
    "kinematics.neutral_feet(leg)": f"robot is of type Leg; {NO_ROBOT}",
    "kinematics.longest_stride(leg)": f"robot is of type Leg; {NO_ROBOT}",
    "kinematics.longest_stride(robot, 'x')": "direction is x; it must be one finite number.",
    "kinematics.reach(robot, 0.1)": (
        "leg is of type Robot; it must be a Leg.\n  try  robot.legs[0]"
    ),
    "kinematics.reach(leg, q)": (
        "height is an array of shape (10, 3); it must be one finite number."
    ),
    "kinematics.step_pose(q, 1.0)": ("step has shape (10, 3); it must be forward, left and turn."),
    "dynamics.mass_matrix(leg, body, Q)": f"robot is of type Leg; {NO_ROBOT}",
    "dynamics.mass_matrix(body, robot, Q)": f"robot is of type BodyMotion; {NO_ROBOT}",
    "dynamics.mass_matrix(robot, Q, body)": f"body is an array of shape (6, 3); {NO_BODY}",
    "dynamics.momentum(robot, None, Q, Q)": f"body is None; {NO_BODY}",
    "dynamics.bias_force(robot, None, Q, Q)": f"body is None; {NO_BODY}",
    "dynamics.gravity_force(robot, None, Q)": f"body is None; {NO_BODY}",
    "dynamics.gravity_force(robot, body, Q, gravity='x')": f"gravity is x; {NUMBER}",
    "dynamics.foot_jacobian(robot, None, Q)": f"body is None; {NO_BODY}",
    "dynamics.forward_dynamics(robot, body, Q, Q, None)": f"torque {REAL}",
    "dynamics.inverse_dynamics(robot, None, Q, Q, Q)": f"body is None; {NO_BODY}",
    "dynamics.kinetic_energy(leg, body, Q, Q)": f"robot is of type Leg; {NO_ROBOT}",
    "dynamics.potential_energy(robot, body, Q, gravity=[1, 2])": (
        f"gravity is an array of shape (2,); {NUMBER}"
    ),
    "dynamics.BodyMotion.at_rest('x')": f"position {REAL}\n  in   body motion",
    "dynamics.BodyMotion.at_rest(q[:, :2])": (
        "position has shape (10, 2); it must end in 3.\n  in   body motion"
    ),
    "dynamics.BodyMotion.at_rest(q[:4], np.tile(np.eye(3), (10, 1, 1)))": (
        "the leading axes are position (4,), rotation (10,), velocity (), angular_velocity (), "
        "acceleration (), angular_acceleration (); they must broadcast together.\n"
        "  in   body motion"
    ),
}

SCRIPT = """
import json, sys
import numpy as np
import phasmid
from phasmid import dynamics, kinematics
from phasmid.dynamics.printed import LegMisprint, printed_leg_matrices, printed_leg_torque
from phasmid.kinematics.printed import (
    printed_body_rotation, printed_dh_transform, printed_joint_angles, printed_leg_pose
)
robot, body = phasmid.load_robot("phantomx-paper"), dynamics.BodyMotion.at_rest()
leg, q, Q = robot.legs[0], np.full((10, 3), -0.3), np.full((6, 3), -0.3)
said = {}
for call in json.load(sys.stdin):
    try:
        eval(call)
    except phasmid.InvalidInput as error:
        said[call] = str(error)
L = Q.tolist()
for name, count in {
    "mass_matrix": 1, "bias_force": 2, "gravity_force": 1, "momentum": 2, "foot_jacobian": 1,
    "forward_dynamics": 3, "inverse_dynamics": 3, "kinetic_energy": 2, "potential_energy": 1,
}.items():
    function = getattr(dynamics, name)
    ours, theirs = (function(robot, body, *[v] * count) for v in (L, Q))
    pairs = zip(ours, theirs) if isinstance(ours, tuple) else [(ours, theirs)]
    assert all(np.array_equal(*pair) for pair in pairs), name
print(json.dumps(said))
"""


@pytest.fixture(scope="module")
def said() -> dict[str, str]:
    """What the person reads, in a process without the tests' type checker.

    It also gives lists where arrays are expected, and finds the same results.
    """
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", SCRIPT],
        input=json.dumps(list(REFUSALS)),
        capture_output=True,
        text=True,
        check=False,
    )
    assert not run.returncode, run.stderr
    return json.loads(run.stdout)


@pytest.mark.parametrize("call", REFUSALS)
def test_what_does_not_fit_is_refused_in_a_sentence(call: str, said: dict[str, str]) -> None:
    assert said.get(call) == REFUSALS[call]
