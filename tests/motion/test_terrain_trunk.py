"""The trunk over uneven ground: its lean, its height, and their derivatives."""

import numpy as np
import pytest

from phasmid.gait import support_margin
from phasmid.kinematics import centre_of_mass, quaternion_rotation
from phasmid.motion import plan
from phasmid.scenario import load_scenario
from support.terrains import TERRAINS

PAPER = load_scenario("paper").replace(step_length_mm=60, duration=6.0)
ARC = {"step_turn_deg": 6, "step_sideways_mm": -10}


def skew(w):
    x, y, z = np.moveaxis(w, -1, 0)
    zero = np.zeros(x.shape)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*x.shape, 3, 3)


@pytest.mark.parametrize("timing", ["rest-to-rest", "constant-speed"])
@pytest.mark.parametrize("name", ["stairs", "waves", "rough"])
def test_the_trunks_motion_is_that_of_its_rotation_and_position(name, timing):
    # v = dx/dt, a = dv/dt, dR/dt = [w] R, dw/dt = angular acceleration. Central differences with
    # h = 2e-5 s err by h^2/6 times third derivatives below 100 /s^3: 1e-8, and round-off
    # 1e-16/h = 5e-12 of the first, 1e-11 of the second.
    walk = plan(PAPER.replace(**TERRAINS[name], **ARC, stance_timing=timing, period=3.0))
    h, time = 2e-5, (np.arange(200) + 0.37) * 5.9 / 200
    before, here, after = (walk.sample(time + k * h).trunk for k in (-1, 0, 1))

    def slope(of):
        return (of(after) - of(before)) / (2 * h)

    assert np.abs(slope(lambda t: t.position) - here.velocity).max() < 1e-8
    assert np.abs(slope(lambda t: t.velocity) - here.acceleration).max() < 1e-7
    turning = skew(here.angular_velocity) @ here.rotation
    assert np.abs(slope(lambda t: t.rotation) - turning).max() < 1e-8
    w = slope(lambda t: t.angular_velocity)
    assert np.abs(w - here.angular_acceleration).max() < 1e-7
    assert np.abs(quaternion_rotation(here.quaternion) - here.rotation).max() < 1e-15
    # It does lean, about both axes.
    assert np.degrees(np.abs(here.attitude[:, :2])).max(axis=0).min() > 0.1


@pytest.mark.parametrize("timing", ["rest-to-rest", "constant-speed"])
@pytest.mark.parametrize("name", ["slope-up", "slope-down", "slope-sideways"])
@pytest.mark.parametrize("way", [{}, ARC], ids=["straight", "arc"])
def test_on_a_slope_the_trunk_glides_along_it(name, timing, way):
    # Its floor's normal is that of the slope, its origin 100 mm from the plane across it; on the
    # map it goes as on level ground. Round-off of the least squares: 1e-12.
    scenario = PAPER.replace(**TERRAINS[name], stance_timing=timing, period=3.0, **way)
    terrain, walk = scenario.load_terrain(), plan(scenario)
    level = plan(PAPER.replace(stance_timing=timing, period=3.0, **way))
    trunk = walk.trunk
    n = terrain.normal(np.zeros(()), np.zeros(()))
    assert np.abs(trunk.rotation[..., 2] - n).max() < 1e-12
    assert np.abs(trunk.position @ n - 0.100).max() < 1e-12
    assert np.abs(trunk.position - level.trunk.position)[:, :2].max() < 1e-12
    assert np.abs(trunk.yaw - level.trunk.yaw).max() < 1e-12


def test_a_level_trunk_stays_level_and_follows_the_height_alone():
    walk = plan(PAPER.replace(terrain="slope", slope_deg=8, trunk_attitude="level"))
    assert np.abs(walk.trunk.attitude).max() == 0
    rise = np.tan(np.radians(8)) * walk.trunk.position[:, 0]
    assert np.abs(walk.trunk.position[:, 2] - 0.100 - rise).max() < 1e-12


def test_the_trunk_leans_no_farther_than_it_may():
    walk = plan(PAPER.replace(**TERRAINS["slope-up"], steepest_lean_deg=10))
    assert np.abs(np.degrees(walk.trunk.attitude) - [0, -10, 0]).max() < 1e-10


@pytest.mark.parametrize("name", ["slope-up", "slope-sideways", "stairs"])
def test_the_support_margin_is_that_of_feet_and_centre_of_mass_on_the_map(name):
    # The polygon in world axes, which the heading does not change: 1e-12.
    walk = plan(PAPER.replace(**TERRAINS[name], step_turn_deg=5, period=3.0))
    com = np.einsum("tij,tj->ti", walk.trunk.rotation, centre_of_mass(walk.robot, walk.q))
    com += walk.trunk.position
    on_map = support_margin(walk.foot_position[..., :2], walk.stance, com[:, :2])
    assert np.abs(walk.support_margin - on_map).max() < 1e-12
