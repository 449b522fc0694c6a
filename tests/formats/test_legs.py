"""Legs are found by what moves on what, in whatever words and frames a file says it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from formats.test_round_trip import differences
from formats.trees import (
    block,
    joined,
    pose,
    random_turn,
    reframed,
    renamed,
    turn,
    with_joint,
    with_joints,
    with_link,
)
from phasmid.formats import ImportOptions, Severity, TreeJoint, TreeLink, robot_from_tree, tree_of
from phasmid.robot import load_robot
from phasmid.robot.inertial import Inertial
from phasmid.scenario import Scenario
from phasmid.servo import load_servo
from phasmid.simulation import build_model
from support.general_robot import general_robot

MK4 = replace(load_robot("phantomx-mk4"), appearance=None)
TREE = tree_of(MK4)
FEMUR, TIBIA = "right_rear_femur", "right_rear_tibia"
AT_LEG_3 = "robot: leg at joint right_rear_coxa: "


def robot_of(tree, **options):
    imported = robot_from_tree(tree, ImportOptions(**options))
    assert imported.robot is not None, imported.findings
    return imported.robot


def said(imported, severity):
    return [f.sentence for f in imported.findings if f.severity is severity]


def refusal(tree, **options):
    imported = robot_from_tree(tree, ImportOptions(**options))
    assert imported.robot is None
    return imported.impossible[0].sentence


def turned_joint(name, degrees):
    """The tree in which a joint's axis is turned about its x."""
    X = joint_called(name).X_parent_child.copy()
    X[:3, :3] = turn([1, 0, 0], math.radians(degrees))
    return with_joint(TREE, name, X_parent_child=X)


def joint_called(name):
    return next(joint for joint in TREE.joints if joint.name == name)


def flipped(joint):
    home = -(joint.home or 0.0)
    return replace(joint, axis=-joint.axis, lower=-joint.upper, upper=-joint.lower, home=home)


def straight_knee(joint):
    return replace(joint, lower=0.1, upper=0.2) if "tibia" in joint.name else joint


def on_its_side():
    return reframed(TREE, {"base_link": pose(turn([1, 0, 0], math.pi / 2))})


def with_three_legs():
    kept = ("right_front", "left_front", "left_rear", "base")
    links = {n: k for n, k in TREE.links.items() if n.startswith(kept)}
    joints = tuple(j for j in TREE.joints if j.child in links)
    return replace(TREE, links=links, joints=joints)


@pytest.mark.parametrize(
    ("tree", "what"),
    [
        (turned_joint(TIBIA, 12), "leg 3: femur and tibia axes differ by 12°; this"),
        (turned_joint(FEMUR, 60), "leg 3: coxa and femur axes are 60° apart; this model needs"),
        (with_joint(TREE, TIBIA, kind="fixed"), AT_LEG_3 + "it has 2 hinges (right_rear_coxa, "),
        (
            with_joint(TREE, "right_rear_foot_joint", kind="revolute"),
            AT_LEG_3 + "it has 4 hinges (",
        ),
        (with_joint(TREE, FEMUR, kind="prismatic"), AT_LEG_3 + f"joint {FEMUR} is prismatic;"),
        (with_three_legs(), "robot: phantomx-mk4 has 3 chains of three hinges that leave"),
        (with_joints(TREE, straight_knee), "robot: no stance with knees up is within the joint"),
        (with_joints(TREE, lambda j: replace(j, effort=None)), "servo: the joints have no effort,"),
        (on_its_side(), "robot: the hips spread 200 mm along z and 0 mm along y; z must be up."),
    ],
)
def test_a_robot_that_is_no_walking_robot_is_told_why(tree, what):
    assert refusal(tree).startswith(what)


@pytest.mark.parametrize("seed", range(3))
def test_names_and_order_of_links_and_joints_mean_nothing(seed):
    rng = np.random.default_rng(seed)
    assert not differences(robot_of(TREE), robot_of(renamed(TREE, rng)))
    general = tree_of(general_robot())
    assert not differences(robot_of(general), robot_of(renamed(general, rng)))


