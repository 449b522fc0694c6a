"""What made a recording, as its attributes."""

from __future__ import annotations

import platform
from functools import cache
from importlib.metadata import version

import numpy as np

from phasmid.experiment.ending import Ending, Failure


@cache
def versions() -> dict[str, str]:
    """Return the versions and machine that a run's bits depend on, by attribute."""
    import mujoco

    return {
        "phasmid_version": version("phasmid"),
        "mujoco_version": mujoco.__version__,
        "numpy_version": np.__version__,
        "numba_version": version("numba"),
        "machine": f"{platform.system()} {platform.machine()}",
    }


def ending_attributes(failure: Failure | None) -> dict[str, str | int | float]:
    """Return how a run ended, as attributes of its recording."""
    ending = failure.ending if failure else Ending.COMPLETED
    return {
        "ending": ending.name,
        "ending_reason": failure.sentence if failure else ending.value,
    }
