"""Run golden cases with the phasmid that this interpreter imports, and keep what they answer.

    python tests/golden/running.py RENAMED OUT DISTURBANCE NAME [NAME ...]

This file uses public functions of phasmid only, so it runs any version of phasmid. Cases and
answers use the names of the version for which the cases were written. A version with other names
lists them in its own ``renamed.toml``; see `Names`.
"""

from __future__ import annotations

import dataclasses
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import tempfile
import tomllib
import urllib.request
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from enum import Enum
from importlib import import_module
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent

Table = dict[str, Any]

NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?!\w)")
"""A number in a text file."""

DIFFERS_BY_ITSELF = re.compile(r"_version$|^versions|path$|folder$|_at$|wall")
"""Entries of a summary that differ between two equal versions."""

LONGEST = 300.0
"""Time limit of a command [s], for a machine that is busy."""


class Names:
    """Names of the cases and names of one version of phasmid.

    Each table of ``renamed.toml`` maps a name of the cases to a name of the version:
    ``functions`` (dotted, below ``phasmid``), ``commands``, ``options`` (of scenario, engine, task
    and command line, without dashes), ``values`` (of options, and names along a dimension),
    ``keys`` (of command files), ``channels``, ``dimensions``, ``summary`` (dotted), ``events``
    (parts of sentences), and ``places``: where a recording's attributes hold the events.
    """

    def __init__(self, file: Path | None = None) -> None:
        known = file is not None and file.is_file()
        self._tables: Table = tomllib.loads(file.read_text("utf-8")) if file and known else {}

    def to_version(self, kind: str, name: str) -> str:
        """Return the version's name of a name of the cases."""
        return str(self._tables.get(kind, {}).get(name, name))

    def from_version(self, kind: str, name: str) -> str:
        """Return the cases' name of a name of the version."""
        return {new: old for old, new in self._tables.get(kind, {}).items()}.get(name, name)

    def function(self, name: str) -> Any:
        """Return a public function or class of the version."""
        module, _, own = f"phasmid.{self.to_version('functions', name)}".rpartition(".")
        return getattr(import_module(module), own)

    def options(self, table: Table) -> Table:
        """Return options and their values in the version's words, tables within them too."""
        found: Table = {}
        for key, value in table.items():
            if isinstance(value, dict):
                value = self.options(value)
            elif isinstance(value, str):
                value = self.to_version("values", value)
            found[self.to_version("options", key)] = value
        return found

    def command_line(self, line: str) -> list[str]:
        """Return the words of a command line of the version."""
        command, *rest = shlex.split(line)
        words = [
            f"--{self.to_version('options', word[2:])}"
            if word.startswith("--")
            else self.to_version("values", word)
            for word in rest
        ]
        return [*self.to_version("commands", command).split(), *words]

    def command_file(self, text: str) -> str:
        """Return a file of commands with the version's keys."""
        for old, new in self._tables.get("keys", {}).items():
            text = re.sub(rf"\b{old}(?=\s*=|\]\])", new, text)
        return text

    def sentence(self, text: str) -> str:
        """Return an event's sentence in the words of the cases."""
        for old, new in self._tables.get("events", {}).items():
            text = text.replace(new, old)
        return text


@dataclasses.dataclass(frozen=True)
class Channel:
    """Numbers that a case answers.

    Attributes:
        dims: Names of the dimensions; ``time`` comes first where there is one.
        values: Real numbers.
        time: Times of the samples [s]; None for a channel without them.
    """

    dims: tuple[str, ...]
    values: np.ndarray
    time: np.ndarray | None = None


