"""Measures the locomotion engine and writes docs/control.md with its tables and pictures.

    python docs/control_page.py [--processes N] [--only velocity,terrain] [--seeds N] ...

All studies take two hours or more on two cores, most of it `terrain`; compilation takes two minutes
more. Measurements are kept as JSON. With --only the others are read from there; sections without
measurements stay as they are on the page.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
sys.path += [str(HERE.parent / folder) for folder in ("benchmarks", "tools")]

from control_study import (  # noqa: E402
    bounds,
    causes,
    damage,
    failures,
    forces,
    level,
    sequences,
    study,
    terrain,
    velocity,
)

import ground  # noqa: E402, needs the path above
from phasmid.robot import load_robot  # noqa: E402

STUDIES = (
    "level",
    "velocity",
    "sequences",
    "terrain",
    "levelling",
    "hardest",
    "causes",
    "bounds",
    "failures",
    "damage",
    "forces",
)
HEADING = "## Measured"
PIXELS_PER_INCH = 100
WHOLE = {"walks": 500, "directions": 24, "sequences": 1000, "simulated": 100, "seeds": 20}


def main() -> None:
    """Measure and write the page."""
    options = arguments()
    chosen = options.only.split(",") if options.only else STUDIES
    for option, values, known in (
        ("only", chosen, (*STUDIES, "page")),
        ("kinds", options.kinds.split(","), ground.GROUNDS),
        ("modes", options.modes, ground.MODES),
    ):
        if unknown := set(values) - set(known):
            sys.exit(f"--{option} knows {', '.join(known)}, not {', '.join(unknown)}")
    files = {name: options.results / f"{name}.json" for name in STUDIES}
    for name in STUDIES:
        if name in chosen:
            study.save(files[name], measured(name, options))
    # Through the files, so that the page is the same for new and for old measurements.
    found = {name: path for name, path in files.items() if path.exists()}
    write({name: json.loads(path.read_text("utf-8")) for name, path in found.items()})


def arguments() -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--only", help=f"studies with commas between: {', '.join(STUDIES)}; page")
    parser.add_argument("--results", type=Path, default=Path("results/control"))
    parser.add_argument("--walks", type=int, default=WHOLE["walks"], help="random walks of `level`")
    parser.add_argument("--seed", type=int, default=0, help="of their velocities")
    parser.add_argument(
        "--directions",
        type=int,
        default=WHOLE["directions"],
        help="straight directions of `velocity`",
    )
    parser.add_argument("--gaits", default="", help="of `velocity`, with commas between")
    parser.add_argument("--sequences", type=int, default=WHOLE["sequences"], help="without forces")
    parser.add_argument(
        "--simulated", type=int, default=WHOLE["simulated"], help="sequences with physics"
    )
    parser.add_argument("--duration", type=float, default=30.0, help="of a sequence [s]")
    parser.add_argument("--seeds", type=int, default=WHOLE["seeds"], help="of each ground")
    parser.add_argument("--kinds", default=",".join(ground.GROUNDS), help="of ground")
    parser.add_argument("--modes", nargs="+", default=list(ground.MODES), help="of walking on it")
    parser.add_argument("--legs", type=int, default=6, help="whose servos die")
    return parser.parse_args()


def measured(name: str, options: argparse.Namespace) -> list[study.Case]:
    """Run one study."""
    many, one = options.processes, 1
    if name == "level":
        return study.run(level.measure, level.cases(options.walks, options.seed), many, name)
    if name == "velocity":
        gaits = tuple(filter(None, options.gaits.split(",")))
        cases = velocity.cases(options.directions, gaits)
        return study.run(velocity.measure, cases, many, name)
    if name == "sequences":
        cases = sequences.cases(options.sequences, options.simulated, options.duration)
        return study.run(sequences.measure, cases, many, name)
    if name == "terrain":
        kinds, modes = tuple(options.kinds.split(",")), tuple(options.modes)
        cases = terrain.cases(options.seeds, kinds, modes)
        return study.run(terrain.measure, cases, many, name)
    if name == "levelling":
        return study.run(terrain.levelling, [{"slope_deg": 10.0}], one, name)
    if name == "hardest":
        return study.run(terrain.measure, terrain.hardest_cases(options.seeds), many, name)
    if name == "causes":
        walked = options.results / "terrain.json"
        if not walked.exists():
            sys.exit(f"{walked} does not exist; run the study terrain first.")
        cases = causes.cases(json.loads(walked.read_text("utf-8")))
        return study.run(causes.measure, cases, many, name)
    if name == "bounds":
        return study.run(bounds.measure, bounds.cases(), many, name)
    if name == "failures":
        return study.run(failures.measure, failures.cases(legs=options.legs), many, name)
    if name == "damage":
        return study.run(damage.measure, damage.cases(options.seeds), many, name)
    return study.run(forces.measure, forces.cases(), many, name)


def draw_swing(path: Path) -> None:
    """Draw position, velocity and acceleration of a foot whose command changes in its swing."""
    from matplotlib.figure import Figure

    from kinematic_world import drive
    from phasmid.control import LocomotionEngine
    from phasmid.experiment import Command
    from phasmid.reporting.style import FAINT, JOINT_COLOURS, save_figure, styled
    from phasmid.robot import load_robot

    engine = LocomotionEngine(load_robot("phantomx-ax"), ground_sensing=False, dynamics="none")
    commands = [
        (0.0, Command(velocity=(0.10, 0.0, 0.0))),
        (2.25, Command(velocity=(-0.02, 0.08, 0.0))),
        (3.40, Command(velocity=(0.0, 0.0, 0.4))),
    ]
    seen = drive(engine, commands, 4.6)
    foot, dt = seen.feet[:, 0], seen.dt
    clock = np.arange(len(foot)) * dt
    speed = np.gradient(foot, dt, axis=0)
    kinds = (
        (1000 * (foot - foot[0]), "position [mm]"),
        (speed, "speed [m/s]"),
        (np.gradient(speed, dt, axis=0), "acceleration [m/s²]"),
    )
    with styled():
        figure = Figure(figsize=(9, 4.6), layout="constrained")
        figure.get_layout_engine().set(w_pad=0.1, h_pad=0.1)
        rows = figure.subplots(3, 1, sharex=True)
        for axes, (values, name) in zip(rows, kinds, strict=True):
            for k, axis in enumerate("xyz"):
                axes.plot(clock, values[:, k], label=axis, color=JOINT_COLOURS[k])
            for when, _ in commands[1:]:
                axes.axvline(when, color=FAINT, linestyle="--", linewidth=0.9)
            axes.set_ylabel(name)
        figure.align_ylabels(rows)
        figure.legend(handles=rows[0].get_lines()[:3], loc="outside upper left", ncols=3)
        rows[-1].set_xlabel("time [s]   (dashed: a new command)")
        save_figure(figure, path, dpi=PIXELS_PER_INCH)


def draw_walk(path: Path) -> None:
    """Draw the robot on unknown blocks."""
    from phasmid import drive
    from phasmid.control import LocomotionEngine
    from phasmid.experiment import Command
    from phasmid.reporting.drawing import draw_robot, mid_walk_swing_time
    from phasmid.reporting.run import read_run
    from phasmid.reporting.style import save_figure

    scenario = ground.scenario_of("blocks", 60, 3).replace(duration=9)
    engine = LocomotionEngine(
        scenario.load_robot(), period=ground.PERIOD, step_height=ground.STEP_HEIGHT
    )
    run = drive(scenario, engine, Command(velocity=(ground.SPEED, 0.0, 0.0)))
    save_figure(draw_robot(run, mid_walk_swing_time(read_run(run))), path, dpi=PIXELS_PER_INCH)


def write(results: dict[str, list[study.Case]]) -> None:
    """Write the sections of the studies that were measured, and keep the others of the page."""
    images = HERE / "images"
    if "velocity" in results:
        velocity.draw(results["velocity"], str(images / "control-velocity.png"))
    if "terrain" in results:
        terrain.draw(results["terrain"], str(images / "control-terrain.png"))
    draw_swing(images / "control-swing.png")
    draw_walk(images / "control-walk.png")
    page = HERE / "control.md"
    top, _, below = page.read_text("utf-8").partition(f"\n{HEADING}")
    # Sections without measurements stay as they are on the page.
    old = dict(part.split("\n", 1) for part in below.rstrip("\n").split("\n### ")[1:])
    sections = {name: text.strip("\n") for name, text in old.items()} | measurements(results)
    # A new section follows the last one of those before it in `SECTIONS`.
    order, at = list(old), 0
    for name in (name for name in SECTIONS if name in sections):
        if name not in order:
            order.insert(at, name)
        at = order.index(name) + 1
    written = [f"### {name}\n\n{sections[name]}" for name in order]
    intro = f"{HEADING}\n\nWritten by `make control`. {machine()}{size(results)}"
    text = "\n\n".join([top.rstrip("\n"), intro, *written])
    page.write_text(f"{text}\n", "utf-8", newline="\n")


SECTIONS = {
    "Level ground": ("level",),
    "Velocity": ("velocity",),
    "Random commands": ("sequences",),
    "Unknown ground": ("terrain", "levelling"),
    "The hardest grounds": ("hardest",),
    "Causes of failures": ("causes",),
    "Bounds of reach, balance and torque": ("bounds",),
    "A dead servo": ("failures",),
    "Walks without some legs": ("damage",),
    "With and without dynamics": ("forces",),
}
"""The page's sections with numbers, and the studies that each needs."""


