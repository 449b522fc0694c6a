"""Comparison of a real robot's log with the replay of its joint targets in simulation."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from phasmid.arguments import checked
from phasmid.errors import InvalidInput, located
from phasmid.identification.bootstrap import BlockBootstrap
from phasmid.identification.replay_fit import SKIPPED, Fit, fit_servo
from phasmid.identification.replays import Replay, Replayer, command_knots, interpolated
from phasmid.identification.robot_log import RobotLog, log_of_recording, read_csv_log
from phasmid.kinematics import body_from_hip, foot_position
from phasmid.motion.trajectory import joint_names
from phasmid.recording import Recording, load_recording
from phasmid.robot import Robot
from phasmid.scenario import Scenario, load_scenario, recorded_scenario
from phasmid.servo import Servo
from phasmid.servo.law import output_per_tick

LEAST_EXCITATION = math.radians(2)
"""Least range of the joint that moves most [rad]."""

LEAST_TORQUE = 0.02
"""Least root mean square of a torque against which an angle error is held [N·m]."""

LEAST_SHARE = 0.02
"""Least share of the squared error of a cause that is named."""

LEAST_ERROR = math.radians(0.01)
"""Root mean square of the error below which log and replay count as equal [rad]."""

Progress = Callable[[float], None]
"""Receives how many replays are done."""


@dataclass(frozen=True)
class Quantity:
    """Quantity of a robot beside that of its simulation, in SI.

    Attributes:
        name: Name.
        unit: Unit.
        robot: Of the robot.
        simulation: Of the replay with the scenario's servo; None: has no counterpart there.
        difference: Robot minus simulation.
        interval: 95 % interval of the difference, or of the robot's number without a counterpart.
        share: For a cause, its share of the squared error of the joint angles.
        field: For a cause, the field of the servo that stands for it.
    """

    name: str
    unit: str
    robot: float
    simulation: float | None = None
    difference: float | None = None
    interval: tuple[float, float] | None = None
    share: float | None = None
    field: str = ""


@dataclass(frozen=True, eq=False)
class Comparison:
    """Robot's log beside its replay in simulation.

    Attributes:
        log: The log.
        scenario: Scenario of the replay.
        robot: Its robot, L legs.
        quantities: All quantities that the log contains, causes first.
        servo: The servo whose replay is nearest to the log.
        simulated: Joint angles with the scenario's servo at the log's times [rad], (N, L, 3).
        fitted: Those with the fitted servo [rad], shape (N, L, 3).
        used: Samples that were compared, shape (N,).
        error: Root mean square of log minus `simulated` [rad].
        rest: Root mean square of log minus `fitted` [rad].
        rest_share: Share of the squared error that no cause explains; None without an error.
    """

    log: RobotLog
    scenario: Scenario
    robot: Robot
    quantities: tuple[Quantity, ...]
    servo: Servo
    simulated: Float[np.ndarray, "time legs 3"]
    fitted: Float[np.ndarray, "time legs 3"]
    used: Bool[np.ndarray, " time"]
    error: float
    rest: float
    rest_share: float | None

    def __getitem__(self, name: str) -> Quantity:
        """Return a quantity by its name."""
        return next(each for each in self.quantities if each.name == name)

    @property
    def largest_cause(self) -> Quantity | None:
        """Cause with the largest notable share whose interval excludes zero, or None."""
        causes = [each for each in self.quantities if (each.share or 0.0) > LEAST_SHARE]
        sure = [q for q in causes if q.interval and not q.interval[0] <= 0 <= q.interval[1]]
        return max(sure, key=lambda each: each.share or 0.0, default=None)

    @property
    def sentence(self) -> str:
        """Largest cause and the field that would be changed."""
        if self.error < LEAST_ERROR:
            return "The joint angles of the log are those of the simulation."
        cause = self.largest_cause
        if cause is None:
            return (
                "No cause stands out: none that is certain explains more than "
                f"{100 * LEAST_SHARE:g} % of the squared error."
            )
        value = getattr(self.servo, cause.field)
        advice = f"{cause.field} = {value:.3g}"
        if cause.field == "backlash":
            advice = f"backlash_deg = {math.degrees(value):.2g}"
        if cause.field == "delay":
            advice = f"delay_ms = {1000 * value:.3g}"
        slope = _nearest_slope(self.servo) if cause.field == "gain_scale" else None
        more = f", or compliance_slope = {slope:g}" if slope else ""
        return (
            f"Largest cause: {cause.name}, {100 * (cause.share or 0):.0f} % of the squared error. "
            f"Set {advice}{more} in [servo] of the robot's file."
        )


def _nearest_slope(servo: Servo) -> float | None:
    """Return the maker's compliance slope nearest to a fitted gain, if it is another one."""
    if servo.law != "compliance":
        return None
    fitted = servo.effective_slope[0]
    own = fitted * servo.gain_scale
    nearest = 2.0 ** round(math.log2(fitted))
    return nearest if nearest != own and abs(math.log2(fitted / nearest)) < 0.15 else None


