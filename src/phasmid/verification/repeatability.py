"""Symmetry, independence of names and axes, and the same bits again."""

from __future__ import annotations

import math
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from phasmid.motion import plan
from phasmid.recording import Recording, load_recording, save_recording
from phasmid.robot import Robot
from phasmid.scenario import Scenario, load_scenario
from phasmid.simulation import Run, simulate
from phasmid.verification.laboratory import CannotMeasure, Laboratory
from phasmid.verification.row import Reading

if TYPE_CHECKING:
    import mujoco

TURN = 0.7
"""By how much the world is turned [rad]."""

ORDER = (2, 0, 1, 5, 3, 4)
"""Another order in which the legs are declared."""

CYCLES = 2
"""Cycles that are compared."""


def symmetry(laboratory: Laboratory) -> list[Reading]:
    """The walk mirrored, with legs declared in another order, and begun in another direction."""
    # Table 2's links are turned, not mirrored, from right to left; at mid-length they are both.
    base = laboratory.scenario.replace(
        mass_model="mid-length", duration=CYCLES * laboratory.scenario.stride.period, step_turn=0.1
    )
    plain = _walked(base)
    robot = base.base_robot()
    mirrored = _walked(_with_order(base, _opposite_legs(robot)).replace(step_turn=-0.1))
    shuffled = replace(robot, legs=tuple(robot.legs[i] for i in ORDER))
    reordered = _walked(_with_order(base, ORDER).replace(robot=shuffled))
    turned = _walked(base, turn=TURN)
    c, s = math.cos(TURN), math.sin(TURN)
    cases = {
        "mirror image": mirrored * [1.0, -1.0, 1.0],
        "legs declared in another order": reordered,
        "world turned by 0.7 rad": turned @ [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]],
    }
    return [
        Reading(
            float(np.abs(trunk - plain).max()),
            1e-9,
            "The same numbers in another order: what rounding (1e-16 m) and the solver's tolerance "
            "leave, over 4000 steps.",
            unit="m",
            case=case,
        )
        for case, trunk in cases.items()
    ]


def replay(laboratory: Laboratory) -> list[Reading]:
    """Half a second of walk: run twice, reloaded, run again from its file, and continued."""
    scenario = laboratory.scenario.replace(duration=0.5)
    first, again = (simulate(scenario, plan(scenario)) for _ in range(2))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "recording.nc"
        save_recording(first, path)
        reloaded = load_recording(path)
        for name in ("scenario", "robot"):
            text = str(reloaded.attrs[name])
            (Path(folder) / f"{name}.toml").write_text(text, encoding="utf-8")
        told = load_scenario(Path(folder) / "scenario.toml")
        from_file = simulate(told, plan(told))
    cases = {
        "run twice": again,
        "saved and reloaded": reloaded,
        "run again from the file's own words": from_file,
    }
    counts = {case: _different(first, other) for case, other in cases.items()}
    counts["continued from its saved middle"] = _continued(scenario)
    why = "The same steps with the same numbers: not one bit may differ."
    return [
        Reading(float(count), 0.0, why, unit="numbers", case=case) for case, count in counts.items()
    ]


def _continued(scenario: Scenario) -> int:
    """How many numbers of the last state differ where a run is continued from its middle."""
    import mujoco

    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    whole, half, rest = (Run(each, plan(each)) for each in (scenario, _half(scenario), scenario))
    whole.advance()
    half.advance()
    state = np.empty(mujoco.mj_stateSize(half.model, kind))
    mujoco.mj_getState(half.model, half.data, state, kind)
    with tempfile.TemporaryDirectory() as folder:
        np.save(Path(folder) / "state.npy", state)
        state = np.load(Path(folder) / "state.npy", allow_pickle=False)
    mujoco.mj_setState(rest.model, rest.data, state, kind)
    for target in rest.targets(half.steps, rest.steps):
        rest.drive.command(target)
        mujoco.mj_step(rest.model, rest.data)
    pairs = ((whole.data.qpos, rest.data.qpos), (whole.data.qvel, rest.data.qvel))
    return sum(int(np.not_equal(a.view(np.uint64), b.view(np.uint64)).sum()) for a, b in pairs)


def _half(scenario: Scenario) -> Scenario:
    return scenario.replace(duration=scenario.duration / 2)


def _different(a: Recording, b: Recording) -> int:
    """How many of a recording's numbers differ from another's in any bit; all, if shapes do."""
    if set(a.data_vars) != set(b.data_vars) or a.sizes != b.sizes:
        return int(sum(channel.size for channel in a.data_vars.values()))
    count = 0
    for name in ("time", *a.data_vars):
        ours, theirs = a[name].values, b[name].values
        bits = (x.view(np.uint64) if x.dtype == np.float64 else x for x in (ours, theirs))
        count += int(np.not_equal(*bits).sum())
    return count


def _with_order(scenario: Scenario, order: tuple[int, ...]) -> Scenario:
    """The scenario with each leg stepping as the leg that the order names for it."""
    gait = scenario.load_gait()
    offsets = tuple(gait.offsets[i] for i in order)
    return scenario.replace(
        gait={"name": "ordered", "duty_factor": gait.duty_factor, "offsets": offsets}
    )


def _opposite_legs(robot: Robot) -> tuple[int, ...]:
    """For each leg the one that is mounted on the other side of the body, counted from 0."""
    hips = robot.arrays.p_body_hip
    across = hips * [1.0, -1.0, 1.0]
    apart = np.linalg.norm(hips[None] - across[:, None], axis=-1)
    return tuple(int(i) for i in apart.argmin(axis=1))


def _walked(scenario: Scenario, *, turn: float = 0.0) -> Float[np.ndarray, "samples 3"]:
    """The trunk's places, for a walk that begins in some direction [m]."""
    run = Run(scenario, plan(scenario))
    if turn:
        _turn(run.data, turn)
    trouble = run.advance()
    if trouble:
        raise CannotMeasure(trouble.reason)
    return run.log.qpos[: run.done, :3]


def _turn(data: mujoco.MjData, angle: float) -> None:
    """Turn a robot that is about to walk about the world's vertical."""
    c, s = math.cos(angle), math.sin(angle)
    for row in (data.qpos, data.qvel):
        row[:2] = [c * row[0] - s * row[1], s * row[0] + c * row[1]]
    w, z = math.cos(angle / 2), math.sin(angle / 2)
    a, b, e, d = data.qpos[3:7].copy()
    data.qpos[3:7] = [w * a - z * d, w * b - z * e, w * e + z * b, w * d + z * a]
