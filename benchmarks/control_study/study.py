"""Cases of a study, run side by side, and kept as JSON."""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

Case = dict[str, Any]
"""Parameters or results of one run; numbers, texts and lists of them."""


def run(
    measure: Callable[..., Case], cases: Sequence[Case], processes: int = 1, name: str = ""
) -> list[Case]:
    """Measure all cases; each result includes its case.

    Args:
        measure: Takes a case as keywords.
        cases: Parameters of the runs.
        processes: Number of runs at a time.
        name: Name of the study, to print its progress.
    """
    began = time.perf_counter()
    found = _run(measure, cases, processes, name)
    if name:
        print(f"{name}: {len(cases)} runs, {time.perf_counter() - began:.0f} s", flush=True)
    return found


def _run(
    measure: Callable[..., Case], cases: Sequence[Case], processes: int, name: str
) -> list[Case]:
    if processes == 1:
        return [case | measure(**case) for case in cases]
    # Each run has one core; threads of linear algebra would occupy the others.
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    found: list[Case] = [{}] * len(cases)
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        places = {pool.submit(measure, **case): place for place, case in enumerate(cases)}
        for count, done in enumerate(as_completed(places), 1):
            place = places[done]
            found[place] = cases[place] | done.result()
            if name and (count % 50 == 0):
                print(f"  {name}: {count} of {len(cases)}", flush=True)
    return found


def save(path: Path, results: list[Case]) -> None:
    """Write results."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(_plain(results), indent=1) + "\n", "utf-8")


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def markdown(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table whose columns are flush right, except the first."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)


def grouped(results: list[Case], *names: str) -> dict[tuple[Any, ...], list[Case]]:
    """Group results by the values of some entries, in order of appearance."""
    found: dict[tuple[Any, ...], list[Case]] = {}
    for result in results:
        found.setdefault(tuple(result[name] for name in names), []).append(result)
    return found
