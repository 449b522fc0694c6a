"""Advice on the servos of a walking robot: do they hold, which others do, and which supply."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

from phasmid.advice.answer import Grade, ServoVerdict
from phasmid.advice.bounds import Postures, TorqueBounds, postures, torque_bounds
from phasmid.advice.supply import Currents, Supply, Wiring, currents, supply
from phasmid.advice.verdict import heat_losses, judge, margins_of
from phasmid.arguments import checked
from phasmid.errors import InvalidInput
from phasmid.experiment import Experiment, ScenarioLike, built
from phasmid.motion import has_room_for, plan
from phasmid.robot import Robot, with_payload, with_servo
from phasmid.servo import Servo, load_servo, servo_names

MOST_PAYLOAD, BISECTIONS = 8.0, 11
"""Largest payload that is tried [masses of the robot], and its bisections: to 0.4 %."""

ORDER = (Grade.GOOD, Grade.TIGHT, Grade.NO)
"""Grades, the best first."""


@dataclass(frozen=True)
class ServoChoice:
    """A servo of the catalogue on the same robot, payload and gait.

    Attributes:
        servo: The servo.
        verdict: Verdict with this servo at its rated voltage and with its mass.
        payload: Payload up to which all margins are at least 1 without help from the floor [kg].
        price: Price of all servos of the robot [US dollars]; None where unknown.
    """

    servo: Servo
    verdict: ServoVerdict
    payload: float
    price: float | None


@dataclass(frozen=True, eq=False)
class Advice:
    """Advice on the servos of a walking robot.

    Attributes:
        experiment: The walk, with its servos at the voltage that reaches them.
        speed: Mean speed of the planned trunk [m/s].
        wiring: Battery and wire.
        bounds: Static torques.
        verdict: Verdict on the robot's own servos.
        currents: What they take from the battery of `supply`, nearly empty, and at stall full; None
            without a known motor.
        supply: What to buy for it; None likewise.
        choices: The servos of the catalogue, the largest margin first.
    """

    experiment: Experiment
    speed: float
    wiring: Wiring
    bounds: TorqueBounds
    verdict: ServoVerdict
    currents: Currents | None
    supply: Supply | None
    choices: tuple[ServoChoice, ...]

    @property
    def robot(self) -> Robot:
        """The robot as supplied, with its payload, L legs."""
        return self.experiment.robot

    @cached_property
    def best(self) -> ServoChoice | None:
        """Servo of the catalogue with the largest margin; None where none holds."""
        return self.choices[0] if self.choices[0].verdict.grade is not Grade.NO else None

    @cached_property
    def cheapest(self) -> tuple[ServoChoice, ...]:
        """Cheapest servos of the catalogue whose margin is at least 1 without help from the floor.

        Empty where there are none, or no price is known.
        """
        holding = [
            (choice.price, choice)
            for choice in self.choices
            if choice.price and choice.verdict.holding.is_possible and choice.verdict.margin[0] >= 1
        ]
        least = min((price for price, _ in holding), default=None)
        return tuple(choice for price, choice in holding if price == least)


@checked
def advise(
    scenario: ScenarioLike | Experiment,
    *,
    speed: float | None = None,
    wiring: Wiring | None = None,
) -> Advice:
    """Return advice on the servos of a walking robot.

    Args:
        scenario: Robot, payload, gait, stride, servo settings, air and the floor's friction.
        speed: Forward speed, reached by the period of the stride [m/s]; None: the scenario's.
        wiring: Battery and wire; None: they lose nothing.

    Raises:
        InvalidInput: The speed is not greater than 0, or the walk does not go ahead.
        InfeasibleWalk: The legs have no room for the walk.
    """
    experiment, wiring = at_speed(built(scenario), speed), wiring or Wiring()
    course, servo = experiment.course, experiment.robot.servo
    if not has_room_for(experiment.robot, course.gait, course.stride):
        plan(experiment)  # It names the leg and a stride that is possible.
    chosen = postures(experiment)
    bounds = torque_bounds(experiment, chosen=chosen)
    low, high = wiring.voltages(servo)
    needed = currents(bounds, replace(experiment.robot, servo=servo.at(low)), high)
    if wiring.resistance(servo):
        left = wiring.voltage_at_servo(servo, needed.largest if needed else 0.0)
        experiment = experiment.replace(voltage=left)
        bounds = torque_bounds(experiment, chosen=chosen)
    robot = experiment.robot
    empty = experiment.replace(payload=0.0).robot
    choices = [_choice(experiment, empty, chosen, load_servo(name)) for name in servo_names()]
    choices.sort(key=lambda c: (ORDER.index(c.verdict.grade), -c.verdict.margin[0]))
    return Advice(
        experiment=experiment,
        speed=course.stride.step_length / (course.gait.duty_factor * course.stride.period),
        wiring=wiring,
        bounds=bounds,
        verdict=judge(experiment, robot, bounds),
        currents=needed,
        supply=None if needed is None else supply(servo, needed, wiring),
        choices=tuple(choices),
    )


def at_speed(experiment: Experiment, speed: float | None) -> Experiment:
    """Return a walk at a speed, reached by its period.

    Args:
        experiment: The walk.
        speed: Forward speed [m/s]; None: the walk's own.

    Raises:
        InvalidInput: The speed is not greater than 0, or the walk does not go ahead.
    """
    if speed is None:
        return experiment
    stride, duty = experiment.course.stride, experiment.course.gait.duty_factor
    if not (math.isfinite(speed) and speed > 0):
        raise InvalidInput(f"speed is {speed:g} m/s; it must be greater than 0.")
    if stride.step_length <= 0:
        raise InvalidInput(
            f"step_length is {1000 * stride.step_length:g} mm; a speed needs a step ahead.",
            hint="step_length_mm = 40",
        )
    return experiment.replace(period=stride.step_length / (duty * speed))


def _choice(experiment: Experiment, empty: Robot, chosen: Postures, servo: Servo) -> ServoChoice:
    """Return another servo on a robot; what it weighs more is counted in the trunk.

    Args:
        experiment: The walk.
        empty: Its robot without payload.
        chosen: Its postures.
        servo: The servo.
    """
    own = experiment.robot
    servo = replace(servo, ambient_temperature=own.servo.ambient_temperature)
    count, more = 3 * len(own.legs), 0.0
    if servo.mass is not None and own.servo.mass is not None:
        more = max(count * (servo.mass - own.servo.mass), 0.0)
    empty = with_servo(empty, servo)

    def margin(payload: float) -> float:
        """Return the least margin without help; 0 where the robot topples."""
        robot = with_payload(empty, more + payload)
        found = torque_bounds(experiment, robot, chosen, with_help=False)
        return (
            min(low for low, _ in margins_of(found, robot, heat_losses(found, robot)).values())
            if found.is_stable
            else 0.0
        )

    robot = with_payload(empty, more + experiment.payload)
    return ServoChoice(
        servo=servo,
        verdict=judge(experiment, robot, torque_bounds(experiment, robot, chosen)),
        payload=_largest(margin, MOST_PAYLOAD * empty.mass),
        price=None if servo.price is None else count * servo.price,
    )


def _largest(margin: Callable[[float], float], most: float) -> float:
    """Return the largest payload up to `most` with a margin of at least 1 [kg]; 0 without one."""
    low, high = 0.0, most
    if margin(low) < 1:
        return 0.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if margin(middle) >= 1 else (low, middle)
    return low
