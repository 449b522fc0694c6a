"""Advice on the servos of a walking robot: do they hold, which others do, and which supply."""

from __future__ import annotations

import math
from dataclasses import dataclass

from phasmid.advice.answer import Grade, ServoVerdict
from phasmid.advice.bounds import Postures, StaticLoads, postures, static_loads
from phasmid.advice.supply import Currents, Supply, Wiring, currents_and_voltage, supply
from phasmid.advice.verdict import judge, margins_of
from phasmid.arguments import checked
from phasmid.errors import InvalidInput
from phasmid.experiment import Experiment, ScenarioLike, built
from phasmid.motion import has_room_for, plan
from phasmid.robot import Robot, with_payload
from phasmid.servo import Servo, servo_names

MOST_PAYLOAD, BISECTIONS = 8.0, 11
"""Largest payload that is tried [masses of the robot], and its bisections: to 0.4 %."""


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
        loads: Static loads of the robot.
        verdict: Verdict on the robot's own servos.
        currents: What they take from the battery of `supply`, nearly empty, and at stall full; None
            without a known motor, and where the robot topples.
        supply: What to buy for it; None likewise, where the servos do not hold, and where no usual
            fuse and wire carry the current.
        choices: The servos of the catalogue, the largest margin first.
    """

    experiment: Experiment
    speed: float
    wiring: Wiring
    loads: StaticLoads
    verdict: ServoVerdict
    currents: Currents | None
    supply: Supply | None
    choices: tuple[ServoChoice, ...]

    @property
    def robot(self) -> Robot:
        """The robot as supplied, with its payload, L legs."""
        return self.experiment.robot

    @property
    def best(self) -> ServoChoice | None:
        """Servo of the catalogue with the largest margin; None where none holds."""
        return self.choices[0] if self.choices[0].verdict.grade is not Grade.NO else None

    @property
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
    experiment, wiring = built(scenario), wiring or Wiring()
    stride, duty_factor = experiment.course.stride, experiment.course.gait.duty_factor
    if speed is None:
        speed = stride.step_length / (duty_factor * stride.period)
    elif not (math.isfinite(speed) and speed > 0):
        raise InvalidInput(f"speed is {speed:g} m/s; it must be greater than 0.")
    elif stride.step_length <= 0:
        raise InvalidInput(
            f"step_length is {1000 * stride.step_length:g} mm; a speed needs a step ahead.",
            hint="step_length_mm = 40",
        )
    else:
        experiment = experiment.replace(period=stride.step_length / (duty_factor * speed))
    if not has_room_for(experiment.robot, experiment.course.gait, stride):
        plan(experiment)  # It names the leg and a stride that is possible.
    chosen = postures(experiment)
    loads = static_loads(experiment, chosen=chosen)
    servo = loads.robot.servo
    needed, left = currents_and_voltage(loads, wiring)
    if left != servo.voltage:
        experiment = experiment.replace(voltage=left)
        loads = static_loads(experiment, chosen=chosen)
    verdict = judge(experiment, loads)
    bought = None
    if needed is not None and verdict.holding.is_possible:
        bought = supply(servo, needed, wiring)
    choices = [_choice(experiment, chosen, name) for name in servo_names()]
    choices.sort(key=lambda c: (list(Grade).index(c.verdict.grade), -c.verdict.margin[0]))
    return Advice(
        experiment=experiment,
        speed=speed,
        wiring=wiring,
        loads=loads,
        verdict=verdict,
        currents=needed,
        supply=bought,
        choices=tuple(choices),
    )


def _choice(experiment: Experiment, chosen: Postures, name: str) -> ServoChoice:
    """Return a servo of the catalogue on the robot of an experiment, in its postures."""
    experiment = experiment.replace(servo=name, voltage=None)
    empty = experiment.replace(payload=0.0).robot

    def holds(payload: float) -> bool:
        """Return whether all margins without help are at least 1."""
        robot = with_payload(empty, payload)
        loads = static_loads(experiment, robot, chosen, with_help=False)
        return loads.is_stable and all(low >= 1 for low, _ in margins_of(loads).values())

    low, high = 0.0, MOST_PAYLOAD * empty.mass if holds(0.0) else 0.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    servo, count = empty.servo, 3 * len(empty.legs)
    return ServoChoice(
        servo=servo,
        verdict=judge(experiment, static_loads(experiment, chosen=chosen)),
        payload=low,
        price=None if servo.price is None else count * servo.price,
    )
