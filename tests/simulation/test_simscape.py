"""The paper's contact law and its simulator against closed forms, and against the engine."""

import math

import mujoco
import numpy as np
import pytest

from phasmid import dynamics
from phasmid.errors import InvalidInput
from phasmid.kinematics import centre_of_mass, link_frames, quaternion_rotation
from phasmid.motion import plan
from phasmid.scenario import load_scenario
from phasmid.simulation import Run, simulate
from phasmid.simulation.contact import foot_points
from phasmid.simulation.simscape.run import SimscapeRun
from phasmid.simulation.simscape.trunk import friction_coefficient, normal_force
from phasmid.units import STANDARD_GRAVITY
from support.walks import tilted_robot

PAPER = load_scenario("paper").replace(contact_law="simscape")
STILL = PAPER.replace(step_length=0.0, step_height=0.0)
"""The same with feet that stay where they are: a rigid robot."""
G, STATIC, KINETIC, THRESHOLD = 9.81, 0.7, 0.5, 1e-3


def started(scenario, *, pose=None, twist=None, weight=None):
    """A run that has settled, with another start, and in another field of gravity."""
    run = SimscapeRun(scenario, plan(scenario))
    run.pose[:] = run.pose if pose is None else pose
    run.twist[:] = run.twist if twist is None else twist
    if weight is not None:
        run.constants = run.constants._replace(weight=tuple(weight))
    return run


def flight(duration, *, dt=1e-3, gravity=True, **changes):
    """A run high over the ground, thrown and tumbling, the legs walking in the air."""
    scenario = PAPER.replace(duration=duration, dt=dt, **changes)
    pose = np.array([0.0, 0.0, 50.0, 1.0, 0.0, 0.0, 0.0])
    twist = np.array([0.3, -0.2, 1.0, 0.6, -0.4, 0.5])
    return started(scenario, pose=pose, twist=twist, weight=None if gravity else np.zeros(3))


def states(run):
    """Time, pose, twist and joints of all samples of a run, and its trunk's motion."""
    n = run.done
    qpos, qvel = run.log["qpos"][:n], run.log["qvel"][:n]
    R = quaternion_rotation(qpos[:, 3:7])
    w = np.einsum("tij,tj->ti", R, qvel[:, 3:6])
    zero = np.zeros((n, 3))
    body = dynamics.BodyMotion(qpos[:, :3], R, qvel[:, :3], w, zero, zero)
    return body, qpos[:, 7:].reshape(n, -1, 3), qvel[:, 6:].reshape(n, -1, 3)


def test_the_centre_of_mass_flies_a_parabola_while_the_legs_wave():
    # c = c0 + v0 t - g t²/2, whatever the joints do: the method is exact for quadratics, and the
    # error is round-off, 400 steps of 50 m * 1e-16.
    run = flight(0.4)
    run.advance()
    body, q, qd = states(run)
    com = body.position + np.einsum("tij,tj->ti", body.rotation, centre_of_mass(run.robot, q))
    speed = dynamics.momentum(run.robot, body, q, qd).linear / run.robot.mass
    t = np.arange(run.done)[:, None] * run.dt
    fallen = com[0] + speed[0] * t - [0, 0, G / 2] * t**2
    assert np.abs(com - fallen).max() < 1e-11


def test_a_robot_that_waves_its_legs_in_flight_keeps_its_momenta():
    # No gravity, no contact: linear and angular momentum, the latter about the centre of mass, by
    # the independent mass matrix of `dynamics`. Both are states of the method and change by
    # round-off alone: 400 steps of 1e-16 times the size of sums that cancel, some tens.
    run = flight(0.4, gravity=False)
    run.advance()
    found = dynamics.momentum(run.robot, *states(run))
    assert np.abs(found.linear - found.linear[0]).max() < 1e-12
    assert np.abs(found.angular - found.angular[0]).max() < 1e-12


