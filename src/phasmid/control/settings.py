"""How the locomotion engine walks."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields

from phasmid.arguments import check_number, check_type
from phasmid.control.estimation import EstimatorSettings
from phasmid.control.feed_forward.settings import FeedForwardSettings
from phasmid.errors import InvalidInput
from phasmid.gait import Gait

DYNAMICS = ("feed-forward", "none")
"""Whether targets come with torques."""


@dataclass(frozen=True, slots=True)
class EngineSettings:
    """What the locomotion engine goes by where a command says nothing else.

    Attributes:
        gait: Name of the gait of the library for the robot's number of legs, or the gait itself;
            None: tripod, tetrapod or crawl, the first of the library.
        period: Time of a gait's cycle [s]; None: as long as makes a swing 0.5 s, of a gait that
            sways 2/3 s.
        step_height: Height to which a foot lifts above the line from where it left to where it
            lands [m].
        update_period: Time from one update to the next [s].
        acceleration: Largest change of the body's velocity [m/s²]; of its turn that share of it
            which the farthest foot makes.
        velocity_bandwidth: Of the filter that rounds the corners of that change [1/s].
        pose_speed: Largest speed at which the commanded pose of the body is approached [m/s].
        pose_turn_speed: The same for its angles [rad/s].
        pose_bandwidth: Of the filter that rounds the corners of the pose's way [1/s].
        joint_speed_share: Share of the servo's no-load speed that a joint's target may use.
        planned_speed_share: Share of that which a steady walk may use; the rest is for changes.
        stretch: Share of its full length to which a leg may be stretched.
        joint_margin: Distance that targets keep from the joints' limits [rad].
        support_margin: Distance that the centre of mass keeps from the edge of the feet that stand
            before a foot may lift [m].
        planned_margin: Distance more that a steady walk keeps [m].
        lowest_lift: Part of the swing before which contact is not believed to be a landing.
        landing_depth: How far a foot that finds no ground goes on down, before it looks elsewhere
            [m].
        landing_speed: How fast it does [m/s].
        patience: Time for which a lift waits for support before feet are put in order [s].
        dynamics: ``feed-forward``: targets come with the torques that the motion takes, and the
            velocity is taken back where ground or servos cannot give them; ``none``: without.
        feed_forward: How the forces of the feet are chosen then, and within which limits.
        ground_sensing: Whether contact and ground are estimated; if not the plan is trusted, as on
            level ground.
        estimator: How they are estimated.

    Raises:
        InvalidInput: A number is not finite or out of its range.
    """

    gait: str | Gait | None = None
    period: float | None = None
    step_height: float = 0.03
    update_period: float = 0.005
    acceleration: float = 0.6
    velocity_bandwidth: float = 20.0
    pose_speed: float = 0.08
    pose_turn_speed: float = 0.5
    pose_bandwidth: float = 15.0
    joint_speed_share: float = 0.95
    planned_speed_share: float = 0.9
    stretch: float = 0.98
    joint_margin: float = 0.02
    support_margin: float = 0.004
    planned_margin: float = 0.004
    lowest_lift: float = 0.5
    landing_depth: float = 0.05
    landing_speed: float = 0.2
    patience: float = 1.0
    dynamics: str = "feed-forward"
    feed_forward: FeedForwardSettings = field(default_factory=FeedForwardSettings)
    ground_sensing: bool = True
    estimator: EstimatorSettings = field(default_factory=EstimatorSettings)

    def __post_init__(self) -> None:
        if self.gait is not None:
            check_type("gait", self.gait, (str, Gait), "the name of a gait, or a Gait")
        check_type(
            "feed_forward",
            self.feed_forward,
            (FeedForwardSettings,),
            "FeedForwardSettings",
            "FeedForwardSettings()",
        )
        check_type("ground_sensing", self.ground_sensing, (bool,), "true or false")
        check_type(
            "estimator",
            self.estimator,
            (EstimatorSettings,),
            "EstimatorSettings",
            "EstimatorSettings(level=0)",
        )
        if self.dynamics not in DYNAMICS:
            raise InvalidInput(
                f'dynamics is "{self.dynamics}"; it must be {" or ".join(DYNAMICS)}.',
                hint='"feed-forward"',
            )
        for one in fields(self):
            value = getattr(self, one.name)
            if one.name not in _RANGES or (one.name == "period" and value is None):
                continue
            check_number(one.name, value)
            least, most = _RANGES[one.name]
            if not (math.isfinite(value) and least <= value <= most):
                raise InvalidInput(
                    f"{one.name} is {value:g}; it must be at least {least:g} and at most {most:g}."
                )


_RANGES = {
    "period": (0.05, 60.0),
    "step_height": (0.0, 1.0),
    "update_period": (0.0005, 0.05),
    "acceleration": (0.01, 100.0),
    "velocity_bandwidth": (1.0, 200.0),
    "pose_speed": (0.001, 10.0),
    "pose_turn_speed": (0.001, 100.0),
    "pose_bandwidth": (1.0, 200.0),
    "joint_speed_share": (0.05, 1.0),
    "planned_speed_share": (0.1, 0.99),
    "stretch": (0.5, 1.0),
    "joint_margin": (0.0, 0.5),
    "support_margin": (0.0, 0.1),
    "planned_margin": (0.001, 0.1),
    "lowest_lift": (0.1, 0.95),
    "landing_depth": (0.0, 0.5),
    "landing_speed": (0.001, 5.0),
    "patience": (0.05, 60.0),
}
