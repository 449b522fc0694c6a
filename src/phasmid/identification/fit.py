"""Fit of a servo's parameters to logs of a bench, with intervals and what stays undetermined."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from phasmid.control.feed_forward.servo_goal import FULL_PUNCH
from phasmid.errors import InvalidInput
from phasmid.identification.bam import BamParameters
from phasmid.identification.bench import BenchLog, simulate_bench
from phasmid.identification.parameters import (
    PARAMETERS,
    Model,
    bench_parameters,
    check_names,
    identified_motor,
    identified_servo,
    parameter_names,
    start_values,
)
from phasmid.robot import Motor, Servo

SETTLING = 0.3
"""Time at the beginning of a log that is not compared: speed and rotor are unknown there [s]."""

DIFFERENCE, ROUGH_DIFFERENCE = 0.005, 0.02
"""Change of a parameter for its derivative, as a share of its size: with a finer sensor, and with
the servo's own."""

FINER = 1000
"""How much finer the servo's sensor is taken for derivatives: with its steps, the simulated angles
are rough in the parameters."""

RESTART = 0.4
"""Time after which the first simulations restart from measured states [s]."""

CORRELATION = 0.5
"""Longest time over which residuals are taken as correlated, as the errors of a coarse sensor are
while the servo is slow [s]."""

PRIOR = 1.0
"""Standard deviation of each parameter about its start, as a share of its size: without it the fit
would wander along directions that the logs do not determine."""

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
    logs: tuple[BenchLog, ...]
    names: tuple[str, ...]
    fixed: Mapping[str, float]
    margin: float | None
    values: Float[np.ndarray, " p"]
    covariance: Float[np.ndarray, "p p"]
    simulated: tuple[Float[np.ndarray, " m"], ...]
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
        return _sizes(self.names, self.values)

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
    def residuals(self) -> tuple[Float[np.ndarray, " m"], ...]:
        """Measured less simulated angles of each log [rad]."""
        return tuple(log.position - one for log, one in zip(self.logs, self.simulated, strict=True))

    @property
    def rms_error(self) -> float:
        """Root mean square of the residuals after the settling time [rad]."""
        kept = [r[_compared(log)] for r, log in zip(self.residuals, self.logs, strict=True)]
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


def identify(
    logs: Sequence[BenchLog],
    servo: Servo,
    *,
    model: Model = "own",
    fixed: Sequence[str] = (),
    hanging: float = 0.0,
) -> Identification:
    """Fit a servo's parameters to logs by nonlinear least squares over simulated angles.

    Args:
        logs: Logs of one servo.
        servo: Start of the fit; its law, resolution and settings are kept.
        model: Friction model: ``own``, or ``m1`` to ``m6`` of BAM.
        fixed: Parameters that keep the servo's values.
        hanging: Expected angle of the hanging pendulum as the servo reports it [rad].

    Raises:
        InvalidInput: There is no log, a log is shorter than the settling time, or a fixed parameter
            is unknown.
    """
    if not logs:
        raise InvalidInput("no log is given.")
    for log in logs:
        if log.time[-1] - log.time[0] < 2 * SETTLING:
            raise InvalidInput(
                f"{log.name} lasts {log.time[-1] - log.time[0]:.3g} s; a log must last "
                f"{2 * SETTLING:g} s or more."
            )
    known = parameter_names(servo, model)
    check_names(fixed, known)
    start = start_values(servo, model, hanging)
    names = tuple(name for name in known if name not in fixed)
    kept = {name: start[name] for name in known if name in fixed}
    problem = _Problem(servo, model, tuple(logs), names, kept, start)
    # Over a long time a swinging pendulum gets out of phase, and its angle no longer shows in which
    # direction a parameter is wrong: short stretches come first.
    for problem.period in (RESTART, math.inf):
        problem.solve()
    margin = problem.round_margin()
    scatter = problem.polish()
    return Identification(
        servo,
        model,
        tuple(logs),
        problem.names,
        problem.kept,
        margin,
        problem.values,
        (problem.covariance(problem.x) + scatter) * np.outer(problem.scale, problem.scale),
        tuple(problem.simulate(problem.x)),
        problem.evaluations,
    )


INSIDE = 0.3
"""Distance of the start from bounds, as a share of the size."""

STARTS, SPREAD = 4, 0.01
"""Starts of the last solution, and their distance, as a share of the size."""

MOST_ITERATIONS = 60
"""Most iterations of a fit."""


def _sizes(names: Sequence[str], values: Float[np.ndarray, " p"]) -> Float[np.ndarray, " p"]:
    scales = [PARAMETERS[name].scale for name in names]
    sizes: np.ndarray = np.maximum(np.abs(values), scales)
    return sizes