def servo_stiffness(servo: Servo, voltage: float) -> float:
    """Return the torque at standstill per position error of a servo's law [N·m/rad]."""
    motor = servo.motor
    stall = motor.constant * voltage / motor.resistance
    return stall * output_per_tick(servo) / servo.resolution


@checked
def compare(
    log: str | Path | Recording,
    scenario: Scenario | str | Path | None = None,
    *,
    progress: Progress | None = None,
) -> Comparison:
    """Compare a robot's log with the replay of its joint targets on simulated servos.

    The log's targets move the simulated robot, whose servos have their own law. Delay, gain,
    backlash and friction of the servos are then fitted to the measured joint angles; intervals
    come from a bootstrap of blocks of the log.

    Args:
        log: A recording, its file or folder, or a ``.csv`` file; docs/recordings.md describes its
            columns.
        scenario: The scenario of the robot, or its name or file; its drive is ignored. None: that
            of the recording, or ``paper`` for a CSV file.
        progress: Receives how many replays are done.

    Raises:
        InvalidInput: The log cannot be read, is too short or has no motion; the robot cannot
            follow its targets, or falls in the replay.
    """
    found, scenario, robot = _read(log, scenario)
    with located(found.name):
        return _compare(found, scenario, robot, progress)


def _read(
    source: str | Path | Recording, scenario: Scenario | str | Path | None
) -> tuple[RobotLog, Scenario, Robot]:
    """Return log, scenario and robot."""
    if isinstance(scenario, str | Path):
        scenario = load_scenario(scenario)
    if isinstance(source, str | Path):
        path = Path(source)
        if path.suffix.lower() == ".csv":
            scenario = scenario or load_scenario()
            robot = scenario.build().robot
            return read_csv_log(path, robot), scenario, robot
        recording = load_recording(path)
        name = path.stem
    else:
        recording, name = source, "recording"
    if scenario is None:
        scenario = recorded_scenario(recording.attrs)
    robot = scenario.build().robot
    return log_of_recording(recording, name, robot), scenario, robot


def _compare(
    log: RobotLog, scenario: Scenario, robot: Robot, progress: Progress | None
) -> Comparison:
    moves = np.ptp(log.target, axis=0).ravel()
    most = int(moves.argmax())
    if moves[most] < LEAST_EXCITATION:
        raise InvalidInput(
            f"no joint target moves by more than {math.degrees(moves[most]):.2g}° "
            f"({joint_names(robot)[most]}); a comparison needs "
            f"{math.degrees(LEAST_EXCITATION):g}° or more.",
            hint="the log of a walk",
        )
    supply = log.measured.get("voltage")
    if supply is not None and scenario.servo.voltage is None:
        scenario = scenario.replace(voltage=float(np.nanmean(supply)))
        robot = scenario.build().robot
    servo = robot.servo
    used = log.time >= SKIPPED
    bootstrap = BlockBootstrap(log.time)
    replayer = Replayer(log, scenario, progress)
    fit = fit_servo(log, replayer, servo, bootstrap)
    begun, fitted = fit.begun.at(0.0), fit.fitted.at(fit.shift)
    # The body is compared at the same phase of the walk.
    in_phase = fit.begun.at(fit.shift)
    error, rest = (
        float(np.sqrt(np.nanmean((log.position - each.position)[used] ** 2)))
        for each in (begun, fitted)
    )
    differs = error >= LEAST_ERROR and fit.shares is not None
    quantities = [
        *_causes(fit, servo, servo.voltage, replayer.lag, differs),
        *_loads(log, fit, begun, fitted, servo.delay + replayer.lag, bootstrap, used),
        _sag(log, fit, begun, fitted, robot, servo.delay + replayer.lag, bootstrap, used),
        *_body(log, in_phase, bootstrap, used),
        *_clock(log, bootstrap),
    ]
    return Comparison(
        log,
        scenario,
        robot,
        tuple(quantities),
        replace(fit.servo, delay=float(max(0.0, servo.delay + fit.shift))),
        begun.position,
        fitted.position,
        used,
        error,
        rest,
        1.0 - float(fit.shares.sum()) if differs and fit.shares is not None else None,
    )


