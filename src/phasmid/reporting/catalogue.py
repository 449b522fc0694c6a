"""Every figure by its name: what it shows, what it needs, and how it is drawn."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from phasmid.arguments import check_type
from phasmid.errors import InvalidInput, located, nearest
from phasmid.recording import Recording, check_recording, load_recording
from phasmid.reporting import envelope, foot_path, friction, gait_diagram, power, residuals, support
from phasmid.reporting.comparison import compare_feet, compare_joints
from phasmid.reporting.demand import Needs, check_needs, lacking
from phasmid.reporting.drawing import walk_picture
from phasmid.reporting.figures import (
    ANGLES,
    FORCES,
    SERVO_FIGURES,
    TORQUES,
    leg_groups,
    normal_force_figure,
    servo_figure,
    suffix_of,
    torque_figure,
    trajectory_figure,
)
from phasmid.reporting.layout import laid_out, page_layout
from phasmid.reporting.runs import Run, gather
from phasmid.reporting.sensors import SENSOR_CHANNELS, sensor_figure
from phasmid.reporting.style import Figure, save_figure

Draw = Callable[[Sequence[Run], tuple[int, ...]], Figure]


def _together(count: int) -> list[tuple[int, ...]]:
    return [tuple(range(1, count + 1))]


@dataclass(frozen=True)
class FigureKind:
    """A figure that can be drawn of a recording.

    Attributes:
        name: By which it is asked for, and the stem of its file.
        sentence: What it shows.
        needs: Of each group of channels it needs one.
        draw: From runs and legs to the figure.
        groups: From a robot's number of legs to those that stand together in one figure.
        in_folder: Whether a run's folder has it.
        in_page: Whether a run's page has it.
        several: Whether it can show several runs.
    """

    name: str
    sentence: str
    needs: Needs
    draw: Draw
    groups: Callable[[int], list[tuple[int, ...]]] = _together
    in_folder: bool = False
    in_page: bool = True
    several: bool = True


def _angles(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    if len(runs) == 1:
        return trajectory_figure(runs[0].recording, legs)
    return compare_joints(runs, legs, ANGLES, "Joint angles", "angle [°]", DEGREES)


def _torques(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    if len(runs) == 1:
        return torque_figure(runs[0].recording, legs)
    return compare_joints(runs, legs, TORQUES, "Joint torques", "torque [N·m]")


def _forces(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    if len(runs) == 1:
        return normal_force_figure(runs[0].recording, legs)
    return compare_feet(runs, legs, FORCES, "Normal forces", "force [N]")


def _servo(name: str) -> Draw:
    what, unit, scale = SERVO_FIGURES[name]

    def draw(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
        if len(runs) == 1:
            return servo_figure(runs[0].recording, legs, name)
        return compare_joints(runs, legs, [name], what, unit, scale)

    return draw


def _sensors(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    del legs
    return sensor_figure(runs[0].recording)


def _walk(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    del legs
    return walk_picture(runs[0].recording)


def _all_angles(count: int) -> list[tuple[int, ...]]:
    groups = leg_groups(count)
    return groups if len(groups) > 2 else groups[:1]


def _first(count: int) -> list[tuple[int, ...]]:
    return leg_groups(count)[:1]


def _others(count: int) -> list[tuple[int, ...]]:
    return leg_groups(count)[1:]


DEGREES = math.degrees(1.0)
PAPER = "as the paper's Fig. "

KINDS: tuple[FigureKind, ...] = (
    FigureKind(
        "fig12",
        f"Joint angles of the first legs over time, {PAPER}12.",
        (ANGLES,),
        _angles,
        _all_angles,
        in_folder=True,
    ),
    FigureKind(
        "fig13",
        f"Joint torques of the first legs over time, {PAPER}13.",
        (TORQUES,),
        _torques,
        _first,
        in_folder=True,
    ),
    FigureKind(
        "fig14",
        f"Joint torques of the other legs over time, {PAPER}14.",
        (TORQUES,),
        _torques,
        _others,
        in_folder=True,
    ),
    FigureKind(
        "fig15",
        f"Normal forces on the first feet over time, {PAPER}15.",
        (FORCES,),
        _forces,
        _first,
        in_folder=True,
    ),
    FigureKind(
        "fig16",
        f"Normal forces on the other feet over time, {PAPER}16.",
        (FORCES,),
        _forces,
        _others,
        in_folder=True,
    ),
    FigureKind(
        "joint-angle",
        "Joint angles of all legs over time.",
        (ANGLES,),
        _angles,
        in_page=False,
    ),
    FigureKind(
        "joint-torque",
        "Joint torques of all legs over time, simulated and by the model.",
        (TORQUES,),
        _torques,
        in_page=False,
    ),
    FigureKind(
        "normal-force",
        "Normal forces on all feet over time, simulated and by the model.",
        (FORCES,),
        _forces,
        in_page=False,
    ),
    FigureKind(
        "gait-diagram",
        "Which foot is down when, as planned and as seen.",
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
        "Tangential over normal force of each standing foot, against the coefficient of friction.",
        friction.NEEDS,
        friction.friction_figure,
    ),
    FigureKind(
        "foot-path",
        "Ways of the feet in body axes and in the world, from above and from the side.",
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
            name.replace("_", "-"),
            f"{title} of every joint over time.",
            ((name,),),
            _servo(name),
            in_folder=True,
        )
        for name, (title, _, _) in SERVO_FIGURES.items()
    ),
    FigureKind(
        "sensors",
        "What sensors told in the last cycle, over what was true.",
        (SENSOR_CHANNELS,),
        _sensors,
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
        _walk,
        in_page=False,
        several=False,
    ),
)
"""All figures, in the order in which they are listed."""

CATALOGUE: dict[str, FigureKind] = {kind.name: kind for kind in KINDS}
"""All figures by their names."""


def find_figure(name: str) -> FigureKind:
    """The figure of a name.

    Raises:
        InvalidInput: There is none.
    """
    check_type("name", name, (str,), "the name of a figure", "phasmid plot --list")
    if name not in CATALOGUE:
        guess = nearest(name, CATALOGUE)
        raise InvalidInput(f'no figure "{name}".', hint=guess or f"one of {', '.join(CATALOGUE)}")
    return CATALOGUE[name]


def can_be_plotted(recording: Recording) -> list[FigureKind]:
    """The figures that a recording has the channels for."""
    return [kind for kind in KINDS if not lacking(recording, kind.needs)]


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
        name: Of a figure, such as ``"support-margin"``; ``phasmid plot --list`` has them all.
        legs: Numbers of the legs that are shown, from 1; by default all that the figure is of.
        labels: What each run is called; by default the scenario's name. What differs in the
            runs' scenarios is added.
        width: Of the figure [m]; type keeps a legible size. A column of a paper has 0.085 m.
        title: Whether the figure has a title and a subtitle.

    Returns:
        A matplotlib figure, which ``savefig`` writes.

    Raises:
        InvalidInput: There is no such figure or leg, a recording lacks what the figure shows, or
            the width is out of range.
    """
    kind = find_figure(name)
    page = page_layout(width, title=title)
    given = list(recordings) if isinstance(recordings, list | tuple) else [recordings]
    if legs is not None:
        check_type("legs", legs, (list, tuple), "a list of legs' numbers, or None")
        for place, leg in enumerate(legs):
            check_type(f"legs[{place}]", leg, (int,), "the number of a leg")
    if labels is not None:
        check_type("labels", labels, (list, tuple), "a list of texts, or None")
        for place, label in enumerate(labels):
            check_type(f"labels[{place}]", label, (str,), "text")
    loaded = [load_recording(one) if isinstance(one, str | Path) else one for one in given]
    for recording in loaded:
        check_recording(recording)
    with laid_out(page):
        return draw_groups(gather(loaded, labels), kind, legs)[0]


