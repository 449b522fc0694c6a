"""Every figure by its name: its content, its channels, and its drawing function."""

from __future__ import annotations

import string
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from phasmid.arguments import checked
from phasmid.errors import InvalidInput, located, nearest
from phasmid.recording import Recording, load_recording
from phasmid.reporting import path_figures, time_figures
from phasmid.reporting.drawing import walk_figure
from phasmid.reporting.run import POSE, Needs, Run, gather, shown_part
from phasmid.reporting.style import DEFAULT_LAYOUT, NORMAL_WIDTH, Figure, Layout, styled
from phasmid.reporting.time_figures import (
    ANGLES,
    FORCES,
    SENSOR_CHANNELS,
    SERVO_QUANTITIES,
    TORQUES,
    Legs,
    quantity_figure,
)

Draw = Callable[[Sequence[Run], Legs, Layout], Figure]

LEGS_PER_FIGURE = 3

TORQUE_AND_SPEED: Needs = (
    ("joint_torque", "joint_torque_model"),
    ("joint_velocity", "joint_velocity_target"),
)


def suffix_of(number: int) -> str:
    """Return the suffix of the files of one kind: none, then b, c and so on, then a number."""
    letters = string.ascii_lowercase
    return "" if number == 0 else letters[number] if number < 26 else f"-{number + 1}"


