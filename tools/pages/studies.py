"""The three studies of examples/studies, and pictures of their pages; needs Chromium.

Takes a quarter of an hour on two cores. Studies in results/studies continue.
"""

from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

import phasmid
from pages.studio import IMAGES, chromium

STUDIES = "payload", "terrain", "legs"


def main():
    """Make the studies and take the pictures."""
    examples = IMAGES.parents[1] / "examples/studies"
    folder = Path("results/studies")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium(), args=["--no-sandbox"])
        for name in STUDIES:
            results = phasmid.study(examples / f"{name}.toml", out=folder / name)
            window = browser.new_page(
                viewport={"width": 1100, "height": 1330}, color_scheme="light"
            )
            window.goto((results.folder / "study.html").resolve().as_uri())
            window.wait_for_timeout(1500)
            picture = IMAGES / f"study-{name}.png"
            window.screenshot(path=picture)
            with Image.open(picture) as image:
                small = image.convert("RGB").quantize(128)
            small.save(picture, optimize=True)
        browser.close()
