"""Variants and gaits of a wrong kind.

In a process of its own, without the tests' type checker, as a newcomer's script runs.
"""

import json
import subprocess
import sys

SCRIPT = """
import json
from phasmid.errors import PhasmidError
from phasmid.gait import load_gait
from phasmid.robot import load_robot
from phasmid.robot.variants import with_mass_model, with_mounts

robot = load_robot("phantomx-paper")
calls = [
    *(lambda w=w: with_mounts(robot, w) for w in ("foo", None, 3, [])),
    *(lambda w=w: with_mass_model(robot, w) for w in ("foo", None, 3, [])),
    lambda: with_mounts(3, "as-given"),
    lambda: load_gait("wave", None),
    lambda: load_gait("wave", [4]),
]
said = []
for call in calls:
    try:
        call()
        said.append("accepted")
    except PhasmidError as error:
        said.append(str(error))
    except Exception as error:
        said.append(f"RAW {error!r}")
print(json.dumps(said))
"""


def test_a_variant_or_gait_of_a_wrong_kind_is_refused_in_a_sentence():
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], check=True, capture_output=True, text=True
    )
    wrong = [said for said in json.loads(done.stdout) if "it must be" not in said]
    assert wrong == []