@pytest.mark.parametrize("seed", range(3))
def test_frames_of_links_mean_nothing(seed):
    """Any frame whose origin is on the hinge's axis, and an axis either way along it."""
    rng = np.random.default_rng(seed)
    for tree in (TREE, tree_of(general_robot())):
        frames = {}
        for joint in tree.joints:
            along = rng.uniform(-0.1, 0.1) if joint.kind == "revolute" else 0.0
            frames[joint.child] = pose(random_turn(rng), [0, 0, along])
        told = reframed(tree, frames)
        flips = {j.name for j in told.joints if rng.random() < 0.5}
        told = replace(told, joints=[flipped(j) if j.name in flips else j for j in told.joints])
        assert not differences(robot_of(tree), robot_of(told))
        for leg in robot_from_tree(told).legs:
            signs = [-1 if name in flips else 1 for name in leg.joints]
            np.testing.assert_array_equal(leg.signs, signs)


def test_zeros_of_femur_and_tibia_become_bends_and_limits():
    """A file whose joints are at 0 elsewhere is the same leg: θ = φ + offset."""

    def shifted(joint):
        shift = {"femur": 0.3, "tibia": -0.7}.get(joint.name.rpartition("_")[2])
        if shift is None:
            return joint
        X = joint.X_parent_child @ pose(turn([0, 0, 1], shift))
        limits = {"lower": joint.lower - shift, "upper": joint.upper - shift}
        return replace(joint, X_parent_child=X, home=(joint.home or 0.0) - shift, **limits)

    told = with_joints(TREE, shifted)
    a, b = robot_of(TREE), robot_of(told)
    bends = [f"legs[{i}].{bend}" for i in range(6) for bend in ("femur_bend", "tibia_bend")]
    assert differences(a, b) == bends
    assert b.legs[0].femur_bend == pytest.approx(0.3)
    assert b.legs[0].tibia_bend == pytest.approx(0.3 - 0.7)
    np.testing.assert_allclose(robot_from_tree(told).legs[0].offsets, [0, 0.3, -0.7], atol=1e-15)


def test_links_that_are_fixed_to_each_other_are_one():
    """Half of each link's mass in a link of its own changes nothing."""
    tree = TREE
    for i, (name, link) in enumerate(TREE.links.items()):
        if link.inertial is None:
            continue
        m = link.inertial
        part = Inertial(m.mass / 2, m.com, m.inertia / 2)
        X = pose(turn([1, 2, 3], 0.1 * i), [0.01, 0.02, 0.03])
        R = X[:3, :3].T
        moved = Inertial(part.mass, R @ (part.com - X[:3, 3]), R @ part.inertia @ R.T)
        glue = TreeJoint(f"glue{i}", "fixed", name, f"half{i}", X)
        tree = joined(
            with_link(tree, name, inertial=part), glue, links=(TreeLink(f"half{i}", moved),)
        )
    assert not differences(robot_of(TREE), robot_of(tree))


def test_heads_and_grippers_are_held_and_told():
    weight = Inertial(0.1, np.zeros(3), np.eye(3) * 1e-4)
    pan = TreeJoint("pan", "revolute", "base_link", "head", pose(p=(0.1, 0, 0.05)))
    tilt = TreeJoint("tilt", "revolute", "head", "eyes", pose(p=(0.02, 0, 0)))
    claw = TreeJoint("claw", "prismatic", "right_front_tibia_link", "jaw", pose(p=(0.1, 0, 0)))
    links = tuple(TreeLink(name, weight) for name in ("head", "eyes", "jaw"))
    imported = robot_from_tree(joined(TREE, pan, tilt, claw, links=links))
    assert imported.robot.mass == pytest.approx(MK4.mass + 0.3, rel=1e-14)
    assert imported.robot.legs[0].tibia.mass == pytest.approx(MK4.legs[0].tibia.mass + 0.1)
    assert "joints pan, tilt, claw: held at angle 0, as part of no leg." in said(
        imported, Severity.NOTE
    )


def test_a_trunk_may_float_in_a_world_and_have_its_origin_anywhere():
    tree = reframed(TREE, {"base_link": pose(p=(0.03, 0.01, -0.02))})
    free = TreeJoint("free", "floating", "world", "base_link", pose(p=(0, 0, 0.2)))
    tree = joined(tree, free, links=(TreeLink("world"),))
    assert not differences(robot_of(TREE), robot_of(tree))
    assert "body: its origin was moved by (-30.00, -10.00, 20.00) mm, amid the coxa axes." in said(
        robot_from_tree(tree), Severity.NOTE
    )


