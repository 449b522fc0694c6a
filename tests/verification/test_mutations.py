"""Each check can fail: physics that is broken on purpose is found out, in the right row."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import phasmid.simulation.experiment
import phasmid.simulation.run
import phasmid.verification.engine
import phasmid.verification.equations
import phasmid.verification.momentum
from phasmid.gait import Gait
from phasmid.kinematics import foot_position
from phasmid.scenario import load_scenario
from phasmid.simulation import build_model
from phasmid.simulation.joint_drive import IdealServoDrive
from phasmid.verification import (
    CHECKS,
    Verdict,
    bodies,
    contact,
    equations,
    friction,
    legs,
    momentum,
    planning,
    sharing,
    statics,
)
from phasmid.verification.laboratory import Laboratory

PAPER = load_scenario("paper")

BUILDERS = (
    phasmid.simulation.run,
    phasmid.verification.engine,
    phasmid.verification.equations,
    phasmid.verification.momentum,
)


@pytest.fixture
def tamper(monkeypatch):
    """Change every model that the engine is given."""

    def with_change(change):
        def build(robot, scenario):
            model = build_model(robot, scenario)
            change(model)
            return model

        for module in BUILDERS:
            monkeypatch.setattr(module, "build_model", build)

    return with_change


def failing(number, laboratory=None):
    """Cases of a check that fail."""
    rows = CHECKS[number].rows(laboratory or Laboratory())
    return [row.case for row in rows if row.verdict is Verdict.FAILS]


def scaled(field, factor, column=slice(None)):
    def change(model):
        getattr(model, field)[..., column] *= factor

    return change


def heavier(model):
    model.opt.gravity[2] *= 1.01


def stiffer(model):
    points = model.geom_type == mujoco.mjtGeom.mjGEOM_SPHERE
    model.geom_solref[points, 0] *= 1.1


def rougher(model):
    model.geom_friction[:, 0] *= 1.1


def creeping_less(model):
    model.opt.impratio *= 1.1


def lopsided(model):
    model.body_ipos[model.body("trunk").id] += [0.0, 0.01, 0.0]


def tilted(model):
    model.opt.gravity[0] += 1e-3


def light_tibia(model):
    model.body_mass[model.body("right_front.tibia").id] *= 0.999


@pytest.mark.parametrize(
    ("number", "change", "case"),
    [
        # Gravity 1 % off: falls, periods, depths and loads are off by 1 % or half of it.
        (1, heavier, "too low, semi-implicit Euler"),
        (2, heavier, "relative error, RK4"),
        (3, heavier, "relative, RK4"),
        (10, heavier, "recursion - engine, in flight"),
        (12, heavier, "left on the trunk, ours"),
        (13, heavier, "mean of all points"),
        (14, heavier, "ΣF / mg"),
        (25, heavier, "over 5 cycles"),
        (12, light_tibia, "torques, our recursion"),
        (13, stiffer, "mean of all points"),
        (14, lopsided, "ΣM / (mg · reach)"),
        (15, lopsided, "leg 2, simulated mean"),
        # atan(0.77) is 2.6 degrees above atan(0.7).
        (16, rougher, "steepest that holds, μ = 0.7"),
        (17, creeping_less, "500 N·s/m a point"),
        (18, rougher, "way, μ = 0.3"),
        (19, rougher, "beyond μ times the normal force"),
        (27, lopsided, "mirror image"),
        (27, tilted, "world turned by 0.7 rad"),
    ],
)
def test_a_changed_engine_is_found_out(number, change, case, tamper):
    tamper(change)
    assert case in failing(number)


@pytest.mark.parametrize(
    ("number", "case"),
    [
        (1, "off the parabola, RK4"),
        (2, "relative error, RK4"),
        (3, "relative, RK4"),
        (4, "order, RK4"),
        (5, "angular, RK4, 0.25 ms"),
    ],
)
def test_an_integrator_of_lower_order_is_found_out(number, case, monkeypatch):
    def first_order(model, integrator, dt):
        model.opt.timestep = dt
        return model

    for module in (phasmid.verification.engine, bodies, momentum):
        monkeypatch.setattr(module, "with_integrator", first_order)
    assert case in failing(number)


def slightly(function, factor):
    def changed(*arguments, **options):
        return factor * function(*arguments, **options)

    return changed


@pytest.mark.parametrize(
    ("number", "module", "name", "factor"),
    [
        (6, legs, "joint_angles", 1 + 1e-9),
        (7, legs, "leg_frames", 1 + 1e-12),
        (8, legs, "jacobian", 1 + 1e-11),
        (9, equations, "kinetic_energy", 1 + 1e-6),
        (10, equations, "leg_torque", 1 + 1e-8),
        (15, statics, "minimum_norm", 1 + 1e-7),
        (22, sharing, "share_load", 1 + 1e-8),
    ],
)
def test_a_slightly_wrong_function_is_found_out(number, module, name, factor, monkeypatch):
    monkeypatch.setattr(module, name, slightly(getattr(module, name), factor))
    assert failing(number)


def test_a_wrong_coriolis_term_is_found_out(monkeypatch):
    right = equations.leg_matrices

    def wrong(*arguments, **options):
        matrices = right(*arguments, **options)
        return matrices._replace(B=0.999 * matrices.B)

    monkeypatch.setattr(equations, "leg_matrices", wrong)
    assert failing(11) == ["rate - 2 C, not skew, legs"]


def test_forces_without_friction_cones_are_found_out(monkeypatch):
    right = sharing.share_load
    monkeypatch.setattr(sharing, "share_load", lambda c, w, _: right(c, w, "minimum-norm"))
    assert "off a second method" in failing(22)


def test_servos_that_ignore_their_limits_are_found_out(tamper, monkeypatch):
    def without_limits(model):
        model.actuator_forcelimited[:] = 0

    def command(drive, target):
        drive._control[:] = target

    # A servo that is weaker on paper than the walk needs, and in the engine knows no limit.
    tamper(without_limits)
    monkeypatch.setattr(IdealServoDrive, "command", command)
    found = failing(21, Laboratory(PAPER.replace(robot=with_stall_torque(0.3))))
    assert found[:2] == ["torque, ideal-servo", "torque at speed, ideal-servo"]


@pytest.mark.parametrize(
    ("channel", "case"),
    [
        ("joint_torque", "torque, beyond what friction explains, servo"),
        ("servo_current", "current, off the motor's law, servo"),
        ("servo_duty", "current, off the motor's law, servo"),
        ("servo_speed", "current, off the motor's law, servo"),
    ],
)
def test_a_servo_that_records_a_thousandth_more_is_found_out(channel, case):
    laboratory = Laboratory()
    walk = laboratory.walk(drive="servo", duration=4.0)
    walk[channel] = 1.001 * walk[channel]
    assert case in failing(21, laboratory)


@pytest.mark.parametrize(
    ("number", "case"),
    [(19, "points that slipped, all steps together"), (20, "impacts")],
)
def test_a_largest_value_of_nothing_is_found_out(number, case, monkeypatch):
    # A bench whose runs make no step sees no impact and no slip.
    for module in (friction, contact):
        monkeypatch.setattr(module, "hold", lambda run, steps: iter(()))
    assert failing(number) == [case]


def test_paths_of_lower_degree_are_found_out(monkeypatch):
    # A cubic begins with an acceleration of 6.
    right = planning.blend
    monkeypatch.setattr(planning, "blend", lambda _, u: right("cubic-spline", u))
    assert failing(23) == ["ends of a blend"]


def test_a_foot_that_lifts_early_is_found_out(monkeypatch):
    right = Gait.stance

    def early(gait, phase):
        stands = right(gait, phase)
        stands[..., 0] &= gait.leg_phase(phase)[..., 0] < 0.999
        return stands

    monkeypatch.setattr(Gait, "stance", early)
    assert "standing, off the duty factor" in failing(24)


def test_feet_that_drag_in_swing_are_found_out():
    assert failing(26, Laboratory(PAPER.replace(step_height=0, duration=4.0)))


def test_contact_that_gives_back_more_than_it_takes_is_found_out():
    # Friction's inertia in the engine gives energy that so little damping does not take.
    assert failing(20, Laboratory(PAPER.replace(damping=3.0)))


def test_a_time_step_that_is_too_long_is_found_out():
    assert failing(28, Laboratory(PAPER.replace(dt=0.003)))


def test_a_leg_that_depends_on_its_place_in_the_list_is_found_out(tamper):
    tamper(scaled("body_mass", 1.001, 3))
    assert "legs declared in another order" in failing(27)


def test_chance_is_found_out(tamper):
    rng = np.random.default_rng(1)

    def by_chance(model):
        model.body_mass *= 1 + 1e-12 * rng.random()

    tamper(by_chance)
    assert "run twice" in failing(29)


def with_stall_torque(torque):
    robot = phasmid.load_robot("phantomx-paper")
    return replace(robot, servo=replace(robot.servo, stall_torque=torque))


def test_a_walk_that_ends_early_is_a_row_that_fails():
    scenario = PAPER.replace(robot=with_stall_torque(0.2), drive="ideal-servo")
    (row,) = CHECKS[25].rows(Laboratory(scenario))
    assert row.case == "could not be measured"
    assert row.verdict is Verdict.FAILS
    assert row.why.startswith("The robot fell")


def test_ctrl_c_ends_the_verification_and_not_only_a_walk_of_it(monkeypatch):
    import signal

    right = phasmid.simulation.experiment.simulate_part

    def interrupt(*arguments, **options):
        signal.raise_signal(signal.SIGINT)
        return right(*arguments, **options)

    monkeypatch.setattr(phasmid.simulation.experiment, "simulate_part", interrupt)
    for number in (25, 28):
        with pytest.raises(KeyboardInterrupt):
            CHECKS[number].rows(Laboratory(PAPER.replace(duration=0.1)))


def test_the_complex_step_is_written_without_our_kinematics():
    # Its own chain, at real angles, is the closed form: sums of lengths below 0.3 m.
    leg = phasmid.load_robot("phantomx-mk4").legs[1]
    q = legs._random_angles()[:100]
    assert np.abs(legs._foot(leg, q.astype(complex)).real - foot_position(leg, q)).max() < 1e-15
