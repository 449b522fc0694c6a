"""The engine whose functions and structures are known by their addresses."""

from __future__ import annotations

import mujoco

ENGINE = (4, 0)
"""Its version."""


def check_engine() -> None:
    """Refuse an engine of another version, before anything of it is touched.

    Raises:
        ImportError: The engine's package or its library is of another version.
    """
    package = tuple(mujoco.__version__.split(".")[:2])
    library = divmod(mujoco.mj_version() // 1000, 1000)
    if package != tuple(map(str, ENGINE)) or library != ENGINE:
        raise ImportError(f"MuJoCo {mujoco.__version__} may be laid out in another way")
