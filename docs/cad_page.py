"""Draws docs/cad.md and its picture anew: solids of the paper's robot, and what they weigh.

    python docs/cad_page.py

Takes about a minute, and needs the extra ``cad``.
"""

import io
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image

from phasmid import kinematics
from phasmid.cad import Assembly, build, mass_properties
from phasmid.reporting.camera import camera_axes, fitted_view
from phasmid.reporting.renderer import SceneRenderer
from phasmid.reporting.robot_mesh import robot_corners
from phasmid.robot import JOINTS, Body, Link, Robot, load_robot
from phasmid.robot.inertial import Inertial
from phasmid.scenario import load_scenario

HERE = Path(__file__).parent
SIZE = (1100, 620)
AZIMUTH, ELEVATION = math.radians(-52), math.radians(28)
COLOURS = 128

PAGE = """# Solids

![The paper's robot as solids](images/cad-paper.png)

`phasmid cad` draws a robot from the numbers of its file, with any number of legs at any place and
tilt. It needs the extra `cad` (`pip install "phasmid[cad]"`); walking does not, and the meshes of
the robots that come with phasmid lie in the package. This page is written by `make cad`.

```
phasmid cad phantomx-paper --out results/cad
```

| file | what it is |
|---|---|
| `ROBOT.step` | named, coloured parts: `body`, and in each leg `coxa`, `femur`, `tibia` |
| `ROBOT.step.toml` | which part belongs to which link, where the axes are, densities and weights |
| `ROBOT.glb` | all meshes; a robot file beside it names it: `appearance = "ROBOT.glb"` |

Servos are solids of their real outside and weight: an AX-12 is 32 × 50 × 38 mm and 54.6 g. A
servo belongs to the link to which its case is screwed: the coxa's to the body. A femur that is
long enough holds two servos back to back; in a shorter one the knee's sits in the tibia.
Brackets, straps and blades are aluminium, the body's plates acrylic; battery and controller are
blocks of an even density. A servo other than AX-12A, AX-18A, MX-28 and XL430-W250 is an AX-12
scaled to fit the shortest link. These shapes look and weigh about right; they are no maker's
drawing.

## What it weighs

The paper's robot: its file (the paper's Table 2, and for the body the rest of 26 N) beside the
solids. Frames are those of Table 1, inertias are about the centre of mass.

{table}
{findings}

## From a STEP file

With a file `robot.step.toml` beside it, `robot.step` is a robot wherever one is asked for:

```toml
name = "mine"
servo = "AX-12A"
density_kg_m3 = 1200                     # of parts without a density of their own

[parts."*servo*"]                        # by path in the assembly, or by the part's own name
mass_g = 54.6                            # each; or density_kg_m3, density_g_cm3

[links.body]
parts = ["chassis/*"]
mass_g = 1357                            # as weighed, in place of what its parts give

[links.right_front_coxa]
parts = ["right_front/coxa/*"]

[joints.right_front_coxa]
parent = "body"
child = "right_front_coxa"
axis_of = "chassis/right_front_servo"    # the axis of its largest round face,
                                         # or point_mm = [x, y, z] and direction = [x, y, z]
limits_deg = [-75, 75]
drawn_at_deg = 0                         # the joint's angle in the drawing

[feet.right_front_foot]
link = "right_front_tibia"
point_mm = [230.9, -167.7, -100]         # in the drawing
```

`[frame]` with `origin_mm`, `forward` and `up` turns a drawing that has another front or top.
Masses, centres of mass and inertias are integrals over the solids. The file is read in a process
of its own with limits of size, memory and time, so that a damaged one costs one sentence.

Robot to STEP to robot moves no axis and no foot by more than a micrometre, and changes no inertia
by more than 1 %.
"""


HEAD = (
    "| link | numbers of | mass [g] | centre of mass x, y, z [mm] "
    "| inertia xx, yy, zz [g·mm²] | xy, xz, yz [g·mm²] |\n"
    "|---|---|---|---|---|---|"
)