def measurements(results: dict[str, list[study.Case]]) -> dict[str, str]:
    """Return the text of each section whose studies were measured."""
    texts = (
        of_level,
        of_velocity,
        of_sequences,
        of_terrain,
        of_hardest,
        of_causes,
        of_bounds,
        of_failures,
        of_damage,
        of_forces,
    )
    return {
        name: text(*(results[study] for study in needed))
        for (name, needed), text in zip(SECTIONS.items(), texts, strict=True)
        if all(study in results for study in needed)
    }


def size(results: dict[str, list[study.Case]]) -> str:
    """Return a warning where less was run than `make control` runs; empty otherwise."""
    straight = {run["way"] for run in results.get("velocity", ()) if run["way"].endswith("°")}
    counts = {
        "level": ("walks", len(results.get("level", ())), WHOLE["walks"]),
        "velocity": ("directions", len(straight), WHOLE["directions"]),
        "sequences": (
            "sequences",
            len(results.get("sequences", ())),
            WHOLE["sequences"] + WHOLE["simulated"],
        ),
        "terrain": (
            "seeds of some ground",
            min(seeds_of(results.get("terrain", [])), default=0),
            WHOLE["seeds"],
        ),
        "failures": ("cases of dead servos", len(results.get("failures", ())), 36),
    }
    run = {what: (n, whole) for name, (what, n, whole) in counts.items() if name in results}
    small = [f"{n} of {whole} {what}" for what, (n, whole) in run.items() if n < whole]
    if not small:
        return ""
    return (
        f"\n\n**This is a small run**: {', '.join(small)}. It indicates results and does not prove "
        "them."
    )


