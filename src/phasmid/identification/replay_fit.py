"""Least-squares fit of a simulated servo to the joint angles of a log."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from phasmid.errors import PhasmidError
from phasmid.identification.bootstrap import BlockBootstrap
from phasmid.identification.replays import Replayer, Simulated
from phasmid.identification.robot_log import RobotLog
from phasmid.servo import Servo

PARAMETERS = ("delay", "gain_scale", "backlash", "friction")
"""Fields of a servo that are fitted: the delay beyond the scenario's, the gain by its logarithm."""

PROBES = np.array([1e-3, 0.1, np.radians(0.5), 0.02])
"""Changes to either side by which the effect of each is found: [s], of the logarithm, [rad],
[N·m]. Two replays of slightly different servos differ by 0.05° at random, as feet slip and servos
chatter by ticks; smaller changes would be lost in that."""

LARGEST_STEPS = np.array([0.05, 0.5, np.radians(2), 0.1])
"""Largest changes in one iteration, in the same units."""

SMALL_STEPS = np.array([1e-5, 1e-3, np.radians(0.01), 2e-4])
"""Changes below which the log's motion is that of the scenario."""

ITERATIONS, AVERAGED = 3, 4
"""Iterations before the last ones, and those last ones, whose results are averaged."""

RENEWALS = 2
"""First iterations that find the effects anew."""

SHORTENINGS = 3
"""Halvings of a step whose replay falls."""

REPLAYS = 2 + RENEWALS * 2 * (len(PARAMETERS) - 1) + ITERATIONS + AVERAGED
"""Number of replays of a fit that does not end at once."""

SHIFTS = np.arange(-0.05, 0.3, 0.01)
"""Delays beyond the scenario's among which the fit begins [s]."""

SKIPPED = 0.25
"""Time at the beginning of a log that is left out [s]: the robot may not have been at rest."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Servo whose replay is nearest to a log.

    Attributes:
        begun: Replay with the scenario's servo.
        fitted: Replay with the fitted servo.
        shift: Delay beyond that of the scenario [s].
        servo: The fitted servo, with the scenario's delay.
        values: Fitted parameters, in the order of `PARAMETERS`; NaN where the log does not
            determine one.
        half_widths: Halves of their 95 % intervals.
        shares: Their shares of the squared error between log and replay; None where there is none.
    """

    begun: Simulated
    fitted: Simulated
    shift: float
    servo: Servo
    values: Float[np.ndarray, "4"]
    half_widths: Float[np.ndarray, "4"]
    shares: Float[np.ndarray, "4"] | None


def fit_servo(log: RobotLog, replayer: Replayer, servo: Servo, bootstrap: BlockBootstrap) -> Fit:
    """Fit delay, gain, backlash and friction of the servos by Gauss and Newton's method.

    The effects of the changes add up to the explained part of the error. The share of a parameter
    is the projection of its part on the whole error, so that all shares and that of the rest add
    up to one. The last iterations keep the effects, and their mean is the result: single replays
    scatter, and the intervals contain that scatter.

    Args:
        log: The log.
        replayer: Simulates its targets.
        servo: The servo of the scenario.
        bootstrap: Of the log's samples.
    """
    from scipy.special import stdtrit

    work = _Residuals(log, replayer, servo)
    x = work.start
    begun = simulated = work.replay(x)
    first = rest = work.error(begun, x)
    parts = np.zeros((len(PARAMETERS), *first.shape))
    # The delay comes first: the effects of the others are seen at the right time only.
    shift = min(SHIFTS, key=lambda each: work.size(begun, each))
    if work.size(begun, shift) < work.size(begun, 0.0):
        x = x + np.array([shift, 0.0, 0.0, 0.0])
        rest = work.error(begun, x)
        parts[0] = first - rest
    averaged: list[np.ndarray] = []
    effects = np.empty_like(parts)
    for iteration in range(ITERATIONS + AVERAGED):
        if iteration < RENEWALS:
            effects, kept, kept_parts = work.effects(x, simulated), x, parts
        change = work.step(x, effects, rest)
        if iteration == 0 and (np.abs(change) < SMALL_STEPS).all():
            break
        x, simulated = work.move(x, change)
        rest = work.error(simulated, x)
        parts = kept_parts + (x - kept)[:, None, None] * effects
        if iteration >= ITERATIONS:
            averaged.append(x)
    scatter = np.zeros(len(x))
    if averaged:
        t = float(stdtrit(AVERAGED - 1, 0.975))
        scatter = t * np.std(averaged, axis=0, ddof=1) / np.sqrt(AVERAGED)
        x = np.mean(averaged, axis=0)
        simulated = work.replay(x)
        rest = work.error(simulated, x)
        parts = kept_parts + (x - kept)[:, None, None] * effects
    half_widths = np.hypot(_half_widths(effects, rest, bootstrap), scatter)
    fitted = work.servo_of(x)
    values = np.array([servo.delay + x[0], *(getattr(fitted, name) for name in PARAMETERS[1:])])
    half_widths[1] *= fitted.gain_scale
    unknown = ~effects.any(axis=(1, 2))
    values[unknown] = half_widths[unknown] = np.nan
    whole = float((first**2).sum())
    shares = (parts * first).sum(axis=(1, 2)) / whole if whole > 0 else None
    return Fit(begun, simulated, float(x[0]), fitted, values, half_widths, shares)


