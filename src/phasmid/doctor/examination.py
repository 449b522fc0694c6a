"""All that is looked at, in the order in which it is told."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

from phasmid.doctor.computing import compiler, engine, machine, python
from phasmid.doctor.finding import Finding
from phasmid.doctor.packages import EXTRAS, extra, needed_packages
from phasmid.doctor.showing import drawing, figures, page


def examine() -> list[Finding]:
    """Look at this machine, without a network and without changing anything.

    Returns:
        What was found, one finding per thing.
    """
    with ThreadPoolExecutor(1) as beside:
        # The process that tries to draw takes a second, in which all else is looked at.
        drawn = beside.submit(drawing)
        others = _others()
    return [*others, drawn.result()]


def _others() -> list[Finding]:
    return [
        machine(),
        python(),
        needed_packages(),
        engine(),
        compiler(),
        figures(),
        page(),
        *map(extra, EXTRAS.values()),
    ]
