"""Studies: begin, go on after an interruption, and return their rows."""

from __future__ import annotations

import secrets
import shutil
from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from phasmid.arguments import checked
from phasmid.cores import cores
from phasmid.errors import InvalidInput, OutputError, plain
from phasmid.extras import install_hint
from phasmid.interrupts import held_signals
from phasmid.recording import Recording
from phasmid.recording.file import cannot_write, check_place, write_whole
from phasmid.recording.provenance import versions
from phasmid.reporting.summary import check_number
from phasmid.scenario import load_scenario
from phasmid.studies.definition import Study, load_study_file
from phasmid.studies.executor import Executor, LocalExecutor
from phasmid.studies.results import (
    DEFINITION,
    PAGE,
    PARTS,
    RECORDINGS,
    StudyResults,
    load_study,
    read_definition,
    read_rows,
    write_definition,
)
from phasmid.studies.runs import Row, Run, Runner, fingerprint, load_function, numbered
from phasmid.studies.search import search
from phasmid.studies.webpage import study_page
from phasmid.toml import toml_value

Progress = Callable[[int, int, int], None]
"""Receives the numbers of runs done, of all runs, and of failures."""

ROOM = 10e6
"""Room for the rows and the page of a study, about ten times those of 1,000 runs [bytes]."""


@checked
def study(
    source: str | Path | Mapping[str, Any],
    *,
    out: str | Path | None = None,
    workers: int | None = None,
    retry_failed: bool = False,
    max_failures: int | None = None,
    ray: str | None = None,
    part: tuple[int, int] | None = None,
    force: bool = False,
    progress: Progress | None = None,
) -> StudyResults:
    """Make the runs of a study that its folder lacks, and return its rows.

    Rows are written as they are made. An interrupted or killed study loses only the runs under way;
    calling this again goes on.

    Args:
        source: A ``study.toml`` file, or its content as a mapping.
        out: Folder of the study; None: ``results/NAME``.
        workers: Number of processes, or of tasks under way on Ray; None: one per core.
        retry_failed: Make failed runs again.
        max_failures: Number of failed runs after which the study stops; None: it never does.
        ray: Address of a Ray cluster, or ``local``; None: processes of this machine.
        part: Part k of n to be made, from 1, of a study that several machines make in one folder;
            None: all runs.
        force: Replace the folder of another study.
        progress: Receives the progress.

    Returns:
        The rows of all runs; of a part, those that exist by now.

    Raises:
        InvalidInput: The study or the part is not well formed, a metric is no number of a summary,
            or the folder holds another study.
        OutputError: The folder cannot be written, or too many runs failed.

    Warns:
        DamagedPart: A part was damaged; its runs are made again.
    """
    table, files = load_study_file(source)
    folder = _folder(out, table)
    _check_extra("study", "loky", "pyarrow")
    if table.search is not None:
        _check_extra("search", "optuna", "cmaes")
    if workers is not None and workers < 1:
        raise InvalidInput(f"workers is {workers}; it must be 1 or more.")
    if part is not None:
        _check_part(part, table, force=force)
    for metric in table.metrics:
        if not metric.function:
            check_number(metric.name, table.kind)
    runner = _runner(table, files, folder)
    parts = fingerprint(runner)
    _prepare(folder, table, parts, force=force)
    total, done = table.count(), 0
    errors: list[str] = []

    def report(rows: Sequence[Row]) -> bool:
        nonlocal done
        done += len(rows)
        errors.extend(str(row["error"]) for row in rows if row["status"] == "failed")
        if progress:
            progress(done, total, len(errors))
        return max_failures is None or len(errors) <= max_failures

    def make(runs: list[Run]) -> bool:
        nonlocal done
        rows = read_rows(folder, table, set_aside=True)
        known = rows[rows["status"] != "failed"] if retry_failed else rows
        made = set(known["run"])
        missing = [run for run in runs if run.id not in made]
        done += len(runs) - len(missing)
        report([])
        if missing:
            executor.make(missing)
        return executor.going

    executor: Executor
    count = min(workers or cores(), total)
    if ray is None:
        executor = LocalExecutor(runner, folder.resolve(), count, report)
    else:
        _check_extra("ray", "ray")
        from phasmid.studies.ray_executor import RayExecutor

        executor = RayExecutor(runner, folder.resolve(), workers or cores(), report, ray)
    with executor:
        if table.search is None:
            runs = numbered(parts, table.points())
            if part is not None:
                runs = runs[part[0] - 1 :: part[1]]
                total = len(runs)
            make(runs)
        else:
            search(table, parts, folder, make)
            if table.keep == "pareto" and executor.going:
                runs = _unrecorded(load_study(folder), runner)
                total += len(runs)
                executor.make(runs)
    place = "" if out is None else f" --out {out}"
    if max_failures is not None and len(errors) > max_failures:
        raise OutputError(
            f"{len(errors)} runs failed, more than {max_failures}; {done} of {total} are done. "
            f"The first: {errors[0]}",
            hint=f"phasmid study {source} --retry failed{place}"
            if isinstance(source, str | Path)
            else "",
        )
    results = load_study(folder)
    if len(results.table) < table.count():
        # Other machines make the rest.
        return results
    file = "study.toml" if isinstance(source, Mapping) else str(source)
    page = study_page(results, f"phasmid study {plain(file)}{plain(place)}")
    write_whole(folder / PAGE, page.encode())
    return results


