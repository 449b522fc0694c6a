"""Standing up and sitting down from any joint angles, and legs by hand, without physics."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from phasmid import load_robot
from phasmid.control.sequences import Sequencer, Stage, packing
from phasmid.control.sequences.ground import (
    belly_ground,
    knees_and_feet,
    resting_ground,
    solve_feet,
)
from phasmid.control.sequences.joint_path import ACCELERATION, largest_speed
from phasmid.control.sequences.posture import fold_legs, leg_gaps
from phasmid.control.sequences.stance import neutral_stance
from phasmid.experiment import Command, Observation, Posture
from phasmid.experiment.command import LegCommand
from support.sequence_runs import DT, Still, run

ROBOTS = {name: load_robot(name) for name in ("phantomx-ax", "quadruped", "octopod")}
UP = Command(posture=Posture.STANDING)
DOWN = Command(posture=Posture.PACKED)

any_robot = pytest.mark.parametrize("name", ROBOTS)


def any_angles(robot, seed):
    """Joint angles drawn evenly within the limits."""
    limits = robot.arrays.joint_limits
    return np.random.default_rng(seed).uniform(limits[..., 0], limits[..., 1])


def check_smooth(robot, told, first):
    """No joint is faster than its share, and no difference is larger than the limits allow.

    A second difference is an acceleration's mean over two steps, so the limit holds for it too;
    the path's own accelerations do not jump, so its change in a step is bounded by the jerk, for
    which the quintic's 60 / T³ with the shortest time that its acceleration allows stands.
    """
    speed = largest_speed(robot)
    q = np.concatenate([first[None], told.q])
    assert np.abs(told.qd).max() <= speed * (1 + 1e-9)
    assert np.abs(np.diff(q, axis=0)).max() <= speed * DT * (1 + 1e-9)
    acceleration = np.diff(q, 2, axis=0) / DT**2
    assert np.abs(acceleration).max() <= ACCELERATION * (1 + 1e-6)
    # The velocities that are told are the positions' derivatives: central differences are off by
    # a sixth of the jerk times the step squared.
    middle = (q[2:] - q[:-2]) / (2 * DT)
    assert np.abs(middle - told.qd[:-1]).max() < ACCELERATION * DT / 2


@any_robot
@given(seed=st.integers(0, 2**32 - 1), times=st.lists(st.integers(1, 400), max_size=6))
@settings(max_examples=3)
def test_from_any_joint_angles_and_by_any_commands_a_robot_comes_to_stand_smoothly(
    name, seed, times
):
    robot = ROBOTS[name]
    first = any_angles(robot, seed)
    commands = [c for k, n in enumerate(times) for c in [DOWN if k % 2 else UP] * n]
    sequencer = Sequencer(Still(), robot)
    told = run(sequencer, first, commands + [UP] * 4000)
    assert sequencer.stage is Stage.STANDING
    assert np.abs(told.q[-1] - neutral_stance(robot).q).max() < 1e-12
    down = run(sequencer, told.q[-1], [DOWN] * 2000, begin=False, until=Stage.LYING)
    assert np.abs(down.q[-1] - packing(robot).folded).max() < 1e-12
    check_smooth(robot, told, first)
    check_smooth(robot, down, told.q[-1])
    limits = robot.arrays.joint_limits
    assert (told.q >= limits[..., 0] - 1e-9).all()
    assert (told.q <= limits[..., 1] + 1e-9).all()


@any_robot
def test_feet_stay_above_the_ground_on_which_the_body_lies_until_they_carry_it(name):
    """The body's pose is known: it lies flat until the feet stand, then rises straight over them.

    A knot every fortieth of a way leaves the spline between them within a tenth of a millimetre.
    """
    robot = ROBOTS[name]
    packed = packing(robot).folded
    told = run(Sequencer(Still(), robot), packed, [UP] * 2000, until=Stage.STANDING)
    knees, feet = knees_and_feet(robot, told.q)
    ground = belly_ground(robot)
    standing = np.abs(ground.height(feet)).max(axis=1) < 1e-6
    first = int(np.argmax(standing))
    assert 0 < first < len(told.q)
    assert ground.height(feet[:first]).min() > -1e-4
    assert ground.height(knees).min() > -1e-4
    # From there to where a foot steps all feet stay where they are on the ground.
    height = feet[first:, :, 2]
    planted = np.ptp(height, axis=1) < 1e-3
    rise = int(np.argmin(planted)) if not planted.all() else len(planted)
    assert np.ptp(feet[first : first + rise, :, :2], axis=0).max() < 1e-4


@any_robot
@given(times=st.lists(st.integers(1, 400), min_size=3, max_size=8))
@settings(max_examples=3)
def test_a_change_of_mind_at_any_moment_is_answered_smoothly(name, times):
    robot = ROBOTS[name]
    packed = packing(robot).folded
    commands = [c for k, n in enumerate(times) for c in [DOWN if k % 2 else UP] * n]
    commands += [DOWN] * 1500
    sequencer = Sequencer(Still(), robot)
    told = run(sequencer, packed, commands)
    assert sequencer.stage is Stage.LYING
    assert np.abs(told.q[-1] - packed).max() < 1e-12
    check_smooth(robot, told, packed)


@any_robot
def test_a_robot_that_stands_on_its_feet_steps_to_neutral_and_never_down_on_its_belly(name):
    """Feet up to 15 mm off and a body 10 mm low: held by all feet, as the geometry tells."""
    robot = ROBOTS[name]
    home = neutral_stance(robot)
    rng = np.random.default_rng(1)
    feet = home.feet - home.pose[:3]
    feet[:, :2] += rng.uniform(-0.015, 0.015, (len(robot.legs), 2))
    feet[:, 2] += 0.01
    first, reached = solve_feet(robot, feet)
    assert reached.all()
    assert resting_ground(robot, first).contact.all()
    sequencer = Sequencer(Still(), robot)
    told = run(sequencer, first, [UP] * 5000, until=Stage.STANDING)
    assert sequencer.stage is Stage.STANDING
    assert np.abs(told.q[-1] - home.q).max() < 1e-12
    check_smooth(robot, told, first)
    assert not any(resting_ground(robot, q).belly_contact for q in told.q[::20])


def farthest_from_home(readings, count=300):
    """Largest distance of the targets from neutral [rad] at a start with these readings.

    The joints give way a little. The last tilt and contacts of the readings stay.
    """
    robot = ROBOTS["phantomx-ax"]
    home, sequencer, farthest = neutral_stance(robot).q, Sequencer(Still(), robot), 0.0
    for step in range(count):
        slope, feet = readings[min(step, len(readings) - 1)]
        half = np.radians(slope) / 2
        seen = Observation(
            step * DT,
            home + 1e-4,
            orientation=np.array([np.cos(half), 0.0, -np.sin(half), 0.0]),
            contact=None if feet is None else np.arange(6) < feet,
        )
        if step == 0:
            sequencer.reset(seen)
        else:
            targets = sequencer.update(seen, UP)
            farthest = max(farthest, float(np.abs(targets.position - home).max()))
    return farthest


@pytest.mark.parametrize(
    ("readings", "stays"),
    [
        *[([(slope, feet)], True) for slope in (9, 25, 35, 45) for feet in (None, 6)],
        *[([(70, feet)], False) for feet in (None, 6)],
        ([(0, 0)], False),
        # One early sample is not believed: feet in the air, or a tilt that is none.
        ([(30, 0), (30, 6)], True),
        ([(80, None), (10, None)], True),
        # Feet that chatter touch now and then.
        ([(30, 0), (30, 1), (30, 0)], True),
        # One contact sample among many without is none.
        ([(90, 6)] * 3 + [(90, 0)], False),
    ],
)
def test_a_robot_that_begins_on_its_feet_stays_on_them(readings, stays):
    """Stance angles with contacts and tilt of a slope, over some updates, tell that it stands.

    Legs of a robot that has fallen, or hangs, fold by tenths of a radian.
    """
    assert (farthest_from_home(readings) < 1e-3) == stays


@pytest.mark.parametrize("name", ["phantomx-ax"])
def test_a_leg_by_hand_goes_where_it_is_told_and_comes_back(name):
    """By its joint angles, or by its foot in the body frame."""
    robot = ROBOTS[name]
    home = neutral_stance(robot).q
    sequencer = Sequencer(Still(), robot)
    asked = np.array([0.3, 0.5, -0.9])
    hand = Command(legs={1: LegCommand(joints=tuple(asked))})
    told = run(sequencer, home, [hand] * 1500)
    assert sequencer.stage is Stage.MANUAL_LEG
    assert np.abs(told.q[-1, 0] - asked).max() < 1e-6
    check_smooth(robot, told, home)
    foot = knees_and_feet(robot, told.q[-1])[1][0]
    by_foot = Command(legs={1: LegCommand(foot=tuple(foot))})
    again = run(Sequencer(Still(), robot), home, [by_foot] * 1500)
    assert np.abs(knees_and_feet(robot, again.q[-1])[1][0] - foot).max() < 1e-6
    back = run(sequencer, told.q[-1], [UP] * 1500, begin=False, until=Stage.STANDING)
    assert sequencer.stage is Stage.STANDING
    assert np.abs(back.q[-1] - home).max() < 1e-12
    check_smooth(robot, back, told.q[-1])
    assert sequencer.events == []


@pytest.mark.parametrize(
    ("legs", "sentence"),
    [
        ((1, 2), "leg right_front and right_rear cannot be moved by hand: the other legs would"),
        ((9,), "leg 9 cannot be moved by hand: there is no such leg."),
    ],
)
def test_legs_that_the_others_cannot_do_without_are_refused_in_a_sentence(legs, sentence):
    robot = ROBOTS["quadruped"]
    sequencer = Sequencer(Still(), robot)
    home = neutral_stance(robot).q
    hand = Command(legs={leg: LegCommand(joints=(0.0, 0.5, -1.0)) for leg in legs})
    told = run(sequencer, home, [hand] * 300)
    assert np.abs(told.q - home).max() == 0
    assert len(sequencer.events) == 1
    assert sequencer.events[0][1].startswith(sentence)


def test_a_foot_in_the_ground_or_out_of_reach_is_waited_out_with_a_sentence():
    robot = ROBOTS["phantomx-ax"]
    sequencer = Sequencer(Still(), robot)
    home = neutral_stance(robot).q
    for foot, why in (
        ((0.231, -0.168, -0.12), "in the ground"),
        ((1.0, 0.0, 0.0), "cannot be put"),
    ):
        told = run(sequencer, home, [Command(legs={1: LegCommand(foot=foot)})] * 600)
        assert why in sequencer.events[-1][1]
        height = neutral_stance(robot).pose[2]
        assert knees_and_feet(robot, told.q)[1][..., 2].min() > -height - 1e-5


def test_a_servo_that_answers_no_more_loses_its_leg_after_a_fifth_of_a_second():
    robot = ROBOTS["phantomx-ax"]
    walker = Still()
    sequencer = Sequencer(walker, robot)
    running = np.ones((6, 3), dtype=bool)
    running[2, 1] = False

    def change(k, observation):
        return replace(observation, servo_running=running | (k < 99))

    run(sequencer, neutral_stance(robot).q, [Command()] * 200, change=change)
    lost = [sorted(c.lost_legs) for c in walker.commands]
    # Last answered at update 98, at 0.495 s; lost at the first one later than 0.695 s.
    assert lost.index([3]) == 139
    assert [s for _, s in sequencer.events] == [
        "servo right_rear.femur answers no more; its leg is lost."
    ]


def test_a_lost_leg_that_stands_is_left_to_the_walking_controller_to_fold():
    """Only legs that a sequence has put somewhere else are held there."""
    robot, held = ROBOTS["phantomx-ax"], []

    class Holding(Still):
        def hold(self, leg, q):
            held.append(leg)

    command = Command(lost_legs=frozenset({2}))
    # It stands a ten-thousandth of a radian from neutral, so that a sequence begins.
    run(Sequencer(Holding(), robot), neutral_stance(robot).q + 1e-4, [command] * 200)
    assert held == []
    run(Sequencer(Holding(), robot), packing(robot).folded, [command] * 2000)
    assert held == [1]


@pytest.mark.parametrize("seed", [0, 12, 17])
def test_legs_of_a_resting_robot_fold_past_the_ground(seed):
    """Straight paths of these dip 7 to 37 mm deep; a millimetre is not worth a way round."""
    robot = ROBOTS["quadruped"]
    first, goal = any_angles(robot, seed), packing(robot).folded
    ground = resting_ground(robot, first)
    paths = fold_legs(robot, first, goal, ground)
    assert np.array_equal(paths[0].at(0.0).position, first)
    assert np.abs(paths[-1].at(paths[-1].duration).position - goal).max() < 1e-12
    for before, after in pairwise(paths):
        assert np.abs(before.at(before.duration).position - after.at(0.0).position).max() < 1e-12
    q = np.array([path.spline(s) for path in paths for s in np.linspace(0, 1, 41)])
    assert ground.height(np.stack(knees_and_feet(robot, q))).min() > -1e-3
    gap = leg_gaps(robot, q)
    assert (gap > np.minimum(0.02, 0.9 * np.minimum(gap[0], gap[-1]))).all()
