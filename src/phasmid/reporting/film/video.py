"""Recordings as videos."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path

from phasmid.arguments import checked
from phasmid.errors import InvalidInput
from phasmid.extras import install_hint
from phasmid.recording import Recording
from phasmid.recording.file import cannot_write, check_new_file
from phasmid.reporting.film.encoder import encode
from phasmid.reporting.film.film import camera_of, frames_of, square_side
from phasmid.reporting.film.frame import FrameFigure, Pixels, picture_size
from phasmid.reporting.renderer import SceneRenderer, opengl_lack
from phasmid.reporting.robot_mesh import body_pose
from phasmid.reporting.run import Run, read_run
from phasmid.reporting.style import styled
from phasmid.robot import Appearance

SIZES = {".mp4": (1280, 720), ".gif": (640, 360)}
RATES = {".mp4": 30.0, ".gif": 15.0}
"""Width and height [pixels], and frames per second, of each kind of file."""

SMALLEST, LARGEST = (320, 240), (3840, 2160)
"""Least and largest width and height [pixels]."""

FASTEST = {".mp4": 120.0, ".gif": 50.0}
"""Most frames per second."""

Progress = Callable[[int, int], object]
"""Function called with the number of finished frames and of all frames."""


@checked
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

    Args:
        recording: Recording with the body's pose and joint angles, simulated or planned.
        path: The file, ``.mp4`` or ``.gif``.
        appearance: The robot's meshes, where they do not come with phasmid.
        size: Width and height [pixels]; by default 1280 by 720, of a GIF 640 by 360.
        fps: Frames per second; by default 30, of a GIF 15.
        speed: Recorded seconds per second of the video.
        force: Replace an older file of that name.
        progress: Function called with the number of finished frames and of all frames.

    Returns:
        The file.

    Raises:
        InvalidInput: The file exists or is of another kind; the pose is not recorded; PyAV or
            OpenGL is missing.
        OutputError: The file cannot be written; nothing is left behind.
    """
    path = check_video(path, force=force)
    suffix = path.suffix.lower()
    size = _checked_size(SIZES[suffix] if size is None else size)
    fps = _checked_rate("fps", RATES[suffix] if fps is None else fps, FASTEST[suffix])
    speed = _checked_rate("speed", speed, 1000.0)
    run = read_run(recording, appearance)
    frames = frames_of(run, fps=fps, speed=speed)
    missing = opengl_lack()
    if missing is not None:
        raise InvalidInput(f"{missing.sentence}.", hint=missing.advice)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(path, error) from None
    with styled():
        pixels = _draw(run, frames, size, speed, progress)
        encode(pixels, path, fps, len(frames.time))
    return path


def _draw(
    run: Run, frames: Run, size: tuple[int, int], speed: float, progress: Progress | None
) -> Iterator[Pixels]:
    view, displacement = camera_of(frames, picture_size(run, size))
    figure = FrameFigure(run, frames, size, speed)
    position, orientation, q = frames.pose("a video")
    X_world_body, square = (
        body_pose(position, orientation),
        square_side(run.experiment.course.stride.step_length),
    )
    terrain, count = run.experiment.world.terrain, len(frames.time)
    with closing(SceneRenderer(run.robot, terrain, position[:, :2], view, square)) as renderer:
        for number in range(count):
            moved = view.moved(displacement[number])
            picture = renderer.picture(moved, X_world_body[number], q[number])
            yield figure.frame(number, picture, moved)
            if progress is not None:
                progress(number + 1, count)


def check_video(path: str | Path, *, force: bool = False) -> Path:
    """Raise where no video can be written to a file, before a run starts.

    Args:
        path: The file; folders above it may be absent.
        force: Replace an older file of that name.

    Returns:
        The file.

    Raises:
        InvalidInput: It is of another kind, or exists and may not be replaced; it is an MP4, and
            PyAV is missing.
        OutputError: It cannot be made there.
    """
    path = Path(path)
    if path.suffix.lower() not in SIZES:
        raise InvalidInput(
            f'"{path}" does not end in {" or ".join(SIZES)}; a video must.',
            hint=f'"{path.with_suffix(".mp4") if path.name else "walk.mp4"}"',
        )
    if path.suffix.lower() == ".mp4" and find_spec("av") is None:
        raise InvalidInput(
            "a video as .mp4 needs PyAV, which was not found.",
            hint=f"{install_hint('video')}, or a .gif",
        )
    check_new_file(path, option="--video FILE", force=force)
    return path


def _checked_size(size: tuple[int, int]) -> tuple[int, int]:
    width, height = size
    for name, pixels, low, high in zip(("width", "height"), size, SMALLEST, LARGEST, strict=True):
        if not low <= pixels <= high or pixels % 2:
            raise InvalidInput(
                f"the video's {name} is {pixels}; it must be an even number of pixels from "
                f"{low} to {high}."
            )
    return int(width), int(height)


def _checked_rate(name: str, value: float, most: float) -> float:
    if not 0 < value <= most:
        raise InvalidInput(f"{name} is {value}; it must be greater than 0 and {most:g} or less.")
    return float(value)
