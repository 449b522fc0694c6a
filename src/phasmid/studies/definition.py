"""Definition of a study: base scenario, axes, sampler, seeds and metrics."""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from annotated_types import Ge, Gt, Le, Len
from pydantic import BeforeValidator, StringConstraints, model_validator

from phasmid.control import EngineSettings
from phasmid.errors import InvalidInput, located, nearest
from phasmid.scenario import option_keys
from phasmid.tables import Count, Hint, Number, Table, dotted, in_file, validate
from phasmid.toml import read_toml
from phasmid.units import split_unit

MOST_RUNS = 10_000_000
"""Most runs of a study."""

Point = dict[str, Any]
"""Values of one run by axis, and its ``seed`` where the study has seeds."""


def _as_axis(raw: Any) -> Any:
    return {"values": raw} if isinstance(raw, list) else raw


def _as_seeds(raw: Any) -> Any:
    return list(range(raw)) if isinstance(raw, int) and not isinstance(raw, bool) else raw


def _as_metric(raw: Any) -> Any:
    return {"name": raw} if isinstance(raw, str) else raw


class Axis(Table):
    """One varied quantity: a list of values, or a range.

    Attributes:
        values: The values, numbers or texts, in the unit of the axis's key.
        low: Lower end of a range.
        high: Upper end of a range.
        count: Number of values of a range on a grid.
        log: Whether the range is divided logarithmically.
        whole: Whether only whole numbers are used.
        function: ``file.py:name`` of a function of scenario and value that returns a scenario; for
            quantities that no key names.
    """

    values: list[Any] | None = None
    low: Number | None = None
    high: Number | None = None
    count: Annotated[Count, Ge(1), Le(MOST_RUNS)] | None = None
    log: bool = False
    whole: bool = False
    function: str = ""

    @model_validator(mode="after")
    def _check(self) -> Axis:
        is_range = self.low is not None and self.high is not None
        if (self.values is None) != is_range or (self.values is not None and self.low is not None):
            raise InvalidInput("an axis must have values, or low and high.")
        if self.values == []:
            raise InvalidInput("an axis has no value; it must have at least one.")
        if self.low is not None and self.high is not None:
            if not self.low < self.high:
                raise InvalidInput(f"low is {self.low:g}; it must be below high, {self.high:g}.")
            if self.log and self.low <= 0:
                raise InvalidInput(f"low is {self.low:g}; with log it must be greater than 0.")
        return self

    def grid(self) -> list[Any]:
        """Return the values on a grid."""
        if self.values is not None:
            return self.values
        spaced = np.geomspace if self.log else np.linspace
        found = spaced(*self.ends(), self.count or 1).tolist()
        return [round(value) for value in found] if self.whole else found

    def at(self, share: float) -> Any:
        """Return the value at a share of the axis, 0 to below 1."""
        if self.values is not None:
            return self.values[int(share * len(self.values))]
        low, high = self.ends()
        if self.whole:
            return math.floor(low + share * (high + 1 - low))
        return low * (high / low) ** share if self.log else low + share * (high - low)

    def ends(self) -> tuple[float, float]:
        """Return the ends of a range."""
        assert self.low is not None
        assert self.high is not None
        return self.low, self.high


class Metric(Table):
    """A number of each run.

    Attributes:
        name: Its place in the summary, such as ``energy.cost_of_transport``, or its own name where
            a function computes it.
        function: ``file.py:name`` of a function of the Recording; empty: from the summary.
    """

    name: Annotated[str, StringConstraints(min_length=1)]
    function: str = ""


class Search(Table):
    """``[search]``: points chosen by an optimiser, in place of a sampler.

    Attributes:
        algorithm: ``nsga2`` for several objectives, ``tpe`` for one or several, ``cma-es`` for one
            objective and ranges only.
        budget: Number of points.
        batch: Points that are chosen together: the population of ``nsga2``.
        minimise: Metrics to be small.
        maximise: Metrics to be large.
        constraints: Rules on metrics, such as ``torque.simulation.largest < 1.2``.
        seed: Seed of the optimiser.
    """

    algorithm: Literal["nsga2", "tpe", "cma-es"] = "nsga2"
    budget: Annotated[Count, Ge(1), Le(MOST_RUNS)]
    batch: Annotated[Count, Ge(1), Le(10_000)] = 40
    minimise: list[str] = []
    maximise: list[str] = []
    constraints: list[str] = []
    seed: Annotated[Count, Ge(0)] = 0

    @property
    def objectives(self) -> list[str]:
        """Metrics to be small or large."""
        return [*self.minimise, *self.maximise]


