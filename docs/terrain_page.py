"""Writes the ten terrains of docs/terrain.md, walked by the paper's robot, and their pictures.

    python docs/terrain_page.py

Takes about a minute. What stands before the first terrain is left as it is.
"""

import math
import tempfile
import tomllib
from pathlib import Path

import numpy as np

import phasmid
from phasmid.kinematics import quaternion_rotation
from phasmid.reporting.drawing import draw_robot, swing_moment
from phasmid.reporting.run import read_run
from phasmid.reporting.style import save_figure

HERE = Path(__file__).parent
WALK = {"step_length_mm": 80, "period": 2, "duration": 10}
PIXELS_PER_INCH = 80

TERRAINS = {
    "flat": ("Level ground.", 'kind = "flat"'),
    "slope": (
        "A plane through the origin, or from `terrain_start_mm` on. `terrain_yaw_deg` turns it, as "
        "it does every terrain: 90 is a slope across the way, 180 one downhill.",
        'kind = "slope"\nslope_deg = 15',
    ),
    "stairs": (
        "Equal steps; `rise_mm` below 0 leads down.",
        'kind = "stairs"\nrise_mm = 20\nrun_mm = 120\nstair_count = 5',
    ),
    "step": ("One step.", 'kind = "step"\nrise_mm = 40'),
    "gap": (
        "A ditch across the way. For other profiles `steps` has its edges at places of your own, "
        "with the height behind each: `edge_x_mm` and `edge_z_mm`.",
        'kind = "gap"\ngap_width_mm = 60\ngap_depth_mm = 100',
    ),
    "blocks": (
        "A field of blocks of seeded heights, 2.4 m by 1.6 m. They touch, or stand `block_gap_mm` "
        "apart.",
        'kind = "blocks"\nblock_size_mm = 80\nblock_height_mm = 20\nterrain_seed = 1',
    ),
    "waves": (
        "A sinusoid across the way, which begins in a trough.",
        'kind = "waves"\nwave_height_mm = 30\nwave_length_mm = 400',
    ),
    "rough": (
        "Twenty-four plane waves of seeded direction, phase and length, added up to the standard "
        "deviation that is asked; they grow out of level ground within 100 mm. The same seed is "
        "the same ground, everywhere and on every machine.",
        'kind = "rough"\nroughness_mm = 6\nrough_length_mm = 150\nterrain_seed = 1',
    ),
    "height-map": (
        "Heights from a file beside the scenario: a grey image of 8 or 16 bits, of which white is "
        "`map_height_mm` high; or metres in a `.npy` or `.csv`. It is seen from above with the "
        "walk from left to right, its left edge at the start, its middle row on the way. A cubic "
        "runs through the samples. At most 4096 × 4096 samples. Maps that pack into 750 kB of "
        "text, about 400 × 400 samples of a measured ground, travel inside the scenario: the "
        "result folder and the recording need no file. Larger ones are named by their path.",
        'kind = "height-map"\nheight_map = "hills.png"\nmap_cell_mm = 20\nmap_height_mm = 60',
    ),
    "ice": (
        "Level ground with slippery tiles, as on a chessboard. On any terrain `patches` names "
        "rectangles of other friction: each from x, to x, from y, to y in metres, and its "
        "friction; where two overlap the last counts.",
        'kind = "ice"\nfriction = 0.7\nice_friction = 0.1\ntile_mm = 100',
    ),
}


def hills(path):
    """A picture of some hills."""
    from PIL import Image

    x, y = np.meshgrid(np.linspace(0, 5.5, 120), np.linspace(0, 3.5, 60))
    height = (1 - np.cos(3 * x)) / 2 * (0.6 + 0.4 * np.sin(3 * y))
    Image.fromarray(np.uint8(255 * height)).save(path)


def outcome(walk, run):
    """How the walk went, in one sentence, and what its summary warns of."""
    target = walk.sample(run["time"].values[-1:])
    made, planned = (
        float(np.hypot(*(p[-1, :2] - start[:2])))
        for p, start in (
            (run["body_position"].values, run["body_position"].values[0]),
            (target.trunk.position, walk.trunk.position[0]),
        )
    )
    up = quaternion_rotation(run["body_orientation"].values)[:, 2, 2]
    tilt = math.degrees(float(np.arccos(up.min())))
    climbed = 1000 * float(np.ptp(run["body_position"].values[:, 2]))
    ending = run.attrs["ending_reason"]
    doubts = "".join(f"\n\n> {sentence}" for sentence in phasmid.summarise(run)["warnings"])
    return (
        f"{ending} Way {1000 * made:.0f} mm of {1000 * planned:.0f} planned; the trunk's height "
        f"ranges over {climbed:.0f} mm, its largest tilt is {tilt:.1f}°.{doubts}"
    )


def section(name, words, table, folder):
    """One terrain: words, the table, how its walk went, and its picture."""
    terrain = tomllib.loads(table)
    if "height_map" in terrain:
        terrain["height_map"] = str(folder / terrain["height_map"])
    terrain = {"terrain" if key == "kind" else key: value for key, value in terrain.items()}
    scenario = phasmid.load_scenario("paper").replace(**WALK, **terrain)
    walk = phasmid.plan(scenario)
    run = phasmid.simulate(scenario, walk)
    moment = swing_moment(read_run(run))
    picture = HERE / "images" / f"terrain-{name}.png"
    save_figure(draw_robot(run, moment), picture, dpi=PIXELS_PER_INCH)
    return (
        f"## {name}\n\n{words}\n\n```toml\n[terrain]\n{table}\n```\n\n"
        f"{outcome(walk, run)}\n\n"
        f"![The robot on this terrain](images/{picture.name})\n"
    )


def main():
    """Write the page."""
    with tempfile.TemporaryDirectory() as folder:
        hills(Path(folder) / "hills.png")
        sections = [section(name, *told, Path(folder)) for name, told in TERRAINS.items()]
    page = HERE / "terrain.md"
    top = page.read_text("utf-8").partition("\n## ")[0]
    page.write_text("\n".join([top, *sections]), "utf-8", newline="\n")


if __name__ == "__main__":
    main()
