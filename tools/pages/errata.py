"""The misprints of the paper and its equation of motion, derived in symbols: docs/errata.md."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from pages.derivation import mid_length, newton_euler, paper_text
from phasmid.dynamics import leg_matrices
from phasmid.motion import plan
from phasmid.paper.misprints import MISPRINTS, SLIPS, Extent, Misprint, torque_error, two_digits
from phasmid.paper.states import (
    FARTHEST_ROLL,
    FASTEST,
    LARGEST_FORCE,
    RANDOM_STATES,
    STRONGEST,
)
from phasmid.robot import load_robot
from phasmid.scenario import load_scenario
from phasmid.units import STANDARD_GRAVITY

PAGE = Path(__file__).parents[2] / "docs" / "errata.md"

_TEXT = """\
# The paper's misprints

```
make pages PAGE=errata    # derive Eq 10 in symbols, by Newton-Euler, and write this page
```

Equations of IMECE2018-88226 as printed, and as phasmid computes them. `kinematics.printed` and
`dynamics.printed` compute every equation as printed, with any of its misprints;
`phasmid.paper.misprints` is the table.

Each row gives the largest error of one misprint alone: in swing and in stance on the paper's walk,
and on random states. The robot is `phantomx-paper` with its masses as Eq 10 assumes (`mass_model =
"mid-length"`); feet bear the forces of minimum norm. Random are {states} states of each leg: any
coxa angle, femur and tibia within their limits, feet outside the coxa axis, speeds to {speed}
rad/s, accelerations to {acceleration} rad/s², foot forces to {force} N along each axis, rolls and
pitches to {roll}°, any yaw.

## Frames and kinematics

Largest error of a foot's position [mm]. The printed equations mix lengths with angles or with
squares of lengths, so the error depends on the unit: here that of Table 1, millimetres and
degrees. "None in 10 %" means that the printed equation gives no angle for that fraction of the
states.

{kinematics}

## Dynamics of a leg

Largest error of a joint's torque [mN·m]. θ3 of the printed sines and cosines is minus that of
Table 1, while speeds and accelerations keep Table 1's sign. With this reading m23, m33, b23, c32
and G are right as printed. Where a plus is missing, the factors that then stand side by side are
multiplied.

{dynamics}

### Equation 10, corrected

In the paper's form, with θ3 as above. Entries that are not listed are zero; torque = M θ̈ + B
[θ̇1θ̇2, θ̇1θ̇3, θ̇2θ̇3] + C [θ̇1², θ̇2², θ̇3²] + G − JᵀF.

```
{equation}
```

Slips that change no number:

{slips}

## Tests

Tests in `tests/paper` fail for the printed form and pass for the corrected one. *Equation of
motion*: the power of the joints is the rate of the leg's energy, the torques equal the recursion
over the whole robot, and each entry the symbolic one from Lagrange's equations; *loaded foot*: the
same with a force on the foot. *Rigid body*: no link has radii of gyration below a thousandth of
its length. *Chain*: the product of the frames of Table 1 ends at the foot. *Rotation*: its columns
are orthogonal unit vectors. *Round trip*: the angles place the foot at its commanded position.

## Centres of mass

Table 2 puts the femur's and tibia's centres of mass 20 mm beside the leg's plane. With them, m12
and m13 are not zero: up to {m12} and {m13} kg·m², beside an m11 of up to {m11} kg·m². On the
paper's walk they make up to {coupled} mN·m on the coxa, beside {own} mN·m of m11.
`phasmid.dynamics.leg_matrices` holds for any centre of mass and any inertia, so both readings are
exact.
"""


def errata() -> str:
    """The page of misprints, in Markdown; its numbers have two digits on any machine."""
    kinematic = [row for row in MISPRINTS if row.error is not torque_error]
    dynamic = [row for row in MISPRINTS if row.error is torque_error]
    around = np.radians(np.arange(-180.0, 180.0))
    q = np.stack(np.meshgrid(0.0, around, around), axis=-1)
    M = np.abs(leg_matrices(load_robot("phantomx-paper").legs[0], q, gravity=STANDARD_GRAVITY).M)
    m11, m12, m13 = (f"{value:.1e}".replace("e-0", "e-") for value in M[..., 0, :].max((0, 1, 2)))
    walk = plan(load_scenario("paper")).sample(np.arange(2000) / 1000)
    inertia = (
        leg_matrices(walk.robot.arrays, walk.q, gravity=STANDARD_GRAVITY).M[..., 0, :] * walk.qdd
    )
    own, coupled = np.abs(inertia[..., 0]).max(), np.abs(inertia[..., 1:].sum(axis=-1)).max()
    return _TEXT.format(
        states=RANDOM_STATES,
        speed=f"{FASTEST:g}",
        acceleration=f"{STRONGEST:g}",
        force=f"{LARGEST_FORCE:g}",
        roll=f"{math.degrees(FARTHEST_ROLL):g}",
        kinematics=_table(kinematic),
        dynamics=_table(dynamic),
        equation=paper_text(mid_length(newton_euler())),
        slips=_lines(("where", "printed", "meant"), SLIPS),
        coupled=two_digits(1000 * coupled),
        own=two_digits(1000 * own),
        m11=m11,
        m12=m12,
        m13=m13,
    )


def _table(rows: Iterable[Misprint]) -> str:
    head = ("where", "printed", "right", "swing", "stance", "random", "shown by")
    body = []
    for row in rows:
        costs = map(_words, row.cost())
        body.append((row.where, row.printed, row.right, *costs, str(row.proof)))
    return _lines(head, body)


def _lines(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _words(extent: Extent) -> str:
    if math.isnan(extent.largest):
        return "no angle"
    largest = two_digits(1000 * extent.largest)
    if extent.without_angle == 0:
        return largest
    return f"{largest}, none in {two_digits(100 * extent.without_angle)} %"


def main() -> None:
    """Write the page."""
    PAGE.write_text(errata(), encoding="utf-8")
