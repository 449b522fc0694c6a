"""The longest stride is the one that a plan allows, with its lift and sway."""

import numpy as np
import pytest

from phasmid import load_scenario
from phasmid.errors import InfeasibleWalk
from phasmid.gait import default_gait, gaits_of
from phasmid.motion import longest_stride
from phasmid.motion.feasibility import check_reach, checked_times
from phasmid.motion.walk import course_of
from phasmid.robot import load_robot, preset_names, with_values


def check(robot, gait, step):
    scenario = load_scenario("paper").for_robot(robot)
    scenario = scenario.replace(gait=gait, step_length=step[0], step_sideways=step[1])
    course = course_of(scenario.build())
    (times,) = checked_times(scenario.build(), course)
    check_reach(scenario.build(), course, times)


@pytest.mark.parametrize("preset", preset_names())
@pytest.mark.parametrize("direction", [0.0, 0.7])
def test_a_plan_allows_the_longest_stride_and_no_longer_one(preset, direction):
    robot = load_robot(preset)
    gait = next(iter(gaits_of(len(robot.legs)).values()))
    longest = longest_stride(robot, gait, direction=direction, supported=True)
    way = np.array([np.cos(direction), np.sin(direction)])
    # 20 bisections of a 16th of a leg's length, which is at most 0.6 m: 4e-8 m.
    check(robot, gait.name, (longest - 1e-7) * way)
    with pytest.raises(InfeasibleWalk):
        check(robot, gait.name, (longest + 1e-6) * way)


def test_a_gait_that_does_not_support_has_room_for_steps_and_no_supported_one():
    """80 mm ahead, the centre of mass is outside of the three feet that stand."""
    robot, gait = with_values(load_robot("quadruped"), {"body.com": [0.08, 0, 0]}), default_gait(4)
    assert longest_stride(robot, gait) > 0.04
    assert longest_stride(robot, gait, supported=True) == 0.0


def test_no_step_is_possible_where_a_lift_has_no_room():
    # The PhantomX's feet come 130 mm up from 100 mm below their hips at the most.
    robot = load_robot("phantomx-ax")
    gait = next(iter(gaits_of(6).values()))
    high = load_scenario("paper").replace(step_height=0.5).build().course.stride
    assert longest_stride(robot, gait, high) == 0.0
