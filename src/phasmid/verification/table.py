"""The table of checks, and how to run it."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from phasmid.arguments import checked
from phasmid.errors import InvalidInput
from phasmid.verification import (
    bodies,
    contact,
    equations,
    planning,
    repeatability,
    servo,
    sharing,
    walking,
)
from phasmid.verification.laboratory import Laboratory
from phasmid.verification.row import Check, Row

CHECKS: dict[int, Check] = {
    check.number: check
    for check in (
        Check(1, "free fall, projectile", "z = v t - g t²/2, Euler ½ g Δt t lower", bodies.fall),
        Check(2, "pendulum period", "T = 4 √(l/g) K(sin ½·0.5)", bodies.pendulum_period),
        Check(3, "pendulum energy, 10 periods", "½ I ω² + m g h = const", bodies.pendulum_energy),
        Check(4, "order of convergence", "error(Δt) / error(Δt/2) = 2^order", bodies.convergence),
        Check(5, "momentum, legs waving in flight", "p, L = const", bodies.floating_momentum),
        Check(6, "inverse kinematics", "FK(IK(p)) = p, IK(FK(q)) = q", equations.round_trip),
        Check(7, "Denavit-Hartenberg chain", "T₁ T₂ T₃ T₄ = closed form", equations.chain),
        Check(8, "Jacobian", "J = Im FK(q + i h e) / h", equations.slopes),
        Check(9, "power balance", "τ·q' + w·v = d(KE + PE)/dt", equations.power),
        Check(10, "three ways to one torque", "Eq. 10 = recursion = engine", equations.agreement),
        Check(11, "mass matrix", "M = Mᵀ > 0, M' - 2 C = -(M' - 2 C)ᵀ", equations.structure),
        Check(
            12,
            "inverse of forward dynamics, in contact",
            "τ(q, q', q''(τ)) = τ",
            contact.forward_and_inverse,
        ),
        Check(13, "static contact depth", "depth = m g / (n k)", contact.static_depth),
        Check(14, "standing", "ΣF = m g, ΣM = 0", contact.standing),
        Check(15, "tripod, share of the middle foot", "N = m g · A(c, a, b) / A", sharing.tripod),
        Check(16, "incline", "slips above atan μ", contact.incline),
        Check(17, "creep while sticking at 20°", "v = m g sin 20° / (n d)", contact.creep),
        Check(18, "stopping distance", "v² / (2 μ g)", contact.stopping),
        Check(19, "friction of sliding feet", "|T| ≤ μ N, T · slip ≤ 0", contact.cone),
        Check(20, "impact", "energy after ≤ energy before", contact.impact_energy),
        Check(21, "servo limits, every sample", "|τ| ≤ τ₀ (1 - |ω|/ω₀), …", servo.servo_limits),
        Check(22, "force sharing", "A F = w, F = Aᵀλ + z", sharing.force_sharing),
        Check(23, "quintic paths", "q, q', q'' continuous, ends exact", planning.quintic),
        Check(24, "gaits", "3 feet down, margin > 0, duty factor", planning.gaits),
        Check(25, "walking, mean load", "mean ΣN = m g", walking.mean_load),
        Check(26, "swing legs", "F = 0", walking.swing_load),
        Check(27, "symmetry", "mirror, leg order, yaw of the world", repeatability.symmetry),
        Check(28, "time-step refinement of a walk", "x(Δt) ≈ x(Δt/2)", walking.refinement),
        Check(29, "replay", "runs that differ in a bit: none", repeatability.repetition),
        Check(
            30,
            "model against simulation, torques",
            "rms τ - τ(model), each joint",
            walking.model_against_simulation,
        ),
    )
}
"""Every check by its number."""


def check_numbers(rows: Iterable[int]) -> list[int]:
    """Return the numbers in order, each once.

    Raises:
        InvalidInput: There are none, or there is no check of a number.
    """
    chosen = sorted(set(rows))
    for number in chosen or [0]:
        if number not in CHECKS:
            raise InvalidInput(
                f"there is no row {number}; rows are {min(CHECKS)} to {max(CHECKS)}."
                if chosen
                else "no row is named; there must be one at least."
            )
    return chosen


Progress = Callable[[Check], None]
"""Receives the check that begins."""


@checked
def verify(rows: Iterable[int] | None = None, *, progress: Progress | None = None) -> list[Row]:
    """Run the physics against closed forms, conservation laws and independent calculations.

    Args:
        rows: Numbers of the checks to run, in any order; all of them where None.
        progress: Receives the check that begins.

    Returns:
        One row for each reading, in the order of the checks.

    Raises:
        InvalidInput: There is no check of a number.
    """
    chosen = sorted(CHECKS) if rows is None else check_numbers(rows)
    laboratory, found = Laboratory(), []
    for number in chosen:
        if progress:
            progress(CHECKS[number])
        found += CHECKS[number].rows(laboratory)
    return found
