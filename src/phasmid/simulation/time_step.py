"""Which time steps resolve the contact."""

from __future__ import annotations

import math

from phasmid.errors import InvalidInput
from phasmid.robot import Robot
from phasmid.scenario import Scenario
from phasmid.simulation.contact import SOFT_TIME


def check_time_step(scenario: Scenario, robot: Robot) -> None:
    """Refuse a time step that cannot resolve the contact.

    Raises:
        InvalidInput: With the longest one that can.
    """
    longest = longest_time_step(scenario, robot.mass)
    if scenario.simulation.dt > longest:
        raise InvalidInput(
            f"--dt {scenario.simulation.dt:g} s cannot resolve this contact "
            f"(needs <= {longest:.2g} s).",
            hint=f"--dt {longest / 2:.1g}",
        )


def longest_time_step(scenario: Scenario, mass: float) -> float:
    """Longest time step that resolves the contact of a robot on three feet [s].

    Args:
        scenario: Its contact is used.
        mass: Of the robot [kg].
    """
    if scenario.contact.contact_law == "mujoco":
        # With longer ones the engine would make its contact softer by itself.
        return SOFT_TIME / 2
    # Each of twelve points carries its share of the mass. The engine takes a contact's spring and
    # damper at the start of a step, which is stable up to twice the time returned here.
    share = mass / 12
    frequency = math.sqrt(scenario.contact.stiffness / share)
    ratio = scenario.contact.law_damping / (2 * math.sqrt(scenario.contact.stiffness * share))
    return (math.sqrt(ratio**2 + 1) - ratio) / frequency
