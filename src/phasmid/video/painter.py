"""Pictures of a scene, drawn by a process of its own while they are looked at."""

from __future__ import annotations

import io
import queue
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np
from jaxtyping import UInt8

from phasmid.errors import OutputError, plain
from phasmid.video.probe import child_environment

SCRIPT = Path(__file__).with_name("draw.py")
"""What that process runs; as a file, so that it loads the engine and nothing of ours."""

AHEAD = 6
"""Pictures that are drawn before they are asked for."""

Pixels = UInt8[np.ndarray, "height width 3"]


@contextmanager
def painted(scene: Mapping[str, np.ndarray], backend: str) -> Iterator[Iterator[Pixels]]:
    """The pictures of a scene, one after the other.

    Args:
        scene: As `phasmid.video.film.scene` tells it.
        backend: Value of ``MUJOCO_GL``.

    Raises:
        OutputError: The process that draws ended early.
    """
    width, height = (int(n) for n in scene["size"])
    packed = io.BytesIO()
    arrays: dict[str, Any] = dict(scene)
    np.savez(packed, **arrays)
    with tempfile.TemporaryFile() as words, tempfile.TemporaryFile() as told:
        told.write(packed.getvalue())
        told.seek(0)
        process = subprocess.Popen(  # noqa: S603
            [sys.executable, "-P", str(SCRIPT)],
            env=child_environment(backend),
            stdin=told,
            stdout=subprocess.PIPE,
            stderr=words,
        )
        assert process.stdout is not None
        done: queue.Queue[bytes] = queue.Queue(AHEAD)
        stopped = threading.Event()
        reader = threading.Thread(
            target=_read, args=(process.stdout, 3 * width * height, done, stopped), daemon=True
        )
        reader.start()
        try:
            yield _pictures(done, len(scene["eye"]), (height, width, 3), process, words)
        finally:
            stopped.set()
            process.kill()
            process.wait()
            reader.join()
            process.stdout.close()


def _read(stream: IO[bytes], size: int, done: queue.Queue[bytes], stopped: threading.Event) -> None:
    """Read pictures until there are no more; the last one is short."""
    while not stopped.is_set():
        picture = stream.read(size)
        while not stopped.is_set():
            try:
                done.put(picture, timeout=0.1)
                break
            except queue.Full:
                pass
        if len(picture) < size:
            return


def _pictures(
    done: queue.Queue[bytes],
    count: int,
    shape: tuple[int, int, int],
    process: subprocess.Popen[bytes],
    words: IO[bytes],
) -> Iterator[Pixels]:
    for _ in range(count):
        picture = done.get()
        if len(picture) < int(np.prod(shape)):
            process.wait()
            words.seek(0)
            said = words.read()[-4000:].decode(errors="replace").strip().splitlines()
            reason = plain(said[-1])[:200] if said else f"it ended with {process.returncode}"
            raise OutputError(f"the video could not be drawn: {reason}.")
        yield np.frombuffer(picture, dtype=np.uint8).reshape(shape)
