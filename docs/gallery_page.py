"""Draws docs/gallery.md and its pictures anew, from the paper's walk.

    python docs/gallery_page.py

Takes about half a minute.
"""

import io
from pathlib import Path

from PIL import Image

import phasmid
from phasmid.reporting import CATALOGUE
from phasmid.reporting.style import encoded_figure

HERE = Path(__file__).parent
PIXELS_PER_INCH = 110
COLOURS = 128
LARGEST_PICTURE = 100_000

TOP = """# Gallery

Every figure that phasmid draws of a run, here of the paper's walk; those of the servos are of
the same walk with `--drive servo`. `make gallery` draws this page anew.

```
phasmid plot --list                                    # all figures, a sentence each
phasmid plot results/paper gait-diagram support-margin # into plots/paper, as SVG
phasmid plot results/paper all --format svg,png,pdf --out figs
phasmid plot results/paper joint-torque --legs 1,2,3
phasmid plot results/a results/b joint-torque          # two runs in one figure
phasmid plot results/paper fig13 --width-mm 85 --dpi 300 --no-title --format pdf,png
```

`--width-mm` sets the width of the figures, such as 85 mm or 175 mm for one or two columns of a
paper. Labels keep at least 7 pt. `--no-title` leaves out title and subtitle, which a caption
replaces. `--dpi` is the resolution of PNG files, and of the pictures in PDF and SVG files.

From Python, `phasmid.plot(recording, "support-margin")` gives the matplotlib figure, and
`phasmid.plot([a, b], "joint-torque", labels=["a", "b"])` compares; `width=0.085` (in metres) and
`title=False` do as the options do. A recording, its file and
its folder are all the same to it.

Of a walk of more than six cycles, figures over time show the last five. Where a required channel is
not recorded, one sentence names it and the command that records it. Colours are Paul
Tol's, which the colour-blind tell apart; runs that are compared differ in their dashes too.
Legs and signs are [the paper's](conventions.md).

The [pictures of terrains](terrain.md) and of the [laws of contact](physics.md) have pages of
their own. `phasmid walk --video walk.mp4` [films a run](recordings.md#as-a-video); `make film` made
this one:

![The walk, filmed: the forces on the feet as arrows, and below them over time.](images/walk.gif)
"""

WORDS = {
    "fig12": (
        "Simulated, and dashed the plan. The coxa, which turns by some degrees, has its own "
        "axis. Of a robot with more than six legs there are as "
        "many figures as groups of at most three legs: `fig12b` follows. The same holds for "
        "the next four."
    ),
    "fig13": "Simulated, and dashed and darker the model's.",
    "joint-angle": "Each leg's own panel. `--legs` chooses some.",
    "gait-diagram": (
        "Broad and pale the planned stance, narrow the recorded contact. The subtitle states the "
        "share of the time, over all legs, in which the two are equal."
    ),
    "support-margin": (
        "The static margin: the distance of the centre of mass, seen from above, from the "
        "nearest edge of the polygon of the stance feet; negative outside of it. Solid of the "
        "feet in contact, dashed of those in planned stance. Where the pose of all links is not "
        "recorded it is the margin of the body's origin, and the subtitle says so. Where fewer "
        "than three feet stand, or all in a line, there is no polygon: that time is shaded."
    ),
    "servo-envelope": (
        "The red line is what the servo can give at a steady speed under its full voltage in "
        "either direction, in all four quadrants: τ = k(±V − kω)/R less the friction of motor"
        " and gears, c₁|τₘ| + c₀ + b|ω|, which is lost where the servo drives its load and "
        "helps it where the load drives the servo. Helped by friction it holds no more than the "
        'stall torque. V is the scenario\'s `voltage` with `drive = "servo"`, and '
        "that of the data sheet else. An ideal servo, or one whose stall current is not "
        "known, has the straight line from stall torque to no-load speed. The dashes are a "
        "fifth of the stall torque, which makers advise not to exceed for long. While a rotor"
        " accelerates, a sample may lie beyond the line."
    ),
    "friction-demand": (
        "The part of the ground's force along the ground over the part along its normal. It "
        "is drawn while the foot is in planned stance and its normal force is at least 2 % of "
        "the robot's weight: the ratio of two forces near zero is meaningless. Above the "
        "dashed line a foot slides."
    ),
    "foot-path": ("Legs of the right side are drawn wider, as those of both sides may overlap."),
    "power": (
        "Of each joint torque times speed, τω; summed as it is, its positive part alone (a "
        "joint that brakes gives nothing back), and its size. With the servos' own law also "
        "what the supply gives: output times voltage times current. Energy is the integral by"
        " the trapezoidal rule; the cost of transport is the energy over weight and way, that"
        " of `summary.json`."
    ),
    "residuals": (
        "Away from the switches of legs model and simulation meet; around them, shaded and "
        "pale, impacts hide what they share. Several runs are compared by the rms over their "
        "feet."
    ),
    "servo-duty": "A share of the supply voltage.",
    "sensors": "With `--measured everything`.",
    "walk": (
        "By the renderer of the physics engine, where there is OpenGL; without it a stick "
        "figure. `phasmid.reporting.draw_robot` draws any moment."
    ),
}

COMPARED = {
    "joint-torque": (
        "A panel for each leg and joint, a line for each run. The first run's lines are wider, so "
        "that runs that are alike both show; runs of one name are numbered."
    ),
    "support-margin": "",
}


def small(figure, path):
    """Write a figure as a picture of few colours."""
    file = io.BytesIO(encoded_figure(figure, "png", dpi=PIXELS_PER_INCH))
    picture = Image.open(file).convert("RGB").quantize(COLOURS, Image.Quantize.MEDIANCUT)
    picture.save(path, optimize=True)
    size = path.stat().st_size
    assert size < LARGEST_PICTURE, f"{path} has {size} bytes"


def walks():
    """The paper's walk, with its own and with the robot's servos."""
    found = []
    for drive in ("prescribed", "servo"):
        scenario = phasmid.load_scenario("paper").replace(drive=drive, measured="everything")
        found.append(phasmid.sense(scenario, phasmid.simulate(scenario, phasmid.plan(scenario))))
    return found


def main():
    """Write the page."""
    pictures = HERE / "gallery"
    pictures.mkdir(exist_ok=True)
    paper, servo = walks()
    sections = []
    for name, kind in CATALOGUE.items():
        run = paper if not name.startswith("servo-") and name != "power" else servo
        small(phasmid.plot(run, name), pictures / f"{name}.png")
        words = [f"## {name}", kind.sentence, f"![{kind.sentence}](gallery/{name}.png)"]
        sections.append("\n\n".join([*words, *([WORDS[name]] if name in WORDS else [])]))
    sections.append("## Runs compared\n\n`phasmid plot results/paper results/servo joint-torque`")
    for name, words in COMPARED.items():
        figure = phasmid.plot([paper, servo], name, legs=(1, 2, 3), labels=["paper", "servo"])
        small(figure, pictures / f"{name}-compared.png")
        picture = f"![{name} of two runs](gallery/{name}-compared.png)"
        sections.append("\n\n".join([*([words] if words else []), picture]))
    text = "\n\n".join([TOP.rstrip(), *sections]) + "\n"
    (HERE / "gallery.md").write_text(text, "utf-8", newline="\n")


if __name__ == "__main__":
    main()
