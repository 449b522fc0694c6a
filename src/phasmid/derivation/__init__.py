"""The leg's equations of motion derived in symbols, by Newton-Euler and by Lagrange.

It needs sympy (``pip install sympy``, or this package with its extra ``derivation``).
``python -m phasmid.derivation`` derives Eq. 10 both ways and prints it, corrected, in the paper's
form.
"""

from phasmid.errors import InvalidInput

try:
    from phasmid.derivation.symbolic import (
        SymbolicMatrices,
        lagrange,
        mid_length,
        newton_euler,
        paper_form,
        paper_text,
    )
except ModuleNotFoundError as error:
    raise InvalidInput(
        "the derivation needs sympy, which is not installed.", hint="pip install sympy"
    ) from error

__all__ = ["SymbolicMatrices", "lagrange", "mid_length", "newton_euler", "paper_form", "paper_text"]
