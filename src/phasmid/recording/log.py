"""Logs: recordings written during a run."""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
import threading
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, OutputError
from phasmid.recording.file import sync_folder
from phasmid.recording.frames import frame, header, json_frame, opening, payload, sample_size
from phasmid.recording.recording import Attributes

SYNC_INTERVAL = 0.5
"""Interval at which a log is forced to the disk [s]."""


class RecordingLog:
    """Log of a run.

    The file appears under its name with its first samples. Appended samples survive the process at
    once, and a power failure as soon as they are acknowledged.

    Attributes:
        path: The file.
        acknowledged: Number of samples forced to the disk.
    """

    def __init__(
        self,
        path: str | Path,
        first: Mapping[str, np.ndarray],
        attributes: Attributes,
        *,
        time: Float[np.ndarray, " time"],
        force: bool = False,
    ) -> None:
        """Prepare a log.

        Args:
            path: The file.
            first: Channels at some samples, for names and shapes.
            attributes: Attributes of the recording if it is cut off.
            time: Times of all planned samples [s].
            force: Whether an older file of that name is replaced.

        Raises:
            InvalidInput: The file exists and may not be replaced.
            OutputError: It cannot be written, or its disk has no room for all samples.
        """
        self.path = Path(path)
        self._channels, self._time, self._force = tuple(first), time, force
        self._done = self.acknowledged = 0
        check_log(self.path, force=force)
        self._check_room(sample_size(first) * len(time))
        self._opening = opening(header(attributes, first, len(time)))
        self._partial = self.path.with_name(f".{self.path.name}.{secrets.token_hex(4)}.partial")
        self._file: Any = None
        self._made: list[Path] = []
        self._failure: OSError | None = None
        self._closing = threading.Event()
        self._syncing = threading.Thread(target=self._sync_now_and_then, daemon=True)

    def __enter__(self) -> RecordingLog:
        try:
            folders = self.path.parent, *self.path.parent.parents
            self._made = [folder for folder in folders if not folder.exists()]
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self._partial.open("xb", buffering=0)
            self._size = 0
            self._write(self._opening)
        except OSError as error:
            self._discard()
            raise self._cannot_write(error) from None
        except BaseException:
            self._discard()
            raise
        return self

    def append(self, time: Float[np.ndarray, " time"], channels: Mapping[str, np.ndarray]) -> None:
        """Add samples.

        Args:
            time: Their times [s].
            channels: The channels of the log.

        Raises:
            OutputError: They cannot be written; the log ends before them.
        """
        samples = payload(time, {name: channels[name] for name in self._channels})
        try:
            self._write(frame(b"DATA", samples, self._done))
            if not self._done:
                self._appear()
        except OSError as error:
            raise self._cannot_write(error) from None
        self._done += len(time)

    def finish(self, attributes: Attributes) -> None:
        """Add the end of the recording; nothing can be appended after it.

        Args:
            attributes: Attributes, which replace those of the same names.

        Raises:
            OutputError: It cannot be written, or forced to the disk, or another run has replaced
                the file.
        """
        try:
            if not os.path.samestat(os.fstat(self._file.fileno()), self.path.stat()):
                raise OutputError(
                    f"{self.path} was replaced by another run of this name; what was recorded here "
                    "is lost.",
                    hint="another --out for each",
                )
            self._write(json_frame(b"DONE", attributes, self._done))
        except OSError as error:
            raise self._cannot_write(error) from None

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the file.

        Raises:
            OutputError: It could not be forced to the disk.
        """
        if self._done == 0:
            self._discard()
            return
        self._stop_syncing()
        self._sync()
        self._file.close()
        if self._failure and error is None:
            reason = (self._failure.strerror or str(self._failure)).lower()
            raise OutputError(
                f"cannot force {self.path} to the disk: {reason}; {self.acknowledged} of "
                f"{self._done} samples are known to be on it."
            )

    def _appear(self) -> None:
        """Rename the file, which has its first samples."""
        self._file.close()
        check_log(self.path, force=self._force)
        self._partial.replace(self.path)
        # A file survives a power failure only with its name, and with its folder's name.
        for folder in (self.path, *self._made):
            sync_folder(folder.parent)
        self._file = self.path.open("r+b", buffering=0)
        self._file.seek(0, os.SEEK_END)
        self._syncing.start()

    def _discard(self) -> None:
        """Delete the file."""
        self._stop_syncing()
        if self._file:
            self._file.close()
        with contextlib.suppress(OSError):
            self._partial.unlink()

    def _write(self, content: bytes) -> None:
        """Write a complete frame, or truncate the file to its end before."""
        rest = memoryview(content)
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
        except BaseException:
            with contextlib.suppress(OSError):
                self._file.truncate(self._size)
                self._file.seek(self._size)
            raise
        self._size += len(content)

    def _sync_now_and_then(self) -> None:
        """Force the file to the disk from a thread, so that the run does not wait."""
        while not self._closing.wait(SYNC_INTERVAL):
            self._sync()

    def _stop_syncing(self) -> None:
        self._closing.set()
        if self._syncing.is_alive():
            self._syncing.join()

    def _sync(self) -> None:
        done = self._done
        if self._failure:
            # The system reports lost data once; a later call succeeds.
            return
        try:
            os.fsync(self._file.fileno())
            self.acknowledged = done
        except OSError as error:
            self._failure = error

    def _check_room(self, size: int) -> None:
        folder = self.path.resolve().parent
        while not folder.exists():
            folder = folder.parent
        free = shutil.disk_usage(folder).free
        if size > free:
            raise OutputError(
                f"{self.path} needs about {_bytes(size)}; {_bytes(free)} are free on its disk.",
                hint="a longer --record-interval, a shorter duration, or another disk (--out)",
            )

    def _cannot_write(self, error: OSError) -> OutputError:
        reason = (error.strerror or str(error)).lower()
        saved = ""
        if self._done:
            saved = (
                f"; {self._time[self._done - 1]:.3g} s of {self._time[-1]:.3g} s were saved "
                "and can be read"
            )
        return OutputError(f"cannot write {self.path}: {reason}{saved}.")


def check_log(path: Path, *, force: bool = False) -> None:
    """Refuse a log that exists, since it may hold the only record of a run that was cut off.

    Args:
        path: The log.
        force: Whether it may be replaced, where it is a file.

    Raises:
        InvalidInput: It may not be replaced.
    """
    if not os.path.lexists(path):
        return
    if not force:
        raise InvalidInput(
            f"{path} exists; nothing was written.",
            hint=f"phasmid report {path}, which makes a folder of it, or --force",
        )
    if not path.is_file():
        raise InvalidInput(f"{path} is not a file; nothing was written.", hint="another name")


def _bytes(size: int) -> str:
    return f"{size / 1e9:.3g} GB" if size >= 1e9 else f"{size / 1e6:.3g} MB"
