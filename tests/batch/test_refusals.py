"""What the batch functions say to a caller whose arguments do not fit."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

WHOLE_NUMBER = "it must be a whole number of at least 1, or None for all cores."

REFUSALS = {
    "batch.foot_position(leg, q[:, :2])": "q has shape (4, 2); it must end in 3.",
    "batch.foot_position(leg, 'abc')": "q is no array of real numbers; it must be one.",
    "batch.jacobian(leg, q + 1j)": "q is no array of real numbers; it must be one.",
    "batch.foot_position(robot.arrays, q)": (
        "the leading axes are q (4,); they must broadcast together with the legs' (6,)."
    ),
    "batch.leg_torque(leg, q, q[:3], q)": (
        "the leading axes are q (4,), qd (3,), qdd (4,); they must broadcast together."
    ),
    "batch.foot_position(leg, q, threads=0)": f"threads is 0; {WHOLE_NUMBER}",
    "batch.foot_position(leg, q, threads=1.5)": f"threads is 1.5; {WHOLE_NUMBER}",
    "batch.foot_position(leg, q, threads=True)": f"threads is True; {WHOLE_NUMBER}",
    "batch.foot_position(leg, q, threads='2')": f"threads is '2'; {WHOLE_NUMBER}",
    "batch.foot_position(leg, q, out=np.zeros((3, 3)))": (
        "out is ndarray of shape (3, 3); it must be an array of float64 of shape (4, 3)."
    ),
    "batch.foot_position(leg, q, out=frozen)": (
        "out is read-only; it must be an array that can be written to."
    ),
    "batch.foot_position(leg, q, out=q[::-1])": (
        "out shares memory with q; it must be q itself or an array of its own."
    ),
    "batch.joint_angles(leg, q, out=q)": (
        "out shares memory with p_hip_foot; it must be an array of its own."
    ),
    "batch.inverse_dynamics(robot, dynamics.BodyMotion.at_rest(), q, q, q)": (
        "q has shape (4, 3); it must end in 6, 3."
    ),
    "batch.leg_torque(robot, q, q, q)": (
        "leg is of type Robot; it must be a Leg or the arrays of a robot's legs.\n"
        "  try  robot.arrays, or robot.legs[0]"
    ),
    "batch.foot_position(robot, q)": (
        "leg is of type Robot; it must be a Leg or the arrays of a robot's legs.\n"
        "  try  robot.arrays, or robot.legs[0]"
    ),
    "batch.jacobian(None, q)": (
        "leg is None; it must be a Leg or the arrays of a robot's legs.\n"
        "  try  robot.arrays, or robot.legs[0]"
    ),
    "batch.joint_angles(None, q)": (
        "leg is None; it must be a Leg or the arrays of a robot's legs.\n"
        "  try  robot.arrays, or robot.legs[0]"
    ),
    "batch.leg_torque(leg, q, q, q, gravity='x')": "gravity is x; it must be one finite number.",
    "batch.leg_torque(leg, q, q, q, gravity=q)": (
        "gravity is an array of shape (4, 3); it must be one finite number."
    ),
    "batch.inverse_dynamics(robot, dynamics.BodyMotion.at_rest(), Q, Q, Q, gravity=np.nan)": (
        "gravity is nan; it must be one finite number."
    ),
    "batch.inverse_dynamics(leg, dynamics.BodyMotion.at_rest(), Q, Q, Q)": (
        'robot is of type Leg; it must be a Robot.\n  try  phasmid.load_robot("phantomx-paper")'
    ),
    "batch.inverse_dynamics(robot, None, Q, Q, Q)": (
        "body is None; it must be a BodyMotion.\n  try  dynamics.BodyMotion.at_rest()"
    ),
}

SCRIPT = """
import json, sys
import numpy as np
import phasmid
from phasmid import batch, dynamics
robot = phasmid.load_robot("phantomx-paper")
leg, q, Q = robot.legs[0], np.zeros((4, 3)), np.zeros((6, 3))
frozen = np.zeros((4, 3))
frozen.flags.writeable = False
said = {}
for call in json.load(sys.stdin):
    try:
        eval(call)
    except phasmid.PhasmidError as error:
        said[call] = str(error)
assert "numba" not in sys.modules or batch.backend() != "NumPy"
whole = np.array([[0, 1, -1], [2, 0, -2]])
assert np.array_equal(batch.foot_position(leg, whole), batch.foot_position(leg, whole * 1.0))
print(json.dumps(said))
"""


@pytest.fixture(scope="module")
def said() -> dict[str, str]:
    """What the person reads, in a process without the tests' type checker."""
    run = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        input=json.dumps(list(REFUSALS)),
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(run.stdout)


@pytest.mark.parametrize("call", REFUSALS)
def test_what_does_not_fit_is_refused_in_a_sentence(call: str, said: dict[str, str]) -> None:
    assert said[call] == REFUSALS[call]