def repeat_run(
    source: str | Path | Mapping[str, Any], number: int, *, out: str | Path | None = None
) -> tuple[Recording, list[str]]:
    """Make one run of a study again.

    Args:
        source: As in `study`.
        number: Number of the run in the study.
        out: Folder of the study; None: ``results/NAME``.

    Returns:
        The recording, and the metrics that differ from those of the run's row.

    Raises:
        InvalidInput: The study has changed since, or there is no such row.
        PhasmidError: The run cannot be made.
    """
    table, files = load_study_file(source)
    folder = _folder(out, table)
    runner = _runner(table, files, folder)
    changed = _changes(read_definition(folder)["parts"], fingerprint(runner))
    if changed:
        raise InvalidInput(f"the study has changed since: {', '.join(changed[:4])}.")
    rows = read_rows(folder, table)
    rows = rows[rows["number"] == number]
    if rows.empty:
        raise InvalidInput(f"{folder} has no run {number}.", hint="a number of its table")
    row = rows.iloc[0].to_dict()
    recording = runner.record(runner.point(row))
    metrics = runner.metrics(recording)
    return recording, [name for name, value in metrics.items() if value != row[name]]


def _check_part(part: tuple[int, int], table: Study, *, force: bool) -> None:
    """Refuse a part that cannot be made.

    Raises:
        InvalidInput: With the reason.
    """
    if not 1 <= part[0] <= part[1]:
        raise InvalidInput(f"part is {part[0]} of {part[1]}; it must be one from 1 to {part[1]}.")
    if table.search is not None:
        raise InvalidInput("a search has no parts: each batch depends on those before.")
    if force:
        raise InvalidInput("a part must not delete the rows of others.", hint="without --force")


def _unrecorded(results: StudyResults, runner: Runner) -> list[Run]:
    """Return the runs of the best points whose recordings do not exist, to be kept."""
    rows = results.table.set_index("number").loc[results.best_numbers]
    return [
        Run(int(number), row["run"], runner.point(row.to_dict()), is_kept=True)
        for number, row in rows.iterrows()
        if not row["recording"]
    ]


def _folder(out: str | Path | None, table: Study) -> Path:
    return Path(out) if out is not None else Path("results") / table.name


def _runner(table: Study, files: Path, folder: Path) -> Runner:
    scenario = load_scenario(_place(table.scenario, files))
    functions = [axis.function for axis in table.axes.values()]
    functions += [metric.function for metric in table.metrics]
    for function in filter(None, functions):
        load_function(function, files)
    # Workers may have other working folders.
    kept = folder.resolve() / RECORDINGS
    return Runner(table, scenario, files.resolve(), kept, versions())


def _prepare(folder: Path, table: Study, parts: Mapping[str, str], *, force: bool) -> None:
    """Make the folder of a study, or check that it holds this one."""
    try:
        exists = folder.exists() and any(folder.iterdir())
    except OSError as error:
        raise cannot_write(folder, error) from None
    # Rows go into its folder of parts.
    for path in (folder, folder / PARTS / PAGE):
        check_place(path, room=ROOM)
    if exists:
        elsewhere = toml_value(f"{folder}-2")
        is_study = (folder / DEFINITION).exists()
        if not is_study:
            raise InvalidInput(
                f"{folder} exists and is no folder of a study; nothing was written.",
                hint=f"out = {elsewhere}",
            )
        changed = _changes(read_definition(folder)["parts"], parts)
        if not changed:
            return
        if not force:
            listed = ", ".join(changed[:4]) + (", ..." if len(changed) > 4 else "")
            raise InvalidInput(
                f"{folder} holds another study of this name; changed since: {listed}.",
                hint=f"out = {elsewhere}, or force = true, which deletes its rows",
            )
    # Other machines may begin a part of this study now: the folder appears whole.
    new = folder.with_name(f".{folder.name}.{secrets.token_hex(4)}.partial")
    with held_signals():
        try:
            (new / PARTS).mkdir(parents=True)
            write_definition(new, table, parts)
            if exists:
                shutil.rmtree(folder)
            new.replace(folder)
        except OSError as error:
            if force or not (folder / DEFINITION).exists():
                raise cannot_write(folder, error) from None
            _prepare(folder, table, parts, force=False)
        except OutputError as error:
            error.what = error.what.replace(str(new), str(folder))
            raise
        finally:
            # Renamed to its place unless something failed.
            shutil.rmtree(new, ignore_errors=True)


def _changes(before: Mapping[str, str], now: Mapping[str, str]) -> list[str]:
    return sorted(name for name in {*before, *now} if before.get(name) != now.get(name))


def _place(scenario: str, files: Path) -> str:
    return str(files / scenario) if Path(scenario).suffix == ".toml" else scenario


def _check_extra(extra: str, *packages: str) -> None:
    missing = [name for name in packages if find_spec(name) is None]
    if missing:
        raise InvalidInput(
            f"this study needs the extra {extra}; not installed: {', '.join(missing)}.",
            hint=install_hint(extra),
        )
