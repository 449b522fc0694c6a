"""Task files: units, defaults, and one sentence for what is wrong."""

import subprocess
import sys

import pytest

from phasmid.errors import InvalidInput
from phasmid.extras import install_hint
from phasmid.learning import Task, load_task, task_names


def test_tasks_load_and_units_are_converted(tmp_path):
    for name in task_names():
        assert isinstance(load_task(name), Task)
    path = tmp_path / "slow.toml"
    path.write_text('robot = "quadruped"\n[commands]\nforward_mm_per_s = 50\nyaw_deg_per_s = 10\n')
    task = load_task(path)
    assert task.commands.forward == pytest.approx(0.05)
    assert task.robot == "quadruped"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[rewards]\nvelocty = 1.0", 'unknown key "velocty" in rewards'),
        ("rate = -50.0", "rate is -50"),
        ('fidelity = "medium"', 'fidelity is "medium"; it must be'),
        ("[randomisation]\nmass = 2.0", "mass is 2"),
    ],
)
def test_bad_tasks_are_refused_in_one_sentence(tmp_path, text, sentence):
    path = tmp_path / "task.toml"
    path.write_text(text)
    with pytest.raises(InvalidInput, match=sentence):
        load_task(path)
    with pytest.raises(InvalidInput, match="unknown key"):
        load_task("walk").replace(fidelty="full")


def test_without_gymnasium_one_sentence_says_what_to_install():
    code = (
        "import sys; sys.modules['gymnasium'] = None\n"
        "try:\n    import phasmid.learning\n"
        "except Exception as error:\n    print(type(error).__name__, error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("InvalidInput learning needs Gymnasium")
    assert install_hint("learn") in done.stdout