def draw_groups(
    runs: Sequence[Run], kind: FigureKind, legs: Sequence[int] | None = None
) -> list[Figure]:
    """All figures of one kind: one, or as many as its groups of legs need.

    Args:
        runs: One, or several that are compared.
        kind: Of figure.
        legs: Numbers of the legs that are shown, from 1, in one figure.

    Raises:
        InvalidInput: A run lacks what the figure shows, or it cannot show several.
    """
    check_figure(runs, kind)
    count = min(len(run.source.robot.legs) for run in runs)
    groups = [tuple(legs)] if legs else kind.groups(count)
    return [kind.draw(runs, group) for group in groups]


def check_figure(runs: Sequence[Run], kind: FigureKind) -> None:
    """Refuse runs that a figure cannot show.

    Raises:
        InvalidInput: A run lacks what the figure shows, or it cannot show several.
    """
    if len(runs) > 1 and not kind.several:
        raise InvalidInput(f"the figure {kind.name} shows one run; {len(runs)} were given.")
    for run in runs:
        where = run.label if len(runs) > 1 else ""
        with located(where):
            check_needs(run.recording, kind.needs, kind.name)


def figures(recording: Recording) -> dict[str, Figure]:
    """Every figure of a run's folder that the recording has the channels for, by its file's stem.

    Returns:
        For a hexapod ``fig12`` to ``fig16``, as in the paper. With another number of legs there
        are as many of a kind as groups of three legs need: ``fig14b`` follows ``fig14``. Of the
        robot's own servos ``servo-duty``, ``servo-current`` and ``servo-temperature``. And
        ``sensors``, where sensors were recorded.
    """
    return {name: figure for name, kind, figure in drawn(recording) if kind.in_folder}


def drawn(recording: Recording) -> Iterator[tuple[str, FigureKind, Figure]]:
    """Every figure of a run's folder and of its page, each drawn when it is asked for.

    Returns:
        Its file's stem, its kind, and the figure.
    """
    runs = gather([recording])
    for name, kind, legs in listed(runs[0]):
        yield name, kind, kind.draw(runs, legs)


def listed(run: Run) -> Iterator[tuple[str, FigureKind, tuple[int, ...]]]:
    """What `drawn` draws.

    Returns:
        Of each figure its file's stem, its kind, and its legs' numbers, from 1.
    """
    for kind in can_be_plotted(run.recording):
        if kind.in_folder or kind.in_page:
            for number, legs in enumerate(kind.groups(len(run.source.robot.legs))):
                yield kind.name + suffix_of(number), kind, legs


def save_figures(recording: Recording, folder: Path) -> list[Path]:
    """Write every figure of `figures` as ``.svg`` and ``.png`` into an existing folder."""
    written = []
    for name, figure in figures(recording).items():
        for suffix in (".svg", ".png"):
            written.append(folder / f"{name}{suffix}")
            save_figure(figure, written[-1])
    return written
