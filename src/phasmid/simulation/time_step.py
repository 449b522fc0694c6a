"""Which time steps resolve the contact, and the gears of servos."""

from __future__ import annotations

import math

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.motion import Motion
from phasmid.robot import Robot
from phasmid.scenario import Scenario
from phasmid.simulation.contact import CONTACT_POINTS, SOFT_TIME, friction_hardness
from phasmid.simulation.model import foot_mobility, joint_mobility
from phasmid.simulation.servo import longest_servo_step, own_servo

MOST_OF_LIMIT = 0.9
"""Part of the largest stable step that is allowed: feet are lighter in other poses."""


def check_time_step(scenario: Scenario, walk: Motion) -> None:
    """Refuse a time step that cannot resolve the contact, or the gears of the robot's own servos.

    Args:
        scenario: Its contact, drive and servos are used.
        walk: Its robot, and the joints' angles at its start, are used.

    Raises:
        InvalidInput: With the longest one that resolves both; or the servos cannot be run.
    """
    longest, what = longest_time_step(scenario, walk.robot), "this contact"
    if scenario.simulation.drive == "servo":
        servo, start = own_servo(scenario, walk.robot), walk.sample(np.zeros(1)).q[0]
        gears = longest_servo_step(servo, joint_mobility(walk.robot, scenario, start))
        if gears < longest:
            longest, what = gears, f"the gears of the servo {servo.name}"
    if scenario.simulation.dt > longest:
        raise InvalidInput(
            f"--dt {scenario.simulation.dt:g} s cannot resolve {what} (needs <= {longest:.2g} s).",
            hint=f"--dt {longest / 2:.1g}",
        )


def longest_time_step(scenario: Scenario, robot: Robot) -> float:
    """Longest time step that resolves the contact [s].

    Args:
        scenario: Its contact is used.
        robot: On three of its feet.
    """
    if scenario.contact.contact_law == "mujoco":
        # With longer ones the engine would make its contact softer by itself.
        return SOFT_TIME / 2
    contact = scenario.contact
    # Each of twelve points carries its share of the mass. The engine takes a contact's spring and
    # damper at the start of a step, which is stable up to twice the time that is taken here.
    share = robot.mass / 12
    frequency = math.sqrt(contact.stiffness / share)
    ratio = contact.law_damping / (2 * math.sqrt(contact.stiffness * share))
    robot_on_feet = (math.sqrt(ratio**2 + 1) - ratio) / frequency
    if contact.contact_law != "spring-damper":
        return robot_on_feet
    return min(robot_on_feet, MOST_OF_LIMIT * longest_foot_step(scenario, robot))


def longest_foot_step(scenario: Scenario, robot: Robot) -> float:
    """Longest time step with which the lightest foot does not chatter in the engine's contact [s].

    A foot has the mass 1/A with which it resists a push, A its mobility, and that with which its
    points resist their own acceleration: d/((1 - d) A) each along the normal, `friction_damping`
    over `damping` times that along the ground. A symplectic step of a mass m on a spring k and a
    damper c, both taken at its start, is stable where k dt² + 2 c dt < 4 m.

    Args:
        scenario: Its contact, drive and time step are used.
        robot: Its lightest foot counts, at the neutral stance.
    """
    contact, mobility = scenario.contact, float(foot_mobility(robot, scenario).max())
    own, hardness = contact.impedance / (1 - contact.impedance), friction_hardness(scenario)
    steps = []
    for k, c, hard in (
        (contact.stiffness, contact.law_damping, 1.0),
        (0.0, hardness * contact.law_damping, hardness),
    ):
        k, c = CONTACT_POINTS * k, CONTACT_POINTS * c
        m = (1 + CONTACT_POINTS * hard * own) / mobility
        steps.append((math.sqrt(c * c + 4 * k * m) - c) / k if k else 2 * m / c)
    return min(steps)
