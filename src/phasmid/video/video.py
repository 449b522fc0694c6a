"""Recordings as videos."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from PIL import Image

from phasmid.arguments import check_callable, check_number, check_type, path_of
from phasmid.errors import AlreadyExists, InvalidInput, OutputError
from phasmid.recording import Recording, check_recording
from phasmid.recording.file import cannot_write, new_file
from phasmid.reporting.source import finite_part, read_source
from phasmid.robot import Appearance
from phasmid.video.encoder import encode
from phasmid.video.film import film_camera, film_of, scene
from phasmid.video.painter import painted
from phasmid.video.probe import gl_backend, lack
from phasmid.video.sheet import Sheet, picture_size

SIZES = {".mp4": (1280, 720), ".gif": (640, 360)}
RATES = {".mp4": 30.0, ".gif": 15.0}
"""Width and height [pixels], and frames per second, of each kind of file."""

SMALLEST, LARGEST = (320, 240), (3840, 2160)
"""Least and largest width and height [pixels]."""

FASTEST = {".mp4": 120.0, ".gif": 50.0}
"""Most frames per second."""

Progress = Callable[[int, int], object]
"""What is told how many of how many frames are done."""


def save_video(
    recording: Recording,
    path: str | Path,
    *,
    appearance: Appearance | None = None,
    size: tuple[int, int] | None = None,
    fps: float | None = None,
    speed: float = 1.0,
    force: bool = False,
    progress: Progress | None = None,
) -> Path:
    """Write a recording as a video: the robot on its ground, and the forces on its feet.

    The engine's renderer draws in a process of its own, by a graphics card or without one.

    Args:
        recording: With the body's pose and joint angles, seen or planned.
        path: The file, ``.mp4`` or ``.gif``.
        appearance: The robot's meshes, where they do not come with phasmid.
        size: Width and height in pixels; 1280 by 720 by default, of a GIF 640 by 360.
        fps: Frames per second; 30 by default, of a GIF 15.
        speed: Recorded seconds per second of the video.
        force: Whether an older file of that name is replaced.
        progress: Called with the number of frames that are done, and of all.

    Returns:
        The file.

    Raises:
        InvalidInput: The file exists or is of another kind; the recording lacks the robot's pose;
            this machine lacks what a video needs, see `phasmid.video.lack`.
        OutputError: The file cannot be written; nothing is left behind.
    """
    check_recording(recording)
    path = check_video(path, force=force)
    suffix = path.suffix.lower()
    if appearance is not None:
        check_type("appearance", appearance, (Appearance,), "an Appearance, or None")
    check_callable("progress", progress)
    size = _checked_size(SIZES[suffix] if size is None else size)
    fps = _checked_rate("fps", RATES[suffix] if fps is None else fps, FASTEST[suffix])
    speed = _checked_rate("speed", speed, 1000.0)
    source, recording = read_source(recording, appearance), finite_part(recording)
    film = film_of(recording, source, fps=fps, speed=speed)
    missing = lack(suffix)
    if missing is not None:
        raise InvalidInput(f"{missing.sentence}.", hint=missing.advice)
    camera = film_camera(film, picture_size(film, size))
    sheet = Sheet(recording, film, camera, size, speed)
    with painted(scene(film, camera), gl_backend() or "") as pictures:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise cannot_write(path, error) from None
        with new_file(path, option="--video FILE", force=force) as place:
            encode(_frames(sheet, pictures, len(film.time), progress), place, fps)
    return path


def _frames(
    sheet: Sheet, pictures: Iterator[np.ndarray], count: int, progress: Progress | None
) -> Iterator[Image.Image]:
    for number, picture in enumerate(pictures):
        yield sheet.frame(number, picture)
        if progress is not None:
            progress(number + 1, count)


def check_video(path: str | Path, *, force: bool = False) -> Path:
    """Refuse a file into which no video can be written; to be asked before a run starts.

    Args:
        path: The file; folders above it may be absent.
        force: Whether an older file of that name may be replaced.

    Returns:
        The file.

    Raises:
        InvalidInput: It is of another kind, or exists and may not be replaced.
        OutputError: It cannot be made there.
    """
    path = path_of("path", path)
    if path.suffix.lower() not in SIZES:
        raise InvalidInput(
            f'"{path}" does not end in {" or ".join(SIZES)}; a video must.',
            hint=f'"{path.with_suffix(".mp4") if path.name else "walk.mp4"}"',
        )
    try:
        folder, exists = path.is_dir(), path.exists() or path.is_symlink()
        parent = path.resolve().parent
        while not parent.exists():
            parent = parent.parent
    except OSError as error:
        raise cannot_write(path, error) from None
    if folder:
        raise InvalidInput(f"{path} is a folder; nothing was written.", hint="a file's name")
    if exists and not force:
        raise AlreadyExists(path, option="--video FILE")
    if not parent.is_dir():
        raise OutputError(f"cannot write {path}: {parent} is not a folder.")
    if not os.access(parent, os.W_OK | os.X_OK):
        raise OutputError(f"cannot write {path}: {parent} is not writable.")
    return path


def _checked_size(size: object) -> tuple[int, int]:
    must = "a width and a height in pixels"
    check_type("size", size, (tuple, list), must)
    assert isinstance(size, tuple | list)
    if len(size) != 2:
        raise InvalidInput(f"size has {len(size)} values; it must be {must}.")
    for name, pixels, low, high in zip(("width", "height"), size, SMALLEST, LARGEST, strict=True):
        whole = isinstance(pixels, int | np.integer) and not isinstance(pixels, bool)
        if not whole or not low <= pixels <= high or pixels % 2:
            raise InvalidInput(
                f"the video's {name} is {pixels!r:.40}; it must be an even number of pixels from "
                f"{low} to {high}."
            )
    return int(size[0]), int(size[1])


def _checked_rate(name: str, value: object, most: float) -> float:
    check_number(name, value)
    assert isinstance(value, int | float | np.number)
    if not 0 < float(value) <= most:
        raise InvalidInput(f"{name} is {value}; it must be greater than 0 and {most:g} or less.")
    return float(value)