def seeds_of(results: list[study.Case]) -> list[int]:
    """Return the number of seeds of each ground and mode."""
    return [len(runs) for runs in study.grouped(results, "kind", "size", "mode").values()]


def machine() -> str:
    """Return the versions of physics and Python."""
    import mujoco

    return (
        f"Physics by MuJoCo {mujoco.__version__}, Python {platform.python_version()}; runs of the "
        "same seed are the same."
    )


def of_level(results: list[study.Case]) -> str:
    """Return text of random walks on level ground."""
    whole = [run for run in results if run["ending"] == "COMPLETED"]
    fell = len(results) - len(whole)
    return (
        f"{len(results)} walks of 6 s use the default controller at a constant random velocity of "
        f"up to ±{1000 * level.FASTEST[0]:.0f} mm/s forward, "
        f"±{1000 * level.FASTEST[1]:.0f} mm/s lateral and ±{level.FASTEST[2]:g} rad/s yaw. "
        "They cycle through the presets, gaits and three drives. Every fourth robot is scaled to a "
        f"mass of {level.LIGHT[0]:g} to {level.LIGHT[1]:g} kg. {fell or 'None'} fell. The trunk "
        f"stays within {1000 * max(run['hop'] for run in whole):.2f} mm of its mean height after "
        f"the first {level.SETTLED:g} s, and tilts by at most "
        f"{max(run['tilt'] for run in whole):.2f}°. "
        "The largest simulated joint torque is at most "
        f"{max(run['torque'] / run['planned_torque'] for run in whole):.2f} times the largest that "
        "the walk can need: by inverse dynamics of the planned walk, or by statics on any three of "
        "the stance feet."
    )


