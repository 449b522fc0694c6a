"""The robot in physics without an end, driven by a setting."""

import math

import numpy as np
import pytest

from phasmid import load_scenario
from phasmid.control import SafetyFilter
from phasmid.dynamics import BodyMotion
from phasmid.dynamics.floating_base import momentum
from phasmid.errors import InvalidInput
from phasmid.kinematics import quaternion_rotation
from phasmid.reporting.webpage.replay import surroundings
from phasmid.studio.fields import field_of
from phasmid.studio.live import LiveRobot
from phasmid.studio.scene import Scene
from phasmid.studio.setting import setting_of

PAPER = setting_of(load_scenario("paper"))
NO_LEGS = frozenset()


def linear_momentum(live):
    """Of the whole robot in the world, as the engine stands."""
    run, data = live.run, live.run.data
    R = quaternion_rotation(data.qpos[3:7])
    body = BodyMotion(
        position=data.qpos[:3].copy(),
        rotation=R,
        velocity=data.qvel[:3].copy(),
        angular_velocity=R @ data.qvel[3:6],
        acceleration=np.zeros(3),
        angular_acceleration=np.zeros(3),
    )
    shape = (len(run.robot.legs), 3)
    q, qd = data.qpos[7:].reshape(shape), data.qvel[6:].reshape(shape)
    return momentum(run.robot, body, q, qd).linear


@pytest.mark.parametrize("drive", ["prescribed", "servo"])
def test_a_push_gives_the_robot_its_impulse(drive):
    # In free flight nothing but gravity and the push changes the momentum: p(T) - p(0) + m g T is
    # the impulse. The engine sets speeds, of which the momentum is a function of the pose too; its
    # pose is a step dt behind or ahead of them, in which the robot turns by w dt. With a trunk that
    # the push turns at some 2 rad/s this is 2e-3 of the momentum, of the impulse and of m g T.
    live = LiveRobot(field_of("drive").changed(PAPER, drive))
    run, impulse = live.run, np.array([0.3, -0.2, 0.1])
    run.data.qpos[2] += 5.0
    turned = quaternion_rotation(np.array([math.cos(0.2), 0.0, 0.0, math.sin(0.2)]))
    run.data.qpos[3:7] = math.cos(0.2), 0.0, 0.0, math.sin(0.2)
    live.advance(1)
    begin, before = linear_momentum(live), live.now
    lasts = run.push(tuple(impulse), 0.05)
    assert lasts == pytest.approx(0.05, abs=1e-12)
    live.advance(20)
    passed = live.now - before
    assert passed == pytest.approx(0.1, abs=1e-12)
    weight = run.robot.mass * 9.81
    gained = linear_momentum(live) - begin + [0.0, 0.0, weight * passed]
    # In the axes that the body had when it was pushed.
    wanted = turned @ impulse
    assert gained == pytest.approx(wanted, abs=2e-3 * (np.linalg.norm(wanted) + weight * passed))
    # It is over: the force is gone.
    assert not run.data.xfrc_applied.any()


def test_a_run_without_an_end_outlives_its_scenario_and_keeps_no_list_that_grows():
    setting = setting_of(load_scenario("paper").replace(duration=0.1))
    live = LiveRobot(setting)
    for turn in range(60):
        # A new command at each turn, and ones that the engine has something to say of.
        share = (0.2 + 0.01 * turn, 0.1, 0.0)
        live.follow(setting, share, frozenset({2}) if turn % 20 == 10 else NO_LEGS)
        live.advance(5)
        live.take_events()
    assert live.now == pytest.approx(1.5, abs=1e-9)
    assert live.failure is None
    run, controller = live.run, live.run.controller
    assert isinstance(controller, SafetyFilter)
    assert len(run.command_changes) <= 1
    assert not controller.events
    assert not controller.controller.events
    assert not controller.controller.walker.events
    assert "time" not in vars(run), "times of samples that never end"
    assert len(live._marks) <= 62


def test_a_learned_policy_walks_by_the_stick():
    """Two seconds at full stick, after one to set off.

    The shipped policy's least gate is 90 %, for motors without stiction; on servos of their own
    law it walks 86 %.
    """
    robot = setting_of(load_scenario("paper").replace(robot="phantomx-ax", drive="servo"))
    setting = field_of("controller").changed(robot, "walk")
    live = LiveRobot(setting)
    assert not live.plays
    assert live.status == "stands"
    live.follow(setting, (1.0, 0.0, 0.0), NO_LEGS)
    assert live.status == "walks"
    live.advance(200)
    start = live.sample["qpos"][0, 0]
    live.advance(400)
    speed = (live.sample["qpos"][0, 0] - start) / 2.0
    assert 0.8 < speed / live.command.velocity[0] < 1.2
    quadruped = field_of("robot").changed(setting, "quadruped")
    with pytest.raises(InvalidInput, match="the policy takes 65 observations"):
        LiveRobot(quadruped)


def test_a_share_of_the_stick_is_that_share_of_what_is_possible():
    live = LiveRobot(PAPER)
    engine = live._engine
    gait, period = PAPER.gait, PAPER.experiment.course.stride.period
    for axis in range(3):
        unit = [0.0, 0.0, 0.0]
        unit[axis] = -1.0
        most = engine.largest_velocity(tuple(unit), gait=gait, period=period).velocity
        share = [0.0, 0.0, 0.0]
        share[axis] = -0.4
        live.follow(PAPER, tuple(share), NO_LEGS)
        assert live.command.velocity == pytest.approx([0.4 * part for part in most], abs=1e-12)
    # Along all at once it stays within what is possible in that direction.
    live.follow(PAPER, (1.0, 1.0, 1.0), NO_LEGS)
    asked = live.command.velocity
    most = engine.largest_velocity(asked, gait=gait, period=period).velocity
    assert math.hypot(*asked) <= math.hypot(*most)
    assert all(part > 0 for part in asked)


