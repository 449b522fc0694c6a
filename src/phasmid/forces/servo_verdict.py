"""Servo verdict: static joint torques of a gait compared with the data sheet.

`servo_verdict` takes a robot and a gait, and `scenario_verdict` a scenario. The command line, the
simulation and the studio show `ServoVerdict.lines`, so that their answers agree.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from phasmid.dynamics import BodyMotion, inverse_dynamics
from phasmid.experiment import Experiment, ScenarioLike, built
from phasmid.forces.contacts import Contacts, JointLoad, contact_jacobian, contact_points
from phasmid.forces.sharing import share_load
from phasmid.gait import Gait, support_margin, sway
from phasmid.gait.cycle import foot_way, timing
from phasmid.kinematics import (
    hip_from_body,
    joint_angles,
    neutral_feet,
    within_reach,
)
from phasmid.motion import longest_stride
from phasmid.robot import JOINTS, Robot
from phasmid.servo import Servo
from phasmid.servo.heat import HEAT_RANGE, temperature_after, time_to_limit
from phasmid.servo.words import servo_label

STEP = 0.04
"""Step length of the verdict [m], that of the paper; shorter where legs reach less. It does not
depend on the scenario, so that all commands agree."""

PHASES = 3
"""Samples of each interval between two events of the gait."""

SIMPSON = np.array([1.0, 4.0, 1.0]) / 6
"""Weights of these samples in a mean."""

TIE = 1e-6
"""Relative difference of torques that count as equal; the first joint is named."""

LEAST_MARGIN = 1e-9
"""Support margin above which a robot is stable [m]."""


class Holding(Enum):
    """Answer of a servo verdict."""

    HOLDS = "HOLDS"
    LIMITED = "HOLDS FOR A LIMITED TIME"
    DOES_NOT_HOLD = "DOES NOT HOLD"
    NOT_STABLE = "NOT STABLE"


@dataclass(frozen=True)
class ServoVerdict:
    """Answer and numbers of a servo verdict.

    Attributes:
        holding: The answer.
        servo: Name of the servo.
        gait: Name of the gait.
        joint: Joint with the largest static torque, such as ``right_middle.femur``.
        feet: Numbers of the legs that carry then, from 1.
        torque: That torque [N·m]; NaN where the robot is not stable.
        rms_torque: Largest rms torque of a joint over the cycle, or largest torque on all feet,
            whichever is larger [N·m].
        stall_torque: Stall torque at the supply voltage [N·m].
        continuous_torque: Continuous torque [N·m].
        is_continuous_assumed: True where the data sheet has no continuous torque.
        voltage: Supply voltage [V].
        highest_voltage: Highest supply voltage of the data sheet [V].
        heat: Final temperature of the warmest servo, lowest and highest estimate [°C]; None where
            the servo's current is unknown.
        time_to_limit: Time until its temperature limit, shortest and longest estimate [s],
            infinite where it is never reached; None likewise.
        temperature_limit: Temperature limit of the servo [°C].
        ambient_temperature: Temperature of the air [°C].
    """

    holding: Holding
    servo: str
    gait: str
    joint: str
    feet: tuple[int, ...]
    torque: float
    rms_torque: float
    stall_torque: float
    continuous_torque: float
    is_continuous_assumed: bool
    voltage: float
    highest_voltage: float
    heat: tuple[float, float] | None
    time_to_limit: tuple[float, float] | None
    temperature_limit: float
    ambient_temperature: float

    @property
    def is_possible(self) -> bool:
        """No static torque exceeds the stall torque; the robot may still topple."""
        return self.holding is not Holding.DOES_NOT_HOLD

    @property
    def lines(self) -> tuple[str, ...]:
        """Sentences that every command shows, the answer first."""
        feet = ", ".join(map(str, self.feet))
        need = f"{self.joint} needs {self.torque:.3g} N·m"
        servo = servo_label(self.servo)
        subject = self.servo if servo == self.servo else servo.capitalize()
        part = f"{100 * self.torque / self.stall_torque:.0f} % of stall."
        lines = []
        if self.holding is Holding.NOT_STABLE:
            lines.append(
                f"{self.holding.value}: while legs {feet} stand in the {self.gait} gait, the "
                "centre of mass is not between their feet."
            )
            if self.joint:
                lines.append(f"Where the robot is stable, {need}, {part}")
        else:
            assumed = ", assumed" if self.is_continuous_assumed else ""
            known = not math.isnan(self.rms_torque)
            rms = f"; rms of the gait {self.rms_torque:.3g} N·m" if known else ""
            lines += [
                f"{self.holding.value}: {need} on feet {feet} of the {self.gait} gait, {part}",
                f"{subject} at {self.voltage:g} V: stall {self.stall_torque:.3g} N·m, "
                f"continuous {self.continuous_torque:.3g} N·m{assumed}{rms}. Static loads, no "
                "credit from friction.",
            ]
            near = 0.8 * self.stall_torque < self.torque <= self.stall_torque
            if self.holding is Holding.LIMITED and near:
                lines.append(
                    "Little torque is left for motion; the servo's overload protection may trip."
                )
            lines += self._heat_lines()
            if self.holding is Holding.DOES_NOT_HOLD:
                lines.append(
                    "A simulation may complete all the same: friction of feet and gears helps it."
                )
        if self.voltage > self.highest_voltage:
            lines.append(
                f"WARNING: the supply of {self.voltage:g} V is above the {self.highest_voltage:g} "
                f"V of the {servo}; its data sheet promises no more torque there, and it may burn."
            )
        return tuple(lines)

    def _heat_lines(self) -> list[str]:
        limit, air = self.temperature_limit, self.ambient_temperature
        if air >= limit:
            return [
                f"The air of {air:g} °C is not below the limit of {limit:g} °C at which "
                f"the {servo_label(self.servo)} shuts down."
            ]
        if self.holding is Holding.DOES_NOT_HOLD or not self.heat or not self.time_to_limit:
            return []
        soon, late = self.time_to_limit
        if self.holding is Holding.HOLDS and math.isinf(soon):
            return []
        words = f"{self.heat[0]:.0f} to {self.heat[1]:.0f} °C in air of {air:g} °C"
        if math.isfinite(late):
            words = (
                f"its limit of {limit:g} °C after {duration_words(soon)} to {duration_words(late)}"
            )
        elif math.isfinite(soon):
            words += f", its limit of {limit:g} °C after {duration_words(soon)} at the earliest"
        else:
            words += f", below its limit of {limit:g} °C; the time is limited by the continuous "
            words += "torque alone"
        return [f"Estimate, by assumed heat figures: the warmest servo reaches {words}."]

    def as_dict(self) -> dict[str, Any]:
        """Return all numbers and `lines` for JSON; infinite and unknown numbers are None."""
        found = asdict(self) | {"holding": self.holding.value, "lines": list(self.lines)}
        return {name: _plain(value) for name, value in found.items()}


def scenario_verdict(scenario: ScenarioLike | Experiment) -> ServoVerdict:
    """Return the verdict on a scenario's robot, gait, servo settings, gravity and air.

    Args:
        scenario: The scenario, or its experiment; drive, stride and ground have no effect.

    Raises:
        InvalidInput: Robot or gait cannot be read, or a neutral foot is out of reach.
    """
    experiment = built(scenario)
    return servo_verdict(experiment.robot, experiment.course.gait, gravity=experiment.world.gravity)


def verdict_text(experiment: Experiment) -> str:
    """Return the verdict as JSON, for a recording."""
    return json.dumps(scenario_verdict(experiment).as_dict(), ensure_ascii=False)


def servo_verdict(
    robot: Robot,
    gait: Gait,
    *,
    gravity: float,
) -> ServoVerdict:
    """Compare the static joint torques of a gait with the servos' torques.

    The robot rests on level ground at three instants between any two events of the gait, with a
    step of `STEP` forward. Ground reaction forces are vertical: neither internal forces between
    feet nor friction in the gears reduce a torque. Three feet share the weight by statics, more by
    least squares. Links have their weight. A joint of its own strength is judged by that.

    The servos hold where the rms torque of the cycle and the torque on all feet are within the
    continuous torque, and the largest torque is within the stall torque. They hold for a limited
    time where only the largest torque is within its bound.

    Args:
        robot: The robot as supplied, L legs; a payload is part of its trunk.
        gait: The gait.
        gravity: Gravitational acceleration [m/s²].

    Raises:
        Unreachable: A neutral foot is out of reach.
    """
    servo, stall = robot.servo, robot.servo.stall_torque
    continuous = min(servo.continuous_torque, stall)
    stance, feet = _instants(robot, gait)
    load, margin = _static_torque(robot, stance, feet, gravity)
    # In torques of the servo: a stronger joint counts with less.
    load = load / robot.arrays.strength
    stable = margin > LEAST_MARGIN
    holding, worst = Holding.NOT_STABLE, int(np.argmin(margin))
    joint, torque, rms, heat, until = "", math.nan, math.nan, None, None
    if stable.any():
        torque = float(load.max())
        # Of legs with equal torques, the first.
        joints = load.max(axis=0)
        leg, which = (int(i) for i in np.argwhere(joints >= torque * (1 - TIE))[0])
        joint = f"{robot.legs[leg].name}.{JOINTS[which]}"
        if torque > stall or stable.all():
            worst = int(np.argmax(load[:, leg, which] >= joints[leg, which] * (1 - TIE)))
    motor, strength = servo.known_motor, 1.0
    if stable.any():
        strength = float(robot.arrays.strength[leg, which])
    if stable.all():
        rms = math.sqrt(_lasting(gait, load**2))
        holding = Holding.HOLDS if rms <= continuous else Holding.LIMITED
        if motor is not None:
            current = motor.lifting_current(load)
            heat, until = _warming(servo, motor.resistance * _lasting(gait, current**2))
            if math.isfinite(until[1]):
                holding = Holding.LIMITED
    # Overload counts wherever the robot is stable, and so does air above the servo's limit.
    if torque > stall or servo.ambient_temperature >= servo.temperature_limit:
        holding = Holding.DOES_NOT_HOLD
    return ServoVerdict(
        holding=holding,
        servo=servo.name,
        gait=gait.name,
        joint=joint,
        feet=tuple(int(leg) + 1 for leg in np.flatnonzero(stance[worst])),
        torque=strength * torque,
        rms_torque=strength * rms,
        stall_torque=strength * stall,
        continuous_torque=strength * continuous,
        is_continuous_assumed=servo.is_assumed("continuous_torque"),
        voltage=servo.voltage,
        highest_voltage=servo.maximum_voltage,
        heat=heat,
        time_to_limit=until,
        temperature_limit=servo.temperature_limit,
        ambient_temperature=servo.ambient_temperature,
    )


def _instants(
    robot: Robot, gait: Gait
) -> tuple[Bool[np.ndarray, "samples legs"], Float[np.ndarray, "samples legs 3"]]:
    """Return stance and feet in the body frame [m] over a cycle, and at last on all feet.

    Swing feet are at their neutral places.
    """
    neutral = neutral_feet(robot)
    way = np.array([min(STEP, longest_stride(robot, gait)), 0.0, 0.0])
    cycle = timing(gait, PHASES)
    swayed = sway(gait, neutral, 1.0, cycle.phase).way[:, None]
    share = np.where(cycle.stance, cycle.share, 0.0)
    feet = np.repeat(neutral[None], len(share) + 1, axis=0)
    feet[:-1, :, :2] = foot_way(neutral[:, :2], way, share) - swayed
    out = ~within_reach(robot, hip_from_body(robot, feet)).all(axis=1)
    # A sway on top of the longest stride may be out of reach.
    feet[out] = neutral
    return np.concatenate([cycle.stance, np.ones((1, len(neutral)), dtype=bool)]), feet


def _static_torque(
    robot: Robot,
    stance: Bool[np.ndarray, "samples legs"],
    feet: Float[np.ndarray, "samples legs 3"],
    gravity: float,
) -> tuple[Float[np.ndarray, "samples legs 3"], Float[np.ndarray, " samples"]]:
    """Return the sizes of the joints' torques at rest [N·m] and the support margins [m].

    Torques are 0 in samples in which the robot topples.
    """
    arrays = robot.arrays
    q = joint_angles(arrays, hip_from_body(robot, feet))
    still = np.zeros_like(q)
    count = len(q)
    body = BodyMotion.at_rest(np.zeros((count, 3)), np.broadcast_to(np.eye(3), (count, 3, 3)))
    free, wrench = inverse_dynamics(robot, body, q, still, still, gravity=gravity)
    com = np.stack([-wrench[:, 4], wrench[:, 3]], axis=1) / wrench[:, 2:3]
    margin = np.asarray(support_margin(feet[..., :2], stance, com))
    stable = margin > LEAST_MARGIN
    up = np.array([0.0, 0.0, 1.0])
    joints = JointLoad(contact_jacobian(robot, q[stable], np.eye(3), up), free[stable])
    # Without friction the ground reaction forces are vertical.
    points = contact_points(robot, feet[stable], up)
    contacts = Contacts(points, stance[stable], friction=0.0)
    torque = np.zeros_like(q)
    if stable.any():
        force = share_load(contacts, wrench[stable], "friction-cone")
        torque[stable] = np.abs(joints.with_ground(force))
    return torque, margin


def _lasting(gait: Gait, values: Float[np.ndarray, "samples legs 3"]) -> float:
    """Return the largest mean of a joint's values over a cycle, or the largest on all feet."""
    begin = gait.events
    width = np.diff(np.append(begin, 1.0 + begin[0]))
    weight = (width[:, None] * SIMPSON).ravel()
    return float(max(np.einsum("t,tlj->lj", weight, values[:-1]).max(), values[-1].max()))


def _warming(servo: Servo, power: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return final temperature [°C] and time to the limit [s] at a power loss [W], as ranges."""
    air, losses = servo.ambient_temperature, power * np.array(HEAT_RANGE)
    low, high = temperature_after(servo, math.inf, air, losses).tolist()
    latest, soonest = time_to_limit(servo, air, losses).tolist()
    return (low, high), (soonest, latest)


def duration_words(seconds: float) -> str:
    """Return a time in seconds or minutes, such as ``12 min``."""
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.0f} min"


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_plain(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
