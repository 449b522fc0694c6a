"""A robot that stands on a slope below the friction angle creeps by the damping of its friction."""

import math

import numpy as np
import pytest

from phasmid.experiment import Command, JointTargets
from phasmid.reporting import summarise
from phasmid.scenario import Scenario
from phasmid.simulation import drive, new_drive
from phasmid.simulation.closed_loop import STANDING_HARDNESS
from phasmid.units import STANDARD_GRAVITY

SLOPE = math.radians(10)
SCENARIO = Scenario(robot="phantomx-ax").replace(
    drive="ideal-servo", duration=8.0, terrain="slope", slope=SLOPE
)
STAND = Command(velocity=(0.0, 0.0, 0.0))


def test_it_creeps_by_its_weight_over_the_friction_damping_and_is_warned_of():
    # m g sin a / (n c) with n of the 24 points on the ground: at least two of a foot's four, since
    # the feet are tilted against the slope.
    robot = SCENARIO.load_robot()
    summary = summarise(drive(SCENARIO, None, STAND))
    damping = STANDING_HARDNESS * SCENARIO.build().world.contact.friction_damping
    force = robot.mass * STANDARD_GRAVITY * math.sin(SLOPE)
    creep = summary["standing"]["creep"]
    assert force / (24 * damping) < creep < force / (12 * damping)
    assert creep < 1e-4
    assert (
        f"The standing robot creeps at {1000 * creep:.2g} mm/s: below its limit, friction is a "
        "damper."
    ) in summary["warnings"]


def test_on_level_ground_nothing_creeps():
    summary = summarise(drive(SCENARIO.replace(terrain="flat", duration=4.0), None, STAND))
    # A hundredth of the speed that is warned of, 25 µm in 2 s.
    assert summary["standing"]["creep"] < 1e-7
    assert not [sentence for sentence in summary["warnings"] if "creeps" in sentence]


@pytest.mark.parametrize(
    ("terrain", "speed", "factor"),
    [("slope", 0.0, STANDING_HARDNESS), ("slope", 0.05, 1.0), ("flat", 0.0, 1.0)],
)
def test_friction_is_hard_under_a_standing_robot_alone(terrain, speed, factor):
    # Under a robot that walks a harder friction would change its torques.
    scenario = SCENARIO.replace(terrain=terrain)
    run = new_drive(scenario, None, Command(velocity=(speed, 0.0, 0.0)))
    run.advance()
    hardness = scenario.build().world.contact.friction_hardness
    assert run.model.opt.impratio == pytest.approx(factor * hardness)


class Treading:
    """Lifts and lowers one foot by positions alone; their velocities stay 0."""

    def reset(self, observation):
        self.start = observation.joint_position.copy()

    def update(self, observation, command):
        q = self.start.copy()
        q[0, 1] += 0.2 * math.sin(6.0 * observation.time)
        return JointTargets(q, np.zeros_like(q))


def test_friction_is_not_hard_under_a_controller_that_moves_positions_alone():
    run = new_drive(SCENARIO.replace(duration=0.3), Treading(), STAND)
    run.advance()
    hardness = SCENARIO.build().world.contact.friction_hardness
    assert run.model.opt.impratio == pytest.approx(hardness)
