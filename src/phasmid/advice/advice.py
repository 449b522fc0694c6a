"""Advice on the servos of a walking robot: do they hold, how warm, how long, and which others."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.advice.load import ServoLoad, simulate_load
from phasmid.arguments import checked
from phasmid.errors import InfeasibleWalk, InvalidInput
from phasmid.experiment import Experiment, ScenarioLike, built
from phasmid.forces.servo_verdict import Holding, ServoVerdict, duration_words, servo_verdict
from phasmid.motion import Walk, plan
from phasmid.robot import JOINTS, Robot, with_payload, with_servo
from phasmid.servo import Servo, load_servo, servo_names
from phasmid.servo.heat import HEAT_RANGE, temperature_after
from phasmid.toml import toml_value
from phasmid.units import rounded_down

WARM_UP, MEASURED = 1, 3
"""Cycles that are simulated: first those that do not count, then those that do."""

MINUTES = 5.0, 15.0, 60.0
"""Times of walking at which temperatures are given [min]."""

CAPACITY, USABLE = 2.2, 0.8
"""Default capacity of the battery [A h], and its share that may be used: lithium cells suffer
below a fifth of their charge."""


@dataclass(frozen=True)
class ServoChoice:
    """A servo of the catalogue on the same robot, payload and gait.

    Attributes:
        servo: The servo.
        verdict: Static verdict with this servo at its rated voltage and with its mass.
        lacks: What it lacks; empty where it holds.
        price: Price of all servos of the robot [US dollars]; None where unknown.
    """

    servo: Servo
    verdict: ServoVerdict
    lacks: str
    price: float | None


@dataclass(frozen=True, eq=False)
class Advice:
    """Advice on the servos of a walking robot.

    Torques, heat and current are those of a few simulated cycles with the servos' own law; the
    verdict is static and counts on no friction.

    Attributes:
        experiment: The walk.
        speed: Mean speed of the planned trunk [m/s].
        load: Load on the servos.
        verdict: Static verdict on the servos.
        choices: The servos of the catalogue.
        capacity: Capacity of the battery [A h].
    """

    experiment: Experiment
    speed: float
    load: ServoLoad
    verdict: ServoVerdict
    choices: tuple[ServoChoice, ...]
    capacity: float

    @property
    def robot(self) -> Robot:
        """The robot as supplied, with its payload, L legs."""
        return self.experiment.robot

    @property
    def servo(self) -> Servo:
        """Its servo with the scenario's settings."""
        return self.robot.servo

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, such as ``right_front.femur``, in the order of ``load``."""
        return tuple(f"{leg.name}.{joint}" for leg in self.robot.legs for joint in JOINTS)

    @property
    def voltage(self) -> float:
        """Supply voltage [V]."""
        return self.servo.voltage

    def temperature(self, minutes: float) -> Float[np.ndarray, "3 legs 3"] | None:
        """Return the servos' temperatures after a time of walking from cold [°C].

        The mean heat of a cycle warms a servo exponentially, with its thermal resistance and heat
        capacity. A servo at its temperature limit would have shut down.

        Args:
            minutes: The time.

        Returns:
            Lowest estimate, expected value and highest estimate, shape (3, L, 3); None without a
            known motor. The lowest and highest are warmings times `HEAT_RANGE`, the highest
            without help from friction.
        """
        load, servo = self.load, self.servo
        if load.heat is None or load.unaided_heat is None:
            return None
        low, high = HEAT_RANGE
        losses = np.stack([low * load.heat, load.heat, high * load.unaided_heat])
        return temperature_after(servo, 60 * minutes, servo.ambient_temperature, losses)

    @property
    def battery_minutes(self) -> float | None:
        """Time of walking on `USABLE` of the battery [min]; None where the current is unknown."""
        current = self.load.supply_current
        return None if current is None else 60 * USABLE * self.capacity / current

    @cached_property
    def cheapest(self) -> ServoChoice | None:
        """Cheapest servo of the catalogue that holds; None where none does."""
        holding = [choice for choice in self.choices if not choice.lacks]
        return min(holding, key=lambda c: math.inf if c.price is None else c.price, default=None)


@checked
def advise(
    scenario: ScenarioLike | Experiment, *, speed: float | None = None, capacity: float = CAPACITY
) -> Advice:
    """Return advice on the servos of a walking robot.

    Args:
        scenario: Robot, payload, gait, stride, servo settings and air; its duration has no effect.
        speed: Forward speed, reached by the period of the stride [m/s]; None: the scenario's.
        capacity: Capacity of the battery [A h].

    Raises:
        InvalidInput: Speed or capacity are not greater than 0, or the walk does not go ahead.
        InfeasibleWalk: The walk is impossible for the robot or its servos.
        InfeasibleLoad: The feet cannot carry the robot.
    """
    experiment, walk, speed = plan_cycles(scenario, speed)
    if not (math.isfinite(capacity) and capacity > 0):
        raise InvalidInput(f"capacity is {capacity:g} A h; it must be greater than 0.")
    robot, gravity = walk.robot, experiment.world.gravity
    air = robot.servo.ambient_temperature

    def judge(robot: Robot) -> ServoVerdict:
        return servo_verdict(robot, walk.gait, gravity=gravity)

    fastest = float(np.abs(walk.qd).max())
    choices = []
    for name in servo_names():
        other = replace(load_servo(name), ambient_temperature=air)
        verdict = judge(with_servo(_with_servo_mass(robot, other), other))
        price = None if other.price is None else 3 * len(robot.legs) * other.price
        choices.append(ServoChoice(other, verdict, _lack(verdict, other, fastest), price))
    return Advice(
        experiment=experiment,
        speed=speed,
        load=simulate_load(experiment, walk, skip=WARM_UP * experiment.course.stride.period),
        verdict=judge(robot),
        choices=tuple(choices),
        capacity=capacity,
    )


def plan_cycles(
    scenario: ScenarioLike | Experiment,
    speed: float | None = None,
    cycles: float = WARM_UP + MEASURED,
) -> tuple[Experiment, Walk, float]:
    """Plan a number of cycles of a walk at a speed.

    Args:
        scenario: The walk.
        speed: Forward speed, reached by the period of the stride [m/s]; None: the scenario's.
        cycles: Number of cycles.

    Returns:
        The experiment of these cycles, the plan, and its speed [m/s].

    Raises:
        InvalidInput: The speed is not greater than 0, or the walk does not go ahead.
        InfeasibleWalk: The walk is impossible for the robot or its servos.
    """
    experiment = built(scenario).driven()
    duty, stride = experiment.course.gait.duty_factor, experiment.course.stride
    own = stride.step_length / (duty * stride.period)
    if speed is not None:
        if not (math.isfinite(speed) and speed > 0):
            raise InvalidInput(f"speed is {speed:g} m/s; it must be greater than 0.")
        if own <= 0:
            raise InvalidInput(
                f"step_length is {1000 * stride.step_length:g} mm; a speed needs a step ahead.",
                hint="step_length_mm = 40",
            )
        # Whole time steps of a cycle spare the plan from being computed for each step.
        dt = experiment.solver.time_step
        experiment = experiment.replace(period=round(stride.period * own / speed / dt) * dt)
        own = stride.step_length / (duty * experiment.course.stride.period)
    experiment = experiment.replace(duration=cycles * experiment.course.stride.period)
    try:
        return experiment, plan(experiment), own
    except InfeasibleWalk as error:
        error.reword(partial(_with_speed, experiment, speed))
        raise


def _with_speed(experiment: Experiment, speed: float | None, hint: str) -> str:
    """Return settings of a walk with its speed in place of its period.

    Args:
        experiment: The walk, which was refused.
        speed: Speed that was wanted [m/s]; None: a period was.
        hint: Settings of the walk, or words, which are kept.
    """
    try:
        changes: dict[str, Any] = tomllib.loads(f"x = {{ {hint} }}")["x"]
    except tomllib.TOMLDecodeError:
        return hint
    course = experiment.replace(**changes).course
    if course.stride.step_length <= 0 or (speed is None and "period" not in changes):
        # A walk that does not go ahead has no speed.
        return hint
    speed = course.stride.step_length / (course.gait.duty_factor * course.stride.period)
    rest = {key: value for key, value in changes.items() if key != "period"}
    return ", ".join(
        [f"speed = {rounded_down(speed)}", *(f"{k} = {toml_value(v)}" for k, v in rest.items())]
    )


def _with_servo_mass(robot: Robot, servo: Servo) -> Robot:
    """Return the robot with heavier servos; their additional mass is counted in the trunk.

    Unknown and smaller masses change nothing.
    """
    if servo.mass is None or robot.servo.mass is None:
        return robot
    more = 3 * len(robot.legs) * (servo.mass - robot.servo.mass)
    return with_payload(robot, max(more, 0.0))


def _lack(verdict: ServoVerdict, servo: Servo, fastest: float) -> str:
    """Return what a servo lacks; empty where it holds.

    Args:
        verdict: Its static verdict.
        servo: The servo.
        fastest: Largest speed of a joint in the plan [rad/s].
    """
    lacks = []
    if verdict.holding is Holding.NOT_STABLE:
        return "the robot is not stable in this gait, with any servo"
    if verdict.torque > verdict.stall_torque:
        lacks.append(f"stall torque {verdict.stall_torque:.3g} of {verdict.torque:.3g} N·m")
    elif verdict.rms_torque > verdict.continuous_torque:
        assumed = ", assumed" if verdict.is_continuous_assumed else ""
        lacks.append(
            f"continuous torque {verdict.continuous_torque:.3g}{assumed}, of "
            f"{verdict.rms_torque:.3g} N·m"
        )
    if fastest > servo.no_load_speed:
        lacks.append(f"speed {servo.no_load_speed:.1f} of {fastest:.1f} rad/s")
    if verdict.holding is not Holding.HOLDS and verdict.time_to_limit is not None:
        soon = verdict.time_to_limit[0]
        if math.isfinite(soon):
            limit = f"{verdict.temperature_limit:.0f} °C"
            lacks.append(f"cooling: {limit} after {duration_words(soon)} at the earliest")
    return "; ".join(lacks)
