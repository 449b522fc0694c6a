"""Each check can fail: physics that is broken on purpose is found, in the right row.

Every mutation runs with the settings of ``phasmid verify``. What was never touched by a mutation
could be a row that passes whatever the physics.
"""

from dataclasses import replace
from operator import attrgetter

import mujoco
import numpy as np
import pytest

import phasmid
import phasmid.motion.walk
import phasmid.simulation.run
import phasmid.simulation.servo
import phasmid.verification.bodies
import phasmid.verification.equations
import phasmid.verification.laboratory
import phasmid.verification.servo
from phasmid.gait import Gait
from phasmid.scenario import load_scenario
from phasmid.simulation import Run, build_model
from phasmid.simulation.servo import ServoDrive
from phasmid.verification import (
    CHECKS,
    Verdict,
    bodies,
    contact,
    equations,
    planning,
    repeatability,
    sharing,
)
from phasmid.verification.laboratory import Laboratory

PAPER = load_scenario("paper")

BUILDERS = (
    phasmid.simulation.run,
    phasmid.verification.laboratory,
    phasmid.verification.equations,
    phasmid.verification.bodies,
)


def failing(number, laboratory=None):
    """Cases of a check that fail."""
    rows = CHECKS[number].rows(laboratory or Laboratory())
    return [row.case for row in rows if row.verdict is Verdict.FAILS]


def engine(change):
    """Change every model that the engine is given."""

    def mutate(monkeypatch):
        def build(robot, scenario):
            model = build_model(robot, scenario)
            change(model)
            return model

        for module in BUILDERS:
            monkeypatch.setattr(module, "build_model", build)

    return mutate


def times(path, factor, which=lambda model: slice(None)):
    """Multiply numbers of the engine's models, at the indices of a function of the model."""

    def change(model):
        attrgetter(path)(model)[which(model)] *= factor

    return engine(change)


def result(owner, name, change):
    """Change what a function or method returns."""

    def mutate(monkeypatch):
        right = getattr(owner, name)

        def wrong(*arguments, **options):
            return change(right(*arguments, **options))

        monkeypatch.setattr(owner, name, wrong)

    return mutate


def scaled(owner, name, factor):
    return result(owner, name, lambda value: factor * value)


def servo_parameter(name, factor):
    """Change a parameter of the servo's law."""

    def change(parameters):
        parameters[name] *= factor
        return parameters

    return result(phasmid.simulation.servo, "servo_parameters", change)


def points(model):
    return np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_SPHERE)


def damping(model):
    return points(model), 1


def damped_by_the_time_step(model):
    model.geom_solref[damping(model)] *= model.opt.timestep / 0.001


def creeping_less(model):
    model.opt.impratio *= 1.1


def lopsided(model):
    model.body_ipos[model.body("trunk").id] += [0.0, 0.01, 0.0]


def tilted(model):
    model.opt.gravity[0] += 1e-3


def with_limp_servos(model):
    model.actuator_gainprm[:] = model.actuator_biasprm[:] = 0


CHANCE = np.random.default_rng(1)


def by_chance(model):
    model.body_mass *= 1 + 1e-12 * CHANCE.random()


def with_integrators_of_first_order(monkeypatch):
    def first_order(model, integrator, dt):
        model.opt.timestep = dt
        return model

    for module in (phasmid.verification.laboratory, bodies):
        monkeypatch.setattr(module, "with_integrator", first_order)


def with_lifts_ahead_of_time(monkeypatch):
    right = Gait.stance

    def early(gait, phase):
        stands = right(gait, phase)
        stands[..., 0] &= gait.leg_phase(phase)[..., 0] < 0.999
        return stands

    monkeypatch.setattr(Gait, "stance", early)


def with_goals_beyond_the_range(monkeypatch):
    right = ServoDrive.command

    def wider(drive, target):
        drive._limits[:] = [[-10.0], [10.0]]
        right(drive, target)

    monkeypatch.setattr(ServoDrive, "command", wider)


def with_plans_beyond_the_range(monkeypatch):
    monkeypatch.setattr(phasmid.motion.walk, "check_reach", lambda *_: None)