def test_small_misalignments_are_set_right_and_told():
    """A tibia axis 0.005° off: a foot 246 mm away is at most 246 mm · 8.7e-5 elsewhere."""
    imported = robot_from_tree(turned_joint(TIBIA, 0.005))
    assert (
        "leg 3: its axes were turned by up to 0.005° to be vertical, square or parallel, which "
        "moves the foot by up to 0.021 mm."
    ) in said(imported, Severity.NOTE)


def test_feet_near_the_legs_plane_are_moved_into_it_and_others_are_lateral_offsets():
    X = pose(p=(MK4.legs[0].tibia.length, 0, 0.003))
    imported = robot_from_tree(with_joint(TREE, "right_front_foot_joint", X_parent_child=X))
    assert "leg 1: its foot is 3 mm off the leg's plane and was moved into it." in said(
        imported, Severity.NOTE
    )
    # The tibia's axis is to the leg's right.
    X[2, 3] = -0.02
    leg = robot_of(with_joint(TREE, "right_front_foot_joint", X_parent_child=X)).legs[0]
    assert leg.lateral_offsets.sum() == pytest.approx(0.02, abs=1e-15)
    np.testing.assert_allclose(leg.lengths, MK4.legs[0].lengths, atol=1e-15)


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"kind": "continuous", "lower": -np.inf, "upper": np.inf}, (-math.pi, math.pi)),
        ({"lower": -np.inf}, (-math.pi, None)),
        ({"upper": np.inf}, (None, math.pi)),
    ],
)
def test_a_side_without_a_limit_is_half_a_turn(fields, expected):
    own = MK4.legs[0].joint_limits
    limits = robot_of(with_joint(TREE, "right_front_femur", **fields)).legs[0].joint_limits
    wanted = [
        side if limit is None else limit for side, limit in zip(own[1], expected, strict=True)
    ]
    np.testing.assert_allclose(limits, [own[0], wanted, own[2]], atol=1e-15)


def test_a_coxa_whose_zero_is_out_of_reach_points_where_its_limits_are_even():
    """Limits of 30° to 90° about a zero that lies 60° aside: the hip turns, not the leg."""
    aside = math.radians(60)
    joint = joint_called("right_middle_coxa")
    told = with_joint(
        TREE,
        joint.name,
        X_parent_child=joint.X_parent_child @ pose(turn([0, 0, 1], -aside)),
        lower=math.radians(30),
        upper=math.radians(90),
    )
    leg = robot_of(told).leg("right_middle")
    assert leg.mount_yaw == pytest.approx(-math.pi / 2, abs=1e-15)
    np.testing.assert_allclose(leg.joint_limits[0], np.radians([-30, 30]), atol=1e-15)


def test_legs_are_named_by_where_they_stand():
    for count, names in (
        (5, ("right_1", "right_2", "rear", "left_1", "left_2")),
        (8, load_robot("octopod").leg_names),
        (10, tuple(f"{s}_{i}" for s in ("right", "left") for i in (1, 2, 3, 4, 5))),
    ):
        legs = []
        for i in range(count):
            azimuth = -2 * math.pi * (i + 0.5) / count
            p = 0.12 * np.array([math.cos(azimuth), math.sin(azimuth), 0])
            legs.append(replace(MK4.legs[0], name=f"n{i}", mount_position=p, mount_yaw=azimuth))
        robot = robot_of(tree_of(replace(MK4, legs=tuple(legs))))
        assert robot.leg_names == names


def without_feet():
    links = {n: k for n, k in TREE.links.items() if not n.endswith("_foot")}
    return replace(TREE, links=links, joints=tuple(j for j in TREE.joints if j.kind != "fixed"))


def test_a_foot_is_named_given_or_taken_from_the_mesh():
    tree = without_feet()
    assert refusal(tree).startswith("legs 1, 2, 3 and 3 more: its foot is not given; its last link")
    length = MK4.legs[0].tibia.length
    assert robot_of(tree, foot=f"{length},0,0").legs[0].tibia.length == pytest.approx(length)
    for name, link in tree.links.items():
        if name.endswith("tibia_link"):
            shape = block((0, -0.01, -0.01), (0.12, 0.01, 0.01))
            tree = with_link(tree, name, parts=(*link.parts, shape))
    imported = robot_from_tree(tree)
    # The middle of the block's end.
    assert imported.robot.legs[0].tibia.length == pytest.approx(0.12, rel=1e-12)
    assert any(
        text.startswith("legs 1, 2, 3 and 3 more: no foot in the file; the tip of the shape")
        for text in said(imported, Severity.SUSPECT)
    )


