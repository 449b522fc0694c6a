"""Symmetry, independence of names and axes, and the same bits again."""

import math
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from phasmid.motion import plan
from phasmid.recording import load_recording, save_recording
from phasmid.scenario import replay
from phasmid.scenario.rerun import first_difference
from phasmid.simulation import Run, simulate
from physics.rows import row

TURN = 0.7  # by how much the world is turned [rad]
ORDER = (2, 0, 1, 5, 3, 4)  # another order in which the legs are declared
CYCLES = 2  # cycles that are compared


def symmetry(bench):
    """Compare a walk with its mirror image, another order of legs, and another heading."""
    # Table 2's links are turned, not mirrored, from right to left; at mid-length they are both.
    base = bench.scenario.replace(
        mass_model="mid-length",
        duration=CYCLES * bench.scenario.build().course.stride.period,
        step_turn=0.1,
    )
    plain = _positions(bench, base)
    robot = base.base_robot()
    mirrored = _positions(bench, _with_order(base, _opposite_legs(robot)).replace(step_turn=-0.1))
    shuffled = replace(robot, legs=tuple(robot.legs[i] for i in ORDER))
    reordered = _positions(bench, _with_order(base, ORDER).replace(robot=shuffled))
    turned = _positions(bench, base, turn=TURN)
    c, s = math.cos(TURN), math.sin(TURN)
    cases = {
        "mirror image": mirrored * [1.0, -1.0, 1.0],
        "legs declared in another order": reordered,
        "world turned by 0.7 rad": turned @ [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]],
    }
    for case, trunk in cases.items():
        why = (
            "The same numbers in another order: what rounding (1e-16 m) and the solver's tolerance "
            "leave, over 4000 steps."
        )
        yield row(case, trunk - plain, 1e-9, why, unit="m")


def repetition(bench):
    """Half a second of walk: run twice, reloaded, run again from its file, and gone on with."""
    scenario = bench.scenario.replace(duration=0.5)
    walk = plan(scenario)
    first, again = (bench.record(scenario) for _ in range(2))
    run = Run(scenario, walk)
    run.advance(until=run.steps // 2)
    with tempfile.TemporaryDirectory() as folder:
        path, state = Path(folder) / "recording.nc", Path(folder) / "state.npy"
        save_recording(first, path)
        reloaded, repeated = load_recording(path), replay(path)
        np.save(state, run.state())
        rest = simulate(scenario, walk, start=np.load(state, allow_pickle=False))
    late = first.isel(time=slice(first.sizes["time"] - rest.sizes["time"], None))
    same = {
        "run twice": first_difference(first, again) is None,
        "saved and reloaded": first_difference(first, reloaded) is None,
        "run again from the file's own words": repeated.equal,
        "gone on with from its saved middle": first_difference(late, rest) is None,
    }
    for case, equal in same.items():
        why = "The same steps with the same numbers: not one bit may differ."
        yield row(case, not equal, 0.0, why, unit="run")


def _with_order(scenario, order):
    """Return the scenario with its gait offsets in another order of legs."""
    gait = scenario.load_gait()
    offsets = tuple(gait.offsets[i] for i in order)
    return scenario.replace(
        gait={"name": "ordered", "duty_factor": gait.duty_factor, "offsets": offsets}
    )


def _opposite_legs(robot):
    """For each leg the one that is mounted on the other side of the body, counted from 0."""
    hips = robot.arrays.p_body_hip
    across = hips * [1.0, -1.0, 1.0]
    apart = np.linalg.norm(hips[None] - across[:, None], axis=-1)
    return tuple(int(i) for i in apart.argmin(axis=1))


def _positions(bench, scenario, *, turn=0.0):
    """Return the trunk's positions of a walk with an initial heading [m]."""
    run = bench.run(scenario)
    if turn:
        _turn(run.data, turn)
    assert run.advance() is None
    return run.log["qpos"][: run.done, :3]


def _turn(data, angle):
    """Turn a robot that is about to walk about the world's vertical."""
    c, s = math.cos(angle), math.sin(angle)
    for vector in (data.qpos, data.qvel):
        vector[:2] = [c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]]
    w, z = math.cos(angle / 2), math.sin(angle / 2)
    a, b, e, d = data.qpos[3:7].copy()
    data.qpos[3:7] = [w * a - z * d, w * b - z * e, w * e + z * b, w * d + z * a]
