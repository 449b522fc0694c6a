"""Films of the paper's walk and of the mixed course, and its report; needs Chromium.

Takes about five minutes on two cores.
"""

import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

import phasmid
from pages.studio import IMAGES, chromium
from phasmid.experiment import Command

VELOCITY, LASTS = 0.06, 62
"""Forward velocity [m/s], and duration with which the robot has left the course [s]."""

SPEED, RATE = 10, 5
"""Of the film: recorded seconds per second, frames per second."""


def main():
    """Walk, film and take the picture."""
    scenario = phasmid.load_scenario("paper").replace(
        robot="phantomx-mk4",
        terrain="course",
        depth="lidar",
        duration=LASTS,
        record_interval_ms=10,
    )
    run = phasmid.drive(scenario, None, Command(velocity=(VELOCITY, 0, 0)))
    film = IMAGES / "control-course.gif"
    phasmid.save_video(run, film, speed=SPEED, fps=RATE, force=True)
    paper = phasmid.load_scenario("paper").replace(duration=4.0)
    walk = phasmid.simulate(paper, phasmid.plan(paper))
    phasmid.save_video(walk, IMAGES / "walk.gif", force=True)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        phasmid.report(run, Path(folder) / "course")
        flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        browser = driver.chromium.launch(executable_path=chromium(), args=flags)
        window = browser.new_page(viewport={"width": 1100, "height": 1330}, color_scheme="light")
        window.goto((Path(folder) / "course/report.html").as_uri())
        window.wait_for_timeout(3000)
        picture = IMAGES / "control-course-page.png"
        window.screenshot(path=picture)
        browser.close()
    with Image.open(picture) as image:
        small = image.convert("RGB").quantize(256, method=Image.Quantize.FASTOCTREE)
    small.save(picture, optimize=True)
