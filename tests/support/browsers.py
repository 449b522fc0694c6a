"""A real browser for tests of pages: the system's Chromium, driven by playwright."""

import io
import os
import shutil
from contextlib import contextmanager

import numpy as np
import pytest

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)

NEEDED = [
    pytest.mark.skipif(bool(os.environ.get("CI")), reason="no browser is started in CI"),
    pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium on this machine"),
]
"""Marks of a module whose tests need a browser."""

PATIENCE = 90.0
"""Time after which a truth is given up, for machines that do much else [s]."""


@contextmanager
def started(*flags):
    """A browser; the test is skipped where nothing drives one.

    Args:
        flags: How it draws. With ``--use-angle=swiftshader`` pictures are made beside the page's
            own work; ``--disable-gpu`` costs the processor a third of that, for pages that move
            all the time.
    """
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="playwright, which drives the browser, is not installed"
    )
    # WebGL is drawn by the processor, as there may be nothing else.
    flags = ("--no-sandbox", "--enable-unsafe-swiftshader", *flags)
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=list(flags))
        yield browser
        browser.close()


def is_ours(message):
    """Whether a line of the console is the page's, and not of a graphics driver to itself."""
    return "GL Driver Message" not in message.text


def until(window, truth):
    """Wait for a truth; a page's policy forbids the driver's own way, which evaluates text."""
    for _ in range(round(PATIENCE / 0.05)):
        if window.evaluate(truth):
            return
        window.wait_for_timeout(50)
    raise AssertionError(f"{PATIENCE:g} s passed and not: {truth}")


def pixels(window, selector="#view"):
    """A part of the page as numbers, shape (H, W, 3)."""
    from PIL import Image

    raw = window.locator(selector).screenshot()
    return np.asarray(Image.open(io.BytesIO(raw)).convert("RGB"), dtype=float)