class Answers:
    """Channels and texts that a case answers, by name."""

    def __init__(self, names: Names | None = None) -> None:
        self.names = names or Names()
        self.channels: dict[str, Channel] = {}
        self.texts: dict[str, str] = {}

    def add_recording(self, name: str, recording: Any) -> None:
        """Add a recording's channels, coordinates, units and events."""
        renamed = self.names.from_version
        time = np.asarray(recording["time"].values, float) if "time" in recording else None
        for own in sorted(map(str, recording.variables)):
            variable = recording[own]
            label = f"{name}.{renamed('channels', own)}"
            if variable.dtype.kind not in "biuf":
                labels = [renamed("values", str(value)) for value in variable.values.ravel()]
                self.texts[label] = " ".join(labels)
                continue
            dims = tuple(renamed("dimensions", str(dim)) for dim in variable.dims)
            values = np.asarray(variable.values, float)
            self.channels[label] = Channel(dims, values, time if "time" in dims[:1] else None)
            self.texts[f"{label} unit"] = str(variable.attrs.get("units", ""))
        attribute, *keys = self.names.to_version("places", "events").split(".")
        events = json.loads(recording.attrs.get(attribute, "[]"))
        for key in keys:
            events = events[key]
        self.add_events(f"{name}.events", events)

    def add_events(self, label: str, events: list[Any]) -> None:
        """Add events, each a pair of time and sentence or a table that has both."""
        pairs = [(e["time"], e["text"]) if isinstance(e, dict) else e[:2] for e in events]
        if pairs:
            moments = np.array([moment for moment, _ in pairs], float)
            self.channels[label] = Channel(("event",), moments)
        self.texts[label] = "\n".join(self.names.sentence(text) for _, text in pairs)

    def add_structure(self, name: str, structure: Any) -> None:
        """Add the numbers and texts of mappings, sequences and dataclasses."""
        for path, value in _leaves(_plain(structure)):
            if DIFFERS_BY_ITSELF.search(path):
                continue
            label = f"{name}.{self.names.from_version('summary', path)}"
            numbers = _numbers(value)
            if path.endswith("events"):
                self.add_events(label, value)
            elif numbers is None or not numbers.size:
                self.texts[label] = self.names.sentence(str(value))
            else:
                self.channels[label] = Channel(("",) * numbers.ndim, numbers)

    def add_file(self, name: str, path: Path) -> None:
        """Add the numbers of a text file, and the text around them."""
        text = path.read_text("utf-8")
        self.texts[name] = NUMBER.sub("#", text)
        found = np.array([float(number) for number in NUMBER.findall(text)])
        self.channels[name] = Channel(("number",), found)

    def save(self, folder: Path) -> None:
        """Write all answers into a folder."""
        folder.mkdir(parents=True, exist_ok=True)
        arrays = {name: channel.values for name, channel in self.channels.items()}
        times = {name: c.time for name, c in self.channels.items() if c.time is not None}
        np.savez(folder / "values.npz", **arrays)  # type: ignore[arg-type]
        np.savez(folder / "times.npz", **times)  # type: ignore[arg-type]
        dims = {name: channel.dims for name, channel in self.channels.items()}
        text = json.dumps({"texts": self.texts, "dims": dims})
        (folder / "answers.json").write_text(text, "utf-8")

    @classmethod
    def load(cls, folder: Path) -> Answers:
        """Read what `save` wrote.

        Raises:
            FileNotFoundError: The case failed.
        """
        answers = cls()
        content = json.loads((folder / "answers.json").read_text("utf-8"))
        answers.texts = content["texts"]
        with np.load(folder / "values.npz") as values, np.load(folder / "times.npz") as times:
            for name, dims in content["dims"].items():
                time = times.get(name)
                answers.channels[name] = Channel(tuple(dims), values[name], time)
        return answers


def _plain(value: Any) -> Any:
    """Return dataclasses as mappings and tuples as lists, a servo by its name, without inputs."""
    kind = type(value).__name__
    if kind == "Servo":
        return value.name
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        inputs = {"Scenario", "Robot", "Experiment"}
        return {
            str(key): _plain(inner)
            for key, inner in value.items()
            if type(inner).__name__ not in inputs
        }
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    return value.value if isinstance(value, Enum) else value


