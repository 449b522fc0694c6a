"""Solids are closed, terrain has its heights, and the renderer draws where the camera says."""

import colorsys
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from phasmid import kinematics
from phasmid.kinematics import yaw_quaternion
from phasmid.reporting.camera import View, camera_axes, fitted_view
from phasmid.reporting.renderer import SceneRenderer, opengl_lack
from phasmid.reporting.robot_mesh import body_pose, mesh_pieces, robot_corners
from phasmid.reporting.style import leg_colour, rgb
from phasmid.reporting.terrain_mesh import DARK_SQUARE, floor_image, landscape
from phasmid.robot import load_robot
from phasmid.terrain import Blocks, Blocky, Course, Flat, Ground, Patch, Rough, Steps, Waves


def volume(corners):
    """Volume inside a closed surface, positive where corners run counter-clockwise outside."""
    return np.sum(corners[:, 0] * np.cross(corners[:, 1], corners[:, 2])) / 6


@pytest.mark.parametrize("name", ["phantomx-paper", "quadruped"])
def test_solids_of_a_robot_without_meshes_are_closed_and_look_outwards(name):
    robot = replace(load_robot(name), appearance=None)
    pieces = mesh_pieces(robot)
    assert {frame for _, frame in pieces.links} == {0, 1, 2, 3}
    # Legs that are alike share their meshes.
    assert len(pieces.meshes) < len(pieces.pieces)
    for vertices, faces in pieces.meshes:
        corners = vertices[faces]
        edges = corners[:, 1:] - corners[:, :1]
        areas = np.cross(edges[:, 0], edges[:, 1]) / 2
        # The areas of a closed surface add up to nothing.
        np.testing.assert_allclose(areas.sum(axis=0), 0, atol=1e-12 * np.abs(areas).sum() + 1e-15)
        assert volume(corners) > 0.2 * np.prod(np.ptp(vertices, axis=0))
    # Each link reaches from its joint to the next, with the same round end at both.
    for link, mesh, _ in pieces.pieces:
        if link >= 0 and pieces.links[link][1] < 3:
            leg, frame = pieces.links[link]
            x = pieces.meshes[mesh][0][:, 0]
            assert x.min() + x.max() == pytest.approx(robot.legs[leg].lengths[frame], abs=1e-9)


def test_a_camera_projects_by_the_intercept_theorem():
    # 1 m before the eye, focal times the offset; up is down in pixels.
    view = View(np.array([0.0, 0, 5]), np.eye(3), 800.0, (100, 80), 5.0)
    np.testing.assert_allclose(view.project(np.array([0.2, -0.1, 4.0])), [210.0, 120.0])
    np.testing.assert_allclose(view.project(np.array([0.2, -0.1, 3.0])), [130.0, 80.0])
    np.testing.assert_allclose(view.middle, 0.0)


GROUNDS = {
    "stairs": Ground(Steps.stairs(0.3, rise=0.02, run=0.1, count=3), 0.7, yaw=0.4),
    "blocks": Ground(Blocks(0.08, 0.006, 0.02, 0.1, 0.3), 0.7, yaw=-0.4),
    "course": Ground(Course.mixed(0.3, difficulty=0.05), 0.7, yaw=-0.4),
    "waves": Ground(Waves(0.03, 0.4, 0.3), 0.7),
    "rough": Ground(Rough(0.006, 0.15, 0.3), 0.7),
}


@pytest.mark.parametrize("name", GROUNDS)
def test_the_landscape_has_the_heights_of_the_ground(name):
    ground = GROUNDS[name]
    vertices, faces = landscape(ground, np.array([0.8, 0.1]), 0.8)
    corners = vertices[faces]
    edges = corners[:, 1:] - corners[:, :1]
    upward = np.cross(edges[:, 0], edges[:, 1])[:, 2] / 2
    if isinstance(ground.shape, Blocky):
        assert volume(corners) > 0
    else:
        assert (upward > 0).all()
    tops = corners[upward > 1e-9]
    # Curved ground has its heights at the corners, blocks all over their tops.
    points = tops.mean(axis=1) if isinstance(ground.shape, Blocky) else tops.reshape(-1, 3)
    # Blocks stand on a plate, 0.1 m lower.
    points = points[points[:, 2] > -0.09]
    np.testing.assert_allclose(points[:, 2], ground.height(points[:, 0], points[:, 1]), atol=1e-9)
    # It covers at least the square around the place.
    assert upward[upward > 0].sum() > 0.95 * 1.6**2


