"""Feet that find no ground where they come down look for it elsewhere."""

import math

import numpy as np
import pytest

from control.estimation.walker import DT, ROBOT, SPEED, Walker
from phasmid.control.blocked_directions import BlockedDirections
from phasmid.control.engine import LocomotionEngine
from phasmid.control.estimation.estimator import update_estimates
from phasmid.control.estimation.ground_plane import FORGETTING_TIME
from phasmid.control.footholds import FAR, LOOKS
from phasmid.control.leg_phases import PROBING_SPEED
from phasmid.control.types import LegPhase, Manoeuvre, SearchStage
from phasmid.experiment import Command, Observation
from phasmid.kinematics import joint_angles
from phasmid.robot import load_robot

NAMES, EVERYWHERE = ROBOT.leg_names, (-10.0, 10.0)


@pytest.mark.parametrize(
    ("way", "start", "width"),
    [("ahead", 0.02, 0.03), ("left", 0.03, 0.06)],
)
def test_a_gap_is_stepped_over(way, start, width):
    """Every foot comes to stand beyond the gap, none in it, the body over those that stand."""
    walker = Walker(way)
    begin = walker.front + start
    walker.trench = begin, begin + width
    leg, foot, speed, q, margin, search, _ = walker.walk(30.0)
    assert (walker.along(foot[-1]) > walker.trench[1]).all()
    stands, over = leg == LegPhase.STANCE, walker.is_over_trench(foot)
    assert not (stands & over).any()
    # No foot goes through a wall of the gap; feet settle 0.4 of 12 ms of the probing speed beyond.
    settled = 0.4 * 0.012 * PROBING_SPEED + 1e-4
    assert foot[~over, 2].min() > -settled - DT * PROBING_SPEED
    assert margin.min() >= 0.0
    most = ROBOT.servo.no_load_speed * DT
    assert np.abs(np.diff(q, axis=0)).max() <= most * (1 + 1e-9)
    looks = (np.diff(search, axis=0) > 0) & (search[1:] <= LOOKS)
    # It begins to look from rest: an update before the end of a quintic of some depth in a time T
    # its speed is 30 depth / T (DT / T)², T being 1.875 depth over the probing speed, and the depth
    # over 15 mm.
    shortest = 1.875 * 0.015 / PROBING_SPEED
    assert speed[:-1][looks].max() < 30 * 0.015 / shortest * (DT / shortest) ** 2
    assert looks.any()
    assert not (stands & (search > 0) & (search <= LOOKS)).any()
    assert (search[-1] == 0).all()


@pytest.mark.parametrize("way", ["ahead", "left"])
def test_a_foot_looks_along_the_way_first_and_then_as_far_behind(way):
    walker = Walker(way)
    # Of all feet only those in front are over it, and find no ground on either side.
    walker.trench = walker.front - 0.12, walker.front + 1.0
    leg, foot, _, _, _, search, _ = walker.walk(3.5)
    looks = int(np.argmax(search[-1]))
    last = (leg[:-1, looks] == LegPhase.PROBING) & (leg[1:, looks] != LegPhase.PROBING)
    first, ahead, behind = walker.along(foot[1:][last, looks])[:3]
    # Feet land where they are told to, to round-off.
    assert ahead - first == pytest.approx(FAR, abs=1e-9)
    assert behind - first == pytest.approx(-FAR, abs=1e-9)


def test_it_gives_up_until_it_has_found_ground_again():
    walker = Walker(trench=EVERYWHERE)
    leg, _, _, _, _, search, _ = walker.walk(25.0)
    assert (np.diff(search, axis=0) >= 0).all()
    assert (search[-1] == SearchStage.GAVE_UP).all()
    assert not ((leg == LegPhase.STANCE) & (search > 0) & (search <= LOOKS)).any()
    # Each leg has told both once, and none was stopped.
    told = walker.said
    for name in NAMES:
        assert told.count(f"leg {name} finds no ground: it looks elsewhere") == 1
        assert told.count(f"leg {name} finds no ground: it stands in the air") == 1
    assert not any(sentence.startswith("held all") for sentence in told)
    walker.trench = 0.0, 0.0
    *_, search, _ = walker.walk(5.0)
    assert (search[-1] == 0).all()


