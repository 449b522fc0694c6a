"""Compares three laws of contact on the paper's walk and writes docs/physics.md and its figure.

python docs/physics_page.py
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from phasmid.reporting.style import FAINT, Figure, save_figure, styled
from phasmid.simulation.closed_loop import STANDING_HARDNESS
from phasmid.simulation.contact import SOFT_TIME
from phasmid.simulation.simscape.run import substeps
from phasmid.simulation.simscape.trunk import KINETIC_FROM

HERE = Path(__file__).parent
sys.path.append(str(HERE.parent / "benchmarks"))

from contact_laws import (  # noqa: E402, needs the path above
    LAWS,
    POINT_FOOT,
    TOUCHDOWN,
    Comparison,
    Squeeze,
    Trial,
    compare,
)

FIGURE = HERE / "physics" / "contact-laws.png"

LINES: dict[str, tuple[str, Any, float]] = {
    "spring-damper": ("#b9bec7", "-", 3.4),
    "mujoco": ("#bb5566", (0, (4, 1.6)), 1.3),
    "simscape": ("#004488", "-", 1.2),
}
"""Colour, dash and width of each law; those that meet stay visible beneath each other."""

LEG = 1
"""The leg that is shown, counted from 0: the right middle one, alone on its side."""

BEFORE = 0.08
"""Time before a touchdown from which on it is shown [s]."""

WIDTH, HEAD, ROW, FOOT = 7.2, 1.12, 1.55, 0.47
"""Of the figure, its title and legend, a row of panels, and the place below [inch]."""

_PAGE = """\
# Contact laws and simulators

```
phasmid walk --contact-law simscape    # or mujoco, or spring-damper, the default
```

The paper's walk under three contact laws. The law of the paper's own contact library, which MuJoCo
cannot express, has a second simulator. Both simulators share the plan and the contact points, but
no code of contact or integration. `make physics` writes this page.

The robot is `{robot}`, the scenario `{scenario}`, with prescribed joints. Mid-stance is the middle
half of each complete stance. The model's forces are of minimum norm.

## The laws

A foot is four points at the corners of a square of {width:g} mm. For a point at depth x that sinks
with speed v and slips with speed u:

{laws}

The ground never pulls. Below the friction limit a foot creeps under all three laws; with
`spring-damper` by its tangential force over 4 × {creep:g} N·s/m (`friction_damping`). More damping
keeps internal forces between the feet, which then appear in the torques; less lets compliant
servos drag their feet. With 100 N·s/m both ways sliding feet chatter; with {damping:g} they do
not. These parameters are chosen from walks and not measured on a foot. In MuJoCo a point also
resists its own acceleration, with a small mass that its impedance d sets (`impedance`).

A robot that a controller drives stands more firmly. On ground that is not level, friction is
{hard:g} times as hard while all its joint targets rest. A `phantomx-ax` on a slope of 10° then
creeps by 0.05 mm/s, which its run states as a warning. Under moving legs the same hardness would
falsify the torques (see *Mass* below).

These are the numbers of the scenario `paper`. Those of other robots
[follow their weight and leg length](your-robot.md#size-and-weight).

**The second simulator** integrates the six degrees of freedom of the trunk on level ground, with
prescribed joints. Its state is the position and momentum of the centre of mass, the orientation,
and the angular momentum about the centre of mass:

    c' = p/m,   p' = m g + Σ F,   L' = Σ r × F,   R' = R [w]×,   w = J⁻¹ (Rᵀ L − l)

with J the inertia about the centre of mass and l the legs' own angular momentum. Sticking friction
is stiff against the robot's mass, so a substep is linearly implicit (ROS2, second order,
L-stable); a time step of {dt:g} ms has {substeps}. Joint torques follow by inverse dynamics.

## The same walk

{same}

Mean normal force of each foot in mid-stance, and the largest difference from `spring-damper` of
any sample, relative to the mean load of its foot. Normal forces do not depend on the law; they
agree within {gap:.2f} %.

![Three laws of contact](physics/contact-laws.png)

{rest}

Tangential force and squeeze are rms per foot in mid-stance. The squeeze is the part of the feet's
forces that adds up to no force and no moment. The torque's difference is that from the model, rms
in mid-stance of the worst joint. Sinkage is the mean depth of the tips, creep the mean speed of
stance feet over the ground. Times depend on the machine.

## Why the torques differ

Statics does not determine how hard three feet press against each other, and prescribed joints do
not yield. The squeeze therefore comes from friction on very small slips, and the torques with it:
**a quoted torque of a stance leg must name its law.** On feet of {point:g} mm, nearly points, two
causes are computed beside the simulated squeeze:

{squeezes}

- *Mass.* MuJoCo takes a contact's acceleration as J q̈ and leaves out J̇ q̇, so a foot that stands
  while its leg turns seems to accelerate by −J̇ q̇. Its friction resists this, at each point with
  a mass of d/((1 − d) A) times `impratio` (A is the mobility of the foot): at the default
  impedance {mass:.1f} kg a foot. A smaller `impedance` removes it.
