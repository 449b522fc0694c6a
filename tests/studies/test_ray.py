"""Studies on a local Ray of two workers."""

import pytest

from phasmid.errors import InvalidInput, OutputError
from phasmid.recording.provenance import versions
from phasmid.studies import study

pytest.importorskip("ray", reason="Ray is not installed")

GRID = {
    "kind": "plan",
    "set": {"duration": 0.5},
    "metrics": ["energy.cost_of_transport"],
    "axes": {"gait": ["tripod", "wave"], "step_length_mm": [20, 40, 60]},
}

# Ray leaves sockets and files to the interpreter.
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")


@pytest.mark.slow
def test_ray_gives_the_same_rows_to_the_bit(tmp_path):
    local = study(GRID, out=tmp_path / "local", workers=1)
    ray = study(GRID, out=tmp_path / "ray", workers=2, ray="local")
    assert ray.table.drop(columns="wall_time_s").equals(local.table.drop(columns="wall_time_s"))


@pytest.mark.slow
def test_a_run_that_kills_its_ray_worker_fails_alone(tmp_path):
    (tmp_path / "mine.py").write_text(
        "import os\n"
        "def deadly(scenario, value):\n"
        "    if value == 1:\n"
        "        os._exit(9)\n"
        "    return scenario\n"
    )
    (tmp_path / "s.toml").write_text(
        'kind = "plan"\nmetrics = ["energy.cost_of_transport"]\nset = {duration = 0.5}\n'
        '[axes]\nload = {values = [0, 1, 2], function = "mine.py:deadly"}\n'
    )
    table = study(tmp_path / "s.toml", out=tmp_path / "out", workers=2, ray="local").table
    assert list(table["status"]) == ["done", "failed", "done"]
    assert "worker process died" in table["error"][1]


@pytest.mark.slow
def test_a_worker_of_another_version_is_refused(tmp_path, monkeypatch):
    other = versions() | {"mujoco_version": "1.0"}
    monkeypatch.setattr("phasmid.studies.driver.versions", lambda: other)
    with pytest.raises(
        OutputError, match=r"a worker has mujoco .*; the study is made with muj.* 1"
    ):
        study(GRID, out=tmp_path / "out", workers=1, ray="local")


def test_an_address_at_which_nobody_answers_is_refused(tmp_path):
    with pytest.raises(InvalidInput, match=r"no Ray cluster answers at 127\.0\.0\.1:1: "):
        study(GRID, out=tmp_path / "out", ray="127.0.0.1:1")
