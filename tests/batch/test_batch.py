"""The kernels against the readable equations that they are made of."""

from __future__ import annotations

import os
import tracemalloc

import numpy as np
import pytest

from phasmid import batch, dynamics, kinematics
from phasmid.batch import generated, series
from phasmid.errors import Unreachable
from phasmid.robot import Robot, load_robot

BLOCK = int(generated.BLOCK)

# The same operations on the same numbers, products and sums at times in one rounding, sines and
# cosines within 2.5 units in the last place: torques of up to 30 N·m, sums of a hundred terms, err
# by 100 * 2.2e-16 * 30 = 7e-13 at most and by a tenth of it in truth. A wrong term shows at 1e-5.
SAME = 1e-12

pytestmark = pytest.mark.usefixtures("backend")


def _states(rng: np.random.Generator, *shape: int) -> tuple[np.ndarray, ...]:
    q = rng.uniform(-np.pi, np.pi, (*shape, 3))
    return q, 5 * rng.normal(size=q.shape), 20 * rng.normal(size=q.shape), rng.normal(size=q.shape)


def _within_reach(rng: np.random.Generator, robot: Robot, *shape: int) -> np.ndarray:
    q = rng.uniform([-2.0, -1.0, -2.5], [2.0, 1.0, -0.1], (*shape, len(robot.legs), 3))
    p = kinematics.foot_position(robot.arrays, q)
    inwards = (np.cos(q[..., 0]) * p[..., 0] + np.sin(q[..., 0]) * p[..., 1]) < 1e-3
    return np.where(inwards[..., None], robot.arrays.neutral_foot, p)


def _motion(rng: np.random.Generator, *lead: int) -> dynamics.BodyMotion:
    quaternion = rng.normal(size=(*lead, 4))
    quaternion /= np.linalg.norm(quaternion, axis=-1, keepdims=True)
    p, v, w, a, dw = rng.normal(size=(5, *lead, 3)) * np.reshape(
        [1, 1, 3, 5, 20], (5, *(1 for _ in lead), 1)
    )
    return dynamics.BodyMotion(p, kinematics.quaternion_rotation(quaternion), v, w, a, dw)


def test_torques_of_all_legs_are_those_of_the_readable_form(
    robot: Robot, rng: np.random.Generator
) -> None:
    q, qd, qdd, force = _states(rng, 300, len(robot.legs))
    for f in (None, force):
        ours = batch.leg_torque(robot.arrays, q, qd, qdd, foot_force=f, gravity=3.7)
        theirs = dynamics.leg_torque(robot.arrays, q, qd, qdd, foot_force=f, gravity=3.7)
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=SAME)


def test_torques_of_one_leg_are_those_of_the_readable_form(
    robot: Robot, rng: np.random.Generator
) -> None:
    leg = robot.legs[-1]
    q, qd, qdd, force = _states(rng, 300)
    ours = batch.leg_torque(leg, q, qd, qdd, foot_force=force)
    theirs = dynamics.leg_torque(leg, q, qd, qdd, foot_force=force)
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=SAME)


def test_feet_and_jacobians_are_those_of_the_readable_form(
    robot: Robot, rng: np.random.Generator
) -> None:
    q = _states(rng, 300, len(robot.legs))[0]
    for leg, angles in ((robot.arrays, q), (robot.legs[1], q[:, 1])):
        p, J = batch.foot_position(leg, angles), batch.jacobian(leg, angles)
        np.testing.assert_allclose(p, kinematics.foot_position(leg, angles), rtol=0, atol=SAME)
        np.testing.assert_allclose(J, kinematics.jacobian(leg, angles), rtol=0, atol=SAME)


def test_a_foot_put_where_the_inverse_says_is_where_it_was_asked(
    robot: Robot, rng: np.random.Generator
) -> None:
    # FK(IK(p)) = p: sums of a few terms below 0.5 m, 1e-16 each.
    p = _within_reach(rng, robot, 300)
    for leg, points in ((robot.arrays, p), (robot.legs[1], p[:, 1])):
        q = batch.joint_angles(leg, points)
        assert np.abs(kinematics.foot_position(leg, q) - points).max() < 1e-12
        # Near a straight leg the angles are ill-conditioned by 1 / sin q3, here at most 10, and
        # near the coxa axis by 0.1 m over the 1 mm of distance: 1e-16 * 100 * 10.
        assert np.abs(q - kinematics.joint_angles(leg, points)).max() < 1e-12


@pytest.mark.parametrize("short", [0.0, 1e-15, 1e-12, 1e-9, 1e-6])
def test_the_round_trip_holds_up_to_full_stretch(robot: Robot, short: float) -> None:
    leg = robot.legs[0]
    coxa, femur, tibia = leg.lengths
    elevation = np.linspace(-1.5, 1.5, 301)
    length = (femur + tibia) * (1 - short)
    p = np.stack(
        [coxa + length * np.cos(elevation), 0 * elevation, length * np.sin(elevation)], axis=-1
    )
    assert np.abs(batch.foot_position(leg, batch.joint_angles(leg, p)) - p).max() < 1e-12


