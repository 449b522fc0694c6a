"""Inspection of a robot on a bus before it moves: its servos, and reasons not to start."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from phasmid.hardware.bus import MOST_LATENCY, Bus, BusError, latency_advice
from phasmid.hardware.calibration import ServoCalibration
from phasmid.hardware.control_table import Model
from phasmid.hardware.rates import achievable_rate
from phasmid.hardware.robot_bus import servo_range
from phasmid.hardware.status import StatusError, shutdown_errors
from phasmid.motion.trajectory import joint_names
from phasmid.robot import Robot
from phasmid.servo.words import servo_words

LIMIT_TOLERANCE = math.radians(5)
"""Excess of a measured angle over its joint's limit that is accepted [rad]: limp legs sag."""

COOL = 5.0
"""Least distance of a servo from its temperature limit at the start [K]."""

TIME_BASED = 4
"""Bit of ``drive_mode`` with which ``goal_speed`` is a time."""

LONG_DELAY = 100e-6
"""Return delay above which a note is given [s]."""


@dataclass
class Inspection:
    """Findings of an inspection.

    Attributes:
        rows: For each servo: joint, id, model, angle, supply, temperature and errors, as text.
        refusals: Sentences on why the robot must not start; none where it may.
        notes: Sentences on what would be better.
    """

    rows: list[list[str]] = field(default_factory=list)
    refusals: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


HEADER = ["joint", "id", "model", "angle", "supply", "temp.", "errors"]


def inspect_servos(
    bus: Bus, robot: Robot, calibration: Sequence[ServoCalibration], rate: float
) -> Inspection:
    """Inspect the servos of a robot; nothing is written to them.

    Args:
        bus: The bus.
        robot: The robot.
        calibration: Its servos, leg by leg.
        rate: Rate at which it will be controlled [1/s].
    """
    result = Inspection()
    found = bus.scan([row.id for row in calibration])
    limits = robot.arrays.joint_limits.reshape(-1, 2)
    if list(joint_names(robot)) != [row.joint for row in calibration]:
        result.refusals.append(f"the calibration has other joints than {robot.name}.")
        return result
    for row, (low, high) in zip(calibration, limits.tolist(), strict=True):
        model = found.get(row.id)
        if not isinstance(model, Model):
            answer = "no answer" if model is None else f"unknown model {model}"
            result.rows.append([row.joint, str(row.id), answer, "", "", "", ""])
            result.refusals.append(f"servo {row.id} ({row.joint}): {answer}.")
            continue
        try:
            _inspect_servo(bus, row, model, low, high, result)
        except BusError as error:
            result.rows.append([row.joint, str(row.id), model.name, "", "", "", ""])
            result.refusals.append(error.what)
    if not result.refusals:
        _inspect_robot(bus, robot, calibration, rate, result)
    return result


