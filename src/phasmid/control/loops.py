"""The loops of the controller that take long to compile, and whether they are ready."""

from __future__ import annotations

from phasmid.compiled import is_compiled
from phasmid.control.estimation.estimator import estimate_ground
from phasmid.control.feed_forward.feed_forward import compute_feed_forward
from phasmid.control.update import advance_engine

LOOPS = advance_engine, estimate_ground, compute_feed_forward
"""Update of the engine, ground estimator, and feed-forward."""


def are_compiled() -> bool:
    """Whether the controller can be asked without waiting for the compiler."""
    return all(is_compiled(loop) for loop in LOOPS)