def test_the_whole_robot_needs_what_the_recursion_says(
    robot: Robot, rng: np.random.Generator
) -> None:
    # Forces reach 200 N in sums of a thousand terms, whose round-off adds at random:
    # 30 * 2.2e-16 * 200 = 1.3e-12, so the bound is relative to the largest.
    q, qd, qdd, force = _states(rng, 200, len(robot.legs))
    body = _motion(rng, 200)
    for f in (None, force):
        ours = batch.inverse_dynamics(robot, body, q, qd, qdd, foot_force=f, gravity=3.7)
        theirs = dynamics.inverse_dynamics(robot, body, q, qd, qdd, foot_force=f, gravity=3.7)
        for a, b in zip(ours, theirs, strict=True):
            np.testing.assert_allclose(a, b, rtol=0, atol=SAME * max(1.0, np.abs(b).max()))


def test_a_trunk_at_rest_serves_many_states_and_the_reverse(rng: np.random.Generator) -> None:
    robot = load_robot("phantomx-mk4")
    q, qd, qdd, _ = _states(rng, 4, 5, 6)
    still, moving = dynamics.BodyMotion.at_rest(), _motion(rng, 4, 5)
    for body, joints in ((still, (q, qd, qdd)), (moving, (q[0, 0], qd[0, 0], qdd))):
        ours = batch.inverse_dynamics(robot, body, *joints)
        theirs = dynamics.inverse_dynamics(robot, body, *joints)
        for a, b in zip(ours, theirs, strict=True):
            np.testing.assert_allclose(a, b, rtol=0, atol=SAME * max(1.0, np.abs(b).max()))


@pytest.mark.parametrize("count", [0, 1, BLOCK - 1, BLOCK, BLOCK + 1, 5000])
def test_any_number_of_samples_will_do(count: int, rng: np.random.Generator) -> None:
    robot = load_robot("phantomx-paper")
    leg = robot.legs[0]
    q, qd, qdd, _ = _states(rng, count)
    ours = batch.leg_torque(leg, q, qd, qdd)
    assert ours.shape == (count, 3)
    np.testing.assert_allclose(ours, dynamics.leg_torque(leg, q, qd, qdd), rtol=0, atol=SAME)
    J = batch.jacobian(leg, q)
    np.testing.assert_allclose(J, kinematics.jacobian(leg, q), rtol=0, atol=SAME)


def test_one_state_gives_one_result(rng: np.random.Generator) -> None:
    robot = load_robot("phantomx-paper")
    leg, p = robot.legs[0], robot.legs[0].neutral_foot
    q, qd, qdd, _ = _states(rng)
    assert batch.leg_torque(leg, q, qd, qdd).shape == (3,)
    assert batch.jacobian(leg, q).shape == (3, 3)
    np.testing.assert_allclose(
        batch.joint_angles(leg, p), kinematics.joint_angles(leg, p), rtol=0, atol=SAME
    )
    assert batch.foot_position(robot.arrays, q).shape == (6, 3)
    body = dynamics.BodyMotion.at_rest()
    torque, wrench = batch.inverse_dynamics(robot, body, *np.zeros((3, 6, 3)))
    assert torque.shape == (6, 3)
    # At rest the trunk has to be held against the whole weight.
    np.testing.assert_allclose(wrench[2], robot.mass * 9.81, rtol=1e-14)


def test_arrays_of_any_layout_and_shape_are_taken(rng: np.random.Generator) -> None:
    robot = load_robot("phantomx-paper")
    wide, qd, qdd, force = _states(rng, 7, 40, 6)
    q = np.asfortranarray(wide)[::2, ::-1]
    qd, qdd, force = qd[:1, :40], qdd[0, 0, :1], force[::2, :1]
    expected = dynamics.leg_torque(robot.arrays, q, qd, qdd, foot_force=force)
    ours = batch.leg_torque(robot.arrays, q, qd, qdd, foot_force=force)
    np.testing.assert_allclose(ours, expected, rtol=0, atol=SAME)
    out = np.zeros((4, 40, 6, 6))[..., ::2]
    assert batch.leg_torque(robot.arrays, q, qd, qdd, foot_force=force, out=out) is out
    np.testing.assert_array_equal(out, ours)


