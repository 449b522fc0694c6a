"""The experiments on physics; tests assert their rows, and docs/verification.md shows them."""

from physics import bodies, contact, equations, planning, repeatability, servo, sharing, walking

CHECKS = {
    1: ("free fall, projectile", "z = v t - g t²/2, Euler ½ g Δt t lower", bodies.fall),
    2: ("pendulum period", "T = 4 √(l/g) K(sin ½·0.5)", bodies.pendulum_period),
    3: ("pendulum energy, 10 periods", "½ I ω² + m g h = const", bodies.pendulum_energy),
    4: ("order of convergence", "error(Δt) / error(Δt/2) = 2^order", bodies.convergence),
    5: ("momentum, legs waving in flight", "p, L = const", bodies.floating_momentum),
    6: ("inverse kinematics", "FK(IK(p)) = p, IK(FK(q)) = q", equations.round_trip),
    7: ("Denavit-Hartenberg chain", "T₁ T₂ T₃ T₄ = closed form", equations.chain),
    8: ("Jacobian", "J = Im FK(q + i h e) / h", equations.slopes),
    9: ("power balance", "τ·q' + w·v = d(KE + PE)/dt", equations.power),
    10: ("three ways to one torque", "Eq. 10 = recursion = engine", equations.agreement),
    11: ("mass matrix", "M = Mᵀ > 0, M' - 2 C = -(M' - 2 C)ᵀ", equations.structure),
    12: (
        "inverse of forward dynamics, in contact",
        "τ(q, q', q''(τ)) = τ",
        contact.forward_and_inverse,
    ),
    13: ("static contact depth", "depth = m g / (n k)", contact.static_depth),
    14: ("standing", "ΣF = m g, ΣM = 0", contact.standing),
    15: ("tripod, share of the middle foot", "N = m g · A(c, a, b) / A", sharing.tripod),
    16: ("incline", "slips above atan μ", contact.incline),
    17: ("creep while sticking at 20°", "v = m g sin 20° / (n d)", contact.creep),
    18: ("stopping distance", "v² / (2 μ g)", contact.stopping),
    19: ("friction of sliding feet", "|T| ≤ μ N, T · slip ≤ 0", contact.cone),
    20: ("impact", "energy after ≤ energy before", contact.impact_energy),
    21: ("servo limits, every sample", "|τ| ≤ τ₀ (1 - |ω|/ω₀), …", servo.servo_limits),
    22: ("force sharing", "A F = w, Σ F² least in the cones", sharing.force_sharing),
    23: ("quintic paths", "q, q', q'' continuous, ends exact", planning.quintic),
    24: ("gaits", "3 feet down, margin > 0, duty factor", planning.gaits),
    25: ("walking, mean load", "mean ΣN = m g", walking.mean_load),
    26: ("swing legs", "F = 0", walking.swing_load),
    27: ("symmetry", "mirror, leg order, yaw of the world", repeatability.symmetry),
    28: ("time-step refinement of a walk", "x(Δt) ≈ x(Δt/2)", walking.refinement),
    29: ("replay", "runs that differ in a bit: none", repeatability.repetition),
    30: (
        "model against simulation, torques",
        "rms τ - τ(model), each joint",
        walking.model_against_simulation,
    ),
}
"""Of each number on the page: subject, law, and the function that yields the rows of a bench."""
