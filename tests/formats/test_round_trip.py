"""A robot that is written as URDF or MJCF and read again has the same numbers."""

from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from formats.trees import ROBOTS, files_of, write
from phasmid.formats import load_robot, robot_from_tree, save_robot, tree_of
from phasmid.formats.mjcf_in import read_mjcf
from phasmid.formats.urdf_in import read_urdf
from phasmid.gait import gaits_of
from phasmid.kinematics import foot_position
from phasmid.motion import longest_stride
from phasmid.robot import Appearance, Part, preset_names

ROUND_OFF = 1e-12
"""A dozen products and sums of numbers up to 4, each rounded to 2e-16 of its size."""


def differences(a, b, path=""):
    """Fields of two robots that differ by more than round-off, by name."""
    found = []
    for field in fields(a):
        x, y, name = getattr(a, field.name), getattr(b, field.name), f"{path}{field.name}"
        if isinstance(x, Appearance):
            continue
        if isinstance(x, tuple) and is_dataclass(x[0]):
            for i, (one, other) in enumerate(zip(x, y, strict=True)):
                found += differences(one, other, f"{name}[{i}].")
        elif is_dataclass(x):
            found += differences(x, y, f"{name}.")
        elif isinstance(x, str | dict) or x is None or y is None:
            found += [name] * (x != y)
        elif not np.allclose(x, y, rtol=0, atol=ROUND_OFF):
            found.append(name)
    return found


def sheet(color, name):
    """An open mesh of two triangles that do not lie in one plane."""
    corners = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0.1, 0.1, 0.03]])
    return Part(corners, np.array([[0, 1, 2], [1, 3, 2]]), color, name)


LOOK = {
    "body": (sheet((1.0, 0.5, 0.25, 1.0), "lid"), sheet((0.1, 0.2, 0.3, 0.4), "lid")),
    "tibia": (sheet((0.0, 0.0, 1.0, 1.0), "shin"),),
}


@pytest.mark.parametrize("suffix", [".urdf", ".xml"])
@pytest.mark.parametrize("name", ROBOTS)
def test_every_number_of_a_tree_survives_the_file(name, suffix, tmp_path):
    robot = replace(ROBOTS[name], appearance=Appearance.of(LOOK))
    ours = tree_of(robot)
    read = read_urdf if suffix == ".urdf" else read_mjcf
    theirs = read(write(files_of(robot, suffix), tmp_path))
    assert (theirs.name, list(theirs.links)) == (robot.name, list(ours.links))
    assert [finding.subject for finding in theirs.findings] == ["key home"] * (suffix == ".xml")
    # Rotations pass through angles or quaternions: some roundings of entries of order one.
    turned = {"rtol": 0, "atol": 3e-15}
    # MJCF turns centres of mass and inertias with their frames.
    kept = {"rtol": 0, "atol": 0 if suffix == ".urdf" else 2e-15}
    for link in ours.links.values():
        other = theirs.links[link.name]
        assert (link.inertial is None) == (other.inertial is None)
        if link.inertial:
            assert other.inertial.mass == link.inertial.mass
            np.testing.assert_allclose(other.inertial.com, link.inertial.com, **kept)
            # URDF writes six of the nine numbers.
            mine, their = np.triu(link.inertial.inertia), np.triu(other.inertial.inertia)
            np.testing.assert_allclose(their, mine, **kept)
        for mine, their in zip(link.parts, other.parts, strict=True):
            assert (mine.name, mine.color) == (their.name, their.color)
            # Single precision, of corners and of the engine's frame about their middle.
            a, b = mine.vertices[mine.faces], their.vertices[their.faces]
            np.testing.assert_allclose(b, a, rtol=0, atol=1e-7)
    same = ["name", "kind", "parent", "child"]
    numbers = ["lower", "upper", "effort", "velocity", "damping", "friction", "armature", "home"]
    numbers += ["stiffness", "servo_damping"] * (suffix == ".xml")
    for joint, other in zip(ours.joints, theirs.joints, strict=True):
        for field in same if joint.kind == "fixed" else same + numbers:
            assert getattr(joint, field) == getattr(other, field), field
        np.testing.assert_allclose(other.X_parent_child, joint.X_parent_child, **turned)
        np.testing.assert_array_equal(other.axis, joint.axis)


LOST = ("description", "body.size", "body.box_centre", "femur_bend", "tibia_bend", "servo.")
"""What these formats have no words for: zeros of the servos, their laws, and a bare trunk's box."""


@pytest.mark.parametrize("name", preset_names())
def test_a_preset_that_was_written_as_mjcf_is_the_same_robot(name, tmp_path):
    """With its stance and gains, and the names of its legs."""
    robot = load_robot(name)
    save_robot(robot, tmp_path / "robot.xml")
    again = load_robot(tmp_path / "robot.xml")
    differ = differences(robot, again)
    assert not [field for field in differ if not any(lost in field for lost in LOST)]
    for field in ("stall_torque", "no_load_speed", "stiffness", "damping", "friction", "armature"):
        assert getattr(again.servo, field) == pytest.approx(getattr(robot.servo, field), rel=1e-12)
    gait = next(iter(gaits_of(len(robot.legs)).values()))
    # Limits that round-off has moved by 1e-15 rad move a stride of 0.2 m by as little.
    assert longest_stride(again, gait) == pytest.approx(longest_stride(robot, gait), abs=1e-7)


@pytest.mark.parametrize("suffix", [".urdf", ".xml", ".toml"])
def test_joints_keep_their_own_numbers(suffix, tmp_path):
    """Torque, speed, armature and friction of each; a second trip is as the first."""
    robot = replace(ROBOTS["own joints"], appearance=None)
    trips = []
    for number in (1, 2):
        path = tmp_path / f"robot_{number}{suffix}"
        save_robot(robot if number == 1 else trips[0], path)
        trips.append(load_robot(path))
    for name in ("stall_torque", "no_load_speed", "armature", "friction"):
        ours = getattr(robot.arrays, name)
        assert np.unique(ours).size == ours.size
        for again in trips:
            # A division by the servo's number and a product with it.
            np.testing.assert_allclose(getattr(again.arrays, name), ours, rtol=1e-15, err_msg=name)
    if suffix == ".toml":
        assert not differences(robot, trips[0])


@pytest.mark.parametrize("name", ROBOTS)
def test_any_robot_s_feet_move_as_before(name):
    """p_body_foot at random angles φ of the file: FK(q) = FK'(signs φ + offsets) + shift."""
    robot = ROBOTS[name]
    shift = robot.arrays.p_body_hip.mean(axis=0)
    q = np.random.default_rng(3).uniform(-1, 1, (5, 3))
    for leg in robot_from_tree(tree_of(robot)).legs:
        own = robot.leg(leg.joints[0].removesuffix("_coxa"))
        R = Rotation.from_euler("ZYX", leg.angles).as_matrix()
        theirs = foot_position(
            replace(own, coxa=_link(own.coxa, leg, 0), femur=_link(own.femur, leg, 1),
                    tibia=_link(own.tibia, leg, 2)),
            leg.signs * q + leg.offsets,
        ) @ R.T + leg.position  # fmt: skip
        ours = foot_position(own, q) @ own.X_body_hip[:3, :3].T + own.mount_position
        np.testing.assert_allclose(theirs + shift, ours, rtol=0, atol=ROUND_OFF)


def _link(link, leg, i):
    left = float(leg.lateral_offsets[i])
    return replace(link, length=float(leg.lengths[i]), lateral_offset=left)
