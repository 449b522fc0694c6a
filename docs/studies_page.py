"""Makes the three studies of examples/studies, and takes the pictures of their pages in a browser.

    python docs/studies_page.py [FOLDER]

Takes a quarter of an hour on two cores. With a folder, the studies in it go on. It needs Chromium
and playwright.
"""

import sys
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright
from studio_page import IMAGES, chromium

import phasmid

STUDIES = "payload", "terrain", "legs"


def main():
    """Make the studies and take the pictures."""
    examples = IMAGES.parents[1] / "examples/studies"
    with tempfile.TemporaryDirectory() as temporary, sync_playwright() as driver:
        folder = Path(*sys.argv[1:2] or [temporary])
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


if __name__ == "__main__":
    main()
