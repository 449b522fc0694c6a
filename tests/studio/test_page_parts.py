"""Plots, sliders and the room of the page, in a browser that is shown chosen frames."""

import pytest

from browsers import NEEDED, started
from studio.shown import shown

pytestmark = NEEDED


@pytest.fixture(scope="module")
def browser():
    with started("--disable-gpu") as browser:
        yield browser


@pytest.fixture(scope="module")
def page(browser):
    with shown(browser, size=(1400, 900)) as page:
        yield page


def read(page, plot, x):
    """The values that a plot tells of a place in it."""
    canvas = page.window.locator("#plots figure").nth(plot).locator("canvas")
    canvas.hover(position={"x": x, "y": 30}, force=True)
    page.window.wait_for_timeout(100)
    return [text.strip() for text in page.window.locator(".reading p").all_text_contents()]


def test_plots_tell_values_are_held_and_go_back(page):
    # Forty seconds, the tilt as their number.
    for k in range(1, 401):
        if k > 380 or k % 20 == 0:
            page.show(time=0.1 * k, tilt=0.001 * k)
    window = page.window
    width = window.evaluate("document.querySelector('#plots canvas').clientWidth")
    time, tilt = read(page, 3, width - 6)
    assert float(time.removesuffix(" s")) == pytest.approx(40.0, abs=0.15)
    # Three digits of 0.4 rad in degrees.
    assert float(tilt.removesuffix(" °")) == pytest.approx(22.9, abs=0.2)
    forces = read(page, 0, width - 6)
    assert len(forces) == 1 + 6
    assert all(force.endswith(" N") for force in forces[1:])
    # Where they are held, new frames move nothing; ten seconds earlier is ten seconds to the left.
    window.get_by_role("button", name="Hold plots").click()
    page.show(time=41.0, tilt=0.5)
    window.wait_for_timeout(200)
    assert float(read(page, 3, width - 6)[0].removesuffix(" s")) == pytest.approx(40.0, abs=0.15)
    window.locator("#since").fill("20")
    assert float(read(page, 3, width - 6)[0].removesuffix(" s")) == pytest.approx(20.0, abs=0.15)
    window.get_by_role("button", name="Go on").click()
    assert float(read(page, 3, width - 6)[0].removesuffix(" s")) == pytest.approx(41.0, abs=0.15)
    # With another tab what was read goes.
    window.get_by_role("tab", name="Events").click()
    window.wait_for_timeout(200)
    assert not window.locator(".reading").is_visible()
    window.get_by_role("tab", name="Plots").click()
    # What lines mean stands in legends, and titles are titles.
    captions = window.locator("#plots figcaption").all_inner_texts()
    assert "commanded" in captions[5]
    assert window.locator("#plots figcaption > span:first-child").all_inner_texts() == [
        "Normal forces",
        "Torques",
        "Gait",
        "Body tilt",
        "Support margin",
        "Speed",
    ]