def _inspect_servo(
    bus: Bus, row: ServoCalibration, model: Model, low: float, high: float, result: Inspection
) -> None:
    """Inspect a servo whose joint turns between two limits [rad]."""

    def read(name: str) -> float:
        return bus.read(row.id, name)

    angle = row.joint_angle(read("present_position"))
    voltage, temperature = read("present_voltage"), read("present_temperature")
    errors, servo = bus.errors(row.id), f"servo {row.id} ({row.joint})"
    result.rows.append(
        [
            row.joint,
            str(row.id),
            model.name,
            f"{math.degrees(angle):.0f}°",
            f"{voltage:.1f} V",
            f"{temperature:.0f} °C",
            ", ".join(errors.names) or "none",
        ]
    )
    refuse = result.refusals.append
    if model.name != row.model:
        refuse(f"{servo} is an {model.name}; the calibration has an {row.model}.")
    if errors:
        refuse(f"{servo} reports {', '.join(errors.names)}.")
    least, most = read("min_voltage_limit"), read("max_voltage_limit")
    if not least <= voltage <= most:
        refuse(f"{servo} has a supply of {voltage:.1f} V; it needs {least:.1f} to {most:.1f} V.")
    limit = read("temperature_limit")
    if temperature > limit - COOL:
        refuse(f"{servo} has {temperature:.0f} °C; its limit is {limit:.0f} °C.")
    if not low - LIMIT_TOLERANCE <= angle <= high + LIMIT_TOLERANCE:
        refuse(
            f"{servo} is at {math.degrees(angle):.0f}°, beyond the joint's limits "
            f"({math.degrees(low):.0f}° to {math.degrees(high):.0f}°): its calibration is wrong."
        )
    own = servo_range(bus, row)
    if own.range_min == own.range_max:
        refuse(f"{servo} is in wheel mode: both of its position limits are {own.range_min}.")
    elif own.range_min > row.range_min or own.range_max < row.range_max:
        ends = [f"{math.degrees(angle):.0f}°" for angle in own.joint_range]
        result.notes.append(f"{servo}: its position limits allow {' to '.join(ends)} of the joint.")
    known_low, known_high = row.joint_range
    if not known_low - LIMIT_TOLERANCE <= angle <= known_high + LIMIT_TOLERANCE:
        refuse(
            f"{servo} is at {math.degrees(angle):.0f}°, outside its calibrated range "
            f"({math.degrees(known_low):.0f}° to {math.degrees(known_high):.0f}°)."
        )
    protected = shutdown_errors(model.protocol, int(read("shutdown")))
    missing = (StatusError.OVERLOAD | StatusError.OVERHEATING) & ~protected
    if missing:
        refuse(f"{servo} does not shut down on {' and '.join(missing.names)}: see its shutdown.")
    if "bus_watchdog" in model.registers and read("bus_watchdog") < 0:
        refuse(f"{servo} was stopped by its bus_watchdog; write 0 to it.")
    if model.protocol == 2 and int(read("drive_mode")) & TIME_BASED:
        refuse(f"{servo} has a time-based profile (drive_mode 4), which ignores speed limits.")
    if read("status_return_level") < 2:
        refuse(f"{servo} does not answer writes: its status_return_level must be 2.")
    if "operating_mode" in model.registers and read("operating_mode") != 3:
        refuse(f"{servo} is not in position mode: its operating_mode must be 3.")


def _inspect_robot(
    bus: Bus,
    robot: Robot,
    calibration: Sequence[ServoCalibration],
    rate: float,
    result: Inspection,
) -> None:
    """Inspect what concerns all servos: their kind, and the rate of the bus."""
    first = calibration[0].id
    model = bus.models[first]
    if len({row.model for row in calibration}) > 1:
        names = ", ".join(sorted({row.model for row in calibration}))
        result.refusals.append(f"the servos are of several models ({names}); one is possible.")
    if robot.servo.name not in (model.name, model.moves_as):
        result.notes.append(
            f"{robot.name} is modelled with the {servo_words(robot.servo.name)}; these are "
            f"{model.name}: predicted temperatures and torques are those of the other servo."
        )
    latency, delay = bus.measure_latency(first), bus.read(first, "return_delay_time")
    if latency >= MOST_LATENCY:
        result.notes.append(
            f"the USB adapter adds {1000 * latency:.0f} ms to each answer; set its latency timer "
            f"to 1 ms: {latency_advice(bus.path)}"
        )
    if delay > LONG_DELAY:
        result.notes.append(
            f"servos answer after {1e6 * delay:.0f} µs; set their return_delay_time to 0."
        )
    servos = len(calibration) if model.reads != "single" else 1
    most = achievable_rate(
        model,
        len(calibration),
        baud=bus.baud,
        return_delay=delay,
        latency=latency,
        read_size=8,
        read_servos=servos,
    )
    if rate > most:
        result.refusals.append(
            f"the bus allows {most:.0f} updates a second with a reading in each; {rate:g} are "
            "wanted."
        )
