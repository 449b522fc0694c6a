"""The page on the paper: every statement with its number, figures and comparisons."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

from phasmid.paper.comparisons import (
    CREEPS,
    grips_table,
    relaxations_table,
    shares_tables,
    squeezes_table,
    table,
    variants_table,
)
from phasmid.paper.evidence import DRIVES, GAITS, SERVO_STIFFNESS, Evidence
from phasmid.paper.misprints import MISPRINTS, two_digits
from phasmid.paper.statement import RULES, Finding, Grade, Statement
from phasmid.paper.trajectory import turned_in_support
from phasmid.paper.walking import force_differences


class Graded(NamedTuple):
    """Statement with its finding."""

    statement: Statement
    finding: Finding


Parts = dict[str, list[Graded]]
"""The graded statements under their headings."""


def tally(parts: Parts) -> str:
    """Return how many statements there are of each grade, a sentence."""
    grades = [line.finding.grade for lines in parts.values() for line in lines]
    counted = Counter(grades)
    each = (f"{grade.value}: {counted[grade]}" for grade in Grade if counted[grade])
    return f"{len(grades)} statements. {' · '.join(each)}"


_PAGE = """\
# The paper, measured

What IMECE2018-88226 says, statement by statement, with a number beside each. `phasmid paper`
simulates, computes and writes all of this anew.

Unless a line says otherwise the robot is `phantomx-paper`, the scenario `paper` (assumptions in
[conventions](conventions.md)), joints are prescribed as in the paper, model forces are of minimum
norm, and "amid stance" is the middle half of each stance. Statements are in our words.

One rule decides each grade:

{rules}

{parts}
{count}

## The paper's figures

Joint angles, joint torques and normal forces, simulated and by the model.

![Fig. 12](paper/fig12.png)
![Fig. 13](paper/fig13.png)
![Fig. 14](paper/fig14.png)
![Fig. 15](paper/fig15.png)
![Fig. 16](paper/fig16.png)

### Figure 12 under both stance laws

The text on the paper's Fig 12 says that in support femur and tibia are fixed and the coxa alone
moves. The left column does so (`phasmid walk --stance-law coxa-only`); the right one is the default
walk of this project, as in the figure above.

![Fig. 12 under both stance laws](paper/fig12-stance-laws.png)

On the left a foot in support moves on an arc about its hip. The arcs of three feet do not fit one
straight motion of the body, so that feet slip, by {slip:.1f} mm a step. On the right each foot
moves on a straight line in the body's frame and stays where it stands; for that its distance from
the hip must change, which takes {femur:.1f}° of the femur and {tibia:.1f}° of the tibia.

## Two stance laws, two layouts

The paper says that in support only the coxa moves, and that the robot walks straight. With corner
legs at 45° both cannot be. The rows are the four readings: the foot on a straight line in the
body's frame (`straight`) or moved by the coxa alone (`coxa-only`), hips as the maker mounts them or
all square to the way. Slip is the way of a standing foot over the ground; heading is its change
over 10 s and, after the ±, half of what it swings; torques are the largest, prescribed joints,
simulated / by the model. Where all feet slide, as on corner legs that the coxa alone moves, the
body goes where friction takes it.

{variants}

## Equation 10 as printed

Each misprint has its own line in [errata](errata.md). Together, on the paper's walk and on random
states:

{misprints}

![Equation 10 as printed](paper/as-printed.png)

On a walk most of the misprints hide: the load on the foot in support, and gravity in swing, make
almost all of the torque of femur and tibia. The coxa's, which turns about the vertical and feels
inertia alone, shows them. What spoils all three is θ3 of Eq 9 in Eq 10's sines and cosines.

## The model against the simulation

Rms difference of the model's torques from the simulated ones amid stance [mN·m], prescribed joints,
minimum-norm forces.

{model}

## How the ground shares the load

Each force model beside four kinds of joints: prescribed ones, position servos of {position:g}
N·m/rad, servos that give like the AX-12A, by {own:g} N·m/rad, and the AX-12A itself with its own
law, gears and friction. Rms differences from the simulated forces and torques amid stance; the
nearest models of each column are **bold**. On three feet of level ground, far from slipping, four
of the five models are one and the same; only `minimum-torque` differs.

{shares}

![Forces on foot 2](paper/sharing.png)

The friction that these forces need, tangential over normal, amid stance; the margin is the least
distance of a foot's force from the cone of the ground's friction, {friction:g}:

{grips}

### Why normal forces agree while tangential ones do not

