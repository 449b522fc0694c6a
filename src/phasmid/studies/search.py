"""Points chosen by an optimiser, batch by batch."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from phasmid.errors import OutputError
from phasmid.studies.definition import Axis, Search, Study
from phasmid.studies.results import read_rows
from phasmid.studies.runs import Run, numbered


def search(
    study: Study, parts: Mapping[str, str], folder: Path, make: Callable[[list[Run]], bool]
) -> None:
    """Choose points and make their runs until the budget is spent.

    The optimiser receives the same values in the same order whenever the search is made, so that an
    interrupted search chooses the same points again, whose rows exist.

    Args:
        study: The study.
        parts: Its fingerprint.
        folder: Its folder.
        make: Makes the runs that have no row; returns False to stop.
    """
    assert study.search is not None
    wanted = study.search
    with warnings.catch_warnings():
        # Constraints and the batches of CMA-ES are marked as experimental.
        warnings.simplefilter("ignore")
        problem = _problem(wanted)
        distributions = {key: _distribution(axis) for key, axis in study.axes.items()}
        for begin in range(0, wanted.budget, wanted.batch):
            count = min(wanted.batch, wanted.budget - begin)
            trials = [problem.ask(distributions) for _ in range(count)]
            runs: list[Run] = []
            for trial in trials:
                points = study.with_seeds(dict(trial.params))
                runs += numbered(parts, points, begin * len(points) + len(runs))
            ids = [run.id for run in runs]
            # Twice, where a part is damaged at once.
            for _ in range(2):
                if not make(runs):
                    return
                rows = read_rows(folder, study).set_index("run")
                if rows.index.isin(ids).sum() == len(ids):
                    break
            else:
                raise OutputError(f"rows of {folder} are damaged as soon as they are written.")
            rows = rows.loc[ids]
            each = len(runs) // count
            for k, trial in enumerate(trials):
                _tell(problem, trial, wanted, study, rows.iloc[each * k : each * (k + 1)])


def _problem(wanted: Search) -> Any:
    """Return the optimiser."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    constraints = _violations if wanted.constraints else None
    sampler: Any
    if wanted.algorithm == "nsga2":
        sampler = optuna.samplers.NSGAIISampler(
            population_size=wanted.batch, constraints_func=constraints, seed=wanted.seed
        )
    elif wanted.algorithm == "tpe":
        sampler = optuna.samplers.TPESampler(constraints_func=constraints, seed=wanted.seed)
    else:
        sampler = optuna.samplers.CmaEsSampler(popsize=wanted.batch, seed=wanted.seed)
    kinds = optuna.study.StudyDirection
    directions = [kinds.MINIMIZE] * len(wanted.minimise) + [kinds.MAXIMIZE] * len(wanted.maximise)
    return optuna.create_study(directions=directions, sampler=sampler)


def _distribution(axis: Axis) -> Any:
    from optuna.distributions import (
        CategoricalDistribution,
        FloatDistribution,
        IntDistribution,
    )

    if axis.values is not None:
        return CategoricalDistribution(axis.values)
    low, high = axis.ends()
    if axis.whole:
        return IntDistribution(round(low), round(high), log=axis.log)
    return FloatDistribution(low, high, log=axis.log)


def _violations(trial: Any) -> list[float]:
    """Return the violation of each constraint; 0 or less where it is kept."""
    return list(trial.user_attrs["violations"])


def _tell(problem: Any, trial: Any, wanted: Search, study: Study, rows: pd.DataFrame) -> None:
    """Return the values of a point, the means over its seeds, to the optimiser."""
    from optuna.trial import TrialState

    failed = bool((rows["status"] == "failed").any())
    means = rows[[metric.name for metric in study.metrics]].mean()
    violations = [] if failed else [study.excess(rule, means) for rule in wanted.constraints]
    # A point that cannot be run is worse than any violation that is measured.
    trial.set_user_attr("violations", violations or [np.inf] * len(wanted.constraints))
    if failed:
        problem.tell(trial, state=TrialState.FAIL)
    else:
        problem.tell(trial, [float(means[name]) for name in wanted.objectives])


def best_points(study: Study, table: pd.DataFrame) -> pd.DataFrame:
    """Return the points that no other point surpasses in all objectives, the Pareto set.

    Args:
        study: A study with ``[search]``.
        table: Its rows.

    Returns:
        One row per point: axes and means of the metrics over seeds, of points without a failed run
        that keep all constraints, by the first objective.
    """
    assert study.search is not None
    wanted = study.search
    axes, names = list(study.axes), [metric.name for metric in study.metrics]
    failed = table.groupby(axes)["status"].transform(lambda status: (status == "failed").any())
    points = table[~failed].groupby(axes, as_index=False)[names].mean()
    for rule in wanted.constraints:
        points = points[study.excess(rule, points) < 0]
    signs = [1.0] * len(wanted.minimise) + [-1.0] * len(wanted.maximise)
    costs = points[wanted.objectives].to_numpy(float) * signs
    keep = [not ((costs <= cost).all(axis=1) & (costs < cost).any(axis=1)).any() for cost in costs]
    return points[keep].sort_values(wanted.objectives[0]).reset_index(drop=True)
