"""One run of a study: from the values of its axes to a row of numbers."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd

from phasmid.control import CommandScript, EngineSettings, load_script
from phasmid.errors import InfeasibleWalk, InvalidInput, PhasmidError, nearest
from phasmid.experiment import Command
from phasmid.forces import analyse
from phasmid.formats import is_foreign, load_robot
from phasmid.motion import plan
from phasmid.recording import Recording, save_recording
from phasmid.reporting import summarise
from phasmid.robot import robot_to_toml
from phasmid.scenario import Scenario
from phasmid.scenario.file import scenario_to_toml
from phasmid.simulation import new_drive, new_run
from phasmid.simulation.drive import scenario_controller
from phasmid.studies.definition import Point, Study
from phasmid.tables import dotted

Row = dict[str, Any]
"""Values of the axes, seed, metrics, ending, error, wall time and versions of a run."""


@dataclass(frozen=True)
class Run:
    """A run of a study.

    Attributes:
        number: Its number in the study, from 0.
        id: Hash of study and values.
        point: Values by axis.
        is_kept: Whether its recording is kept, whatever the study's rule.
    """

    number: int
    id: str
    point: Point
    is_kept: bool = False


@dataclass(frozen=True, eq=False)
class Runner:
    """Makes the runs of a study; workers receive it once.

    Attributes:
        study: The study.
        scenario: Its base scenario.
        folder: Folder to which file names of the study are relative.
        recordings: Folder of the recordings that are kept.
        versions: Versions by package, a part of every row.
    """

    study: Study
    scenario: Scenario
    folder: Path
    recordings: Path
    versions: Mapping[str, str]

    def row(self, run: Run) -> Row:
        """Make a run; one that fails has its error in the row."""
        begin, row = time.perf_counter(), self._begun(run)
        try:
            recording = self.record(run.point)
            row["ending"] = str(recording.attrs.get("ending", ""))
            row["ending_reason"] = str(recording.attrs.get("ending_reason", ""))
            row |= self.metrics(recording)
            if run.is_kept or self.keeps(row):
                path = self.recordings / f"{run.id}.nc"
                self.recordings.mkdir(exist_ok=True)
                save_recording(recording, path)
                row["recording"] = path.name
        except InfeasibleWalk as error:
            # Without its remedy, which may take as long to find as a run.
            row |= {"status": "failed", "error": error.what}
        except PhasmidError as error:
            row |= {"status": "failed", "error": " ".join(str(error).split())}
        except Exception as error:
            # A function of the user may raise anything.
            row |= {"status": "failed", "error": f"{type(error).__name__}: {error}"}
        return row | {"wall_time_s": time.perf_counter() - begin}

    def remove_partials(self, runs: Sequence[Run]) -> None:
        """Remove what a killed study or worker left of the recordings of runs."""
        names = {f".{run.id}.nc" for run in runs}
        for path in self.recordings.glob(".*.nc.*.partial"):
            if path.name.partition(".nc.")[0] + ".nc" in names:
                path.unlink(missing_ok=True)

    def point(self, row: Row) -> Point:
        """Return the values of a row's run."""
        found: Point = {"seed": int(row["seed"])} if self.study.seeds else {}
        for key, axis in self.study.axes.items():
            known = {_cell(value): value for value in axis.values or []}
            is_whole = axis.whole and axis.values is None
            found[key] = round(float(row[key])) if is_whole else known.get(row[key], row[key])
        return found

    def failed(self, run: Run, error: str) -> Row:
        """Return the row of a run that was never completed."""
        return self._begun(run) | {"status": "failed", "error": error}

    def _begun(self, run: Run) -> Row:
        return {
            "number": run.number,
            "run": run.id,
            **{key: _cell(value) for key, value in run.point.items()},
            **dict.fromkeys((metric.name for metric in self.study.metrics), math.nan),
            "status": "done",
            **dict.fromkeys(("ending", "ending_reason", "error", "recording"), ""),
            "wall_time_s": 0.0,
            **self.versions,
        }

    def record(self, point: Point) -> Recording:
        """Make the run of some values and return its recording.

        Raises:
            PhasmidError: The values are refused, or the run cannot begin.
        """
        scenario, settings = self.build(point)
        if self.study.kind == "plan":
            return analyse(scenario, plan(scenario))
        if self.study.kind == "simulate":
            return new_run(scenario, plan(scenario)).simulate()
        rate = self.study.rate
        controller = scenario_controller(scenario, rate, **settings) if settings else None
        run = new_drive(scenario, controller, self.commands(), rate=rate)
        return run.simulate()

    def commands(self) -> Command | CommandScript:
        """Return the commands of a driven run."""
        if self.study.velocity is not None:
            return Command(velocity=self.study.velocity)
        return load_script(self.folder / self.study.commands)

    def build(self, point: Point) -> tuple[Scenario, dict[str, Any]]:
        """Return scenario and engine settings of some values.

        Raises:
            InvalidInput: A value is refused.
        """
        values = {**self.study.set, **{k: v for k, v in point.items() if k != "seed"}}
        axes = self.study.axes
        functions = {key: axes[key].function for key in axes if axes[key].function}
        own = {key: value for key, value in values.items() if key not in functions}
        changes = {key: v for key, v in own.items() if not key.startswith("engine.")}
        if "robot" in changes:
            changes["robot"] = load_robot(self._place(changes["robot"]))
        if "seed" in point:
            changes |= {"terrain_seed": point["seed"], "sensor_seed": point["seed"]}
        scenario = self.scenario.changed(changes, lambda loc: (dotted(loc), ""))
        for key, place in functions.items():
            scenario = load_function(place, self.folder)(scenario, values[key])
        settings: dict[str, Any] = {}
        for key, value in own.items():
            if key.startswith("engine."):
                name, _, inner = key.removeprefix("engine.").partition(".")
                base = settings.get(name) or getattr(EngineSettings(), name)
                settings[name] = replace(base, **{inner: value}) if inner else value
        return scenario, settings

    def metrics(self, recording: Recording) -> dict[str, float]:
        """Return the metrics of a recording.

        Raises:
            InvalidInput: One is absent, no number, or not finite.
        """
        summary = summarise(recording)
        found = {}
        for metric in self.study.metrics:
            if metric.function:
                value = load_function(metric.function, self.folder)(recording)
            else:
                value = _summary_value(summary, metric.name)
            try:
                found[metric.name] = float(value)
            except (TypeError, ValueError):
                raise InvalidInput(
                    f'the metric "{metric.name}" is {type(value).__name__}; it must be a number.',
                    hint='{ name = "mine", function = "file.py:name" }',
                ) from None
            if not math.isfinite(found[metric.name]):
                raise InvalidInput(f'the metric "{metric.name}" is {found[metric.name]}.')
        return found

    def keeps(self, row: Row) -> bool:
        """Return whether the recording of a row is kept."""
        keep = self.study.keep
        if keep in ("none", "all", "pareto"):
            return keep == "all"
        if keep == "fell":
            return bool(row["ending"] == "FELL")
        return bool(self.study.excess(keep, row) < 0)

    def _place(self, robot: Any) -> Any:
        """Return a robot's file relative to the study's, or the name of a preset."""
        if isinstance(robot, str) and (Path(robot).suffix == ".toml" or is_foreign(robot)):
            return str(self.folder / robot)
        return robot


