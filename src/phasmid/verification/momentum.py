"""Momentum of the robot afloat, which its own legs cannot change."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from phasmid.dynamics import momentum
from phasmid.kinematics import joint_angles
from phasmid.simulation import build_model
from phasmid.verification.engine import (
    INTEGRATORS,
    Integrator,
    joint_state,
    trunk_motion,
    with_integrator,
)
from phasmid.verification.laboratory import Laboratory
from phasmid.verification.row import Row, reading, seen

STEPS: dict[Integrator, float] = {"the project's": 1e-3, "RK4": 2.5e-4}
"""Time step of each integrator [s]; the servos hold a leg at up to 100 rad/s, which RK4 must
resolve to its fourth power."""

LOOK = 0.05
"""Time from one look at the momentum to the next [s]."""

LOOKS = 20
"""Number of samples after the start."""

WAVING = 1.0
"""Speed above which a joint is counted as moving [rad/s]."""


def floating_momentum(laboratory: Laboratory) -> Iterator[Row]:
    """Without gravity, drifting and turning, all legs waved by servos for a second."""
    bounds = {
        "the project's": (
            1e-2,
            "An error of first order: legs that turn by 2 rad/s lose their part of it at each "
            "step, some 1e-3 of the whole in a second.",
        ),
        "RK4": (1e-9, "Of fourth order: 1.1e-8 was measured at 1 ms, so 4e-11 at a quarter of it."),
    }
    waving = 0
    for integrator in INTEGRATORS:
        tolerance, why = bounds[integrator]
        name = "RK4" if integrator == "RK4" else "implicit"
        step = f"{1000 * STEPS[integrator]:g} ms"
        drifts, moving = _drifts(laboratory, integrator)
        waving += moving
        for what, drift in drifts.items():
            yield reading(f"{what}, {name}, {step}", drift, tolerance, why)
    yield seen(waving, f"joints above {WAVING:g} rad/s, all instants together")


def _drifts(laboratory: Laboratory, integrator: Integrator) -> tuple[dict[str, float], int]:
    """Largest change of linear and angular momentum, as parts of those at the start.

    The second value counts joints that move, over all instants.
    """
    import mujoco

    scenario = laboratory.scenario.replace(drive="ideal-servo")
    robot, step = scenario.load_robot(), STEPS[integrator]
    model = with_integrator(build_model(robot, scenario), integrator, step)
    model.opt.gravity[:] = 0.0
    data = mujoco.MjData(model)
    neutral = joint_angles(robot.arrays, robot.arrays.neutral_foot).ravel()
    data.qpos[2] = 10.0
    data.qpos[7:] = neutral
    data.qvel[:6] = [0.3, 0.2, -0.1, 0.5, -0.4, 0.8]
    wave = 0.3 * np.cos(np.arange(len(neutral)))
    stride = round(LOOK / step)
    looks, moving = [], 0
    for k in range(LOOKS * stride + 1):
        if k % stride == 0:
            q, qd, _ = joint_state(data)
            moving += int(np.count_nonzero(np.abs(qd) > WAVING))
            looks.append(momentum(robot, trunk_motion(data), q, qd))
        data.ctrl[:] = neutral + wave * math.sin(2 * math.pi * k * step)
        mujoco.mj_step(model, data)
    drifts = {}
    for name in ("linear", "angular"):
        rows = np.array([getattr(look, name) for look in looks])
        drifts[name] = float(np.abs(rows - rows[0]).max() / np.linalg.norm(rows[0]))
    return drifts, moving
