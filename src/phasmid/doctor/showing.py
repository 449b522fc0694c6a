"""What shows a walk: figures, the page of a run, video."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec

from phasmid.doctor.computing import reason
from phasmid.doctor.finding import Finding, State

BROWSERS = ("firefox", "chromium", "chromium-browser", "google-chrome", "microsoft-edge", "brave")
"""Names of browsers that can show the page of a run and the studio, as Linux calls them."""

TRIAL = """
from phasmid.reporting.renderer import gl_backend, opengl_lack
lack = opengl_lack()
print(gl_backend(), lack.what if lack else "", lack.advice if lack else "", sep="\\n", flush=True)
"""
"""Prints the GL backend, what it lacks, and the remedy, on a line each."""

TIMEOUT = 40.0
"""Longest time that a driver may take [s]."""

WAYS = {"egl": "EGL, without a window", "osmesa": "OSMesa, on the processor", "cgl": "CGL"}
"""What the engine draws with, by the values of ``MUJOCO_GL``."""


def figures() -> Finding:
    """Whether figures can be drawn."""
    topic = "figures"
    if find_spec("matplotlib") is None:
        what = "matplotlib is not installed"
        return Finding(topic, State.ABSENT, what, "pip install matplotlib", needed=True)
    try:
        matplotlib = import_module("matplotlib")
        for kind in ("svg", "agg"):
            import_module(f"matplotlib.backends.backend_{kind}")
        import_module("phasmid.reporting")
    except Exception as error:
        what = f"figures cannot be drawn: {reason(error)}"
        remedy = "pip install --force-reinstall phasmid"
        return Finding(topic, State.BROKEN, what, remedy, needed=True)
    return Finding(topic, State.READY, f"matplotlib {matplotlib.__version__}", needed=True)


def page() -> Finding:
    """Whether a browser is here that can show the page of a run and the studio."""
    topic = "page"
    if sys.platform in ("darwin", "win32"):
        return Finding(topic, State.READY, "the system's browser shows report.html and the studio")
    name = next(filter(shutil.which, BROWSERS), "")
    if not name:
        what = "no browser was found; report.html opens in that of any machine"
        return Finding(topic, State.ABSENT, what, "install firefox or chromium")
    display = any(os.environ.get(key) for key in ("DISPLAY", "WAYLAND_DISPLAY"))
    here = "" if display else ", once there is a display"
    return Finding(topic, State.READY, f"{name} shows report.html and the studio{here}")


def drawing() -> Finding:
    """Whether the engine can draw; tried in a process of its own, as drivers may crash or hang."""
    topic, purpose = "OpenGL", "pictures of the robot and videos"
    try:
        done = subprocess.run(  # noqa: S603
            [sys.executable, "-P", "-c", TRIAL],
            env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=TIMEOUT,
            check=False,
        )
        backend, what, advice = done.stdout.split("\n")[:3]
    except (OSError, ValueError, subprocess.TimeoutExpired):
        advice = "MUJOCO_GL=osmesa, or MUJOCO_GL=off"
        return Finding(topic, State.BROKEN, f"{purpose}: the driver crashes or hangs", advice)
    if what:
        return Finding(topic, State.ABSENT, f"{purpose}: they need {what}", advice)
    return Finding(topic, State.READY, f"{purpose}: drawn by {WAYS.get(backend, backend)}")
