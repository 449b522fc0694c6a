"""One leg in symbols: its angles, its links, and the chain of Table 1."""

from __future__ import annotations

from typing import NamedTuple

import sympy as sp

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
    """The matrices of Eq. 10 in symbols: torque = M q" + B [q' q'] + C [q'²] + G.

    Attributes:
        M: Mass matrix [kg·m²], shape (3, 3).
        B: Coriolis coefficients [kg·m²], shape (3, 3); its columns multiply
            q1' q2', q1' q3' and q2' q3'.
        C: Centrifugal coefficients [kg·m²], shape (3, 3); its columns multiply
            q1'², q2'² and q3'².
        G: Torques that hold the leg against gravity [N·m], shape (3, 1).
    """

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
