"""Statements of the paper on the leg's dynamics (Eqs 10 and 11, Table 2)."""

from __future__ import annotations

import numpy as np

from phasmid import dynamics
from phasmid.paper.evidence import Evidence
from phasmid.paper.misprints import MISPRINTS, Cost, Extent, torque_error, two_digits
from phasmid.paper.statement import Finding, Grade, Statement, judged
from phasmid.robot import with_mass_model
from phasmid.units import STANDARD_GRAVITY

STATES = 10_000
"""Random states per leg on which equations are compared."""

AGREEMENT = 1e-10
"""Torques [N·m] of two ways that agree: row 10 of the physics tests."""


def as_printed(name: str) -> Finding:
    """Measure the cost of a row of the table of misprints."""
    row = next(misprint for misprint in MISPRINTS if misprint.name == name)
    cost = row.cost()
    unit = "N·m" if row.error is torque_error else "m"
    swing, support, random = (_words(extent, unit) for extent in cost)
    return Finding(
        f"as printed, wrong by {swing} in swing, {support} in support, {random} on random states",
        Grade.MISPRINTED if max(_sizes(cost)) > AGREEMENT else Grade.HOLDS,
        f"Right: {row.right}.",
    )


def _sizes(cost: Cost) -> list[float]:
    """Return the errors; infinite where the printed equation gives no value."""
    return [np.inf if np.isnan(extent.largest) else extent.largest for extent in cost]


def _words(extent: Extent, unit: str) -> str:
    if np.isnan(extent.largest):
        return "any amount (it gives no angle)"
    lost = f" (no angle for {two_digits(100 * extent.without_angle)} %)"
    return f"{two_digits(1000 * extent.largest)} m{unit}{lost if extent.without_angle else ''}"


def two_methods(evidence: Evidence) -> Finding:
    """Compare the closed form, from Lagrange's equations, with the Newton-Euler recursion."""
    robot = evidence.robot
    rng, shape = np.random.default_rng(4), (STATES, len(robot.legs), 3)
    q = rng.uniform(-np.pi, np.pi, shape)
    qd, qdd = 5 * rng.normal(size=shape), 20 * rng.normal(size=shape)
    closed = dynamics.leg_torque(robot.arrays, q, qd, qdd, gravity=STANDARD_GRAVITY)
    still = dynamics.BodyMotion.at_rest()
    recursive = dynamics.inverse_dynamics(
        robot, still, q, qd, qdd, gravity=STANDARD_GRAVITY
    ).joint_torque
    miss = np.abs(closed - recursive).max()
    return judged(
        bool(miss < AGREEMENT),
        f"{miss:.0e} N·m apart at most, on {STATES} random states a leg",
        "The corrected Eq. 10, with Table 2 in full; Eq. 10 as printed agrees with neither method.",
        best=Grade.CORRECTED,
    )


def uncoupled(evidence: Evidence) -> Finding:
    """Measure m12 and m13, and the torques that they cause on the walk."""
    walk = evidence.planned
    M = dynamics.leg_matrices(walk.robot.arrays, walk.q, gravity=STANDARD_GRAVITY).M
    others = np.abs(np.sum(M[..., 0, 1:] * walk.qdd[..., 1:], axis=-1)).max()
    own = np.abs(M[..., 0, 0] * walk.qdd[..., 0]).max()
    middle = with_mass_model(walk.robot, "mid-length").arrays
    left = np.abs(
        dynamics.leg_matrices(middle, walk.q, gravity=STANDARD_GRAVITY).M[..., 0, 1:]
    ).max()
    at_middle = "0" if left == 0 else f"up to {left:.0e} kg·m²"
    return judged(
        left == 0,
        f"with masses at mid-length, as Eq. 10 has them, both are {at_middle}; with Table 2 they "
        f"cause up to {1000 * others:.1f} mN·m on the coxa, beside {1000 * own:.1f} mN·m of m11",
        "Table 2 puts the masses of femur and tibia 20 mm beside the leg's plane.",
        best=Grade.HOLDS if others < 0.01 * own else Grade.WITH_A_LIMIT,
    )


def weight(evidence: Evidence) -> Finding:
    """Compare the weight of the legs by Table 2 with the total; the rest is the trunk."""
    robot = evidence.robot
    legs = float(robot.arrays.mass.sum()) * evidence.scenario.model.gravity
    total = robot.mass * evidence.scenario.model.gravity
    return judged(
        abs(total - 26) < 0.05,
        f"six legs by Table 2 {legs:.2f} N, which leaves {total - legs:.2f} N for the trunk",
        "The weight of the trunk is chosen as the rest of 26 N.",
        best=Grade.BY_CONSTRUCTION,
    )


EQUATIONS = (
    Statement("Eq 1", "the transform between two links", lambda _: as_printed("eq-1-offset")),
    Statement("Eq 2", "the pose of a leg in the body", lambda _: as_printed("eq-2-height")),
    Statement("T_B^G", "the body's rotation", lambda _: as_printed("body-rotation")),
    Statement("Eqs 3-9", "the inverse kinematics", lambda _: as_printed("eqs-3-to-9")),
    Statement("Eq 10", "M, B, C and G of a leg", lambda _: as_printed("eq-10")),
    Statement("Eq 10", "Newton-Euler and Lagrange both give the dynamic model", two_methods),
    Statement("Eq 10", "the coxa is not coupled: m12 = m13 = 0", uncoupled),
    Statement("Eq 11", "the ground enters as + JᵀF", lambda _: as_printed("eq-11-sign")),
    Statement("Table 2", "inertias in 10⁻⁶ g·mm²", lambda _: as_printed("table-2-unit")),
    Statement("results", "the robot weighs about 26 N", weight),
)
"""In the paper's order."""
