"""Verdicts beside simulated walks: the tables, output and figure of docs/holding.md.

Takes a few seconds; the first time kernels are compiled.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

import phasmid
from phasmid.advice import Advice
from phasmid.advice.answer import margin_words
from phasmid.advice.supply import wire_resistance
from phasmid.cli import main as command
from phasmid.reporting.advice_figure import advice_figure
from phasmid.reporting.style import save_figure
from phasmid.scenario import Scenario

DOCS = Path(__file__).parents[2] / "docs"
PAGE, ROBOT_PAGE = DOCS / "holding.md", DOCS / "your-robot.md"
ROBOT = "mine.toml"
PRESETS = "phantomx-ax", "phantomx-paper", "phantomx-mk4", "quadruped", "octopod"
SERVOS = "AX-12A", "XL430-W250", "MG996R", "LX-16A", "STS3215"
"""Servos on the robot of docs/your-robot.md."""

CYCLES = 3
"""Simulated cycles; the first one, in which the robot settles, does not count."""

FILTERED = 0.1
"""Part of a stance over which simulated torques and currents are averaged, as in tests/advice."""

CHAINS = 1, 2, 3, 4, 6, 9, 18
"""Servos of a chain."""

CHAIN_CURRENTS = 0.15, 0.5, 1.5
"""Currents of each servo [A]: a walk, a lift, the stall of an AX-12A."""

CHAIN_AREA, CHAIN_LENGTH = 0.2e-6, 0.15
"""Supply wires of a chain's cables [m²], AWG 24, and the length of each [m]."""

PIXELS_PER_INCH = 110
COLUMNS = 80

Pair = tuple[float, float]


@dataclass(frozen=True)
class Simulated:
    """What a simulated walk shows.

    Attributes:
        share: Largest share of a joint's stall torque.
        mean: Mean current of all servos [A].
        largest: Largest current of all servos [A].
        ending: How it ended.
    """

    share: float
    mean: float
    largest: float
    ending: str


@dataclass(frozen=True)
class Case:
    """A robot on servos.

    Attributes:
        name: Name of the robot.
        scenario: Its walk.
    """

    name: str
    scenario: Scenario

    @cached_property
    def advice(self) -> Advice:
        """Advice on its servos."""
        return phasmid.advise(self.scenario)

    @cached_property
    def simulated(self) -> Simulated:
        """The same walk with the drive `servo`."""
        period = self.scenario.build().course.stride.period
        experiment = self.scenario.replace(drive="servo", duration=CYCLES * period).build()
        run = phasmid.simulate(experiment, phasmid.plan(experiment))
        time = run.time.values
        robot, duty = experiment.robot, experiment.course.gait.duty_factor
        window = max(round(FILTERED * duty * period / (time[1] - time[0])), 1)
        counts = slice(np.searchsorted(time, period), len(time) - window)

        def filtered(values: np.ndarray) -> np.ndarray:
            kernel = np.ones(window) / window
            return np.apply_along_axis(np.convolve, 0, values, kernel, "same")[counts]

        torque = np.abs(filtered(run.joint_torque.values.reshape(len(time), -1)))
        drawn = np.maximum(run.servo_duty * run.servo_current, 0.0).values.sum(axis=(1, 2))
        current = drawn + robot.arrays.strength.size * robot.servo.standby_current
        return Simulated(
            share=float((torque / robot.arrays.stall_torque.ravel()).max()),
            mean=float(current[counts].mean()),
            largest=float(filtered(current).max()),
            ending=str(run.attrs["ending"]),
        )


def robot_text() -> str:
    """Return the robot file of docs/your-robot.md."""
    return re.findall(r"```toml\n(.*?)```", ROBOT_PAGE.read_text("utf-8"), re.DOTALL)[0]


