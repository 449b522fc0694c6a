"""The locomotion engine in a world without forces."""

from dataclasses import replace

import numpy as np
import pytest

from phasmid.control import LocomotionEngine
from phasmid.control.types import LegPhase
from phasmid.control.velocity_limits import LEAST_CLEARANCE
from phasmid.errors import InvalidInput
from phasmid.experiment import Command, Observation
from phasmid.gait import GAITS, load_gait
from phasmid.kinematics import joint_angles, neutral_feet, trunk_clearance
from phasmid.robot import load_robot
from support.kinematic_world import core_engine, drive, random_commands

DIRECTIONS = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (1, -1, 0), (0, 0, 1), (1, 0, -4)]
ROBOTS = ["phantomx-ax", "quadruped", "octopod"]
ENGINES = {}


def engine_of(name):
    """Return an engine after a reset; the next test reuses it."""
    if name not in ENGINES:
        ENGINES[name] = core_engine(load_robot(name))
    engine = ENGINES[name]
    engine.reset(Observation(0.0, home(engine.robot)))
    return engine


def home(robot):
    return joint_angles(robot.arrays, robot.arrays.neutral_foot)


def check(seen):
    """Check what holds at every update, for any command."""
    limits = seen.robot.arrays.joint_limits
    assert np.isfinite(seen.q).all()
    # Stance feet are fixed points; their displacement is round-off.
    assert seen.slip < 1e-9
    assert seen.joint_speed.max() <= seen.robot.servo.no_load_speed
    assert (seen.q >= limits[..., 0]).all()
    assert (seen.q <= limits[..., 1]).all()
    assert seen.margin.min() > 0
    assert "held all" not in " ".join(sentence for _, sentence in seen.events)


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("seed", range(3))
def test_any_sequence_of_commands_keeps_feet_joints_and_balance(name, seed):
    engine = engine_of(name)
    rng = np.random.default_rng(seed)
    commands = random_commands(engine.robot, rng, 12.0)
    commands.append((12.0, Command(gait=commands[-1][1].gait)))
    seen = drive(engine, commands, 20.0)
    check(seen)
    assert engine.is_standing
    # At rest the feet are at their neutral places, but for what need not be stepped (0.5 mm).
    away = seen.feet_in_body[-1] - neutral_feet(engine.robot)
    assert np.abs(away).max() < 6e-4