def of_velocity(results: list[study.Case]) -> str:
    """Return text, table and picture of walks in all directions."""
    straight = {run["way"] for run in results if run["way"].endswith("°")}
    # Each of the firmware's gaits equals another one.
    shown = [run for run in results if not run["gait"].startswith("firmware")]
    falls = [run for run in results if "error" not in run]
    fell = "".join(
        f"\n- fell: {run['gait']}, {run['joints']}, {run['way']}, {100 * run['share']:.0f} %"
        for run in falls[:20]
    )
    return (
        f"A `{velocity.ROBOT}` on level ground walks straight in {len(straight)} directions, turns "
        "to both sides and follows an arc of 0.4 m radius, at "
        f"{' and '.join(f'{100 * share:.0f} %' for share in velocity.SHARES)} of the "
        "velocity that `largest_velocity` returns for direction and gait: "
        f"{len(results)} walks. Each firmware gait equals another gait and is not listed. The "
        "error is that of the mean velocity in body axes, "
        f"|mean − commanded| / |commanded|, over {velocity.CYCLES} whole cycles after the start, "
        "with the yaw rate weighted by the distance of the feet. Slip is the displacement of a "
        "stance foot from touchdown to lift-off, as in a run's summary.\n\n"
        f"{velocity.verdict(results)}{fell}\n\n{velocity.table(shown)}\n\n"
        "![Left, the largest velocity in each direction; right, the errors of all walks]"
        "(images/control-velocity.png)"
    )


def of_sequences(results: list[study.Case]) -> str:
    """Return text and table of the random commands."""
    return (
        "Random velocities, poses and gaits, starts and stops at random times, of a "
        f"`{sequences.ROBOT}`; in the last {sequences.SETTLING:g} s it is commanded to stop. "
        "In a kinematic simulation, without forces, joints follow their targets exactly, and a "
        "stance foot must not move by a nanometre. In the physics engine the robot must not fall. "
        "In both, joint targets must stay within joint limits and the servo's speed, feet "
        "within reach and the centre of mass over the stance feet, and the robot must come to rest."
        f"\n\n{sequences.table(results)}"
    )


