"""Settings of the locomotion engine."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

from phasmid.arguments import check_fields
from phasmid.control.estimation import EstimatorSettings
from phasmid.control.feed_forward.settings import FeedForwardSettings
from phasmid.control.terrain_map import SOURCES
from phasmid.errors import InvalidInput, nearest
from phasmid.gait import Gait
from phasmid.units import STANDARD_GRAVITY

DYNAMICS = ("feed-forward", "none")
"""Torques of the targets."""


@dataclass(frozen=True, slots=True)
class EngineSettings:
    """Settings of the locomotion engine; a command may replace gait, period and step height.

    Attributes:
        gait: Name of a gait of the library for the robot's number of legs, or the gait; None: the
            default, as of `phasmid.gait.default_gait`.
        period: Duration of a cycle [s]; None: a swing takes 0.5 s, with sway 2/3 s.
        step_height: Height to which a foot lifts above the line from lift-off to touchdown [m].
        update_period: Time from one update to the next [s].
        acceleration: Largest acceleration of the body, and of the neutral feet where it turns
            [m/s²].
        landing_depth: Depth to which a foot without contact goes on down, before it searches
            elsewhere [m].
        dynamics: ``feed-forward``: targets include the torques of the motion, and the velocity is
            reduced where ground or servos cannot give them; ``none``: without.
        feed_forward: Choice and limits of the foot forces.
        ground_sensing: Estimate contact and ground; otherwise the plan on level ground is trusted.
        estimator: Settings of these estimates.
        gravity: Gravitational acceleration of the world in which the robot walks [m/s²].
        terrain_map: Source of a height map around the robot: ``none``; ``feet``: footholds, by
            ground sensing; ``points``: footholds and the ground points of a depth sensor.

    Raises:
        InvalidInput: A number is not finite or out of its range.
    """

    gait: str | Gait | None = None
    period: float | None = None
    step_height: float = 0.03
    update_period: float = 0.005
    acceleration: float = 0.6
    landing_depth: float = 0.05
    dynamics: str = "feed-forward"
    feed_forward: FeedForwardSettings = field(default_factory=FeedForwardSettings)
    ground_sensing: bool = True
    estimator: EstimatorSettings = field(default_factory=EstimatorSettings)
    terrain_map: str = "none"
    gravity: float = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        check_fields(self)
        if self.dynamics not in DYNAMICS:
            raise InvalidInput(
                f'dynamics is "{self.dynamics}"; it must be {" or ".join(DYNAMICS)}.',
                hint='"feed-forward"',
            )
        if self.terrain_map not in SOURCES:
            raise InvalidInput(
                f'terrain_map is "{self.terrain_map}"; it must be {", ".join(SOURCES[:-1])} or '
                f"{SOURCES[-1]}.",
                hint='"points"',
            )
        for name, (least, most) in _RANGES.items():
            value = getattr(self, name)
            if name == "period" and value is None:
                continue
            if not (math.isfinite(value) and least <= value <= most):
                raise InvalidInput(
                    f"{name} is {value:g}; it must be at least {least:g} and at most {most:g}."
                )


def with_settings(settings: EngineSettings, changes: Mapping[str, Any]) -> EngineSettings:
    """Return settings with other values, by field name.

    Raises:
        InvalidInput: There is no such field, or the value is refused.
    """
    known = [field.name for field in fields(settings)]
    for name in changes:
        if name not in known:
            guess = nearest(name, known)
            raise InvalidInput(
                f'the engine has no setting "{name}".',
                hint=f'"{guess}"' if guess else f"settings are {', '.join(known)}",
            )
    return replace(settings, **changes)


_RANGES = {
    "gravity": (1e-6, 100.0),
    "period": (0.05, 60.0),
    "step_height": (0.0, 1.0),
    "update_period": (0.0005, 0.05),
    "acceleration": (0.01, 100.0),
    "landing_depth": (0.0, 0.5),
}