class Study(Table):
    """A study.

    Attributes:
        name: Short name, also of its result folder.
        description: Purpose of the study.
        scenario: Base scenario: a preset or a file.
        kind: ``plan``: the planned walk and its inverse dynamics; ``simulate``: the planned walk in
            the physics engine; ``drive``: the locomotion engine in closed loop.
        velocity: Velocity command of driven runs: forward, left [m/s], yaw rate [rad/s].
        commands: File of commands of driven runs, in place of a velocity.
        rate: Updates of the controller per second [1/s].
        set: Values of all runs, by the keys of axes.
        axes: Varied quantities by key: a key of a scenario, such as ``step_length_mm``; of the
            robot's table, such as ``robot.body.mass_g`` or ``robot.legs.*.tibia_mm``; of the
            engine's settings, such as ``engine.step_height``; or a free name with a function.
        sampler: Choice of the points.
        runs: Number of points, of other samplers than the grid.
        sampler_seed: Seed of these samplers.
        search: Optimiser that chooses the points, in place of a sampler.
        seeds: Seeds of terrain and sensors; each point is run with each of them. A number n stands
            for 0 to n - 1.
        metrics: Numbers of each run.
        keep: Recordings that are kept: ``none``, ``all``, ``fell``, ``pareto`` (the best points of
            a search), or a rule on a metric, such as ``energy.cost_of_transport < 2``.
    """

    name: Annotated[
        str,
        StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$"),
        Hint('name = "walk", of letters, digits, and . _ - between them, 64 at most'),
    ] = "study"
    description: str = ""
    scenario: str = "paper"
    kind: Literal["plan", "simulate", "drive"] = "simulate"
    velocity: tuple[Number, Number, Number] | None = None
    commands: str = ""
    rate: Annotated[Number, Gt(0)] = 200.0
    set: dict[str, Any] = {}
    axes: dict[str, Annotated[Axis, BeforeValidator(_as_axis)]] = {}
    sampler: Literal["grid", "random", "latin-hypercube", "sobol"] = "grid"
    runs: Annotated[Count, Ge(1), Le(MOST_RUNS)] | None = None
    sampler_seed: Annotated[Count, Ge(0)] = 0
    search: Search | None = None
    seeds: Annotated[list[Annotated[Count, Ge(0)]], BeforeValidator(_as_seeds)] = []
    metrics: Annotated[list[Annotated[Metric, BeforeValidator(_as_metric)]], Len(1)]
    keep: str = "none"

    @model_validator(mode="after")
    def _check(self) -> Study:
        if not self.axes and not self.seeds:
            raise InvalidInput(
                "a study must have an axis or seeds.", hint='[axes] gait = ["tripod", "wave"]'
            )
        for key in (*self.axes, *self.set):
            axis = self.axes.get(key)
            if key in self.axes and key in self.set:
                raise InvalidInput(f'"{key}" is in [axes] and in [set]; one must go.')
            if axis is None or not axis.function:
                check_key(key)
        if self.search is not None:
            self._check_search(self.search)
        elif self.sampler == "grid":
            for key, axis in self.axes.items():
                if axis.values is None and axis.count is None:
                    raise InvalidInput(f"axes.{key} has no count, which a grid needs.")
        elif self.runs is None:
            raise InvalidInput(f"runs is missing; the sampler {self.sampler} needs it.")
        elif not self.axes:
            raise InvalidInput(f"the sampler {self.sampler} needs an axis.")
        if self.kind == "drive":
            if (self.velocity is None) == (not self.commands):
                raise InvalidInput(
                    "driven runs must have a velocity or commands.", hint="velocity = [0.05, 0, 0]"
                )
        elif self.velocity is not None or self.commands:
            raise InvalidInput("velocity and commands are for driven runs.", hint='kind = "drive"')
        elif any(key.startswith("engine.") for key in (*self.axes, *self.set)):
            raise InvalidInput("engine settings are for driven runs.", hint='kind = "drive"')
        names = [metric.name for metric in self.metrics]
        if len(set(names)) < len(names):
            raise InvalidInput("a metric is named twice.")
        if self.keep == "pareto" and self.search is None:
            raise InvalidInput(
                'keep is "pareto", which needs the objectives of [search].', hint='keep = "all"'
            )
        if self.keep not in ("none", "all", "fell", "pareto"):
            self.rule("keep", self.keep)
        return self

    def _check_search(self, search: Search) -> None:
        if self.sampler != "grid" or self.runs is not None:
            raise InvalidInput("a study has a sampler or [search]; one must go.")
        names = [metric.name for metric in self.metrics]
        if not search.objectives:
            raise InvalidInput(
                "[search] has no objective.", hint=f'minimise = ["{names[0]}"] in [search]'
            )
        for name in search.objectives:
            if name not in names:
                guess = nearest(name, names)
                raise InvalidInput(
                    f'the objective "{name}" is none of the metrics.',
                    hint=f'"{guess}"' if guess else "",
                )
        if len(set(search.objectives)) < len(search.objectives):
            raise InvalidInput("an objective is named twice.")
        for rule in search.constraints:
            self.rule("a constraint", rule)
        if not self.axes:
            raise InvalidInput("[search] needs an axis.")
        if search.algorithm == "cma-es":
            if len(search.objectives) > 1 or search.constraints:
                raise InvalidInput("cma-es takes one objective and no constraint.", hint='"nsga2"')
            for key, axis in self.axes.items():
                if axis.values is not None:
                    raise InvalidInput(f"axes.{key} has values; cma-es takes ranges only.")

    def rule(self, what: str, text: str) -> tuple[str, str, float]:
        """Return metric, comparison and bound of a rule.

        Args:
            what: Name of the rule, for messages.
            text: The rule.

        Raises:
            InvalidInput: It is no rule on a metric of the study.
        """
        names = [metric.name for metric in self.metrics]
        name, comparison, bound = [*text.rsplit(maxsplit=2), "", "", ""][:3]
        with suppress(ValueError):
            if name in names and comparison in ("<", ">"):
                return name, comparison, float(bound)
        raise InvalidInput(
            f'{what} is "{text[:80]}"; it must be a rule on a metric'
            f"{', or none, all, fell or pareto' if what == 'keep' else ''}.",
            hint=f'"{names[0]} < 1"',
        )

    def excess(self, rule: str, metrics: Any) -> Any:
        """Return by how much a metric exceeds the bound of a rule; below 0 the rule is kept.

        Args:
            rule: The rule, such as ``slip.mean < 0.002``.
            metrics: Metrics by name, numbers or columns of a table.
        """
        name, comparison, bound = self.rule("a rule", rule)
        return metrics[name] - bound if comparison == "<" else bound - metrics[name]

    def points(self) -> Iterator[Point]:
        """Yield the values of each run of a sampler: seeds change fastest, then the last axis."""
        for point in self._axis_points():
            yield from self.with_seeds(point)

    def with_seeds(self, point: Point) -> list[Point]:
        """Return the values of the runs of a point, one for each seed."""
        return [point | {"seed": seed} for seed in self.seeds] or [point]

    def count(self) -> int:
        """Return the number of runs."""
        points = self.runs or 1
        if self.search is not None:
            points = self.search.budget
        elif self.sampler == "grid":
            points = math.prod(len(axis.grid()) for axis in self.axes.values())
        return points * max(1, len(self.seeds))

    def _axis_points(self) -> Iterator[Point]:
        if self.sampler == "grid":
            for values in itertools.product(*(axis.grid() for axis in self.axes.values())):
                yield dict(zip(self.axes, values, strict=True))
            return
        from scipy.stats import qmc

        size, count = len(self.axes), self.runs or 1
        if self.sampler == "random":
            shares = np.random.default_rng(self.sampler_seed).random((count, size))
        elif self.sampler == "latin-hypercube":
            shares = qmc.LatinHypercube(size, rng=self.sampler_seed).random(count)
        else:
            with warnings.catch_warnings():
                # Any number of points is allowed; powers of two are balanced.
                warnings.simplefilter("ignore", UserWarning)
                shares = qmc.Sobol(size, rng=self.sampler_seed).random(count)
        for row in shares.tolist():
            yield {key: axis.at(s) for (key, axis), s in zip(self.axes.items(), row, strict=True)}


