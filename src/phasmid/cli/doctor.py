"""``phasmid doctor``: list what this machine supports, and how to install the rest."""

from __future__ import annotations

import argparse
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module, metadata
from typing import Literal, NamedTuple

from phasmid.cli.output import has_display, say
from phasmid.errors import OutputError, plain
from phasmid.extras import install_hint

PURPOSES = {
    "cad": "solids and STEP files",
    "hardware": "real servos on a serial bus",
    "learn": "learned policies and their training",
    "live": "runs live in Foxglove",
    "ray": "studies on a Ray cluster",
    "search": "studies by an optimiser",
    "studio": "the live page",
    "study": "studies of many runs",
    "video": "videos of walks",
}
"""Extras of phasmid."""

BROWSERS = ("firefox", "chromium", "chromium-browser", "google-chrome", "microsoft-edge", "brave")

RENDERER = """
from phasmid.reporting.renderer import gl_backend, opengl_lack
lack = opengl_lack()
print(gl_backend(), lack.what if lack else "", lack.advice if lack else "", sep="\\n", flush=True)
"""
"""Prints the OpenGL backend, what it lacks, and the remedy, on a line each."""

TIMEOUT = 40.0
"""Longest time that a graphics driver may take [s]."""

OPTIONS: dict[str, str] = {}


class Finding(NamedTuple):
    """Finding about one capability of the machine.

    Attributes:
        topic: The capability.
        state: ``ready``, ``absent`` or ``broken``.
        what: What is there, or what is missing and its purpose.
        remedy: A command or an action that helps; empty where nothing is to be done.
        needed: True where no robot walks without it.
    """

    topic: str
    state: Literal["ready", "absent", "broken"]
    what: str
    remedy: str = ""
    needed: bool = False


def run(_: argparse.Namespace) -> int:
    """Examine the machine, and return the exit status: 1 where no robot can walk."""
    findings = examine()
    faults = [one for one in findings if one.needed and one.state != "ready"]
    for one in findings:
        say(f"{one.topic:<11} {one.state:<7} {plain(one.what)}", indent=20)
        if one.remedy:
            say(f"{'':<19} try  {plain(one.remedy)}")
    if faults:
        sentence = f"nothing can walk here: {faults[0].topic}: {faults[0].what.rstrip('.')}."
        raise OutputError(sentence, hint=faults[0].remedy)
    say("robots can walk here.")
    return 0


def examine() -> list[Finding]:
    """Examine this machine, without a network and without changing anything."""
    return [
        _machine(),
        _packages("packages", "", "the packages that phasmid needs"),
        _attempt(
            "engine", "the simulation", _check_simulation, "pip install --force-reinstall phasmid"
        ),
        _attempt(
            "compiler", "numba", _check_compiler, "unset NUMBA_DISABLE_JIT, or pip install numba"
        ),
        _attempt("figures", "figures", _import_figures, "pip install --force-reinstall phasmid"),
        _browser(),
        *(_packages(extra, extra, purpose) for extra, purpose in PURPOSES.items()),
        _opengl(),
    ]


def _machine() -> Finding:
    from phasmid.cores import cores

    system = f"{platform.system()} {platform.machine()}, {cores()} cores"
    python = f"{platform.python_implementation()} {platform.python_version()}"
    return Finding("machine", "ready", f"{system}, {python}")


def _packages(topic: str, extra: str, purpose: str) -> Finding:
    """Compare the installed packages with those that phasmid, or an extra of it, requires."""
    from packaging.requirements import Requirement

    found, missing = [], []
    for line in metadata.requires("phasmid") or ():
        requirement = Requirement(line)
        marker = requirement.marker
        is_always = marker is None or marker.evaluate({"extra": ""})
        is_asked = marker is None or marker.evaluate({"extra": extra})
        if not is_asked or (extra and is_always):
            continue
        try:
            version = metadata.version(requirement.name)
        except metadata.PackageNotFoundError:
            missing.append(f"{requirement.name} is not installed")
            continue
        found.append(f"{requirement.name} {version}")
        if not requirement.specifier.contains(version, prereleases=True):
            missing.append(f"{found[-1]} is installed; it must be {requirement.specifier}")
    if missing:
        remedy = install_hint(extra) if extra else "pip install --upgrade phasmid"
        what = f"{purpose}: {'; '.join(missing)}"
        return Finding(topic, "absent", what, remedy, not extra)
    return Finding(topic, "ready", f"{purpose}: {', '.join(found)}", needed=not extra)


def _attempt(topic: str, purpose: str, work: Callable[[], str], remedy: str) -> Finding:
    """Return whether some work succeeds, without which no robot walks."""
    try:
        return Finding(topic, "ready", work(), needed=True)
    except Exception as error:
        # A package whose parts do not fit each other raises anything.
        lines = str(error).strip().splitlines() or [type(error).__name__]
        what = f"{purpose} does not start: {lines[0][:120]}"
        remedy = "unset MUJOCO_GL" if "MUJOCO_GL" in str(error) else remedy
        return Finding(topic, "broken", what, remedy, needed=True)


def _check_simulation() -> str:
    """Step an empty model, import the simulation, and return MuJoCo's version."""
    import mujoco

    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    mujoco.mj_step(model, mujoco.MjData(model))
    import_module("phasmid.simulation")
    return f"MuJoCo {mujoco.__version__}"


def _check_compiler() -> str:
    """Compile a function, and return numba's version."""
    numba = import_module("numba")
    if numba.config.DISABLE_JIT:
        raise RuntimeError("NUMBA_DISABLE_JIT is set")
    try:
        # Nothing is compiled before the first call.
        numba.njit(cache=True)(_check_compiler)
    except RuntimeError:
        return (
            f"numba {numba.__version__}, which compiles in every run; NUMBA_CACHE_DIR names a "
            "folder that can be written to"
        )
    return f"numba {numba.__version__}"


def _import_figures() -> str:
    for module in ("matplotlib.backends.backend_svg", "phasmid.reporting"):
        import_module(module)
    return f"matplotlib {metadata.version('matplotlib')}"


def _browser() -> Finding:
    own = "the system's browser" if sys.platform in ("darwin", "win32") else ""
    name = own or next(filter(shutil.which, BROWSERS), "")
    if not name:
        what = "no browser was found; report.html opens in that of any machine"
        return Finding("page", "absent", what, "install firefox or chromium")
    where = "" if has_display() else ", once there is a display"
    return Finding("page", "ready", f"{name} shows report.html and the studio{where}")


def _opengl() -> Finding:
    """Draw in a process of its own, because drivers may crash or hang."""
    purpose = "pictures of the robot and videos"
    try:
        done = subprocess.run(  # noqa: S603
            [sys.executable, "-P", "-c", RENDERER],
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
        return Finding("OpenGL", "broken", f"{purpose}: the driver crashes or hangs", advice)
    if what:
        return Finding("OpenGL", "absent", f"{purpose}: they need {what}", advice)
    return Finding("OpenGL", "ready", f"{purpose}: drawn by {backend.upper()}")