def test_the_plan_is_played_as_it_was_planned():
    setting = field_of("walks").changed(PAPER, "the plan")
    setting = field_of("drive").changed(setting, "prescribed")
    live = LiveRobot(setting)
    assert live.plays
    live.advance(400)
    # Two seconds of the paper's walk are two steps of 40 mm, rest to rest; the ground gives way by
    # less than a millimetre.
    assert live.failure is None
    assert live.sample["qpos"][0, 0] == pytest.approx(0.08, abs=1e-3)
    assert live.ends_at == math.inf


@pytest.fixture(scope="module")
def standing():
    """The robot at rest, half a second after its start."""
    setting = field_of("walks").changed(PAPER, "by hand")
    live = LiveRobot(setting)
    live.follow(setting, (0.0, 0.0, 0.0), NO_LEGS)
    live.advance(100)
    return live


def named(scene, row):
    row, at, found = np.frombuffer(row, "<f4"), 0, {}
    for name, count in scene.layout:
        found[name] = row[at : at + count]
        at += count
    assert at == len(row)
    return found


def test_a_frame_tells_what_the_robot_does(standing):
    scene = Scene(standing, 7)
    frame = named(scene, scene.frame(standing, 1.0))
    assert frame["scene"] == 7
    weight = standing.source.weight
    forces = frame["foot_force"].reshape(6, 3)
    # At rest the ground bears the weight; the robot still sways by some thousandths of g.
    assert forces[:, 2].sum() == pytest.approx(weight, rel=0.01)
    assert frame["contact"].all()
    assert frame["stance"].all()
    # The model of the robot at rest shares it alike by symmetry, and its torques belong to it.
    model = frame["foot_force_model"].reshape(6, 3)
    assert model.sum(axis=0) == pytest.approx([0.0, 0.0, weight], abs=1e-4 * weight)
    assert frame["margin"] > 0.05
    assert frame["tilt"] < 0.01
    assert frame["below"] == 0.0
    assert frame["body_position"] == pytest.approx(standing.sample["qpos"][0, :3], abs=1e-6)
    worst, share = frame["worst_servo"]
    torque = np.abs(frame["joint_torque"])
    assert torque[int(worst)] == pytest.approx(torque.max(), rel=0.2)
    assert 0 < share < 1.5
    # Nothing was asked, and nothing is got.
    assert frame["velocity_command"] == pytest.approx([0, 0, 0])
    assert np.abs(frame["velocity"][:2]).max() < 2e-3


def test_a_force_model_that_is_changed_counts_at_once(standing):
    """It does not build the run anew; the model's arrows follow the setting."""
    before = standing.setting
    changed = field_of("force_model").changed(before, "minimum-torque")
    assert changed.built_of() == before.built_of()
    frames = []
    for setting in (before, changed):
        standing.follow(setting, (0.0, 0.0, 0.0), frozenset())
        scene = Scene(standing, 1)
        frames.append(named(scene, scene.frame(standing, 1.0)))
    standing.follow(before, (0.0, 0.0, 0.0), frozenset())
    models = [frame["foot_force_model"] for frame in frames]
    assert np.abs(models[1] - models[0]).max() > 0.01 * standing.source.weight


def test_links_are_where_the_reports_have_them(standing):
    from phasmid.reporting.robot_mesh import link_poses, mesh_pieces, quaternions

    scene = Scene(standing, 1)
    frame = named(scene, scene.frame(standing, 1.0))
    q = standing.sample["qpos"][0, 7:].reshape(1, 6, 3)
    places = mesh_pieces(standing.source.robot).links
    poses = link_poses(standing.source.robot, q, places)[0]
    # Numbers of four bytes.
    position, turn = frame["link_position"].reshape(-1, 3), frame["link_orientation"].reshape(-1, 4)
    assert position == pytest.approx(poses[:, :3, 3], abs=1e-6)
    assert turn == pytest.approx(quaternions(poses[:, :3, :3]), abs=1e-6)


def test_a_payload_costs_a_robot_on_its_servos_more_power_and_more_per_weight_and_way():
    # Servos that hold a load draw current without any mechanical work. Three cycles of 2 s.
    costs = []
    for payload in (0.0, 4.0):
        setting = field_of("payload").changed(field_of("drive").changed(PAPER, "servo"), payload)
        live = LiveRobot(setting)
        live.follow(setting, (0.5, 0.0, 0.0), frozenset())
        live.advance(round(6.0 / live.period))
        assert live.failure is None
        costs.append(live.metrics)
    assert costs[1].power > 2 * costs[0].power
    # Mechanical work per weight and way stays within some per cent.
    assert costs[1].cost_of_transport > 1.3 * costs[0].cost_of_transport


def test_patches_are_told_with_their_friction_over_that_of_the_ground():
    patches = ((0.3, 0.6, -1.0, 1.0, 0.14), (0.5, 0.7, 0.0, 0.2, 1.4))
    scenario = load_scenario("paper").replace(friction=0.7, patches=patches, terrain_yaw=0.5)
    ground = scenario.load_terrain()
    told = surroundings(ground, np.zeros(2), 2.0)["patches"]
    assert told["each"] == [[0.3, 0.6, -1.0, 1.0, 0.2], [0.5, 0.7, 0.0, 0.2, 2.0]]
    assert (told["box"], told["yaw"]) == ([0.3, 0.7, -1.0, 1.0], 0.5)
    # Far away there is none to draw.
    assert surroundings(ground, np.array([9.0, 0.0]), 2.0)["patches"] is None
    plain = load_scenario("paper").load_terrain()
    assert surroundings(plain, np.zeros(2), 2.0)["patches"] is None
