"""A driven robot keeps its trunk level and at its height on level ground."""

import pytest

from phasmid import drive, load_scenario, plan
from phasmid.control import Player
from phasmid.errors import InvalidInput
from phasmid.experiment import Command, Ending
from simulation import level_walks as level
from support.walks import with_servo

PAPER = load_scenario("paper")

TORQUE = 1.5
"""Largest torque over what the walk can need: feet that touch down a contact's depth of 0.3 mm
early or late shift load between legs. A light robot's contact vibrates as strongly."""


CASES = level.cases(15, seed=1024)


@pytest.mark.parametrize(
    "case",
    [*CASES[4:9], *(pytest.param(case, marks=pytest.mark.slow) for case in CASES[9:14])],
    ids=str,
)
def test_the_trunk_of_a_driven_robot_does_not_hop_on_level_ground(case):
    """Random velocities, gaits, robots and drives; every fourth robot weighs 0.6 to 1.6 kg.

    Contact gives way by mg / 4k = 0.2 mm a foot, an AX-12A's dead band of one tick in 0.1 m of
    lever is 0.5 mm; both together stay below 1 mm. A foot that dives 5 mm lifts the trunk by 2.9.
    """
    found = level.measure(**case)
    assert Ending[found["ending"]].is_full_length
    assert found["hop"] < level.HOP
    if case["mass"] is None:
        assert found["torque"] < TORQUE * found["planned_torque"]


def test_a_driven_robot_moves_its_joints_by_its_own_servos_unless_told_otherwise():
    """The recording names the drive: that of the scenario, else the servo or its ideal form."""
    short = PAPER.replace(duration=0.02)
    assert drive(short).attrs["drive"] == "servo"
    assert drive(short.replace(drive="prescribed")).attrs["drive"] == "prescribed"
    unknown = with_servo(stall_current=None)
    assert drive(short.replace(robot=unknown)).attrs["drive"] == "ideal-servo"


def test_prescribed_joints_are_refused_on_ground_that_the_controller_does_not_know():
    """Only a plan that follows the ground may prescribe joints on it."""
    stairs = PAPER.replace(duration=0.02, drive="prescribed", terrain="stairs")
    with pytest.raises(InvalidInput, match='drive is "prescribed" on terrain "stairs"'):
        drive(stairs, None, Command(velocity=(0.05, 0.0, 0.0)))
    unaware = stairs.replace(planned_on="level")
    player = Player(plan(unaware))
    with pytest.raises(InvalidInput, match="a plan that follows the ground"):
        drive(unaware, player)
    known = drive(stairs, Player(plan(stairs)))
    assert known.attrs["ending"] == "COMPLETED"