def mass_table(robot: Robot, assembly: Assembly) -> str:
    """Each link of the robot's file and of its solids, line by line, as Markdown.

    Frames are the body's and those of Table 1; inertias are about the centre of mass. Legs whose
    file and solids agree to the digits shown stand once.
    """
    found = mass_properties(assembly)
    lines = [HEAD, *_pair("body", robot.body, found["body"])]
    seen = set()
    for leg in robot.legs:
        pairs = [
            "\n".join(_pair(joint, link, found[f"{leg.name}.{joint}"]))
            for joint, link in zip(JOINTS, leg.links, strict=True)
        ]
        if tuple(pairs) not in seen:
            seen.add(tuple(pairs))
            if len(seen) > 1:
                lines.append(f"| **{leg.name}** | | | | | |")
            lines += pairs
    solids = sum(link.mass for link in found.values())
    lines += [
        f"| whole robot | file | {1000 * robot.mass:.1f} | | | |",
        f"| | solids | {1000 * solids:.1f} | | | |",
    ]
    return "\n".join(lines) + "\n"


def _pair(name: str, given: Body | Link, made: Inertial) -> Iterator[str]:
    for title, source, mass in ((name, "file", given), ("", "solids", made)):
        com = ", ".join(_number(1e3 * float(c), 1) for c in mass.com)
        I = 1e9 * np.asarray(mass.inertia)
        across = ", ".join(_number(float(I[i, j]), 0) for i, j in ((0, 1), (0, 2), (1, 2)))
        own = ", ".join(_number(float(I[i, i]), 0) for i in range(3))
        yield f"| {title} | {source} | {1000 * mass.mass:.1f} | {com} | {own} | {across} |"


def _number(value: float, digits: int) -> str:
    # A rounded zero has no sign.
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "−")


def draw(robot):
    """The picture of the page."""
    X_world_body = np.eye(4)
    X_world_body[2, 3] = -float(robot.legs[0].neutral_foot[2])
    q = kinematics.joint_angles(robot.arrays, robot.arrays.neutral_foot)
    corners = robot_corners(robot, q, X_world_body)
    view = fitted_view(corners, camera_axes(AZIMUTH, ELEVATION), SIZE, (0.86, 0.86))
    ground = load_scenario("paper").load_terrain()
    renderer = SceneRenderer(robot, ground, X_world_body[None, :2, 3], view, 0.1)
    out = io.BytesIO()
    image = Image.fromarray(renderer.picture(view, X_world_body, q))
    renderer.close()
    image.quantize(COLOURS).save(out, "png", optimize=True)
    (HERE / "images" / "cad-paper.png").write_bytes(out.getvalue())


def findings(robot, assembly):
    """What the table shows, in numbers."""
    made = mass_properties(assembly)
    leg = robot.legs[0]
    lines = []
    for joint, link in zip(JOINTS, leg.links, strict=True):
        own = made[f"{leg.name}.{joint}"]
        mass = 100 * (own.mass / link.mass - 1)
        turn = 100 * (own.inertia[2, 2] / link.inertia[2, 2] - 1)
        lines.append(f"{joint} {mass:+.0f} % of mass and {turn:+.0f} % of inertia zz")
    rod = math.sqrt(12 * leg.tibia.inertia[2, 2] / leg.tibia.mass)
    body = 100 * (made["body"].mass / robot.body.mass - 1)
    return (
        f"The solids beside the file: {'; '.join(lines)}; body {body:+.0f} % of mass. "
        "Coxa and femur are thus what Table 2 says: two brackets, and two servos back to back. "
        f"Table 2's tibia turns like an even rod of {1000 * rod:.0f} mm, and is "
        f"{1000 * leg.tibia.length:.0f} mm long; its centres of mass 20 mm off the leg's plane "
        "are not those of a leg that is alike on both sides."
    )


def main():
    """Write the page."""
    robot = load_robot("phantomx-paper")
    assembly = build(robot)
    draw(robot)
    page = PAGE.format(
        table=mass_table(robot, assembly),
        findings=findings(robot, assembly),
    )
    (HERE / "cad.md").write_text(page, "utf-8", newline="\n")


if __name__ == "__main__":
    main()
