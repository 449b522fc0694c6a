"""The leg bench against kinematics, dynamics, closed forms and virtual work."""

import json
import math
from functools import cache, partial

import numpy as np
import pytest
from matplotlib.path import Path

from phasmid.dynamics import leg_torque
from phasmid.errors import InvalidInput, InvalidRobot, Unreachable
from phasmid.kinematics import explain_foot, foot_position, joint_angles
from phasmid.robot import load_robot, preset_names
from phasmid.studio.bench import bench as bench_at
from phasmid.studio.bench import workspace
from phasmid.studio.messages import Bench
from phasmid.units import STANDARD_GRAVITY
from support.general_robot import general_robot

bench = partial(bench_at, gravity=STANDARD_GRAVITY)

ROBOTS = [*(load_robot(name) for name in preset_names()), general_robot()]
ROUND_OFF = 1e-14
"""Positions and torques are sums of some ten terms below 10, each of relative round-off 1.1e-16."""


@pytest.fixture(params=ROBOTS, ids=lambda robot: robot.name)
def robot(request):
    return request.param


def poses(robot, count=20, seed=0):
    """Legs, angles and forces at random, within the joint limits."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        leg = int(rng.integers(1, len(robot.legs) + 1))
        low, high = robot.legs[leg - 1].joint_limits.T
        yield leg, tuple(rng.uniform(low, high).tolist()), tuple(rng.uniform(-9, 9, 3).tolist())


@cache
def answers(robot):
    """What the bench tells of these poses; nobody may change it."""
    return [(p, bench(robot, Bench(leg=p[0], angles=p[1], force=p[2]))) for p in poses(robot)]


# ---------------------------------------------------------------------------- pose and frames


def test_frames_end_at_the_foot_and_follow_from_the_table_shown_beside_them(robot):
    for (leg, q, _), told in answers(robot):
        X = np.eye(4)
        for (alpha, a, d, theta), frame in zip(told["dh"], told["frames"][1:], strict=True):
            ca, sa, ct, st = math.cos(alpha), math.sin(alpha), math.cos(theta), math.sin(theta)
            # Rx(alpha) Tx(a) Rz(theta) Tz(d), which Eq. 1 multiplies out.
            X = X @ [[1, 0, 0, a], [0, ca, -sa, 0], [0, sa, ca, 0], [0, 0, 0, 1]]
            X = X @ [[ct, -st, 0, 0], [st, ct, 0, 0], [0, 0, 1, d], [0, 0, 0, 1]]
            np.testing.assert_allclose(frame["origin"], X[:3, 3], atol=ROUND_OFF)
            np.testing.assert_allclose(np.transpose(frame["axes"]), X[:3, :3], atol=ROUND_OFF)
        foot = foot_position(robot.legs[leg - 1], np.array(q))
        np.testing.assert_allclose(told["frames"][-1]["origin"], foot, atol=ROUND_OFF)
        np.testing.assert_allclose(told["foot"], foot, atol=0)
        assert told["frames"][0] == {"name": "hip", "origin": [0, 0, 0], "axes": np.eye(3).tolist()}


# -------------------------------------------------------------------------------- out of reach


@pytest.mark.parametrize("foot", [(0.5, 0.1, -0.1), (0.06, 0.0, 0.01), (0.0, 0.0, 0.0)])
def test_a_foot_out_of_reach_is_explained_and_the_nearest_possible_one_is_shown(foot):
    robot = load_robot("phantomx-paper")
    with pytest.raises(Unreachable):
        joint_angles(robot.legs[0], np.array(foot))
    told = bench(robot, Bench(leg=1, foot=foot))
    found = explain_foot(robot.legs[0], np.array(foot))
    assert told["remarks"][0] == found.sentence
    np.testing.assert_allclose(told["foot"], found.nearest, atol=ROUND_OFF)
    assert not any("stands at" in each for each in told["remarks"])


def test_a_foot_beyond_a_joint_limit_is_explained_and_shown_there():
    robot, foot = load_robot("phantomx-paper"), (0.15, -0.05, 0.14)
    told = bench(robot, Bench(leg=1, foot=foot))
    assert told["remarks"][0] == explain_foot(robot.legs[0], np.array(foot)).sentence
    np.testing.assert_allclose(told["foot"], foot, atol=ROUND_OFF)


# ------------------------------------------------------------------------------------ Jacobian


def test_joint_speeds_of_unit_norm_move_the_foot_along_the_half_axes(robot):
    for _, told in answers(robot):
        J, values = np.array(told["jacobian"]), np.array(told["singular_values"])
        axes = values[:, None] * np.array(told["directions"])
        # The speeds that move the foot to the ends of the half axes have unit norm.
        speeds = np.linalg.solve(J, axes.T)
        worst = values.max() / values.min()
        np.testing.assert_allclose(speeds.T @ speeds, np.eye(3), atol=worst * ROUND_OFF)
        # Forces on the half axes of the other ellipsoid take torques of unit norm.
        forces = np.array(told["force_axes"])[:, None] * told["directions"]
        np.testing.assert_allclose(np.linalg.norm(forces @ J, axis=1), 1, rtol=worst * ROUND_OFF)
        speed = robot.servo.no_load_speed
        np.testing.assert_allclose(told["fastest"], speed * values, rtol=ROUND_OFF)


def test_remarks_name_singularities_and_limits():
    robot = load_robot("phantomx-paper")
    told = bench(robot, Bench(leg=1, angles=tuple(np.radians([80.0, 0.0, -90.0]))))
    # The coxa's limits are ±75°, the femur's ±100°, the tibia's -180° and -23°.
    np.testing.assert_allclose(np.degrees(told["room"]), [-5, 100, 67], atol=1e-12)
    assert told["remarks"] == ["right_front.coxa stands at 80.0°; its limits are -75° to 75°."]
    # det J = r Lf Lt sin(q3) with the foot 52 + 82 mm out.
    assert told["manipulability"] == pytest.approx(0.134 * 0.082 * 0.14, abs=ROUND_OFF)
    straight = bench(robot, Bench(leg=1, angles=(0.0, 0.3, 0.0)))
    assert straight["nearness"] < 1e-15
    assert any("the knee is nearly stretched" in each for each in straight["remarks"])
    # No force along a stretched leg takes a torque: what is infinite, JSON has no number for.
    assert straight["force_axes"][2] is None
    folded = bench(robot, Bench(leg=1, angles=(0.0, 0.3, -math.pi)))
    assert any("the knee is nearly folded flat" in each for each in folded["remarks"])
    under = bench(robot, Bench(leg=1, foot=(0.001, 0.0, -0.15)))
    assert any("the foot is close to the coxa axis" in each for each in under["remarks"])
    assert not any("singular" in each for each in bench(robot, Bench(leg=1))["remarks"])


# -------------------------------------------------------------------------------------- torques


def test_the_load_s_torques_do_the_work_that_the_force_takes_away(robot):
    # Virtual work: for any joint speeds the motors give what the ground takes, torque·q' = -F·x'.
    rng = np.random.default_rng(3)
    for (_, _, force), told in answers(robot):
        speeds = rng.normal(size=3)
        foot = np.array(told["jacobian"]) @ speeds
        given = np.dot(told["torque"]["load"], speeds)
        assert given == pytest.approx(-np.dot(force, foot), abs=10 * ROUND_OFF)


def test_torques_are_those_of_equation_11_at_rest_and_beside_the_servo_s(robot):
    for (leg, q, force), told in answers(robot):
        which, zero = robot.legs[leg - 1], np.zeros(3)
        right = leg_torque(
            which, np.array(q), zero, zero, foot_force=np.array(force), gravity=STANDARD_GRAVITY
        )
        np.testing.assert_allclose(told["torque"]["sum"], right, atol=10 * ROUND_OFF)
        share = np.abs(right) / robot.servo.stall_torque
        np.testing.assert_allclose(told["share"], share, atol=10 * ROUND_OFF)
        assert told["servo"]["name"] == robot.servo.name
        said = [each for each in told["remarks"] if "to hold" in each]
        assert len(said) == np.sum(share > 1)


def test_at_the_largest_force_the_worst_servo_gives_all_it_has(robot):
    for (leg, q, force), told in answers(robot):
        way = np.array(force) / np.linalg.norm(force)
        most = bench(robot, Bench(leg=leg, angles=q, force=tuple((told["most"] * way).tolist())))
        if max(np.abs(told["torque"]["gravity"])) > robot.servo.stall_torque:
            assert told["most"] == 0
            continue
        assert max(most["share"]) == pytest.approx(1, rel=1e-12)
    assert bench(robot, Bench(leg=1))["most"] is None


# ------------------------------------------------------------------------------------ workspace


def inside(curves, point):
    """Whether a point lies in any of the curves."""
    return any(Path(curve).contains_point(point) for curve in curves)


def distance(curves, point):
    """Of a point from the curves' edges [m]."""
    best = math.inf
    for curve in curves:
        a, b = curve, np.roll(curve, -1, axis=0)
        along = b - a
        square = np.maximum(np.sum(along**2, axis=1), 1e-30)
        share = np.clip(np.sum((point - a) * along, axis=1) / square, 0, 1)
        best = min(best, np.linalg.norm(a + share[:, None] * along - point, axis=1).min())
    return best


