"""Bounds of grounds by geometry and statics, and causes of failed walks."""

import math
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from phasmid.robot import load_robot

SCRIPTS = [str(Path(__file__).parents[2] / folder) for folder in ("benchmarks", "tools")]
sys.path += SCRIPTS

from control_study import bounds, causes  # noqa: E402

import ground  # noqa: E402, needs the path above

# Scripts there have the names of packages of tests.
del sys.path[-len(SCRIPTS) :]

ROBOT = load_robot("phantomx-mk4")


@pytest.mark.parametrize("friction", [0.4, 0.7])
def test_friction_bounds_a_slope_at_its_friction_angle(friction):
    """A point on a plane rests if tan(slope) <= mu; bisection ends within its tolerance above."""
    size, binding = bounds.bound("slope", bounds.Walker(ROBOT, friction))
    limit = math.degrees(math.atan(friction))
    assert limit <= size <= limit + bounds.TOLERANCE
    assert binding == ("friction",)


def test_longer_legs_pass_higher_blocks():
    """The trunk clears a block if the legs reach from its lowest to its highest neighbour."""
    legs = [
        replace(leg, tibia=replace(leg.tibia, length=1.2 * leg.tibia.length)) for leg in ROBOT.legs
    ]
    # 20 % of a tibia of 131 mm are 26 mm, more than two steps of heights of 12 mm.
    assert not bounds.Walker(ROBOT).passes(bounds.blocks(165))
    assert bounds.Walker(replace(ROBOT, legs=tuple(legs))).passes(bounds.blocks(165))


def test_a_weak_servo_cannot_carry_the_robot_on_bent_legs():
    """With tibiae bent by 57° or more a leg lifts 60 N per N·m at most, by its Jacobian.

    Three legs of 0.02 N·m carry 3.6 N; the robot weighs 32 N.
    """
    limits = ROBOT.arrays.joint_limits.copy()
    limits[:, 2, 1] = -1.0
    legs = [replace(leg, joint_limits=pair) for leg, pair in zip(ROBOT.legs, limits, strict=True)]
    servo = replace(ROBOT.servo, stall_torque=0.02)
    weak, level = bounds.Walker(replace(ROBOT, legs=tuple(legs), servo=servo)), bounds.slope(0.0)
    assert not weak.passes(level)
    assert weak.passes(level, "torque")


@pytest.mark.parametrize(("obstacle", "walked"), [("stairs", 67), ("gap", 60), ("beams", 60)])
def test_bounds_are_not_below_what_is_walked(obstacle, walked):
    """A necessary condition holds wherever a walk of docs/control.md passes."""
    assert bounds.Walker(ROBOT).passes(bounds.KINDS[obstacle][0](walked))


def test_a_foot_that_meets_risers_again_and_again_is_classified():
    """Without ground sensing each swing of 30 mm ends at a riser of 80 mm."""
    assert causes.measure("stairs", 80, "without", 3)["cause"] == "obstacle hits"


def test_feet_that_slip_back_are_classified():
    """Friction of 0.2 holds on a slope of 11° at most; this one has 15°."""
    slope = {"kind": "slope", "slope_deg": 15, "planned_on": "level", "friction": 0.2}
    scenario = ground.scenario_of("slope", 15, 0).replace(terrain=slope | {"terrain_start_mm": 250})
    found = causes.explain(scenario, "slope", 15, "ground sensing and dynamics")
    assert found["cause"] == "slip"
