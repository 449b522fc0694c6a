"""The CAD library, which is optional and slow to load; it is imported here alone."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from phasmid.errors import PhasmidError
from phasmid.extras import install_hint


@cache
def build123d() -> Any:
    """Import and return build123d.

    Raises:
        PhasmidError: It is not installed, or cannot be loaded.
    """
    check_installed()
    try:
        return import_module("build123d")
    except ImportError as error:
        # The cause shows an import that Ctrl-C interrupted.
        reason = " ".join(str(error).split())[:160]
        raise PhasmidError(f"build123d is installed and cannot be loaded: {reason}.") from error


def check_installed() -> None:
    """Refuse to go on without the library; it is not loaded, which takes seconds."""
    if find_spec("OCP") is None or find_spec("build123d") is None:
        raise PhasmidError(
            "solids and STEP files need build123d, which is not installed.",
            hint=install_hint("cad"),
        )
