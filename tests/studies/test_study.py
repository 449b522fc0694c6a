"""Studies: points of axes, rows of runs, and what survives interruptions and bad runs."""

import errno
import hashlib
import os
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import tomlkit

import phasmid
from phasmid.cli import main
from phasmid.errors import InvalidInput, OutputError
from phasmid.recording import load_recording
from phasmid.scenario import load_scenario
from phasmid.servo import load_servo
from phasmid.studies import load_study, load_study_file, repeat_run, study
from phasmid.studies.results import MOST_BYTES, PARTS, DamagedPart, read_rows, write_rows
from phasmid.studies.runs import Run, Runner
from phasmid.studies.search import best_points, search
from phasmid.studies.webpage import failure_table, main_effects

COST = "energy.cost_of_transport"
PLAN = {"kind": "plan", "set": {"duration": 0.5}, "metrics": [COST]}


def study_of(**changes):
    return load_study_file(PLAN | changes)[0]


def runner_of(tmp_path, **changes):
    one = study_of(**changes)
    return Runner(one, load_scenario("paper"), tmp_path, tmp_path, {})


def same(one, other):
    """Whether two tables have equal rows, except for their times."""
    return one.drop(columns="wall_time_s").equals(other.drop(columns="wall_time_s"))


# Points ------------------------------------------------------------------------------------------


def test_a_grid_has_every_combination_once_with_every_seed():
    axes = {"gait": ["tripod", "wave"], "step_length_mm": {"low": 20, "high": 60, "count": 3}}
    one = study_of(axes=axes, seeds=2)
    points = list(one.points())
    assert len(points) == one.count() == 2 * 3 * 2
    assert points[0] == {"gait": "tripod", "step_length_mm": 20.0, "seed": 0}
    assert points[-1] == {"gait": "wave", "step_length_mm": 60.0, "seed": 1}
    assert len({tuple(point.values()) for point in points}) == len(points)


def test_ranges_may_be_logarithmic_or_whole():
    axes = {
        "stiffness": {"low": 1e2, "high": 1e4, "count": 3, "log": True},
        "samples": {"low": 100, "high": 201, "count": 3, "whole": True},
    }
    points = list(study_of(axes=axes).points())
    assert [point["stiffness"] for point in points[::3]] == pytest.approx([1e2, 1e3, 1e4])
    assert [point["samples"] for point in points[:3]] == [100, 150, 201]


def test_a_latin_hypercube_has_one_point_in_each_slice_of_each_axis():
    axes = {"step_length": {"low": 0.0, "high": 1.0}, "period": {"low": 2.0, "high": 4.0}}
    one = study_of(axes=axes, sampler="latin-hypercube", runs=16, sampler_seed=3)
    points = list(one.points())
    for key, (low, high) in {"step_length": (0, 1), "period": (2, 4)}.items():
        slices = [int(16 * (point[key] - low) / (high - low)) for point in points]
        assert sorted(slices) == list(range(16))
    assert points == list(one.points())


@pytest.mark.parametrize("sampler", ["random", "sobol"])
def test_sampled_values_lie_in_their_ranges(sampler):
    axes = {
        "period": {"low": 1.0, "high": 8.0, "log": True},
        "samples": {"low": 3, "high": 5, "whole": True},
        "gait": ["tripod", "wave", "ripple"],
    }
    points = list(study_of(axes=axes, sampler=sampler, runs=300).points())
    period = np.array([point["period"] for point in points])
    # Half of a logarithmic range from 1 to 8 is below its geometric mean.
    assert 1 <= period.min() < period.max() <= 8
    assert np.mean(period < 8**0.5) == pytest.approx(0.5, abs=0.1)
    assert {point["samples"] for point in points} == {3, 4, 5}
    assert {point["gait"] for point in points} == {"tripod", "wave", "ripple"}


# One run -----------------------------------------------------------------------------------------


