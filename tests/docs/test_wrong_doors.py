"""Wrong kinds of things at the doors of the rooms: refused in one sentence, as in the public API.

In a process of its own, without the tests' type checker, as a newcomer's script runs.
"""

import json
import subprocess
import sys

import pytest

SCRIPT = """
import json
import numpy as np
from phasmid.errors import PhasmidError
from phasmid.formats import load_robot
from phasmid.gait import load_gait, support_margin
from phasmid.gait.sway import sway
from phasmid.robot.variants import with_mass_model, with_mounts, with_neutral_foot

robot, gait = load_robot("phantomx-paper"), load_gait("wave", 6)
feet, stance = np.zeros((9, 6, 2)), np.ones((9, 6), dtype=bool)
centre, neutral, time = np.zeros((9, 2)), np.zeros((6, 2)), np.zeros(3)
bad = [None, 3, "abc", {}, object(), ["a"], np.zeros((2, 2, 2, 2))]
calls = {
    "variants": [lambda w=w: with_mounts(robot, w) for w in ("foo", None, 3, [])]
    + [lambda w=w: with_mass_model(robot, w) for w in ("foo", None, 3, [])]
    + [lambda: with_mounts(3, "as-given")],
    "neutral": [lambda w=w: with_neutral_foot(robot, w, None) for w in bad[2:] + [float("nan")]]
    + [lambda w=w: with_neutral_foot(robot, None, w) for w in bad[2:] + [True]]
    + [lambda: with_neutral_foot(3, None, None)],
    "gait": [lambda: load_gait("wave", None), lambda: load_gait("wave", [4])],
    "margin": [lambda w=w: support_margin(w, stance, centre) for w in bad]
    + [lambda w=w: support_margin(feet, w, centre) for w in bad if w is not bad[1]]
    + [lambda w=w: support_margin(feet, stance, w) for w in bad if w is not bad[1]],
    "sway": [lambda w=w: sway(w, neutral, 1.0, time) for w in bad]
    + [lambda w=w: sway(gait, w, 1.0, time) for w in bad]
    + [lambda w=w: sway(gait, neutral, w, time) for w in bad if w is not bad[1]]
    + [lambda w=w: sway(gait, neutral, 1.0, w) for w in bad],
}
said = {name: [] for name in calls}
for name, group in calls.items():
    for call in group:
        try:
            call()
            said[name].append("accepted")
        except PhasmidError as error:
            said[name].append(str(error))
        except Exception as error:
            said[name].append(f"RAW {error!r}")
print(json.dumps(said))
"""


@pytest.fixture(scope="module")
def told() -> dict[str, list[str]]:
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], check=True, capture_output=True, text=True
    )
    return json.loads(done.stdout)


@pytest.mark.parametrize("door", ["variants", "neutral", "gait", "margin", "sway"])
def test_a_wrong_kind_is_refused_in_a_sentence(door, told):
    assert [said for said in told[door] if "it must be" not in said] == []
