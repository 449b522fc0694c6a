"""Solids are closed, the camera is a pinhole, and what is covered lies in shadow."""

import numpy as np
import pytest

from phasmid.kinematics import yaw_quaternion
from phasmid.reporting.camera import View, rasterise
from phasmid.reporting.light import LIGHT, ShadowMap
from phasmid.reporting.machine import body_pose, robot_mesh
from phasmid.reporting.shapes import ball, beam, box, cylinder, slab
from phasmid.robot import load_robot

AXES = np.eye(3)
SOLIDS = {
    "box": (box((0, 0, 0), (0.2, 0.1, 0.05), "#808080"), 0.2 * 0.1 * 0.05),
    "beam": (beam([(0, 0.1, 0.1), (0.5, 0.1, 0.1)], "#808080", chamfer=0.0), 0.5 * 0.04),
    "cylinder": (cylinder(0 * AXES[0], AXES[0], (0.1, 0.1), "#808080"), np.pi * 0.01),
    "cone": (cylinder(0 * AXES[0], AXES[1], (0.1, 0.0), "#808080"), np.pi * 0.01 / 3),
    "ball": (ball(AXES[2], 0.1, "#808080"), 4 / 3 * np.pi * 1e-3),
    "slab": (
        slab(np.array([[0.0, 0], [0.2, 0], [0.2, 0.1], [0, 0.1]]), 1e-4, 0.0, 0.01, "#808080"),
        0.2 * 0.1 * 0.01,
    ),
}


def volume(corners):
    """Volume inside a closed surface, positive where corners run counter-clockwise outside."""
    return np.sum(corners[:, 0] * np.cross(corners[:, 1], corners[:, 2])) / 6


@pytest.mark.parametrize("name", SOLIDS)
def test_solids_are_closed_and_look_outwards(name):
    mesh, expected = SOLIDS[name]
    edges = mesh.corners[:, 1:] - mesh.corners[:, :1]
    areas = np.cross(edges[:, 0], edges[:, 1]) / 2
    # The areas of a closed surface add up to nothing.
    np.testing.assert_allclose(areas.sum(axis=0), 0, atol=1e-12 * np.abs(areas).sum() + 1e-15)
    # Bevels, facets and cut corners take up to 15 %.
    assert 0.85 * expected < volume(mesh.corners) < 1.02 * expected


def test_nearness_makes_the_front_triangle_win():
    square = np.array([[[0.0, 0, 1], [20, 0, 1], [0, 20, 1]], [[0, 0, 2], [4, 0, 2], [0, 4, 2]]])
    index, near = rasterise(square, 10, 10)
    assert index[0, 0] == 1
    assert index[8, 8] == 0
    assert near[0, 0] == pytest.approx(2)
    # Pixel centres with x + y < 4 lie inside the small one: 10 of them, 4 on its edge or without.
    assert 6 <= (index == 1).sum() <= 10


def test_each_pixel_sees_the_nearest_of_all_triangles_about_its_middle():
    rng = np.random.default_rng(5)
    # Large ones, small ones, slivers, and some that leave the picture on every side.
    corners = rng.uniform(-10, 50, (300, 1, 3)) + rng.uniform(-1, 1, (300, 3, 3)) * np.repeat(
        [20.0, 2.0, 0.4], 100
    ).reshape(300, 1, 1)
    index, near = rasterise(corners, 40, 30)
    x, y = np.meshgrid(np.arange(40) + 0.5, np.arange(30) + 0.5)
    a, b, c = (corner[..., None, None] for corner in np.moveaxis(corners, 1, 0))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    to_b = ((x - a[:, 0]) * (c[:, 1] - a[:, 1]) - (y - a[:, 1]) * (c[:, 0] - a[:, 0])) / area
    to_c = ((b[:, 0] - a[:, 0]) * (y - a[:, 1]) - (b[:, 1] - a[:, 1]) * (x - a[:, 0])) / area
    inside = (to_b >= 0) & (to_c >= 0) & (to_b + to_c <= 1)
    depth = a[:, 2] + to_b * (b[:, 2] - a[:, 2]) + to_c * (c[:, 2] - a[:, 2])
    depth = np.where(inside, depth, -np.inf)
    np.testing.assert_array_equal(index, np.where(inside.any(axis=0), depth.argmax(axis=0), -1))
    # Round-off of numbers of some tens, larger by what divides by the area of a sliver.
    np.testing.assert_allclose(near, depth.max(axis=0), rtol=0, atol=1e-9)


