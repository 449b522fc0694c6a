"""Recordings that are written while they are made, and read even where they were cut off.

A log begins with twelve fixed bytes and the version of this format, four bytes, little-endian as
all that follows. Then come frames: a header of 28 bytes (kind, length of the payload, index of the
first sample, CRC-32 of the payload, CRC-32 of the header before it) and the payload. The first
frame, ``HEAD``, holds JSON: the recording's attributes, its channels with dims, units, kind and
shape, and how many samples were to come. ``DATA`` frames hold samples, channel after channel: time
and numbers as float64, yes and no as one byte. ``DONE`` holds the attributes that were known only
at the end, as JSON; a log without it was cut off.
"""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import struct
import threading
import zlib
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, OutputError
from phasmid.recording.channels import CHANNELS

MAGIC = b"\x89PHASMID\r\n\x1a\n"
"""First bytes of a log; a transfer that takes it for text breaks them."""

LOG_FORMAT = 1
"""Version of the frames."""

VERSION = struct.Struct("<I")
FRAME = struct.Struct("<4sQQII")

SYNC_INTERVAL = 0.5
"""Longest wall time between two times that a log is forced to the disk [s]."""


class RecordingLog:
    """A recording's file that grows while the recording is made.

    The file appears under its name with its first samples. What was appended outlives the process
    at once, and the machine's power as soon as it is acknowledged.

    Attributes:
        path: The file.
        acknowledged: Number of samples that are forced to the disk.
    """

    def __init__(
        self,
        path: str | Path,
        first: Mapping[str, np.ndarray],
        attributes: Mapping[str, str | int | float],
        *,
        time: Float[np.ndarray, " time"],
        force: bool = False,
    ) -> None:
        """Prepare a log.

        Args:
            path: The file.
            first: Channels at some samples, from which names and shapes are taken.
            attributes: Those of the recording if it is cut off.
            time: Of all the samples that are to come [s].
            force: Whether an older file of that name is replaced.

        Raises:
            InvalidInput: The file exists and may not be replaced.
            OutputError: It cannot be written, or its disk has no room for all samples.
        """
        self.path = Path(path)
        self._dtypes = {name: _dtype(name) for name in first}
        self._shapes = {name: first[name].shape[1:] for name in first}
        self._time, self._force = time, force
        self._done = self.acknowledged = 0
        check_log(self.path, force=force)
        size = sample_size(first) * len(time)
        self._check_room(size)
        self._header = {
            "attributes": dict(attributes),
            "channels": [
                {
                    "name": name,
                    "dims": CHANNELS[name].dims,
                    "units": CHANNELS[name].units,
                    "kind": CHANNELS[name].kind,
                    "shape": self._shapes[name],
                }
                for name in first
            ],
            "samples": len(time),
        }
        self._partial = self.path.with_name(f".{self.path.name}.{secrets.token_hex(4)}.partial")
        self._file: Any = None
        self._closing = threading.Event()
        self._syncing = threading.Thread(target=self._sync_now_and_then, daemon=True)

    def __enter__(self) -> RecordingLog:
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self._partial.open("xb", buffering=0)
            self._size = 0
            self._write(MAGIC + VERSION.pack(LOG_FORMAT) + _json_frame(b"HEAD", self._header))
        except OSError as error:
            self._discard()
            raise self._cannot_write(error) from None
        return self

    def append(self, time: Float[np.ndarray, " time"], channels: Mapping[str, np.ndarray]) -> None:
        """Add samples.

        Args:
            time: Their times [s].
            channels: Those that the log was prepared for.

        Raises:
            OutputError: They cannot be written; the log ends before them.
        """
        parts = [np.ascontiguousarray(time, "<f8").data]
        for name, dtype in self._dtypes.items():
            parts.append(np.ascontiguousarray(channels[name], dtype).data)
        payload = b"".join(parts)
        try:
            self._write(_frame(b"DATA", payload, self._done))
            if not self._done:
                self._appear()
        except OSError as error:
            raise self._cannot_write(error) from None
        self._done += len(time)

    def finish(self, attributes: Mapping[str, str | int | float]) -> None:
        """Add how the recording ended; nothing can be appended after that.

        Args:
            attributes: They replace those of the same names.

        Raises:
            OutputError: It cannot be written.
        """
        try:
            self._write(_json_frame(b"DONE", dict(attributes), self._done))
        except OSError as error:
            raise self._cannot_write(error) from None

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._done == 0:
            self._discard()
            return
        self._closing.set()
        self._syncing.join()
        self._sync()
        self._file.close()

    def _appear(self) -> None:
        """Give the file its name: it holds its first samples."""
        self._file.close()
        check_log(self.path, force=self._force)
        self._partial.replace(self.path)
        self._file = self.path.open("r+b", buffering=0)
        self._file.seek(0, os.SEEK_END)
        self._syncing.start()

    def _discard(self) -> None:
        """Leave nothing behind."""
        if self._file:
            self._file.close()
        with contextlib.suppress(OSError):
            self._partial.unlink()

    def _write(self, frame: bytes) -> None:
        """Write a frame whole, or take back what was written of it."""
        rest = memoryview(frame)
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
        except BaseException:
            with contextlib.suppress(OSError):
                self._file.truncate(self._size)
                self._file.seek(self._size)
            raise
        self._size += len(frame)

    def _sync_now_and_then(self) -> None:
        """Force the file to the disk, beside the run: it would wait for the disk."""
        while not self._closing.wait(SYNC_INTERVAL):
            self._sync()

    def _sync(self) -> None:
        done = self._done
        with contextlib.suppress(OSError):
            os.fsync(self._file.fileno())
            self.acknowledged = done

    def _check_room(self, size: int) -> None:
        import shutil

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


def sample_size(channels: Mapping[str, np.ndarray]) -> int:
    """Bytes of a sample in a log, its time included.

    Args:
        channels: At any number of samples, at least one.
    """
    sizes = (array[0].size * _dtype(name).itemsize for name, array in channels.items())
    return 8 + sum(sizes)


def _dtype(name: str) -> np.dtype[Any]:
    return np.dtype("?" if CHANNELS[name].kind == "bool" else "<f8")


def _bytes(size: int) -> str:
    return f"{size / 1e9:.3g} GB" if size >= 1e9 else f"{size / 1e6:.3g} MB"


def _frame(kind: bytes, payload: bytes, first: int) -> bytes:
    head = FRAME.pack(kind, len(payload), first, zlib.crc32(payload), 0)[:-4]
    return head + VERSION.pack(zlib.crc32(head)) + payload


def _json_frame(kind: bytes, content: dict[str, Any], first: int = 0) -> bytes:
    return _frame(kind, json.dumps(content, ensure_ascii=False).encode(), first)
