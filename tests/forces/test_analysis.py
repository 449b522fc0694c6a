"""Model torques and foot forces of planned walks, and of a robot at rest."""

import numpy as np
import pytest

from phasmid.dynamics import BodyMotion, inverse_dynamics, kinetic_energy, potential_energy
from phasmid.errors import InfeasibleLoad, InvalidInput
from phasmid.forces import FORCE_MODELS, analyse, holding_forces
from phasmid.forces.analysis import planned_body
from phasmid.kinematics import (
    body_from_hip,
    centre_of_mass,
    foot_position,
    joint_angles,
    rotation_rpy,
)
from phasmid.motion import plan
from phasmid.scenario import load_scenario
from phasmid.terrain import Flat, Ground
from phasmid.units import STANDARD_GRAVITY
from support.general_robot import general_robot
from support.terrains import TERRAINS

PAPER = load_scenario("paper")
HILLY = PAPER.replace(step_length_mm=60, step_turn_deg=5, duration=4.0)
AMID = (np.arange(60) + 0.37) / 60 * 3.9
"""Instants that no switch is near."""


def analysed(**changes):
    scenario = PAPER.replace(**changes)
    return analyse(scenario, plan(scenario))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"force_model": "minimum-norm", "friction": 0.3}, ""),
        ({"force_model": "weighted-minimum-norm", "tangential_weight": 4}, "tangential weight 4"),
        ({"force_model": "minimum-torque"}, ""),
        (
            {"force_model": "friction-cone", "friction": 0.3, "torque_limits": "counted"},
            "friction 0.3, torque limits",
        ),
        (
            {"force_model": "smallest-largest-load", "load_transfer": 0.1},
            "friction 0.7, transfer 0.1 s",
        ),
    ],
)
def test_every_model_carries_the_walk_and_is_named_with_its_options(changes, words):
    # Level ground: all normal forces together are the weight, whatever shares them.
    run = analysed(**changes, body_acceleration="quasi-static", duration=2)
    assert np.abs(run.foot_normal_force_model.sum("leg").values - 26).max() < 1e-9
    name = changes["force_model"]
    assert run.attrs["force_model"] == (f"{name} ({words})" if words else name)


def test_torques_are_those_of_a_second_inverse_dynamics_with_the_forces():
    # tau = tau0 - J^T F, and F among the loads of the recursion: two ways to the same torque of
    # 1 N·m, each of a few hundred roundings.
    walk = plan(PAPER)
    run, minimum_torque = analyse(PAPER, walk), analysed(force_model="minimum-torque")
    force = run.foot_force_model.values
    torque, wrench = inverse_dynamics(
        walk.robot,
        planned_body(walk),
        walk.q,
        walk.qd,
        walk.qdd,
        foot_force=force,
        gravity=STANDARD_GRAVITY,
    )
    assert np.abs(torque - run.joint_torque_model.values).max() < 1e-12
    # And the trunk needs nothing more: the forces give the whole wrench.
    assert np.abs(wrench).max() < 1e-9
    # Three feet on level ground leave no choice in the normal forces; the squeeze is free.
    apart = np.abs(force - minimum_torque.foot_force_model.values)
    assert apart[..., 2].max() < 1e-9
    assert apart[..., :2].max() > 1
    least = np.sum(minimum_torque.joint_torque_model.values**2)
    assert least < 0.5 * np.sum(run.joint_torque_model.values**2)


@pytest.mark.parametrize("name", ["minimum-norm", "friction-cone"])
def test_with_a_load_transfer_torques_do_not_jump_and_without_they_do(name):
    # A continuous torque changes by its rate times the interval: a tenth of the interval, a tenth
    # of the change. A jump stays.
    def steps(interval, load_transfer):
        scenario = PAPER.replace(force_model=name, load_transfer=load_transfer)
        walk = plan(scenario).sample(np.arange(0.7, 1.3, interval))
        return np.abs(np.diff(analyse(scenario, walk).joint_torque_model.values, axis=0)).max()

    assert steps(1e-4, 0.2) == pytest.approx(steps(1e-3, 0.2) / 10, rel=0.05)
    assert steps(1e-4, 0.2) < 2e-3
    assert steps(1e-4, 0.0) > 0.5


def test_torque_limits_are_refused_with_a_model_without_limits():
    with pytest.raises(InvalidInput, match="minimum-norm has no limits; it must be") as caught:
        analysed(torque_limits="counted")
    error = caught.value
    assert (error.where, error.hint) == ("model.torque_limits", 'force_model = "friction-cone"')


