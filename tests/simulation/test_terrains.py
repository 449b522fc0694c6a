"""Ten terrains and more in the engine, walked by a planner that is told of them, and by one not."""

import math
from functools import cache

import mujoco
import numpy as np
import pytest

from phasmid.kinematics import quaternion_rotation
from phasmid.motion import plan
from phasmid.reporting import summarise
from phasmid.scenario import load_scenario
from phasmid.simulation import simulate
from phasmid.simulation.run import Run
from support.terrains import TERRAINS

PAPER = load_scenario("paper").replace(step_length_mm=80, duration=6.0)


def walked(**changes):
    scenario = PAPER.replace(**changes)
    walk = plan(scenario)
    run = simulate(scenario, walk)
    return scenario, walk.sample(run.time.values), run


@cache
def walked_over(name):
    return walked(**TERRAINS[name])


def creep(slope):
    """How far feet creep down a slope in 6 s by the friction's damping [m].

    Three feet of four points, each m g sin a / (12 c); on a foot that is tilted against the
    ground two of its points may touch, which doubles it.
    """
    friction_damping = PAPER.build().world.contact.friction_damping
    return 2 * 26 * math.sin(slope) / (12 * friction_damping) * PAPER.duration


def tilt_error(walk, run):
    """Angle between the planned and the simulated trunk at each sample [rad]."""
    R = quaternion_rotation(run.body_orientation.values)
    turn = np.swapaxes(walk.trunk.rotation, 1, 2) @ R
    return np.arccos(np.clip((np.trace(turn, axis1=1, axis2=2) - 1) / 2, -1, 1))


@pytest.mark.parametrize("name", TERRAINS)
def test_every_terrain_that_is_told_is_walked_as_planned(name):
    # With prescribed joints the trunk goes where the plan has it but for what contact gives: on
    # level ground 0.4 % of the way, here 1 % of 480 mm and 1 mm in height. Where the ground itself
    # is inclined the robot creeps down besides, no faster than on a slope of its steepest lean.
    scenario, walk, run = walked_over(name)
    assert run.attrs["ending"] == "COMPLETED"
    miss = run.body_position.values - walk.trunk.position
    miss -= miss[0] * [1, 1, 0]
    terrain = scenario.load_terrain()
    x, y, z = np.moveaxis(run.foot_position.values, -1, 0)
    inclined = terrain.normal(x, y)[..., 2].min() < 1
    lean = float(np.arccos(walk.trunk.rotation[:, 2, 2].min())) if inclined else 0.0
    down = creep(lean)
    assert np.hypot(*miss[:, :2].T).max() < 0.0048 + down
    assert np.abs(miss[:, 2]).max() < 0.001 + down * math.sin(lean)
    # One degree: 1 mm of contact over a stance of 120 mm is half of one.
    assert math.degrees(tilt_error(walk, run).max()) < 1.0
    # Standing feet stand on the ground, at most 1 mm in it: 26 N on three feet of two points.
    assert np.abs(z - terrain.height(x, y))[run.stance.values & run.contact.values].max() < 0.001


@pytest.mark.parametrize("name", ["stairs", "waves", "slope-sideways"])
def test_normal_forces_follow_the_model_on_uneven_ground(name):
    # Away from switches, as on level ground; across the slope the feet that creep share the
    # tangential load otherwise, which moves normal forces by its lever: 100 mm / 300 mm of 7 N.
    _, _, run = walked_over(name)
    amid = np.abs((run.time.values + 0.5) % 1.0 - 0.5) > 0.15
    difference = (run.foot_normal_force - run.foot_normal_force_model).values[amid]
    assert np.sqrt((difference**2).mean(axis=0)).max() < 0.6


def test_a_run_begins_with_the_plans_velocities():
    # Turning at constant speed on a slope the trunk turns about all its axes. The engine's own
    # figure in world axes is the plan's, to round-off.
    changes = {"stance_timing": "constant-speed", "step_length_mm": 40, "step_turn_deg": 6}
    scenario = PAPER.replace(**TERRAINS["slope-up"], **changes)
    walk = plan(scenario)
    run = Run(scenario, walk)
    mujoco.mj_forward(run.model, run.data)
    velocity, trunk = np.empty(6), walk.sample(np.zeros(1)).trunk
    mujoco.mj_objectVelocity(
        run.model,
        run.data,
        mujoco.mjtObj.mjOBJ_XBODY,
        run.model.body("trunk").id,
        velocity,
        0,
    )
    R_settled = quaternion_rotation(run.data.qpos[3:7])
    # It settled by a fraction of a degree, and turns as planned in its own axes.
    planned = R_settled @ trunk.rotation[0].T @ trunk.angular_velocity[0]
    assert np.abs(trunk.angular_velocity[0]).max() > 0.05
    assert np.abs(velocity[:3] - planned).max() < 1e-12
    assert np.abs(velocity[3:] - trunk.velocity[0]).max() < 1e-12


def test_recorded_normal_forces_are_never_negative():
    """A foot that strikes the face of a stair is pushed away from it, also downwards.

    That part of the force has no place in the normal force of the tread below; it is -53 N here.
    """
    changes = {"duration": 3.0, "period": 1.0, "step_length_mm": 80, "terrain": "stairs"}
    scenario = load_scenario("paper").replace(planned_on="level", **changes)
    run = simulate(scenario, plan(scenario))
    assert any("Joints are prescribed" in sentence for sentence in summarise(run)["warnings"])
    feet, force = run["foot_position"].values, run["foot_force"].values
    normal = scenario.load_terrain().normal(feet[..., 0], feet[..., 1])
    assert np.einsum("tlk,tlk->tl", force, normal).min() < -1.0
    assert float(run["foot_normal_force"].min()) >= 0.0
