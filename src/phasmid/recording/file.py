"""Recordings as netCDF-4 files, written atomically."""

from __future__ import annotations

import contextlib
import math
import os
import secrets
import tempfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from phasmid.arguments import checked
from phasmid.errors import (
    AlreadyExists,
    InvalidInput,
    OutputError,
    PhasmidError,
    located,
    own_words,
)
from phasmid.interrupts import held_signals
from phasmid.recording.channels import CHANNELS, COORDINATES, MOST_BYTES
from phasmid.recording.log import DamagedRecording, check_room, is_log, read_log, sync_folder
from phasmid.recording.recording import FORMAT, Recording, check_time, new_recording

CHECKSUM = b"\nphasmid CRC-32 %08x\n"
"""Checksum at the end of a file, after the HDF5 data.

HDF5 keeps attributes and its own structure without a checksum, and a bit that is wrong there can
make it read forever.
"""

END_OF_HDF5 = slice(40, 48)
"""Bytes of the head, as h5netcdf writes it, that tell where the HDF5 data end."""

DEFLATE_LIMIT = 1100
"""Largest ratio of decompression that is accepted; deflate reaches 1032."""


MOST_FOLDERS = 200
"""Most folders around a file; Python makes them by as many nested calls, of 1000 in all."""


@checked
def save_recording(recording: Recording, path: str | Path) -> None:
    """Write a recording to a file, exactly to the bit.

    The file is written under another name, forced to the disk and renamed. An older file of the
    name is replaced.

    Args:
        recording: The recording.
        path: The file, by custom ``.nc``.

    Raises:
        InvalidInput: It is not a recording, or not a file name.
        OutputError: The disk is full, the folder is absent or not writable; nothing is left behind.
    """
    path = Path(path)
    check_time(recording)
    # Encode in memory, so that only the write can fail.
    packed = {"zlib": True, "complevel": 1, "shuffle": True, "fletcher32": True}
    encoding = {name: packed | {"_FillValue": None} for name in (*recording.data_vars, "time")}
    encoded = recording.to_netcdf(engine="h5netcdf", encoding=encoding)
    try:
        with whole_file(path) as file:
            file.write(encoded)
            file.write(CHECKSUM % zlib.crc32(encoded))
    finally:
        # Python 3.13 warns where a buffer is collected before its view.
        encoded.release()


def write_whole(path: Path, data: bytes | memoryview) -> None:
    """Write a file atomically.

    Args:
        path: The file.
        data: Its bytes.

    Raises:
        OutputError: It cannot be written; nothing is left behind.
    """
    with whole_file(path) as file:
        file.write(data)


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """Open a file that appears under its name once it is complete, or not at all.

    Args:
        path: The file.

    Raises:
        OutputError: It cannot be written; nothing is left behind.
    """
    partial = path.with_name(f".{path.name}.{secrets.token_hex(4)}.partial")
    try:
        try:
            with partial.open("xb") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            partial.replace(path)
            sync_folder(path.parent)
        except BaseException:
            with contextlib.suppress(OSError):
                partial.unlink()
            raise
    except OSError as error:
        raise cannot_write(path, error) from None


def check_new_file(path: Path, *, option: str, force: bool) -> None:
    """Raise where no file can be written, before a run starts.

    Args:
        path: The file; folders above it may be absent.
        option: The option of the command line that names another place.
        force: Whether an older file is replaced.

    Raises:
        InvalidInput: It is a folder, or exists and may not be replaced.
        OutputError: It cannot be made there.
    """
    try:
        folder, exists = path.is_dir(), path.exists() or path.is_symlink()
    except OSError as error:
        raise cannot_write(path, error) from None
    if folder:
        raise InvalidInput(f"{path} is a folder; nothing was written.", hint="a file's name")
    if exists and not force:
        raise AlreadyExists(path, option=option)
    check_place(path)


PARTIAL_LETTERS = len("..12345678.partial")
"""Letters by which the name of a partial file or folder is longer than its own."""


def check_place(path: Path, *, room: float = 0.0) -> None:
    """Raise where a file or folder cannot be made, before it is computed.

    Args:
        path: The file or folder; folders above it may be absent.
        room: Size that must be free on its disk [bytes].

    Raises:
        InvalidInput: It lies in too many nested folders.
        OutputError: Its folder is none or not writable, its name is too long, or the disk is full.
    """
    try:
        parent, names = path.resolve().parent, [path.name + PARTIAL_LETTERS * "."]
        if len(parent.parents) > MOST_FOLDERS:
            raise InvalidInput(
                f"{path} lies in {len(parent.parents)} nested folders; at most {MOST_FOLDERS} are "
                "possible.",
                hint="a shorter path",
            )
        while not parent.exists():
            names.append(parent.name)
            parent = parent.parent
        if not parent.is_dir():
            raise OutputError(f"cannot write {path}: {parent} is not a folder.")
        if not os.access(parent, os.W_OK | os.X_OK):
            raise OutputError(f"cannot write {path}: {parent} is not writable.")
        longest = os.pathconf(parent, "PC_NAME_MAX") if hasattr(os, "pathconf") else 255
        if max(len(os.fsencode(name)) for name in names) > longest:
            raise OutputError(
                f"cannot write {path}: its name is too long; {longest - PARTIAL_LETTERS} bytes are "
                "possible."
            )
        with held_signals(), tempfile.TemporaryFile(dir=parent):
            # Systems of files that only look writable refuse this.
            pass
    except OSError as error:
        raise cannot_write(path, error) from None
    check_room(path, room)