@pytest.mark.parametrize("name", ["waves", "stairs"])
def test_feet_and_joints_obey_newtons_law_and_the_balance_of_energy(name):
    # Sum of F = m (a + g), with the centre of mass in the world differentiated twice by central
    # differences of 2e-4 s: error h^2/12 times a fourth derivative below 300 m/s^4, 1e-6 m/s^2,
    # and round-off 4e-16/h^2 = 1e-8.
    walk = plan(HILLY.replace(**TERRAINS[name]))
    run = analyse(walk.experiment, walk.sample(AMID))
    gravity = walk.experiment.world.gravity

    def com(time):
        at = walk.sample(time)
        turned = np.einsum("tij,tj->ti", at.trunk.rotation, centre_of_mass(at.robot, at.q))
        return at.trunk.position + turned

    h = 2e-4
    a = (com(AMID + h) - 2 * com(AMID) + com(AMID - h)) / h**2 + [0.0, 0.0, gravity]
    total = run.foot_force_model.values.sum(axis=1)
    assert np.abs(total - walk.robot.mass * a).max() < 1e-4

    # tau q' = d(KE + PE)/dt, since standing feet do not move. Central differences of 2e-5 s of an
    # energy of 3 J: round-off 4e-16 * 3 / 4e-5 = 3e-11 W, third derivatives 1e4 W/s^2 * h^2/6.
    def energy(time):
        at = walk.sample(time)
        body = planned_body(at)
        kinetic = kinetic_energy(at.robot, body, at.q, at.qd)
        return kinetic + potential_energy(at.robot, body, at.q, gravity=gravity)

    h = 2e-5
    needed = (energy(AMID + h) - energy(AMID - h)) / (2 * h)
    power = (run.joint_torque_model.values * walk.sample(AMID).qd).sum(axis=(1, 2))
    assert np.abs(needed).max() > 0.1
    assert np.abs(power - needed).max() < 1e-6


def test_forces_stay_in_cones_about_the_slopes_normal():
    # tan 15 degrees = 0.268: with a friction of 0.32 the robot can stand and walk slowly, with
    # that of 0.28 it cannot hurry.
    slow = HILLY.replace(
        **TERRAINS["slope-up"],
        step_turn=0.0,
        step_length_mm=20,
        period=4.0,
        force_model="friction-cone",
    )
    walk = plan(slow.replace(friction=0.32))
    force = analyse(walk.experiment, walk.sample(AMID)).foot_force_model.values
    angle = np.radians(15)
    normal = force @ [-np.sin(angle), 0, np.cos(angle)]
    tangential = np.sqrt(np.maximum(np.sum(force**2, axis=-1) - normal**2, 0.0))
    assert (tangential <= 0.32 * normal + 1e-7).all()
    # About the vertical they would not be: the robot pushes straight down.
    assert np.hypot(force[..., 0], force[..., 1]).max() < 0.2 * normal.max()
    slippery = slow.replace(friction=0.28, period=1.0)
    with pytest.raises(InfeasibleLoad):
        analyse(slippery, plan(slippery))


def test_friction_is_that_under_each_foot():
    # On tiles of ice, a friction of 0.03 where feet would ask for 0.05, forces bend to the feet on
    # dry ground. Feet that may not step aside stand on both.
    scenario = HILLY.replace(
        terrain="ice",
        terrain_start_mm=-1000,
        tile_mm=150,
        ice_friction=0.03,
        search_radius=0.0,
        step_turn=0.0,
        force_model="friction-cone",
    )
    walk = plan(scenario).sample(AMID)
    force = analyse(scenario, walk).foot_force_model.values
    mu = scenario.load_terrain().friction(*np.moveaxis(walk.foot_position[..., :2], -1, 0))
    assert set(np.unique(mu[walk.stance])) == {0.03, 0.7}
    assert (np.hypot(force[..., 0], force[..., 1]) <= mu * force[..., 2] + 1e-9).all()


@pytest.mark.parametrize("force_model", FORCE_MODELS)
def test_a_robot_at_rest_is_held_by_the_torques_of_inverse_dynamics(force_model):
    # Some hundred newtons and sums of some twenty products: round-off of 1e-12, the share's own
    # tolerance 1e-9 of the load.
    robot, position = general_robot(), np.array([0.3, -0.2, 0.4])
    rotation = rotation_rpy(*np.array([[0.05], [-0.08], [0.7]]))[0]
    q = joint_angles(robot.arrays, robot.arrays.neutral_foot)
    feet = position + body_from_hip(robot, foot_position(robot.arrays, q)) @ rotation.T

    # A robot of five legs has no tripod.
    wave = PAPER.replace(robot=robot, gait="wave")

    def held(stance):
        scenario, ground = wave.replace(force_model=force_model), Ground(Flat(), 1.0)
        return holding_forces(scenario.build(), position, rotation, q, feet, stance, ground)

    legs = np.arange(len(robot.legs))
    found, still = held(legs >= 0), np.zeros_like(q)
    body = BodyMotion.at_rest(position, rotation)
    torque, wrench = inverse_dynamics(
        robot, body, q, still, still, foot_force=found.force, gravity=9.81
    )
    assert found.torque == pytest.approx(torque, abs=1e-8)
    assert wrench == pytest.approx(np.zeros(6), abs=1e-7)
    assert not held(legs != 1).force[1].any()
    with pytest.raises(InfeasibleLoad):
        held(legs < 2)