def check_key(key: str) -> None:
    """Refuse a key of an axis that no scenario, robot or engine has.

    Raises:
        InvalidInput: With the nearest key.
    """
    head, *rest = key.split(".")
    if head == "robot" and rest:
        # The robot's own table refuses unknown keys.
        return
    if head == "engine" and rest:
        settings: Any = EngineSettings()
        for name in rest:
            known = [f.name for f in fields(settings)] if is_dataclass(settings) else []
            if name not in known:
                guess = nearest(name, known)
                raise InvalidInput(
                    f'the engine has no setting "{name}".', hint=f'"{guess}"' if guess else ""
                )
            settings = getattr(settings, name)
        return
    keys = option_keys()
    stem = split_unit(key)[0]
    known_stems = {path[-1] for path in keys.values()}
    if key not in keys and stem not in known_stems:
        guess = nearest(key, keys)
        raise InvalidInput(
            f'no scenario has a field "{key}".',
            hint=f'"{guess}"' if guess else "robot.KEY, engine.KEY, or an axis with a function",
        )


def load_study_file(source: str | Path | Mapping[str, Any]) -> tuple[Study, Path]:
    """Read a study.

    Args:
        source: A ``.toml`` file, or its content as a mapping.

    Returns:
        The study, and the folder to which its file names are relative.

    Raises:
        InvalidInput: The file is absent or not well formed.
    """
    if isinstance(source, Mapping):
        return validate(Study, source, lambda loc: (dotted(loc), "")), Path()
    path = Path(source)
    raw, content = read_toml(path)
    with located(path.name):
        study = validate(Study, raw, in_file(path, content))
    return study, path.parent