def test_a_tumbling_flight_converges_with_second_order():
    # ROS2 without contact is Heun's method: halved substeps leave a quarter of the error.
    def end(substeps):
        run = flight(0.4, dt=4e-3, record_interval=4e-3)
        run.constants = run.constants._replace(substeps=substeps)
        run.advance()
        return run.log["qpos"][run.done - 1, 3:7].copy()

    exact = end(64)
    errors = [np.linalg.norm(end(n) - exact) for n in (1, 2, 4)]
    # 64 against 4 substeps: the reference's own error is 1/256 of the smallest.
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([2, 2], abs=0.1)


def test_a_press_into_the_ground_converges_with_second_order():
    # Pushed down and forward below the threshold, all points sink and stick for 2 ms: the law is
    # smooth there, and the order is the method's. The dampers' rates are up to 3e4/s.
    def end(substeps):
        run = started(STILL.replace(duration=0.002))
        run.twist[:3] = [2e-4, 0.0, -0.02]
        run.constants = run.constants._replace(substeps=substeps)
        run.advance()
        return np.concatenate([run.pose, run.twist])

    exact = end(2048)
    errors = [np.linalg.norm(end(n) - exact) for n in (32, 64, 128)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([2, 2], abs=0.2)


@pytest.mark.parametrize("robot", ["phantomx-paper", tilted_robot()], ids=["paper", "tilted"])
def test_a_flight_agrees_with_the_engines_to_the_engines_order(robot):
    # Both simulators are told the same plan; the engine is of first order, so that halving its
    # step halves the difference. 20 % for its second-order part.
    def apart(dt):
        ours = flight(0.2, dt=dt, record_interval=dt, robot=robot)
        ours.advance()
        theirs = Run(ours.experiment.replace(contact_law="spring-damper"), ours.walk)
        first = ours.log["qpos"][0], ours.log["qvel"][0]
        theirs.data.qpos[:], theirs.data.qvel[:] = first
        mujoco.mj_forward(theirs.model, theirs.data)
        theirs.advance()
        return np.linalg.norm(
            theirs.log["qpos"][theirs.done - 1, :7] - ours.log["qpos"][ours.done - 1, :7]
        )

    wide, narrow = apart(2e-3), apart(1e-3)
    assert narrow < 1e-2
    assert wide / narrow == pytest.approx(2, rel=0.2)


def test_a_standing_robot_is_in_equilibrium_as_deep_as_its_springs_say():
    # Sum of forces m g, and no acceleration; 1e-6 of the weight, as row 14 asks. Feet at their
    # neutral places lie flat: the mean depth of the 24 points is m g/(24 k), and a foot's tip is at
    # the bottom of its points. 1 s of one-sided damping leaves nothing.
    run = started(STILL.replace(duration=0.01))
    run.advance()
    contact = run.log["sensors"][0, :24].reshape(6, 4)
    assert contact[:, 0].tolist() == [4.0] * 6
    assert contact[:, 3].sum() == pytest.approx(run.robot.mass * G, rel=1e-6)
    assert np.abs(run.acceleration[0]).max() < 1e-5
    tips = run.log["sensors"][0, 24:].reshape(6, 3)
    assert -tips[:, 2].mean() == pytest.approx(run.robot.mass * G / (24 * 1e4), rel=1e-6)


def test_a_sliding_robot_stops_after_v_squared_over_twice_mu_g():
    # Fast slip has the kinetic coefficient: v²/(2 mu g) = 4.08 mm at 0.2 m/s. The last
    # millimetre per second, where friction is larger, is (1/200)² of the way. Friction also tilts
    # the robot, which rocks on its springs: 0.5 %, as row 18 allows.
    run = started(STILL.replace(duration=0.2))
    run.twist[0] = 0.2
    run.advance()
    way = run.log["qpos"][run.done - 1, 0] - run.log["qpos"][0, 0]
    assert way == pytest.approx(0.2**2 / (2 * KINETIC * G), rel=0.005)


def tilted(run, degrees):
    """Gravity as on an incline that falls along x."""
    angle = math.radians(degrees)
    size = -run.constants.weight[2]
    weight = size * math.sin(angle), 0.0, -size * math.cos(angle)
    run.constants = run.constants._replace(weight=weight)


@pytest.mark.parametrize("degrees", [5, 20, 25])
def test_a_robot_on_an_incline_creeps_as_the_law_says(degrees):
    # Below atan(0.7) = 35° friction is 0.7 N v/threshold at each point, and all points of a rigid
    # robot slip alike: v = threshold tan(angle)/0.7, however the load is shared. Rocking is over
    # after 0.6 s: 1e-3 of it. Past atan(0.5) = 27° the jolt of the start would set it sliding.
    run = started(STILL.replace(duration=0.6))
    tilted(run, degrees)
    run.advance()
    creep = THRESHOLD * math.tan(math.radians(degrees)) / STATIC
    assert run.twist[0] == pytest.approx(creep, rel=1e-3)


def test_a_robot_on_a_steeper_incline_slips():
    # Above 35°: a = g (sin - 0.5 cos) once it slips; 36.5° for 0.4 s. The first 1.5 mm/s are
    # soon over, and rocking averages out: 3 %.
    run = started(STILL.replace(duration=0.4))
    tilted(run, 36.5)
    run.advance()
    half = run.done // 2
    gained = run.log["qvel"][run.done - 1, 0] - run.log["qvel"][half, 0]
    angle = math.radians(36.5)
    rate = gained / ((run.done - 1 - half) * run.dt)
    assert rate == pytest.approx(G * (math.sin(angle) - KINETIC * math.cos(angle)), rel=0.03)


def contact_in_numpy(run, k):
    """The law at sample k, written anew: forces on all points and their Jacobians.

    Returns generalised forces of the ground, and the force on each foot.
    """
    robot, legs = run.robot, len(run.robot.legs)
    qpos, qvel = run.log["qpos"][k], run.log["qvel"][k]
    R = quaternion_rotation(qpos[3:7])
    q = qpos[7:].reshape(legs, 3)
    speeds = np.concatenate([qvel[:3], R @ qvel[3:6], qvel[6:]])
    frames = link_frames(robot, q)
    points = np.stack([foot_points(robot, leg, run.law) for leg in robot.legs])
    radius, general, on_feet = run.law.point_radius, np.zeros(6 + 3 * legs), np.zeros((legs, 3))
    for leg in range(legs):
        for corner in points[leg]:
            centre = qpos[:3] + R @ (frames.position[leg, 2] + frames.rotation[leg, 2] @ corner)
            depth = radius - centre[2]
            if depth <= 0:
                continue
            at = centre - [0.0, 0.0, radius - depth / 2]
            J = np.zeros((3, 6 + 3 * legs))
            J[:, :3] = np.eye(3)
            J[:, 3:6] = np.cross(np.eye(3), at - qpos[:3]).T
            for joint in range(3):
                axis = R @ frames.rotation[leg, joint, :, 2]
                origin = qpos[:3] + R @ frames.position[leg, joint]
                J[:, 6 + 3 * leg + joint] = np.cross(axis, at - origin)
            v = J @ speeds
            normal = 1e4 * depth + 1e2 * max(0.0, -v[2])
            slip = math.hypot(v[0], v[1])
            mu = np.interp(slip, [0, THRESHOLD, 1.5 * THRESHOLD], [0, STATIC, KINETIC])
            force = np.array([-mu * normal * v[0] / slip, -mu * normal * v[1] / slip, normal])
            on_feet[leg] += force
            general += J.T @ force
    return general, on_feet


@pytest.mark.parametrize("robot", ["phantomx-paper", tilted_robot()], ids=["paper", "tilted"])
def test_forces_and_torques_satisfy_the_law_and_the_equation_of_motion(robot):
    # M a + h = tau + sum J^T F of all points, with the law written anew in NumPy and the matrices
    # of `dynamics`: six rows say that the trunk's acceleration is right, the others give the
    # recorded torques. Round-off: depths of 1e-4 m out of 0.1 m, times 1e4 N/m, and slips of
    # 1e-4 m/s out of 0.1 times 1400 N·s/m: some 1e-11 N, on arms below 1 m.
    run = started(PAPER.replace(duration=0.5, robot=robot))
    run.advance()
    for k in (3, 77, 250, 490):
        general, on_feet = contact_in_numpy(run, k)
        recorded = run.log["sensors"][k, :24].reshape(6, 4)[:, 1:]
        assert np.abs(recorded - on_feet).max() < 1e-9
        body, q, qd = states(run)
        here = dynamics.BodyMotion(
            body.position[k],
            body.rotation[k],
            body.velocity[k],
            body.angular_velocity[k],
            np.zeros(3),
            np.zeros(3),
        )
        h = dynamics.bias_force(run.robot, here, q[k], qd[k], gravity=STANDARD_GRAVITY)
        M = dynamics.mass_matrix(run.robot, here, q[k])
        qdd = run.walk.sample(np.array([k * run.dt])).qdd[0].ravel()
        needed = M @ np.concatenate([run.acceleration[k], qdd]) + h - general
        assert np.abs(needed[:6]).max() < 1e-9
        assert needed[6:] == pytest.approx(run.log["torque"][k], abs=1e-9)


def test_the_law_of_a_point_is_linear_between_its_corners():
    # K depth + B sinking, no damping while it leaves, nothing above the ground: 2 N + 1 N. Friction
    # over normal force by thresholds of slip: (0, 0), (1, 0.7), (1.5, 0.5); rounding only.
    forces = [normal_force(*point, 1e4, 1e2) for point in ((2e-4, 0.01), (2e-4, -1.0), (0.0, 1.0))]
    assert forces == pytest.approx([3.0, 2.0, 0.0], rel=1e-15)
    speeds = np.array([0, 0.5, 1, 1.25, 1.5, 2, 1000]) * THRESHOLD
    law = [friction_coefficient(speed, STATIC, KINETIC, THRESHOLD) for speed in speeds]
    assert law == pytest.approx([0.0, 0.35, 0.7, 0.6, 0.5, 0.5, 0.5], abs=1e-12)


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        (
            {"drive": "ideal-servo"},
            'drive is "ideal-servo"; under contact_law = "simscape" it must be "prescribed", since '
            "its simulator has no other drive.",
        ),
        (
            {"terrain": "stairs"},
            'terrain is "stairs"; under contact_law = "simscape" it must be level ground without '
            "patches, since its simulator has no other.",
        ),
    ],
)
def test_other_drives_and_grounds_are_refused(changes, what):
    scenario = PAPER.replace(**changes)
    with pytest.raises(InvalidInput) as caught:
        simulate(scenario, plan(scenario))
    assert caught.value.what == what