def _leaves(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the dotted path and the value of every entry that is no table."""
    for key, value in table.items():
        path = f"{before}{key}"
        is_structure = isinstance(value, list) and not all(isinstance(v, str) for v in value)
        if is_structure and not path.endswith("events") and _numbers(value) is None:
            value = {str(number): inner for number, inner in enumerate(value)}
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{path}.")
        else:
            yield path, value


def _numbers(value: Any) -> np.ndarray | None:
    """Return numbers as an array, with NaN for an absent one; None for what has no numbers."""
    if isinstance(value, str) or value is None:
        return None
    try:
        return np.array(value, float)
    except (TypeError, ValueError):
        return None


# Cases --------------------------------------------------------------------------------------------


def case_names() -> list[str]:
    """Return the names of all cases."""
    return sorted(path.stem for path in (HERE / "cases").glob("*.toml"))


def load_case(name: str) -> Table:
    """Return the table of a case."""
    return tomllib.loads((HERE / "cases" / f"{name}.toml").read_text("utf-8"))


def is_smoke(name: str) -> bool:
    """Return whether only the names of a case's answers are compared, and its texts."""
    return load_case(name).get("compare") == "names"


class Run:
    """One case in a folder of its own.

    Args:
        case: Table of the case.
        folder: Folder to work in.
        names: Names of the version.
        disturbance: Added to the depth of the feet below the hips [m].
    """

    def __init__(
        self, case: Table, folder: Path, names: Names | None = None, disturbance: float = 0.0
    ) -> None:
        self.case, self.folder, self.disturbance = case, folder, disturbance
        self.names = names or Names()
        self.answers = Answers(self.names)
        for file in (HERE / "files").iterdir():
            text = file.read_text("utf-8")
            (folder / file.name).write_text(self.names.command_file(text), "utf-8")

    def answer(self) -> Answers:
        """Run the case, once for each combination of the options' values in ``vary``."""
        vary = self.case.get("vary", {})
        for values in product(*vary.values()):
            changes = dict(zip(vary, values, strict=True))
            part = "".join(f"{value}/" for value in values)
            getattr(self, self.case["run"])(part, self.case.get("scenario", {}) | changes)
        return self.answers

    def scenario(self, options: Table) -> Any:
        """Return the default scenario with other options; files are those of the case."""
        files = {
            key: str(self.folder / value)
            for key, value in options.items()
            if isinstance(value, str) and (self.folder / value).is_file()
        }
        options = self.names.options(options | files)
        scenario = self.names.function("load_scenario")().replace(**options)
        if self.disturbance:
            leg = self.robot(options).legs[0]
            depth = -float((leg.R_level_hip @ leg.neutral_foot)[2]) + self.disturbance
            scenario = scenario.replace(**{self.names.to_version("options", "body_height"): depth})
        return scenario

    def robot(self, options: Table) -> Any:
        """Return the robot that options name, or the default one."""
        robot = options.get("robot", "phantomx-paper")
        return self.names.function("load_robot")(robot) if isinstance(robot, str) else robot

    def keep_run(self, name: str, recording: Any) -> None:
        """Keep a recording and its summary."""
        self.answers.add_recording(name, recording)
        summary = self.names.function("summarise")(recording)
        self.answers.add_structure(f"{name} summary", summary)

    # Kinds of cases: what the key ``run`` names.

    def plan(self, part: str, options: Table) -> Any:
        """Plan and analyse a walk."""
        scenario = self.scenario(options)
        walk = self.names.function("plan")(scenario)
        self.answers.add_recording(f"{part}model", self.names.function("analyse")(scenario, walk))
        return scenario, walk

    def walk(self, part: str, options: Table) -> None:
        """Plan, analyse and simulate a walk."""
        scenario, walk = self.plan(part, options)
        self.keep_run(f"{part}run", self.names.function("simulate")(scenario, walk))

    def trajectory(self, part: str, options: Table) -> None:
        """Simulate joint angles from a file, which no disturbance changes."""
        self.disturbance = 0.0
        scenario = self.scenario(options)
        load = self.names.function("load_trajectory")
        motion = load(self.folder / self.case["file"], self.robot(options))
        self.keep_run(f"{part}run", self.names.function("simulate")(scenario, motion))

    def drive(self, part: str, options: Table) -> None:
        """Drive a robot by a file of commands, or by a function of time."""
        if "function" in self.case:
            commands = getattr(self, self.case["function"])
        else:
            load = self.names.function("control.load_script")
            commands = load(self.folder / self.case["commands"])
        faults = self.case.get("faults", ())
        scenario, controller = self.scenario(options), None
        if "engine" in self.case:
            engine = self.names.function("LocomotionEngine")
            controller = engine(self.robot(options), **self.names.options(self.case["engine"]))
        drive = self.names.function("drive")
        self.keep_run(f"{part}run", drive(scenario, controller, commands, faults=faults))

    def through_file(self, part: str, options: Table) -> None:
        """Write the robot in another format, read it back, and drive it."""
        load, save = self.names.function("load_robot"), self.names.function("save_robot")
        file = self.folder / self.case["file"]
        save(load(options["robot"]), file)
        self.answers.add_file(f"{part}{file.name}", file)
        self.drive(part, options | {"robot": load(file)})

    def advise(self, part: str, options: Table) -> None:
        """Advise on the servos of a walk, and on those of the catalogue in their place."""
        advice = self.names.function("advise")(self.scenario(options))
        # The loads in each posture are many, and behind these.
        names = "speed", "verdict", "currents", "supply"
        found = {name: getattr(advice, name) for name in names if hasattr(advice, name)}
        choices = {choice.servo.name: choice for choice in advice.choices}
        self.answers.add_structure(f"{part}advice", found | {"choices": choices})

    def learn(self, part: str, options: Table) -> None:
        """Step a batch of robots that are pushed, with actions that are functions of time."""
        settings = self.names.options(self.case["environment"])
        environment = self.names.function("learning.WalkVectorEnv")(**settings)
        observed, _ = environment.reset(seed=1)
        names = "observation", "reward", "fell", "over"
        rows: dict[str, list[np.ndarray]] = {name: [] for name in names}
        count = environment.single_action_space.shape[0]
        for step in range(self.case["steps"]):
            action = 0.3 * np.sin(0.2 * step + np.arange(count)) * np.ones((len(observed), 1))
            observed, *others, _ = environment.step(action.astype(np.float32))
            for name, values in zip(names, (observed, *others), strict=True):
                rows[name].append(np.array(values, float))
        for name, arrays in rows.items():
            values, time = np.array(arrays), np.arange(float(len(arrays)))
            dims = ("time", "robot", "entry")[: values.ndim]
            self.answers.channels[f"{part}{name}"] = Channel(dims, values, time)

    def command(self, part: str, options: Table) -> None:
        """Run command lines one after another, and keep the files that the case names."""
        del options
        for line in self.case["lines"]:
            self.answers.texts[f"{part}{line}"] = str(self.call(line))
        for name in self.case.get("files", ()):
            path = self.folder / name
            if path.suffix == ".json":
                self.answers.add_structure(f"{part}{name}", json.loads(path.read_text("utf-8")))
            elif path.suffix == ".nc":
                self.keep_run(f"{part}{name}", self.names.function("load_recording")(path))
            else:
                self.answers.add_file(f"{part}{name}", path)

    def page(self, part: str, options: Table) -> None:
        """Open the live page, ask for it once, and stop it by Ctrl-C."""
        del options
        process = subprocess.Popen(
            self._words(self.case["lines"][0]), cwd=self.folder, stdout=subprocess.PIPE, text=True
        )
        assert process.stdout is not None
        addresses = (re.search(r"http://\S+", line) for line in process.stdout)
        browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
        try:
            address = next(filter(None, addresses))[0]
            with browser.open(address, timeout=LONGEST) as page:
                self.answers.texts[f"{part}page"] = str(page.status)
        finally:
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=LONGEST)
        self.answers.texts[f"{part}status"] = str(process.returncode)

    def call(self, line: str) -> int:
        """Run a command line, and return its exit status."""
        words = self._words(line)
        done = subprocess.run(
            words, cwd=self.folder, capture_output=True, text=True, timeout=LONGEST, check=False
        )
        if done.returncode:
            print(done.stderr, file=sys.stderr)
        return done.returncode

    def _words(self, line: str) -> list[str]:
        """Return the words of a command line; the disturbance adds to a length in braces [mm]."""

        def disturbed(length: re.Match[str]) -> str:
            return f"{float(length[1]) + 1000 * self.disturbance:.15g}"

        line = re.sub(r"\{([\d.]+)\}", disturbed, line)
        return [sys.executable, "-m", "phasmid", *self.names.command_line(line)]

    # Commands that are functions of time.

    def winding(self, time: float, observation: Any) -> Any:
        """Return a velocity that changes at every update."""
        del observation
        velocity = 0.05 * np.sin(time), 0.03 * np.cos(time), 0.1
        return self.names.function("control.Command")(velocity=velocity)


def answer(name: str, renamed: Path | None = None, disturbance: float = 0.0) -> Answers:
    """Run a case in a temporary folder."""
    with tempfile.TemporaryDirectory() as folder:
        return Run(load_case(name), Path(folder), Names(renamed), disturbance).answer()


def answer_into(name: str, renamed: Path, out: Path, disturbance: float) -> str:
    """Run a case and save its answers; return why there are none."""
    try:
        answer(name, renamed, disturbance).save(out / name)
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return ""


def main() -> int:
    """Run cases side by side, one a core, and save their answers."""
    renamed, out, disturbance, *names = sys.argv[1:]
    # Each run has one core; threads of linear algebra would occupy the others.
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    failed = 0
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        arguments = Path(renamed), Path(out), float(disturbance)
        runs = {name: pool.submit(answer_into, name, *arguments) for name in names}
        for name, future in runs.items():
            if why := future.result():
                failed += 1
                print(f"{name}: {why}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