def with_an_overload_that_is_none(monkeypatch):
    # The paper's walk, which does not reach the servos' limits.
    monkeypatch.setattr(phasmid.verification.servo, "LOAD", 0.0)
    monkeypatch.setattr(phasmid.verification.servo, "OVERLOADED", {"duration": 2.0})


def with_cubic_paths(monkeypatch):
    # A cubic begins with an acceleration of 6.
    right = planning.blend
    monkeypatch.setattr(planning, "blend", lambda _, u: right("cubic-spline", u))


def with_a_faster_path(path):
    return path._replace(velocity=1.001 * path.velocity)


def with_less_coriolis_torque(matrices):
    return matrices._replace(B=0.999 * matrices.B)


def without_numbers_at_one_place(values):
    values = values.copy()
    values[-1] = np.nan
    return values


def displaced(state):
    # The step, the time, then the trunk's place.
    state[2] += 1e-12
    return state


def rounded(monkeypatch):
    right = repeatability.save_recording

    def save(recording, path):
        shorter = recording["joint_torque"].astype(np.float32).astype(float)
        right(recording.assign(joint_torque=shorter), path)

    monkeypatch.setattr(repeatability, "save_recording", save)


def minimum_norm_instead_of_cones(monkeypatch):
    right = sharing.share_load
    monkeypatch.setattr(sharing, "share_load", lambda c, w, _: right(c, w, "minimum-norm"))


# Number of the row, what is broken, and cases that must fail.
MUTATIONS = [
    # Gravity 1 % off: falls, periods, depths and loads are off by 1 % or half of it.
    (1, times("opt.gravity", 1.01), "too low, semi-implicit Euler"),
    (1, with_integrators_of_first_order, "off the parabola, RK4"),
    (2, with_integrators_of_first_order, "relative error, RK4"),
    (3, with_integrators_of_first_order, "relative, RK4"),
    (4, with_integrators_of_first_order, "order, RK4"),
    (5, engine(lambda model: setattr(model.opt, "density", 1.2)), "angular, implicit, 1 ms"),
    (5, engine(with_limp_servos), "joints above 1 rad/s, all instants together"),
    (5, with_integrators_of_first_order, "angular, RK4, 0.25 ms"),
    (6, scaled(equations, "joint_angles", 1 + 1e-9), "FK(IK(p)) - p"),
    (6, result(equations, "joint_angles", without_numbers_at_one_place), "FK(IK(p)) - p"),
    (7, scaled(equations, "leg_frames", 1 + 1e-12), "foot, all presets"),
    (8, scaled(equations, "jacobian", 1 + 1e-11), "all presets"),
    (9, scaled(equations, "kinetic_energy", 1 + 1e-6), "of the largest power"),
    (10, times("opt.gravity", 1.01), "recursion - engine, in flight"),
    (10, scaled(equations, "leg_torque", 1 + 1e-8), "closed form - recursion"),
    (11, scaled(equations, "mass_matrix", 1 + 1e-8), "v'M v / 2, off the kinetic energy"),
    (11, scaled(equations, "mass_matrix", -1.0), "least eigenvalue below 0"),
    (
        11,
        result(equations, "leg_matrices", with_less_coriolis_torque),
        "rate - 2 C, not skew, legs",
    ),
    (12, times("body_mass", 0.999, lambda model: -1), "torques, our recursion"),
    (12, times("geom_conaffinity", 0), "points that touch, all instants together"),
    (13, times("geom_solref", 1.1, lambda model: (points(model), 0)), "mean of 24 points"),
    (13, times("geom_conaffinity", 0, lambda model: points(model)[::4]), "mean of 24 points"),
    (14, engine(lopsided), "ΣM / (mg · reach)"),
    (15, engine(lopsided), "leg 2, simulated mean"),
    (15, scaled(sharing, "minimum_norm", 1 + 1e-7), "statics: model off the areas' share"),
    # atan(0.77) is 2.6 degrees above atan(0.7).
    (16, times("geom_friction", 1.1), "steepest that holds, μ = 0.7"),
    (17, engine(creeping_less), "500 N·s/m a point"),
    (18, times("geom_friction", 1.1), "way, μ = 0.3"),
    (19, times("geom_friction", 1.1), "beyond μ times the normal force"),
    (19, times("geom_friction", 0), "short of μ times the normal force, fast slip"),
    # The engine's friction has inertia, which gives energy that so little damping does not take.
    (20, times("geom_solref", 0.1, damping), "most that any impact gained"),
    (
        21,
        times("actuator_forcelimited", False),
        "torque, ideal-servo",
        "torque at speed, ideal-servo",
        "speed, ideal-servo",
        "torque, torque",
        "torque at speed, torque",
        "speed, torque",
    ),
    (21, servo_parameter("limit", 10.0), "torque, servo"),
    (21, servo_parameter("most", 10.0), "share of the supply, servo"),
    (21, servo_parameter("resistance", 1.001), "current, off the motor's law, servo"),
    (21, servo_parameter("inertia", 1.001), "torque, beyond what friction explains, servo"),
    (21, with_goals_beyond_the_range, "range and a step of the sensor, servo"),
    (21, with_plans_beyond_the_range, "range, ideal-servo and torque, by the plan"),
    (
        21,
        with_an_overload_that_is_none,
        "samples at the limit: torque, ideal-servo",
        "samples at the limit: torque, torque",
        "samples at the limit: torque, servo",
        "samples at the limit: share of the supply, servo",
    ),
    (22, scaled(sharing, "share_load", 1 + 1e-8), "equilibrium"),
    (22, minimum_norm_instead_of_cones, "off a second method"),
    (23, with_cubic_paths, "ends of a blend"),
    (
        23,
        result(planning, "lift", with_a_faster_path),
        "derivatives, off the difference quotient",
    ),
    (24, with_lifts_ahead_of_time, "standing, off the duty factor"),
    (
        24,
        scaled(phasmid.motion.walk, "support_margin", 1 + 1e-9),
        "margin, off the support function's",
    ),
    (25, times("opt.gravity", 1.01), "over 5 cycles"),
    (26, times("eq_solref", 1e-4), "largest on any foot"),
    (27, engine(lopsided), "mirror image"),
    (27, times("body_mass", 1.001, lambda model: 3), "legs declared in another order"),
    (27, engine(tilted), "world turned by 0.7 rad"),
    (28, engine(damped_by_the_time_step), "normal forces, 1 ms and half"),
    (29, engine(by_chance), "run twice"),
    (29, rounded, "saved and reloaded"),
    (29, result(Run, "state", displaced), "gone on with from its saved middle"),
]


