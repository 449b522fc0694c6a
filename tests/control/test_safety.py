"""What safety answers to what can go wrong, case by case."""

import math
from dataclasses import replace

import numpy as np
import pytest

from phasmid import load_robot
from phasmid.control.safety import Mode, SafetyMonitor, SafetySettings, tipping
from phasmid.control.safety_filter import BRAKING, SafetyFilter
from phasmid.control.sequences.stance import neutral_stance
from phasmid.experiment import Command, JointTargets, Observation, Posture
from phasmid.kinematics import rpy_quaternion
from phasmid.servo.servo import AMBIENT
from phasmid.units import STANDARD_GRAVITY
from support.sequence_runs import DT

ROBOT = load_robot("phantomx-ax")
HOME = neutral_stance(ROBOT).q
AHEAD = Command(velocity=(0.1, 0.0, 0.0))
SETTINGS = SafetySettings()


def watch(changes, commands, seconds):
    """Check changed observations of the neutral stance and commands every 5 ms.

    Returns the monitor, and time, mode and passed command of each check.
    """
    monitor = SafetyMonitor(ROBOT)
    monitor.reset(Observation(0.0, HOME))
    seen = []
    for k in range(1, round(seconds / DT) + 1):
        time = k * DT
        observation = replace(Observation(time, HOME), **changes(time))
        told, command = monitor.check(observation, commands(time))
        assert np.isfinite(told.joint_position).all()
        seen.append((observation.time, monitor.mode, command))
    return monitor, seen


def tilted(degrees):
    zero = np.zeros(())
    return rpy_quaternion(np.array(math.radians(degrees)), zero, zero)


def first(seen, mode):
    return next(time for time, m, _ in seen if m == mode)


NAN = np.full((6, 3), math.nan)
ONE_BAD = HOME.copy()
ONE_BAD[3, 2] = math.inf

