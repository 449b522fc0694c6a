"""The paired comparison of passes on unknown ground: sign test, pairs, decisions, arguments."""

import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import ground
import versions

TOOLS = str(Path(__file__).parents[2] / "tools")

CELL, OTHER = ground.Cell("stairs", 60, ground.BLIND), ground.Cell("gap", 60, ground.BLIND)


def passes(seeds, **results):
    """Passes of two cells."""
    cells = {"stairs": CELL, "gap": OTHER}
    return ground.Passes(list(seeds), {cells[name]: text for name, text in results.items()})


@pytest.mark.parametrize(("won", "lost"), [(0, 0), (0, 5), (0, 6), (3, 9), (10, 3), (7, 7)])
def test_the_sign_test_is_the_exact_binomial_test(won, lost):
    """Two-sided: twice the tail of the smaller count, sum of C(n, k) / 2^n, at most 1."""
    n = won + lost
    tail = sum(math.comb(n, k) for k in range(min(won, lost) + 1)) / 2**n
    # Sums of at most 15 binomial coefficients: rounding only.
    assert ground.sign_test(won, lost) == pytest.approx(min(1.0, 2 * tail), rel=1e-12)


def test_the_smallest_loss_is_the_first_that_the_test_shows():
    """2 / 2^6 = 0.031 < 0.05 < 2 / 2^5; five pairs show nothing."""
    assert ground.smallest_loss(0, 100) == 6
    assert ground.smallest_loss(0, 5) is None
    least = ground.smallest_loss(4, 100)
    assert ground.sign_test(4, least) < 0.05 <= ground.sign_test(4, least - 1)


@pytest.mark.parametrize(
    ("theirs", "verdict", "worse"),
    [("++++++++", "worse", True), ("+l+l+l+l", "no difference", False)],
)
def test_the_verdict_follows_the_discordant_pairs(theirs, verdict, worse):
    """Six of six discordant pairs lost: p = 2 / 2^6; two lost and two won: p = 1."""
    ours = "ffffff++" if worse else "++llll++"
    rows = ground.compare(passes(range(8), stairs=ours), passes(range(8), stairs=theirs))
    text, found = ground.report(rows, same_grounds=True)
    assert found is worse
    assert f"Verdict: {verdict}" in text


def test_runs_of_equal_seeds_make_pairs_and_others_in_order():
    """Seeds 2 and 3 are common: their places are 2, 3 and 1, 0."""
    assert ground.seed_pairs([0, 1, 2, 3], [3, 2, 7]) == [(2, 1), (3, 0)]
    assert ground.seed_pairs([0, 1, 2], [10, 11]) == [(0, 0), (1, 1)]


def test_each_pair_counts_once():
    """Of six seeds both refuse one, and theirs passes one that ours refuses: that is lost."""
    ours = passes(range(6), stairs="++fl--", gap="++++++")
    theirs = passes(range(6), stairs="+a+l-+")
    row = ground.Row(CELL, pairs=5, ours=2, theirs=3, won=1, lost=2)
    assert ground.compare(ours, theirs) == [row]


def test_passes_are_read_as_written(tmp_path):
    kept = passes([3, 5], stairs="+f", gap="l-")
    ground.save(kept, tmp_path / "passes.json")
    assert ground.load(tmp_path / "passes.json") == kept


def test_the_stored_passes_are_those_of_the_quick_form():
    stored = ground.load(Path(TOOLS) / "ground_passes.json")
    assert set(ground.QUICK) <= set(stored.results)
    assert set(ground.QUICK) <= set(ground.CELLS)


def recording(x, y, tilt_deg, interval=0.02):
    """Recording of a body at places [m] with a roll [deg]."""
    count, half = len(x), np.radians(np.broadcast_to(tilt_deg, len(x))) / 2
    zero = np.zeros(count)
    return xr.Dataset(
        {
            "body_position": (("time", "axis"), np.stack([x, y + zero, zero], axis=1)),
            "body_orientation": (
                ("time", "quaternion"),
                np.stack([np.cos(half), np.sin(half), zero, zero], axis=1),
            ),
        },
        {"time": np.arange(count) * interval},
    )


CLOCK = np.arange(1001) * 0.02
TASK = ground.Task(distance=0.6, limit=20.0, tilt=math.radians(35))


@pytest.mark.parametrize(
    ("x", "y", "tilt", "why", "time"),
    [
        (0.06 * CLOCK, 0 * CLOCK, 0.0, "", 10.0),
        (0.06 * CLOCK, 0.021 * CLOCK, 0.0, "astray", 9.6),
        (0.06 * CLOCK, 0 * CLOCK, np.where(CLOCK > 4.95, 36.0, 34.0), "fell", 5.0),
        # 0.6 - 0.02 t > 0.072 (20 - t) from t = 0.84 / 0.052 = 16.15 s.
        (0.02 * CLOCK, 0 * CLOCK, 0.0, "late", 16.2),
    ],
)
def test_a_walk_is_decided_at_the_first_check_that_shows_its_result(x, y, tilt, why, time):
    """Checks are at multiples of 0.1 s; the rest of the run does not count."""
    found = ground.decide(recording(x, y, tilt), TASK)
    assert (found.why, found.time) == (why, pytest.approx(time))
    until = round(time / 0.02) + 1
    assert ground.decide(recording(x, y, tilt).isel(time=slice(until)), TASK) == found


