"""The equations of motion of one leg in symbols, by Newton-Euler and by Lagrange.

The leg is the chain of Table 1. Both derivations give the matrices of Eq. 10 in one normal form,
so that they can be compared, and written as the paper writes them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import sympy as sp
from sympy.polys.rings import PolyRing
from sympy.simplify.fu import TR8

ANGLES = sp.symbols("q1 q2 q3", real=True)
"""Coxa, femur and tibia angle, signs of Table 1 [rad]."""

SPEEDS = sp.symbols("u1 u2 u3", real=True)
"""Their speeds [rad/s]."""

ACCELERATIONS = sp.symbols("a1 a2 a3", real=True)
"""Their accelerations [rad/s²]."""

LENGTHS = sp.symbols("L1 L2 L3", positive=True)
"""Lengths of coxa, femur and tibia [m]; that of the tibia counts only where its centre of mass
is placed by it."""

GRAVITY = sp.Symbol("g", real=True)
"""Acceleration of free fall, downwards along the hip's z [m/s²]."""


class SymbolicLink(NamedTuple):
    """One link in the axes of its own frame (Table 1, x along the link).

    Attributes:
        mass: Mass [kg], such as ``m2``.
        com: Centre of mass [m], such as ``x2, y2, z2``, shape (3, 1).
        inertia: About the centre of mass [kg·m²], such as ``I_xx2``; off-diagonal entries are
            those of the tensor, shape (3, 3).
    """

    mass: sp.Symbol
    com: sp.Matrix
    inertia: sp.Matrix


def _link(number: int) -> SymbolicLink:
    com = sp.symbols(f"x{number} y{number} z{number}", real=True)
    names = ("xx", "xy", "xz", "xy", "yy", "yz", "xz", "yz", "zz")
    tensor = [sp.Symbol(f"I_{name}{number}", real=True) for name in names]
    return SymbolicLink(
        sp.Symbol(f"m{number}", positive=True), sp.Matrix(com), sp.Matrix(3, 3, tensor)
    )


LINKS = (_link(1), _link(2), _link(3))
"""Coxa, femur and tibia."""

PAIRS = ((0, 1), (0, 2), (1, 2))
"""The joints whose speeds the columns of B multiply: q1' q2', q1' q3', q2' q3'."""


class SymbolicMatrices(NamedTuple):
    """The matrices of Eq. 10 in symbols, as `phasmid.dynamics.LegMatrices`; G has shape (3, 1)."""

    M: sp.Matrix
    B: sp.Matrix
    C: sp.Matrix
    G: sp.Matrix


def link_pose(k: int) -> tuple[sp.Matrix, sp.Matrix]:
    """Rotation (3, 3) and origin (3, 1) of link k's frame in the frame before it, k from 0.

    Source: Table 1 in modified Denavit-Hartenberg form (Craig), Eq. 1 corrected.
    """
    alpha, a = ((0, 0), (sp.pi / 2, LENGTHS[0]), (0, LENGTHS[1]))[k]
    ca, sa, c, s = sp.cos(alpha), sp.sin(alpha), sp.cos(ANGLES[k]), sp.sin(ANGLES[k])
    rotation = sp.Matrix([[c, -s, 0], [s * ca, c * ca, -sa], [s * sa, c * sa, ca]])
    return rotation, sp.Matrix([a, 0, 0])


_COSINES = tuple(sp.cos(q) for q in ANGLES)
_SINES = tuple(sp.sin(q) for q in ANGLES)
_NUMBERS = sorted(
    {s for link in LINKS for s in (link.mass, *link.com, *link.inertia)}, key=lambda s: str(s.name)
)
# In lexicographic order the squares of the sines lead these identities.
_RING = PolyRing([*_SINES, *_COSINES, *SPEEDS, *ACCELERATIONS, *LENGTHS, GRAVITY, *_NUMBERS], sp.QQ)
_PYTHAGORAS = [s**2 + c**2 - 1 for s, c in zip(_RING.gens[:3], _RING.gens[3:6], strict=True)]


def normal_form(matrix: sp.Matrix) -> sp.Matrix:
    """Return the matrix with polynomial entries, linear in every sine.

    Cosine and sine of an angle obey cos² + sin² = 1 and no other algebraic law. The remainder of
    the division by these identities is therefore the same for all expressions that are equal for
    all angles and all numbers of the leg.

    Args:
        matrix: Entries are polynomials, with rational coefficients, in the symbols of the
            leg and the sines and cosines of its angles.
    """
    return matrix.applyfunc(
        lambda entry: _RING.from_expr(sp.sympify(entry)).rem(_PYTHAGORAS).as_expr()
    )


def newton_euler() -> SymbolicMatrices:
    """Matrices of Eq. 10 from the forces and moments on the links, for any mass distribution.

    Speeds and accelerations run outwards from the hip, forces and moments inwards from the tibia;
    the torques are then sorted by accelerations and products of speeds. Entries are in normal form.

    Source: Luh, Walker, Paul 1980; the paper's own method.
    """
    torque = _torque()
    still = dict.fromkeys((*SPEEDS, *ACCELERATIONS), 0)

    def part(*variables: sp.Symbol) -> sp.Matrix:
        return torque.diff(*variables).subs(still)

    # The torques are linear in the accelerations and a quadratic form in the speeds.
    parts = (
        [part(a) for a in ACCELERATIONS],
        [part(SPEEDS[j], SPEEDS[k]) for j, k in PAIRS],
        [part(u, u) / 2 for u in SPEEDS],
        [torque.subs(still)],
    )
    return SymbolicMatrices(*(normal_form(sp.Matrix.hstack(*columns)) for columns in parts))


