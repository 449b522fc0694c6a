"""``python -m phasmid.verification.contact_page`` writes docs/physics.md and its figure."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from phasmid.reporting.page import write_page
from phasmid.reporting.style import save_figure
from phasmid.scenario import Scenario
from phasmid.scenario.contact import ContactTable
from phasmid.simulation.contact import SOFT_TIME
from phasmid.simulation.simscape.run import substeps
from phasmid.simulation.simscape.trunk import KINETIC_FROM
from phasmid.verification.contact_figure import contact_figure
from phasmid.verification.contact_laws import LAWS, POINT_FOOT, Comparison, Squeeze, compare

FIGURE = "physics/contact-laws.png"
"""The figure, beside the page."""

_PAGE = """\
# Physics: three laws of contact, two simulators

The paper's walk under three laws of how the ground holds a foot, one argument apart:
`--contact-law`, or `contact_law` in `[contact]`. Two of them live in MuJoCo. The third, the law of
the paper's own library, does not fit into it and has a simulator of its own: both share the plan
and the places of the contact points, and no line of contact or integration, so that what they agree
on is not an artefact of either. `make physics` simulates, computes and writes all of this anew.

The robot is `{robot}`, the scenario `{scenario}`, joints are prescribed. "Amid stance" is the
middle half of each whole stance. The model's forces are of minimum norm.

## The laws

A foot is four points at the corners of a square of {width:g} mm. For a point at depth x that sinks
with speed v and slips with speed u:

{laws}

The ground pulls under none of them. In the engine a point also resists its own acceleration, with a
small mass that its impedance d sets (`impedance`); that mass turns out to matter, below. `mujoco`
keeps all of the engine's default numbers, its friction no harder than its normal force
(`impratio` 1). All three creep below their friction limit.

## The second simulator

Prescribed joints leave the trunk's six degrees of freedom. Seen from the trunk everything else is
known beforehand: centre of mass, inertia J about it, the legs' own angular momentum l, and each
contact point with its speed. The state is the place and momentum of the centre of mass, the
orientation, and the angular momentum about the centre of mass:

    c' = p/m,   p' = m g + Σ F,   L' = Σ r × F,   R' = R [w]×,   w = J⁻¹ (Rᵀ L − l)

Friction that sticks is a damper of μ N/threshold, stiff against the robot's mass, so a substep is
linearly implicit (ROS2, second order, L-stable) with the contacts' dampers as its matrix. A time
step of {dt:g} ms is made in {substeps} substeps, so many that each is at most a twelfth of the
longest step that resolves the contact. Joint torques follow by inverse dynamics of the whole robot,
with the force at each point. In flight momentum is kept to round-off; tests hold the simulator
against closed forms, and its forces and torques against the law and the equation of motion written
anew. Without numba, which phasmid installs, the same loop is plain Python, some hundred
times slower.

## The same walk

{same}

Normal forces: mean amid stance of each foot, and the largest difference from `spring-damper` of any
sample amid stance, as a share of the mean load of its foot. On three feet statics leaves no choice
of them. They agree within {gap:.2f} %; 2 % is asked.

![Three laws of contact](physics/contact-laws.png)

{rest}

Tangential force and squeeze are rms per foot amid stance; a squeeze is the part of the feet's
forces that adds up to no force and no moment. The torque's difference is that from the model, rms
amid stance of the worst joint. Sinkage is the mean depth of the tips, creep the mean speed of
standing feet over the ground. A foot touches early because the robot has sunk by then. Times depend
on the machine; read them beside each other.

## Where they differ, and why

**Touchdown.** The plan sets a foot down at rest, but on springs the robot stands a little low, so
that the foot touches earlier and takes its load as the others give it. The softer `mujoco` sinks
deeper and touches sooner; how the laws damp shows in the first moments. Amid stance nothing of it
is left.

**Sinkage.** A point sinks by its load over k. `mujoco` is softer, and has no such number.

**Squeeze, and torques with it.** Three feet give nine numbers for six equations; no statics says
how hard feet squeeze each other, and prescribed joints do not give. What is simulated is friction
on very small slips, and these are known from the plan. Here it stands beside two causes that are
computed, not fitted, on feet of {point:g} mm, nearly points:

{squeezes}

- *Mass.* The engine takes a contact's acceleration as J q̈ and leaves out J̇ q̇, so that a foot which
  stands while its leg turns seems to be accelerated, by −J̇ q̇. Its friction resists that, at each
  point with a mass of d/((1 − d) A) times `impratio` (A is the mobility of the foot): at the
  default impedance, {mass:.1f} kg a foot. This makes most of the default's squeeze. It belongs to
  the engine and to no ground; a smaller `impedance` takes it away.
- *Slip.* A foot touches half its depth above its tip, and the turning tibia moves that point over
  the ground. It is a matter of some hundredths of a millimetre per second, but friction is steep
  there. A larger threshold makes it less, as does a harder ground.

