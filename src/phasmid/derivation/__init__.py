"""The leg's equations of motion derived in symbols, by Newton-Euler and by Lagrange.

It needs sympy (``pip install sympy``, or this package with its extra ``derivation``).
``python -m phasmid.derivation`` derives Eq. 10 both ways and prints it, corrected, in the paper's
form.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from phasmid.errors import InvalidInput

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


# A package that needs sympy to be imported could not be run as a program without it.
def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        symbolic = import_module(f"{__name__}.symbolic")
    except ModuleNotFoundError as error:
        raise InvalidInput(
            "the derivation needs sympy, which is not installed.", hint="pip install sympy"
        ) from error
    return getattr(symbolic, name)


def __dir__() -> list[str]:
    return [*globals(), *__all__]
