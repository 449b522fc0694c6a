"""Compiled functions of the controller, and whether they are ready."""

from __future__ import annotations

from phasmid.compiled import is_compiled
from phasmid.control.estimation.estimator import estimate_ground
from phasmid.control.feed_forward.feed_forward import compute_feed_forward
from phasmid.control.update import advance_engine, update

LOOPS = advance_engine, estimate_ground, compute_feed_forward, update
"""In the order in which they are compiled."""


def are_compiled() -> bool:
    """Return whether an update of the controller does not wait for the compiler."""
    return all(is_compiled(loop) for loop in LOOPS)
