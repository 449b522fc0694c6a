"""Walks over each kind of terrain: table and pictures of docs/terrain.md.

Takes about a minute. The text above the table stays as it is.
"""

import math
import tempfile
import tomllib
from pathlib import Path

import numpy as np

import phasmid
from phasmid.kinematics import quaternion_rotation
from phasmid.reporting.drawing import draw_robot, mid_walk_swing_time
from phasmid.reporting.run import read_run
from phasmid.reporting.style import save_figure

DOCS = Path(__file__).parents[2] / "docs"
WALK = {"step_length_mm": 80, "period": 2, "duration": 10}
PIXELS_PER_INCH = 80

TERRAINS = {
    "flat": ("Level ground.", ""),
    "slope": ("A plane, from `terrain_start_mm` on if it is set.", "slope_deg = 15"),
    "stairs": (
        "Equal steps; `rise_mm` below 0 leads down.",
        "rise_mm = 20\nrun_mm = 120\nstair_count = 5",
    ),
    "step": (
        "One step; `steps` has several, with `edge_x_mm` and the height behind each, `edge_z_mm`.",
        "rise_mm = 40",
    ),
    "gap": ("A ditch across the path.", "gap_width_mm = 60\ngap_depth_mm = 100"),
    "blocks": (
        "Blocks of seeded heights, 2.4 m by 1.6 m, which touch or stand `block_gap_mm` apart.",
        "block_size_mm = 80\nblock_height_mm = 20\nterrain_seed = 1",
    ),
    "stepping-stones": (
        "Stones of seeded heights on a staggered lattice, each displaced by up to a quarter of the "
        "gap, above a floor.",
        "stone_size_mm = 100\nstone_distance_mm = 140\nblock_height_mm = 20\ngap_depth_mm = 100",
    ),
    "beams": (
        "Beams across the path, the last about 2.4 m behind the start.",
        "beam_width_mm = 50\nbeam_height_mm = 30\nbeam_distance_mm = 300",
    ),
    "course": (
        "3 m: two stairs up, blocks, a gap, stepping stones, two stairs down, rubble; "
        "`course_level` is its difficulty, from 0 to 1.",
        "course_level = 0.5\nterrain_seed = 1",
    ),
    "waves": (
        "A sinusoid across the path, which begins in a trough.",
        "wave_height_mm = 30\nwave_length_mm = 400",
    ),
    "rough": (
        "24 plane waves of seeded direction, phase and length; `roughness_mm` is the standard "
        "deviation of their sum.",
        "roughness_mm = 6\nrough_length_mm = 150\nterrain_seed = 1",
    ),
    "height-map": (
        "Heights from a file, see above.",
        'height_map = "hills.png"\nmap_cell_mm = 20\nmap_height_mm = 60',
    ),
    "ice": (
        "Level ground with slippery tiles, as on a chessboard.",
        "friction = 0.7\nice_friction = 0.1\ntile_mm = 100",
    ),
}


def hills(path):
    """A picture of some hills."""
    from PIL import Image

    x, y = np.meshgrid(np.linspace(0, 5.5, 120), np.linspace(0, 3.5, 60))
    height = (1 - np.cos(3 * x)) / 2 * (0.6 + 0.4 * np.sin(3 * y))
    Image.fromarray(np.uint8(255 * height)).save(path)


def outcome(walk, run):
    """Return the displacement, height and tilt of a walk, and its warnings."""
    target = walk.sample(run["time"].values[-1:])
    simulated, planned = (
        float(np.hypot(*(p[-1, :2] - start[:2])))
        for p, start in (
            (run["body_position"].values, run["body_position"].values[0]),
            (target.trunk.position, walk.trunk.position[0]),
        )
    )
    up = quaternion_rotation(run["body_orientation"].values)[:, 2, 2]
    tilt = math.degrees(float(np.arccos(up.min())))
    climbed = 1000 * float(np.ptp(run["body_position"].values[:, 2]))
    return (
        f"{run.attrs['ending_reason']} Displacement {1000 * simulated:.0f} mm of "
        f"{1000 * planned:.0f} planned, height {climbed:.0f} mm, tilt {tilt:.1f}°.",
        phasmid.summarise(run)["warnings"],
    )


def row(name, words, table, folder):
    """Walk on one terrain, draw it, and return its row of the table."""
    terrain = tomllib.loads(table)
    if "height_map" in terrain:
        terrain["height_map"] = str(folder / terrain["height_map"])
    scenario = phasmid.load_scenario("paper").replace(terrain=name, **WALK, **terrain)
    walk = phasmid.plan(scenario)
    run = phasmid.simulate(scenario, walk)
    moment = mid_walk_swing_time(read_run(run))
    picture = DOCS / "images" / f"terrain-{name}.png"
    save_figure(draw_robot(run, moment), picture, dpi=PIXELS_PER_INCH)
    numbers, warnings = outcome(walk, run)
    keys = ", ".join(f"`{line}`" for line in table.splitlines())
    cell = "<br>".join(filter(None, (f"**{name}**", words, keys, numbers, *warnings)))
    return f"| {cell} | ![The robot on this terrain](images/{picture.name}) |"


def main():
    """Write the page."""
    with tempfile.TemporaryDirectory() as folder:
        hills(Path(folder) / "hills.png")
        rows = [row(name, *words, Path(folder)) for name, words in TERRAINS.items()]
    page = DOCS / "terrain.md"
    top = page.read_text("utf-8").partition("\n| terrain |")[0]
    page.write_text(
        "\n".join([top, "| terrain | |", "|---|---|", *rows, ""]), "utf-8", newline="\n"
    )