def test_the_outline_holds_what_the_joint_limits_allow_and_nothing_else(robot):
    rng = np.random.default_rng(5)
    leg = robot.legs[0]
    curves = workspace(leg)[0]
    femur, tibia = leg.lengths[1:]
    # Arcs of radius R up to the stretched leg are drawn by chords of 3°, which leave them by
    # R (1 - cos 1.5°); where the coxa axis cuts an edge, a chord of 3° may be bent.
    chord = (femur + tibia) * math.radians(3.0)
    sagitta = (femur + tibia) * (1 - math.cos(math.radians(1.5)))
    low, high = leg.joint_limits.T
    for q in rng.uniform(low, high, (400, 3)):
        x, _, z = foot_position(leg, np.array([0.0, q[1], q[2]]))
        if x >= chord:
            assert inside(curves, (x, z)) or distance(curves, (x, z)) <= sagitta
    size = 1.1 * leg.lengths.sum()
    for r, z in rng.uniform([chord, -size], [size, size], (400, 2)):
        if distance(curves, (r, z)) > sagitta:
            assert inside(curves, (r, z)) == allowed(leg, r, z)


def allowed(leg, r, z):
    """Whether a knee bent to either side puts the foot there within femur's and tibia's limits."""
    try:
        _, q2, q3 = joint_angles(leg, np.array([r, leg.lateral_offsets.sum(), z]))
    except Unreachable:
        return False
    # The knee to the other side mirrors femur and tibia at the line from femur axis to foot.
    line = math.atan2(z, r - leg.lengths[0])
    low, high = leg.joint_limits[1:].T
    for angles in ((q2, q3), (2 * line - q2, -q3)):
        turned = np.array([angles[0] + 2 * np.pi * k for k in (-1, 0, 1)])
        ok = np.any((turned >= low[0]) & (turned <= high[0])) and low[1] <= angles[1] <= high[1]
        if ok:
            return True
    return False