def leg_groups(count: int) -> list[Legs]:
    """Return leg numbers from 1 in even groups of at most three."""
    parts = np.array_split(np.arange(1, count + 1), -(-count // LEGS_PER_FIGURE))
    return [tuple(int(leg) for leg in part) for part in parts]


def _all_angles(count: int) -> list[Legs]:
    groups = leg_groups(count)
    return groups if len(groups) > 2 else groups[:1]


@dataclass(frozen=True)
class FigureKind:
    """A figure that can be drawn of a recording.

    Attributes:
        name: Its name, and the stem of its file.
        sentence: Its content.
        needs: Groups of channels; it requires one of each.
        draw: Function from runs, leg numbers and a layout to the figure.
        groups: Function from a number of legs to the legs of each figure.
        in_folder: It is a file of a run's folder.
        in_page: It is part of a run's page.
        several: It can compare runs.
        whole: It shows whole runs, others their last cycles.
    """

    name: str
    sentence: str
    needs: Needs
    draw: Draw
    groups: Callable[[int], list[Legs]] = lambda count: [tuple(range(1, count + 1))]
    in_folder: bool = False
    in_page: bool = True
    several: bool = True
    whole: bool = False


KINDS: tuple[FigureKind, ...] = (
    *(
        FigureKind(
            f"fig{number}",
            f"{words} over time, as the paper's Fig. {number}.",
            (quantity.channels,),
            partial(quantity_figure, quantity=quantity),
            groups,
            in_folder=True,
        )
        for number, words, quantity, groups in (
            (12, "Joint angles of the first legs", ANGLES, _all_angles),
            (13, "Joint torques of the first legs", TORQUES, lambda n: leg_groups(n)[:1]),
            (14, "Joint torques of the other legs", TORQUES, lambda n: leg_groups(n)[1:]),
            (15, "Normal forces on the first feet", FORCES, lambda n: leg_groups(n)[:1]),
            (16, "Normal forces on the other feet", FORCES, lambda n: leg_groups(n)[1:]),
        )
    ),
    *(
        FigureKind(
            name,
            f"{words} over time{kinds}.",
            (quantity.channels,),
            partial(quantity_figure, quantity=quantity),
            in_page=False,
        )
        for name, words, quantity, kinds in (
            ("joint-angle", "Joint angles of all legs", ANGLES, ""),
            ("joint-torque", "Joint torques of all legs", TORQUES, ", simulated and by the model"),
            ("normal-force", "Normal forces on all feet", FORCES, ", simulated and by the model"),
        )
    ),
    FigureKind(
        "gait-diagram",
        "Planned stance and recorded contact of each leg over time.",
        (("stance", "contact"),),
        time_figures.gait_diagram,
        several=False,
    ),
    FigureKind(
        "support-margin",
        "Distance of the centre of mass, seen from above, from the edge of the support polygon.",
        (("foot_position",), ("contact", "stance"), ("body_position",)),
        time_figures.support_figure,
    ),
    FigureKind(
        "servo-envelope",
        "Torque over speed of each joint, in the envelope of its servo.",
        TORQUE_AND_SPEED,
        path_figures.envelope_figure,
        several=False,
        whole=True,
    ),
    FigureKind(
        "friction-demand",
        "Tangential over normal force of each stance foot, against the coefficient of friction.",
        (("foot_force", "foot_force_model"), ("foot_position",), ("stance", "contact")),
        time_figures.friction_figure,
    ),
    FigureKind(
        "foot-path",
        "Foot paths in body axes and in the world, from above and from the side.",
        (("foot_position",), ("body_position",), ("body_orientation",)),
        path_figures.foot_path_figure,
        several=False,
    ),
    FigureKind(
        "power",
        "Power of all joints, the energy since the start, and the cost of transport.",
        TORQUE_AND_SPEED,
        time_figures.power_figure,
        whole=True,
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
        time_figures.sensor_figure,
        in_folder=True,
        several=False,
        whole=True,
    ),
    FigureKind(
        "walk",
        "The robot in mid-walk, the forces on its feet, and its gait.",
        POSE,
        walk_figure,
        in_page=False,
        several=False,
        whole=True,
    ),
)
"""All figures, in the order in which they are listed."""

CATALOGUE: dict[str, FigureKind] = {kind.name: kind for kind in KINDS}
"""All figures by their names."""


def find_figure(name: str) -> FigureKind:
    """Return the figure of a name; raise InvalidInput where there is none."""
    if name not in CATALOGUE:
        guess = nearest(name, CATALOGUE)
        hint = f'"{guess}"' if guess else f"one of {', '.join(CATALOGUE)}"
        raise InvalidInput(f'no figure "{name}".', hint=hint)
    return CATALOGUE[name]


def can_be_plotted(recording: Recording) -> list[FigureKind]:
    """Return the figures whose channels are recorded."""
    known = set(recording.data_vars)
    return [kind for kind in KINDS if all(known & set(group) for group in kind.needs)]


@checked
def plot(
    recordings: Recording | str | Path | Sequence[Recording | str | Path],
    name: str,
    *,
    legs: Sequence[int] | None = None,
    labels: Sequence[str] | None = None,
    width: float = NORMAL_WIDTH,
    title: bool = True,
) -> Figure:
    """Draw one figure of a recording, or of several that are compared.

    Args:
        recordings: A recording, or its file or folder; or a list of two to six of these.
        name: Name of the figure, such as ``"support-margin"``, listed by
            ``phasmid report --list-figures``.
        legs: Leg numbers, from 1; by default all legs of the figure.
        labels: Name of each run; by default its robot and gait.
        width: Width of the figure [m]; type keeps a legible size. A column of a paper has 0.085 m.
        title: Draw a title and a subtitle.

    Returns:
        A matplotlib figure; its ``savefig`` writes it.

    Raises:
        InvalidInput: There is no such figure or leg, a required channel is not recorded, or the
            width is out of range.
    """
    kind = find_figure(name)
    given = [recordings] if isinstance(recordings, str | Path | Mapping) else list(recordings)
    loaded = [load_recording(one) if isinstance(one, str | Path) else one for one in given]
    return draw_groups(gather(loaded, labels), kind, legs, Layout(width, title))[0]


def draw_groups(
    runs: Sequence[Run],
    kind: FigureKind,
    legs: Sequence[int] | None = None,
    layout: Layout = DEFAULT_LAYOUT,
) -> list[Figure]:
    """Draw all figures of one kind: one for each of its groups of legs.

    Args:
        runs: One, or several that are compared.
        kind: The kind of figure.
        legs: Leg numbers, from 1, of a single figure instead.
        layout: Width and heading.

    Raises:
        InvalidInput: A required channel is not recorded, there is no such leg, or the figure cannot
            compare runs.
    """
    check_figure(runs, kind)
    count = min(len(run.robot.legs) for run in runs)
    for leg in legs or ():
        if not 1 <= leg <= count:
            raise InvalidInput(f"there is no leg {leg}; legs are 1 to {count}.")
    groups = [tuple(legs)] if legs else kind.groups(count)
    parts, note = (runs, "") if kind.whole else shown_part(runs)
    layout = replace(layout, note=note)
    with styled(layout.type_scale):
        return [kind.draw(parts, group, layout) for group in groups]


def check_figure(runs: Sequence[Run], kind: FigureKind) -> None:
    """Raise InvalidInput for runs that a figure cannot show."""
    if len(runs) > 1 and not kind.several:
        raise InvalidInput(f"the figure {kind.name} shows one run; {len(runs)} were given.")
    for run in runs:
        with located(run.label if len(runs) > 1 else ""):
            for group in kind.needs:
                run.first_channel(group, f"the figure {kind.name}")


def figures(recording: Recording) -> dict[str, Figure]:
    """Draw every figure of a run's folder whose channels are recorded, by its file's stem.

    Returns:
        For a hexapod ``fig12`` to ``fig16``, as in the paper. Other numbers of legs take as many of
        a kind as groups of three legs: ``fig14b`` follows ``fig14``. With the servos' own law
        ``servo-duty``, ``servo-current`` and ``servo-temperature``, and ``sensors`` where sensors
        were recorded.
    """
    return {name: figure for name, _, figure in report_figures(recording, in_page=False)}


def report_figures(
    recording: Recording, *, in_page: bool = True
) -> Iterator[tuple[str, FigureKind, Figure]]:
    """Yield file stem, kind and figure of a run's folder, and of its page."""
    run = gather([recording])[0]
    for kind in can_be_plotted(run.recording):
        if kind.in_folder or (in_page and kind.in_page):
            for number, figure in enumerate(draw_groups([run], kind)):
                yield kind.name + suffix_of(number), kind, figure