def test_values_reach_scenario_robot_and_seeds(tmp_path):
    axes = {
        "step_length_mm": [30],
        "robot.body.mass_g": [1500],
        "robot.legs.*.tibia_mm": [120],
        "robot.servo": ["AX-18A"],
    }
    runner = runner_of(tmp_path, axes=axes, seeds=[7])
    (point,) = runner.study.points()
    scenario, settings = runner.build(point)
    robot = scenario.load_robot()
    assert scenario.stride.step_length == 0.03
    assert robot.body.mass == 1.5
    assert [leg.tibia.length for leg in robot.legs] == [0.12] * 6
    assert robot.servo.name == "AX-18A"
    assert (scenario.terrain.terrain_seed, scenario.sensors.sensor_seed) == (7, 7)
    assert scenario.duration == 0.5
    assert settings == {}


def test_a_study_varies_the_servo(tmp_path):
    table = study(
        PLAN | {"axes": {"servo": ["AX-12A", "MX-28"]}, "metrics": ["robot.stall_torque"]},
        out=tmp_path / "out",
        workers=1,
    ).table
    assert list(table["servo"]) == ["AX-12A", "MX-28"]
    assert list(table["robot.stall_torque"]) == [
        load_servo(name).stall_torque for name in table["servo"]
    ]
    runner = runner_of(tmp_path, axes={"servo": ["MX-82"]})
    (point,) = runner.study.points()
    assert 'no servo called "MX-82".' in runner.row(Run(0, "id", point))["error"]


def test_values_reach_the_engine(tmp_path):
    axes = {"engine.acceleration": [0.3], "engine.estimator.level": [1.0]}
    runner = runner_of(tmp_path, kind="drive", velocity=[0.05, 0, 0], axes=axes)
    (point,) = runner.study.points()
    _, settings = runner.build(point)
    assert settings["acceleration"] == 0.3
    assert settings["estimator"].level == 1.0
    recording = runner.record(point)
    assert '"acceleration": 0.3' in recording.attrs["controller_settings"]
    assert recording.attrs["ending"] == "COMPLETED"


def test_functions_of_a_file_make_axes_and_metrics(tmp_path):
    (tmp_path / "mine.py").write_text(
        "def twice(scenario, value):\n"
        "    return scenario.replace(step_length=2 * value)\n"
        "def samples(recording):\n"
        "    return recording.sizes['time']\n"
    )
    axes = {"half_step": {"values": [0.01], "function": "mine.py:twice"}}
    metrics = [{"name": "samples", "function": "mine.py:samples"}]
    runner = runner_of(tmp_path, axes=axes, metrics=metrics)
    scenario, _ = runner.build({"half_step": 0.01})
    assert scenario.stride.step_length == 0.02
    recording = runner.record({"half_step": 0.01})
    assert runner.metrics(recording) == {"samples": recording.sizes["time"]}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"metrics": ["energy.cost_of_transprot"]}, '"energy.cost_of_transport"'),
        ({"metrics": ["servo_verdict.servo"]}, "is str; it must be a number"),
        ({"axes": {"robot.bod.mass": [1]}}, 'the robot has no table "bod"'),
        ({"axes": {"robot.body.mas": [1]}}, 'unknown key "mas" in body'),
        ({"axes": {"step_length": ["long"]}}, 'step_length is "long"'),
        ({"axes": {"step_length": [5.0]}}, "step of 5000 mm"),
    ],
)
def test_a_run_that_cannot_be_made_is_a_row_with_a_sentence(tmp_path, changes, message):
    runner = runner_of(tmp_path, **({"axes": {"gait": ["tripod"]}} | changes))
    (point,) = runner.study.points()
    row = runner.row(Run(0, "id", point))
    assert row["status"] == "failed"
    assert message in row["error"]
    assert "\n" not in row["error"]


# Studies -----------------------------------------------------------------------------------------

