"""Servo verdict: do these servos hold this robot in this gait, for how long, with what margin.

`servo_verdict` is the one computation. The commands, the report, studies and the studio show
`ServoVerdict.lines`, so that their answers agree.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.advice.answer import Holding, ServoVerdict
from phasmid.advice.bounds import StaticLoads, static_loads
from phasmid.experiment import Experiment, ScenarioLike, built
from phasmid.robot import JOINTS
from phasmid.servo import Servo
from phasmid.servo.heat import HEAT_RANGE, temperature_after, time_to_limit

HOUR = 3600.0
"""Time after which temperatures are given and judged [s]."""

BEHIND = (
    *("stall_torque", "no_load_speed", "stall_current", "friction", "continuous_torque"),
    *("thermal_resistance", "heat_capacity", "standby_current", "temperature_limit"),
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
    return judge(experiment, static_loads(experiment))


def judge(experiment: Experiment, loads: StaticLoads) -> ServoVerdict:
    """Return the verdict on the servos of an experiment's robot, whose loads are known."""
    robot, servo, friction = loads.robot, loads.robot.servo, loads.friction or 0.0
    limit, air = servo.temperature_limit, servo.ambient_temperature
    warming, hour, until = warming_power(loads), None, None
    if warming is not None:
        hour = _pair(temperature_after(servo, HOUR, air, warming))
        until = _pair(time_to_limit(servo, air, warming))
    margins = margins_of(loads)
    needed = loads.least_friction()
    if not loads.is_stable:
        holding = Holding.NOT_STABLE
    elif needed > friction or air >= limit:
        holding = Holding.DOES_NOT_HOLD
    elif "speed" in margins and margins["speed"][0] < 1:
        holding = Holding.TOO_SLOW
    elif needed > 0:
        holding = Holding.NEEDS_FRICTION
    elif margins["continuous"][0] < 1 if until is None else math.isfinite(until[0]):
        holding = Holding.LIMITED
    else:
        holding = Holding.HOLDS
    leg, joint, posture = _most_loaded(loads)
    named = posture
    if holding is Holding.NOT_STABLE:
        named = int(np.argmin(loads.support_margin))
    return ServoVerdict(
        holding=holding,
        servo=servo.name,
        interface=servo.interface,
        gait=experiment.course.gait.name,
        joint=f"{robot.legs[leg].name}.{JOINTS[joint]}",
        feet=tuple(int(each) + 1 for each in np.flatnonzero(loads.postures.stance[named])),
        torque=float(loads.torque[0, posture, leg, joint]),
        stall_torque=float(robot.arrays.stall_torque[leg, joint]),
        peak_share=_pair(loads.largest(loads.share)),
        least_friction=needed,
        floor_friction=friction,
        rms_torque=_pair(loads.largest(loads.rms())),
        continuous_torque=min(servo.continuous_torque, servo.stall_torque),
        voltage=servo.voltage,
        highest_voltage=servo.maximum_voltage,
        ambient_temperature=air,
        temperature_limit=limit,
        hour_temperature=hour,
        time_to_limit=until,
        margins=margins,
        sources=_sources(servo),
    )


def margins_of(loads: StaticLoads) -> dict[str, tuple[float, float]]:
    """Return allowed over needed by name, without help and with the best help.

    The continuous torque stands for heat, and counts where heat is unknown.
    """
    servo, arrays = loads.robot.servo, loads.robot.arrays
    speed = (loads.postures.fastest / arrays.no_load_speed).max()
    needed = {"peak": loads.largest(loads.share), "speed": np.full(2, speed)}
    air, warming = servo.ambient_temperature, warming_power(loads)
    if warming is not None:
        room = servo.temperature_limit - air
        rise = temperature_after(servo, HOUR, air, warming) - air
        needed["heat"] = rise / room if room > 0 else np.full(2, np.inf)
    else:
        continuous = arrays.strength * min(servo.continuous_torque, servo.stall_torque)
        needed["continuous"] = loads.largest(loads.rms() / continuous)
    return {
        name: _pair(1 / np.maximum(shares, 1e-300))
        for name, shares in needed.items()
        if not np.isnan(shares).any()
    }


def warming_power(loads: StaticLoads) -> Float[np.ndarray, "2"] | None:
    """Return the loss that warms the warmest servo [W]: winding and electronics.

    The highest is without help from the floor and for an uncooled servo, the lowest with the best
    help and cooled by the frame. None without a known motor, and where the robot topples.
    """
    servo, motor = loads.robot.servo, loads.robot.servo.known_motor
    if motor is None or not loads.is_stable:
        return None
    # In torques of the servo: a stronger joint counts with less.
    current = motor.working_current(loads.torque / loads.robot.arrays.strength)
    winding = motor.resistance * loads.largest(loads.sustained(current**2))
    return np.asarray((winding + servo.standby_power) * HEAT_RANGE[::-1])


def _most_loaded(loads: StaticLoads) -> tuple[int, int, int]:
    """Return leg, joint and posture of the largest share without help; of equal legs the first."""
    share = np.nan_to_num(loads.share[0])
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
