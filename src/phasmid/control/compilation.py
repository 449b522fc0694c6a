"""Compiled functions of the controller, which its first use waits for."""

from __future__ import annotations

from phasmid.compiled import is_compiled
from phasmid.control.estimation.estimator import estimate_ground
from phasmid.control.feed_forward.contact_force_qp import apply_solution, write_programme
from phasmid.control.feed_forward.feed_forward import compute_feed_forward
from phasmid.control.update import advance_engine, update
from phasmid.control.velocity_limits import steady_walk_constraint

FUNCTIONS = (
    advance_engine,
    steady_walk_constraint,
    estimate_ground,
    compute_feed_forward,
    write_programme,
    apply_solution,
    update,
)
"""In the order in which they are compiled."""


def are_compiled() -> bool:
    """Return whether commands and updates do not wait for the compiler."""
    return all(is_compiled(function) for function in FUNCTIONS)
