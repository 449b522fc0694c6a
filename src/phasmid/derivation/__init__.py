"""The leg's equations of motion derived in symbols, by Newton-Euler and by Lagrange.

It needs sympy (``pip install sympy``, or this package with its extra ``derivation``).
``python -m phasmid.derivation`` derives Eq. 10 both ways and prints it, corrected, in the paper's
form.
"""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from phasmid.errors import PhasmidError

if TYPE_CHECKING:
    from phasmid.derivation.symbolic import (
        SymbolicMatrices,
        lagrange,
        mid_length,
        newton_euler,
        paper_form,
        paper_text,
    )

__all__ = ["SymbolicMatrices", "lagrange", "mid_length", "newton_euler", "paper_form", "paper_text"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'phasmid.derivation' has no attribute {name!r}")
    if find_spec("sympy") is None:
        raise PhasmidError(
            "the derivation needs sympy, which is not installed.",
            where="phasmid.derivation",
            hint="pip install sympy",
        )
    return getattr(import_module("phasmid.derivation.symbolic"), name)
