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
    from phasmid.derivation.energy import lagrange
    from phasmid.derivation.equation import mid_length, paper_form, paper_text
    from phasmid.derivation.leg import SymbolicMatrices
    from phasmid.derivation.recursion import newton_euler

_MODULE_OF = {
    "SymbolicMatrices": "leg",
    "lagrange": "energy",
    "mid_length": "equation",
    "newton_euler": "recursion",
    "paper_form": "equation",
    "paper_text": "equation",
}

__all__ = [
    "SymbolicMatrices",
    "lagrange",
    "mid_length",
    "newton_euler",
    "paper_form",
    "paper_text",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'phasmid.derivation' has no attribute {name!r}")
    if find_spec("sympy") is None:
        raise PhasmidError(
            "the derivation needs sympy, which is not installed; "
            "it must be there to derive equations in symbols.",
            where="phasmid.derivation",
            hint="pip install sympy",
        )
    return getattr(import_module(f"phasmid.derivation.{_MODULE_OF[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
