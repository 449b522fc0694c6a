"""Every figure by its name: its content, its channels, and its drawing function."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from phasmid.errors import InvalidInput, located, nearest
from phasmid.recording import Recording, load_recording
from phasmid.reporting import envelope, foot_path, friction, gait_diagram, power, residuals, support
from phasmid.reporting.drawing import walk_figure
from phasmid.reporting.layout import laid_out, page_layout
from phasmid.reporting.leg_figures import (
    ANGLES,
    FORCES,
    SERVO_QUANTITIES,
    TORQUES,
    Quantity,
    leg_groups,
    quantity_figure,
    suffix_of,
)
from phasmid.reporting.required_channels import Needs, check_needs, missing_group
from phasmid.reporting.runs import Run, gather
from phasmid.reporting.sensors import SENSOR_CHANNELS, sensor_figure
from phasmid.reporting.style import Figure

Draw = Callable[[Sequence[Run], tuple[int, ...]], Figure]


def _together(count: int) -> list[tuple[int, ...]]:
    return [tuple(range(1, count + 1))]


@dataclass(frozen=True)
class FigureKind:
    """A figure that can be drawn of a recording.

    Attributes:
        name: Its name, and the stem of its file.
        sentence: Its content.
        needs: Groups of channels; it requires one of each.
        draw: Function from runs and leg numbers to the figure.
        groups: Function from a number of legs to the legs of each figure.
        in_folder: It is a file of a run's folder.
        in_page: It is part of a run's page.
        several: It can compare runs.
    """

    name: str
    sentence: str
    needs: Needs
    draw: Draw
    groups: Callable[[int], list[tuple[int, ...]]] = _together
    in_folder: bool = False
    in_page: bool = True
    several: bool = True


def _all_angles(count: int) -> list[tuple[int, ...]]:
    groups = leg_groups(count)
    return groups if len(groups) > 2 else groups[:1]


def _first(count: int) -> list[tuple[int, ...]]:
    return leg_groups(count)[:1]


def _others(count: int) -> list[tuple[int, ...]]:
    return leg_groups(count)[1:]


def _paper(number: int, words: str, quantity: Quantity, groups: Any) -> FigureKind:
    sentence = f"{words} over time, as the paper's Fig. {number}."
    draw = partial(quantity_figure, quantity=quantity)
    name, needs = f"fig{number}", (quantity.channels,)
    return FigureKind(name, sentence, needs, draw, groups, in_folder=True)


def _all_legs(name: str, sentence: str, quantity: Quantity) -> FigureKind:
    draw = partial(quantity_figure, quantity=quantity)
    return FigureKind(name, sentence, (quantity.channels,), draw, in_page=False)


KINDS: tuple[FigureKind, ...] = (
    _paper(12, "Joint angles of the first legs", ANGLES, _all_angles),
    _paper(13, "Joint torques of the first legs", TORQUES, _first),
    _paper(14, "Joint torques of the other legs", TORQUES, _others),
    _paper(15, "Normal forces on the first feet", FORCES, _first),
    _paper(16, "Normal forces on the other feet", FORCES, _others),
    _all_legs("joint-angle", "Joint angles of all legs over time.", ANGLES),
    _all_legs(
        "joint-torque", "Joint torques of all legs over time, simulated and by the model.", TORQUES
    ),
    _all_legs(
        "normal-force", "Normal forces on all feet over time, simulated and by the model.", FORCES
    ),
    FigureKind(
        "gait-diagram",
        "Planned stance and recorded contact of each leg over time.",
        gait_diagram.NEEDS,
        gait_diagram.gait_diagram,
    ),
    FigureKind(
        "support-margin",
        "Distance of the centre of mass, seen from above, from the edge of the support polygon.",
        support.NEEDS,
        support.support_figure,
    ),
    FigureKind(
        "servo-envelope",
        "Torque over speed of each joint, in the envelope of its servo.",
        envelope.NEEDS,
        envelope.envelope_figure,
    ),
    FigureKind(
        "friction-demand",
        "Tangential over normal force of each stance foot, against the coefficient of friction.",
        friction.NEEDS,
        friction.friction_figure,
    ),
    FigureKind(
        "foot-path",
        "Foot paths in body axes and in the world, from above and from the side.",
        foot_path.NEEDS,
        foot_path.foot_path_figure,
    ),
    FigureKind(
        "power",
        "Power of all joints, the energy since the start, and the cost of transport.",
        power.NEEDS,
        power.power_figure,
    ),
    FigureKind(
        "residuals",
        "The model's normal forces and joint torques less the simulated ones.",
        residuals.NEEDS,
        residuals.residuals_figure,
    ),
    *(
        FigureKind(
            quantity.channels[0].replace("_", "-"),
            f"{quantity.title} of every joint over time.",
            (quantity.channels,),
            partial(quantity_figure, quantity=quantity),
            in_folder=True,
        )
        for quantity in SERVO_QUANTITIES
    ),
    FigureKind(
        "sensors",
        "Measured over true values of the last cycle.",
        (SENSOR_CHANNELS,),
        sensor_figure,
        in_folder=True,
        several=False,
    ),
    FigureKind(
        "walk",
        "The robot in mid-walk, the forces on its feet, and its gait.",
        (
            ("body_position",),
            ("body_orientation",),
            ("joint_position", "joint_position_target"),
        ),
        walk_figure,
        in_page=False,
        several=False,
    ),
)
"""All figures, in the order in which they are listed."""

CATALOGUE: dict[str, FigureKind] = {kind.name: kind for kind in KINDS}
"""All figures by their names."""


def find_figure(name: str) -> FigureKind:
    """Return the figure of a name; raise InvalidInput where there is none."""
    if name not in CATALOGUE:
        guess = nearest(name, CATALOGUE)
        raise InvalidInput(f'no figure "{name}".', hint=guess or f"one of {', '.join(CATALOGUE)}")
    return CATALOGUE[name]


def can_be_plotted(recording: Recording) -> list[FigureKind]:
    """Return the figures whose channels are recorded."""
    return [kind for kind in KINDS if not missing_group(recording, kind.needs)]


def plot(
    recordings: Recording | str | Path | list[Any] | tuple[Any, ...],
    name: str,
    *,
    legs: Sequence[int] | None = None,
    labels: Sequence[str] | None = None,
    width: float | None = None,
    title: bool = True,
) -> Figure:
    """Draw one figure of a recording, or of several that are compared.

    Args:
        recordings: A recording, or its file or folder; or a list of two to six of these.
        name: Name of the figure, such as ``"support-margin"``; ``phasmid plot --list`` lists them.
        legs: Leg numbers, from 1; by default all legs of the figure.
        labels: Name of each run; by default the scenario's. Differences between the runs'
            scenarios are added.
        width: Width of the figure [m]; type keeps a legible size. A column of a paper has 0.085 m.
        title: Draw a title and a subtitle.

    Returns:
        A matplotlib figure; its ``savefig`` writes it.

    Raises:
        InvalidInput: There is no such figure or leg, a required channel is not recorded, or the
            width is out of range.
    """
    kind = find_figure(name)
    given = list(recordings) if isinstance(recordings, list | tuple) else [recordings]
    loaded = [load_recording(one) if isinstance(one, str | Path) else one for one in given]
    with laid_out(page_layout(width, title=title)):
        return draw_groups(gather(loaded, labels), kind, legs)[0]


def draw_groups(
    runs: Sequence[Run], kind: FigureKind, legs: Sequence[int] | None = None
) -> list[Figure]:
    """Draw all figures of one kind: one for each of its groups of legs.

    Args:
        runs: One, or several that are compared.
        kind: The kind of figure.
        legs: Leg numbers, from 1, of a single figure instead.

    Raises:
        InvalidInput: A required channel is not recorded, or the figure cannot compare runs.
    """
    check_figure(runs, kind)
    count = min(len(run.source.robot.legs) for run in runs)
    groups = [tuple(legs)] if legs else kind.groups(count)
    return [kind.draw(runs, group) for group in groups]


def check_figure(runs: Sequence[Run], kind: FigureKind) -> None:
    """Raise InvalidInput for runs that a figure cannot show."""
    if len(runs) > 1 and not kind.several:
        raise InvalidInput(f"the figure {kind.name} shows one run; {len(runs)} were given.")
    for run in runs:
        with located(run.label if len(runs) > 1 else ""):
            check_needs(run.recording, kind.needs, kind.name)


def figures(recording: Recording) -> dict[str, Figure]:
    """Draw every figure of a run's folder whose channels are recorded, by its file's stem.

    Returns:
        For a hexapod ``fig12`` to ``fig16``, as in the paper. Other numbers of legs take as many of
        a kind as groups of three legs: ``fig14b`` follows ``fig14``. With the servos' own law
        ``servo-duty``, ``servo-current`` and ``servo-temperature``, and ``sensors`` where sensors
        were recorded.
    """
    run = gather([recording])[0]
    return {
        name: kind.draw([run], legs) for name, kind, legs in report_figures(run) if kind.in_folder
    }


def report_figures(run: Run) -> list[tuple[str, FigureKind, tuple[int, ...]]]:
    """Return file stem, kind and leg numbers of each figure of a run's folder and page."""
    return [
        (kind.name + suffix_of(number), kind, legs)
        for kind in can_be_plotted(run.recording)
        if kind.in_folder or kind.in_page
        for number, legs in enumerate(kind.groups(len(run.source.robot.legs)))
    ]
