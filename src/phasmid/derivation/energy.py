"""The leg's equations of motion by Lagrange's equations."""

from __future__ import annotations

import sympy as sp

from phasmid.derivation.leg import (
    ANGLES,
    GRAVITY,
    LINKS,
    PAIRS,
    SPEEDS,
    SymbolicMatrices,
    link_pose,
)
from phasmid.derivation.normal_form import normal_form


def lagrange() -> SymbolicMatrices:
    """Matrices of Eq. 10 from the energies of the links, for any mass distribution.

    With the kinetic energy ½ q'ᵀ M q' and the potential energy V, Lagrange's equations say
    torque_i = Σ M_ij q_j" + Σ Γ_ijk q_j' q_k' + ∂V/∂q_i, where
    Γ_ijk = (∂M_ij/∂q_k + ∂M_ik/∂q_j - ∂M_jk/∂q_i) / 2 are Christoffel's symbols.

    Returns:
        The matrices, every entry in normal form.
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
        turn, step = link_pose(k)
        origin, rotation = origin + rotation * step, rotation * turn
        spin = spin + rotation[:, 2] * SPEEDS[k]
        centre = origin + rotation * link.com
        velocity = normal_form(centre.jacobian(ANGLES) * sp.Matrix(SPEEDS))
        spin_in_link = normal_form(rotation.T * spin)
        kinetic += link.mass * velocity.dot(velocity) / 2
        kinetic += spin_in_link.dot(link.inertia * spin_in_link) / 2
        potential += link.mass * GRAVITY * centre[2]
    return kinetic, potential
