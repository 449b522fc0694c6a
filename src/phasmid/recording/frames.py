"""Format of a log: frames with checksums.

A log begins with twelve fixed bytes and the version of this format, four bytes, little-endian as
all that follows. Then come frames: a header of 28 bytes (kind, length of the payload, index of the
first sample, CRC-32 of the payload, CRC-32 of the header before it) and the payload. The first
frame, ``HEAD``, holds JSON: the recording's attributes, its channels with dims, units, kind and
shape, and how many samples were to come. ``DATA`` frames hold samples, channel after channel: time
and numbers as float64, yes and no as one byte. ``DONE`` holds the attributes that were known only
at the end, as JSON; a log without it was cut off.
"""

from __future__ import annotations

import json
import math
import struct
import warnings
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, plain
from phasmid.recording.channels import CHANNELS, COORDINATES
from phasmid.recording.recording import Attributes

MAGIC = b"\x89PHASMID\r\n\x1a\n"
"""First bytes of a log; transfers in text mode change them."""

LOG_FORMAT = 1
"""Version of the frames."""

HEADER_LIMIT = 16_000_000
"""Longest JSON that is read [bytes]; robots and scenarios are texts of some kilobytes."""

_VERSION = struct.Struct("<I")
_FRAME = struct.Struct("<4sQQI")
_FRAME_SIZE = _FRAME.size + 4


class DamagedRecording(UserWarning):
    """A recording was read only in part.

    Attributes:
        wrong: True for damaged bytes, False where only the end is missing.
    """

    def __init__(self, message: str, *, wrong: bool) -> None:
        super().__init__(plain(message))
        self.wrong = wrong


def opening(header: Mapping[str, Any]) -> bytes:
    """Return the beginning of a log, before its first samples."""
    return MAGIC + _VERSION.pack(LOG_FORMAT) + json_frame(b"HEAD", header)


def frame(kind: bytes, payload: bytes, first: int) -> bytes:
    """Return a frame.

    Args:
        kind: ``HEAD``, ``DATA`` or ``DONE``.
        payload: Its content.
        first: Number of samples before it.
    """
    head = _FRAME.pack(kind, len(payload), first, zlib.crc32(payload))
    return head + _VERSION.pack(zlib.crc32(head)) + payload


def json_frame(kind: bytes, content: Mapping[str, Any], first: int = 0) -> bytes:
    """Return a frame of JSON."""
    return frame(kind, json.dumps(content, ensure_ascii=False).encode(), first)


def header(
    attributes: Attributes, channels: Mapping[str, np.ndarray], samples: int
) -> dict[str, Any]:
    """Return the content of the first frame.

    Args:
        attributes: Those of the recording if it is cut off.
        channels: At some samples, from which names and shapes are taken.
        samples: How many are to come.
    """
    listed = [
        {
            "name": name,
            "dims": CHANNELS[name].dims,
            "units": CHANNELS[name].units,
            "kind": CHANNELS[name].kind,
            "shape": array.shape[1:],
        }
        for name, array in channels.items()
    ]
    return {"attributes": dict(attributes), "channels": listed, "samples": samples}


def payload(time: Float[np.ndarray, " time"], channels: Mapping[str, np.ndarray]) -> bytes:
    """Return samples as the payload of a frame, in the order of the channels."""
    arrays = [np.ascontiguousarray(time, "<f8")]
    arrays += [np.ascontiguousarray(array, dtype(name)) for name, array in channels.items()]
    return b"".join(array.tobytes() for array in arrays)


def dtype(channel: str) -> np.dtype[Any]:
    """Return the type of a channel's values in a log."""
    return np.dtype("?" if CHANNELS[channel].kind == "bool" else "<f8")


def sample_size(channels: Mapping[str, np.ndarray]) -> int:
    """Return the size of a sample in a log with its time [bytes].

    Args:
        channels: At any number of samples, at least one.
    """
    sizes = (array[0].size * dtype(name).itemsize for name, array in channels.items())
    return 8 + sum(sizes)


def is_log(path: Path) -> bool:
    """Return whether a file is a log."""
    with path.open("rb") as file:
        return file.read(len(MAGIC)) == MAGIC