def _quantity(
    name: str,
    unit: str,
    bootstrap: BlockBootstrap,
    terms: np.ndarray,
    values: Callable[[np.ndarray], np.ndarray],
) -> Quantity:
    """Return a quantity whose values of robot and simulation follow from sums of terms.

    Args:
        name: Its name.
        unit: Its unit.
        bootstrap: Gives the interval of the difference.
        terms: Terms of each sample, shape (N, K).
        values: Returns both values, shape (..., 2), of sums of shape (..., K).
    """

    def with_difference(sums: np.ndarray) -> np.ndarray:
        both = values(sums)
        return np.concatenate([both, both[..., :1] - both[..., 1:]], axis=-1)

    found, half = bootstrap.estimate(terms, with_difference)
    robot, simulation, difference = found.tolist()
    width = float(half[2])
    interval = difference - width, difference + width
    return Quantity(name, unit, robot, simulation, difference, interval)


def _causes(fit: Fit, servo: Servo, voltage: float, lag: float, differs: bool) -> list[Quantity]:
    """Return latency, stiffness, backlash and friction; those that the fit determines.

    The latency is the time from a target to its reading, with the lag of the sensors.
    """
    base = servo_stiffness(servo, voltage) / servo.gain_scale
    rows = [
        ("latency", "s", servo.delay, 1.0, "delay"),
        ("stiffness", "N·m/rad", servo.gain_scale, base, "gain_scale"),
        ("backlash", "rad", servo.backlash, 1.0, "backlash"),
        ("friction", "N·m", servo.friction, 1.0, "friction"),
    ]
    found = []
    for k, (name, unit, own, factor, field) in enumerate(rows):
        if not math.isfinite(fit.values[k]):
            continue
        value, own = factor * float(fit.values[k]), factor * own
        difference = value - own
        late = lag if name == "latency" else 0.0
        share = float(fit.shares[k]) if differs and fit.shares is not None else None
        half = factor * float(fit.half_widths[k])
        interval = difference - half, difference + half
        found.append(
            Quantity(name, unit, value + late, own + late, difference, interval, share, field)
        )
    return found


def _loads(
    log: RobotLog,
    fit: Fit,
    begun: Replay,
    fitted: Replay,
    latency: float,
    bootstrap: BlockBootstrap,
    used: np.ndarray,
) -> list[Quantity]:
    """Return the angle error per torque in stance and swing: regression through the origin.

    The robot's torques are estimated by the fitted replay. Targets count when they take effect.
    """
    found = []
    for name, is_stance in (("stance", True), ("swing", False)):
        terms = []
        for position, replayed, delay in (
            (log.position, fitted, latency + fit.shift),
            (begun.position, begun, latency),
        ):
            error = _delayed(log, delay) - position
            where = (fitted.contact == is_stance)[..., None] & used[:, None, None]
            where = where & np.isfinite(error)
            torque = np.where(where, replayed.torque, 0.0)
            error = np.where(where, error, 0.0)
            count = max(1, int(where.sum()))
            if np.sqrt((torque**2).sum() / count) < LEAST_TORQUE:
                break
            terms += [(torque * error).sum(axis=(1, 2)), (torque**2).sum(axis=(1, 2))]
        if len(terms) < 4:
            continue

        def slopes(sums: np.ndarray) -> np.ndarray:
            return np.asarray(sums[..., ::2] / sums[..., 1::2])

        rows = np.stack(terms, axis=1)
        found.append(_quantity(f"compliance, {name}", "rad/(N·m)", bootstrap, rows, slopes))
    return found


def _delayed(log: RobotLog, delay: float) -> Float[np.ndarray, "time legs 3"]:
    """Return the log's targets as they were a delay before the positions were read."""
    at = log.time[:, None, None] if log.read_time is None else log.read_time
    knots, targets = command_knots(log)
    return interpolated(np.broadcast_to(at - delay, log.target.shape), knots, targets)


def _height(robot: Robot, q: np.ndarray, stance: np.ndarray) -> Float[np.ndarray, " time"]:
    """Return the height of the body over its standing feet [m]; NaN where none stands."""
    height = -body_from_hip(robot, foot_position(robot.arrays, np.nan_to_num(q)))[..., 2]
    known = stance & np.isfinite(q).all(axis=2)
    count = known.sum(axis=1)
    total = np.where(known, height, 0.0).sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _sag(
    log: RobotLog,
    fit: Fit,
    begun: Replay,
    fitted: Replay,
    robot: Robot,
    latency: float,
    bootstrap: BlockBootstrap,
    used: np.ndarray,
) -> Quantity:
    """Return how much lower than its targets the body stands over the standing feet."""
    stance = fitted.contact
    wanted = _height(robot, _delayed(log, latency + fit.shift), stance)
    own = wanted - _height(robot, log.position, stance)
    own_wanted = _height(robot, _delayed(log, latency), begun.contact)
    simulated = own_wanted - _height(robot, begun.position, begun.contact)
    return _mean("sag of the body", "m", own, simulated, bootstrap, used)