# ----------------------------------------------------------------------------- as printed, JSON


def test_the_equations_as_printed_stand_beside_the_right_ones():
    robot = load_robot("phantomx-paper")
    told = bench(robot, Bench(leg=1, force=(1.0, 2.0, 9.0)))
    J, torque = np.array(told["jacobian"]), np.array(told["torque"]["sum"])
    # Eq. 11 has the ground's force with the other sign.
    np.testing.assert_allclose(
        told["printed"]["torque"], torque + 2 * J.T @ [1, 2, 9], atol=10 * ROUND_OFF
    )
    # Eq. 1 has an angle, 90 degrees, where the coxa's length belongs, and nothing for the others.
    np.testing.assert_allclose(told["printed"]["foot"], [0.09, 0, 0], atol=ROUND_OFF)
    # b11 as printed is half of what it should be.
    printed, right = (told["printed"][name]["B"] for name in ("matrices", "matrices_right"))
    assert printed[0][0] == pytest.approx(right[0][0] / 2, rel=1e-12)


def test_every_answer_is_json_even_where_numbers_are_infinite(robot):
    for leg in range(1, len(robot.legs) + 1):
        for request in (
            Bench(leg=leg),
            Bench(leg=leg, angles=(0.0, 0.0, 0.0)),
            Bench(leg=leg, foot=(9, 9, 9)),
        ):
            told = bench(robot, request)
            assert json.loads(json.dumps(told, allow_nan=False)) == told


# ------------------------------------------------------------------------------------- refusals


def test_a_leg_that_is_none_and_two_poses_at_once_are_refused():
    robot = load_robot("phantomx-paper")
    with pytest.raises(InvalidRobot, match=r"there is no leg 7; legs are 1 to 6\."):
        bench(robot, Bench(leg=7))
    with pytest.raises(InvalidInput, match="both angles and foot"):
        bench(robot, Bench(leg=1, angles=(0.0, 0.0, 0.0), foot=(0.1, 0.0, 0.0)))