# Without the reference governor a leg cannot follow, or never comes to rest: poses that change
# during a swing (3, 36), turns during swings that can hardly rise (5, 38), and stance feet that
# are left behind (25).
@pytest.mark.parametrize("seed", [3, 5, 25, 36, 38])
def test_commands_are_followed_without_an_abrupt_stop_with_sensing_and_torque(seed):
    engine = LocomotionEngine(load_robot("phantomx-ax"))
    commands = random_commands(engine.robot, np.random.default_rng(seed), 22.0)
    commands.append((22.0, Command(gait=commands[-1][1].gait)))
    seen = drive(engine, commands, 30.0)
    check(seen)
    assert engine.is_standing
    assert "braked" not in " ".join(sentence for _, sentence in seen.events)
    # The path's velocity is a mean of a reference that changes by the acceleration at most.
    feet = np.array([1.0, 1.0, engine.model.radius])
    change = np.linalg.norm(np.diff(seen.velocity, axis=0) * feet, axis=1)
    assert change.max() <= engine.settings.acceleration * seen.dt * (1 + 1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_steady_walk_has_the_feasible_velocity(name):
    engine = engine_of(name)
    for gait in list(GAITS[len(engine.robot.legs)])[:2]:
        for direction in DIRECTIONS[:: 3 if len(gait) > 4 else 5]:
            engine.reset(Observation(0.0, home(engine.robot)))
            limit = engine.largest_velocity(direction, gait=gait)
            assert np.linalg.norm(limit.velocity) > 0.005
            velocity = tuple(0.999 * v for v in limit.velocity)
            # It starts from rest, with the feet where no cycle has them: seven cycles on it is
            # steady.
            swing = 2 / 3 if gait == "crawl" else 0.5
            period = swing / load_gait(gait, len(engine.robot.legs)).swing_fraction
            seen = drive(engine, [(0.0, Command(velocity=velocity, gait=gait))], 9 * period)
            check(seen)
            begin = 7 * len(seen.path) // 9
            second = seen.path[begin:]
            mean = seen.velocity[begin:].mean(axis=0)
            np.testing.assert_allclose(mean, velocity, rtol=1e-3, atol=1e-5)
            way = np.linalg.norm(np.diff(second[:, :2], axis=0), axis=1).sum()
            time = (len(second) - 1) * seen.dt
            assert way == pytest.approx(np.hypot(*velocity[:2]) * time, rel=1e-3, abs=1e-6)
            assert seen.slow[begin:].min() == 1.0


def test_beyond_the_limit_a_command_is_scaled_in_all_its_components():
    engine = engine_of("phantomx-ax")
    limit = np.array(engine.largest_velocity((1.0, 0.5, 2.0)).velocity)
    drive(engine, [(0.0, Command(velocity=(2.0, 1.0, 4.0)))], 0.01)
    given = engine.reference.velocity
    np.testing.assert_allclose(given / given[0], [1.0, 0.5, 2.0], rtol=1e-12)
    # Found by halving, to a part in 250 of it.
    np.testing.assert_allclose(given, limit, rtol=6e-3)
    assert any("scaled" in sentence for _, sentence in engine.events)


def test_joints_and_feet_move_without_a_jump_of_speed_or_acceleration():
    # Of a path with bounded jerk j the second difference changes by j dt³ at most from one update
    # to the next: with half the step, an eighth (here less than a quarter, for round numbers).
    # Central differences miss the joints' velocities by j dt²/6, which halving reduces to a quarter
    # (less than a half), and their accelerations by j dt/2 where the jerk jumps.
    changes, velocity_errors, acceleration_errors = [], [], []
    for dt in (0.01, 0.005):
        engine = core_engine(load_robot("phantomx-ax"), update_period=dt)
        commands = [
            (0.0, Command(velocity=(0.1, 0.0, 0.0))),
            (1.3, Command(velocity=(-0.05, 0.05, 0.2), pose=(0, 0, 0.01, 0.05, 0, 0))),
            (3.1, Command()),
        ]
        seen = drive(engine, commands, 6.0)
        check(seen)
        assert seen.slow.min() == 1.0
        changes.append(np.abs(np.diff(seen.feet_in_body, n=3, axis=0)).max())
        error = seen.qd[1:-1] - (seen.q[2:] - seen.q[:-2]) / (2 * dt)
        velocity_errors.append(np.abs(error).max())
        error = seen.qdd[1:-1] - (seen.qd[2:] - seen.qd[:-2]) / (2 * dt)
        acceleration_errors.append(np.abs(error).max())
    assert changes[1] < changes[0] / 4
    assert velocity_errors[1] < velocity_errors[0] / 2
    assert acceleration_errors[1] < acceleration_errors[0] / 1.5


def test_a_mirrored_command_gives_a_mirrored_walk():
    engine = engine_of("phantomx-ax")
    ends = []
    for sign in (1, -1):
        engine.reset(Observation(0.0, home(engine.robot)))
        command = Command(velocity=(0.05, 0.03 * sign, 0.1 * sign))
        ends.append(drive(engine, [(0.0, command)], 5.0).path[-1])
    np.testing.assert_allclose(ends[0] * [1, -1, -1], ends[1], atol=1e-9)


def test_a_robot_walks_on_five_legs_and_on_six_again():
    engine = engine_of("phantomx-ax")
    lost = frozenset({2})
    commands = [
        (0.0, Command(velocity=(0.1, 0.0, 0.0))),
        (2.0, Command(velocity=(0.1, 0.0, 0.0), lost_legs=lost)),
        (9.0, Command(lost_legs=lost)),
        (12.0, Command(velocity=(0.05, 0.0, 0.0))),
        (15.0, Command()),
    ]
    seen = drive(engine, commands, 20.0)
    check(seen)
    k = round(9.0 / seen.dt)
    assert not seen.stance[round(6.0 / seen.dt) : k, 1].any()
    way = seen.path[k, 0] - seen.path[round(6.0 / seen.dt), 0]
    assert way > 0.05
    assert engine.is_standing


def test_a_lost_leg_folds_upwards():
    """It folds from the top of a swing; with the acceleration there it would go down first."""
    engine = engine_of("phantomx-mk4")
    command = Command(lost_legs=frozenset({2}))
    heights = []
    for k in range(1, 401):
        engine.update(Observation(0.005 * k, engine.state.q.copy()), command)
        if engine.state.leg_phase[1] == LegPhase.HELD:
            heights.append(engine.state.foot[1, 2])
    assert heights[0] == pytest.approx(engine.reference.step_height, abs=1e-3)
    assert min(heights) == heights[0]
    np.testing.assert_allclose(engine.state.q[1], engine.model.folded[1])


@pytest.mark.parametrize("lost", [{1, 4}, {2, 5}, {3, 6}])
def test_a_robot_walks_on_four_legs_and_on_six_again(lost):
    """Two opposite legs lost: feet that stay at the neutral places of six legs allow 13 mm/s."""
    engine = engine_of("phantomx-mk4")
    lost = frozenset(lost)
    limit = engine.largest_velocity((1.0, 0.0, 0.0), lost_legs=lost)
    assert limit.velocity[0] > 0.03
    whole = engine.largest_velocity((1.0, 0.0, 0.0))
    commands = [
        (0.0, Command(velocity=(0.5 * limit.velocity[0], 0.0, 0.0), lost_legs=lost)),
        (14.0, Command()),
    ]
    seen = drive(engine, commands, 22.0)
    check(seen)
    k = round(14.0 / seen.dt)
    # The feet step over to their new places for the first cycle of 3 s.
    assert seen.path[k, 0] > 0.5 * limit.velocity[0] * 9.0
    assert engine.is_standing
    np.testing.assert_array_equal(engine.model.nominal, neutral_feet(engine.robot))
    assert engine.largest_velocity((1.0, 0.0, 0.0)) == whole


@pytest.mark.parametrize("lost", [{1, 3}, {1, 5}])
def test_a_robot_stands_where_the_other_legs_cannot_step(lost):
    """Without 1 and 3 no lift is supported; without 1 and 5 legs do not reach far enough."""
    engine = engine_of("phantomx-mk4")
    lost = frozenset(lost)
    seen = drive(engine, [(0.0, Command(velocity=(0.05, 0.0, 0.0), lost_legs=lost))], 3.0)
    assert engine.is_lame
    assert np.abs(seen.path[-1]).max() < 1e-9
    assert (seen.stance[-1] == [leg not in lost for leg in range(1, 7)]).all()


def test_a_pose_does_not_lay_the_trunk_on_the_ground():
    """Low and tilted, each of which alone the legs and the ground allow."""
    robot = load_robot("phantomx-ax")
    length, width, height = robot.body.size
    # A box that is turned about one axis, and lowered.
    pitched = 0.14 - height / 2 * np.cos(0.3) - length / 2 * np.sin(0.3)
    pose = np.array([0.0, 0.0, -0.01, 0.0, 0.3, 0.5])
    assert trunk_clearance(robot, 0.15, pose) == pytest.approx(pitched)
    rolled = 0.15 - height / 2 * np.cos(0.2) - width / 2 * np.sin(0.2)
    pose = np.array([0.1, 0.0, 0.0, -0.2, 0.0, 0.0])
    assert trunk_clearance(robot, 0.15, pose) == pytest.approx(rolled)
    engine = engine_of("phantomx-ax")
    command = Command(pose=(0.0, 0.0, -0.0568, -0.311, 0.3745, -0.4686))
    drive(engine, [(0.0, command)], 3.0)
    assert any("too near to the ground" in sentence for _, sentence in engine.events)
    clearance = trunk_clearance(robot, engine.model.height, engine.state.pose_filter[3])
    assert trunk_clearance(robot, engine.model.height, np.array(command.pose)) < 0.0
    assert LEAST_CLEARANCE - 1e-6 <= clearance < LEAST_CLEARANCE + 0.002


def test_a_robot_with_more_legs_than_a_record_has_is_refused():
    robot = load_robot("octopod")
    ninth = replace(robot.legs[0], name="ninth", mount_position=np.zeros(3))
    legs = (*robot.legs, ninth)
    with pytest.raises(InvalidInput, match=r"^the robot has 9 legs; the locomotion engine walks"):
        LocomotionEngine(replace(robot, legs=legs))