def cannot_write(path: Path, error: OSError) -> OutputError:
    """Return the error of a path that cannot be written."""
    reason = (error.strerror or str(error)).lower()
    return OutputError(f"cannot write {path}: {reason}.")


@checked
def load_recording(path: str | Path) -> Recording:
    """Read a recording into memory.

    Args:
        path: A file that `save_recording` wrote, the log of a run, or a result folder, of which
            ``recording.nc`` is read.

    Raises:
        InvalidInput: The file is absent, damaged, not a recording, or of a newer format.

    Warns:
        DamagedRecording: A log is cut off or damaged; the samples before that are returned.
    """
    path = Path(path)
    try:
        if path.is_dir():
            path = _inside(path)
        if not path.exists():
            raise InvalidInput(f"recording {path} does not exist.")
        # A pipe never ends.
        if not path.is_file():
            raise InvalidInput(f"{path} is not a file.")
        log = is_log(path)
        if not log:
            _check_sum(path)
        time, channels, attributes = read_log(path) if log else _read_netcdf(path)
        _check_format(attributes.pop("format", None), path)
        with located(str(path)):
            return new_recording(time.astype(np.float64), channels, attributes)
    except (PhasmidError, DamagedRecording):
        raise
    except Exception as error:
        # A damaged file can raise any exception in the HDF5 reader.
        raise InvalidInput(
            f"{path} is not a recording that can be read{own_words(error)}.",
            hint="a recording.nc that phasmid wrote, copied whole",
        ) from None


def _inside(folder: Path) -> Path:
    """Return the recording of a result folder."""
    path = folder / "recording.nc"
    if not path.exists():
        raise InvalidInput(
            f"{folder} is a folder without a recording.nc.",
            hint="a recording.nc, a .mcap, or a folder that phasmid wrote",
        )
    return path


def _check_sum(path: Path) -> None:
    """Refuse a file whose checksum is wrong, or damaged; one of another writer may have none."""
    length = len(CHECKSUM % 0)
    with path.open("rb") as file:
        head = file.read(END_OF_HDF5.stop)
        file.seek(0)
        left = max(0, path.stat().st_size - length)
        found = 0
        while left and (block := file.read(min(left, 1 << 20))):
            found, left = zlib.crc32(block, found), left - len(block)
        end = file.read()
    hdf5 = int.from_bytes(head[END_OF_HDF5], "little")
    has_checksum = end.startswith(CHECKSUM[:16]) or path.stat().st_size == hdf5 + length
    if has_checksum and end != CHECKSUM % found:
        raise InvalidInput(
            f"{path} is damaged: it fails its checksum.", hint="a copy that is whole"
        )


def _read_netcdf(
    path: Path,
) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, str | int | float]]:
    """Read time, channels and attributes of a netCDF file."""
    import h5py

    with h5py.File(path, "r") as stored:
        attributes = {
            str(name): _own(value)
            for name, value in stored.attrs.items()
            if not str(name).startswith("_NC")
        }
        _check_claims(stored, path)
        time = np.asarray(stored["time"][()])
        channels = {
            str(name): _read(stored[name]) for name in stored if str(name) not in _COORDINATES
        }
    return time, channels, attributes


_COORDINATES = {"time", "leg", "leg_name", *COORDINATES}


def _own(value: Any) -> str | int | float:
    """Return an attribute as Python text or number."""
    if isinstance(value, np.ndarray | np.generic) and value.size == 1:
        value = value.item()
    # HDF5 has a type for empty text.
    return "" if type(value).__name__ == "Empty" else value


def _check_format(version: str | int | float | None, path: Path) -> None:
    if not isinstance(version, int) or version < 1:
        raise InvalidInput(f"{path} is not a phasmid recording: it names no format of ours.")
    if version > FORMAT:
        raise InvalidInput(
            f"{path} uses format {version}; this version reads up to {FORMAT}.",
            hint="upgrade phasmid",
        )


def _check_claims(stored: Any, path: Path) -> None:
    """Refuse arrays that the file cannot hold itself, before memory is allocated for them."""
    import h5py

    claimed = written = 0
    for name in stored:
        array = stored[name]
        own = isinstance(stored.get(name, getlink=True), h5py.HardLink)
        if not own or not isinstance(array, h5py.Dataset) or array.external or array.is_virtual:
            raise InvalidInput(f"{path} is damaged: {name} is not an array of its own.")
        # A chunk is read whole, however little of it belongs to the array.
        claimed += max(array.nbytes, math.prod(array.chunks or ()) * array.dtype.itemsize)
        written += array.id.get_storage_size()
    # What was never written costs a file nothing, so that its size alone bounds nothing.
    if claimed > min(MOST_BYTES, DEFLATE_LIMIT * min(path.stat().st_size, written)):
        raise InvalidInput(f"{path} is damaged: it claims {claimed:.3g} bytes.")


def _read(stored: Any) -> np.ndarray:
    """Return the numbers of a channel; netCDF stores booleans as small numbers."""
    name = str(stored.name).lstrip("/")
    channel = CHANNELS.get(name)
    if channel is None:
        # An unknown name is refused later, in the words of `new_recording`.
        return np.zeros(0)
    units = _own(stored.attrs["units"])
    if units != channel.units:
        raise InvalidInput(f'channel "{name}" is in {units}; it must be in {channel.units}.')
    values = np.asarray(stored[()])
    return values.astype(np.bool_) if channel.kind == "bool" else values