def _torque() -> sp.Matrix:
    """Joint torques for any motion, the hip at rest, shape (3, 1)."""
    zero, axis = sp.zeros(3, 1), sp.Matrix([0, 0, 1])
    # Gravity acts as if the hip accelerated upwards.
    w, dw, a = zero, zero, sp.Matrix([0, 0, GRAVITY])
    loads = []
    for k, link in enumerate(LINKS):
        R, p = link_pose(k)
        a = normal_form(R.T * (a + _carried(p, w, dw)))
        w, dw = R.T * w, R.T * dw
        dw = normal_form(dw + w.cross(axis) * SPEEDS[k] + axis * ACCELERATIONS[k])
        w = normal_form(w + axis * SPEEDS[k])
        force = normal_form(link.mass * (a + _carried(link.com, w, dw)))
        moment = normal_form(link.inertia * dw + w.cross(link.inertia * w) + link.com.cross(force))
        loads.append((force, moment))
    force, moment = zero, zero
    torque: list[sp.Expr] = []
    for k in (2, 1, 0):
        force, moment = force + loads[k][0], moment + loads[k][1]
        torque.insert(0, moment[2])
        R, p = link_pose(k)
        force = normal_form(R * force)
        moment = normal_form(R * moment + p.cross(force))
    return normal_form(sp.Matrix(torque))


def _carried(p: sp.Matrix, w: sp.Matrix, dw: sp.Matrix) -> sp.Matrix:
    """Acceleration of a point p of a turning body relative to the body's origin."""
    return dw.cross(p) + w.cross(w.cross(p))


def lagrange() -> SymbolicMatrices:
    """Matrices of Eq. 10 from the energies of the links, for any mass distribution.

    With the kinetic energy ½ q'ᵀ M q' and the potential energy V, Lagrange's equations give
    torque_i = Σ M_ij q_j" + Σ Γ_ijk q_j' q_k' + ∂V/∂q_i, where
    Γ_ijk = (∂M_ij/∂q_k + ∂M_ik/∂q_j - ∂M_jk/∂q_i) / 2 are Christoffel's symbols.
    Entries are in normal form.
    """
    kinetic, potential = _energies()
    M = normal_form(sp.hessian(kinetic, SPEEDS))

    def christoffel(i: int, j: int, k: int) -> sp.Expr:
        return (M[i, j].diff(ANGLES[k]) + M[i, k].diff(ANGLES[j]) - M[j, k].diff(ANGLES[i])) / 2

    rows = range(3)
    B = sp.Matrix([[2 * christoffel(i, j, k) for j, k in PAIRS] for i in rows])
    C = sp.Matrix([[christoffel(i, j, j) for j in rows] for i in rows])
    G = sp.Matrix([potential.diff(q) for q in ANGLES])
    return SymbolicMatrices(M, normal_form(B), normal_form(C), normal_form(G))


def _energies() -> tuple[sp.Expr, sp.Expr]:
    """Kinetic energy ½ Σ (m v·v + w·I w), and potential energy Σ m g z, the hip at rest."""
    rotation, origin, spin = sp.eye(3), sp.zeros(3, 1), sp.zeros(3, 1)
    kinetic, potential = sp.Integer(0), sp.Integer(0)
    for k, link in enumerate(LINKS):
        R, p = link_pose(k)
        origin, rotation = origin + rotation * p, rotation * R
        spin = spin + rotation[:, 2] * SPEEDS[k]
        centre = origin + rotation * link.com
        velocity = normal_form(centre.jacobian(ANGLES) * sp.Matrix(SPEEDS))
        spin_in_link = normal_form(rotation.T * spin)
        kinetic += link.mass * velocity.dot(velocity) / 2
        kinetic += spin_in_link.dot(link.inertia * spin_in_link) / 2
        potential += link.mass * GRAVITY * centre[2]
    return kinetic, potential


PRINTED_ANGLES = sp.symbols("theta2 theta3", real=True)
"""θ2 and θ3 as they stand inside the printed sines and cosines: θ3 is minus that of Table 1."""

_SUMS = ((2, 0), (2, -2), (1, 0), (0, 1), (1, -1), (2, -1))
"""The paper's sums of angles, in its order: how often each contains θ2 and θ3."""


def mid_length(matrices: SymbolicMatrices) -> SymbolicMatrices:
    """Return the matrices for centres of mass at mid-length and principal inertias only.

    Args:
        matrices: For any mass distribution, from ``newton_euler`` or ``lagrange``.

    Source: implicit assumptions of Eq. 10.
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
    """Return an entry as text: its constant, then each function times its coefficient."""
    text = ""
    for function, coefficient in _terms(entry):
        if function == 1:
            # The first term.
            text = _symbols(coefficient)
            continue
        negative = coefficient.could_extract_minus_sign() and not coefficient.is_Add
        magnitude = -coefficient if negative else coefficient
        factor = f"({_symbols(magnitude)})" if magnitude.is_Add else _symbols(magnitude)
        if text:
            text += " - " if negative else " + "
        elif negative:
            text = "-"
        text += f"{_symbols(function)} {factor}"
    return text


def _symbols(expression: sp.Expr) -> str:
    text = sp.sstr(expression)
    for old, new in (("**2", "²"), ("*", " "), ("theta", "θ"), ("(θ2)²", "²θ2"), ("2 θ", "2θ")):
        text = text.replace(old, new)
    return text