- *Slip.* A foot touches half its depth above its tip, and the turning tibia moves that point over
  the ground by some hundredths of a millimetre per second. A larger threshold or harder ground
  reduces it.
- *Wide feet* (last column: squares of {width:g} mm). A stance foot turns about the vertical with
  its coxa. In `simscape` friction grows with the load of each point, so on an unevenly loaded
  square it does not cancel. In MuJoCo sticking friction does not depend on the load, and it
  cancels. Most of the squeeze of {squeeze_simscape:.2f} N under `simscape`, and of the
  {torque_simscape:.3f} N·m by which its torques differ from the model's, comes from this.
  A foot whose tibia tilts stands on an edge of its square; a gait that goes around the body
  [turns](gaits.md#heading) by it.

The minimum norm is the limit of all laws for point feet on hard, freely creeping ground.
"""


def document(comparison: Comparison) -> str:
    """Return the page, in Markdown.

    Args:
        comparison: The measurements.
    """
    default, own = comparison.trials[LAWS[0]], comparison.trials["simscape"]
    law = default.scenario.contact_law(default.walk.robot)
    points = [each for each in comparison.squeezes if each.width == POINT_FOOT]
    wide = [each for each in comparison.squeezes if each.width != POINT_FOOT]
    usual = next(
        each
        for each in points
        if each.law == LAWS[0] and each.varied == f"impedance {law.impedance:g}"
    )
    return _PAGE.format(
        robot=default.walk.robot.name,
        scenario=default.scenario.name,
        width=1000 * law.tip_width,
        point=1000 * POINT_FOOT,
        dt=1000 * own.scenario.simulation.time_step,
        substeps=substeps(own.scenario, own.walk.robot),
        gap=100 * comparison.largest_load_gap,
        laws=_laws(default, own),
        same=_loads(comparison),
        rest=_rest(comparison),
        squeezes=_squeezes(points, wide),
        creep=law.friction_damping,
        hard=STANDING_HARDNESS,
        damping=law.damping,
        mass=usual.mass,
        squeeze_simscape=own.squeeze,
        torque_simscape=own.torque_gap,
    )


def _laws(default: Trial, own: Trial) -> str:
    contact, library = (each.scenario.contact_law(each.walk.robot) for each in (default, own))
    table, most = own.scenario.contact, KINETIC_FROM
    least, rough = table.friction_threshold, own.scenario.terrain.friction
    spring = f"k = {contact.stiffness:g} N/m"
    rows = [
        (
            "`spring-damper` (default)",
            f"k x + b v, {spring}, b = {contact.damping:g} N·s/m, both ways",
            f"c u up to μ N, c = {contact.friction_damping:g} N·s/m",
            "MuJoCo",
        ),
        (
            "`mujoco`",
            f"the engine's own, critically damped in {SOFT_TIME:g} s, without a stiffness in N/m",
            "of the same softness, up to μ N",
            "MuJoCo",
        ),
        (
            "`simscape`",
            f"k x + b v while sinking, k x while leaving; {spring}, b = {library.damping:g} N·s/m",
            f"μ(u) N; μ rises to {rough:g} at {1000 * least:g} mm/s, falls "
            f"to {table.kinetic_friction:g} at {1000 * most * least:g} mm/s, linearly",
            "phasmid's own",
        ),
    ]
    return _table(("law", "normal force", "friction", "simulator"), rows)


def _loads(comparison: Comparison) -> str:
    default = comparison.trials[LAWS[0]]
    legs = [f"leg {number} [N]" for number in range(1, len(default.mean_load) + 1)]
    rows = [
        (
            f"`{law}`",
            *(f"{load:.3f}" for load in trial.mean_load),
            f"{100 * trial.load_gap(default):.2f} %" if trial is not default else "",
        )
        for law, trial in comparison.trials.items()
    ]
    return _table(("law", *legs, "differ"), rows)


def _rest(comparison: Comparison) -> str:
    trials, times = comparison.trials, comparison.step_times
    lines = {
        "tangential force [N]": [f"{t.tangential:.2f}" for t in trials.values()],
        "squeeze [N]": [f"{t.squeeze:.2f}" for t in trials.values()],
        "torque, difference [N·m]": [f"{t.torque_gap:.3f}" for t in trials.values()],
        "largest normal force, touchdown [N]": [
            f"{t.touchdown.max():.1f} (leg {t.touchdown.argmax() + 1})" for t in trials.values()
        ],
        "touches before the plan [ms]": [f"{1000 * t.early:.0f}" for t in trials.values()],
        "sinkage [mm]": [f"{1000 * t.sinkage:.3f}" for t in trials.values()],
        "creep [mm/s]": [f"{1000 * t.creep:.3f}" for t in trials.values()],
        "displacement [m]": [f"{t.way:.4f}" for t in trials.values()],
        "time of a step, all channels [µs]": [f"{1e6 * times[law]:.0f}" for law in trials],
    }
    return _table(("", *(f"`{law}`" for law in trials)), [(n, *row) for n, row in lines.items()])


def _squeezes(points: Iterable[Squeeze], squares: Iterable[Squeeze]) -> str:
    wide = {(each.law, each.varied): f"{each.simulated:.3f}" for each in squares}
    head = ("law", "varied", "squeeze [N]", "by mass [N]", "by slip [N]", "wide feet [N]")
    rows = [
        (
            f"`{each.law}`",
            each.varied,
            f"{each.simulated:.3f}",
            f"{each.by_mass:.3f}",
            f"{each.by_slip:.3f}",
            wide.get((each.law, each.varied), ""),
        )
        for each in points
    ]
    return _table(head, rows)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def contact_figure(comparison: Comparison) -> Figure:
    """Normal and outward force on a foot and torque of its femur, under all laws.

    Args:
        comparison: The walks; of each at least two cycles.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as NewFigure
    from matplotlib.lines import Line2D

    first = next(iter(comparison.trials.values()))
    period = first.scenario.period
    lands = _touchdown(first)
    spans = ((period, 2 * period), (lands - BEFORE, lands + TOUCHDOWN))
    rows = ("normal [N]", "outward [N]", "femur [N·m]")
    height = HEAD + ROW * len(rows) + FOOT
    with styled():
        figure = NewFigure(figsize=(WIDTH, height))
        FigureCanvasAgg(figure)
        axes = figure.subplots(len(rows), len(spans), sharex="col", squeeze=False)
        figure.subplots_adjust(
            left=0.108,
            right=0.98,
            top=1 - HEAD / height,
            bottom=FOOT / height,
            hspace=0.14,
            wspace=0.22,
        )
        for law, trial in comparison.trials.items():
            colour, dash, width = LINES[law]
            for row, values in enumerate(_shown(trial)):
                for column, (start, stop) in enumerate(spans):
                    part = slice(*np.searchsorted(trial.walk.time, (start, stop + 1e-9)))
                    moment = trial.walk.time[part]
                    axes[row, column].plot(
                        moment if column == 0 else 1000 * (moment - lands),
                        values[part],
                        color=colour,
                        linestyle=dash,
                        linewidth=width,
                    )
        for label, axis in zip(rows, axes[:, 0], strict=True):
            axis.set_ylabel(label)
        axes[0, 0].set_title("one cycle")
        axes[0, 1].set_title("a touchdown")
        axes[-1, 0].set_xlabel("time [s]")
        axes[-1, 1].set_xlabel("time since the plan's touchdown [ms]")
        axes[0, 0].set_xlim(*spans[0])
        axes[0, 1].set_xlim(-1000 * BEFORE, 1000 * TOUCHDOWN)
        figure.align_ylabels(axes[:, 0])
        leg = first.walk.robot.legs[LEG].name.replace("_", " ")
        place: dict[str, Any] = {"x": 0.108, "va": "top", "ha": "left"}
        title = f"Foot {LEG + 1}, {leg}, under three laws of contact"
        figure.text(y=1 - 0.10 / height, s=title, fontsize=11.5, fontweight="bold", **place)
        words = f"{first.walk.robot.name}, {first.walk.gait.name} gait, prescribed joints; "
        words += "outward: away from the hip"
        figure.text(y=1 - 0.33 / height, s=words, fontsize=8.5, color=FAINT, **place)
        handles = [
            Line2D([], [], color=colour, linestyle=dash, linewidth=width, label=law)
            for law, (colour, dash, width) in LINES.items()
        ]
        figure.legend(
            handles=handles,
            loc="upper left",
            bbox_to_anchor=(0.100, 1 - 0.50 / height),
            ncols=len(handles),
            columnspacing=1.4,
            borderaxespad=0.2,
        )
    return figure


def _touchdown(trial: Trial) -> float:
    """When the plan sets the shown foot down in the second cycle [s]."""
    stance, time = trial.walk.stance[:, LEG], trial.walk.time
    landed = np.flatnonzero(stance[1:] & ~stance[:-1]) + 1
    later = landed[time[landed] >= trial.scenario.period]
    return float(time[later[0]])


def _shown(trial: Trial) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normal and outward force, and the femur's torque."""
    force = trial.channel("foot_force")[:, LEG]
    outward = trial.walk.robot.arrays.R_body_hip[LEG, :, 0]
    return force[:, 2], force @ outward, trial.channel("joint_torque")[:, LEG, 1]


def main() -> None:
    """Compare the laws and write the page and its figure."""
    comparison = compare(announce=lambda what: sys.stderr.write(f"… {what}\n"))
    FIGURE.parent.mkdir(parents=True, exist_ok=True)
    save_figure(contact_figure(comparison), FIGURE)
    (HERE / "physics.md").write_text(document(comparison), encoding="utf-8")


if __name__ == "__main__":
    main()