def test_a_general_robot_has_the_matrices_of_dynamics():
    # Inertia, momenta and their rates of `legs` for legs without any symmetry, against the mass
    # matrix of `dynamics`; rates against central differences of 1e-5 s: 1e-9 of their size.
    from phasmid.simulation.simscape import legs as room
    from support.general_robot import general_robot

    robot = general_robot()
    rng = np.random.default_rng(5)
    q0, qd0, qdd = rng.uniform(-1, 1, (3, 1, len(robot.legs), 3))
    times = np.array([-1e-5, 0.0, 1e-5])[:, None, None]
    joints = room.Setpoints(
        q0 + qd0 * times + qdd * times**2 / 2, qd0 + qdd * times, qdd + 0 * times
    )
    whole = room.mass_distribution(robot, link_frames(robot, joints.q), joints)
    body = dynamics.BodyMotion.at_rest()
    M = dynamics.mass_matrix(robot, body, joints.q)
    momenta = dynamics.momentum(robot, body, joints.q, joints.qd)
    first = robot.mass * whole.com
    second = M[:, 3:6, 3:6] - robot.mass * room.spread(whole.com, whole.com) / 2
    assert np.abs(M[:, 5, 1] - first[:, 0]).max() < 1e-14
    assert np.abs(second - whole.inertia).max() < 1e-14
    assert np.abs(momenta.linear - robot.mass * whole.com_rate).max() < 1e-14
    assert np.abs(momenta.angular - whole.momentum).max() < 1e-14
    for value, rate in (
        (whole.com, whole.com_rate),
        (whole.com_rate, whole.com_acceleration),
        (whole.inertia, whole.inertia_rate),
        (whole.momentum, whole.momentum_rate),
    ):
        slope = (value[2] - value[0]) / 2e-5
        assert np.abs(slope - rate[1]).max() < 1e-8