Three feet give nine numbers for six equations. The three that are left over are squeezes of feet
against each other along the lines between them. On level ground these lines lie level, so that a
squeeze has no normal part, and statics alone settles the normal forces, whatever the model. How
hard the feet squeeze, no equation of equilibrium says: how the joints give, how the feet touched
down and how the ground holds them decide it. Rms per foot amid stance [N]:

{squeezes}

"Internal" is the squeeze beyond that of the minimum norm; "remainder" is what no squeeze explains,
from a body that moves a little beside its plan. Where more than three feet stand, statics leaves
normal forces open, too: by the minimum norm they miss the simulated ones, prescribed joints, by
{more_feet}.

### Joints that do not give

Prescribed joints say where each foot goes, to some hundredths of a millimetre; whether it squeezes
the others depends on how the ground takes that. The engine's friction creeps, with a damper for
each point that sticks, and the squeeze goes with it:

{creeps}

What is left of it has two causes, which [physics](physics.md) computes from the plan: an inertia of
the engine's contact that no ground has, and slips of hundredths of a millimetre a second, on a
damper that this project chose. The minimum norm is its limit for ground that creeps freely. On
rigid feet, rigid ground and Coulomb friction alone the squeeze would be whatever the touchdowns
made it.

### Servos

Position servos give way like springs. If all springs are equal and linear, the feet stick, and each
touched down where its plan has it, then of all ways to carry the load the one comes about that
stores least energy (Castigliano): the least sum of τ²/2k, which is `minimum-torque`. The engine's
creep then lets go of it. The simulated tangential forces along those of the minimum torque, as a
share of them, by the time since touchdown:

{relaxations}

The time in which it fades is about that of a foot's friction damping against its joints' give. For
servos as soft as the AX-12A it is longer than a stance, and `minimum-torque` is by far the nearest
model. The AX-12A itself does not give like a spring: inside its margin and its friction it does not
give at all, so that it keeps part of what touchdown left; `minimum-torque` remains the nearest. For
servos four times as stiff it is the nearer one, but not near, and for prescribed joints the minimum
norm is. `friction-cone` and `smallest-largest-load` bound what the ground can give, and
change nothing on a walk that is far from slipping.
"""


def document(parts: Parts, evidence: Evidence) -> str:
    """Return the page, in Markdown."""
    femur, tibia = turned_in_support(evidence, "straight")
    return _PAGE.format(
        parts="".join(_part(name, lines) for name, lines in parts.items()),
        rules=table(("grade", "given where"), [(g.value, rule) for g, rule in RULES.items()]),
        count=tally(parts),
        slip=1000 * evidence.variant("coxa-only", "as-given").summary["slip"]["mean"],
        femur=femur,
        tibia=tibia,
        variants=variants_table(evidence),
        misprints=_misprints(),
        model=_model_torque(evidence),
        position=SERVO_STIFFNESS,
        own=evidence.robot.servo.stiffness,
        friction=evidence.scenario.terrain.friction,
        shares=shares_tables(evidence),
        grips=grips_table(evidence),
        squeezes=squeezes_table("joints", {drive: evidence.driven(drive) for drive in DRIVES}),
        creeps=squeezes_table(
            "friction damping", {f"{c:g} N·s/m a point": evidence.creeping(c) for c in CREEPS}
        ),
        relaxations=relaxations_table(evidence),
        more_feet=", ".join(
            f"{force_differences(evidence.gait(gait))[0]:.2f} N ({gait})" for gait in GAITS
        ),
    )


def _part(name: str, lines: list[Graded]) -> str:
    rows = []
    for statement, finding in lines:
        measured = finding.number + (f". {finding.note}" if finding.note else "")
        rows.append((statement.where, statement.says, measured, finding.grade.value))
    return f"## {name}\n\n{table(('where', 'the paper says', 'measured', 'grade'), rows)}\n\n"


def _misprints() -> str:
    rows = []
    for name in ("eq-10", "theta-3-as-fed", "eq-10-as-fed", "eq-11-sign"):
        row = next(misprint for misprint in MISPRINTS if misprint.name == name)
        rows.append((row.where, *(two_digits(1000 * extent.largest) for extent in row.cost())))
    return table(("largest error of a torque [mN·m]", "swing", "support", "random states"), rows)


def _model_torque(evidence: Evidence) -> str:
    gap = evidence.walk.summary["model_against_simulation"]["torque"]["rms_mid_stance"]
    rows = [
        (f"{number} {name.replace('_', ' ')}", *(f"{1000 * value:.1f}" for value in joints))
        for number, (name, joints) in enumerate(zip(evidence.robot.leg_names, gap, strict=True), 1)
    ]
    return table(("leg", "coxa", "femur", "tibia"), rows)
