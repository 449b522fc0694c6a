"""Logs: recordings written during a run, as MCAP files.

A log holds two channels of ROS 2 messages. ``/recording`` has one message for each sample:
``float64 time`` and then every channel as an array of fixed length. ``/recording/attributes`` has
the attributes as JSON: one message at the beginning, for a run that is cut off, and one at the end.
Every message is a chunk with its own CRC-32, so that each sample outlives a killed process.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import re
import shutil
import struct
import warnings
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import IO, Any

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, OutputError, plain
from phasmid.recording.channels import CHANNELS, COORDINATES
from phasmid.recording.recording import FORMAT, Attributes

MAGIC = b"\x89MCAP0\r\n"
"""First bytes of an MCAP file."""

_SAMPLE, _ATTRIBUTES = "/recording", "/recording/attributes"
_ROS_TYPES = {"float": "float64", "bool": "bool"}
_CDR = b"\x00\x01\x00\x00"
"""Header of a ROS 2 message in little-endian byte order."""


class DamagedRecording(UserWarning):
    """A recording was read only in part.

    Attributes:
        wrong: True for damaged bytes, False where only the end is missing.
    """

    def __init__(self, message: str, *, wrong: bool) -> None:
        super().__init__(plain(message))
        self.wrong = wrong


class RecordingLog:
    """Log of a run.

    The file appears with its first samples. Appended samples survive the process at once, and a
    finished log survives a power failure.

    Attributes:
        path: The file.
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
            OutputError: Its disk has no room for all samples.
        """
        self.path = Path(path)
        self._attributes, self._time, self._force = attributes, time, force
        self._definition = _definition({name: math.prod(a.shape[1:]) for name, a in first.items()})
        self._dtype = _dtype(self._definition)
        self._done = 0
        self._file: Any = None
        check_log(self.path, force=force)
        check_room(self.path, self._dtype.itemsize * len(time))

    def __enter__(self) -> RecordingLog:
        return self

    def append(self, time: Float[np.ndarray, " time"], channels: Mapping[str, np.ndarray]) -> None:
        """Add samples.

        Args:
            time: Their times [s].
            channels: The channels of the log.

        Raises:
            OutputError: They cannot be written; the log ends before them.
        """
        samples = np.empty(len(time), self._dtype)
        for name in samples.dtype.names or ():
            values = time if name == "time" else channels[name]
            samples[name] = values.reshape(samples[name].shape)
        try:
            if self._file is None:
                self._open()
            for number, sample in enumerate(samples, self._done):
                self._write(self._sample, sample.tobytes(), number, sample["time"])
            self._file.flush()
        except OSError as error:
            raise self._cannot_write(error) from None
        self._done += len(time)

    def finish(self, attributes: Attributes) -> None:
        """Add the end of the recording and force it to the disk; nothing can be appended after it.

        Args:
            attributes: Attributes, which replace those of the same names.

        Raises:
            OutputError: It cannot be written, or forced to the disk.
        """
        try:
            self._write_attributes(attributes)
            self._writer.finish()
            self._file.flush()
            os.fsync(self._file.fileno())
            sync_folder(self.path.parent)
        except OSError as error:
            raise self._cannot_write(error) from None

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the file; one without samples is removed."""
        if self._file is None:
            return
        with contextlib.suppress(OSError):
            self._file.close()
        if not self._done:
            self.path.unlink(missing_ok=True)

    def _open(self) -> None:
        # Lazy import: 0.07 s.
        from mcap.writer import CompressionType, Writer

        self.path.parent.mkdir(parents=True, exist_ok=True)
        check_log(self.path, force=self._force)
        self.path.unlink(missing_ok=True)
        self._file = self.path.open("xb")
        # A chunk ends as soon as it is longer than 0 bytes.
        self._writer: Any = Writer(self._file, chunk_size=0, compression=CompressionType.NONE)
        self._writer.start("ros2")
        self._text = self._channel(_ATTRIBUTES, "std_msgs/msg/String", "string data")
        self._sample = self._channel(_SAMPLE, "phasmid_msgs/msg/Sample", self._definition)
        self._write_attributes(
            {**self._attributes, "format": FORMAT, "planned_samples": len(self._time)}
        )

    def _channel(self, topic: str, kind: str, definition: str) -> int:
        schema = self._writer.register_schema(kind, "ros2msg", definition.encode())
        return int(self._writer.register_channel(topic, "cdr", schema))

    def _write_attributes(self, attributes: Attributes) -> None:
        text = json.dumps(attributes, ensure_ascii=False).encode() + b"\0"
        self._write(self._text, struct.pack("<I", len(text)) + text, self._done, 0.0)

    def _write(self, channel: int, content: bytes, number: int, time: float) -> None:
        ns = max(0, round(1e9 * time))
        self._writer.add_message(channel, ns, _CDR + content, ns, number)

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


def check_room(path: Path, size: float) -> None:
    """Raise OutputError where the disk of a file has less room than a size [bytes]."""
    folder = path.resolve().parent
    while not folder.exists():
        folder = folder.parent
    free = shutil.disk_usage(folder).free
    if size > free:
        raise OutputError(
            f"{path} needs about {size / 1e9:.3g} GB; {free / 1e9:.3g} GB are free on its disk.",
            hint="another disk (--out), or for a run a longer --record-interval",
        )