def _mean(
    name: str,
    unit: str,
    robot: np.ndarray,
    simulation: np.ndarray | None,
    bootstrap: BlockBootstrap,
    used: np.ndarray,
) -> Quantity:
    """Return the means of a quantity where both are known, and their difference."""
    simulated = np.zeros_like(robot) if simulation is None else simulation
    known = used & np.isfinite(robot) & np.isfinite(simulated)
    columns = [np.where(known, values, 0.0) for values in (robot, simulated)]
    terms = np.stack([*columns, known.astype(float)], axis=1)

    found = _quantity(
        name, unit, bootstrap, terms, lambda sums: sums[..., :2] / np.maximum(sums[..., 2:], 1)
    )
    return replace(found, simulation=None, difference=None) if simulation is None else found


def _spread(
    name: str,
    unit: str,
    robot: np.ndarray,
    simulation: np.ndarray,
    bootstrap: BlockBootstrap,
    used: np.ndarray,
) -> Quantity:
    """Return the standard deviations of a quantity where both are known."""
    known = used & np.isfinite(robot) & np.isfinite(simulation)
    columns = [np.where(known, values, 0.0) for values in (robot, simulation)]
    terms = np.stack([*columns, *(c**2 for c in columns), known.astype(float)], axis=1)

    def spreads(sums: np.ndarray) -> np.ndarray:
        count = np.maximum(sums[..., 4:], 1)
        variance = sums[..., 2:4] / count - (sums[..., :2] / count) ** 2
        return np.sqrt(np.maximum(variance, 0.0))

    return _quantity(name, unit, bootstrap, terms, spreads)


def _body(
    log: RobotLog, begun: Replay, bootstrap: BlockBootstrap, used: np.ndarray
) -> list[Quantity]:
    """Return what else the log contains: tilt, turn rates, distance, supply, temperature."""
    found = []
    for name in ("roll", "pitch"):
        if name in log.measured:
            both = log.measured[name], begun.measured[name]
            found.append(_mean(f"{name}, mean", "rad", *both, bootstrap, used))
            found.append(_spread(f"{name}, deviation", "rad", *both, bootstrap, used))
        if f"{name}_rate" in log.measured:
            both = log.measured[f"{name}_rate"], begun.measured[f"{name}_rate"]
            found.append(_spread(f"{name} rate, deviation", "rad/s", *both, bootstrap, used))
    if "distance" in log.measured:
        found.append(_distance(log.measured["distance"], begun.measured["distance"], bootstrap))
    if "temperature" in log.measured:
        both = log.measured["temperature"], begun.measured["temperature"]
        found.append(_mean("temperature", "°C", *both, bootstrap, used))
    if "voltage" in log.measured:
        found.append(_mean("supply voltage", "V", log.measured["voltage"], None, bootstrap, used))
    return found


def _distance(robot: np.ndarray, simulation: np.ndarray, bootstrap: BlockBootstrap) -> Quantity:
    """Return the distance from the log's first row to its last; the interval by its increments."""
    known = np.flatnonzero(np.isfinite(robot))
    gaps = np.interp(np.arange(len(robot)), known, robot[known])
    steps = np.stack([np.diff(each, prepend=each[0]) for each in (gaps, simulation)], axis=1)

    return _quantity("distance", "m", bootstrap, steps, lambda sums: sums)


def _clock(log: RobotLog, bootstrap: BlockBootstrap) -> list[Quantity]:
    """Return sample rate and jitter of the log."""
    step = np.diff(log.time, append=2 * log.time[-1] - log.time[-2])
    terms = np.stack([np.ones_like(step), step, step**2], axis=1)

    def numbers(sums: np.ndarray) -> np.ndarray:
        mean = sums[..., 1] / sums[..., 0]
        variance = np.maximum(sums[..., 2] / sums[..., 0] - mean**2, 0.0)
        return np.stack([1 / mean, np.sqrt(variance)], axis=-1)

    values, half = bootstrap.estimate(terms, numbers)
    return [
        Quantity(name, unit, float(value), interval=(float(value - width), float(value + width)))
        for name, unit, value, width in zip(
            ("sample rate", "jitter"), ("Hz", "s"), values, half, strict=True
        )
    ]