def test_a_camera_sees_what_its_rays_hit():
    view = View(np.array([0.0, 0, 5]), np.eye(3), 800.0, (100, 80), (50.0, 40.0))
    point = np.array([0.2, -0.1, 1.0])
    across, down, near = view.project(point)
    assert near == pytest.approx(1 / 4)
    ray = view.rays(np.array(across), np.array(down))
    np.testing.assert_allclose(view.eye + ray / near, point, atol=1e-12)


def test_the_ground_behind_a_box_lies_in_its_shadow():
    lamp = ShadowMap(box((0, 0, 0.1), (0.1, 0.1, 0.1), "#808080"))
    shadow = -LIGHT * 0.1 / LIGHT[2] + [0.0, 0.0, 0.1]
    points = np.stack([shadow, -shadow * [1, 1, 0], [10.0, 10.0, 0.0]])
    lit = lamp.light(points, blur=0.001, bias=0.001, taps=8)
    np.testing.assert_array_equal(lit, [0.0, 1.0, 1.0])


def test_the_rim_of_a_shadow_is_soft_over_twice_its_blur():
    # A box of 0.1 m on the ground: the rim of its upper face throws a shadow beside it.
    lamp = ShadowMap(box((0, 0, 0.05), (0.1, 0.1, 0.1), "#808080"))
    across = np.linspace(-0.05, 0.05, 2001)
    edge = np.array([0.05, 0.0, 0.1]) - LIGHT * 0.1 / LIGHT[2]
    lit = lamp.light(edge + np.outer(across, [1.0, 0, 0]), blur=0.010, bias=0.0005, taps=64)
    assert lit[0] == 0.0
    assert lit[-1] == 1.0
    # The edge runs along y. Seen along the light, a step along x leads away from it by the area of
    # the square of both over the length of its side along y.
    away = LIGHT[2] / np.sqrt(1 - LIGHT[1] ** 2)
    soft = across[(lit > 0) & (lit < 1)]
    # Of 64 samples in a circle the outermost reach at least 0.87 of its radius in every direction;
    # the map has six pixels in a millimetre.
    assert 2 * 0.87 * 0.010 - 0.0003 < np.ptp(soft) * away < 2 * 0.010 + 0.0003


def test_the_robot_stands_on_its_feet_and_is_as_wide_as_it_is():
    robot = load_robot("phantomx-paper")
    from phasmid import kinematics

    q = kinematics.joint_angles(robot.arrays, robot.arrays.neutral_foot)
    pose = body_pose(np.array([1.0, 2.0, 0.1]), yaw_quaternion(np.zeros(1))[0])
    mesh = robot_mesh(robot, q, pose)
    feet = kinematics.neutral_feet(robot) + np.array([1.0, 2.0, 0.1])
    low, high = mesh.corners.min(axis=(0, 1)), mesh.corners.max(axis=(0, 1))
    # Beside the way from knee to foot the tip is 6.1 mm wide and the blade 18.9 mm, half of its
    # width each side, as its mesh is drawn.
    assert low[2] == pytest.approx(0.0, abs=0.0061)
    np.testing.assert_allclose(low[:2], feet[:, :2].min(axis=0), atol=0.0189)
    np.testing.assert_allclose(high[:2], feet[:, :2].max(axis=0), atol=0.0189)
    assert mesh.corners.shape[0] == mesh.colours.shape[0]