def _compared(log: BenchLog) -> Bool[np.ndarray, " n"]:
    """Return which rows of a log are compared."""
    compared: np.ndarray = log.time >= log.time[0] + SETTLING
    return compared


def make_finer(parameters: np.ndarray) -> None:
    """Give records of `servo_parameters` a sensor with finer steps and the same mean output.

    With the servo's own steps, the compliance law has its first output half a step beyond the
    margin, and from there the mean output of the next steps.
    """
    punch, slope = parameters["punch"].copy(), parameters["slope"].copy()
    parameters["punch"] += 0.5 * (1 - punch) / slope.mean(axis=1)
    parameters["slope"] *= ((1 - parameters["punch"]) / (1 - punch))[:, None]
    parameters["margin"] += 0.5
    for name, power in {"tick": -1, "margin": 1, "slope": 1, "gain": -1, "change_gain": -1}.items():
        parameters[name] *= float(FINER) ** power


class _Problem:
    """Least-squares problem in parameters over their sizes at the start.

    Args:
        servo: The servo.
        model: Its friction model.
        logs: The logs.
        names: Free parameters.
        kept: Values of the others.
        start: Values of the free ones at the start.

    Attributes:
        names: Free parameters.
        kept: Values of the others.
        x: Free parameters over their sizes.
        is_smooth: Simulate with a finer sensor.
        has_smooth_derivative: Take derivatives with a finer sensor.
        period: Time after which the simulation restarts from measured states [s].
        evaluations: Number of simulations.
    """

    def __init__(
        self,
        servo: Servo,
        model: Model,
        logs: tuple[BenchLog, ...],
        names: tuple[str, ...],
        kept: Mapping[str, float],
        start: Mapping[str, float],
    ) -> None:
        self._servo, self._model, self._logs = servo, model, logs
        self.names, self.kept = names, dict(kept)
        own = [PARAMETERS[name] for name in names]
        self.scale = np.array([max(abs(start[p.name]), p.scale) for p in own])
        self._low, self._high = (
            np.array([getattr(p, key) for p in own]) / self.scale for key in ("low", "high")
        )
        # The solver leaves a bound slowly.
        first = np.array([start[name] for name in names]) / self.scale
        self._start = np.clip(first, self._low + INSIDE, self._high - INSIDE)
        self.x = self._start
        self._noise = servo.resolution / math.sqrt(12)
        self._rows = [_compared(log) for log in logs]
        self.has_smooth_derivative = True
        self.is_smooth, self.period, self.evaluations = True, math.inf, 0

    @property
    def values(self) -> Float[np.ndarray, " p"]:
        """Values of the free parameters."""
        return self.x * self.scale

    def solve(self) -> float:
        """Minimize the errors from where the parameters are, and return half their squares."""
        # Lazy import: scipy.optimize takes 0.2 s.
        from scipy.optimize import least_squares

        solution = least_squares(
            self.errors,
            self.x,
            jac=self.jacobian,
            bounds=(self._low, self._high),
            x_scale="jac",
            ftol=1e-5,
            xtol=1e-5,
            gtol=1e-10,
            max_nfev=MOST_ITERATIONS,
        )
        self.x = solution.x
        return float(solution.cost)

    def round_margin(self) -> float | None:
        """Solve with the servo's own sensor; the compliance margin is a whole number of ticks.

        Returns:
            The half width of the margin's interval before [ticks]; None where it is not free.
        """
        self.is_smooth = False
        if "compliance_margin" not in self.names:
            self.solve()
            return None
        i = self.names.index("compliance_margin")
        width = QUANTILE * math.sqrt(self.covariance(self.x)[i, i]) * self.scale[i]
        fitted = self.values[i]
        self.names = tuple(name for name in self.names if name != "compliance_margin")
        for key in ("x", "scale", "_low", "_high", "_start"):
            setattr(self, key, np.delete(getattr(self, key), i))
        found, first = [], self.x
        for margin in {max(round(fitted) + change, 0) for change in (-1, 0, 1)}:
            self.kept["compliance_margin"], self.x = float(margin), first.copy()
            self._shift_punch(margin - fitted)
            self.has_smooth_derivative = True
            self.solve()
            # The rough derivative over a larger change leads on where the smooth one ends.
            self.has_smooth_derivative = False
            found.append((self.solve(), margin, self.x))
        _, margin, self.x = min(found, key=lambda one: one[0])
        self.kept["compliance_margin"] = float(margin)
        return width

    def _shift_punch(self, ticks: float) -> None:
        """Change a free punch so that the output stays while the margin changes by some ticks."""
        if "punch" in self.names:
            i, values = self.names.index("punch"), dict(zip(self.names, self.values, strict=True))
            slope = values.get("compliance_slope", self.kept.get("compliance_slope", 1.0))
            shifted = self.x[i] + ticks * (FULL_PUNCH - values["punch"]) / slope / self.scale[i]
            self.x[i] = np.clip(shifted, self._low[i] + 0.01, self._high[i] - 0.01)

    def polish(self) -> Float[np.ndarray, "p p"]:
        """Solve from several starts near the solution, and keep the best of the solutions.

        With the servo's own sensor the errors are rough: each start may end elsewhere.

        Returns:
            Sum of squares of the other solutions' distances from the best, shape (P, P): a few
                starts show less than the whole scatter.
        """
        self.has_smooth_derivative = False
        rng, first, found = np.random.default_rng(0), self.x, []
        for k in range(STARTS):
            moved = first + min(k, 1) * SPREAD * rng.normal(size=len(first))
            self.x = np.clip(moved, self._low + 1e-6, self._high - 1e-6)
            found.append((self.solve(), k, self.x))
        found.sort()
        self.x = found[0][2]
        apart = np.array([x - self.x for _, _, x in found[1:]])
        scatter: np.ndarray = apart.T @ apart
        return scatter

    def simulate(self, x: Float[np.ndarray, " p"]) -> list[Float[np.ndarray, " m"]]:
        """Return the simulated angles of each log [rad]."""
        self.evaluations += 1
        values = {**self.kept, **dict(zip(self.names, (x * self.scale).tolist(), strict=True))}
        voltages = [log.voltage for log in self._logs]
        parameters = bench_parameters(self._servo, self._model, values, voltages)
        if self.is_smooth:
            make_finer(parameters)
        return simulate_bench(
            self._logs, parameters, values["delay"], values["hanging"], self.period
        )

    def errors(self, x: Float[np.ndarray, " p"]) -> Float[np.ndarray, " n"]:
        """Return residuals in standard deviations of a sensor's step, then those of the prior."""
        rows = zip(self.simulate(x), self._logs, self._rows, strict=True)
        parts = [(one - log.position)[kept] / self._noise for one, log, kept in rows]
        return np.concatenate([*parts, (x - self._start) / PRIOR])

    def jacobian(self, x: Float[np.ndarray, " p"]) -> Float[np.ndarray, "n p"]:
        """Return the derivative of the errors by central differences, one-sided at bounds."""
        was_smooth, share = self.is_smooth, ROUGH_DIFFERENCE
        if self.has_smooth_derivative:
            self.is_smooth, share = True, DIFFERENCE
        columns = []
        for i in range(len(x)):
            width = share * max(abs(x[i]), 1.0)
            up, down = x.copy(), x.copy()
            up[i] = min(x[i] + width, self._high[i])
            down[i] = max(x[i] - width, self._low[i])
            columns.append((self.errors(up) - self.errors(down)) / (up[i] - down[i]))
        self.is_smooth = was_smooth
        return np.stack(columns, axis=1)

    def covariance(self, x: Float[np.ndarray, " p"]) -> Float[np.ndarray, "p p"]:
        """Return the covariance of a solution for residuals that are correlated in time.

        (H)^-1 S (H)^-1 with H = J'J and S the sum of J'r r'J over pairs of residuals of one log, of
        weights that fall to zero at the longest correlation time (Newey and West, 1987), but no
        less than that of uncorrelated residuals.
        """
        jacobian, errors, count = self.jacobian(x), self.errors(x), len(x)
        prior = jacobian[-count:]
        middle, plain, row = prior.T @ prior, prior.T @ prior, 0
        for log, kept in zip(self._logs, self._rows, strict=True):
            n = int(kept.sum())
            J, r = jacobian[row : row + n], errors[row : row + n]
            row += n
            score = J * r[:, None]
            interval = np.diff(log.time[kept]).mean()
            middle = middle + score.T @ score
            plain = plain + J.T @ J * np.mean(r**2)
            lags = min(math.ceil(CORRELATION / interval), n - 1)
            for lag in range(1, lags):
                pairs = score[lag:].T @ score[:-lag] * (1 - lag / lags)
                middle = middle + pairs + pairs.T
        inverse = np.linalg.inv(jacobian.T @ jacobian)
        robust, simple = (inverse @ one @ inverse for one in (middle, plain))
        larger = np.sqrt(np.maximum(np.diag(simple) / np.diag(robust), 1.0))
        return robust * np.outer(larger, larger)
