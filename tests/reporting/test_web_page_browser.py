"""The page in a real browser, opened from disk with the network cut off."""

from contextlib import contextmanager

import numpy as np
import pytest

from phasmid.reporting import report
from support.browsers import NEEDED, is_ours, pixels, started, until
from support.hostile import LEG_NAMES, NAME, UNSEEN, hostile_walk

pytestmark = NEEDED


@pytest.fixture(scope="module")
def page(walk, tmp_path_factory):
    """A page on disk, of a walk of four seconds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("phasmid.reporting.drawing.DPI", 60)
        folder = report(walk(duration=4.0, interval=0.01), tmp_path_factory.mktemp("run") / "walk")
    return folder / "report.html"


@pytest.fixture(scope="module")
def browser():
    with started("--use-angle=swiftshader") as browser:
        yield browser


@pytest.fixture(scope="module")
def hostile_page(walk, tmp_path_factory):
    """A page on disk, of a robot and a scenario whose names would run if they could."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("phasmid.reporting.drawing.DPI", 60)
        recording = hostile_walk(walk(duration=4.0, interval=0.02))
        folder = report(recording, tmp_path_factory.mktemp("hostile") / "walk")
    return folder / "report.html"


@contextmanager
def opened(browser, page, *, width=1400, scheme="light", scripts=True):
    """The page in a window, and what went wrong in it."""
    context = browser.new_context(
        viewport={"width": width, "height": 900},
        offline=True,
        color_scheme=scheme,
        java_script_enabled=scripts,
    )
    window = context.new_page()
    wrong = []
    window.on(
        "console",
        lambda message: is_ours(message) and wrong.append(f"{message.type}: {message.text}"),
    )
    window.on("pageerror", lambda error: wrong.append(f"error: {error}"))
    window.on("requestfailed", lambda request: wrong.append(f"failed: {request.url[:80]}"))
    window.on("dialog", lambda dialog: (wrong.append(f"says: {dialog.message}"), dialog.dismiss()))
    window.on("request", lambda request: asked(request.url, page, wrong))
    window.goto(page.as_uri())
    yield window, wrong
    context.close()


def asked(url, page, wrong):
    """Note what is asked of anywhere but the page itself."""
    if not url.startswith(("data:", "blob:")) and url.partition("#")[0] != page.as_uri():
        wrong.append(f"asks: {url[:80]}")


def clock(window):
    return float(window.locator("#clock").text_content().split()[0])


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [400, 1400])
def test_the_page_opens_without_a_network_or_a_complaint(browser, page, width, scheme):
    with opened(browser, page, width=width, scheme=scheme) as (window, wrong):
        window.wait_for_selector("html.plays")
        until(window, "document.getElementById('clock').textContent !== ''")
        broken = "[...document.images].filter((i) => i.offsetParent && !i.naturalWidth).length"
        assert window.evaluate(broken) == 0
        assert window.locator("#figures figure img").count() >= 12
        # Nothing is wider than the window: tables and figures scroll in themselves.
        assert window.evaluate("document.documentElement.scrollWidth") <= width
        shown = pixels(window)
        # Ground, robot, its shadow and its legs: many colours, none of which is nearly all.
        colours, count = np.unique(shown.reshape(-1, 3), axis=0, return_counts=True)
        assert len(colours) > 200
        assert count.max() < 0.9 * count.sum()
        assert (shown.mean() < 128) == (scheme == "dark")
        assert wrong == []


def test_hostile_names_are_read_and_never_run_W11(browser, hostile_page):
    with opened(browser, hostile_page) as (window, wrong):
        until(window, "document.getElementById('clock').textContent !== ''")
        text = window.evaluate("document.body.innerText")
        for name in (NAME, *LEG_NAMES):
            assert name in text
        assert NAME in window.title()
        assert NAME in window.locator("#view").get_attribute("aria-label")
        assert window.locator("html.plays").count() == 1
        # The page's own elements, and no other: its script's data, its script, its chips.
        count = "document.querySelectorAll('script, [onerror], [onload], img[src=x]').length"
        assert window.evaluate(count) == 2
        for part in ("summary", "robot"):
            window.evaluate(f"document.getElementById('{part}')?.scrollIntoView()")
        window.evaluate("document.querySelectorAll('details').forEach((d) => (d.open = true))")
        window.locator("#play").click()
        window.wait_for_timeout(300)
        assert not set(UNSEEN) & set(window.evaluate("document.body.innerText"))
        assert wrong == []


def test_the_replay_plays_and_scrubs(browser, page):
    with opened(browser, page) as (window, wrong):
        until(window, "document.getElementById('clock').textContent !== ''")
        window.locator("#seek").fill("0.5")
        until(window, "document.getElementById('clock').textContent.startsWith('0.50')")
        before = pixels(window)
        window.locator("#play").click()
        until(window, "parseFloat(document.getElementById('clock').textContent) > 1")
        assert window.locator("#play").text_content() == "Pause"
        window.locator("#play").click()
        assert np.abs(pixels(window) - before).max() > 50
        paused = clock(window)
        window.wait_for_timeout(200)
        assert clock(window) == paused
        # Ten times slower: in a quarter of a second at most a tenth of what would be.
        window.locator("#speed").select_option("0.1")
        window.locator("#play").click()
        window.wait_for_timeout(250)
        window.locator("#play").click()
        assert 0 <= clock(window) - paused < 0.2
        assert wrong == []


def test_keys_play_and_step(browser, page):
    with opened(browser, page) as (window, wrong):
        until(window, "document.getElementById('clock').textContent !== ''")
        window.locator("#view").focus()
        window.keyboard.press("Home")
        until(window, "document.getElementById('clock').textContent.startsWith('0.00')")
        window.keyboard.press("ArrowRight")
        until(window, "parseFloat(document.getElementById('clock').textContent) > 0.02")
        # A frame is the first sample after a thirtieth of a second; they are 10 ms apart.
        assert clock(window) == pytest.approx(1 / 30, abs=0.01)
        window.keyboard.press("Shift+ArrowRight")
        until(window, "parseFloat(document.getElementById('clock').textContent) > 1")
        window.keyboard.press("Space")
        assert window.locator("#play").text_content() == "Pause"
        window.keyboard.press("Space")
        assert window.locator("#play").text_content() == "Play"
        window.keyboard.press("End")
        until(window, "document.getElementById('clock').textContent.startsWith('4.00')")
        # On the play button space presses the button, once.
        window.locator("#play").focus()
        window.keyboard.press("Space")
        assert window.locator("#play").text_content() == "Pause"
        assert wrong == []


def test_each_mark_can_be_put_out(browser, page):
    with opened(browser, page) as (window, wrong):
        until(window, "document.getElementById('clock').textContent !== ''")
        for mark in ("forces", "trails", "support", "centre", "names"):
            with_it = pixels(window)
            window.locator(f"#show-{mark}").uncheck()
            window.wait_for_timeout(300)
            changed = np.abs(pixels(window) - with_it).max(axis=2) > 20
            assert changed.sum() > 40, mark
        assert wrong == []


def test_on_paper_there_are_no_controls(browser, page):
    with opened(browser, page) as (window, _):
        window.wait_for_selector("html.plays")
        window.emulate_media(media="print")
        assert window.locator("img.still").is_visible()
        assert not window.locator("#play").is_visible()
        assert not window.locator("#view").is_visible()
