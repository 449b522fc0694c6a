"""What the live robot did, kept: a log while it goes on, then a run's folder by another process."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import re
import secrets
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from phasmid.errors import InvalidInput, OutputError
from phasmid.recording import RecordingLog
from phasmid.robot import preset_names
from phasmid.robot.appearance import glb
from phasmid.scenario import scenario_to_toml
from phasmid.simulation.channels import ending_attributes
from phasmid.simulation.termination import Ending, Failure
from phasmid.studio.live import LiveRobot
from phasmid.studio.setting import Setting

LONGEST = 600.0
"""A recording ends by itself after as long [s]."""

SHORTEST = 0.1
"""A recording that is shorter has nothing to report [s]."""

MOST_JOBS = 2
"""Most folders that are written at a time."""

NICENESS = 10
"""Of those who write: the live robot goes first."""

PATIENCE = 5.0
"""Time in which a writer that is asked to end must have done so [s]."""

ALONE = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
"""Environment of a writer, which leaves all cores but one to the live robot."""

MOST_EVENTS = 10_000
"""Most sentences that a recording keeps."""

CUT_OFF = {"ending": Ending.CUT.name, "ending_reason": Ending.CUT.value}
"""What a recording says of its end for as long as it has none."""

# A terminal's Ctrl-C is for the studio, which ends its writers itself; Windows, which knows no
# sessions, has groups, and such a group hears of Ctrl-Break alone.
IS_WINDOWS = sys.platform == "win32"
NEW_GROUP = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
INTERRUPT: int = getattr(signal, "CTRL_BREAK_EVENT", signal.SIGINT)


def walked_name(setting: Setting) -> str:
    """Name a run by its robot, gait, terrain and drive.

    Args:
        setting: As it is when the run ends; the gait may have changed meanwhile.
    """
    parts = (setting.robot_name, setting.gait.name, setting.terrain_name)
    words = [Path(part).stem for part in parts] + [str(setting.scenario.simulation.drive)]
    # A scenario's name has at most 64 characters, and a number may follow.
    return re.sub(r"[^A-Za-z0-9._-]+", "-", "-".join(words)).strip("-._")[:56] or "walk"


@dataclass(frozen=True)
class Saved:
    """A recording that was written, or could not be.

    Attributes:
        run: Its id.
        sentence: What became of it.
        whole: Whether its folder is there.
    """

    run: str
    sentence: str
    whole: bool


@dataclass
class _Job:
    run: str
    folder: Path
    process: subprocess.Popen[bytes]
    complaint: IO[bytes]
    log: Path


class Recorder:
    """Records a live robot at a time, and has the folders of finished recordings written.

    Args:
        out: Folder of all runs.

    Attributes:
        run: Id of the recording that goes on; empty where none does.
    """

    def __init__(self, out: Path) -> None:
        self._out = out
        self.run = ""
        self.failure = ""
        self._log: RecordingLog | None = None
        self._live: LiveRobot | None = None
        self._done, self._interval, self._begin = 0, 0.001, 0.0
        self._events: list[tuple[float, str]] = []
        self._jobs: list[_Job] = []
        self._saved: dict[str, Path] = {}

    @property
    def seconds(self) -> float:
        """Length of the recording that goes on [s]."""
        return self._done * self._interval

    @property
    def is_full(self) -> bool:
        """Whether the recording is as long as one may be."""
        return bool(self.run) and self.seconds >= LONGEST

    @property
    def is_writing(self) -> bool:
        """Whether folders are being written."""
        return bool(self._jobs)

    def begin(self, live: LiveRobot) -> str:
        """Record from now on.

        Args:
            live: The robot.

        Returns:
            The id of the run.

        Raises:
            InvalidInput: A recording goes on.
            InvalidInput: Others are still being written.
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
            reason = (error.strerror or str(error)).lower()
            raise OutputError(f"cannot write {self._out}: {reason}.") from None
        run = f"r-{secrets.token_hex(2)}"
        while any(self._out.glob(f"{run}*")):
            run = f"r-{secrets.token_hex(2)}"
        self.run, self._live, self._log = run, live, None
        self._done, self._interval = 0, live.run.every * live.run.dt
        self._begin, self.failure, self._events = live.now, "", []
        live.recorder = self._take
        return run

    def note(self, events: Sequence[tuple[float, str]]) -> None:
        """Keep sentences.

        Args:
            events: Times of the robot [s] and sentences.
        """
        room = MOST_EVENTS - len(self._events)
        self._events += [(time - self._begin, text) for time, text in events[:room]]

    def _take(self, time: np.ndarray, channels: dict[str, np.ndarray]) -> None:
        """Append samples; a disk that is full ends the recording, not the robot."""
        if self.failure:
            return
        try:
            if self._log is None:
                self._log = self._open(channels)
            own = np.arange(self._done, self._done + len(time)) * self._interval
            self._log.append(own, channels)
        except OutputError as error:
            self.failure = error.what
            return
        self._done += len(time)

    def _open(self, first: dict[str, np.ndarray]) -> RecordingLog:
        assert self._live is not None
        live = self._live
        said = {**live.driving.attributes(live.run), **CUT_OFF}
        # A block or two more than fits: its last samples come together.
        time = np.arange(round(LONGEST / self._interval) + 2 * live.run.block_steps)
        log = RecordingLog(self._path(self.run), first, said, time=time * self._interval)
        return log.__enter__()

    def _path(self, run: str) -> Path:
        return self._out / f"{run}-log" / f"{run}.rec"

    def end(self, trouble: Failure | None, *, cut: bool = False) -> str:
        """End the recording; its folder is written in a process of its own.

        Args:
            trouble: What ended the robot's run; None where it goes on.
            cut: Whether it is cut off: its log stays, which says so, and no folder is written.

        Returns:
            What became of it, where nothing can be written; else nothing.
        """
        log, live, run = self._log, self._live, self.run
        assert live is not None
        live.recorder = None
        self.run, self._log, self._live = "", None, None
        if log is None or self.seconds < SHORTEST:
            if log is not None:
                log.__exit__(None, None, None)
                shutil.rmtree(self._path(run).parent, ignore_errors=True)
            return self.failure or f"the recording has less than {SHORTEST:g} s; it was not kept."
        folder = self._free(walked_name(live.setting))
        scenario = live.setting.machine.replace(duration=self.seconds, name=folder.name)
        said: dict[str, Any] = {
            **(CUT_OFF if cut else ending_attributes(trouble)),
            "events": json.dumps(self._events, ensure_ascii=False),
            # Gait and stride as they were at last: they may have changed meanwhile.
            "scenario": scenario_to_toml(scenario, "robot.toml"),
        }
        try:
            log.finish(said)
            log.__exit__(None, None, None)
            look = live.source.robot.appearance
            if look is not None and look.name.removesuffix(".glb") not in preset_names():
                (self._path(run).parent / Path(look.name).name).write_bytes(glb(look.parts))
        except OutputError as error:
            self.failure = error.what
        except OSError as error:
            self.failure = f"cannot write {self._path(run)}: {(error.strerror or '').lower()}."
        if not cut:
            self._write(run, folder)
        return self.failure

    def _free(self, name: str) -> Path:
        """The folder of this name, with a number where it is taken or being written."""
        taken = {job.folder for job in self._jobs}
        names = itertools.chain((name,), (f"{name}-{number}" for number in itertools.count(2)))
        folders = (self._out / one for one in names)
        return next(folder for folder in folders if folder not in taken and not folder.exists())

    def _write(self, run: str, folder: Path) -> None:
        """Have a run's folder written."""
        log = self._path(run)
        complaint = tempfile.TemporaryFile()  # noqa: SIM115, it is read when the process ends
        command = [sys.executable, "-m", "phasmid", "report", str(log), "--quiet"]
        process = subprocess.Popen(  # noqa: S603, our own words and paths
            [*command, "--out", str(folder)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=complaint,
            start_new_session=not IS_WINDOWS,
            creationflags=NEW_GROUP,
            env={**os.environ, **ALONE},
        )
        with contextlib.suppress(OSError, AttributeError):
            os.setpriority(os.PRIO_PROCESS, process.pid, NICENESS)
        self._jobs.append(_Job(run, folder, process, complaint, log))

    def look(self) -> list[Saved]:
        """Those that were finished since it was asked last."""
        found = []
        for job in [job for job in self._jobs if job.process.poll() is not None]:
            self._jobs.remove(job)
            folder = job.folder
            job.complaint.seek(0)
            told = job.complaint.read(4096).decode(errors="replace").strip().splitlines()
            job.complaint.close()
            if job.process.returncode == 0 and (folder / "report.html").exists():
                self._saved[job.run] = folder
                shutil.rmtree(job.log.parent, ignore_errors=True)
                found.append(Saved(job.run, f"saved as {folder}", True))
                continue
            why = told[-1].removeprefix("phasmid: ") if told else "its report came to no end."
            sentence = f"the recording {job.run} stays in {job.log}: {why}"
            found.append(Saved(job.run, sentence, False))
        return found

    def folder(self, run: str) -> Path | None:
        """Folder of a run that was saved; None where there is none of this id."""
        return self._saved.get(run) if re.fullmatch(r"r-[0-9a-f]{4}", run) else None

    def close(self) -> None:
        """End what goes on; logs of what was not written stay, and can be read."""
        if self.run:
            self.end(None, cut=True)
        for job in self._jobs:
            # As by Ctrl-C, so that it leaves no half of a folder.
            job.process.send_signal(INTERRUPT)
        for job in self._jobs:
            try:
                job.process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                job.process.kill()
                job.process.wait()
            job.complaint.close()
        self._jobs.clear()