def of_terrain(results: list[study.Case], levelling: list[study.Case]) -> str:
    """Return text, table and pictures of unknown ground."""
    levelled = levelling[0]
    counts = seeds_of(results)
    least, most = min(counts), max(counts)
    seeds = f"{most} seeds each" if least == most else f"{least} to {most} seeds each"
    hills = ""
    if any(run["kind"] == "hills" for run in results):
        hills = (
            " That of *hills*, which have no edges and wavelengths from 300 mm, is the standard "
            "deviation of their height."
        )
    kinds = {run["kind"] for run in results}
    longer = "".join(
        f"; on *{kind}* {new.distance:g} m within {new.limit:g} s, and at most "
        f"{ground.LARGEST_DEVIATION / ground.DISTANCE * new.distance:.1f} m"
        for kind, new in ground.GROUNDS.items()
        if kind in kinds and new.distance != ground.DISTANCE
    )
    words = {
        "stairs up and down": "*Stairs up and down* are two up to a plateau of 300 mm and two "
        "down.",
        "rubble": "*Rubble* are blocks of 50 mm.",
        "beams": "*Beams* are 50 mm wide, 300 mm from centre to centre.",
        "stepping stones": "*Stepping stones* are 100 mm wide above a floor 100 mm lower; their "
        "size is the distance of their centres.",
        "course": "The *course*, from 0 to 1, has stairs, blocks, a gap, stepping stones and "
        "rubble.",
    }
    others = "".join(f" {text}" for kind, text in words.items() if kind in kinds)
    return (
        f"The ground begins {220} to {320} mm ahead, is turned by up to 20° to either side and has "
        f"random heights, all by the seed; {seeds}, from 0. Some constants of the controller were "
        f"chosen on these seeds. A `{ground.ROBOT}` on ideal servos is commanded "
        f"{1000 * ground.SPEED:.0f} mm/s forward: tripod, a cycle of {ground.PERIOD:g} s, steps of "
        f"{1000 * ground.STEP_HEIGHT:.0f} mm, the engine's default. Columns: *ground sensing* by "
        "the feet; *dynamics*, the feed-forward torques; both, the engine's default; both with a "
        "height map from a *lidar* with the errors of its defaults; the same with noise and delays "
        f"of *all sensors*. Rows with steps of {1000 * ground.HIGHER:.0f} mm show a choice for "
        "rough ground without sensing. A run passes if the robot walks "
        f"{1000 * ground.DISTANCE:.0f} mm within {ground.TIME_LIMIT:g} s, without steering, a "
        f"fall or a tilt above 35°, and at most {1000 * ground.LARGEST_DEVIATION:.0f} mm sideways"
        f"{longer}. Times are those at which the result is certain. A run is *late* if the rest of "
        f"the path requires more than {ground.LATE_SPEED_RATIO:g} times the commanded speed. The "
        f"size of *blocks*, 100 mm wide, is the range of their heights.{hills} Stairs are 150 mm "
        f"deep, gaps 100 mm.{others} Cells give "
        "the number of runs that passed, the mean of the largest tilts of all runs, the mean time "
        "of those that passed, and the failures; – was not run. `tools/ground.py` holds grounds, "
        "modes and the rule; `make ground` compares the passes with those of another version.\n\n"
        "A walk like those of one cell; `--terrain-seed`, `--terrain-start-mm` and "
        "`--terrain-yaw-deg` vary it:\n\n"
        f"```\nphasmid drive --robot {ground.ROBOT} --drive ideal-servo --period {ground.PERIOD:g} "
        f"--velocity {ground.SPEED:g},0,0 --duration {ground.TIME_LIMIT:g} "
        "--terrain stairs --rise-mm 40 --run-mm 150\n```"
        f"\n\n{terrain.table(results)}\n\n"
        "![Runs that passed, by the size of the ground](images/control-terrain.png)\n\n"
        "![The robot on unknown blocks](images/control-walk.png)\n\n"
        f"On a slope of {levelled['slope']:g}° the standing body is tilted by "
        f"{levelled['parallel']:.1f}° with `level=0`, parallel to the ground, and by "
        f"{levelled['level']:.1f}° with `level=1`: levelling removes "
        f"{100 * levelled['taken']:.0f} % of the tilt."
    )


def of_hardest(results: list[study.Case]) -> str:
    """Return text and table of the hardest grounds with kept seeds and with AX-12A servos."""
    return (
        f"Seeds {terrain.HELD_OUT_SEEDS[0]} to {terrain.HELD_OUT_SEEDS[-1]}, on which no constant "
        "of the controller was chosen; ideal servos, and AX-12A servos in place of the robot's "
        "own. Columns: the way of walking, then the servo.\n\n"
        f"{terrain.table_of_hardest(results)}"
    )


def of_causes(results: list[study.Case]) -> str:
    """Return text and table of the causes of failed walks."""
    if not results:
        return f"On every ground {100 * causes.ENOUGH:.0f} % of the runs passed or more."
    return (
        f"Failed runs of each ground and mode on which fewer than {100 * causes.ENOUGH:.0f} % "
        "passed, repeated. A fall has the cause *tilt* above that of a run that passes, or else "
        "*body collision*: the trunk's underside meets the ground. Otherwise the cause is the "
        "condition under which the robot lost most of the commanded way. Each instant counts "
        "for the first of these conditions that holds. *Obstacle hits*: a foot draws back, or "
        "the force on it is outside the friction cone of the ground below, as at a riser. *Late "
        "touchdown*: a foot probes downwards or looks for ground. *Torque limit*: a joint has "
        f"{100 * causes.SATURATED:.0f} % of the stall torque, or the engine slows down for "
        "ground or servos. *Slip*: feet in contact move back by more than "
        f"{100 * causes.SLIPPING:.0f} % of the commanded way. *Reach*: feet or support allow "
        f"less than {100 * causes.ALLOWED:.0f} % of the commanded velocity. *Progress*: none of "
        "these.\n\n"
        f"{causes.table(results)}"
    )