CASES = {
    "no angle of a joint": (
        lambda t: {"joint_position": ONE_BAD if t > 1 else HOME},
        Mode.SLOW,
        "no valid joint angle of left_rear.tibia: the robot stops.",
    ),
    "an orientation that is not finite": (
        lambda t: {"orientation": np.full(4, math.nan) if t > 1 else None},
        Mode.FREE,
        "orientation is not valid and is not used.",
    ),
    "a body that tilts": (
        lambda t: {"orientation": tilted(40 if t > 1 else 0)},
        Mode.SLOW,
        "the predicted tilt of the body is 40°; it tips over at 66°: the robot stops.",
    ),
    "a body that falls": (
        lambda t: {"orientation": tilted(58 if t > 1 else 0)},
        Mode.HOLD,
        "the predicted tilt of the body is 58°; it tips over at 66°: the robot holds still.",
    ),
    "a servo at its limit": (
        lambda t: {"joint_load": np.full((6, 3), 0.95 if t > 1 else 0.1)},
        Mode.SLOW,
        "the output of servo right_front.coxa exceeds 90% for 1 s: the robot walks slower.",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_each_reason_has_its_answer_and_its_event(case):
    changes, mode, sentence = CASES[case]
    monitor, seen = watch(changes, lambda _: AHEAD, 3.0)
    assert max(m for _, m, _ in seen) == mode
    texts = [text for _, text in monitor.events]
    assert texts == [sentence]
    if mode is not Mode.FREE:
        assert monitor.events[0][0] == first(seen, mode)
    goal = {Mode.FREE: 0.1, Mode.HOLD: 0.0}.get(mode, 0.0)
    if case == "a servo at its limit":
        goal = 0.1 * SETTINGS.slow_factor
    assert seen[-1][2].velocity[0] == pytest.approx(goal, abs=1e-12)


def test_the_tilt_that_counts_is_the_one_that_a_turning_body_will_have():
    """Tilted by 20 degrees and turning at w it is where 20 degrees plus w times the time are."""
    monitor = SafetyMonitor(ROBOT)
    monitor.reset(Observation(0.0, HOME))
    rate = np.array([0.5 / tipping(ROBOT, STANDARD_GRAVITY)[1], 0.0, 0.0])
    monitor.check(Observation(DT, HOME, orientation=tilted(20), angular_velocity=rate), AHEAD)
    # The vertical goes along its tangent.
    assert monitor.tilt == pytest.approx(math.radians(20) + math.atan(0.5), abs=1e-12)


def test_a_velocity_is_taken_back_over_the_set_time_and_given_back_likewise():
    def changes(t):
        return {"orientation": tilted(40 if 1 < t <= 1.5 else 0)}

    monitor, seen = watch(changes, lambda _: AHEAD, 5.0)
    speed = np.array([command.velocity[0] for _, _, command in seen])
    assert np.abs(np.diff(speed)).max() <= 0.1 * DT / SETTINGS.slow_time + 1e-12
    assert speed.min() == 0
    assert speed[-1] == 0.1
    height = np.array([command.pose[2] for _, _, command in seen])
    assert height.min() == pytest.approx(-SETTINGS.crouch)
    assert height[-1] == 0
    # Let go when the reason has been gone for the clear time.
    (start, _), (end, text) = monitor.events
    assert text == "the body is level enough again: the restriction ends."
    assert end - start == pytest.approx(0.5 + SETTINGS.clear_time, abs=3 * DT)


def test_old_commands_stop_the_robot_and_then_make_it_sit_until_there_are_new_ones():
    def commands(t):
        return replace(AHEAD, time=1.0 if 1 < t <= 9 else t)

    monitor, seen = watch(lambda _: {}, commands, 12.0)
    assert first(seen, Mode.SLOW) == pytest.approx(1.0 + SETTINGS.command_time, abs=2 * DT)
    assert first(seen, Mode.SIT) == pytest.approx(1.0 + SETTINGS.sit_time, abs=2 * DT)
    assert all((c.posture is Posture.PACKED) == (m is Mode.SIT) for _, m, c in seen)
    assert seen[-1][1] is Mode.FREE
    assert seen[-1][2].velocity == AHEAD.velocity
    assert [text for _, text in monitor.events] == [
        "no command for 0.5 s: the robot stops.",
        "no command for 5 s: the robot sits down.",
        "commands arrive again: the restriction ends.",
    ]


def test_a_servo_that_grows_hot_makes_the_robot_sit_until_it_has_cooled_down():
    """A servo at a share s of its output for t seconds warms by s² U I t / C at first."""
    servo = ROBOT.servo
    rise = servo.temperature_limit - SETTINGS.heat_margin - AMBIENT
    power = 0.8**2 * servo.rated_voltage * servo.stall_current
    # From the equation of warming, T = P R (1 - exp(-t / R C)).
    R, C = servo.thermal_resistance, servo.heat_capacity
    expected = -R * C * math.log(1 - rise / (power * R))
    monitor, seen = watch(
        lambda _: {"joint_load": np.full((6, 3), 0.8)}, lambda _: AHEAD, expected + 2
    )
    # Looked at every tenth of a second.
    assert first(seen, Mode.SIT) == pytest.approx(expected, rel=0.01)
    assert "the temperature of servo right_front.coxa is 65 °C: the robot sits down." in [
        text for _, text in monitor.events
    ]


def test_loads_count_as_heat_while_the_clock_stands_still():
    servo, monitor, load = ROBOT.servo, SafetyMonitor(ROBOT), np.full((6, 3), 0.8)
    monitor.reset(Observation(0.0, HOME))
    monitor.add_load(load, 10.0)
    monitor.check(Observation(DT, HOME, joint_load=load), AHEAD)
    rise = 0.8**2 * servo.rated_voltage * servo.stall_current * servo.thermal_resistance
    left = math.exp(-(10.0 + DT) / (servo.thermal_resistance * servo.heat_capacity))
    assert monitor.temperature[0, 0] == pytest.approx(AMBIENT + rise * (1 - left))


def test_commands_beyond_any_robot_of_this_size_are_brought_into_range():
    monitor = SafetyMonitor(ROBOT)
    monitor.reset(Observation(0.0, HOME))
    given = Command((1e6, 0.0, -1e6), (0.0, 0.0, 0.0, 2.0, 0.0, 0.0), lost_legs=frozenset({7}))
    _, command = monitor.check(Observation(DT, HOME), given)
    assert max(map(abs, command.velocity)) < 100
    assert command.pose[3] == pytest.approx(math.radians(60))
    assert command.lost_legs == frozenset()
    assert [text for _, text in monitor.events] == [
        "velocity and pose and lost legs of a command out of range."
    ]


class Wild:
    """A controller whose targets are what a test says."""

    def __init__(self, targets):
        self.targets, self.resets = targets, 0

    def reset(self, _observation):
        self.resets += 1

    def update(self, observation, _command):
        return JointTargets(*self.targets(observation.time))


@pytest.mark.parametrize(
    ("kind", "wrong", "why"),
    [
        (0, math.nan, "the target of right_rear.femur is not finite; the last one stays."),
        (1, math.nan, "the target of right_rear.femur is not finite; the last one stays."),
        (0, 2.5, "the target of right_rear.femur is beyond the joint's limits."),
        (0, -1.0, "the target of right_rear.femur is farther than the servo can turn."),
    ],
)
def test_targets_that_no_servo_can_be_given_never_leave_the_controller(kind, wrong, why):
    def targets(time):
        targets = HOME.copy(), 0 * HOME
        if time > 0.05:
            targets[kind][2, 1] = wrong
        return targets

    safe = SafetyFilter(Wild(targets), ROBOT)
    safe.reset(Observation(0.0, HOME))
    told = [safe.update(Observation(k * DT, HOME), AHEAD) for k in range(1, 30)]
    assert all(np.isfinite(targets.velocity).all() for targets in told)
    q = [targets.position for targets in told]
    limits = ROBOT.arrays.joint_limits
    assert np.isfinite(q).all()
    assert (np.array(q) <= limits[..., 1] + 1e-6).all()
    assert np.abs(np.diff(q, axis=0)).max() <= 1.021 * ROBOT.servo.no_load_speed * DT
    assert safe.events[0][1] == why


def test_a_robot_that_falls_is_held_still_without_a_jump_and_begins_anew():
    def targets(time):
        return HOME + 0.1 * np.sin(time), np.full(HOME.shape, 0.1 * np.cos(time))

    wild = Wild(targets)
    safe = SafetyFilter(wild, ROBOT)
    safe.reset(Observation(0.0, HOME))
    told = []
    for k in range(1, 800):
        time = k * DT
        orientation = tilted(60 if 1 < time <= 1.5 else 0)
        told.append(safe.update(Observation(time, HOME, orientation=orientation), AHEAD))
    v = np.array([t.velocity for t in told])
    q = np.array([t.position for t in told])
    held = slice(round(1.1 / DT), round(2.4 / DT))
    assert np.abs(v[held]).max() == 0
    # The joints go on by the mean of the speeds while they brake.
    brakes = slice(round(1.0 / DT), held.start)
    mean = (v[brakes] + v[brakes.start - 1 : brakes.stop - 1]) / 2
    assert np.abs(np.diff(q[brakes.start - 1 : brakes.stop], axis=0) - DT * mean).max() < 1e-12
    assert np.abs(np.diff(v[: held.stop], axis=0)).max() <= BRAKING * DT + 1e-9
    assert np.abs(np.diff(q, axis=0)).max() <= 1.021 * ROBOT.servo.no_load_speed * DT
    assert wild.resets == 2


def test_torques_pass_and_one_that_is_not_finite_is_the_last_that_was():
    """A robot that is held still keeps its torques."""
    torque = np.linspace(-1.0, 1.0, HOME.size).reshape(HOME.shape)
    wrong = np.where(np.arange(3) == 1, math.nan, 2 * torque)
    safe = SafetyFilter(Wild(lambda t: (HOME, 0 * HOME, wrong if t > DT else torque)), ROBOT)
    safe.reset(Observation(0.0, HOME))
    assert safe.update(Observation(DT, HOME), AHEAD).torque is torque
    told = safe.update(Observation(2 * DT, HOME), AHEAD)
    np.testing.assert_array_equal(told.torque, torque * [2, 1, 2])
    np.testing.assert_array_equal(told.position, HOME)
    held = safe.update(Observation(4 * DT, HOME, orientation=tilted(60)), AHEAD)
    assert safe.monitor.mode is Mode.HOLD
    assert held.torque is told.torque


def test_a_gap_in_what_sensors_tell_stops_the_robot():
    monitor = SafetyMonitor(ROBOT)
    monitor.reset(Observation(0.0, HOME))
    monitor.check(Observation(0.3, HOME), AHEAD)
    assert monitor.mode is Mode.SLOW
    assert monitor.events == [(0.3, "no observation for 0.3 s: the robot stops.")]
