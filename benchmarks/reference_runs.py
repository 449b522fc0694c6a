"""Compare runs with the figures of the same runs in benchmarks/reference_runs.json.

    python benchmarks/reference_runs.py [NAME ...]      compare; exit status 1 where runs differ
    python benchmarks/reference_runs.py --write         write the figures anew

A change that only restructures code must leave all runs equal to round-off. For each channel of a
run the file holds the mean, the root mean square, the largest magnitude and the last sample's mean.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

import phasmid
from phasmid.control import Command, EngineSettings, LocomotionEngine, Posture, script_from_text
from phasmid.scenario import Scenario

FIGURES = Path(__file__).with_suffix(".json")

TOLERANCE = 1e-9
"""Largest difference from the reference, relative to the channel's largest magnitude."""

AHEAD = Command(velocity=(0.06, 0.02, 0.1))

UNEVEN: dict[str, dict[str, Any]] = {
    "blocks": {"kind": "blocks", "block_height_mm": 40, "block_size_mm": 100},
    "waves": {"kind": "waves"},
    "rough": {"kind": "rough", "roughness_mm": 10, "rough_length_mm": 300},
    "slope": {"kind": "slope", "slope_deg": 10},
    "stairs": {"kind": "stairs", "rise_mm": 20, "run_mm": 150},
    "gap": {"kind": "gap", "gap_width_mm": 30, "gap_depth_mm": 100},
}

SCRIPT = """
[[command]]
time = 0.0
ahead_mm_per_s = 50

[[command]]
time = 1.0
ahead_mm_per_s = 0
left_mm_per_s = 40
shift_mm = [0, 0, 10]
tilt_deg = [0, 3, 0]

[[command]]
time = 2.0
ahead_mm_per_s = 30
left_mm_per_s = 0
turn_deg_per_s = 10
gait = "wave"
period = 1.5

[[command]]
time = 3.5
ahead_mm_per_s = 0
turn_deg_per_s = 0
"""

PLACES = """
[[waypoint]]
x_mm = 120
y_mm = 0

[[waypoint]]
x_mm = 200
y_mm = 80
heading_deg = 30
"""


def planned(simulates: bool = True, **changes: Any) -> Any:
    """Plan, analyse and simulate a walk."""
    scenario = Scenario().replace(**{"duration": 2.0, "record_interval_ms": 10, **changes})
    walk = phasmid.plan(scenario)
    found = phasmid.analyse(scenario, walk)
    return [found, phasmid.simulate(scenario, walk)] if simulates else [found]


def driven(
    commands: Any = AHEAD,
    engine: dict[str, Any] | None = None,
    faults: tuple[str, ...] = (),
    **changes: Any,
) -> Any:
    """Drive a robot with the scenario's controller, or with a bare engine."""
    changes = {"robot": "phantomx-ax", "drive": "servo", "duration": 4.0, **changes}
    scenario = Scenario().replace(**{"record_interval_ms": 10, **changes})
    controller = None
    if engine is not None:
        controller = LocomotionEngine(scenario.load_robot(), EngineSettings(**engine))
    return [phasmid.drive(scenario, controller, commands, faults=faults)]


def uneven(kind: str, **options: Any) -> Any:
    """Drive over ground that the controller does not know."""
    terrain = {"planned_on": "level", **UNEVEN[kind]}
    return driven(Command(velocity=(0.06, 0.0, 0.0)), terrain=terrain, duration=5.0, **options)


def by_function(time: float, observation: Any) -> Command:
    """A command that changes at every update."""
    del observation
    return Command(velocity=(0.05 * np.sin(time), 0.03 * np.cos(time), 0.1))


def changing(time: float, observation: Any) -> Command:
    """Stand up, walk, pose, walk by another gait, lose a leg, sit down."""
    del observation
    if time < 4.0:
        return Command()
    if time < 6.0:
        return Command(velocity=(0.05, 0.0, 0.1))
    if time < 7.5:
        return Command(pose=(0.01, 0.0, -0.01, 0.05, 0.0, 0.1))
    if time < 9.5:
        return Command(velocity=(0.0, 0.03, 0.0), gait="ripple", period=1.2)
    if time < 13.0:
        return Command(velocity=(0.03, 0.0, 0.0), lost_legs=frozenset({2}))
    return Command(posture=Posture.PACKED)


def studio() -> Any:
    """Change the live robot's setting while it walks."""
    from phasmid.studio.live import LiveRobot
    from phasmid.studio.setting import setting_of

    live = LiveRobot(setting_of(Scenario().replace(robot="phantomx-ax", drive="servo")))
    parts: dict[str, list[np.ndarray]] = {}

    def keep(time: np.ndarray, channels: dict[str, np.ndarray]) -> None:
        for name, values in {"time": time, **channels}.items():
            parts.setdefault(name, []).append(np.array(values))

    live.recorder = keep
    none = frozenset[int]()
    for share, lost in (
        ((0.5, 0.0, 0.0), none),
        ((0.0, 0.5, 0.5), none),
        ((0.3, 0.0, 0.0), frozenset({1})),
        ((0.0, 0.0, 0.0), frozenset({1})),
    ):
        live.follow(live.setting, share, lost)
        live.advance(200)
    return [{name: np.concatenate(rows) for name, rows in parts.items()}]