@pytest.mark.parametrize(("width", "later"), [(0.12, 0.1), (0.3, 0.4), (0.12, 0.8)])
def test_a_robot_that_stops_while_a_foot_looks_stands(width, later):
    """As it rises, swings and comes down."""
    walker = Walker()
    begin = walker.front + 0.005
    walker.trench = begin, begin + width
    state = walker.state
    walker.until(lambda s: s.search_stage == 1)
    walker.walk(later)
    walker.command = Command()
    walker.walk(10.0)
    assert state.clock.gait_running == 0
    assert (state.leg_phase == LegPhase.STANCE).all()


@pytest.mark.parametrize("doing", [LegPhase.SWING, LegPhase.PROBING, Manoeuvre.RISE])
def test_feet_that_are_caught_stand_where_they_come_down(doing):
    walker = Walker(trench=EVERYWHERE)
    state = walker.state
    rises = doing == Manoeuvre.RISE
    walker.until(lambda s: (s.manoeuvre if rises else s.leg_phase) == doing)
    caught = state.leg_phase != LegPhase.STANCE
    walker.engine.catch()
    leg, *_ = walker.walk(1.0)
    first = leg[np.argmax(leg[:, caught] != LegPhase.PROBING, axis=0), np.flatnonzero(caught)]
    assert (first == LegPhase.STANCE).all()


@pytest.mark.parametrize(
    ("name", "period"), [("phantomx-ax", 1.0), ("quadruped", None), ("octopod", None)]
)
def test_joints_go_on_where_a_foot_begins_to_look(name, period):
    """Also near a joint's limit, to which a leg that swings yields: its angle is where its speeds
    before and after tell, but for the trapezoid's error of a DT² / 4 at an acceleration of a. A
    rise of 60 mm in 0.28 s makes 5 m/s² at the most. A knee stretched to its limit of 15° turns by
    less than 250 rad/s² for it, 5 m/s² over 80 mm sin 15°."""
    robot = load_robot(name)
    engine = LocomotionEngine(robot, ground_sensing=False, dynamics="none", period=period)
    q = joint_angles(robot.arrays, robot.arrays.neutral_foot)
    command, state = Command(velocity=(SPEED, 0.0, 0.0), pose=(0, 0, 0.02, 0, 0, 0)), engine.state
    time, off, looks = 0.0, 0.0, 0
    while time < 12.0:
        before, rate, search = state.q.copy(), state.qd.copy(), state.search_stage.copy()
        time += DT
        engine.reference.contact[:] = (
            state.leg_phase == LegPhase.STANCE if time > 3.0 else state.foot[:, 2] <= 1e-4
        )
        engine.update(Observation(time=time, joint_position=q), command)
        begins = (state.search_stage > search) & (state.search_stage <= LOOKS)
        if begins.any():
            looks += 1
            jump = state.q - before - DT * (rate + state.qd) / 2
            off = max(off, np.abs(jump[begins]).max())
    assert looks > 0
    assert off < 250 * DT**2 / 4


@pytest.mark.parametrize(("way", "start"), [("ahead", 0.01), ("left", 0.06)])
def test_a_robot_stops_at_an_edge(way, start):
    """Where no look finds ground its feet go back, and it rests on them; told so again it stays."""
    walker = Walker(way)
    walker.trench = walker.front + start, 10.0
    leg, foot, _, q, margin, _, _ = walker.walk(25.0)
    state = walker.state
    assert state.clock.gait_running == 0
    assert (state.leg_phase == LegPhase.STANCE).all()
    assert not walker.is_over_trench(foot[leg == LegPhase.STANCE]).any()
    assert margin.min() >= 0.0
    most = ROBOT.servo.no_load_speed * DT
    assert np.abs(np.diff(q, axis=0)).max() <= most * (1 + 1e-9)
    told = walker.said
    assert any(sentence.startswith("goes no farther: leg ") for sentence in told)
    assert (state.search_stage == SearchStage.RETURNED).any()
    assert any(sentence.endswith("it is back where it stood") for sentence in told)
    walker.command = Command(velocity=(*(0.8 * SPEED * walker.way), 0.0))
    *_, path = walker.walk(2.0)
    assert np.ptp(path) < 1e-9


