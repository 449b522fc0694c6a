"""The paper's robot as solids: docs/cad.md and its picture; needs the extra cad.

Takes about a minute.
"""

import io
import math
from pathlib import Path

import numpy as np
from PIL import Image

from phasmid import kinematics
from phasmid.formats.solids import build, mass_properties
from phasmid.reporting.camera import camera_axes, fitted_view
from phasmid.reporting.renderer import SceneRenderer
from phasmid.reporting.robot_mesh import robot_corners
from phasmid.robot import JOINTS, load_robot
from phasmid.scenario import load_scenario

DOCS = Path(__file__).parents[2] / "docs"
SIZE = (1100, 620)
AZIMUTH, ELEVATION = math.radians(-52), math.radians(28)
COLOURS = 128

PAGE = """# Solids

```
phasmid export --robot phantomx-paper --out results/cad
```

![The paper's robot as solids](images/cad-paper.png)

A robot is drawn from the numbers of its file, with any number of legs. It needs the
extra `cad` (`pip install ".[cad]"`); walking does not. `make pages PAGE=cad` writes this page.

| file | content |
|---|---|
| `ROBOT.step` | named, coloured parts: `body`, and in each leg `coxa`, `femur`, `tibia` |
| `ROBOT.step.toml` | which part belongs to which link, joint axes, densities and weights |
| `ROBOT.glb` | all meshes; use them in a robot file with `appearance = "ROBOT.glb"` |

Servos have their real size and weight: an AX-12 is 32 × 50 × 38 mm and 54.6 g. A servo belongs to
the link to which its case is screwed; the coxa servo belongs to the body. A long femur holds two
servos back to back; in a shorter one the knee servo sits in the tibia. Brackets are aluminium, the
body's plates acrylic; battery and controller are blocks of even density. Servos other than AX-12A,
AX-18A, MX-28 and XL430-W250 are an AX-12 scaled to fit the shortest link. Shapes and weights are
approximate.

## Masses

{findings}

## From a STEP file

A STEP assembly `robot.step` becomes a robot with the file `robot.step.toml` beside it. Start from
the one that this command writes, or from this example:

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

Masses, centres of mass and inertias are integrals over the solids. `[frame]` with `origin_mm`,
`forward` and `up` turns a drawing that has another front or top. The file is read in a separate
process with limits of size, memory and time.
"""


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
    (DOCS / "images" / "cad-paper.png").write_bytes(out.getvalue())


def findings(robot, assembly):
    """Compare masses and inertias of the solids with those of the robot file."""
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
        f"On the paper's robot the solids differ from the file by: {'; '.join(lines)}; "
        f"body {body:+.0f} % of mass. Coxa and femur agree with Table 2: two brackets, and two "
        "servos back to back. Table 2's tibia has the inertia of an even rod of "
        f"{1000 * rod:.0f} mm, and is {1000 * leg.tibia.length:.0f} mm long; its centre of mass "
        "lies 20 mm off the leg's plane."
    )


def main():
    """Write the page."""
    robot = load_robot("phantomx-paper")
    assembly = build(robot)
    draw(robot)
    page = PAGE.format(findings=findings(robot, assembly))
    (DOCS / "cad.md").write_text(page, "utf-8", newline="\n")
