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

```
phasmid plot --list                                    # all figures, a sentence each
phasmid plot results/paper gait-diagram support-margin # into plots/paper, as SVG
phasmid plot results/paper all --format svg,png,pdf --out figs
phasmid plot results/paper joint-torque --legs 1,2,3
phasmid plot results/a results/b joint-torque          # two runs in one figure
phasmid plot results/paper fig13 --width-mm 85 --dpi 300 --no-title --format pdf,png
```

`--width-mm` sets the width of the figures; labels keep at least 7 pt. `--dpi` is the resolution of
PNG files and of pictures in PDF and SVG files. From Python, `phasmid.plot(recording,
"support-margin")` returns the matplotlib figure, and `phasmid.plot([a, b], "joint-torque",
labels=["a", "b"])` compares runs. Of a walk of more than six cycles, figures over time show the
last five.

The figures below show the paper's walk; `power` and those of servos show it with `--drive servo
--measured everything`. `make gallery` draws this page.
"""

WORDS = {
    "fig12": "The coxa, which turns by some degrees, has its own axis.",
    "gait-diagram": "The subtitle states the share of the time in which both are equal.",
    "support-margin": (
        "Negative outside the polygon. Solid: feet in contact; dashed: planned stance. Shaded: "
        "fewer than three feet, or all in a line."
    ),
    "servo-envelope": (
        "Red: the servo's torque at steady speed under its supply, τ = k(±V − kω)/R less the "
        "friction of motor and gears, at most the stall torque. Dashed: a fifth of the stall "
        "torque, which makers advise not to exceed for long. While a rotor accelerates, a sample "
        "may lie beyond the line."
    ),
    "friction-demand": (
        "Above the dashed line a foot slides. Drawn in planned stance, at normal forces of at "
        "least 2 % of the weight."
    ),
    "power": (
        "Net, positive and absolute power at the joints' axes; with servos also that of their "
        "friction, and with their own law that of the supply. The cost of transport is the energy "
        "over weight and distance; that in `summary.json` is mechanical."
    ),
    "residuals": "Shaded: the time around lift-offs and touchdowns, where impacts hide the rest.",
    "servo-duty": "A share of the supply voltage.",
    "sensors": "With `--measured everything`.",
    "walk": "By the physics engine's renderer; without OpenGL a stick figure.",
}

COMPARED = ("joint-torque", "support-margin")


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
    rows = ["| figure | |", "|---|---|"]
    for name, kind in CATALOGUE.items():
        run = paper if not name.startswith("servo-") and name != "power" else servo
        small(phasmid.plot(run, name), pictures / f"{name}.png")
        words = " ".join(filter(None, (kind.sentence, WORDS.get(name))))
        rows.append(f"| **{name}**<br>{words} | ![{kind.sentence}](gallery/{name}.png) |")
    for name in COMPARED:
        figure = phasmid.plot([paper, servo], name, legs=(1, 2, 3), labels=["paper", "servo"])
        small(figure, pictures / f"{name}-compared.png")
        words = f"**{name}** of two runs<br>`phasmid plot results/paper results/servo {name}`"
        rows.append(f"| {words} | ![{name} of two runs](gallery/{name}-compared.png) |")
    (HERE / "gallery.md").write_text("\n".join([TOP, *rows, ""]), "utf-8", newline="\n")


if __name__ == "__main__":
    main()