def test_a_number_that_is_none_makes_no_other_one_wrong(rng: np.random.Generator) -> None:
    leg = load_robot("phantomx-paper").legs[0]
    q, qd, qdd, force = _states(rng, 3 * BLOCK)
    for array in (q, qd, qdd, force):
        array[rng.integers(0, len(q), 5), 1] = np.nan
    q[7, 2] = np.inf
    ours = batch.leg_torque(leg, q, qd, qdd, foot_force=force)
    with np.errstate(invalid="ignore"):
        theirs = dynamics.leg_torque(leg, q, qd, qdd, foot_force=force)
    assert np.isnan(theirs).any()
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=SAME, equal_nan=True)
    np.testing.assert_array_equal(np.isnan(ours), np.isnan(theirs))


@pytest.mark.parametrize("turns", [1e3, 9e4, 1e6])
def test_angles_of_many_turns_are_reduced_exactly(turns: float, rng: np.random.Generator) -> None:
    # An angle of 1e6 rad is known to 1e-10 rad, and taken as if exact by both.
    leg = load_robot("phantomx-paper").legs[0]
    q = rng.uniform(-turns, turns, (1000, 3))
    p = batch.foot_position(leg, q)
    np.testing.assert_allclose(p, kinematics.foot_position(leg, q), rtol=0, atol=SAME)


def test_threads_give_the_same_bits(rng: np.random.Generator) -> None:
    robot = load_robot("phantomx-paper")
    q, qd, qdd, _ = _states(rng, 9000, 6)
    p = _within_reach(rng, robot, 9000)
    for work in (
        lambda n: batch.leg_torque(robot.arrays, q, qd, qdd, threads=n),
        lambda n: batch.joint_angles(robot.arrays, p, threads=n),
        lambda n: batch.foot_position(robot.legs[0], q[::2, 0], threads=n),
    ):
        one = work(1)
        for n in (2, 3, None):
            np.testing.assert_array_equal(work(n), one)
    body = _motion(rng, 9000)
    one = batch.inverse_dynamics(robot, body, q, qd, qdd)
    two = batch.inverse_dynamics(robot, body, q, qd, qdd, threads=2)
    for a, b in zip(one, two, strict=True):
        np.testing.assert_array_equal(a, b)


def test_a_result_may_take_the_place_of_its_input(rng: np.random.Generator) -> None:
    leg = load_robot("phantomx-paper").legs[0]
    q, qd, qdd, _ = _states(rng, 1000)
    expected = batch.leg_torque(leg, q, qd, qdd)
    assert batch.leg_torque(leg, q, qd, qdd, out=qdd) is qdd
    np.testing.assert_array_equal(qdd, expected)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("wrong", [[0.5, 0.0, 0.0], [np.nan, 0.0, 0.0], [0.06, 0.0, 0.0]])
def test_the_first_unreachable_point_is_named_as_by_the_readable_form(
    threads: int, wrong: list[float]
) -> None:
    robot = load_robot("phantomx-paper")
    p = np.tile(robot.arrays.neutral_foot, (2, 5000, 1, 1))
    for place in ((1, 2000, 4), (1, 2000, 5), (1, 3000, 0)):
        p[place] = wrong
    for leg, points in ((robot.arrays, p), (robot.legs[4], p[..., 4, :])):
        with pytest.raises(Unreachable) as ours:
            batch.joint_angles(leg, points, threads=threads)
        with pytest.raises(Unreachable) as theirs:
            kinematics.joint_angles(leg, points)
        assert str(ours.value) == str(theirs.value)
        assert ours.value.index == theirs.value.index
        assert ours.value.index[:2] == (1, 2000)


def test_memory_stays_within_three_times_the_inputs(rng: np.random.Generator) -> None:
    # Inputs 9, results 3 numbers per sample: 4/3 and what a part or a block needs besides; the
    # bound is the issue's.
    leg = load_robot("phantomx-paper").legs[0]
    q, qd, qdd, _ = _states(rng, 200_000)
    batch.leg_torque(leg, q[:1], qd[:1], qdd[:1])
    inputs = q.nbytes + qd.nbytes + qdd.nbytes
    for arrays in ((q, qd, qdd), (q[::-1], qd[::-1], qdd[::-1])):
        tracemalloc.start()
        batch.leg_torque(leg, *arrays)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert inputs + peak < 3 * inputs
        # In fact no more than the results and a few megabytes.
        assert peak < q.nbytes + 6e6


def test_all_cores_are_those_that_this_process_may_use(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # One core out of many: parts are then worked on in turn, whatever the machine has.
    monkeypatch.setattr(os, "cpu_count", lambda: 64)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {3}, raising=False)
    parts: list[tuple[int, int]] = []
    series.in_parts(lambda *part: parts.append(part), 4 * series.PART, None, largest=None)
    assert parts == [(0, 4 * series.PART)]
    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    parts.clear()
    series.in_parts(lambda *part: parts.append(part), 4 * series.PART, None, largest=None)
    assert sorted(parts) == [(0, 2 * series.PART), (2 * series.PART, 4 * series.PART)]
