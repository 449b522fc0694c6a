"""The CAD library, which is optional and slow to load: it is asked for here and nowhere else."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import Any

from phasmid.errors import PhasmidError


@cache
def build123d() -> Any:
    """The package build123d.

    Raises:
        PhasmidError: It is not installed.
    """
    return _library("build123d")


@cache
def occt(name: str) -> Any:
    """A module of the geometry kernel beneath build123d, such as ``XCAFDoc``.

    Raises:
        PhasmidError: It is not installed.
    """
    return _library(f"OCP.{name}")


def _library(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        raise PhasmidError(
            "solids and STEP files need build123d, which is not installed.",
            hint='pip install "phasmid[cad]"',
        ) from None
