"""Identified servo: values, intervals, and what stays undetermined."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.identification.bam import BamParameters
from phasmid.identification.logs import Log, compared_rows
from phasmid.identification.parameters import (
    Model,
    identified_motor,
    identified_servo,
    parameter_sizes,
)
from phasmid.servo import Motor, Servo

QUANTILE = 1.96
"""Half width of a 95 % interval in standard deviations."""

SURE, ROUGH = 0.05, 0.25
"""Half widths of intervals, as shares of the size, up to which a parameter is determined, and
roughly determined."""

PART = 0.3
"""Least part of a parameter in a direction in which it is named."""


class Determined(StrEnum):
    """How well the logs determine a parameter."""

    YES = "yes"
    ROUGHLY = "roughly"
    NO = "no"


@dataclass(frozen=True)
class TradeOff:
    """Direction in which parameters change together while the simulated angles hardly do.

    Attributes:
        changes: Change of each named parameter, as a share of its size; the largest is 1.
        deviation: Standard deviation along the direction, in the same unit.
    """

    changes: Mapping[str, float]
    deviation: float


@dataclass(frozen=True)
class Identification:
    """Identified servo.

    Attributes:
        servo: The servo of the start.
        model: Its friction model.
        logs: The logs.
        names: Names of the free parameters.
        fixed: Values of the others, among them a rounded compliance margin.
        margin: Interval's half width of the compliance margin before it was rounded [ticks]; None
            where it was not fitted.
        values: Values of the free parameters, internal units, shape (P,).
        covariance: Their covariance, shape (P, P).
        simulated: Simulated angles of each log [rad].
        evaluations: Number of simulations of all logs.
    """

    servo: Servo
    model: Model
    logs: tuple[Log, ...]
    names: tuple[str, ...]
    fixed: Mapping[str, float]
    margin: float | None
    values: Float[np.ndarray, " p"]
    covariance: Float[np.ndarray, "p p"]
    simulated: tuple[np.ndarray, ...]
    evaluations: int

    @property
    def all_values(self) -> dict[str, float]:
        """Values of all parameters, by name."""
        return {**self.fixed, **dict(zip(self.names, self.values.tolist(), strict=True))}

    @cached_property
    def half_widths(self) -> Float[np.ndarray, " p"]:
        """Half widths of the 95 % intervals."""
        return QUANTILE * np.sqrt(np.diag(self.covariance))

    @property
    def sizes(self) -> Float[np.ndarray, " p"]:
        """Sizes of the parameters: their values, or their typical sizes where these are larger."""
        return parameter_sizes(self.names, self.values)

    @property
    def determined(self) -> tuple[Determined, ...]:
        """How well each parameter is determined, by the half width of its interval."""
        shares = self.half_widths / self.sizes
        return tuple(
            Determined.YES if s <= SURE else Determined.ROUGHLY if s <= ROUGH else Determined.NO
            for s in shares
        )

    @property
    def trade_offs(self) -> tuple[TradeOff, ...]:
        """Directions that the logs do not determine, the worst first.

        They are the singular vectors of the sensitivity along which the standard deviation exceeds
        that of roughly determined parameters.
        """
        scaled = self.covariance / np.outer(self.sizes, self.sizes)
        variances, vectors = np.linalg.eigh(scaled)
        found = []
        for variance, vector in zip(variances[::-1], vectors.T[::-1], strict=True):
            deviation = math.sqrt(max(variance, 0.0))
            if QUANTILE * deviation <= ROUGH:
                break
            vector = vector / vector[np.abs(vector).argmax()]
            named = np.flatnonzero(np.abs(vector) >= PART)
            order = named[np.argsort(-np.abs(vector[named]), kind="stable")]
            changes = {self.names[i]: float(vector[i]) for i in order}
            found.append(TradeOff(changes, deviation))
        return tuple(found)

    @property
    def residuals(self) -> tuple[np.ndarray, ...]:
        """Measured less simulated angles of each log [rad]."""
        return tuple(log.position - one for log, one in zip(self.logs, self.simulated, strict=True))

    @cached_property
    def compared(self) -> tuple[np.ndarray, ...]:
        """Which readings of each log are compared, in the form of its positions."""
        return tuple(compared_rows(log).reshape(log.position.shape) for log in self.logs)

    @property
    def rms_error(self) -> float:
        """Root mean square of the residuals that are compared [rad]."""
        kept = [r[which] for r, which in zip(self.residuals, self.compared, strict=True)]
        return float(np.sqrt(np.mean(np.concatenate(kept) ** 2)))

    @property
    def motor(self) -> Motor:
        """The identified motor and friction."""
        return identified_motor(self.model, self.all_values)

    @property
    def bam(self) -> BamParameters:
        """The identified values for BAM.

        Raises:
            InvalidInput: The model is phasmid's own.
        """
        if self.model == "own":
            raise InvalidInput("BAM has no model of phasmid's own friction.")
        values = self.all_values
        return BamParameters(
            self.model,
            self.servo.name.lower(),
            values["motor_constant"],
            values["resistance"],
            values["armature"],
            self.motor.friction,
            {"q_offset": -values["hanging"]},
        )

    @property
    def identified(self) -> Servo:
        """The servo with the identified values."""
        return identified_servo(self.servo, self.model, self.all_values)
