"""Position, velocity and orientation of the body in odom, from its own sensors.

Observations go in; `BodyState` comes out. Closed-loop runs and the driver of a robot call it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Bool, Float

from phasmid.control.estimation.body_filter import (
    FILTER_PARAMETERS,
    FILTER_STATE,
    NEVER,
    POSITION,
    VELOCITY,
    FilterParameters,
    FilterState,
    update_body_state,
)
from phasmid.control.estimation.settings import EstimatorSettings
from phasmid.control.estimation.state import (
    ESTIMATOR_PARAMETERS,
    MEASURED,
    MEASUREMENTS,
    EstimatorParameters,
    Measurements,
    parameters_of,
)
from phasmid.control.records import MAX_LEGS, fill, view_of
from phasmid.errors import InvalidInput
from phasmid.experiment.observation import Observation
from phasmid.robot import Robot
from phasmid.units import STANDARD_GRAVITY


@dataclass(frozen=True, slots=True)
class BodyStateSettings:
    """Settings of the body's state estimator; noises are standard deviations.

    Attributes:
        force_noise: Noise of the accelerometer, with vibration of the walk [m/s²/√Hz].
        rate_noise: Noise of the gyro [rad/s/√Hz].
        orientation_noise: Error of one reading of the orientation sensor [rad].
        heading_walk: Drift of its yaw, a random walk [rad/√s].
        foot_noise: Error of a foot's position by joint angles [m].
        creep: Random walk of a standing foot [m/√s].
        gate: Largest Mahalanobis distance of an innovation that is used; infinite: all are.
        settling_time: Time from touchdown until a foot is used: joint readings are late [s].
        gravity: Gravitational acceleration [m/s²].

    Raises:
        InvalidInput: A number is not greater than 0.
    """

    force_noise: float = 0.1
    rate_noise: float = 0.002
    orientation_noise: float = math.radians(1)
    heading_walk: float = math.radians(0.05)
    foot_noise: float = 0.001
    creep: float = 0.002
    gate: float = 4.0
    settling_time: float = 0.03
    gravity: float = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not value > 0.0:
                raise InvalidInput(f"{field.name} is {value:g}; it must be greater than 0.")


@dataclass(frozen=True, slots=True, eq=False)
class BodyState:
    """Estimate of the body's motion in odom, for a robot with L legs.

    Odom begins under the robot, x along the body at the start, z against gravity.

    Attributes:
        position: Origin of the body frame [m], shape (3,).
        velocity: Its velocity, axes of odom [m/s], shape (3,).
        orientation: Orientation of the body, w x y z, shape (4,).
        position_deviation: Standard deviations of the position [m], shape (3,).
        velocity_deviation: Standard deviations of the velocity [m/s], shape (3,).
        slipping: Feet that move though in contact, shape (L,).
    """

    position: Float[np.ndarray, "3"]
    velocity: Float[np.ndarray, "3"]
    orientation: Float[np.ndarray, "4"]
    position_deviation: Float[np.ndarray, "3"]
    velocity_deviation: Float[np.ndarray, "3"]
    slipping: Bool[np.ndarray, " legs"]


class BodyStateEstimator:
    """Estimates the body's motion from joint angles, inertial sensors and contacts.

    An extended Kalman filter predicts by gyro and accelerometer, and corrects by the feet that
    stand, as if they were fixed, and by the orientation sensor. A foot whose innovation is
    implausible slips and is left out until it rests. Without contact sensors joint loads show which
    feet stand; without those, the inertial sensors, by which feet rest in odom. Any other sensor
    may be absent or fail.

    Args:
        robot: The robot, four to eight legs.
        settings: Noise and gate; None: the default.
        update_period: Time between updates [s].

    Attributes:
        state: State of the filter.

    Raises:
        InvalidInput: The robot has too many legs.
    """

    def __init__(
        self,
        robot: Robot,
        settings: BodyStateSettings | None = None,
        update_period: float = 0.005,
    ) -> None:
        settings, legs = settings or BodyStateSettings(), len(robot.legs)
        if legs > MAX_LEGS:
            raise InvalidInput(
                f"the robot has {legs} legs; its body's state is estimated for {MAX_LEGS} or fewer."
            )
        self._states, parameters, robots, measurements = (
            np.zeros(1, kind)
            for kind in (FILTER_STATE, FILTER_PARAMETERS, ESTIMATOR_PARAMETERS, MEASUREMENTS)
        )
        self.state = view_of(self._states, FilterState, legs)
        self._measured = view_of(measurements, Measurements, legs)
        noise = {field.name: getattr(settings, field.name) for field in fields(settings)}
        arrays = robot.arrays
        fill(
            view_of(parameters, FilterParameters, legs),
            FilterParameters(arrays.R_body_hip, arrays.p_body_hip, **noise),
        )
        # Delays are not used.
        still = EstimatorSettings(joint_delay=0.0, motion_lag=0.0)
        fill(
            view_of(robots, EstimatorParameters, legs),
            parameters_of(robot, still, update_period, settings.gravity),
        )
        self._records = self._states[0], parameters[0], robots[0], measurements[0]
        self._clear()

    def _clear(self) -> None:
        self._states[:] = np.zeros((), FILTER_STATE)
        self._states["rest_time"] = NEVER

    def reset(self, observation: Observation) -> None:
        """Begin at rest at the origin of odom, with the robot as it is observed."""
        self._clear()
        self.update(observation)

    def update(self, observation: Observation) -> BodyState:
        """Return the estimate after another update period.

        Args:
            observation: Its joint angles and inertial sensors are used; values that are not finite
                are left out.
        """
        for name in MEASURED:
            value = getattr(observation, name)
            getattr(self._measured, name)[:] = math.nan if value is None else value
        update_body_state(*self._records)
        return self.estimate

    def observe(self, observation: Observation) -> Observation:
        """Return an observation with the body's motion after another update period."""
        body = self.update(observation)
        return replace(
            observation,
            body_position=body.position,
            body_velocity=body.velocity,
            body_orientation=body.orientation,
        )

    def channels(self) -> dict[str, np.ndarray]:
        """Return the recorded channels of the present estimate."""
        state = self.state
        return {
            "body_position_estimated": state.position.copy(),
            "body_velocity_estimated": state.velocity.copy(),
        }

    @property
    def estimate(self) -> BodyState:
        """The present estimate."""
        state = self.state
        deviation = np.sqrt(state.covariance.diagonal()[: VELOCITY + 3])
        return BodyState(
            position=state.position.copy(),
            velocity=state.velocity.copy(),
            orientation=state.orientation.copy(),
            position_deviation=deviation[POSITION:VELOCITY],
            velocity_deviation=deviation[VELOCITY:],
            slipping=state.slipping != 0,
        )