RUNS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    **{
        f"plan {gait}": (planned, {"gait": gait, "simulates": False})
        for gait in ("wave", "ripple", "amble", "tetrapod", "metachronal", "firmware-tripod")
    },
    **{
        f"walk {robot}": (planned, {"robot": robot, "gait": gait})
        for robot, gait in (
            ("phantomx-paper", "tripod"),
            ("phantomx-ax", "ripple"),
            ("phantomx-mk4", "wave"),
            ("octopod", "tetrapod"),
            ("quadruped", "crawl"),
        )
    },
    **{
        f"walk with {joints}": (planned, {"robot": "phantomx-ax", "drive": joints})
        for joints in ("ideal-servo", "servo", "torque")
    },
    "walk on planned waves": (
        planned,
        {"terrain": {"kind": "waves", "planned_on": "terrain"}, "drive": "ideal-servo"},
    ),
    **{
        f"drive {robot} {joints}": (driven, {"robot": robot, "drive": joints, "gait": gait})
        for robot, joints, gait in (
            ("phantomx-paper", "prescribed", "tripod"),
            ("phantomx-ax", "prescribed", "tripod"),
            ("phantomx-ax", "ideal-servo", "tripod"),
            ("phantomx-ax", "servo", "tripod"),
            ("phantomx-ax", "torque", "tripod"),
            ("phantomx-mk4", "servo", "tripod"),
            ("octopod", "ideal-servo", "tetrapod"),
            ("quadruped", "ideal-servo", "crawl"),
        )
    },
    **{
        f"drive {gait}": (driven, {"gait": gait, "drive": "ideal-servo"})
        for gait in ("wave", "ripple", "amble", "metachronal", "firmware-wave")
    },
    **{f"drive on {kind}": (uneven, {"kind": kind}) for kind in UNEVEN},
    "drive on blocks by engine alone": (uneven, {"kind": "blocks", "engine": {"dynamics": "none"}}),
    "drive on waves without ground estimation": (
        uneven,
        {"kind": "waves", "engine": {"ground_sensing": False}},
    ),
    "drive with sensors": (driven, {"measured": "everything", "sensor_seed": 5}),
    "drive with sensors on blocks": (uneven, {"kind": "blocks", "measured": "everything"}),
    "drive with a dead servo": (driven, {"faults": ("right_middle.tibia dead at 2 s",)}),
    "drive with a lost leg": (
        driven,
        {"commands": Command(velocity=(0.03, 0.0, 0.0), lost_legs=frozenset({3}))},
    ),
    "drive by script": (driven, {"commands": script_from_text(SCRIPT), "duration": 5.0}),
    "drive to waypoints": (driven, {"commands": script_from_text(PLACES), "duration": 6.0}),
    "drive by function": (driven, {"commands": by_function}),
    "drive sequences": (
        driven,
        {
            "commands": changing,
            "start_posture": "packed",
            "duration": 18.0,
            "drive": "ideal-servo",
            "record_interval_ms": 50,
        },
    ),
    "studio": (studio, {}),
}


def figures(recording: Any) -> dict[str, list[float]]:
    """Mean, root mean square, largest magnitude and last sample's mean of each channel."""
    found = {}
    for name in sorted(recording):
        values = np.asarray(recording[name])
        if values.dtype.kind not in "bifu" or not values.size:
            continue
        values = values.astype(float)
        known = np.where(np.isfinite(values), values, 0.0)
        found[name] = [
            float(known.mean()),
            float(np.sqrt(np.mean(known**2))),
            float(np.abs(known).max()),
            float(np.mean(known[-1])),
        ]
    return found


def run(name: str) -> list[Any]:
    """Make one run: the figures of each of its recordings, and what the controller reported."""
    make, options = RUNS[name]
    recordings = make(**options)
    return [
        [figures(recording), str(getattr(recording, "attrs", {}).get("events", ""))]
        for recording in recordings
    ]


def differences(found: list[Any], reference: list[Any]) -> list[str]:
    """Return what differs by more than `TOLERANCE`, the largest difference first."""
    lines: list[tuple[float, str]] = []
    for (ours, said), (theirs, then) in zip(found, reference, strict=True):
        lines += [
            (np.inf, f"{name}: {'new' if name in ours else 'missing'}")
            for name in sorted(set(ours) ^ set(theirs))
        ]
        for name in sorted(set(ours) & set(theirs)):
            a, b = np.array(ours[name]), np.array(theirs[name])
            away = np.abs(a - b).max() / max(b[2], 1e-12)
            if away > TOLERANCE:
                lines.append((away, f"{name}: {away:.1e} of its largest value {b[2]:.3g}"))
        if said != then:
            lines.append((np.inf, f"events: {said} instead of {then}"))
    return [line for _, line in sorted(lines, key=lambda line: -line[0])]


def main() -> int:
    """Compare runs, or write their figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="runs, by the beginning of their names")
    parser.add_argument("--write", action="store_true", help="write the figures anew")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    names = [name for name in RUNS if name.startswith(tuple(options.names) or "")]
    known = json.loads(FIGURES.read_text("utf-8")) if FIGURES.exists() else {}
    failed = 0
    with ProcessPoolExecutor(options.processes, mp_context=get_context("spawn")) as pool:
        for name, future in [(name, pool.submit(run, name)) for name in names]:
            try:
                found = future.result()
            except Exception as error:
                failed += 1
                print(f"failed  {name}: {error}", flush=True)
                continue
            if options.write:
                known[name] = found
                lines = ",\n".join(
                    f"{json.dumps(key)}:{json.dumps(known[key], separators=(',', ':'))}"
                    for key in RUNS
                    if key in known
                )
                FIGURES.write_text(f"{{\n{lines}\n}}\n", "utf-8")
                print(f"wrote  {name}", flush=True)
                continue
            # What the file holds has been through JSON, too.
            lines = differences(json.loads(json.dumps(found)), known[name])
            failed += bool(lines)
            print(f"{'differs' if lines else 'equal  '}  {name}", flush=True)
            for line in lines[:5]:
                print(f"         {line}", flush=True)
    if not options.write:
        print(f"{len(names) - failed} of {len(names)} runs equal the reference")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
