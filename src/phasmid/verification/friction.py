"""Friction: sticking, creeping, sliding and stopping."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from phasmid.simulation import Run
from phasmid.verification.engine import contact_points, hold, touching
from phasmid.verification.laboratory import Laboratory
from phasmid.verification.row import Row, reading, seen

FRICTIONS = (0.3, 0.7)
"""Coefficients of friction that are tried."""

HALVINGS = 5
"""Halvings of the 4° in which the steepest slope is sought: it is found to 0.06°."""

SLIDING = 0.5
"""Time after which the speed on a slope is measured [s]."""

CREEP_SLOPE = math.radians(20)
"""Slope on which creep is measured."""

CREEPLESS = 5000.0
"""Friction damping with which creep at 20° stays below 1e-4 m/s [N·s/m]."""

FAST_SLIP = 0.05
"""Slip above which a point's friction is on its cone [m/s]: its damper of 500 N·s/m then takes
25 N, more than friction and the point's own inertia need."""

RUN_UP = 0.8
"""Speed from which the robot stops [m/s]."""

BRAKING_STEP = 0.00025
"""Time step of stopping [s]."""


def incline(laboratory: Laboratory) -> Iterator[Row]:
    """The steepest slope that holds the robot, found by halving; six feet, joints held."""
    for friction in FRICTIONS:
        critical = math.atan(friction)
        low, high = critical - math.radians(2), critical + math.radians(2)
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            run = laboratory.standing(friction=friction)
            # Twice the speed at which it could creep with all friction that there is.
            limit = 2 * friction * _weight(run) / _damping(run)
            slides = _speed_on_slope(run, middle) > limit
            low, high = (low, middle) if slides else (middle, high)
        yield reading(
            f"steepest that holds, μ = {friction:g}",
            math.degrees((low + high) / 2),
            0.5,
            "The charter's; after 0.5 s a slope steeper by 0.1° shows, found to 0.06°.",
            unit="°",
            expected=math.degrees(critical),
        )


def creep(laboratory: Laboratory) -> Iterator[Row]:
    """How fast the robot goes down a slope of 20° on which it sticks."""
    for damping in (laboratory.scenario.contact.friction_damping, CREEPLESS):
        run = laboratory.standing(friction_damping=damping)
        speed = _speed_on_slope(run, CREEP_SLOPE)
        law = _weight(run) * math.sin(CREEP_SLOPE) / _damping(run)
        yield reading(
            f"{damping:g} N·s/m a point",
            speed,
            1e-3 * law,
            "Stated: friction that sticks is a damper here. Joints are held to a thousandth.",
            unit="m/s",
            expected=law,
        )
    yield reading(
        f"bound, {CREEPLESS:g} N·s/m a point",
        speed,
        1e-4,
        "The charter's 1e-4 m/s; it takes more friction damping than the default.",
        unit="m/s",
    )


def stopping(laboratory: Laboratory) -> Iterator[Row]:
    """The way of the robot that slides on six feet, joints held, until it rests."""
    for friction in FRICTIONS:
        run = laboratory.standing(friction=friction, dt=BRAKING_STEP)
        g = run.scenario.model.gravity
        run.data.qvel[0] = RUN_UP
        start, aloft = float(run.data.qpos[0]), 0
        steps = round(RUN_UP / (friction * g) / BRAKING_STEP)
        for k in hold(run, steps + round(0.1 / BRAKING_STEP)):
            aloft += k < steps and run.data.ncon == 0
        expected = RUN_UP**2 / (2 * friction * g)
        yield reading(
            f"way, μ = {friction:g}",
            float(run.data.qpos[0]) - start,
            0.005 * expected,
            "Half a step at full speed is 0.2 %; the damper in which friction ends adds about "
            "0.1 mm, 0.2 %.",
            unit="m",
            expected=expected,
        )
        yield reading(
            f"time off the ground, μ = {friction:g}",
            100 * aloft / steps,
            None,
            "A point that slips by v is pushed up by μ · damping · v besides, as engines with "
            "convex contact have it: above load / (μ · damping), here some 0.1 m/s, feet hop.",
            unit="%",
        )


def cone(laboratory: Laboratory) -> Iterator[Row]:
    """Every point's friction while the robot slides and stops, at every step."""
    measured: list[tuple[float, float, float, int]] = []
    for friction in FRICTIONS:
        run = laboratory.standing(friction=friction)
        run.data.qvel[:2] = [0.6, -0.8]
        slipping = 2 * friction * _weight(run) / _damping(run)
        measured += [_friction(run, friction, slipping) for _ in hold(run, 300)]
    over, short, along, slips = np.reshape(measured, (-1, 4)).T
    yield reading(
        "beyond μ times the normal force",
        over.max(initial=0.0),
        1e-9,
        "The cone is exact in the engine; forces below 30 N round by 1e-14 N.",
        unit="N",
    )
    yield reading(
        "short of μ times the normal force, fast slip",
        short.max(initial=0.0),
        1e-9,
        f"A point that slips by more than {FAST_SLIP:g} m/s has all the friction that the cone "
        "allows; round-off as above.",
        unit="N",
    )
    yield reading(
        "along the slip",
        along.max(initial=0.0),
        1e-9,
        "Friction takes energy from a point that slips, and never gives.",
        unit="N",
    )
    yield seen(int(slips.sum()), "points that slipped fast, all steps together")


def _friction(run: Run, friction: float, slipping: float) -> tuple[float, float, float, int]:
    """Return excess over the cone, shortfall in fast slip and friction along the slip.

    All three are the largest of all points [N]; the last number counts points in fast slip.
    """
    import mujoco

    # Contacts, forces and velocities of one instant.
    mujoco.mj_forward(run.model, run.data)
    touch = touching(run.robot, run.model, run.data)
    if not len(touch.leg):
        return 0.0, 0.0, 0.0, 0
    normal = np.sum(touch.force * touch.normal, axis=1)
    tangential = touch.force - normal[:, None] * touch.normal
    slip = touch.velocity - np.sum(touch.velocity * touch.normal, axis=1)[:, None] * touch.normal
    speed = np.linalg.norm(slip, axis=1)
    over = np.linalg.norm(tangential, axis=1) - friction * normal
    slips, fast = speed > slipping, speed > FAST_SLIP
    along = np.sum(tangential * slip, axis=1)[slips] / speed[slips]
    return (
        float(over.max()),
        float(-over[fast].min(initial=0.0)),
        float(along.max(initial=0.0)),
        int(fast.sum()),
    )


def _weight(run: Run) -> float:
    return run.robot.mass * run.scenario.model.gravity


def _damping(run: Run) -> float:
    """Return the friction damping of all feet's points [N·s/m]."""
    return contact_points(run.robot) * run.scenario.contact.friction_damping


def _speed_on_slope(run: Run, slope: float) -> float:
    """Speed downhill, half a second after level ground has become a slope [m/s].

    Gravity is turned, not the ground: seen from the ground it is the same.
    """
    g = run.scenario.model.gravity
    run.model.opt.gravity[:] = [g * math.sin(slope), 0.0, -g * math.cos(slope)]
    for _ in hold(run, round(SLIDING / run.dt)):
        pass
    return float(run.data.qvel[0])