def test_foot_options_name_a_link_or_a_point_for_each_leg_or_are_refused():
    length = MK4.legs[0].tibia.length
    left = [name for name in TREE.links if "left" in name and name.endswith("tibia_link")]
    tree = reframed(without_feet(), dict.fromkeys(left, pose(turn([0, 0, 1], math.pi))))
    made = robot_of(tree, foot=f"1-3={length},0,0; 4-6=-{length},0,0")
    assert not differences(robot_of(TREE), made)
    assert not differences(robot_of(TREE), robot_of(TREE, foot="_foot"))
    for option, what in (
        ("1-9=_foot", 'robot: there is no leg "1-9"; legs are 1 to 6.'),
        ("1=", 'robot: foot is "1="; it must be numbers of legs, =, and a link\'s name or three'),
        ("hand", 'leg 1: no links at its end have a name that ends in "hand"; 1 is needed.'),
        ("0,0,x", "legs 1, 2, 3 and 3 more: foot is 0,0,x; it must be a link's name or three"),
    ):
        assert refusal(TREE, foot=option).startswith(what)


def test_masses_may_come_from_a_scale_and_from_boxes():
    bare = {name: replace(link, inertial=None) for name, link in TREE.links.items()}
    shared = robot_of(replace(TREE, links=bare), masses="geometry", total_mass=2.0)
    assert shared.mass == pytest.approx(2.0, rel=1e-14)
    heavy = robot_of(TREE, total_mass=2 * MK4.mass)
    np.testing.assert_allclose(heavy.arrays.inertia, 2 * MK4.arrays.inertia, rtol=1e-12, atol=1e-18)
    box = robot_of(TREE, masses="geometry")
    np.testing.assert_allclose(box.arrays.mass, MK4.arrays.mass, rtol=1e-14)
    tibia = box.legs[0].tibia
    a, b = tibia.length, tibia.length / 4
    inertia = np.diag([2 * b**2, a**2 + b**2, a**2 + b**2]) * tibia.mass / 12
    np.testing.assert_allclose(tibia.inertia, inertia)


def test_servos_come_from_a_name_or_from_the_file():
    assert robot_of(TREE, servo_model="AX-12A").servo == load_robot("phantomx-paper").servo
    bare = with_joints(TREE, lambda j: replace(j, stiffness=0.0, servo_damping=0.0))
    own = robot_of(with_joints(bare, lambda j: replace(j, effort=3.0, velocity=4.0))).servo
    assert (own.stall_torque, own.no_load_speed) == (3.0, 4.0)
    # By the rules for servos: the stall torque at an error of 0.1 rad.
    assert own.stiffness == pytest.approx(30.0)
    slow = robot_of(with_joints(TREE, lambda j: replace(j, effort=3.0, velocity=None))).servo
    assert slow.no_load_speed == load_servo("AX-12A").no_load_speed


def test_each_joint_is_judged_by_its_own_effort():
    # Knees of twice the torque, as geared knees of quadrupeds: one finding with both efforts. All
    # joints of the preset need at most 1.1 N m; hips of 0.6 N m are too weak, knees of 1.2 are not.
    def efforts(joint):
        ratio = 1.2 if "tibia" in joint.name else 0.6
        gains = {"stiffness": 5 * ratio, "servo_damping": ratio / 10}
        return replace(joint, effort=ratio, **gains)

    imported = robot_from_tree(with_joints(TREE, efforts), ImportOptions())
    differ = [text for text in said(imported, Severity.NOTE) if "the joints differ" in text]
    assert differ == ["servo: the joints differ: effort 0.6 to 1.2 N·m (each joint keeps its own)."]
    robot = imported.robot
    np.testing.assert_array_equal(robot.arrays.strength, [[1.0, 1.0, 2.0]] * 6)
    model = build_model(Scenario(robot=robot).replace(drive="ideal-servo"))
    largest = model.actuator_forcerange[:, 1].reshape(6, 3)
    np.testing.assert_allclose(largest, [[0.6, 0.6, 1.2]] * 6)
