"""What this machine lacks for a video, found out without risk to the program that asks.

A broken driver can crash whoever asks it, and a wrong ``MUJOCO_GL`` breaks the import of the
engine; so the question is put to a process of its own, which may end as it likes.
"""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

TIMEOUT = 40.0
"""Longest time that one way to draw is waited for [s]."""

OFF = ("disable", "disabled", "off", "false", "0")
"""Values of ``MUJOCO_GL`` by which a user forbids all drawing."""

PACKAGES = {"OpenGL": "PyOpenGL", "av": "PyAV"}
"""Modules of the extra ``video``, and what they are called."""

if sys.platform != "linux":
    PACKAGES["glfw"] = "glfw"

ENCODERS = ("libx264", "libopenh264", "h264_videotoolbox", "h264_mf", "h264_nvenc")
"""Encoders of H.264, the best first."""

EXTRA = 'pip install "phasmid[video]"'

TRIAL = """
import mujoco

body = '<mujoco><worldbody><light pos="0 0 3"/><geom size="1"/></worldbody></mujoco>'
model = mujoco.MjModel.from_xml_string(body)
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
renderer = mujoco.Renderer(model, 32, 32)
renderer.update_scene(data)
picture = renderer.render()
print("drawn" if picture.max() > picture.min() else "blank", flush=True)
"""


@dataclass(frozen=True)
class Lack:
    """What a video needs and this machine does not have.

    Attributes:
        what: That thing, to stand after "needs": ``PyAV``, ``EGL or OSMesa``.
        advice: What to install.
        why: What became of it.
    """

    what: str
    advice: str
    why: str = "which was not found"

    @property
    def sentence(self) -> str:
        """What is missing, without a full stop."""
        return f"video needs {self.what}, {self.why}"


def lack(suffix: str = ".mp4") -> Lack | None:
    """What is missing for a video, or None where nothing is.

    Args:
        suffix: Of the file: ``.mp4`` or ``.gif``; only the first needs an encoder.
    """
    needed = [module for module in PACKAGES if module != "av" or suffix == ".mp4"]
    missing = [PACKAGES[module] for module in needed if find_spec(module) is None]
    if missing:
        why = "which was not found" if len(missing) == 1 else "which were not found"
        return Lack(" and ".join(missing), EXTRA, why)
    if suffix == ".mp4" and h264_encoder() is None:
        return Lack("an H.264 encoder in PyAV", EXTRA)
    if gl_backend() is None:
        return _no_drawing()
    return None


@cache
def h264_encoder() -> str | None:
    """Name of PyAV's encoder for MP4, or None."""
    try:
        import av
    except Exception:
        # A package that is broken is as good as none.
        return None
    return next((name for name in ENCODERS if name in av.codecs_available), None)


@cache
def gl_backend() -> str | None:
    """Value of ``MUJOCO_GL`` by which the engine can draw here, or None; asked once."""
    if find_spec("OpenGL") is None:
        return None
    return next((name for name in candidates() if _draws(name)), None)


def candidates() -> tuple[str, ...]:
    """Values of ``MUJOCO_GL`` to try, the user's own first; none where the user forbids it."""
    own = os.environ.get("MUJOCO_GL", "").lower().strip()
    if own in OFF:
        return ()
    kinds = {"linux": ("egl", "osmesa"), "darwin": ("cgl", "glfw")}.get(sys.platform, ("glfw",))
    return tuple(dict.fromkeys((own, *kinds) if own else kinds))


def child_environment(backend: str) -> dict[str, str]:
    """Environment of a process that draws: as this one's, with its way to draw and its modules."""
    environment = {k: v for k, v in os.environ.items() if k != "PYOPENGL_PLATFORM"}
    places = [str(Path(place).resolve()) for place in sys.path if place]
    return environment | {"MUJOCO_GL": backend, "PYTHONPATH": os.pathsep.join(places)}


def _draws(backend: str) -> bool:
    """Whether the engine draws this way, asked of a process that may crash or hang."""
    try:
        done = subprocess.run(  # noqa: S603
            [sys.executable, "-P", "-c", TRIAL],
            env=child_environment(backend),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=TIMEOUT,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return done.returncode == 0 and done.stdout.strip() == b"drawn"


def _no_drawing() -> Lack:
    own = os.environ.get("MUJOCO_GL", "").lower().strip()
    if own in OFF:
        return Lack("OpenGL", "unset MUJOCO_GL", f"which MUJOCO_GL={own} forbids")
    if sys.platform == "linux":
        advice = "apt install libegl1 libgl1-mesa-dri, or libosmesa6"
        return Lack("OpenGL without a window (EGL or OSMesa)", advice)
    return Lack("OpenGL", "a driver of the graphics card")
