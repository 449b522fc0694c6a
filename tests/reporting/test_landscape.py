"""The ground of a picture is the ground that was walked on."""

import numpy as np
import pytest

from phasmid.reporting.camera import View, rasterise
from phasmid.reporting.drawing import walk_picture
from phasmid.reporting.ground import ground
from phasmid.reporting.landscape import CELL, landscape
from phasmid.reporting.light import ShadowMap
from phasmid.reporting.picture import picture
from phasmid.reporting.shapes import Mesh, box
from phasmid.scenario import load_scenario
from phasmid.terrain import Blocks, Blocky, Flat, Ground, Patch, Rough, Steps, Waves

GROUNDS = {
    "stairs": Ground(Steps.stairs(0.3, rise=0.02, run=0.1, count=3), 0.7, yaw=0.4),
    "blocks": Ground(Blocks(0.08, 0.006, 0.02, 0.1, 0.3), 0.7, yaw=-0.4),
    "waves": Ground(Waves(0.03, 0.4, 0.3), 0.7),
    "rough": Ground(Rough(0.006, 0.15, 0.3), 0.7),
}
ABOVE = View(np.array([0.8, 0.1, 20.0]), np.eye(3), 4000.0, (200, 200), (100.0, 100.0))


@pytest.mark.parametrize("name", GROUNDS)
def test_seen_from_above_the_landscape_has_the_heights_of_the_ground(name):
    # A picture from straight above: height = eye - 1/nearness. Triangles of side c miss a curved
    # ground by up to κ (c√2)²/8, with curvatures κ below 10/m, 0.6 mm; a ray leans by 0.5 m in 20 m
    # and meets ground of 60 mm height 1.5 mm further in, which a slope of 0.5 makes 0.8 mm. A pixel
    # of 5 mm whose middle is near an edge may see the other side: left out.
    terrain = GROUNDS[name]
    mesh = landscape(terrain, np.array([0.8, 0.1]), 0.8)
    _, near = rasterise(ABOVE.project(mesh.corners), 200, 200)
    x = 0.8 + (np.arange(200) - 99.5) / 4000 * 20
    x, y = np.meshgrid(x, 0.1 - (np.arange(200) - 99.5) / 4000 * 20)
    expected = terrain.height(x, y)
    at_edge = np.zeros(x.shape, dtype=bool)
    for dx in (-0.006, 0.006):
        for dy in (-0.006, 0.006):
            other = terrain.height(x + dx, y + dy)
            at_edge |= isinstance(terrain.shape, Blocky) & (other != expected)
    seen = (near > 0) & ~at_edge
    assert seen.mean() > 0.5
    assert np.abs(20 - 1 / near[seen] - expected[seen]).max() < 10 * 2 * CELL**2 / 8 + 1e-3


def looking(terrain):
    """A view from the side of a box that stands at the origin, and the ground that it sees."""
    back = np.array([0.0, -np.cos(0.5), np.sin(0.5)])
    axes = np.stack([[1.0, 0, 0], np.cross(back, [1.0, 0, 0]), back])
    view = View(2 * back, axes, 400.0, (160, 120), (80.0, 60.0))
    solid = box((0, 0, 0.1), (0.3, 0.3, 0.1), "#204080")
    return solid, view, ground(view, ShadowMap(solid), solid, terrain)


def test_level_ground_made_of_triangles_is_seen_where_the_level_is():
    # A step without height is level; both ways to find a pixel's place give the same colours but
    # for edges of the fading.
    flat, step = (looking(Ground(shape, 0.7))[2][0] for shape in (Flat(), Steps((0.1,), (0.0,))))
    assert np.abs(flat - step).max() < 0.02


def test_high_ground_is_warm_and_low_ground_cool():
    # A step of 20 mm across the middle of the picture, away from the box and its shadow.
    image = looking(Ground(Steps((0.0,), (0.02,)), 0.7))[2][0]
    low, high = image[95:100, 40:60].mean(axis=(0, 1)), image[95:100, 100:120].mean(axis=(0, 1))
    assert low[2] - low[0] > 0.02
    assert high[0] - high[2] > 0.01


def test_slippery_ground_has_another_colour():
    # Two fields in the box's front that differ in friction alone.
    patches = (Patch((-1, 0), (-1, 1), 0.1),)
    image = looking(Ground(Flat(), 0.7, patches))[2][0]
    left, right = image[95:100, 40:60].mean(axis=(0, 1)), image[95:100, 100:120].mean(axis=(0, 1))
    # Ice is bluer: its red falls below its blue, here far out where the ground fades.
    assert left[2] - left[0] > right[2] - right[0] + 0.01


def test_a_step_hides_what_stands_behind_it():
    # A wall of 0.5 m between camera and box; without it the box is seen.
    hidden = []
    for rise in (0.0, -0.5):
        # Seen from -y: the terrain is turned so that it falls from a plateau towards the box.
        terrain = Ground(Steps((0.25,), (rise,)), 0.7, yaw=np.pi / 2)
        solid, view, _ = looking(terrain)
        lowered = Mesh(solid.corners + np.array([0.0, 0.45, rise]), solid.colours)
        image = picture(lowered, Mesh(np.zeros((0, 3, 3)), np.zeros((0, 3))), view, terrain)
        assert image.min() >= 0
        assert image.max() <= 1
        hidden.append((image.mean(axis=-1) < 0.4).sum())
    assert hidden[0] > 200
    assert hidden[1] < hidden[0] / 4


@pytest.mark.parametrize("kind", ["stairs", "rough", "ice"])
def test_a_walk_is_drawn_on_its_terrain(walk, monkeypatch, kind):
    monkeypatch.setattr("phasmid.reporting.drawing.DPI", 40)
    scenario = load_scenario("paper").replace(terrain=kind)
    figure = walk_picture(walk(scenario=scenario, duration=2.0))
    texts = " ".join(text.get_text() for text in figure.axes[0].texts)
    assert f"terrain: {kind}" in texts