def of_bounds(results: list[study.Case]) -> str:
    """Return text and table of the bounds of the grounds."""
    servo = load_robot(ground.ROBOT).servo
    return (
        f"Beyond these sizes, plus 6 % for the grid, a `{ground.ROBOT}` cannot walk straight by "
        "a statically stable tripod gait, whatever its controller. Below them it may fail all "
        "the same: they explain no failure in the tables of this page. The bounds "
        "follow from link lengths, joint limits, masses, the trunk's underside, friction and "
        f"the stall torque of {servo.stall_torque:g} N·m, which ideal servos and the "
        f"{servo.name} share. The body moves forward through heights and pitches at which a "
        "tripod has footholds around the centre of mass and carries the weight, and the trunk "
        "is clear of the ground. Each leg must reach over the edges while the other tripod "
        "stands. A condition binds if the ground just beyond the bound passes without it; where "
        "none does, reach binds.\n\n"
        f"{bounds.table(results)}\n\n"
        "The pitch relative to the slope is at most 35°, as in a run that passes. The robot "
        "walks straight, without roll, legs do not collide, and no foot stands on the floor of "
        "a gap or between stones. *Blocks* are the worst case: feet on the lowest blocks, the "
        "highest ones below the trunk. Stones are level and evenly spaced. With a grid of poses "
        "and footholds twice as fine, bounds are larger by less than 6 %. Hills, rubble, the "
        "course, and stairs up and down have no bound of their own."
    )


def of_failures(results: list[study.Case]) -> str:
    """Return text and table of dead servos."""
    passed = ", ".join(
        f"{sum(run['walks'] for run in runs)} of {len(runs)} on `{joints}`"
        for (joints,), runs in study.grouped(results, "joints").items()
    )
    speeds = [run["speed"] for run in results if run["walks"]]
    return (
        f"A `{failures.ROBOT}` walks forward at half its largest velocity, "
        f"{100 * results[0]['velocity']:.1f} cm/s, when one of its servos dies at "
        f"{failures.DIES:g} s. From then on its joint is limp, the leg folds as far as it still "
        "moves, and the other five walk. A run passes if the robot does not fall, and from "
        f"{failures.JUDGED:g} s to {failures.ENDS:g} s is faster than "
        f"{100 * failures.WALKS:.0f} cm/s: {passed}, at {100 * min(speeds):.1f} to "
        f"{100 * max(speeds):.1f} cm/s."
    )


def of_damage(results: list[study.Case]) -> str:
    """Return text and table of lost legs."""
    return (
        "Walks as over unknown ground, with ground sensing and dynamics, on ideal servos and with "
        "AX-12A servos in place of the robot's own. `lost_legs` of the command names the lost legs "
        "from the start; the robot folds them and walks on the others. Seeds of one lost leg "
        f"spread over the six legs.\n\n{damage.table(results)}\n\n"
        "Without two legs that are not adjacent, on level ground; a run passes after "
        f"{1000 * damage.DISTANCE_OF_PAIR:.0f} mm. The second column bounds the support margin "
        "from above: for each remaining leg the other three feet stand at the best places within "
        "reach of the level body at its neutral height. Below 0 no quasi-static gait walks. "
        "Where it is small, the engine's four neutral feet and its sway are not all within reach: "
        "the robot stands, with an event."
        f"\n\n{damage.table_of_pairs(results)}"
    )


def of_forces(results: list[study.Case]) -> str:
    """Return text and table of walks with and without dynamics."""
    return (
        f"Walks forward at {100 * forces.SHARE:.0f} % of the largest velocity, with a cycle of "
        f"{forces.PERIOD:g} s. The tangential force is the sum over all feet, most of which push "
        "against one another, and its mean over time; the energy is the positive work of the "
        f"joints per metre.\n\n{forces.table(results)}"
    )


if __name__ == "__main__":
    main()
