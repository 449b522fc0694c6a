"""Stride of a scenario."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Gt, Le
from jaxtyping import Float

from phasmid.tables import Angle, Count, Hint, Length, Table, Time


class StrideTable(Table):
    """``[stride]``: how the feet travel.

    Attributes:
        step_length: The body's way forward in one step, the time for which a foot stands [m].
        step_sideways: The body's way to the left in one step [m].
        step_turn: The body's turn to the left in one step [rad].
        step_height: Height to which a foot lifts [m].
        period: Time of one cycle, in which every leg steps once [s].
        samples: Samples of one cycle, both ends included.
        stance_law: ``straight``: standing feet stay where they are; ``coxa-only``: only the coxa
            joint moves in stance, so that feet slip.
        stance_timing: ``rest-to-rest``: the body stops whenever a foot lifts or lands;
            ``constant-speed``: it never stops.
        curve: Polynomial of all paths: the paper's quintic, or the cubic spline of its ref. [11].
        stance_radius: Distance of the neutral feet from their hips, seen from above [m]; absent:
            the robot's.
        body_height: Height of the hips over level ground [m]; absent: the robot's.
    """

    step_length: Length = 0.040
    step_sideways: Length = 0.0
    step_turn: Annotated[Angle, Ge(-np.pi), Le(np.pi)] = 0.0
    step_height: Annotated[Length, Ge(0)] = 0.030
    period: Annotated[Time, Gt(0)] = 2.0
    samples: Annotated[Count, Ge(9), Le(100_000), Hint("41, as the paper; two phases need 9")] = 41
    stance_law: Literal["straight", "coxa-only"] = "straight"
    stance_timing: Literal["rest-to-rest", "constant-speed"] = "rest-to-rest"
    curve: Literal["quintic", "cubic-spline"] = "quintic"
    stance_radius: Annotated[Length, Gt(0), Le(2)] | None = None
    body_height: Annotated[Length, Gt(0), Le(2)] | None = None

    @property
    def step(self) -> Float[np.ndarray, "3"]:
        """Displacement of one step: forward [m], left [m], turn [rad]."""
        return np.array([self.step_length, self.step_sideways, self.step_turn])

    def scaled(self, factor: float) -> StrideTable:
        """Return the stride with steps of another size."""
        steps = ("step_length", "step_sideways", "step_turn")
        return self.model_copy(update={name: factor * getattr(self, name) for name in steps})
