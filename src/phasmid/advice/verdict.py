"""Servo verdict: do these servos hold this robot in this gait, for how long, with what margin.

`servo_verdict` is the one computation. The commands, the report, studies and the studio show
`ServoVerdict.lines`, so that their answers agree.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from phasmid.advice.answer import GOOD, Grade, Holding, ServoVerdict
from phasmid.advice.bounds import TorqueBounds, floor_friction, torque_bounds
from phasmid.experiment import Experiment, ScenarioLike, built
from phasmid.robot import JOINTS, Robot
from phasmid.servo import Servo
from phasmid.servo.heat import HEAT_RANGE, temperature_after, time_to_limit

HOUR = 3600.0
"""Time after which temperatures are given and judged [s]."""

BEHIND = (
    *("stall_torque", "no_load_speed", "stall_current", "friction", "continuous_torque"),
    *("thermal_resistance", "heat_capacity", "temperature_limit"),
)
"""Numbers of a servo behind its verdict."""

TIE = 1e-6
"""Relative difference of torques that count as equal; the first joint is named."""


def servo_verdict(scenario: ScenarioLike | Experiment) -> ServoVerdict:
    """Judge the servos of a robot that walks on level ground.

    The robot is at rest in the postures of its stride and of standing up. The static torque of each
    joint lies between two bounds: that of vertical foot forces, and that of the smallest largest
    share of a joint's stall torque that the floor's friction allows.

    Args:
        scenario: The scenario, or its experiment; drive and terrain's shape have no effect.

    Raises:
        InvalidInput: Robot or gait cannot be read, or a neutral foot is out of reach.

    Source: docs/holding.md.
    """
    experiment = built(scenario)
    return judge(experiment, experiment.robot, torque_bounds(experiment))


def judge(experiment: Experiment, robot: Robot, bounds: TorqueBounds) -> ServoVerdict:
    """Return the verdict on the servos of a robot of known loads.

    Args:
        experiment: Gait and ground.
        robot: The robot as supplied.
        bounds: Its static torques.
    """
    servo, limit = robot.servo, robot.servo.temperature_limit
    air, friction = servo.ambient_temperature, floor_friction(experiment)
    losses, hour, until = heat_losses(bounds, robot), None, None
    if losses is not None:
        hour = _pair(temperature_after(servo, HOUR, air, losses))
        until = _pair(time_to_limit(servo, air, losses))
    margins = margins_of(bounds, robot, losses)
    deciding = min(margins, key=lambda name: margins[name])
    low, high = (min(pair[end] for pair in margins.values()) for end in (0, 1))
    needed = bounds.statics.least_friction(bounds.torque[0])
    if needed > friction or air >= limit:
        holding = Holding.DOES_NOT_HOLD
    elif not bounds.is_stable:
        holding = Holding.NOT_STABLE
    elif margins["speed"][0] < 1:
        holding = Holding.TOO_SLOW
    elif needed > 0:
        holding = Holding.NEEDS_FRICTION
    elif low < 1 if until is None else math.isfinite(until[0]):
        holding = Holding.LIMITED
    else:
        holding = Holding.HOLDS
    grade = Grade.TIGHT if holding.is_possible and high >= 1 else Grade.NO
    if grade is Grade.TIGHT and low >= GOOD:
        grade = Grade.GOOD
    leg, joint, posture = _most_loaded(bounds)
    named = posture
    if holding is Holding.NOT_STABLE:
        named = int(np.argmin(bounds.statics.margin))
    rms = np.sqrt(bounds.lasting(bounds.torque**2)).reshape(2, -1).max(axis=1)
    found = ServoVerdict(
        holding=holding,
        grade=grade,
        servo=servo.name,
        interface=servo.interface,
        gait=experiment.course.gait.name,
        joint=f"{robot.legs[leg].name}.{JOINTS[joint]}",
        feet=tuple(int(each) + 1 for each in np.flatnonzero(bounds.postures.stance[named])),
        torque=float(bounds.torque[0, posture, leg, joint]),
        stall_torque=float(bounds.statics.limit[leg, joint]),
        peak_share=_pair(bounds.largest(bounds.torque / bounds.statics.limit)),
        least_friction=needed,
        floor_friction=friction,
        rms_torque=_pair(rms),
        continuous_torque=min(servo.continuous_torque, servo.stall_torque),
        speed_share=1 / margins["speed"][0],
        voltage=servo.voltage,
        highest_voltage=servo.maximum_voltage,
        ambient_temperature=air,
        temperature_limit=limit,
        hour_temperature=hour,
        time_to_limit=until,
        margins=margins,
        margin=(low, high),
        deciding=deciding,
        sources=_sources(servo),
    )
    return replace(found, grade=Grade.NO) if found.is_supply_too_high else found


def margins_of(
    bounds: TorqueBounds, robot: Robot, losses: Float[np.ndarray, "2"] | None
) -> dict[str, tuple[float, float]]:
    """Return allowed over needed by name, without help and with the best help.

    The continuous torque stands for heat, and counts where heat is unknown.

    Args:
        bounds: The robot's static torques.
        robot: The robot as supplied.
        losses: Result of `heat_losses` [W].
    """
    servo, arrays = robot.servo, robot.arrays
    speed = (bounds.postures.fastest / arrays.no_load_speed).max()
    needed = {
        "peak": bounds.largest(bounds.torque / bounds.statics.limit),
        "speed": np.array([speed, speed]),
    }
    air = servo.ambient_temperature
    if losses is not None:
        rise, room = (
            temperature_after(servo, HOUR, air, losses) - air,
            servo.temperature_limit - air,
        )
        needed["heat"] = rise / room if room > 0 else np.full(2, np.inf)
    else:
        continuous = arrays.strength * min(servo.continuous_torque, servo.stall_torque)
        rms = np.sqrt(bounds.lasting(bounds.torque**2))
        needed["continuous"] = bounds.largest(rms / continuous)
    return {
        name: _pair(1 / np.maximum(shares, 1e-300))
        for name, shares in needed.items()
        if not np.isnan(shares).any()
    }


def heat_losses(bounds: TorqueBounds, robot: Robot) -> Float[np.ndarray, "2"] | None:
    """Return the mean loss in the winding of the warmest servo [W], as it heats the servo.

    The highest is without help from the floor and for the servo alone, the lowest with the best
    help and in a frame that cools it. None without a known motor, and where the robot topples.
    """
    motor = robot.servo.known_motor
    if motor is None or not bounds.is_stable:
        return None
    # In torques of the servo: a stronger joint counts with less.
    current = motor.working_current(bounds.torque / robot.arrays.strength)
    power = motor.resistance * bounds.largest(bounds.lasting(current**2))
    return np.asarray(power * HEAT_RANGE[::-1])


def _most_loaded(bounds: TorqueBounds) -> tuple[int, int, int]:
    """Return leg, joint and posture of the largest share without help; of equal legs the first."""
    share = np.nan_to_num(bounds.torque[0] / bounds.statics.limit)
    joints = share.max(axis=0)
    leg, joint = (int(i) for i in np.argwhere(joints >= joints.max() * (1 - TIE))[0])
    return leg, joint, int(np.argmax(share[:, leg, joint] >= joints[leg, joint] * (1 - TIE)))


def _sources(servo: Servo) -> dict[str, tuple[str, ...]]:
    """Return the numbers behind a verdict by the kind of their source."""
    found: dict[str, tuple[str, ...]] = {}
    for name in BEHIND:
        if source := servo.sources.get(name):
            kind = source.split(" (")[0]
            found[kind] = (*found.get(kind, ()), name.replace("_", " "))
    return found


def _pair(values: Float[np.ndarray, "2"]) -> tuple[float, float]:
    return float(values[0]), float(values[1])