def test_the_floor_is_in_squares_and_ice_is_blue():
    image = floor_image(np.zeros(2), 0.2, 64, 0.1, Ground(Flat(), 0.8)).astype(float)
    np.testing.assert_allclose(image[-10, 42], DARK_SQUARE * image[-10, 10], atol=1)
    np.testing.assert_array_equal(image[10, 42], image[-10, 10])
    ice = Ground(Flat(), 0.8, (Patch((0.5, 1.5), (-1.0, 1.0), 0.0),))
    image = floor_image(np.array([-2.0, -2.0]), 4.0, 512, 0.1, ice).astype(float)
    rows, columns = (256 - 128 * np.array([0.05, 0.05])), (256 + 128 * np.array([1.05, -0.55]))
    on, off = image[rows.astype(int), columns.astype(int)]
    assert np.ptp(on) > 30 > 10 > np.ptp(off)


@pytest.fixture(scope="module")
def standing():
    """Robot, pose, joint angles and a camera; the test is skipped without OpenGL."""
    lack = opengl_lack()
    if lack is not None:
        pytest.skip(lack.sentence)
    robot = load_robot("phantomx-paper")
    q = kinematics.joint_angles(robot.arrays, robot.arrays.neutral_foot)
    height = -float(robot.arrays.neutral_foot[0, 2])
    pose = body_pose(np.array([0.3, -0.2, height]), yaw_quaternion(np.zeros(1))[0])
    corners = robot_corners(robot, q, pose)
    view = fitted_view(corners, camera_axes(-1.0, 0.5), (480, 320), (0.7, 0.7))
    return robot, pose, q, view


def picture_on(ground, standing, shift=0.0):
    robot, pose, q, view = standing
    moved = pose + np.array([[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, shift], [0, 0, 0, 0]])
    with closing(SceneRenderer(robot, ground, pose[None, :2, 3], view, 0.1)) as renderer:
        return renderer.picture(view, moved, q).astype(float)


def test_the_robot_is_drawn_where_the_camera_says_in_its_legs_colours(standing):
    robot, pose, q, view = standing
    ground = Ground(Flat(), 0.8)
    seen, bare = picture_on(ground, standing), picture_on(ground, standing, shift=90.0)
    assert seen.shape == (320, 480, 3)
    # Shadows on the bright ground are less dark than the robot.
    differs = np.abs(seen - bare).max(axis=-1)
    rows, _ = np.nonzero(differs > 40)
    _, columns = np.nonzero(differs > 130)
    points = view.project(robot_corners(robot, q, pose))
    assert abs(rows.min() - points[:, 1].min()) <= 2
    assert columns.min() >= points[:, 0].min() - 2
    assert columns.max() <= points[:, 0].max() + 2
    found = 0
    for number, leg in enumerate(robot.legs):
        frames = pose @ leg.X_body_hip @ kinematics.leg_frames(leg, q[number])
        x, y = view.project((frames[2] + frames[3])[:3, 3] / 2).astype(int)
        patch = seen[max(y - 30, 0) : y + 30, max(x - 20, 0) : x + 20].reshape(-1, 3)
        hues = [colorsys.rgb_to_hsv(*one / 255)[0] for one in patch[np.ptp(patch, axis=1) > 60]]
        off = np.abs(np.array(hues) - colorsys.rgb_to_hsv(*rgb(leg_colour(number)))[0])
        found += (np.minimum(off, 1 - off) < 0.03).sum() > 10
    # One leg in six may stand behind the trunk.
    assert found >= 5


@pytest.mark.parametrize("name", ["stairs", "waves"])
def test_uneven_ground_is_drawn(standing, name):
    level, uneven = picture_on(Ground(Flat(), 0.8), standing), picture_on(GROUNDS[name], standing)
    assert np.abs(level - uneven).mean() > 2


def test_the_robot_stands_on_its_feet_and_is_as_wide_as_it_is():
    robot = load_robot("phantomx-paper")
    q = kinematics.joint_angles(robot.arrays, robot.arrays.neutral_foot)
    pose = body_pose(np.array([1.0, 2.0, 0.1]), yaw_quaternion(np.zeros(1))[0])
    corners = robot_corners(robot, q, pose)
    feet = kinematics.neutral_feet(robot) + np.array([1.0, 2.0, 0.1])
    low, high = corners.min(axis=0), corners.max(axis=0)
    # Beside the way from knee to foot the tip is 6.1 mm wide and the blade 18.9 mm, half of its
    # width each side, as its mesh is drawn.
    assert low[2] == pytest.approx(0.0, abs=0.0061)
    np.testing.assert_allclose(low[:2], feet[:, :2].min(axis=0), atol=0.0189)
    np.testing.assert_allclose(high[:2], feet[:, :2].max(axis=0), atol=0.0189)
