"""All that is looked at, in the order in which it is told."""

from __future__ import annotations

from phasmid.doctor.computing import engine, fast, machine, python
from phasmid.doctor.finding import Finding
from phasmid.doctor.packages import EXTRAS, extra, needed_packages
from phasmid.doctor.showing import figures, page


def examine() -> list[Finding]:
    """Look at this machine, without a network and without changing anything.

    Returns:
        What was found, one finding per thing.
    """
    return [
        machine(),
        python(),
        needed_packages(),
        engine(),
        fast(),
        figures(),
        page(),
        *map(extra, EXTRAS.values()),
    ]