def _summary_value(summary: Mapping[str, Any], name: str) -> Any:
    """Return a number of a summary by its place, such as ``energy.cost_of_transport``.

    Raises:
        InvalidInput: It is absent; with the nearest one.
    """
    value: Any = summary
    for part in name.split("."):
        value = value.get(part) if isinstance(value, Mapping) else None
    if value is None:
        guess = nearest(name, pd.json_normalize(dict(summary)).columns)
        raise InvalidInput(
            f'the run has no metric "{name}".', hint=f'"{guess}"' if guess else "summary.json"
        )
    return value


@cache
def load_function(place: str, folder: Path) -> Callable[..., Any]:
    """Return a function of a Python file.

    Args:
        place: ``file.py:name``.
        folder: Folder to which the file is relative.

    Raises:
        InvalidInput: There is no such file or function.
    """
    file, _, name = place.partition(":")
    path = folder / file
    if not path.is_file():
        raise InvalidInput(f"the file {path} of a function does not exist.")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    function = getattr(module, name, None)
    if not callable(function):
        raise InvalidInput(f'{path} has no function "{name}".')
    return function


def fingerprint(runner: Runner) -> dict[str, str]:
    """Return all that determines the rows of a study, as texts by name.

    Files that the study names count by their content.
    """
    study, scenario, folder = runner.study, runner.scenario, runner.folder
    parts = {
        name: json.dumps(value, sort_keys=True, default=str)
        for name, value in study.model_dump(
            exclude={"name", "description", "keep"}, exclude_defaults=True
        ).items()
        if name not in ("axes", "set")
    }
    for key, axis in study.axes.items():
        parts[f"axes.{key}"] = axis.model_dump_json()
    for key, value in study.set.items():
        parts[f"set.{key}"] = json.dumps(value, default=str)
    parts["base scenario"] = scenario_to_toml(scenario, "robot.toml")
    parts["base robot"] = robot_to_toml(scenario.base_robot())
    parts |= runner.versions
    places = [study.commands, *(axis.function for axis in study.axes.values())]
    places += [metric.function for metric in study.metrics]
    values = [*study.set.values()]
    for axis in study.axes.values():
        values += axis.values or []
    for name in {str(place).partition(":")[0] for place in [*places, *values]}:
        path = folder / name
        try:
            content = path.read_bytes() if name and path.is_file() else None
        except (OSError, ValueError):
            content = None
        if content is not None:
            parts[f"file {name}"] = hashlib.sha256(content).hexdigest()
    return parts


def numbered(parts: Mapping[str, str], points: Iterable[Point], first: int = 0) -> list[Run]:
    """Return runs with their numbers and hashes.

    Args:
        parts: Fingerprint of the study.
        points: Values of the runs.
        first: Number of the first of them.
    """
    whole = hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()
    found = []
    for number, point in enumerate(points, first):
        text = f"{whole} {number} {json.dumps(point, sort_keys=True, default=str)}"
        found.append(Run(number, hashlib.sha256(text.encode()).hexdigest()[:16], point))
    return found


def _cell(value: Any) -> Any:
    """Return a value of an axis as a cell of a table."""
    if isinstance(value, bool | str) or value is None:
        return str(value)
    return value if isinstance(value, int | float) else json.dumps(value)