@contextlib.contextmanager
def in_folder_of_robot() -> Iterator[None]:
    """Work in a folder that contains the robot file, as the page's reader does."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path(ROBOT).write_text(robot_text(), "utf-8")
        yield


def cases() -> list[Case]:
    """Return the cases of the tables; needs the folder of the robot file."""
    presets = [Case(f"`{name}`", Scenario(robot=name)) for name in PRESETS]
    mine = Scenario(robot=ROBOT)
    quick = Case(f"`{ROBOT}`, 80 mm/s", mine.replace(servo=SERVOS[-1], period=1.0))
    return [
        *presets,
        *(Case(f"`{ROBOT}`", mine.replace(servo=servo)) for servo in SERVOS),
        quick,
    ]


class Terminal(io.StringIO):
    """A terminal, in which lines are broken."""

    def isatty(self) -> bool:
        """It is one."""
        return True


def output(*arguments: str) -> str:
    """Return a command with what it prints in a terminal of `COLUMNS`, as a block."""
    text = Terminal()
    os.environ["COLUMNS"] = str(COLUMNS)
    with contextlib.redirect_stdout(text):
        command(list(arguments))
    return f"```\n$ phasmid {' '.join(arguments)}\n{text.getvalue().strip()}\n```"


def verdicts(chosen: Sequence[Case]) -> str:
    """Return the table of verdicts."""
    rows = [
        "| robot | servo | share of stall | least friction | margin | decides | °C after 1 h |",
        "|---|---|---|---|---|---|---|",
    ]
    for case in chosen:
        found = case.advice.verdict
        hour = found.hour_temperature
        cells = [
            case.name,
            found.servo,
            f"{_range(_percent(found.peak_share))} %",
            f"{found.least_friction:.2g}",
            f"{margin_words(found.margin)}, {found.grade.value}",
            found.deciding,
            "unknown" if hour is None else _range(hour),
        ]
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows)


def walks(chosen: Sequence[Case]) -> str:
    """Return the table of simulated walks beside the bounds."""
    rows = [
        "| robot | servo | share of stall [%] | simulated | mean current [A] | simulated "
        "| largest current [A] | simulated | ending |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for case in chosen:
        advice, walk = case.advice, case.simulated
        current = advice.currents
        assert current is not None
        cells = [
            case.name,
            advice.verdict.servo,
            _range(_percent(advice.verdict.peak_share)),
            f"{100 * walk.share:.0f}",
            _range(current.mean, ".1f"),
            f"{walk.mean:.1f}",
            _range(current.walking, ".1f"),
            f"{walk.largest:.1f}",
            walk.ending.lower(),
        ]
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows)


def chains() -> str:
    """Return the table of the voltage that daisy chains lose."""
    rows = [
        "| servos of the chain | "
        + " | ".join(f"{current:g} A each" for current in CHAIN_CURRENTS)
        + " |",
        "|---:|" + "---:|" * len(CHAIN_CURRENTS),
    ]
    for servos in CHAINS:
        lost = (chain_drop(servos, each, CHAIN_AREA, CHAIN_LENGTH) for each in CHAIN_CURRENTS)
        rows.append(f"| {servos} | " + " | ".join(f"{each:.2f} V" for each in lost) + " |")
    return "\n".join(rows)


def chain_drop(servos: int, current: float, area: float, length: float) -> float:
    """Return the voltage that a daisy chain loses up to its last servo [V].

    Args:
        servos: Servos on the chain, with a cable of one length before each.
        current: Of each servo [A].
        area: Cross-section of the cable's supply wires [m²].
        length: Length of each cable [m].
    """
    return wire_resistance(length, area) * current * servos * (servos + 1) / 2


def outside(chosen: Sequence[Case]) -> list[str]:
    """Return what simulated walks show beyond the bounds of their verdicts."""
    found = []
    for case in chosen:
        current = case.advice.currents
        assert current is not None
        for what, (high, low), value in (
            ("share", case.advice.verdict.peak_share, case.simulated.share),
            ("mean current", current.mean, case.simulated.mean),
            ("largest current", current.walking, case.simulated.largest),
        ):
            if not low <= value <= high:
                servo = case.advice.verdict.servo
                found.append(
                    f"{case.name} {servo}: {what} {value:.3g}, not {low:.3g} to {high:.3g}"
                )
    return found


def _percent(pair: Pair) -> Pair:
    return 100 * pair[0], 100 * pair[1]


def _range(pair: Pair, style: str = ".0f") -> str:
    """Return bounds, the lower first."""
    high, low = (format(each, style) for each in pair)
    return low if low == high else f"{low} to {high}"


def replaced(text: str, block: str, lines: int = 1) -> str:
    """Return a page with the block that begins with the same lines replaced."""
    start = text.index("\n".join(block.split("\n")[:lines]))
    end = "\n```" if block.startswith("```") else "\n\n"
    stop = text.index(end, start + 3) + (len(end) if block.startswith("```") else 0)
    return text[:start] + block + text[stop:]


def main() -> None:
    """Write tables and figure."""
    text = PAGE.read_text("utf-8")
    with in_folder_of_robot():
        chosen = cases()
        text = replaced(text, output("advise", "--robot", ROBOT), lines=2)
        for table in (verdicts(chosen), walks(chosen), chains()):
            text = replaced(text, table)
        figure = advice_figure(phasmid.advise(Scenario(robot=ROBOT)))
        save_figure(figure, DOCS / "images" / "advice.png", dpi=PIXELS_PER_INCH)
        for line in outside(chosen):
            print(line)
    PAGE.write_text(text, "utf-8", newline="\n")
