"""Fit of a servo's parameters to logs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.identification.logs import SETTLING, BenchLog, Log, compared_rows
from phasmid.identification.parameters import (
    PARAMETERS,
    Model,
    check_names,
    parameter_names,
    servo_records,
    start_values,
)
from phasmid.identification.result import QUANTILE, Identification
from phasmid.identification.simulation import simulate_logs, time_step
from phasmid.servo import Servo
from phasmid.servo.servo import FULL_PUNCH

CHANGE, LEAST_CHANGE, LAST_CHANGE = 0.3, 0.005, 0.05
"""Changes of a parameter for a derivative, by the share of the squared errors that they make:
first, least, and for intervals. Simulated angles are rough in the parameters, since sensors have
steps and friction holds: small changes would measure that roughness."""

WIDEST = 0.3
"""Largest change of a parameter for a derivative, as a share of its size."""

FINER = 1000
"""How much finer the servo's sensor is taken at first and for intervals: with its steps, the
simulated angles are rougher in the parameters."""

RESTART = 0.4
"""Time after which the first simulations restart from measured states [s]."""

CORRELATION = 0.5
"""Longest time over which residuals are taken as correlated, as the errors of a coarse sensor are
while the servo is slow [s]."""

PRIOR = 1.0
"""Standard deviation of each parameter about its start, as a share of its size: without it the fit
would wander along directions that the logs do not determine."""


def identify(
    logs: Sequence[Log],
    servo: Servo,
    *,
    model: Model = "own",
    fixed: Sequence[str] = (),
    hanging: float = 0.0,
) -> Identification:
    """Fit a servo's parameters to logs by nonlinear least squares over simulated angles.

    Args:
        logs: Logs of one servo on a bench, or of legs whose servos are alike.
        servo: Start of the fit; its law, resolution and settings are kept.
        model: Friction model: ``own``, or ``m1`` to ``m6`` of BAM.
        fixed: Parameters that keep the servo's values.
        hanging: Expected angle of the hanging pendulum as the servo reports it [rad].

    Raises:
        InvalidInput: There is no log, a log is shorter than the settling time, logs of benches and
            legs are mixed, or a fixed parameter is unknown.
    """
    if not logs:
        raise InvalidInput("no log is given.")
    for log in logs:
        if log.time[-1] - log.time[0] < 2 * SETTLING:
            raise InvalidInput(
                f"{log.name} lasts {log.time[-1] - log.time[0]:.3g} s; a log must last "
                f"{2 * SETTLING:g} s or more."
            )
    is_bench = isinstance(logs[0], BenchLog)
    if any(isinstance(log, BenchLog) != is_bench for log in logs):
        raise InvalidInput("logs of a bench and of a leg need a fit each.")
    known = parameter_names(servo, model)
    if not is_bench:
        known.remove("hanging")
    check_names(fixed, known)
    start = start_values(servo, model, hanging)
    names = tuple(name for name in known if name not in fixed)
    kept = {name: start[name] for name in known if name in fixed}
    problem = _Problem(servo, model, tuple(logs), names, kept, start)
    # Over a long time a swinging pendulum gets out of phase, and its angle no longer shows in which
    # direction a parameter is wrong: short stretches come first.
    problem.period = RESTART
    problem.solve(FIRST_ITERATIONS)
    problem.forget_backlash()
    problem.period = math.inf
    problem.solve(MOST_ITERATIONS)
    margin = problem.round_margin()
    problem.try_again(BENCH_STARTS if is_bench else LEG_STARTS)
    return Identification(
        servo,
        model,
        tuple(logs),
        problem.names,
        problem.kept,
        margin,
        problem.values,
        (problem.covariance() + problem.bound_variance) * np.outer(problem.scale, problem.scale),
        tuple(problem.simulate(problem.x)),
        problem.evaluations,
    )


INSIDE = 0.3
"""Distance of the start from bounds, as a share of the size."""

FIRST_ITERATIONS, MOST_ITERATIONS = 4, 20
"""Iterations over short stretches, and most over whole logs."""

LEAST_GAIN = 1e-3
"""Share of the squared errors below which an iteration gains nothing."""

BENCH_STARTS, LEG_STARTS = 1, 3
"""Further starts after a solution; legs that rattle in their backlash have more local minima."""

APART = 0.2
"""Distance of these starts in shares of the sizes."""

DERIVATIVES = 4
"""Derivatives for intervals."""

PATIENCE = 3
"""Iterations in a row without a gain after which a fit ends."""

DAMPINGS = 0.0, 1e-3, 1e-2, 0.1, 1.0, 10.0
"""Weights on the change of each parameter that an iteration tries (Levenberg and Marquardt)."""

AT_BOUND = 1e-3
"""Distance from a bound up to which a parameter counts as at it, as a share of its size."""

FIRST_WIDTH = 0.05
"""Change of each parameter for the first derivative, as a share of its size."""

LARGEST_ERROR = 1e6
"""Largest residual that counts [standard deviations]: simulations may diverge."""


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

    Attributes:
        names: Free parameters.
        kept: Values of the others.
        scale: Sizes of the free ones.
        x: Free parameters over their sizes.
        is_smooth: Simulate with a finer sensor.
        period: Time after which the simulation restarts from measured states [s].
        evaluations: Number of simulations.
    """

    def __init__(
        self,
        servo: Servo,
        model: Model,
        logs: tuple[Log, ...],
        names: tuple[str, ...],
        kept: Mapping[str, float],
        start: Mapping[str, float],
    ) -> None:
        self._servo, self._model, self._logs = servo, model, logs
        self._dt = time_step(logs, servo)
        self.names, self.kept = names, dict(kept)
        own = [PARAMETERS[name] for name in names]
        self.scale = np.array([max(abs(start[p.name]), p.scale) for p in own])
        self._low, self._high = (
            np.array([getattr(p, key) for p in own]) / self.scale for key in ("low", "high")
        )
        # The derivative of a product with a parameter of zero would be zero.
        first = np.array([start[name] for name in names]) / self.scale
        self._start = np.clip(first, self._low + INSIDE, self._high - INSIDE)
        self.x = self._start
        self._noise = servo.resolution / math.sqrt(12)
        # Rows of each log with readings that are compared, and which of them are.
        compared = [compared_rows(log) for log in logs]
        self._rows = [one.any(axis=1) for one in compared]
        self._compared = [one[rows] for one, rows in zip(compared, self._rows, strict=True)]
        self.is_smooth, self.period, self.evaluations = True, math.inf, 0
        self._rng = np.random.default_rng(0)

    @property
    def values(self) -> Float[np.ndarray, " p"]:
        """Values of the free parameters."""
        return self.x * self.scale

    def _all_values(self, x: Float[np.ndarray, " p"]) -> dict[str, float]:
        """Return the values of the servo's parameters, free and kept."""
        return {**self.kept, **dict(zip(self.names, (x * self.scale).tolist(), strict=True))}

    def solve(self, iterations: int) -> float:
        """Minimize the errors from where the parameters are, and return half their squares.

        Gauss and Newton's method with derivatives by wide central differences along the singular
        vectors of the last derivative, each as wide as changes the errors by a share that falls
        where the method gains little.
        """
        # Lazy import: scipy.optimize takes 0.2 s.
        from scipy.optimize import lsq_linear

        share, idle = CHANGE, 0
        errors = self.errors(self.x)
        cost = 0.5 * errors @ errors
        jacobian = None
        for _ in range(iterations):
            jacobian = self.jacobian(self.x, self._changes(jacobian, share * cost))
            q, r = np.linalg.qr(jacobian)
            aim, lengths, best = q.T @ errors, np.linalg.norm(r, axis=0), math.inf
            bounds = self._low - self.x - 1e-9, self._high - self.x + 1e-9
            for damping in DAMPINGS:
                damped = np.vstack([r, np.diag(math.sqrt(damping) * lengths)])
                change = lsq_linear(damped, np.concatenate([-aim, 0 * aim]), bounds).x
                x = np.clip(self.x + change, self._low, self._high)
                tried = self.errors(x)
                if 0.5 * tried @ tried < best:
                    best, found = 0.5 * tried @ tried, (x, tried)
            gain = 1 - best / cost
            if gain > 0:
                cost, (self.x, errors) = best, found
            if gain < 0.2 * share:
                share = max(share / 2, LEAST_CHANGE)
            idle = 0 if gain > LEAST_GAIN else idle + 1
            if idle == PATIENCE and share == LEAST_CHANGE:
                break
        return float(cost)

    def _changes(
        self, jacobian: Float[np.ndarray, "n p"] | None, change: float
    ) -> Float[np.ndarray, "p p"]:
        """Return changes of the parameters for a derivative, in columns.

        Args:
            jacobian: The last derivative; None: there is none.
            change: Half of the squared errors by which they change the angles.
        """
        count = len(self.x)
        if jacobian is None:
            return np.eye(count) * FIRST_WIDTH
        _, values, directions = np.linalg.svd(np.linalg.qr(jacobian, mode="r"))
        # The prior makes no singular value smaller; an average of one-sided changes may.
        widths = np.minimum(np.sqrt(2 * change) / np.maximum(values, 1 / PRIOR), WIDEST)
        # No direction twice: where a fit rests, others show a way on.
        turn, _ = np.linalg.qr(self._rng.normal(size=(count, count)))
        columns: np.ndarray = directions.T * widths @ turn
        return columns

    def round_margin(self) -> float | None:
        """Solve with the servo's own sensor; the compliance margin is a whole number of ticks.

        Returns:
            The half width of the margin's interval before [ticks]; None where it is not free.
        """
        if "compliance_margin" not in self.names:
            self.is_smooth = False
            self.solve(MOST_ITERATIONS)
            return None
        i = self.names.index("compliance_margin")
        width = QUANTILE * math.sqrt(self.covariance()[i, i]) * self.scale[i]
        fitted = self.values[i]
        self.is_smooth = False
        self.names = tuple(name for name in self.names if name != "compliance_margin")
        self.scale = np.delete(self.scale, i)
        for key in ("x", "_low", "_high", "_start"):
            setattr(self, key, np.delete(getattr(self, key), i))
        ticks = max(round(fitted), 0)
        self.kept["compliance_margin"] = float(ticks)
        self._shift(ticks - fitted)
        best, tried = (self.solve(MOST_ITERATIONS), ticks, self.x), {ticks}
        # What else a solution has found helps its neighbours.
        while new := {best[1] - 1, best[1] + 1} - tried - {-1}:
            for ticks in sorted(new):
                self.kept["compliance_margin"], self.x = float(ticks), best[2]
                self._shift(ticks - best[1])
                best = min(
                    best, (self.solve(MOST_ITERATIONS), ticks, self.x), key=lambda one: one[0]
                )
            tried |= new
        self.kept["compliance_margin"], self.x = float(best[1]), best[2]
        return width

    def _shift(self, ticks: float) -> None:
        """Change free punch and slope as keeps the output while the margin changes by ticks."""
        own = self._all_values(self.x)
        punch, slope = own["punch"] / FULL_PUNCH, own["compliance_slope"]
        raised = min(max(punch + ticks * (1 - punch) / slope, 0.0), 0.5)
        shifted = {
            "punch": raised * FULL_PUNCH,
            "compliance_slope": slope * (1 - raised) / (1 - punch),
        }
        self.x = self.x.copy()
        for name, value in shifted.items():
            if name in self.names:
                i = self.names.index(name)
                self.x[i] = value / self.scale[i]
        self.x = np.clip(self.x, self._low, self._high)

    def forget_backlash(self) -> None:
        """Set the backlash to its start: where a rotor is in it no measured state shows."""
        if "backlash" in self.names:
            i = self.names.index("backlash")
            self.x[i] = self._start[i]

    def try_again(self, starts: int) -> None:
        """Solve from further starts around the solution, and keep the best."""
        best = self.solve(0), self.x
        for _ in range(starts):
            moved = best[1] + APART * self._rng.normal(size=len(best[1]))
            self.x = np.clip(moved, self._low, self._high)
            best = min(best, (self.solve(MOST_ITERATIONS), self.x), key=lambda one: one[0])
        self.x = best[1]

    def simulate(self, x: Float[np.ndarray, " p"]) -> list[np.ndarray]:
        """Return the simulated angles of each log [rad]."""
        self.evaluations += 1
        values = self._all_values(x)
        voltages = [log.voltage for log in self._logs]
        parameters = servo_records(self._servo, self._model, values, voltages, self._dt)
        if self.is_smooth:
            make_finer(parameters)
        return simulate_logs(
            self._logs,
            parameters,
            values["delay"],
            values.get("hanging", 0.0),
            period=self.period,
        )

    def errors(self, x: Float[np.ndarray, " p"]) -> Float[np.ndarray, " n"]:
        """Return residuals in standard deviations of a sensor's step, then those of the prior.

        A row of a log gives one for each joint, 0 where that is not compared.
        """
        parts = []
        with np.errstate(over="ignore", invalid="ignore"):
            for one, log, rows, compared in zip(
                self.simulate(x), self._logs, self._rows, self._compared, strict=True
            ):
                apart = (one - log.position)[rows].reshape(compared.shape) / self._noise
                parts.append(np.where(compared, apart, 0.0).ravel())
        errors = np.clip(np.concatenate(parts), -LARGEST_ERROR, LARGEST_ERROR)
        return np.concatenate([np.nan_to_num(errors), (x - self._start) / PRIOR])

    def jacobian(
        self, x: Float[np.ndarray, " p"], changes: Float[np.ndarray, "p p"]
    ) -> Float[np.ndarray, "n p"]:
        """Return the derivative of the errors by central differences, one-sided at bounds.

        Args:
            x: Where.
            changes: Of the parameters, in columns.
        """
        ups = np.clip(x[:, None] + changes, self._low[:, None], self._high[:, None])
        downs = np.clip(x[:, None] - changes, self._low[:, None], self._high[:, None])
        pairs = zip(ups.T, downs.T, strict=True)
        differences = [self.errors(up) - self.errors(down) for up, down in pairs]
        jacobian: np.ndarray = np.stack(differences, axis=1) @ np.linalg.pinv(ups - downs)
        return jacobian

    def covariance(self) -> Float[np.ndarray, "p p"]:
        """Return the covariance of the solution for residuals that are correlated in time.

        (H)^-1 S (H)^-1 with H = J'J and S the sum of J'r r'J over pairs of residuals of one log, of
        weights that fall to zero at the longest correlation time (Newey and West, 1987), but no
        less than that of uncorrelated residuals. Every product has two of several derivatives J,
        each with changes in other directions: what is rough in one does not count.
        """
        x, was_smooth = self.x, self.is_smooth
        errors, count = self.errors(x), len(x)
        self.is_smooth, found = True, [self.jacobian(x, self._changes(None, 0.0))]
        for _ in range(DERIVATIVES):
            changes = self._changes(found[-1], LAST_CHANGE * 0.5 * errors @ errors)
            found.append(self.jacobian(x, changes))
        self.is_smooth, jacobians = was_smooth, np.stack(found[1:])
        prior = np.eye(count) / PRIOR**2
        own, middle, plain, row = prior, 0 * prior, prior, 0
        for log, rows, compared in zip(self._logs, self._rows, self._compared, strict=True):
            part = slice(row, row := row + compared.size)
            J, r = jacobians[:, part] * compared.reshape(-1, 1), errors[part]
            score = (J * r[:, None]).reshape(len(J), len(compared), -1, count).sum(axis=2)
            product = _product(J, J)
            own, plain = own + product, plain + product * (r @ r) / compared.sum()
            middle = middle + _product(score, score)
            lags = min(math.ceil(CORRELATION / np.diff(log.time[rows]).mean()), len(compared) - 1)
            for lag in range(1, lags):
                pairs = _product(score[:, lag:], score[:, :-lag]) * (1 - lag / lags)
                middle = middle + pairs + pairs.T
        inverse = np.linalg.inv(_limited(own, PRIOR**-2))
        robust, simple = (
            inverse @ one @ inverse
            for one in (_limited(middle, 0.0) + prior, _limited(plain, PRIOR**-2))
        )
        larger = np.sqrt(np.maximum(np.diag(simple) / np.diag(robust), 1.0))
        # Logs never tell less than the prior.
        return _limited(robust * np.outer(larger, larger), 0.0, PRIOR**2)

    @property
    def bound_variance(self) -> Float[np.ndarray, "p p"]:
        """Variance of parameters at a bound, where the errors hardly depend on them."""
        is_bound = (self.x <= self._low + AT_BOUND) | (self.x >= self._high - AT_BOUND)
        variance: np.ndarray = np.diag(is_bound * PRIOR**2)
        return variance


def _product(
    left: Float[np.ndarray, "k n p"], right: Float[np.ndarray, "k n p"]
) -> Float[np.ndarray, "p p"]:
    """Return the mean product of two different ones of K matrices, the first transposed."""
    same = np.einsum("knp,knq->pq", left, right)
    product: np.ndarray = left.sum(axis=0).T @ right.sum(axis=0) - same
    return product / (len(left) * (len(left) - 1))


def _limited(
    matrix: Float[np.ndarray, "p p"], low: float, high: float = math.inf
) -> Float[np.ndarray, "p p"]:
    """Return a symmetric matrix with its eigenvalues between two limits."""
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    limited: np.ndarray = vectors * np.clip(values, low, high) @ vectors.T
    return limited
