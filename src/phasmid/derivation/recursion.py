"""The leg's equations of motion by the recursion of Newton and Euler."""

from __future__ import annotations

import sympy as sp

from phasmid.derivation.leg import (
    ACCELERATIONS,
    GRAVITY,
    LINKS,
    PAIRS,
    SPEEDS,
    SymbolicMatrices,
    link_pose,
)
from phasmid.derivation.normal_form import normal_form


def newton_euler() -> SymbolicMatrices:
    """Matrices of Eq. 10 from the forces and moments on the links, for any mass distribution.

    Speeds and accelerations run outwards from the hip, forces and moments inwards from the tibia;
    the torques are then sorted by accelerations and products of speeds.

    Returns:
        The matrices, every entry in normal form.

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
    needs = []
    for k, link in enumerate(LINKS):
        turn, step = link_pose(k)
        a = normal_form(turn.T * (a + _carried(step, w, dw)))
        w, dw = turn.T * w, turn.T * dw
        dw = normal_form(dw + w.cross(axis) * SPEEDS[k] + axis * ACCELERATIONS[k])
        w = normal_form(w + axis * SPEEDS[k])
        force = normal_form(link.mass * (a + _carried(link.com, w, dw)))
        moment = normal_form(link.inertia * dw + w.cross(link.inertia * w) + link.com.cross(force))
        needs.append((force, moment))
    force, moment = zero, zero
    torque: list[sp.Expr] = []
    for k in (2, 1, 0):
        force, moment = force + needs[k][0], moment + needs[k][1]
        torque.insert(0, moment[2])
        turn, step = link_pose(k)
        force = normal_form(turn * force)
        moment = normal_form(turn * moment + step.cross(force))
    return normal_form(sp.Matrix(torque))


def _carried(p: sp.Matrix, w: sp.Matrix, dw: sp.Matrix) -> sp.Matrix:
    """Acceleration of a point p of a turning body against the body's origin."""
    return dw.cross(p) + w.cross(w.cross(p))
