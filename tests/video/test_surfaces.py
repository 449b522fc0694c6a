"""Solids are round where they are round, and the ground is in squares."""

import numpy as np

from phasmid.reporting.machine import FRAME
from phasmid.reporting.shapes import beam, cylinder
from phasmid.reporting.style import LEG_COLOURS
from phasmid.scenario import load_scenario
from phasmid.terrain import Flat, Ground, Patch
from phasmid.video.floor import DARK_SQUARE, SQUARE, floor, square_side
from phasmid.video.solid import surface


def test_a_box_keeps_its_edges():
    box = beam([(0.0, 0.1, 0.1), (0.2, 0.1, 0.1)], FRAME, chamfer=1e-9)
    found = surface(box.corners)
    assert found is not None
    a, b, c = found.vertices[found.faces].transpose(1, 0, 2)
    facing = np.cross(b - a, c - a)
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    # Each corner of a face looks where the face does: four corners for each of six faces, and the
    # hubs of the ends.
    for corner in range(3):
        np.testing.assert_allclose(found.normals[found.faces[:, corner]], facing, atol=1e-6)


def test_a_cylinder_is_round():
    up = np.array([0.0, 0.0, 1.0])
    found = surface(cylinder(0 * up, up, (0.5, 0.5), LEG_COLOURS[0], sides=48).corners)
    assert found is not None
    side = np.abs(found.normals[:, 2]) < 0.5
    assert side.any()
    outward = found.vertices[side, :2] / 0.5
    # A side of 48 is turned by 7.5° from the next; a corner's direction lies between the two.
    inward = np.sum(found.normals[side, :2] * outward, axis=1)
    assert inward.min() > np.cos(np.radians(4.0))
    # Its ends are flat; between them and the side is a bevel of 45°, an edge on either side.
    ends = np.abs(found.normals[~side][:, 2])
    flat = ends > 0.9
    np.testing.assert_allclose(ends[flat], 1.0, atol=1e-9)
    np.testing.assert_allclose(ends[~flat], np.sqrt(0.5), atol=1e-3)


def test_triangles_without_an_area_are_no_surface():
    assert surface(np.zeros((4, 3, 3))) is None


def test_a_cycle_passes_whole_squares():
    paper = load_scenario("paper")
    assert square_side(paper) == 0.08  # two steps of 40 mm
    wide = paper.replace(stride=paper.stride.model_copy(update={"step_length": 0.12}))
    assert square_side(wide) == 0.12
    turning = paper.replace(stride=paper.stride.model_copy(update={"step_length": 0.0}))
    assert square_side(turning) == SQUARE


def test_level_ground_is_one_tile_of_two_by_two_squares():
    told = floor(Ground(Flat(), 0.8), np.zeros((3, 2)), 0.1)
    assert "floor_vertices" not in told
    assert float(told["floor_side"]) == 0.2
    image = told["floor_image"].astype(float)
    half = len(image) // 2
    low, high = image[-10, 10], image[-10, half + 10]
    np.testing.assert_allclose(high, DARK_SQUARE * low, atol=1)
    np.testing.assert_array_equal(image[10, half + 10], low)


def test_slippery_ground_is_painted_where_it_lies():
    ice = Ground(Flat(), 0.8, (Patch((0.5, 1.5), (-1.0, 1.0), 0.0),))
    told = floor(ice, np.array([[0.0, 0.0], [1.0, 0.0]]), 0.1)
    image, vertices = told["floor_image"].astype(float), told["floor_vertices"]
    low, high = vertices[:, 0].min(), vertices[:, 0].max()

    def colour(x: float, y: float) -> np.ndarray:
        row = (1 - (y - vertices[:, 1].min()) / np.ptp(vertices[:, 1])) * len(image)
        return image[int(row), int((x - low) / (high - low) * image.shape[1])]

    # Ice is blue: there is clearly more blue in it than red.
    assert np.ptp(colour(1.05, 0.05)) > 30 > 10 > np.ptp(colour(-0.55, 0.05))


def test_places_on_the_painted_ground_are_those_of_the_world():
    told = floor(
        load_scenario("paper").replace(terrain={"kind": "waves"}).load_terrain(),
        np.zeros((1, 2)),
        0.1,
    )
    places, vertices = told["floor_places"], told["floor_vertices"]
    np.testing.assert_allclose(np.ptp(places, axis=0), 1.0, atol=0.03)
    np.testing.assert_allclose(np.corrcoef(places[:, 0], vertices[:, 0])[0, 1], 1.0, atol=1e-9)
    assert told["floor_normals"][:, 2].min() > 0.5