class _Residuals:
    """Errors of replays against a log, for a vector of parameters in the order of `PARAMETERS`."""

    def __init__(self, log: RobotLog, replayer: Replayer, servo: Servo) -> None:
        self._log, self._replayer, self._servo = log, replayer, servo
        self._used = np.isfinite(log.position) & (log.time >= SKIPPED)[:, None, None]
        self.start = np.array([0.0, np.log(servo.gain_scale), servo.backlash, servo.friction])
        self._least = np.array([SHIFTS[0], -2.5, 0.0, 0.0])
        self._most = np.array([SHIFTS[-1], 2.5, np.radians(15), servo.stall_torque / 2])

    def servo_of(self, x: np.ndarray) -> Servo:
        """Return the servo of parameters; the delay is a shift of the replay."""
        if (x[1:] == self.start[1:]).all():
            return self._servo
        gain, backlash, friction = float(np.exp(x[1])), float(x[2]), float(x[3])
        return replace(self._servo, gain_scale=gain, backlash=backlash, friction=friction)

    def replay(self, x: np.ndarray) -> Simulated:
        """Simulate the servo of parameters."""
        return self._replayer.replay(self.servo_of(x))

    def error(self, simulated: Simulated, x: np.ndarray) -> Float[np.ndarray, "time angles"]:
        """Return the log's angles minus those of a replay; zero where nothing was measured."""
        return self._flat(self._log.position - simulated.position(x[0]))

    def size(self, simulated: Simulated, shift: float) -> float:
        """Return the sum of the squared errors."""
        return float((self.error(simulated, np.array([shift])) ** 2).sum())

    def effects(self, x: np.ndarray, simulated: Simulated) -> Float[np.ndarray, "4 time angles"]:
        """Return the changes of the angles per change of each parameter; zero: not determined."""
        later, sooner = (simulated.position(x[0] + side) for side in (PROBES[0], -PROBES[0]))
        found = [self._flat(later - sooner) / (2 * PROBES[0])]
        for k, probe in enumerate(PROBES[1:], 1):
            pair = []
            for side in (probe, -probe):
                other = x.copy()
                other[k] = np.clip(x[k] + side, self._least[k], self._most[k])
                pair.append(other)
            try:
                more, less = (self.replay(each).position(each[0]) for each in pair)
            except PhasmidError:
                # No motor overcomes such a friction, or the robot falls.
                found.append(np.zeros_like(self._flat(self._log.position)))
                continue
            found.append(self._flat(more - less) / (pair[0][k] - pair[1][k]))
        return np.array(found)

    def step(self, x: np.ndarray, effects: np.ndarray, rest: np.ndarray) -> np.ndarray:
        """Return the change of parameters that removes most of an error, within their bounds."""
        from scipy.optimize import lsq_linear

        A = effects.reshape(len(x), -1).T * LARGEST_STEPS
        low = np.maximum(-1.0, (self._least - x) / LARGEST_STEPS)
        high = np.minimum(1.0, (self._most - x) / LARGEST_STEPS)
        # Bounds must differ.
        low, high = np.minimum(low, -1e-9), np.maximum(high, 1e-9)
        found = lsq_linear(A.T @ A, A.T @ rest.ravel(), (low, high), method="bvls").x
        known = effects.any(axis=(1, 2))
        return np.where(known, found * LARGEST_STEPS, 0.0)

    def move(self, x: np.ndarray, change: np.ndarray) -> tuple[np.ndarray, Simulated]:
        """Return changed parameters and their replay, with a shorter step where the robot falls."""
        for _ in range(SHORTENINGS):
            moved = np.clip(x + change, self._least, self._most)
            try:
                return moved, self.replay(moved)
            except PhasmidError:
                change = change / 2
        return x, self.replay(x)

    def _flat(self, values: np.ndarray) -> np.ndarray:
        return np.where(self._used, values, 0.0).reshape(len(values), -1)


def _half_widths(
    effects: np.ndarray, rest: np.ndarray, bootstrap: BlockBootstrap
) -> Float[np.ndarray, "4"]:
    """Return half the 95 % intervals of least-squares parameters, by bootstrap of the samples."""
    n = len(effects)
    # In units in which all effects are about one.
    effects = effects * LARGEST_STEPS[:, None, None]
    A = np.einsum("ank,bnk->nab", effects, effects).reshape(-1, n * n)
    b = np.einsum("ank,nk->na", effects, rest)

    def solved(sums: np.ndarray) -> np.ndarray:
        matrix = sums[..., : n * n].reshape(*sums.shape[:-1], n, n)
        inverse = np.linalg.pinv(matrix, 1e-9, hermitian=True)
        return np.einsum("...ab,...b->...a", inverse, sums[..., n * n :])

    return bootstrap.estimate(np.concatenate([A, b], axis=1), solved)[1] * LARGEST_STEPS
