"""The contact of the engine's model against the spring and damper that it shall be."""

import mujoco
import numpy as np
import pytest

from phasmid.errors import InvalidInput
from phasmid.kinematics import joint_angles
from phasmid.motion import plan
from phasmid.robot import load_robot, preset_names
from phasmid.scenario import load_scenario
from phasmid.simulation import Run, build_model, longest_time_step, simulate
from phasmid.simulation.start import longest_foot_step
from support.walks import GAITS_OF

PAPER = load_scenario("paper")


def at_neutral(model, robot):
    """The engine's state with the legs at their neutral places."""
    data = mujoco.MjData(model)
    data.qpos[7:] = joint_angles(robot.arrays, robot.arrays.neutral_foot).ravel()
    return data


@pytest.mark.parametrize("preset", preset_names())
@pytest.mark.parametrize("changes", [{}, {"stiffness": 3e4, "damping": 40}], ids=str)
def test_each_point_is_a_spring_of_its_stiffness(preset, changes):
    # At rest the force of every point that touches is K times its depth (law of the spring).
    # The engine's solver is iterative (tolerance 1e-8 of its scale): 1e-6 N of the weight.
    scenario = PAPER.replace(robot=preset, gait=GAITS_OF[preset][0], **changes)
    run = Run(scenario, plan(scenario))
    model, data = run.model, run.data
    total = np.zeros(6)
    for i in range(data.ncon):
        force = np.zeros(6)
        mujoco.mj_contactForce(model, data, i, force)
        depth = -data.contact.dist[i]
        assert force[0] == pytest.approx(scenario.build().world.contact.stiffness * depth, abs=2e-5)
        total += force
    assert total[0] == pytest.approx(run.robot.mass * 9.81, rel=1e-6)


@pytest.mark.parametrize("d", [0.2, 0.5, 0.9])
def test_a_moving_point_is_a_spring_a_damper_and_a_small_mass(d):
    # Pressed in by 1 mm at 10 mm/s each point gives K depth + B speed - m a with
    # m = d/((1 - d) A), a the point's upward acceleration, A the mobility of its foot:
    # 10 N + 0.3 N - m a.
    robot = load_robot("phantomx-paper")
    model = build_model(PAPER.replace(impedance=d))
    data = at_neutral(model, robot)
    data.qpos[2] = 0.1 - 0.001
    data.qvel[2] = -0.01
    # Prescribed joints must not resist: hold them where they are, at their speed 0.
    model.eq_data[:, 0] = data.qpos[7:]
    mujoco.mj_forward(model, data)
    assert data.ncon == 24
    for i in range(24):
        contact, force, jacobian = data.contact[i], np.zeros(6), np.zeros((3, model.nv))
        mujoco.mj_contactForce(model, data, i, force)
        body = model.geom_bodyid[contact.geom2]
        mujoco.mj_jac(model, data, jacobian, None, contact.pos, body)
        acceleration = (jacobian @ data.qacc)[2]
        mass = d / ((1 - d) * model.body_invweight0[body, 0])
        # 1e-3: the trunk is level, but friction's share tilts the feet's acceleration a little.
        assert force[0] == pytest.approx(10.3 - mass * acceleration, rel=1e-3)


def test_a_time_step_that_cannot_resolve_the_contact_is_refused():  # C4
    scenario = PAPER.replace(dt=0.5)
    with pytest.raises(InvalidInput) as caught:
        simulate(scenario, plan(scenario))
    longest = longest_time_step(scenario.build())
    assert caught.value.what == (
        f"a time step of 0.5 s cannot resolve this contact; it needs {longest:.3g} s or less."
    )


def jitter(scenario, dt):
    """Largest change of a standing foot's force along the ground from step to step [N]."""
    scenario = scenario.replace(dt=dt, duration=1.0)
    run = Run(scenario, plan(scenario))
    run.advance()
    force = run.log["sensors"][:, : 4 * 6].reshape(-1, 6, 4)[:, :, 1:3]
    bearing = run.walk.sample(run.time).stance & (np.abs(run.time - 0.5) < 0.25)[:, None]
    change = np.linalg.norm(np.diff(force, axis=0), axis=-1)
    return float(change[bearing[1:] & bearing[:-1]].max())


@pytest.mark.parametrize("changes", [{}, {"impedance": 0.1}, {"friction_damping": 2000.0}])
def test_feet_chatter_only_beyond_the_step_that_the_lightest_foot_stands(changes):
    # Stable where 2 c dt < 4 m along the ground: newtons from step to step beyond it, and below it
    # no more than the smooth load itself changes in a step, 0.1 N.
    scenario = PAPER.replace(**changes)
    longest = longest_foot_step(scenario.build())
    assert jitter(scenario, 0.9 * longest) < 0.1
    assert jitter(scenario, 1.3 * longest) > 1.0
