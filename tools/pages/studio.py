"""Pictures of the live page, for docs/studio.md; needs Chromium.

Takes about a minute.
"""

import re
import shutil
import subprocess
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path

IMAGES = Path(__file__).parents[2] / "docs" / "images"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
WALKED = 12
"""The plots show ten seconds: only then they are full [s]."""
PATIENCE = 300
"""For how long it may take to walk them [s]."""


def main():
    """Start the studio, look at it, end it."""
    from playwright.sync_api import sync_playwright

    # There may be no graphics card: the processor draws.
    flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with studio() as address, sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium(), args=flags)
        window = browser.new_page(viewport={"width": 1400, "height": 900}, color_scheme="light")
        window.goto(address)
        walked(window)
        window.get_by_role("button", name="Pause").click()
        window.locator("#plots canvas").nth(1).hover(position={"x": 200, "y": 40})
        window.wait_for_timeout(1500)
        window.screenshot(path=IMAGES / "studio.png")
        window.get_by_role("tab", name="Leg bench").click()
        window.get_by_label("Foot z", exact=True).fill("-75")
        window.get_by_label("Force x", exact=True).fill("-3")
        window.set_viewport_size({"width": 1400, "height": 1330})
        window.mouse.move(0, 0)
        window.wait_for_timeout(1500)
        window.locator("#below").screenshot(path=IMAGES / "studio-bench.png")
        browser.close()


def chromium():
    """The system's browser."""
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        sys.exit(f"no browser; one of {', '.join(BROWSERS)} is needed.")
    return found


@contextmanager
def studio():
    """A studio on a port that is free; gives its address."""
    with tempfile.TemporaryDirectory() as out:
        command = [sys.executable, "-m", "phasmid", "studio", "--no-open", "--port", "0"]
        command += ["--terrain", "blocks"]
        process = subprocess.Popen([*command, "--out", out], stdout=subprocess.PIPE, text=True)
        try:
            found = None
            while found is None:
                line = process.stdout.readline()
                if not line:
                    sys.exit("the studio did not start.")
                found = re.search(r"http://\S+", line)
            yield found[0]
        finally:
            process.terminate()
            process.wait(timeout=30)


def walked(window):
    """Wait until the robot has walked for a while."""
    pattern = re.compile(r"^(\d+)\.\d+ s")
    for _ in range(2 * PATIENCE):
        time = pattern.match(window.get_by_label("Simulated time").text_content())
        if time and int(time[1]) >= WALKED:
            return
        window.wait_for_timeout(500)
    sys.exit(f"the robot did not walk for {WALKED} s.")