def test_a_run_that_ends_undecided_fell():
    """drive ends a run early where the trunk meets the ground."""
    assert ground.decide(recording(0.06 * CLOCK[:200], 0.0, 0.0), TASK).why == "fell"
    assert ground.decide(recording(CLOCK[:1], 0.0, 0.0), TASK).why == "fell"


def test_a_run_is_decided_as_if_it_had_ended_then():
    """A shorter duration changes nothing before its end: the same result, at the same time."""
    scenario = ground.scenario_of("gap", 30, 1)
    task, robot = ground.task_of("gap", 30), scenario.load_robot()
    whole, _ = ground.walk(scenario, ground.engine_of(robot, "gap", ground.BLIND), task)
    short = scenario.replace(duration=round(whole.time, 1))
    assert ground.walk(short, ground.engine_of(robot, "gap", ground.BLIND), task)[0] == whole


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--seeds", "9-0"], "names no seed"),
        (["--seeds", "x"], "names no seeds"),
        (["--grounds", "stairs,lava"], "not lava"),
        (["--modes", "blind"], "invalid choice"),
        (["--quick", "--grounds", "course"], "no cell"),
        (["--step-height-ratio", "-1"], "greater than 0"),
        (["--processes", "0"], "whole number from 1"),
        (["--against", "no-such-commit"], "no file and no commit"),
        (["--against", "FILE"], "holds no passes"),
        (["--write", "FILE/passes.json"], "passes.json"),
    ],
)
def test_bad_arguments_get_one_sentence(arguments, sentence, tmp_path, capsys):
    """One line, exit status 2."""
    file = tmp_path / "passes.json"
    file.write_text("[]")
    try:
        status = ground.main([each.replace("FILE", str(file)) for each in arguments])
    except SystemExit as end:
        status = end.code
    printed = capsys.readouterr()
    assert (status, printed.out) == (2, "")
    assert sentence in printed.err
    assert printed.err.count("\n") == 1


@pytest.mark.parametrize(("letters", "status"), [("+" * 10, 0), ("f" * 10, 1)])
def test_the_exit_status_shows_a_loss(letters, status, tmp_path, capsys, monkeypatch):
    """Ten of ten pairs lost: p = 2 / 2^10."""
    file = tmp_path / "passes.json"
    ground.save(passes(range(10), stairs="+" * 10), file)
    monkeypatch.setattr(ground, "measure_all", lambda *_: passes(range(10), stairs=letters))
    assert ground.main(["--against", str(file), "--modes", ground.BLIND]) == status
    assert ("worse (p = 0.002)" in capsys.readouterr().out) == bool(status)


def test_other_seeds_are_said_not_to_be_the_same_ground(tmp_path, capsys, monkeypatch):
    file = tmp_path / "passes.json"
    ground.save(passes(range(10, 20), stairs="+" * 10), file)
    monkeypatch.setattr(ground, "measure_all", lambda *_: passes(range(10), stairs="+" * 10))
    assert ground.main(["--against", str(file)]) == 0
    assert "not on the same ground" in capsys.readouterr().out


def test_only_the_sources_of_a_checkout_are_measured(tmp_path):
    """The interpreter imports phasmid from elsewhere than an empty folder."""
    with pytest.raises(ground.UserError, match="does not import phasmid from"):
        ground.check_source(sys.executable, tmp_path, {})


@pytest.mark.skipif(os.name == "nt", reason="needs make and a shell")
def test_a_commit_with_other_dependencies_gets_an_environment_of_its_own(tmp_path, monkeypatch):
    """Its own make target makes the interpreter, here a shell script that copies known passes."""
    kept, python = passes([0, 1], stairs="+f"), tmp_path / ".venv/bin/python"
    ground.save(kept, tmp_path / "passes.json")
    (tmp_path / "pyproject.toml").write_text('[project]\ndependencies = ["numpy<1"]\n')
    (tmp_path / "Makefile").write_text(
        f".venv/.develop:\n\tmkdir -p .venv/bin\n\tcp stub {python}\n"
    )
    (tmp_path / "stub").write_text(
        "#!/bin/sh\n"
        f'if [ "$1" = -c ]; then echo {tmp_path}/src/phasmid/__init__.py; exit; fi\n'
        f'for file; do :; done; cp {tmp_path}/passes.json "$file"\n'
    )
    (tmp_path / "stub").chmod(0o755)
    monkeypatch.setattr(versions, "worktree_of", lambda commit: tmp_path)
    assert ground.passes_of("commit", ["--quick"]) == kept


@pytest.mark.slow
def test_a_run_is_made_by_the_program(tmp_path):
    """One ground and seed, in a process of their own: the result is that of `measure`."""
    file, cell = tmp_path / "passes.json", ground.Cell("gap", 30, "dynamics")
    command = [sys.executable, f"{TOOLS}/ground.py", "--quick", "--grounds", "gap"]
    done = subprocess.run(
        [*command, "--seeds", "0", "--processes", "1", "--write", str(file)],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "gap 30 mm" in done.stdout
    assert ground.load(file).results == {cell: ground.LETTERS[ground.measure(cell, 0).why]}
