"""The ground in the page's picture: its height, its friction, and the robot's shadow on it."""

import numpy as np
import pytest

from browsers import NEEDED, pixels, started
from phasmid import load_scenario
from phasmid.reporting.webpage.replay import surroundings
from studio.shown import shown

TERRAINS = ("flat", "stairs", "ice")

BELOW = -0.85
"""A lift of the robot by which it is out of the picture, and the camera not yet after it [m]."""

AHEAD = 0.6
"""Where the robot is, so that all of the ground's heights are in the picture [m]."""

HEIGHT = 0.12
"""Of the trunk over level ground, about [m]."""

DIM = 0.68
"""Of ground in shadow, over that in the light: 1 - 0.32 in the light scheme."""


def in_a_browser(test):
    """Mark a test that needs a browser."""
    for mark in NEEDED:
        test = mark(test)
    return test


@pytest.fixture(scope="module")
def browser():
    with started("--use-angle=swiftshader") as browser:
        yield browser


def pictures(browser, terrain, *lifts):
    """The page's picture of a standing robot, lifted by some metres; nothing but it is drawn."""
    found = []
    with shown(browser, terrain=terrain, middle=(AHEAD, 0.0)) as page:
        boxes = "document.querySelectorAll('#eyes input').forEach((box) => (box.checked = false))"
        page.window.evaluate(boxes)
        for k, lift in enumerate(lifts):
            page.show(time=0.01 * (k + 1), body_position=(AHEAD, 0.0, HEIGHT + lift))
            # The picture that stands still is drawn once more, with all its detail.
            page.window.wait_for_timeout(1500)
            found.append(pixels(page.window))
    return found


@in_a_browser
@pytest.mark.parametrize("terrain", ["flat", "stairs", "rough"])
def test_the_robot_casts_its_shadow_on_every_ground(browser, terrain):
    near, gone = pictures(browser, terrain, 0.15, BELOW)
    ratio = near / np.maximum(gone, 1.0)
    # Eight bits of 100 or more for each colour: 1 %; at the rim of the shadow more.
    share = np.mean(np.abs(ratio - DIM).max(axis=2) < 0.02)
    assert share > 0.003


@in_a_browser
def test_height_and_friction_are_seen_in_the_ground(browser):
    def cool(shown):
        return np.mean(shown[..., 2] - shown[..., 0] > 20)

    def warm(shown):
        return np.mean(shown[..., 0] - shown[..., 2] > 8)

    flat, stairs, ice = (pictures(browser, name, 0.0, BELOW)[1] for name in TERRAINS)
    assert max(cool(flat), warm(flat)) < 0.01
    # The lowest ground is cool, the highest warm; ice is cool, and all else as level ground.
    assert min(cool(stairs), warm(stairs)) > 0.05
    assert cool(ice) > 0.05
    assert warm(ice) < 0.01


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
