"""What a walk over uneven ground needs: Newton's law, the power of the joints, and cones."""

import numpy as np
import pytest

from phasmid.dynamics import kinetic_energy, potential_energy
from phasmid.errors import InfeasibleLoad
from phasmid.forces import analyse
from phasmid.forces.analysis import planned_body
from phasmid.kinematics import centre_of_mass
from phasmid.motion import plan
from phasmid.scenario import load_scenario
from terrains import TERRAINS

PAPER = load_scenario("paper").replace(step_length_mm=60, step_turn_deg=5, duration=4.0)
AMID = (np.arange(60) + 0.37) / 60 * 3.9
"""Instants that no switch is near."""


def analysed(walk, time):
    return analyse(walk.scenario, walk.sample(time))


@pytest.mark.parametrize("name", ["waves", "stairs", "slope-up"])
def test_the_feet_give_what_newtons_law_asks_of_the_centre_of_mass(name):
    # Sum of F = m (a + g), with the centre of mass in the world differentiated twice by central
    # differences of 2e-4 s: error h^2/12 times a fourth derivative below 300 m/s^4, 1e-6 m/s^2,
    # and round-off 4e-16/h^2 = 1e-8.
    walk, h = plan(PAPER.replace(**TERRAINS[name])), 2e-4

    def com(time):
        at = walk.sample(time)
        turned = np.einsum("tij,tj->ti", at.trunk.rotation, centre_of_mass(at.robot, at.q))
        return at.trunk.position + turned

    a = (com(AMID + h) - 2 * com(AMID) + com(AMID - h)) / h**2
    g = walk.scenario.model.gravity
    total = analysed(walk, AMID).foot_force_model.values.sum(axis=1)
    a[:, 2] += g
    assert np.abs(total - walk.robot.mass * a).max() < 1e-4


@pytest.mark.parametrize("name", ["waves", "stairs", "slope-up"])
def test_the_joints_give_the_power_that_the_energy_takes(name):
    # tau q' = d(KE + PE)/dt, since standing feet do not move. Central differences of 2e-5 s of an
    # energy of 3 J: round-off 4e-16 * 3 / 4e-5 = 3e-11 W, third derivatives 1e4 W/s^2 * h^2/6.
    walk, h = plan(PAPER.replace(**TERRAINS[name])), 2e-5

    def energy(time):
        at = walk.sample(time)
        body, g = planned_body(at), at.scenario.model.gravity
        return kinetic_energy(at.robot, body, at.q, at.qd) + potential_energy(
            at.robot, body, at.q, gravity=g
        )

    taken = (energy(AMID + h) - energy(AMID - h)) / (2 * h)
    run = analysed(walk, AMID)
    given = (run.joint_torque_model.values * walk.sample(AMID).qd).sum(axis=(1, 2))
    assert np.abs(taken).max() > 0.1
    assert np.abs(given - taken).max() < 1e-6


def test_forces_stay_in_cones_about_the_slopes_normal():
    # tan 15 degrees = 0.268: with a friction of 0.32 the robot can stand and walk slowly, with
    # that of 0.28 it cannot hurry.
    slow = PAPER.replace(
        **TERRAINS["slope-up"],
        step_turn=0.0,
        step_length_mm=20,
        period=4.0,
        force_model="friction-cone",
    )
    walk = plan(slow.replace(friction=0.32))
    run = analysed(walk, AMID)
    angle = np.radians(15)
    n = np.array([-np.sin(angle), 0, np.cos(angle)])
    force = run.foot_force_model.values
    normal = force @ n
    tangential = np.linalg.norm(force - normal[..., None] * n, axis=-1)
    assert (tangential <= 0.32 * normal + 1e-9).all()
    # About the vertical they would not be: the robot pushes straight down.
    assert np.hypot(force[..., 0], force[..., 1]).max() < 0.2 * normal.max()
    # With 0.28 a standing robot holds, but not one that also speeds up uphill and down.
    slippery = slow.replace(friction=0.28, period=1.0)
    with pytest.raises(InfeasibleLoad):
        analyse(slippery, plan(slippery))


def test_friction_is_that_under_each_foot():
    # On tiles of ice, a friction of 0.03 where feet would ask for 0.05, forces bend to the feet on
    # dry ground. Feet that may not step aside stand on both.
    scenario = PAPER.replace(
        terrain="ice",
        terrain_start_mm=-1000,
        tile_mm=150,
        ice_friction=0.03,
        search_radius=0.0,
        step_turn=0.0,
        force_model="friction-cone",
    )
    walk = plan(scenario)
    time = AMID
    force = analysed(walk, time).foot_force_model.values
    x, y, _ = np.moveaxis(walk.sample(time).foot_position, -1, 0)
    mu = scenario.load_terrain().friction(x, y)
    stands = walk.sample(time).stance
    assert set(np.unique(mu[stands])) == {0.03, 0.7}
    assert (np.hypot(force[..., 0], force[..., 1]) <= mu * force[..., 2] + 1e-9).all()