GRID = PLAN | {"axes": {"gait": ["tripod", "wave"], "step_length_mm": [20, 40, 60]}, "seeds": 2}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A study that nothing has disturbed."""
    return study(GRID, out=tmp_path_factory.mktemp("whole") / "study", workers=1)


def test_rows_are_those_of_single_runs(whole):
    assert list(whole.table["number"]) == list(range(12))
    assert (whole.table["status"] == "done").all()
    scenario = load_scenario("paper").replace(duration=0.5, gait="wave", step_length_mm=40)
    alone = phasmid.summarise(phasmid.analyse(scenario, phasmid.plan(scenario)))
    row = whole.table.query("gait == 'wave' and step_length_mm == 40 and seed == 1")
    # Bit by bit: another process makes the same run.
    assert row[COST].item() == alone["energy"]["cost_of_transport"]
    cost = whole.dataset[COST].sel(gait="wave", step_length_mm=40, seed=1)
    assert cost.item() == row[COST].item()


def test_a_study_that_is_complete_makes_no_run_again(whole):
    before = sorted(whole.folder.glob("parts/*"))
    again = study(GRID, out=whole.folder)
    assert sorted(whole.folder.glob("parts/*")) == before
    assert same(again.table, whole.table)


def test_another_study_of_the_name_is_refused_and_says_what_changed(whole):
    other = GRID | {"axes": GRID["axes"] | {"step_length_mm": [20, 50]}}
    with pytest.raises(InvalidInput) as caught:
        study(other, out=whole.folder)
    assert caught.value.what == (
        f"{whole.folder} holds another study of this name; changed since: axes.step_length_mm."
    )
    assert caught.value.hint == f'out = "{whole.folder}-2", or force = true, which deletes its rows'


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
def test_a_killed_study_goes_on_without_a_lost_or_double_row(tmp_path, whole):
    (tmp_path / "s.toml").write_text(
        'kind = "plan"\nmetrics = ["energy.cost_of_transport"]\nseeds = 2\n[set]\n'
        'duration = 0.5\n[axes]\ngait = ["tripod", "wave"]\nstep_length_mm = [20, 40, 60]\n'
    )
    out = tmp_path / "out"
    command = [sys.executable, "-m", "phasmid", "study", "s.toml", "--out", "out", "--workers", "2"]
    process = subprocess.Popen(command, cwd=tmp_path, start_new_session=True)
    while process.poll() is None and not list(out.glob("parts/*.parquet")):
        time.sleep(0.01)
    # The driver and its workers, all at once.
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    assert len(load_study(out).table) > 0
    results = study(tmp_path / "s.toml", out=out, workers=1)
    assert same(results.table.drop(columns="run"), whole.table.drop(columns="run"))
    assert not results.table["run"].duplicated().any()


def test_parts_made_at_once_in_one_folder_are_the_whole_study(tmp_path, whole):
    def make(k):
        return study(GRID, out=tmp_path / "out", workers=1, part=(k, 3))

    # A part alone has no page.
    assert len(make(1).table) == 4
    assert not (tmp_path / "out/study.html").exists()
    with ThreadPoolExecutor() as pool:
        assert max(len(results.table) for results in pool.map(make, (2, 3))) == 12
    assert (tmp_path / "out/study.html").exists()
    assert same(load_study(tmp_path / "out").table, whole.table)


def test_a_run_that_kills_its_worker_fails_alone(tmp_path):
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
    table = study(tmp_path / "s.toml", out=tmp_path / "out", workers=2).table
    assert list(table["status"]) == ["done", "failed", "done"]
    assert "worker process died" in table["error"][1]


def test_failed_runs_are_rows_and_can_be_made_again(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("s.toml").write_text(
        'kind = "plan"\nmetrics = ["energy.cost_of_transport"]\nset = {duration = 0.5}\n'
        "[axes]\nstep_length_mm = [40, 5000, 5001]\n"
    )
    assert main(["study", "s.toml", "--workers", "1"]) == 0
    printed = capsys.readouterr()
    assert "3 runs, 2 failed" in printed.out
    assert "phasmid: failed: 2, such as run 1: step of 5000 mm is too much " in printed.err
    table = load_study("results/study").table
    assert list(table["status"]) == ["done", "failed", "failed"]
    again = ["study", "s.toml", "--workers", "1", "--retry", "failed", "--max-failures", "0"]
    assert main(again) == 1
    assert "runs failed, more than 0" in capsys.readouterr().err
    assert main(["study", "s.toml", "--only", "0"]) == 0
    assert capsys.readouterr().out.startswith("equal: every metric is that of its row")
    assert Path("results/study/runs/0/report.html").exists()
    assert len(load_study("results/study").table) == 3


def test_without_a_terminal_progress_is_a_line_now_and_then(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("phasmid.cli.study.LINE_EVERY", 0.0)
    file = tmp_path / "s.toml"
    file.write_text(
        f'kind = "plan"\nmetrics = ["{COST}"]\n[set]\nduration = 0.5\nstep_length_mm = 400\n'
        "[axes]\nperiod = [2, 3]\n"
    )
    assert main(["study", str(file), "--out", str(tmp_path / "out"), "--workers", "1"]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].startswith("phasmid: 0 of 2, 0/s")
    assert any(line.startswith("phasmid: 2 of 2, ") and "2 failed" in line for line in lines)


def test_recordings_are_kept_by_a_rule(tmp_path):
    one = {
        "kind": "simulate",
        "set": {"duration": 0.3},
        "metrics": ["torque.simulation.largest"],
        "axes": {"robot.body.mass_g": [500, 2500]},
        "keep": "torque.simulation.largest > 1",
    }
    results = study(one, out=tmp_path / "out", workers=1)
    light, heavy = results.table["recording"]
    assert light == ""
    recording = load_recording(results.folder / "recordings" / heavy)
    largest = phasmid.summarise(recording)["torque"]["simulation"]["largest"]
    assert largest == results.table["torque.simulation.largest"][1] > 1


# Page --------------------------------------------------------------------------------------------


def test_the_page_is_one_file_that_loads_nothing(whole):
    page = (whole.folder / "study.html").read_text("utf-8")
    assert "http" not in page.replace("http-equiv", "")
    assert "default-src 'none'" in page
    assert "12 planned walks" in page
    assert "No run failed." in page


def test_main_effects_are_means_with_students_interval_over_seeds():
    # Two seeds with means 1 and 3: Student's factor for one degree of freedom is 12.7062.
    rows = [("a", 0, 1.0), ("a", 1, 3.0), ("b", 0, 5.0), ("b", 1, 5.0)]
    effects = main_effects(pd.DataFrame(rows, columns=["x", "seed", "m"]), "x", ["m"])
    assert effects["labels"] == ["a", "b"]
    assert effects["m"][0] == pytest.approx([2.0, 12.7062], rel=1e-4)
    assert effects["m"][1] == [5.0, 0.0]


def test_causes_of_failures_are_counted_without_their_numbers():
    errors = ["joint 1 needs 6.2 rad/s", "joint 2 needs 7.5e+01 rad/s", "<b>fell</b>", ""]
    status = ["failed", "failed", "failed", "done"]
    table = pd.DataFrame({"number": range(4), "error": errors, "status": status})
    found = failure_table(table)
    assert "<tr><td>2</td><td>0</td><td>joint 1 needs 6.2 rad/s</td></tr>" in found
    assert "&lt;b&gt;fell" in found


def test_a_run_made_again_equals_its_row(whole, tmp_path):
    recording, different = repeat_run(GRID, 7, out=whole.folder)
    assert different == []
    assert recording.attrs["ending"] == "COMPLETED"
    changed = whole.table.iloc[7].to_dict() | {COST: 0.1}
    folder = tmp_path / "copy"
    shutil.copytree(whole.folder, folder)
    write_rows(folder, [changed])
    assert repeat_run(GRID, 7, out=folder)[1] == [COST]
    with pytest.raises(InvalidInput, match="has no run 99"):
        repeat_run(GRID, 99, out=folder)


# Search ------------------------------------------------------------------------------------------


def searching(tmp_path, **options):
    """A search on the metrics x² and (x - 1)², without a walk."""
    (tmp_path / PARTS).mkdir(parents=True, exist_ok=True)
    axes = {"x": {"low": -2.0, "high": 2.0, "function": "x.py:f"}}
    one = study_of(axes=axes, metrics=["near 0", "near 1"], search={"budget": 60} | options)
    made = []

    def make(runs):
        made.extend(run.point["x"] for run in runs)
        rows = [
            {"number": run.number, "run": run.id, "x": x, "near 0": x**2, "near 1": (x - 1) ** 2}
            | {"status": "done", "ending": "", "error": "", "wall_time_s": 0.0}
            for run in runs
            for x in [run.point["x"]]
        ]
        write_rows(tmp_path, rows)
        return True

    search(one, {}, tmp_path, make)
    return one, made, best_points(one, read_rows(tmp_path, one))


@pytest.mark.parametrize("algorithm", ["tpe", "cma-es"])
def test_a_search_finds_the_least_of_a_parabola(tmp_path, algorithm):
    _, made, best = searching(tmp_path, algorithm=algorithm, minimise=["near 1"], batch=10)
    assert len(made) == 60
    # 60 random points are within 0.03 of it once in two times; a search is nearer.
    assert abs(best["x"][0] - 1) < 0.05


@pytest.mark.parametrize(
    ("objectives", "low", "high", "slack"),
    [
        ({"minimise": ["near 0", "near 1"]}, 0, 1, 1e-9),
        # A point just below 1 is best until its mirror image above 1 is tried.
        ({"minimise": ["near 1"], "maximise": ["near 0"]}, 1, 2, 0.05),
    ],
)
def test_a_search_of_two_objectives_finds_the_pareto_set(tmp_path, objectives, low, high, slack):
    _, _, best = searching(tmp_path, **objectives, batch=20, budget=200)
    # Every point between both optima is best in its way, and no other point.
    assert best["x"].between(low - slack, high + slack).all()
    assert best["x"].min() < low + 0.05
    assert best["x"].max() > high - 0.05
    assert len(best) > 20


def test_points_that_violate_a_constraint_are_not_best(tmp_path):
    _, _, best = searching(tmp_path, minimise=["near 1"], constraints=["near 0 < 0.25"], budget=200)
    # The minimum at 1 violates x² < 0.25; the best allowed point is 0.5.
    assert best["x"][0] == pytest.approx(0.5, abs=0.05)


def test_a_search_of_walks_goes_on_where_it_was_stopped(tmp_path):
    one = PLAN | {
        "axes": {"step_length_mm": {"low": 20, "high": 60}, "gait": ["tripod", "wave"]},
        "keep": "pareto",
        "search": {"budget": 8, "batch": 4, "minimise": [COST]},
    }
    whole = study(one, out=tmp_path / "whole", workers=1)
    # Of the rows the last batches are lost; the same points are chosen again.
    parts = sorted((tmp_path / "whole/parts").glob("*"))
    for part in parts[len(parts) // 2 :]:
        part.unlink()
    again = study(one, out=tmp_path / "whole", workers=1)
    assert same(again.table, whole.table)
    best = whole.best
    assert best[COST][0] == whole.table[COST].min()
    # The recordings of the best points are kept.
    kept = again.table.query("recording != ''")
    assert list(kept["number"]) == again.best_numbers == [again.table[COST].idxmin()]
    recording = load_recording(again.folder / "recordings" / kept["recording"].item())
    assert phasmid.summarise(recording)["energy"]["cost_of_transport"] == kept[COST].item()


# Bad input ---------------------------------------------------------------------------------------

RANGE = {"axes": {"period": {"low": 1, "high": 2}}}
FEW = {"budget": 3, "minimise": [COST]}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({}, "a study must have an axis or seeds."),
        ({"axes": {"gait": []}}, "an axis has no value; it must have at least one."),
        ({"axes": {"gat": ["wave"]}}, 'no scenario has a field "gat".'),
        ({"axes": {"period": {"low": 2}}}, "an axis must have values, or low and high."),
        ({"axes": {"period": {"low": 2, "high": 1, "count": 2}}}, "low is 2; it must be below"),
        ({"axes": {"period": {"low": 1, "high": 2}}}, "axes.period has no count"),
        ({"axes": {"period": [1]}, "sampler": "sobol"}, "runs is missing"),
        ({"axes": {"engine.acceleration": [1]}}, "engine settings are for driven runs."),
        ({"axes": {"period": [1]}, "kind": "drive"}, "must have a velocity or commands"),
        (
            {"axes": {"engine.acceleratoin": [1]}, "kind": "drive", "velocity": [0, 0, 0]},
            'the engine has no setting "acceleratoin".',
        ),
        ({"seeds": 2, "metrics": []}, "metrics"),
        ({"seeds": 2, "metrics": ["a", "a"]}, "a metric is named twice."),
        ({"seeds": 2, "keep": "b < 3"}, 'keep is "b < 3"'),
        ({"seeds": 2, "keep": "pareto"}, "needs the objectives of [search]"),
        ({"seeds": 2, "axis": {}}, 'unknown key "axis"'),
        (RANGE | {"search": {"budget": 3}}, "[search] has no objective."),
        (RANGE | {"search": {"budget": 3, "minimise": ["a"]}}, 'the objective "a" is none'),
        (RANGE | {"search": FEW | {"constraints": ["a < 1"]}}, 'a constraint is "a < 1"'),
        (RANGE | {"search": FEW, "runs": 3}, "a sampler or [search]; one must go."),
        (
            {"axes": {"gait": ["wave"]}, "search": FEW | {"algorithm": "cma-es"}},
            "cma-es takes ranges only.",
        ),
    ],
)
def test_a_study_that_cannot_be_is_refused_in_a_sentence(changes, message):
    with pytest.raises(InvalidInput) as caught:
        study_of(**changes)
    assert message in str(caught.value)


def test_bad_files_and_options_are_status_2(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("s.toml").write_text('kind = "plan"\nseeds = 1\nmetrics = ["energy.work"]\n')
    Path("results/study").mkdir(parents=True)
    Path("results/study/mine.txt").write_text("mine")
    Path("f.toml").write_text('seeds = 1\nmetrics = [{name = "a", function = "no.py:f"}]\n')
    for arguments, message in (
        (["absent.toml"], "absent.toml does not exist."),
        (["s.toml"], "is no folder of a study; nothing was written."),
        (["s.toml", "--workers", "none"], '--workers is "none"'),
        (["s.toml", "--part", "1 of 2"], '--part is "1 of 2"'),
        (["s.toml", "--part", "3/2"], "part is 3 of 2; it must be one from 1 to 2."),
        (["s.toml", "--part", "1/2", "--force"], "a part must not delete the rows of others."),
        (["f.toml", "--out", "o"], "no.py of a function does not exist."),
    ):
        assert main(["study", *arguments]) == 2
        said = capsys.readouterr().err
        assert said.startswith("phasmid: ")
        assert message in said
    assert Path("results/study/mine.txt").read_text() == "mine"


def damage(folder, table, kind, number):
    """Write a run's row as a part of its own, and damage it."""
    before = set((folder / "parts").iterdir())
    lost = {"lost axis": "gait", "lost metric": COST}.get(kind)
    write_rows(folder, [table.iloc[number].drop(lost or []).to_dict()])
    (part,) = set((folder / "parts").iterdir()) - before
    content = part.read_bytes()
    middle = len(content) // 2
    damaged = {
        "cut": content[:middle],
        "empty": b"",
        "flipped bit": content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :],
    }
    if kind in damaged:
        part.write_bytes(damaged[kind])
    elif kind == "too large":
        os.truncate(part, MOST_BYTES + 1)
    elif kind == "checked nonsense":
        # Its checksum is right, and Parquet's reader raises an OSError.
        nonsense = b"PAR1" + 40 * b"\xff" + (40).to_bytes(4, "little") + b"PAR1"
        name = f"{part.stem.partition('-')[0]}-{hashlib.sha256(nonsense).hexdigest()[:16]}"
        part = part.replace(part.with_stem(name))
        part.write_bytes(nonsense)
    elif not lost:
        part.unlink()
        make = {"link": lambda path: path.symlink_to(os.devnull), "pipe": os.mkfifo}
        make.get(kind, Path.mkdir)(part)
    return part.name


