"""Log of a drive on a bus: a recording that is written as the robot moves."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from phasmid.experiment import Experiment
from phasmid.experiment.ending import Ending, Failure
from phasmid.forces.analysis import recording_attributes
from phasmid.recording.channels import CHANNELS
from phasmid.recording.file import check_place
from phasmid.recording.log import RecordingLog, check_log
from phasmid.recording.provenance import ending_attributes, versions
from phasmid.recording.recording import Attributes
from phasmid.simulation.start import standing

INTERVAL = 0.2
"""Time between writes [s]: what a killed process loses at most."""

LONGEST_START, LONGEST_WALK = 120.0, 3600.0
"""Time for which room on the disk is needed beside that of the walk, and for a walk without end
[s]."""

LEG_BYTES = 300.0
"""Size of a leg's part of a sample on the disk [bytes]: 250 on a hexapod."""

Watch = Callable[[np.ndarray, Mapping[str, np.ndarray]], None]
"""Receives the time [s] and the channels of a sample, one row each."""


class DriveLog:
    """Log of a drive, to be closed.

    Args:
        path: The file; None: there is none.
        experiment: Experiment of the robot.
        period: Time between samples [s].
        duration: Time for which the robot will walk [s].
        force: Whether an older file is replaced.
        watch: Receives each sample, too.

    Raises:
        InvalidInput: The file exists and may not be replaced.
        OutputError: It cannot be written, or its disk has no room for it.
    """

    def __init__(
        self,
        path: str | Path | None,
        experiment: Experiment,
        period: float,
        *,
        duration: float,
        force: bool = False,
        watch: Watch | None = None,
    ) -> None:
        self._path = None if path is None else Path(path)
        self._experiment, self._period, self._force, self._watch = experiment, period, force, watch
        self._planned = np.arange(0.0, min(duration, LONGEST_WALK) + LONGEST_START, period)
        self._times: list[float] = []
        self._rows: list[dict[str, np.ndarray]] = []
        self._file: RecordingLog | None = None
        self._stack = ExitStack()
        if self._path is not None:
            legs = len(experiment.robot.legs)
            check_log(self._path, force=force)
            check_place(self._path, room=LEG_BYTES * legs * len(self._planned))
            # What takes time is done before the robot moves.
            import mcap.writer  # noqa: F401

            self._attributes = self._first_attributes()

    def close(self) -> None:
        """Close the file."""
        self._stack.close()

    def append(self, time: float, channels: Mapping[str, Any]) -> None:
        """Add a sample; the names are those of the first one.

        Raises:
            OutputError: It cannot be written.
        """
        self._times.append(time)
        self._rows.append(
            {
                name: np.array(value, bool if CHANNELS[name].kind == "bool" else float)
                for name, value in channels.items()
            }
        )
        if self._watch is not None:
            self._watch(
                np.array([time]), {name: array[None] for name, array in self._rows[-1].items()}
            )
        if len(self._rows) * self._period >= INTERVAL:
            self._write()

    def finish(self, ending: Failure | None, events: list[tuple[float, str]]) -> None:
        """Write the last samples, how the drive ended, and its events: times [s] and sentences.

        Raises:
            OutputError: It cannot be written.
        """
        self._write()
        if self._file is not None:
            rows = [[round(time, 3), sentence] for time, sentence in events]
            text = json.dumps(rows, ensure_ascii=False)
            self._file.finish({**ending_attributes(ending), "events": text})

    def _write(self) -> None:
        """Write the samples that were not written yet."""
        if not self._rows:
            return
        time = np.array(self._times)
        channels = {name: np.stack([row[name] for row in self._rows]) for name in self._rows[0]}
        self._times, self._rows = [], []
        if self._path is not None and self._file is None:
            file = RecordingLog(
                self._path, channels, self._attributes, time=self._planned, force=self._force
            )
            self._file = self._stack.enter_context(file)
        if self._file is not None:
            self._file.append(time, channels)

    def _first_attributes(self) -> Attributes:
        """Return the attributes of a log that may be cut off."""
        motion = standing(self._experiment)
        return {
            **recording_attributes(self._experiment, motion),
            **versions(),
            **ending_attributes(Failure(Ending.CUT, 0, "")),
            "kind": "robot",
            "drive": "servo",
            "control_rate": 1 / self._period,
        }