@pytest.mark.parametrize(
    ("number", "mutate", "cases"),
    [
        pytest.param(number, mutate, cases, id=f"{number}-{cases[0]}-{place}")
        for place, (number, mutate, *cases) in enumerate(MUTATIONS)
    ],
)
def test_each_row_fails_when_its_physics_is_broken(number, mutate, cases, monkeypatch):
    mutate(monkeypatch)
    assert set(cases) <= set(failing(number))


def test_every_row_that_claims_something_is_broken_by_a_mutation():
    # Row 30 is reported and claims nothing.
    assert {number for number, *_ in MUTATIONS} | {30} == set(CHECKS)


@pytest.mark.parametrize(
    ("number", "case"),
    [(19, "points that slipped fast, all steps together"), (20, "impacts")],
)
def test_a_largest_value_of_nothing_is_found_out(number, case, monkeypatch):
    # A bench whose runs make no step sees no impact and no slip.
    monkeypatch.setattr(contact, "hold", lambda run, steps: iter(()))
    assert failing(number) == [case]


def test_a_walk_that_ends_early_is_a_row_that_fails():
    robot = PAPER.load_robot()
    weak = replace(robot, servo=replace(robot.servo, stall_torque=0.2))
    scenario = PAPER.replace(robot=weak, drive="ideal-servo")
    (row,) = CHECKS[25].rows(Laboratory(scenario))
    assert row.case == "could not be measured"
    assert row.verdict is Verdict.FAILS
    assert row.why.startswith("The robot fell")


def test_ctrl_c_ends_the_verification_and_not_only_a_walk_of_it(monkeypatch):
    import signal

    right = Run.simulate

    def interrupt(*arguments, **options):
        signal.raise_signal(signal.SIGINT)
        return right(*arguments, **options)

    monkeypatch.setattr(Run, "simulate", interrupt)
    for number in (25, 28):
        with pytest.raises(KeyboardInterrupt):
            CHECKS[number].rows(Laboratory(PAPER.replace(duration=0.1)))