def test_on_rough_or_mapped_ground_a_direction_is_blocked_by_the_third_return():
    """The next foothold may be on ground; after 60 mm of walking the returns count anew."""
    state = LocomotionEngine(ROBOT, ground_sensing=False, dynamics="none").state
    state.missed_foothold[0] = state.last_foothold[0] + (0.1, 0.0, 0.0)

    def blocked_after(roughness, *walked, mapped=False):
        blocked = BlockedDirections(state)
        state.path[:] = 0.0
        for distance in walked:
            state.path[0] += distance
            for stage in (SearchStage.RETURNED, SearchStage.NONE):
                state.search_stage[0] = stage
                state.clock.search_changes += 1
                blocked.update(roughness, mapped)
        return blocked.blocking_leg(np.array([0.05, 0.0, 0.0])) is not None

    assert blocked_after(0.0, 0.0)
    assert not blocked_after(0.01, 0.0, 0.0)
    assert blocked_after(0.01, 0.0, 0.0, 0.0)
    assert not blocked_after(0.01, 0.0, 0.0, 0.1)
    assert not blocked_after(0.0, 0.0, 0.0, mapped=True)
    assert blocked_after(0.0, 0.0, 0.0, 0.0, mapped=True)


@pytest.mark.parametrize(
    ("name", "gait", "period", "way", "speed"),
    [
        ("phantomx-ax", "tripod", 1.0, "left", 0.12),
        ("phantomx-mk4", "ripple", 2.5, "left", 0.04),
        ("octopod", "tetrapod", 1.5, "ahead", 0.12),
    ],
)
def test_robots_stop_at_an_edge_at_any_speed(name, gait, period, way, speed):
    """Also where a foot that goes back passes under its hip, where joints would jump."""
    walker = Walker(way, robot=load_robot(name), speed=speed, period=period, gait=gait)
    walker.trench = walker.front + 0.03, 10.0
    leg, foot, _, _, margin, _, _ = walker.walk(30.0)
    assert walker.state.clock.gait_running == 0
    assert not walker.is_over_trench(foot[-1]).any()
    assert (leg[-1] == LegPhase.STANCE).all()
    assert margin.min() >= 0.0


@pytest.mark.parametrize("later", [0.05, 0.4])
def test_a_way_is_closed_although_the_robot_is_told_to_stop_while_a_foot_goes_back(later):
    walker = Walker()
    walker.trench = walker.front + 0.03, 10.0
    walker.until(lambda s: s.search_stage == SearchStage.RETURNING)
    walker.engine.take_events()
    walker.walk(later)
    ahead, walker.command = walker.command, Command()
    walker.walk(6.0)
    assert walker.state.clock.gait_running == 0
    walker.command = ahead
    *_, path = walker.walk(2.0)
    assert np.ptp(path) < 1e-9
    assert any(sentence.startswith("goes no farther") for sentence in walker.said)


@pytest.mark.parametrize(
    ("roughness", "planned", "weight"), [(0.05, False, 1.0), (0.0, False, 0.0), (0.05, True, 0.0)]
)
def test_on_rough_ground_the_plane_follows_a_foot_that_finds_no_ground(roughness, planned, weight):
    """It is the least-squares plane; on even ground, or with a planned foothold, it stays."""
    engine = LocomotionEngine(ROBOT, dynamics="none")
    q = joint_angles(ROBOT.arrays, ROBOT.arrays.neutral_foot)
    engine.reset(Observation(time=0.0, joint_position=q, contact=np.ones(6, dtype=bool)))
    memory, state = engine.memory.view(np.recarray)[0], engine.state
    estimator = memory.estimator

    def update():
        engine.estimator.measure(Observation(time=0.0, joint_position=q, contact=contact))
        update_estimates(
            memory.states[0], estimator, memory.estimator_parameters, memory.measurements
        )

    contact = np.ones(6, dtype=bool)
    for _ in range(5):
        update()
    depth, contact[0] = 0.04, False
    state.leg_phase[0] = LegPhase.PROBING
    state.foot[0, 2] -= depth
    state.next_foothold[0] = state.foot[0] if planned else np.nan
    estimator.roughness = roughness
    for _ in range(400):
        update()
    plane = estimator.ground_plane
    # Feet that do not stand are forgotten from the first update on.
    root = np.sqrt([weight * math.exp(-DT / FORGETTING_TIME), 1, 1, 1, 1, 1])
    xy = np.column_stack([state.foot[:, :2], np.ones(6)])
    z = -depth * np.eye(6)[0]
    slope_x, slope_y, _ = np.linalg.lstsq(root[:, None] * xy, root * z, rcond=None)[0]
    np.testing.assert_allclose([plane.slope_x, plane.slope_y], [slope_x, slope_y], atol=1e-6)
    assert (abs(slope_x) > 0.01) == (weight > 0)
