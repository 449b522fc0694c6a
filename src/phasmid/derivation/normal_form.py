"""One way only of writing a polynomial in the sines and cosines of the joint angles."""

from __future__ import annotations

import sympy as sp
from sympy.polys.rings import PolyElement, PolyRing

from phasmid.derivation.leg import ACCELERATIONS, ANGLES, GRAVITY, LENGTHS, LINKS, SPEEDS

_COSINES = tuple(sp.cos(q) for q in ANGLES)
_SINES = tuple(sp.sin(q) for q in ANGLES)
_NUMBERS = sorted(
    {s for link in LINKS for s in (link.mass, *link.com, *link.inertia)}, key=lambda s: str(s.name)
)
_RING = PolyRing([*_COSINES, *_SINES, *SPEEDS, *ACCELERATIONS, *LENGTHS, GRAVITY, *_NUMBERS], sp.QQ)
_COSINE, _SINE = _RING.gens[:3], _RING.gens[3:6]


def normal_form(matrix: sp.Matrix) -> sp.Matrix:
    """The same matrix with each entry a polynomial in which no sine has a higher power than one.

    Cosine and sine of an angle obey cos² + sin² = 1 and no other algebraic law. Writing 1 - cos²
    for every sin² therefore leaves one way of writing each function: two expressions are equal for
    all angles and all numbers of the leg exactly if their normal forms are the same.

    Args:
        matrix: Entries are polynomials, with rational coefficients, in the symbols of ``leg`` and
            the sines and cosines of its angles.
    """
    return matrix.applyfunc(lambda entry: _reduced(_RING.from_expr(sp.sympify(entry))).as_expr())


def _reduced(polynomial: PolyElement) -> PolyElement:
    for k in range(3):
        square = 1 - _COSINE[k] ** 2
        place = 3 + k
        rest = _RING.zero
        for powers, coefficient in polynomial.terms():
            halves, left = divmod(powers[place], 2)
            lowered = (*powers[:place], left, *powers[place + 1 :])
            term = _RING.from_dict({lowered: coefficient})
            rest += term * square**halves if halves else term
        polynomial = rest
    return polynomial
