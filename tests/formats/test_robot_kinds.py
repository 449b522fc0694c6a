"""Wrong kinds of things at the doors of robot files.

In a process of its own, without the tests' type checker, as a newcomer's script runs.
"""

import json
import subprocess
import sys

SCRIPT = """
import json
from phasmid.errors import PhasmidError
from phasmid.formats import ImportOptions, import_robot, load_robot, save_robot
wrong = [("packages", None), ("packages", 3), ("packages", {"x": 3}), ("foot", 3), ("masses", 3)]
wrong += [("servo", 3), ("strict", 3), ("total_mass", "a"), ("mesh_unit", 3), ("mesh_unit", True)]
wrong += [("mesh_unit", b"x"), ("mesh_unit", [1])]

robot = load_robot("phantomx-paper")
calls = [
    *(lambda k=k, v=v: ImportOptions(**{k: v}) for k, v in wrong),
    *(lambda r=r: save_robot(r, "x.urdf") for r in (None, 3, "x")),
    *(lambda p=p: save_robot(robot, p) for p in (None, 3, b"x", [])),
    lambda: import_robot("phantomx-paper", 3),
    lambda: load_robot("phantomx-paper", options={}),
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


def test_a_wrong_kind_is_refused_in_a_sentence():
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], check=True, capture_output=True, text=True
    )
    wrong = [said for said in json.loads(done.stdout) if "it must be" not in said]
    assert wrong == []
