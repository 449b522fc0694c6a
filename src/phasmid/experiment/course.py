"""How a robot walks: its gait, stride and footholds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, Self

import numpy as np
from annotated_types import Ge, Gt, Le
from jaxtyping import Float

from phasmid.gait import Gait
from phasmid.robot.similarity import Scale
from phasmid.tables import Angle, Count, Hint, Length, Number, Table, Time

REFERENCE_PERIOD = 2.0
"""Period of ``phantomx-ax`` where the scenario gives none [s]: that of the paper."""


class StrideTable(Table):
    """``[stride]``: how the feet travel.

    Attributes:
        step_length: Forward displacement of the body during one stance [m].
        step_sideways: Displacement of the body to the left during one stance [m].
        step_turn: Turn of the body to the left during one stance [rad].
        step_height: Height to which a swinging foot lifts [m].
        period: Time of one cycle, in which every leg steps once [s]; absent: 2 s for
            ``phantomx-ax``, and proportional to the root of the leg length for other robots.
        samples: Samples of one cycle, both ends included.
        stance_law: ``straight``: feet on the ground do not move; ``coxa-only``: only the coxa
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
    period: Annotated[Time, Gt(0)] | None = None
    samples: Annotated[Count, Ge(9), Le(100_000), Hint("samples = 41, as in the paper")] = 41
    stance_law: Literal["straight", "coxa-only"] = "straight"
    stance_timing: Literal["rest-to-rest", "constant-speed"] = "rest-to-rest"
    curve: Literal["quintic", "cubic-spline"] = "quintic"
    stance_radius: Annotated[Length, Gt(0), Le(2)] | None = None
    body_height: Annotated[Length, Gt(0), Le(2)] | None = None

    @property
    def step(self) -> Float[np.ndarray, "3"]:
        """Displacement of one step: forward [m], left [m], turn [rad]."""
        return np.array([self.step_length, self.step_sideways, self.step_turn])

    def scaled(self, factor: float) -> Self:
        """Return the stride with steps of another size."""
        steps = ("step_length", "step_sideways", "step_turn")
        return self.model_copy(update={name: factor * getattr(self, name) for name in steps})

    def planned(self, scale: Scale) -> Stride:
        """Return the stride of a robot of a scale, with its period rounded to 10 ms."""
        period = round(REFERENCE_PERIOD * scale.time, 2) if self.period is None else self.period
        return Stride.model_construct(**{**dict(self), "period": period})


class Stride(StrideTable):
    """A stride whose period is known.

    Attributes:
        period: Time of one cycle [s].
    """

    period: Annotated[Time, Gt(0)]


class Footing(Table):
    """``[footing]``: adaptation of a walk to ground that the plan follows.

    The lengths and angles are assumptions, for feet of some millimetres and servos that place them
    within one or two.

    Attributes:
        search_radius: Largest distance of a foothold from its place on level ground [m].
        foothold_margin: Radius around a foothold within which the ground must be even [m].
        steepest_foothold: Steepest slope on which a foot is placed [rad].
        deepest_foothold: Depth below both sides from which ground counts as a gap, on which no foot
            is placed [m].
        least_friction: Coefficient of friction below which ground is avoided.
        trunk_attitude: ``follow-terrain``: the trunk leans with the ground under its feet;
            ``level``: the trunk stays level.
        steepest_lean: Largest lean of the trunk [rad].
    """

    search_radius: Annotated[Length, Ge(0), Le(0.5)] = 0.040
    foothold_margin: Annotated[Length, Gt(0), Le(0.1)] = 0.010
    steepest_foothold: Annotated[Angle, Gt(0), Le(np.pi / 4)] = np.radians(30)
    deepest_foothold: Annotated[Length, Gt(0)] = 0.050
    least_friction: Annotated[Number, Ge(0)] = 0.3
    trunk_attitude: Literal["follow-terrain", "level"] = "follow-terrain"
    steepest_lean: Annotated[Angle, Ge(0), Le(np.pi / 4)] = np.radians(25)


@dataclass(frozen=True)
class Course:
    """How a robot walks.

    Attributes:
        gait: Which legs stand, when.
        stride: How the feet travel.
        footing: Adaptation of the walk to ground that the plan follows.
    """

    gait: Gait
    stride: Stride
    footing: Footing
