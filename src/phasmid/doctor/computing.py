"""What computes: the machine, Python, the engine, and the compiler."""

from __future__ import annotations

import os
import platform
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from phasmid.doctor.finding import Finding, State
from phasmid.doctor.packages import version_of

GIB = 2**30

LIMIT = Path("/sys/fs/cgroup/memory.max")
"""Where Linux keeps the limit of a container's memory."""


def machine() -> Finding:
    """The system, its cores and its memory."""
    from phasmid.cores import cores

    count = cores()
    told = [f"{platform.system()} {platform.machine()}", f"{count} core{'s' * (count != 1)}"]
    total = memory()
    if total:
        told.append(f"{total / GIB:.1f} GiB of memory")
    return Finding("machine", State.READY, ", ".join(told))


def memory() -> int:
    """Memory that this process may use, where the system tells [bytes]; 0 where it does not."""
    try:
        total = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return 0
    try:
        allowed = LIMIT.read_text(encoding="ascii").strip()
    except (OSError, ValueError):
        allowed = ""
    return min(total, int(allowed)) if allowed.isdigit() else total


def python() -> Finding:
    """Python, and this package."""
    here = version_of("phasmid")
    what = f"{platform.python_implementation()} {platform.python_version()}"
    told = here or "run from its source"
    return Finding("Python", State.READY, f"{what}, phasmid {told}")


def engine() -> Finding:
    """Whether the engine makes a step, and in which loop."""
    topic = "engine"
    if find_spec("mujoco") is None:
        what = "MuJoCo, the physics engine, is not installed"
        return Finding(topic, State.ABSENT, what, "pip install mujoco-core", needed=True)
    try:
        import mujoco

        model = mujoco.MjModel.from_xml_string("<mujoco/>")
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data)
        import_module("phasmid.simulation")
    except Exception as error:
        # A package whose parts do not fit each other raises anything.
        what = f"the simulation does not start: {reason(error)}"
        forced = "MUJOCO_GL" in str(error)
        remedy = "unset MUJOCO_GL" if forced else "pip install --force-reinstall phasmid"
        return Finding(topic, State.BROKEN, what, remedy, needed=True)
    return Finding(topic, State.READY, f"MuJoCo {mujoco.__version__}", needed=True)


def compiler() -> Finding:
    """Return whether numba compiles the equations and loops, and whether it caches them."""
    topic, purpose = "compiler", "equations and loops as machine code"
    if find_spec("numba") is None:
        what = f"{purpose}: numba is not installed"
        return Finding(topic, State.ABSENT, what, "pip install numba", needed=True)
    try:
        numba = import_module("numba")
    except Exception as error:
        what = f"{purpose}: numba does not load: {reason(error)}"
        return Finding(topic, State.BROKEN, what, "pip install numba", needed=True)
    version = f"{purpose}: numba {numba.__version__}"
    if numba.config.DISABLE_JIT:
        what = f"{version} is put out by NUMBA_DISABLE_JIT"
        return Finding(topic, State.BROKEN, what, "unset NUMBA_DISABLE_JIT", needed=True)
    try:
        # Nothing is compiled before the first call.
        numba.njit(cache=True)(compiler)
    except Exception:
        what = (
            f"{version}, which compiles anew in every run: "
            "no folder can be written to that would keep it"
        )
        remedy = "set NUMBA_CACHE_DIR to a folder that can be written to"
        return Finding(topic, State.READY, what, remedy, needed=True)
    return Finding(topic, State.READY, f"{version}, which keeps what it compiles", needed=True)


def reason(error: Exception) -> str:
    """An error's first line, cut where it is long."""
    lines = str(error).strip().splitlines()
    said = lines[0] if lines else type(error).__name__
    return said if len(said) <= 120 else f"{said[:119]}…"