def is_log(path: Path) -> bool:
    """Return whether a file is an MCAP file."""
    with path.open("rb") as file:
        return file.read(len(MAGIC)) == MAGIC


def read_log(path: Path) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, Any]]:
    """Read time, channels and attributes of a log, up to its end or first damage.

    Raises:
        InvalidInput: Its beginning is damaged, it is no log, or it holds no sample.

    Warns:
        DamagedRecording: It was cut off, or a bit in it is wrong.
    """
    from mcap.exceptions import EndOfFile

    dtype: np.dtype[Any] | None = None
    samples: list[bytes] = []
    attributes: list[dict[str, Any]] = []
    damage: Exception | None = None
    with path.open("rb") as file:
        try:
            for topic, definition, message in _messages(file, path.stat().st_size):
                if message.sequence != len(samples):
                    raise ValueError("a sample is absent")
                if topic == _ATTRIBUTES:
                    attributes.append(json.loads(message.data[8:-1]))
                elif topic == _SAMPLE:
                    dtype = dtype or _dtype(definition)
                    if len(message.data) != len(_CDR) + dtype.itemsize:
                        raise ValueError("a sample has a wrong length")
                    samples.append(message.data[len(_CDR) :])
        except InvalidInput as error:
            raise InvalidInput(f"{path}: {error.what}", hint=error.hint) from None
        except Exception as error:
            # Damaged bytes raise any exception in the MCAP reader.
            damage = error
    if not (dtype and samples and attributes and isinstance(attributes[0], dict)):
        raise InvalidInput(
            f"{path} holds no whole sample of a phasmid recording.",
            hint="a log that phasmid walk or drive wrote",
        )
    planned = max(len(samples), attributes[0].pop("planned_samples", 0))
    known = attributes[0]
    if len(attributes) > 1:
        known |= attributes[-1]
    else:
        wrong = damage is not None and not isinstance(damage, EndOfFile)
        found = (
            f"{path.name} is {'damaged' if wrong else 'cut off'}: {len(samples)} of {planned} "
            "samples were read; the original is untouched."
        )
        warnings.warn(DamagedRecording(found, wrong=wrong), stacklevel=3)
        reason = str(known.get("ending_reason", "")).rstrip(".")
        known["ending_reason"] = f"{reason}: {found}" if reason else found
    read = np.frombuffer(b"".join(samples), dtype)
    arrays = {name: _shaped(name, read[name]) for name in dtype.names or ()}
    return arrays.pop("time"), arrays, known


def _shaped(name: str, rows: np.ndarray) -> np.ndarray:
    """Return a channel's rows of numbers as an array of its shape."""
    dims = CHANNELS[name].dims[1:] if name in CHANNELS else ()
    sizes = (len(COORDINATES[dim]) if dim in COORDINATES else -1 for dim in dims)
    return np.ascontiguousarray(rows).reshape(len(rows), *sizes)


def _messages(file: IO[bytes], size: int) -> Iterator[tuple[str, str, Any]]:
    """Yield topic, definition and message of every message, each chunk checked first."""
    from mcap.records import Channel, Chunk, Message, Schema
    from mcap.stream_reader import StreamReader, breakup_chunk

    definitions: dict[int, str] = {}
    channels: dict[int, Any] = {}
    for chunk in StreamReader(file, emit_chunks=True, record_size_limit=size).records:
        if not isinstance(chunk, Chunk):
            continue
        if chunk.compression:
            # A small file must not fill the memory.
            raise InvalidInput("it is compressed; a log that phasmid wrote is not.")
        # The reader takes a checksum of zeros for none at all.
        if zlib.crc32(chunk.data) != chunk.uncompressed_crc:
            raise ValueError("a chunk fails its checksum")
        for record in breakup_chunk(chunk):
            if isinstance(record, Schema):
                definitions[record.id] = record.data.decode()
            elif isinstance(record, Channel):
                channels[record.id] = record
            elif isinstance(record, Message):
                channel = channels[record.channel_id]
                yield channel.topic, definitions[channel.schema_id], record


def _definition(lengths: Mapping[str, int]) -> str:
    """Return the ROS 2 message definition of a sample: numbers, aligned to 8 bytes, then bools."""
    lines = ["float64 time  # s"]
    for kind, ros in _ROS_TYPES.items():
        lines += [
            f"{ros}[{length}] {name}  # {CHANNELS[name].units}"
            for name, length in lengths.items()
            if CHANNELS[name].kind == kind
        ]
    return "\n".join(lines)


def _dtype(definition: str) -> np.dtype[Any]:
    """Return the layout of a sample.

    Raises:
        InvalidInput: A channel is unknown, or has another unit or kind than in this version.
    """
    fields: list[tuple[str, str, tuple[int, ...]]] = [("time", "<f8", ())]
    for ros, length, name, units in re.findall(r"(\w+)\[(\d{1,9})\] (\w+)  # (.+)", definition):
        channel = CHANNELS.get(name)
        if channel is None:
            raise InvalidInput(f'its channel "{name[:40]}" is unknown.', hint="upgrade phasmid")
        if (ros, units) != (_ROS_TYPES[channel.kind], channel.units):
            raise InvalidInput("its channels have other units.", hint="upgrade phasmid")
        fields.append((name, "?" if channel.kind == "bool" else "<f8", (int(length),)))
    return np.dtype(fields)


def sync_folder(folder: Path) -> None:
    """Force a rename to the disk, on systems that can open folders."""
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