DAMAGES = [
    *("cut", "empty", "flipped bit", "link", "pipe", "folder"),
    *("too large", "checked nonsense", "lost axis", "lost metric"),
]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no named pipes in folders")
def test_damaged_parts_are_named_and_their_runs_are_made_again(whole, tmp_path, capsys):
    folder = tmp_path / "copy"
    shutil.copytree(whole.folder, folder)
    shutil.rmtree(folder / "parts")
    (folder / "parts").mkdir()
    write_rows(folder, [whole.table.iloc[11].to_dict()])
    names = [damage(folder, whole.table, kind, k) for k, kind in enumerate(DAMAGES)]
    with pytest.warns(DamagedPart) as caught:
        assert list(load_study(folder).table["number"]) == [11]
    assert [len(str(one.message).splitlines()) for one in caught] == [1] * len(DAMAGES)
    for name, one in zip(names, caught, strict=True):
        assert name in str(one.message)
    assert f"it has {MOST_BYTES + 1} bytes" in str(caught[DAMAGES.index("too large")].message)
    (tmp_path / "s.toml").write_text(tomlkit.dumps(GRID))
    assert main(["study", str(tmp_path / "s.toml"), "--out", str(folder), "--workers", "1"]) == 0
    printed = capsys.readouterr().err
    for name in names:
        assert f"it is now {name}.damaged, and its runs are made again." in printed
        assert os.path.lexists(folder / f"parts/{name}.damaged")
    # The warnings are errors here: nothing is read again.
    assert same(load_study(folder).table.drop(columns="run"), whole.table.drop(columns="run"))