**Wide feet.** In `simscape` friction grows with the load of each point, and a standing foot turns
about the vertical, with its coxa. Where the load lies off the middle of the square, the loaded
points go round that middle, and their friction does not cancel. In the engine sticking friction
does not know the load, and it cancels:

{wide}

So the squeeze of {squeeze_simscape:.2f} N under `simscape`, and the {torque_simscape:.3f} N·m by
which its torques differ from the model's, come from feet of {width:g} mm that are rigid and flat,
at the library's threshold. The minimum norm is the limit of all laws for point feet on hard, freely
creeping ground. Normal forces do not depend on any of this. Every torque of a standing leg does: a
quoted one names its law.
"""


def document(comparison: Comparison) -> str:
    """The page, in Markdown.

    Args:
        comparison: What was measured.
    """
    default, own = comparison.trials[LAWS[0]], comparison.trials["simscape"]
    contact, library = default.scenario.contact, own.scenario.contact
    points = [each for each in comparison.squeezes if each.width == POINT_FOOT]
    wide = [each for each in comparison.squeezes if each.width != POINT_FOOT]
    usual = next(
        each
        for each in points
        if each.law == LAWS[0] and each.varied == f"impedance {contact.impedance:g}"
    )
    return _PAGE.format(
        robot=default.walk.robot.name,
        scenario=default.scenario.name,
        width=1000 * contact.tip_width,
        point=1000 * POINT_FOOT,
        dt=1000 * own.scenario.simulation.dt,
        substeps=substeps(own.scenario, own.walk.robot),
        gap=100 * comparison.largest_load_gap,
        laws=_laws(default.scenario, library),
        same=_loads(comparison),
        rest=_rest(comparison),
        squeezes=_squeezes(points),
        wide=_wide(wide, points),
        mass=usual.mass,
        squeeze_simscape=own.squeeze,
        torque_simscape=own.torque_gap,
    )


def _laws(scenario: Scenario, library: ContactTable) -> str:
    contact, least, most = scenario.contact, library.friction_threshold, KINETIC_FROM
    spring = f"k = {contact.stiffness:g} N/m"
    rows = [
        (
            "`spring-damper` (default)",
            f"k x + b v, {spring}, b = {contact.law_damping:g} N·s/m, both ways",
            f"c u up to μ N, c = {contact.friction_damping:g} N·s/m",
            "MuJoCo",
        ),
        (
            "`mujoco`",
            f"the engine's own, critically damped in {SOFT_TIME:g} s; nothing in N/m",
            "as soft as that, up to μ N",
            "MuJoCo",
        ),
        (
            "`simscape`",
            f"k x + b v while sinking, k x while leaving; {spring}, "
            f"b = {library.law_damping:g} N·s/m",
            f"μ(u) N; μ rises to {scenario.terrain.friction:g} at {1000 * least:g} mm/s, falls "
            f"to {library.kinetic_friction:g} at {1000 * most * least:g} mm/s, linearly",
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
        "way [m]": [f"{t.way:.4f}" for t in trials.values()],
        "time of a step, all channels [µs]": [f"{1e6 * times[law]:.0f}" for law in trials],
    }
    return _table(("", *(f"`{law}`" for law in trials)), [(n, *row) for n, row in lines.items()])


def _squeezes(squeezes: Iterable[Squeeze]) -> str:
    head = ("law", "varied", "squeeze [N]", "by mass [N]", "by slip [N]", "both miss [N]")
    rows = [
        (
            f"`{each.law}`",
            each.varied,
            f"{each.simulated:.3f}",
            f"{each.by_mass:.3f}",
            f"{each.by_slip:.3f}",
            f"{each.missed:.3f}",
        )
        for each in squeezes
    ]
    return _table(head, rows)


def _wide(wide: Iterable[Squeeze], points: Iterable[Squeeze]) -> str:
    narrow = {(each.law, each.varied): each for each in points}
    rows = [
        (
            f"`{each.law}`",
            each.varied,
            f"{narrow[each.law, each.varied].simulated:.3f}",
            f"{each.simulated:.3f}",
        )
        for each in wide
    ]
    return _table(("law", "varied", "points [N]", "squares [N]"), rows)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the page and its figure; the exit status is 1 where they cannot be written.

    Args:
        arguments: Of the command line; those of the process where None.
    """
    return write_page(
        _write,
        module="phasmid.verification.contact_page",
        description="Walk under the three laws of contact and write the page on them.",
        default="docs/physics.md",
        arguments=arguments,
    )


def _write(path: Path) -> None:
    comparison = compare(announce=lambda what: sys.stderr.write(f"… {what}\n"))
    figure = path.parent / FIGURE
    figure.parent.mkdir(parents=True, exist_ok=True)
    save_figure(contact_figure(comparison), figure)
    path.write_text(document(comparison), encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
