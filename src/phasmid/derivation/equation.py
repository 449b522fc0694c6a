"""The derived matrices written as the paper writes them: mid-length links, sums of angles."""

from __future__ import annotations

from collections.abc import Iterator

import sympy as sp
from sympy.simplify.fu import TR8

from phasmid.derivation.leg import ANGLES, LENGTHS, LINKS, SymbolicMatrices
from phasmid.derivation.normal_form import normal_form

PRINTED_ANGLES = sp.symbols("theta2 theta3", real=True)
"""θ2 and θ3 as they stand inside the printed sines and cosines: θ3 is minus that of Table 1."""

_SUMS = ((2, 0), (2, -2), (1, 0), (0, 1), (1, -1), (2, -1))
"""The paper's sums of angles, in its order: how often each contains θ2 and θ3."""


def mid_length(matrices: SymbolicMatrices) -> SymbolicMatrices:
    """The matrices for centres of mass at mid-length and principal inertias only.

    Args:
        matrices: For any mass distribution, from ``newton_euler`` or ``lagrange``.

    Source: what Eq. 10 assumes without saying so.
    """
    special: dict[sp.Expr, sp.Expr] = {}
    for link, length in zip(LINKS, LENGTHS, strict=True):
        special |= dict(zip(link.com, (length / 2, sp.S.Zero, sp.S.Zero), strict=True))
        special |= {link.inertia[i, j]: sp.S.Zero for i, j in ((0, 1), (0, 2), (1, 2))}
    return SymbolicMatrices(*(normal_form(part.subs(special)) for part in matrices))


def paper_form(matrices: SymbolicMatrices) -> SymbolicMatrices:
    """Mid-length matrices grouped as in Eq. 10: one bracket for each sum of angles.

    Args:
        matrices: From ``mid_length``.

    Returns:
        The same matrices in θ2 and θ3 of the printed sines and cosines (``PRINTED_ANGLES``).
    """
    return SymbolicMatrices(
        *(part.applyfunc(lambda e: sp.Add(*(a * b for a, b in _terms(e)))) for part in matrices)
    )


def paper_text(matrices: SymbolicMatrices) -> str:
    """Eq. 10 in words of one line for each entry that is not zero.

    Args:
        matrices: From ``mid_length``.
    """
    lines = []
    for name, part in zip("mbc", matrices[:3], strict=True):
        lines += [
            f"{name}{i + 1}{j + 1} = {_text(part[i, j])}"
            for i in range(3)
            for j in range(3)
            if part[i, j] != 0
        ]
    lines += [f"g{i + 1} = {_text(e)}" for i, e in enumerate(matrices.G) if e != 0]
    return "\n".join(lines)


def _terms(entry: sp.Expr) -> Iterator[tuple[sp.Expr, sp.Expr]]:
    """Functions of the angles and their coefficients other than zero, in the paper's order."""
    theta2, theta3 = PRINTED_ANGLES
    rest = sp.expand(TR8(entry.subs({ANGLES[1]: theta2, ANGLES[2]: -theta3})))
    found: list[tuple[sp.Expr, sp.Expr]] = []
    for a, b in _SUMS:
        for function in (sp.cos, sp.sin):
            wave = function(a * theta2 + b * theta3)
            coefficient = rest.coeff(wave)
            rest = sp.expand(rest - coefficient * wave)
            if wave == sp.cos(2 * theta2):
                # The paper writes this one as a square.
                found.append((sp.cos(theta2) ** 2, 2 * coefficient))
                rest = sp.expand(rest - coefficient)
            elif a == 2 and sp.S.Half in {
                abs(coefficient.coeff(s)) for s in coefficient.free_symbols
            }:
                found.append((wave / 2, 2 * coefficient))
            else:
                found.append((wave, coefficient))
    assert not rest.has(sp.cos, sp.sin)
    squares = [length**2 for length in LENGTHS[:2]]
    terms = [(sp.S.One, sp.collect(rest, squares))]
    terms += [(function, sp.factor_terms(coefficient)) for function, coefficient in found]
    yield from ((function, coefficient) for function, coefficient in terms if coefficient != 0)


def _text(entry: sp.Expr) -> str:
    words = ""
    for function, coefficient in _terms(entry):
        if function == 1:
            words = _symbols(coefficient)
            continue
        negative = coefficient.could_extract_minus_sign() and not coefficient.is_Add
        size = -coefficient if negative else coefficient
        inside = f"({_symbols(size)})" if size.is_Add else _symbols(size)
        sign = (" - " if negative else " + ") if words else ("-" if negative else "")
        words += f"{sign}{_symbols(function)} {inside}"
    return words


def _symbols(expression: sp.Expr) -> str:
    text = sp.sstr(expression)
    for old, new in (("**2", "²"), ("*", " "), ("theta", "θ"), ("(θ2)²", "²θ2"), ("2 θ", "2θ")):
        text = text.replace(old, new)
    return text
