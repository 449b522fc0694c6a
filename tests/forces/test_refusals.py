"""What no force model can use: refused in one sentence, without a foreign exception or warning."""

import json
import subprocess
import sys

import pytest

REFUSALS = {
    "share(c, w, forces.FrictionCone)": (
        "the force model is the class FrictionCone; it must be a member of the family or its "
        "name.\n  try  FrictionCone()"
    ),
    "share(c, w, 5)": "the force model is 5; it must be a member of the family or its name.\n"
    "  try  one of minimum-norm, weighted-minimum-norm, minimum-torque, friction-cone, "
    "smallest-largest-load",
    "share(c, w, None)": "the force model is None; it must be a member of the family or its name.",
    "forces.force_model(['a'])": "the force model is ['a']; it must be a member of the family or",
    "forces.FrictionCone('friction-cone')": (
        'the cost is "friction-cone"; it must be a force model without limits of its own.\n'
        "  try  one of minimum-norm, weighted-minimum-norm, minimum-torque"
    ),
    "forces.FrictionCone('least')": 'the cost is "least"; it must be a force model without limits',
    "forces.FrictionCone(forces.MinimumTorque)": (
        "the cost is the class MinimumTorque; it must be a force model without limits of its "
        "own.\n  try  MinimumTorque()"
    ),
    "forces.FrictionCone(forces.FrictionCone())": "the cost is of type FrictionCone; it must be",
    "forces.FrictionCone(None)": "the cost is None; it must be a force model without limits of",
    "forces.FrictionCone(least_normal='a')": 'least_normal is "a"; it must be a number.',
    "forces.FrictionCone(least_normal=inf)": "least_normal is inf N; it must be between 0 and",
    "forces.WeightedMinimumNorm('x')": 'tangential_weight is "x"; it must be a number.',
    "forces.WeightedMinimumNorm(1e12)": "tangential_weight is 1e+12; it must be between 1e-06",
    "forces.MinimumTorque('x')": 'lever is "x"; it must be a number.',
    "forces.SmallestLargestLoad(slack=nan)": "slack is nan; it must be between 1e-05 and 1.",
    "forces.Contacts(np.zeros((0, 3)), np.ones(0))": "feet have shape (0, 3); there must be one",
    "forces.Contacts([[0, 0, 0], [1, 1]], [1, 1])": "feet is [[0, 0, 0], [1, 1]]; it must be an",
    "forces.Contacts('feet', [1, 1])": 'feet is "feet"; it must be an array of numbers.',
    "share(c, 'w')": 'wrench is "w"; it must be an array of numbers.',
    "share(c, [[1], [1, 2]])": "wrench is [[1], [1, 2]]; it must be an array of numbers.",
    "share(c, w * 1j)": "wrench is an array of shape (6,); it must be an array of numbers.",
    "share(c, w, joints=3)": "joints is 3; it must be JointLoad.\n"
    "  try  JointLoad(jacobian, torque)",
    "share(w, c)": "contacts is an array of shape (6,); it must be Contacts.\n"
    "  try  Contacts(feet, stance)",
    "share(FEET, w)": "contacts is an array of shape (4, 3); it must be Contacts.",
    "share(c, w, time=np.zeros(3))": "time has shape (3,); it must fit ().",
    "share(c, w, time='now')": 'time is "now"; it must be an array of numbers.',
    "forces.JointLoad(J, tau, nan)": "limit is nan N·m; it must be 0 or more.",
    "forces.JointLoad(J, tau, 'a')": 'limit is "a"; it must be an array of numbers.',
    "forces.minimum_norm(FEET.tolist(), [[1]], w)": "feet, stance and wrench have shapes (4, 3), "
    "(1, 1) and (6,); they must be (..., L, 3), (..., L) and (..., 6)",
    "forces.minimum_norm(FEET[:, :2], np.ones(4), w)": "feet, stance and wrench have shapes (4, 2)",
    "forces.minimum_norm(FEET, None, w)": "stance is None; it must be an array of numbers.",
    "forces.friction_statistics(c, 'a')": 'force is "a"; it must be an array of numbers.',
    "forces.friction_statistics(c, FEET + inf)": "force[0, 0] is inf; it must be a finite number.",
    "forces.friction_statistics(FEET, c)": "contacts is an array of shape (4, 3); it must be",
    "forces.friction_statistics(c, FEET).summary('a')": 'percentile is "a"; it must be a number.',
    "load_share(period=0)": "period is 0 s; it must be a finite number greater than 0.",
    "load_share(period=nan)": "period is nan s; it must be a finite number greater than 0.",
    "load_share(period=-2)": "period is -2 s; it must be a finite number greater than 0.",
    "load_share(period='a')": 'period is "a"; it must be a number.',
    "load_share(window=None)": "window is None; it must be a number.",
}

SCRIPT = """
import json, sys
import numpy as np
import phasmid
from phasmid import forces
from phasmid.gait import HEXAPOD_GAITS
inf, nan, share = np.inf, np.nan, forces.share_load
FEET = np.array([[0.2, -0.2, -0.1], [-0.2, -0.2, -0.1], [-0.2, 0.2, -0.1], [0.2, 0.2, -0.1]])
c, w = forces.Contacts(FEET, np.ones(4)), np.array([0, 0, 26.0, 0, 0, 0])
J, tau = np.zeros((4, 3, 3)), np.zeros((4, 3))
def load_share(period=2.0, window=0.1):
    return forces.load_share(HEXAPOD_GAITS["tripod"], np.zeros(3), period=period, window=window)
said = {}
for call in json.load(sys.stdin):
    try:
        eval(call)
    except phasmid.InvalidInput as error:
        said[call] = str(error)
    except Exception as error:
        said[call] = repr(error)
# Lists of numbers are as good as arrays.
assert np.allclose(share(c, w.tolist()), forces.minimum_norm(FEET.tolist(), [1, 1, 1, 1], [*w]))
print(json.dumps(said))
"""


@pytest.fixture(scope="module")
def said():
    """What the person reads, in a process without the tests' type checker."""
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", SCRIPT],
        input=json.dumps(list(REFUSALS)),
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)


@pytest.mark.parametrize("call", REFUSALS)
def test_what_cannot_be_used_is_refused_in_a_sentence(call, said):
    assert said.get(call, "no refusal").startswith(REFUSALS[call])
