"""Recordings of the live robot: a log while it goes on, then a run's folder by another process."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import re
import secrets
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from phasmid.errors import InvalidInput, OutputError
from phasmid.experiment.ending import Ending, Failure
from phasmid.recording import RecordingLog
from phasmid.recording.file import cannot_write
from phasmid.recording.provenance import ending_attributes
from phasmid.robot import preset_names
from phasmid.robot.glb import glb
from phasmid.scenario import scenario_to_toml
from phasmid.studio.live import LiveRobot
from phasmid.studio.setting import Setting

LONGEST = 600.0
"""Longest recording [s]."""

MOST_JOBS = 2
"""Most folders that are written at a time."""

LONGEST_END = 2.0
"""Longest time in which a writer ends that is told to, and removes what it wrote [s]."""

NICENESS = 10
"""Niceness of the writers: the live robot goes first."""

CUT_OFF = {"ending": Ending.CUT.name, "ending_reason": Ending.CUT.value}
"""End of a recording that was not finished."""

# A terminal's Ctrl-C must reach the studio only, which ends its writers itself. Windows has no
# sessions; there a process group does this.
NEW_GROUP = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)


def run_name(setting: Setting) -> str:
    """Name a run by its robot, gait, terrain and drive."""
    parts = (setting.robot_name, setting.gait.name, setting.terrain_name)
    words = [Path(part).stem for part in parts] + [str(setting.scenario.simulation.drive)]
    # A scenario's name has at most 64 characters, and a number may follow.
    return re.sub(r"[^A-Za-z0-9._-]+", "-", "-".join(words)).strip("-._")[:56] or "walk"


class _Job(NamedTuple):
    run: str
    folder: Path
    log: Path
    process: subprocess.Popen[str]


class Recorder:
    """Recorder of one live robot at a time.

    Args:
        out: Folder of all runs.

    Attributes:
        run: Id of the present recording; empty if there is none.
        failure: Reason why it cannot be written.
    """

    def __init__(self, out: Path) -> None:
        self._out = out
        self.run, self.failure = "", ""
        self._log: RecordingLog
        self._live: LiveRobot
        self._samples, self._interval, self._begin = 0, 0.0, 0.0
        self._events: list[tuple[float, str]] = []
        self._jobs: list[_Job] = []
        self._saved: dict[str, Path] = {}

    @property
    def seconds(self) -> float:
        """Length of the present recording [s]."""
        return self._samples * self._interval

    @property
    def is_full(self) -> bool:
        """True if the present recording has its greatest length."""
        return bool(self.run) and self.seconds >= LONGEST

    def begin(self, live: LiveRobot) -> str:
        """Start recording.

        Returns:
            Id of the recording.

        Raises:
            InvalidInput: A recording goes on, or others are still being written.
            OutputError: The folder cannot be made.
        """
        if self.run:
            raise InvalidInput("a recording goes on; it must end before the next one.")
        if len(self._jobs) >= MOST_JOBS:
            raise InvalidInput(
                f"{MOST_JOBS} recordings are still being written.", hint="wait until one is done"
            )
        try:
            self._out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise cannot_write(self._out, error) from None
        run = f"r-{secrets.token_hex(2)}"
        while any(self._out.glob(f"{run}*")):
            run = f"r-{secrets.token_hex(2)}"
        interval = live.run.every * live.run.dt
        # Two blocks more than fits: the last samples come together.
        time = np.arange(round(LONGEST / interval) + 2 * live.run.block_steps) * interval
        attributes = {**live.run.attributes(), **CUT_OFF}
        first = live.run.channels(live.sample)
        self._log = RecordingLog(self._path(run), first, attributes, time=time)
        self.run, self._live, self.failure = run, live, ""
        self._samples, self._interval, self._begin, self._events = 0, interval, live.now, []
        live.recorder = self._take
        return run

    def add_event(self, time: float, text: str) -> None:
        """Add a sentence at a simulated time [s]."""
        if self.run:
            self._events.append((time - self._begin, text))

    def _take(self, _: np.ndarray, channels: dict[str, np.ndarray]) -> None:
        """Append samples; a full disk ends the recording, not the robot."""
        if self.failure:
            return
        count = len(next(iter(channels.values())))
        try:
            time = np.arange(self._samples, self._samples + count) * self._interval
            self._log.append(time, channels)
        except OutputError as error:
            self.failure = error.what
            return
        self._samples += count

    def _path(self, run: str) -> Path:
        return self._out / f"{run}-log" / f"{run}.mcap"

    def end(self, failure: Failure | None, *, cut: bool = False) -> str:
        """End the recording; another process writes its folder.

        Args:
            failure: Cause of the end of the robot's run; None if it goes on.
            cut: Leave the log, marked as cut off, and write no folder.

        Returns:
            Reason why nothing is written; empty on success.
        """
        log, live, run = self._log, self._live, self.run
        live.recorder, self.run = None, ""
        if not self._samples:
            return self.failure or "the recording has no sample; it was not kept."
        folder = self._free_folder(run_name(live.setting))
        scenario = live.setting.scenario.replace(duration=self.seconds, name=folder.name)
        attributes: dict[str, Any] = {
            **(CUT_OFF if cut else ending_attributes(failure)),
            "events": json.dumps(self._events, ensure_ascii=False),
            # The last gait and stride: they may have changed meanwhile.
            "scenario": scenario_to_toml(scenario, "robot.toml"),
        }
        try:
            with log:
                log.finish(attributes)
            look = live.source.robot.appearance
            if look is not None and look.name.removesuffix(".glb") not in preset_names():
                (self._path(run).parent / Path(look.name).name).write_bytes(glb(look.parts))
        except OutputError as error:
            self.failure = error.what
        except OSError as error:
            self.failure = cannot_write(self._path(run), error).what
        if not cut:
            self._write(run, folder)
        return self.failure

    def _free_folder(self, name: str) -> Path:
        """Return the folder of this name, with a number if it is taken."""
        taken = {job.folder for job in self._jobs}
        names = itertools.chain((name,), (f"{name}-{number}" for number in itertools.count(2)))
        folders = (self._out / one for one in names)
        return next(folder for folder in folders if folder not in taken and not folder.exists())

    def _write(self, run: str, folder: Path) -> None:
        """Start the writer of a run's folder."""
        log = self._path(run)
        command = [sys.executable, "-m", "phasmid", "report", str(log), "--quiet"]
        process = subprocess.Popen(  # noqa: S603, our own words and paths
            [*command, "--out", str(folder)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            start_new_session=not NEW_GROUP,
            creationflags=NEW_GROUP,
            env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        )
        with contextlib.suppress(OSError, AttributeError):
            os.setpriority(os.PRIO_PROCESS, process.pid, NICENESS)
        self._jobs.append(_Job(run, folder, log, process))

    def finished(self) -> list[tuple[str, str]]:
        """Return sentences on writers that ended since the last call, with the ids of their runs.

        The id of a run whose folder is not written is empty.
        """
        results = []
        for job in [job for job in self._jobs if job.process.poll() is not None]:
            self._jobs.remove(job)
            lines = job.process.communicate()[1].strip().splitlines()
            if job.process.returncode == 0:
                self._saved[job.run] = job.folder
                shutil.rmtree(job.log.parent, ignore_errors=True)
                results.append((f"saved as {job.folder}", job.run))
                continue
            why = lines[-1].removeprefix("phasmid: ") if lines else "its report came to no end."
            results.append((f"the recording {job.run} stays in {job.log}: {why}", ""))
        return results

    def folder(self, run: str) -> Path | None:
        """Return the folder of a saved run; None for an unknown id."""
        return self._saved.get(run)

    def close(self, *, finish: bool = True) -> None:
        """End recording and writers; the logs of unwritten runs stay readable.

        Args:
            finish: Mark the end of the present log; not while it may still be written.
        """
        if self.run and finish:
            self.end(None, cut=True)
        for job in self._jobs:
            job.process.terminate()
        for job in self._jobs:
            try:
                job.process.communicate(timeout=LONGEST_END)
            except subprocess.TimeoutExpired:
                job.process.kill()
                job.process.communicate()
        self._jobs.clear()