@pytest.mark.parametrize(
    ("kind", "metric", "hint"),
    [
        ("plan", "torque.simulation.largest", '"torque.model.largest"'),
        ("simulate", "state_estimate.velocity_error", ""),
        ("drive", "torque.model.largest", '"torque.simulation.largest"'),
    ],
)
def test_a_metric_that_no_run_has_is_refused_before_the_first(tmp_path, kind, metric, hint):
    driven = {"velocity": [0.05, 0, 0]} if kind == "drive" else {}
    with pytest.raises(InvalidInput, match=f'has no number "{metric}"') as caught:
        study(GRID | {"kind": kind, "metrics": [metric]} | driven, out=tmp_path / "out")
    assert hint in caught.value.hint
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("force", [False, True])
def test_a_full_disk_leaves_nothing_of_a_study_that_does_not_begin(
    tmp_path, monkeypatch, force, whole
):
    folder = tmp_path / "study"
    if force:
        shutil.copytree(whole.folder, folder)
    before = sorted(tmp_path.rglob("*"))

    def full(descriptor):
        raise OSError(errno.ENOSPC, "No space left on device")

    other = GRID | {"axes": {"gait": ["tripod"]}}
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(OutputError, match="no space left on device") as caught:
            study(other, out=folder, force=force)
    assert "partial" not in str(caught.value)
    with monkeypatch.context() as patch:
        patch.setattr(shutil, "disk_usage", lambda _: shutil._ntuple_diskusage(1, 1, 0))
        with pytest.raises(OutputError, match="0 GB are free"):
            study(other, out=folder, force=force)
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
@pytest.mark.parametrize("name", ["SIGINT", "SIGKILL"])
def test_no_worker_outlives_its_study(tmp_path, name):
    (tmp_path / "mine.py").write_text(
        "import time\n"
        "def slow(scenario, value):\n"
        "    open('begun', 'w').close()\n"
        "    time.sleep(60)\n"
    )
    (tmp_path / "s.toml").write_text(
        'kind = "plan"\nmetrics = ["energy.cost_of_transport"]\n'
        '[axes]\nload = {values = [0, 1], function = "mine.py:slow"}\n'
    )
    command = [sys.executable, "-m", "phasmid", "study", "s.toml", "--out", "out", "--workers", "1"]
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        while not (tmp_path / "begun").exists():
            time.sleep(0.01)
            assert process.poll() is None
        process.send_signal(getattr(signal, name))
        # The workers hold the other end of the pipe until they end.
        output, _ = process.communicate(timeout=30)
        assert "Traceback" not in output
        assert process.returncode == (-signal.SIGKILL if name == "SIGKILL" else 130)
    assert [path.name for path in tmp_path.rglob("*") if path.name.startswith(".")] == []


def test_a_folder_without_rows_is_no_study(tmp_path):
    with pytest.raises(InvalidInput, match="no folder of a study"):
        load_study(tmp_path)


def test_a_sound_part_that_the_system_cannot_read_is_not_set_aside(whole, tmp_path, monkeypatch):
    """A share of the network may fail for a moment."""
    folder = tmp_path / "study"
    shutil.copytree(whole.folder, folder)

    def fail(self):
        raise OSError(errno.ESTALE, "Stale file handle")

    before = sorted(folder.rglob("*"))
    with monkeypatch.context() as share:
        share.setattr(Path, "read_bytes", fail)
        with pytest.raises(InvalidInput, match="stale file handle"):
            load_study(folder)
    assert sorted(folder.rglob("*")) == before
