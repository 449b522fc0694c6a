"""Static torques and friction of simple stances: by hand and by a linear programme."""

import math

import numpy as np
import pytest
from scipy.optimize import linprog

from advice.by_hand import stance_of, with_massless_legs, with_numbers
from phasmid.advice.bounds import (
    BISECTIONS,
    EVEN,
    FACES,
    MOST_FRICTION,
    postures,
    static_loads,
)
from phasmid.kinematics import body_from_hip, foot_position
from phasmid.robot import load_robot
from phasmid.scenario import Scenario

GRAVITY, MASS = 9.81, 2.0

LOAD = MASS * GRAVITY / 4
"""Weight on each foot of the quadruped, whose feet are symmetric about its centre of mass [N]."""

PYRAMID = math.cos(math.pi / FACES)
"""Friction of a pyramid along the normal of a face, as a share of the cone's. The quadruped's legs
point at multiples of 45 degrees, which are such normals."""

SOLVER = 1e-5
"""Tolerance of the quadratic programme, whose constraints hold to 1e-6 of the load."""

QUADRUPED = with_massless_legs(load_robot("quadruped"), MASS)


def leg_by_hand(robot):
    """Distances of a foot from the axes of femur and tibia, outwards and downwards [m].

    The two links and the way from the femur's axis to the foot form a triangle; the knee is above.
    """
    leg = robot.legs[0]
    out, down = leg.neutral_foot[0] - leg.coxa.length, -leg.neutral_foot[2]
    femur, tibia, way = leg.femur.length, leg.tibia.length, math.hypot(out, down)
    inner = math.acos((femur**2 + way**2 - tibia**2) / (2 * femur * way))
    knee = inner - math.atan2(down, out)
    return (out, down), (out - femur * math.cos(knee), down + femur * math.sin(knee))


def torques_by_hand(robot, inwards):
    """Torques of femur and tibia under the weight and a force towards the body [N·m]."""
    return tuple(abs(LOAD * out - inwards * down) for out, down in leg_by_hand(robot))


def test_one_leg_s_torque_without_and_with_friction():
    # The ground pushes each foot towards the body, and the four forces are in balance.
    stance = stance_of(QUADRUPED)
    for friction, torque in ((0.0, stance.unaided()), (0.1, stance.aided(0.1))):
        femur, tibia = torques_by_hand(QUADRUPED, friction * PYRAMID * LOAD)
        expected = np.tile([0.0, femur, tibia], (1, 4, 1))
        assert femur > tibia
        # Levers are below 0.2 m.
        np.testing.assert_allclose(np.abs(torque), expected, atol=0.2 * SOLVER * LOAD)


def test_the_least_friction_of_a_symmetric_stance():
    """Of the force by hand that brings the femur's torque to its limit, over the weight.

    The bisection ends within a part of the interval from 1e-3 to `MOST_FRICTION`, above the least.
    """
    (out, down), _ = leg_by_hand(QUADRUPED)
    limit = 0.8 * LOAD * out
    inwards = (LOAD * out - limit) / down
    assert max(torques_by_hand(QUADRUPED, inwards)) == pytest.approx(limit)
    stance = stance_of(with_numbers(QUADRUPED, rated_stall_torque=limit))
    least = stance.least_friction()
    step = math.log(MOST_FRICTION / 1e-3) / 2**BISECTIONS
    excess = math.log(least * LOAD * PYRAMID / inwards)
    assert -SOLVER <= excess <= step + SOLVER


def test_no_friction_is_enough_for_servos_that_are_too_small():
    # One force cannot point at the axes of both femur and tibia and carry the weight.
    stance = stance_of(with_numbers(QUADRUPED, rated_stall_torque=1e-4))
    assert math.isinf(stance.least_friction())
    strong = stance_of(with_numbers(QUADRUPED, rated_stall_torque=9.0))
    assert strong.least_friction() == 0.0


def points_of_contact(robot, q):
    """Feet in the body's axes, of a robot without balls [m]."""
    assert robot.foot_radius == 0
    return body_from_hip(robot, foot_position(robot.arrays, q))


def best_share_by_a_linear_programme(robot, q, stance, friction):
    """Smallest largest share of a stall torque: forces of the standing feet and the share.

    Jacobians are differences of the feet over 1e-6 rad, with errors of 1e-9 m.
    """
    on, step = np.flatnonzero(stance), 1e-6
    feet = points_of_contact(robot, q)
    width = 3 * len(on) + 1
    equal, less = np.zeros((6, width)), []
    for i, leg in enumerate(on):
        part = slice(3 * i, 3 * i + 3)
        equal[:3, part] = np.eye(3)
        equal[3:, part] = np.cross(feet[leg], np.eye(3)).T
        for joint in range(3):
            turned = [q.copy(), q.copy()]
            turned[0][leg, joint] += step
            turned[1][leg, joint] -= step
            ahead, behind = (points_of_contact(robot, each)[leg] for each in turned)
            for sign in (1, -1):
                row = np.zeros(width)
                row[part] = sign * (ahead - behind) / (2 * step)
                row[-1] = -robot.arrays.stall_torque[leg, joint]
                less.append(row)
        angles = 2 * np.pi * np.arange(FACES) / FACES if math.isfinite(friction) else []
        for angle in angles:
            row = np.zeros(width)
            row[part] = [np.cos(angle), np.sin(angle), -friction * PYRAMID]
            less.append(row)
    bounds = [(None, None), (None, None), (0, None)] * len(on) + [(0, None)]
    weight = [0, 0, robot.mass * GRAVITY, 0, 0, 0]
    cost = np.append(np.zeros(width - 1), 1.0)
    found = linprog(cost, np.array(less), np.zeros(len(less)), equal, weight, bounds)
    assert found.success
    return found.fun


@pytest.mark.parametrize("friction", [0.1, 0.7, math.inf])
@pytest.mark.parametrize("name", ["phantomx-paper", "quadruped"])
def test_the_best_help_is_that_of_a_linear_programme(name, friction):
    """The programme of `aided` adds half of `EVEN` times the sum of squared shares.

    With t the least largest share, no share is larger in the linear programme: its sum over n
    joints is at most n t². The other programme has no larger total, so that its largest share is at
    most t + EVEN/2 n t².
    """
    robot = with_massless_legs(load_robot(name), MASS)
    experiment = Scenario(robot=robot).build()
    chosen = postures(experiment)
    found = static_loads(experiment, chosen=chosen)
    shares = (np.abs(found.aided(friction)) / robot.arrays.stall_torque).max(axis=(1, 2))
    stable = found.stable
    assert stable.sum() > 10
    for i in np.flatnonzero(stable)[::3]:
        least = best_share_by_a_linear_programme(robot, chosen.q[i], chosen.stance[i], friction)
        more = EVEN / 2 * 3 * chosen.stance[i].sum() * least**2
        assert least - SOLVER <= shares[i] <= least + more + SOLVER