def read_log(path: Path) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, Any]]:
    """Read time, channels and attributes of a log, up to its end or first damage.

    Raises:
        InvalidInput: Its beginning is damaged, it is of a newer format, or it holds no sample.

    Warns:
        DamagedRecording: It was cut off, or a bit in it is wrong.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(len(MAGIC))
        _check_version(file.read(_VERSION.size), path)
        frames = _Frames(file, size)
        kind, _, content = next(frames, (b"", 0, b""))
        if kind != b"HEAD":
            raise InvalidInput(f"{path} is damaged at its beginning; nothing of it can be read.")
        said = _parsed(content, path)
        layout = _Layout(said, path, size)
        room = layout.room(size)
        samples = count = longest = 0
        ended: dict[str, Any] | None = None
        for kind, first, content in frames:
            if kind == b"DONE" and first == samples:
                ended = _parsed(content, path)
                break
            part, rest = divmod(len(content), layout.size)
            if kind != b"DATA" or first != samples or rest or not part:
                frames.damage = "is out of order"
                break
            layout.fill(room, samples, content)
            samples, count, longest = samples + part, count + 1, max(longest, part)
    if not samples:
        raise InvalidInput(f"{path} holds no whole sample.")
    attributes = _attributes(said, "attributes", path)
    if ended is None:
        planned = said.get("samples")
        planned = planned if type(planned) is int and planned > 0 else samples
        found = _finding(path.name, frames.damage, count, math.ceil(planned / longest))
        wrong = frames.damage not in ("", "ends")
        warnings.warn(DamagedRecording(found, wrong=wrong), stacklevel=3)
        reason = str(attributes.get("ending_reason", "")).rstrip(".")
        attributes["ending_reason"] = f"{reason}: {found}" if reason else found
    else:
        attributes |= _attributes({"attributes": ended}, "attributes", path)
    arrays = {name: array[:samples] for name, array in room.items()}
    return arrays.pop("time"), arrays, attributes


def _finding(name: str, damage: str, count: int, planned: int) -> str:
    """Return the damage of a log in a sentence."""
    if damage and damage != "ends":
        return f"{name} frame {count} {damage}; frames 0 to {count - 1} were read."
    cut = "ends mid-frame" if damage else "has no end"
    return (
        f"{name} {cut}: {_spaced(count)} of about {_spaced(max(planned, count))} frames recovered; "
        "the original is untouched."
    )


def _spaced(number: int) -> str:
    return f"{number:,}".replace(",", " ")


def _check_version(stored: bytes, path: Path) -> None:
    version = int.from_bytes(stored, "little")
    if len(stored) < _VERSION.size or version < 1:
        raise InvalidInput(f"{path} is damaged at its beginning; nothing of it can be read.")
    if version > LOG_FORMAT:
        raise InvalidInput(
            f"{path} uses format {version}; this version reads up to {LOG_FORMAT}.",
            hint="upgrade phasmid",
        )


class _Frames(Iterator[tuple[bytes, int, bytes]]):
    """Complete frames of a file: kind, number of samples before it, payload.

    Attributes:
        damage: Why there are no more: empty at the file's end, ``ends`` where it ends amid a
            frame, or the fault of the frame.
    """

    def __init__(self, file: IO[bytes], size: int) -> None:
        self._file, self._size = file, size
        self.damage = ""

    def __next__(self) -> tuple[bytes, int, bytes]:
        head = self._file.read(_FRAME_SIZE)
        if not head:
            raise StopIteration
        if len(head) < _FRAME_SIZE:
            self.damage = "ends"
            raise StopIteration
        (sum_of_head,) = _VERSION.unpack(head[_FRAME.size :])
        if zlib.crc32(head[: _FRAME.size]) != sum_of_head:
            self.damage = "fails its checksum"
            raise StopIteration
        kind, length, first, sum_of_payload = _FRAME.unpack(head[: _FRAME.size])
        # Allocate only where the file has as many bytes.
        if length > self._size - self._file.tell():
            self.damage = "ends"
            raise StopIteration
        content = self._file.read(length)
        if zlib.crc32(content) != sum_of_payload:
            self.damage = "fails its checksum"
            raise StopIteration
        return kind, first, content


class _Layout:
    """Layout of the channels in the payload of a frame."""

    def __init__(self, said: Mapping[str, Any], path: Path, size: int) -> None:
        self._shapes: dict[str, tuple[int, ...]] = {"time": ()}
        self._dtypes = {"time": np.dtype("<f8")}
        listed = said.get("channels")
        if not isinstance(listed, list):
            raise InvalidInput(f"{path} is damaged: it does not list its channels.")
        for entry in listed:
            entry = entry if isinstance(entry, dict) else {}
            name = str(entry.get("name"))
            channel = CHANNELS.get(name)
            if channel is None or name in self._shapes:
                raise InvalidInput(
                    f'{path} lists the channel "{name[:40]}", which is unknown or there twice.'
                )
            if entry.get("units") != channel.units:
                raise InvalidInput(
                    f'channel "{name}" is in {str(entry.get("units"))[:20]}; '
                    f"it must be in {channel.units}."
                )
            self._shapes[name] = _shape(entry.get("shape"), channel.dims, name, size)
            self._dtypes[name] = dtype(name)
        self.size = sum(
            math.prod(shape) * self._dtypes[name].itemsize for name, shape in self._shapes.items()
        )

    def room(self, size: int) -> dict[str, np.ndarray]:
        """Return arrays for all samples that fit a file of some size [bytes]."""
        return {
            name: np.empty((size // self.size, *shape), self._dtypes[name])
            for name, shape in self._shapes.items()
        }

    def fill(self, room: Mapping[str, np.ndarray], at: int, content: bytes) -> None:
        """Copy the samples of a frame to the arrays."""
        count, start = len(content) // self.size, 0
        for name, shape in self._shapes.items():
            length = count * math.prod(shape)
            values = np.frombuffer(content, self._dtypes[name], length, start)
            room[name][at : at + count] = values.reshape(count, *shape)
            start += values.nbytes


def _shape(shape: Any, dims: tuple[str, ...], name: str, size: int) -> tuple[int, ...]:
    """Return the shape of a channel at one sample, checked before memory is allocated."""
    legs = shape[0] if isinstance(shape, list) and shape and dims[1] == "leg" else 0
    wanted = [legs if dim == "leg" else len(COORDINATES[dim]) for dim in dims[1:]]
    if shape != wanted or any(type(n) is not int or not 0 < n <= size for n in wanted):
        raise InvalidInput(f'channel "{name}" has a wrong shape in a recording.')
    return tuple(wanted)


def _parsed(content: bytes, path: Path) -> dict[str, Any]:
    try:
        if len(content) > HEADER_LIMIT:
            raise ValueError("it is too long")
        parsed = json.loads(content)
        if not isinstance(parsed, dict):
            raise ValueError("it is no table")
    except (ValueError, RecursionError) as error:
        raise InvalidInput(
            f"{path} is damaged: its header is not JSON: {str(error)[:80]}."
        ) from None
    return parsed


def _attributes(said: Mapping[str, Any], key: str, path: Path) -> dict[str, Any]:
    attributes = said.get(key)
    if not isinstance(attributes, dict):
        raise InvalidInput(f"{path} is damaged: it has no attributes.")
    return dict(attributes)
