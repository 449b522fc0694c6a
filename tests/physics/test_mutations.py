"""Physics with an error is detected, in the right row: each experiment can fail."""

import mujoco
import numpy as np
import pytest

from physics import equations, planning, sharing
from physics.bench import Bench
from physics.checks import CHECKS

pytestmark = pytest.mark.slow


def failing(number, bench):
    return {row.case for row in CHECKS[number][-1](bench) if not row.holds}


def points(model):
    """Indices of the feet's points."""
    return np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_SPHERE)


def scale(name, factor, which=lambda model: slice(None)):
    """Return a change that multiplies numbers of a model, at the indices of a function of it."""

    def change(model):
        getattr(model, name)[which(model)] *= factor

    return change


def gravity(model):
    model.opt.gravity *= 1.01


def air(model):
    model.opt.density = 1.2


def friction_damping(model):
    model.opt.impratio *= 1.1


def lopsided(model):
    model.body_ipos[model.body("trunk").id] += [0.0, 0.01, 0.0]


def tilted(model):
    model.opt.gravity[0] += 1e-3


def limp(model):
    model.actuator_gainprm[:] = model.actuator_biasprm[:] = 0


CHANCE = np.random.default_rng(1)


def random_mass(model):
    model.body_mass *= 1 + 1e-12 * CHANCE.random()


ENGINE = [
    (1, gravity, "too low, semi-implicit Euler"),
    (5, air, "angular, implicit, 1 ms"),
    (5, limp, "joints above 1 rad/s, all instants together"),
    (10, gravity, "recursion - engine, in flight"),
    (12, scale("body_mass", 0.999, lambda model: -1), "torques, our recursion"),
    (12, scale("geom_conaffinity", 0), "points that touch, all instants together"),
    (13, scale("geom_solref", 1.1, lambda model: (points(model), 0)), "mean of 24 points"),
    (13, scale("geom_conaffinity", 0, lambda model: points(model)[::4]), "mean of 24 points"),
    (14, lopsided, "ΣM / (mg · reach)"),
    (15, lopsided, "leg 2, simulated mean"),
    # atan(0.77) is 2.6 degrees above atan(0.7).
    (16, scale("geom_friction", 1.1), "steepest that holds, μ = 0.7"),
    (17, friction_damping, "500 N·s/m a point"),
    (18, scale("geom_friction", 1.1), "way, μ = 0.3"),
    (19, scale("geom_friction", 1.1), "beyond μ times the normal force"),
    (19, scale("geom_friction", 0), "short of μ times the normal force, fast slip"),
    # The engine's friction has inertia; so little damping does not dissipate its energy.
    (
        20,
        scale("geom_solref", 0.1, lambda model: (points(model), 1)),
        "most that any impact gained",
    ),
    (21, scale("actuator_forcelimited", False), "torque, ideal-servo"),
    (25, gravity, "over 5 cycles"),
    (26, scale("eq_solref", 1e-4), "largest on any foot"),
    (27, lopsided, "mirror image"),
    (27, scale("body_mass", 1.001, lambda model: 3), "legs declared in another order"),
    (27, tilted, "world turned by 0.7 rad"),
    (29, random_mass, "run twice"),
]
"""Number of the check, change of the engine's models, and a case that must fail."""


@pytest.mark.parametrize(
    ("number", "change", "case"), [pytest.param(*each, id=each[-1]) for each in ENGINE]
)
def test_an_error_in_the_engine_s_model_is_detected(number, change, case):
    assert case in failing(number, Bench(change=change))


FORMULAS = [
    (6, equations, "joint_angles", 1 + 1e-9, "FK(IK(p)) - p"),
    (7, equations, "leg_frames", 1 + 1e-12, "foot, all presets"),
    (8, equations, "jacobian", 1 + 1e-11, "all presets"),
    (9, equations, "kinetic_energy", 1 + 1e-6, "of the largest power"),
    (10, equations, "leg_torque", 1 + 1e-8, "closed form - recursion"),
    (11, equations, "mass_matrix", 1 + 1e-8, "v'M v / 2, off the kinetic energy"),
    (11, equations, "mass_matrix", -1.0, "least eigenvalue below 0"),
    (15, sharing, "minimum_norm", 1 + 1e-7, "statics: model off the areas' share"),
    (22, sharing, "share_load", 1 + 1e-8, "equilibrium"),
    (23, planning, "blend", 1.001, "ends of a blend"),
]
"""Number of the check, its module, a function it calls, a factor, and a case that must fail."""


@pytest.mark.parametrize(
    ("number", "module", "name", "factor", "case"),
    [pytest.param(*each, id=each[-1]) for each in FORMULAS],
)
def test_an_error_in_a_formula_is_detected(number, module, name, factor, case, monkeypatch):
    formula = getattr(module, name)
    monkeypatch.setattr(module, name, lambda *a, **k: factor * np.array(formula(*a, **k)))
    assert case in failing(number, Bench())
