"""The live page in a real browser: a robot in physics is looked at, driven, changed and kept."""

import math
import re
from contextlib import contextmanager
from functools import partial
from itertools import chain

import numpy as np
import pytest

from phasmid.robot import load_robot
from phasmid.studio.bench import bench as bench_at
from phasmid.studio.messages import Bench
from phasmid.units import STANDARD_GRAVITY
from studio.running import Heard, running
from support.browsers import NEEDED, PATIENCE, is_ours, pixels, started, until
from support.hostile import LEG_NAMES, hostile_files

bench = partial(bench_at, gravity=STANDARD_GRAVITY)

pytestmark = NEEDED


@pytest.fixture(scope="module")
def studio(tmp_path_factory):
    """A studio of the paper's robot, which all tests of this module look at."""
    with running(tmp_path_factory.mktemp("runs")) as studio:
        yield studio


@pytest.fixture(scope="module")
def browser():
    with started("--disable-gpu") as browser:
        yield browser


@contextmanager
def opened(browser, studio, *, width=1400, scheme="light"):
    """The page in a window, what it hears, and what went wrong in it."""
    context = browser.new_context(
        viewport={"width": width, "height": 900}, color_scheme=scheme, accept_downloads=True
    )
    window = context.new_page()
    window.set_default_timeout(1000 * PATIENCE)
    wrong = []
    window.on(
        "console",
        lambda message: is_ours(message) and wrong.append(f"{message.type}: {message.text}"),
    )
    window.on("pageerror", lambda error: wrong.append(f"error: {error}"))
    window.on("dialog", lambda dialog: (wrong.append(f"says: {dialog.message}"), dialog.dismiss()))
    window.on(
        "request",
        lambda request: (
            None
            if request.url.startswith((studio.origin, "data:", "blob:"))
            else wrong.append(f"asks: {request.url[:80]}")
        ),
    )
    heard = Heard(window)
    window.goto(studio.address)
    yield window, heard, wrong
    context.close()


@pytest.fixture
def page(browser, studio):
    """A window of the robot that walks by itself on flat ground; nothing goes wrong in it."""
    with opened(browser, studio) as (window, heard, wrong):
        walks(window)
        begin_anew(window, heard)
        yield window, heard
        assert wrong == []


def wait(window, truth):
    """Wait for a truth of what was heard."""
    for _ in range(round(PATIENCE / 0.05)):
        if truth():
            return
        window.wait_for_timeout(50)
    raise AssertionError(f"{PATIENCE:g} s passed and it did not become true")


def walks(window):
    """Wait until there is a robot and its numbers."""
    until(window, "/[1-9]/.test(document.getElementById('now-real').textContent)")


def begin_anew(window, heard):
    """The setting that tests start from: by itself, on flat ground, in the tripod gait."""
    for label, name, word in (
        ("Robot", "robot", "phantomx-paper"),
        ("Terrain", "terrain", "flat"),
        ("Gait", "gait", "tripod"),
        ("Walks", "walks", "by itself"),
    ):
        if heard.told["setting"][name] != word:
            choose(window, heard, label, name, word)


def choose(window, heard, label, name, word):
    """Choose by hand, and wait until the robot took it up."""
    window.get_by_label(label, exact=True).select_option(word)
    wait(window, lambda: heard.told["setting"][name] == word)


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [400, 800, 1400])
def test_the_page_opens_and_the_robot_walks(browser, studio, width, scheme):
    with opened(browser, studio, width=width, scheme=scheme) as (window, heard, wrong):
        walks(window)
        wait(window, lambda: heard.value("body_position") is not None)
        begin = heard.value("body_position").copy()
        # The paper's robot walks ahead by itself, in the x axis.
        wait(window, lambda: heard.value("body_position")[0] > begin[0] + 0.02)
        # Nothing is wider than the window, and what is shown is a picture of many colours.
        assert window.evaluate("document.documentElement.scrollWidth") <= width
        shown = pixels(window)
        assert len(np.unique(shown.reshape(-1, 3), axis=0)) > 200
        assert (shown.mean() < 128) == (scheme == "dark")
        assert wrong == []


def test_every_control_is_found_by_its_label(page):
    window, heard = page
    for field in chain(*heard.told["catalogue"].values()):
        control = window.get_by_label(field["label"], exact=True)
        role = {"choice": "SELECT", "range": "INPUT", "switch": "INPUT"}[field["kind"]]
        assert control.evaluate("(one) => one.tagName") == role
    for name in ("Pause", "Step", "Reset", "Record", "Stop", "Save scenario"):
        assert window.get_by_role("button", name=name, exact=True).is_visible()
    for name in ("ahead", "back", "to the left", "to the right"):
        assert window.get_by_role("button", name=f"Push {name}", exact=True).is_visible()
    unnamed = (
        "[...document.querySelectorAll('button, select, input')].filter((one) =>"
        " !one.labels?.length && !one.ariaLabel && !one.textContent.trim()).length"
    )
    assert window.evaluate(unnamed) == 0


def test_gait_terrain_and_robot_are_changed(page):
    window, heard = page
    choose(window, heard, "Gait", "gait", "wave")
    until(window, "document.getElementById('what').textContent.includes('wave gait')")
    # A wave gait has five of six feet down at any time.
    wait(window, lambda: heard.told["scene"]["gait"]["duty"] > 0.8)
    choose(window, heard, "Terrain", "terrain", "waves")
    wait(window, lambda: heard.told["scene"]["ground"] is not None)
    choose(window, heard, "Terrain", "terrain", "flat")
    choose(window, heard, "Robot", "robot", "quadruped")
    until(window, "document.querySelectorAll('#legs .leg').length === 4")
    wait(window, lambda: heard.value("contact") is not None and len(heard.value("contact")) == 4)
    begin_anew(window, heard)
    until(window, "document.querySelectorAll('#legs .leg').length === 6")


def test_a_change_that_is_refused_says_why_and_puts_the_old_value_back(page):
    window, heard = page
    before = heard.told["setting"]["friction"]
    number = window.get_by_label("Friction in", exact=False)
    number.fill("-1")
    number.press("Enter")
    alert = window.locator(".field", has=number).get_by_role("alert")
    alert.filter(has_text="friction is -1").wait_for()
    assert heard.told["setting"]["friction"] == before
    until(window, f"Number(document.getElementById('field-friction').value) === {before}")
    assert float(number.input_value()) == before
    # The next change that is taken up puts the sentence away.
    number.fill("0.9")
    number.press("Enter")
    wait(window, lambda: heard.told["setting"]["friction"] == 0.9)
    alert.filter(has_text=re.compile("^$")).wait_for(state="attached")


def test_keys_drive_turn_and_stop(page):
    window, heard = page
    window.locator("#view").focus()
    window.keyboard.down("w")
    wait(window, lambda: heard.told["setting"]["walks"] == "by hand")
    wait(window, lambda: heard.value("velocity_command")[0] > 0)
    assert window.get_by_role("slider", name="Stick").get_attribute("aria-valuetext") == (
        "100 % ahead"
    )
    window.keyboard.down("q")
    wait(window, lambda: heard.value("velocity_command")[2] > 0)
    window.keyboard.up("q")
    window.keyboard.up("w")
    wait(window, lambda: not heard.value("velocity_command").any())
    # While somebody types, letters are letters.
    window.get_by_label("Cycle time in s").press("w")
    window.wait_for_timeout(300)
    assert not heard.value("velocity_command").any()


def test_the_stick_springs_back_and_the_robot_stands(page):
    window, heard = page
    stick = window.get_by_role("slider", name="Stick")
    box = stick.bounding_box()
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    window.mouse.move(*middle)
    window.mouse.down()
    window.mouse.move(middle[0] - 0.3 * box["width"], middle[1])
    # To the left on the page is to the left of the robot, the y axis.
    wait(window, lambda: heard.value("velocity_command")[1] > 0)
    assert "to the left" in stick.get_attribute("aria-valuetext")
    window.mouse.up()
    wait(window, lambda: not heard.value("velocity_command").any())
    assert stick.get_attribute("aria-valuetext") == "at rest"
    turn = window.get_by_label("Turn", exact=True)
    box = turn.bounding_box()
    window.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    window.mouse.down()
    window.mouse.move(box["x"] + 0.95 * box["width"], box["y"] + box["height"] / 2)
    wait(window, lambda: heard.value("velocity_command")[2] < 0)
    window.mouse.up()
    wait(window, lambda: not heard.value("velocity_command").any())
    assert turn.input_value() == "0"


def test_time_pauses_steps_and_begins_anew(page):
    window, heard = page
    window.get_by_role("button", name="Pause", exact=True).click()
    wait(window, lambda: heard.told["state"]["playing"] is False)
    window.get_by_role("button", name="Play", exact=True).wait_for()
    window.wait_for_timeout(500)
    paused = float(heard.value("time")[0])
    window.get_by_role("button", name="Step", exact=True).click()
    wait(window, lambda: heard.value("time")[0] > paused)
    # One update of the controller, and no more.
    assert heard.value("time")[0] - paused <= 0.05
    # So short a time is to be seen.
    stepped = f"{heard.value('time')[0]:.3f} s"
    clock = window.get_by_label("Simulated time")
    wait(window, lambda: clock.text_content() == stepped)
    window.get_by_label("Pace").select_option("0.5")
    wait(window, lambda: heard.told["state"]["pace"] == 0.5)
    window.get_by_label("Pace").select_option("1")
    window.locator("#view").focus()
    window.keyboard.press("p")
    wait(window, lambda: heard.told["state"]["playing"] is True)
    wait(window, lambda: heard.value("time")[0] > 1)
    window.keyboard.press("r")
    wait(window, lambda: heard.value("time") is not None and heard.value("time")[0] < 1)


def test_plots_are_read_and_held(page):
    window, heard = page
    wait(window, lambda: heard.value("time")[0] > 1)
    canvas = window.locator("#plots canvas").first
    width = window.evaluate("document.querySelector('#plots canvas').clientWidth")

    def read():
        canvas.hover(position={"x": width - 6, "y": 30}, force=True)
        window.wait_for_timeout(100)
        time, *forces = window.locator(".reading p").all_text_contents()
        assert len(forces) == 6
        assert all(force.strip().endswith(" N") for force in forces)
        return float(time.removesuffix(" s"))

    window.get_by_role("button", name="Hold plots").click()
    held = read()
    wait(window, lambda: heard.value("time")[0] > held + 1)
    assert read() == pytest.approx(held, abs=0.15)
    window.get_by_role("button", name="Go on").click()
    assert read() > held + 0.8


def test_a_push_and_a_lost_leg(page):
    window, heard = page
    window.get_by_role("button", name="Push to the left", exact=True).click()
    wait(window, lambda: any("push" in event["text"] for event in heard.events))
    leg = window.get_by_role("button", name="2 right middle")
    leg.click()
    wait(window, lambda: heard.told["state"]["lost"] == [2])
    # The badge stands on one line: its height is below that of two lines of its letters.
    badge = "document.querySelector('#legs .leg.off .how')"
    letters = f"parseFloat(getComputedStyle({badge}).fontSize)"
    assert window.evaluate(f"{badge}.clientHeight < 2 * {letters}")
    leg.filter(has_text="lost").click()
    wait(window, lambda: heard.told["state"]["lost"] == [])


def test_a_run_is_recorded_saved_and_its_report_opened(page):
    window, heard = page
    window.get_by_role("button", name="Record", exact=True).click()
    wait(window, lambda: (heard.told["state"]["recording"] or {"seconds": 0})["seconds"] >= 1)
    window.get_by_role("button", name="Stop and save run", exact=True).click()
    wait(window, lambda: any("run" in event for event in heard.events))
    window.get_by_role("tab", name="Events").click()
    link = window.locator("#event-list").get_by_role("link", name="Open its report").first
    with window.context.expect_page() as told:
        link.click()
    report = told.value
    report.wait_for_load_state()
    assert "phasmid" in report.title()
    assert report.locator("#summary").is_visible()


def test_hostile_names_are_shown_as_text_W11(browser, tmp_path):
    (tmp_path / "robot.toml").write_text(hostile_files(4.0)["robot"], encoding="utf-8")
    robot = str(tmp_path / "robot.toml")
    with (
        running(tmp_path, robot=robot) as studio,
        opened(browser, studio) as (window, _, wrong),
    ):
        for number, name in enumerate(LEG_NAMES, start=1):
            window.get_by_role("button", name=f"{number} {name}").wait_for()
        own = "document.querySelectorAll('script:not([src]), [onerror], [onload], img').length"
        assert window.evaluate(own) == 0
        assert wrong == []


def test_a_lost_connection_is_told_and_comes_back(browser, tmp_path):
    with running(tmp_path) as studio, opened(browser, studio) as (window, heard, wrong):
        walks(window)
        studio.end()
        window.get_by_role("alert").filter(has_text="connection to the robot is lost").wait_for()
        studio.begin()
        until(window, "document.getElementById('banner').hidden")
        seen = float(heard.value("time")[0])
        wait(window, lambda: heard.value("time")[0] > seen)
        # A browser writes of connections that fail; nothing else went wrong.
        assert [line for line in wrong if "WebSocket" not in line] == []


# The leg bench ------------------------------------------------------------------------------------

ROBOT = load_robot("phantomx-paper")


def bench_of(page):
    """The page with the leg bench, once it has answered."""
    window, _ = page
    window.get_by_role("tab", name="Leg bench").click()
    reads(window, "Force z in N", "8.7")
    return window


def reads(window, label, text):
    """Wait until a number reads so."""
    field = window.get_by_label(label, exact=True)
    for _ in range(100):
        if field.input_value() == text:
            return
        window.wait_for_timeout(50)
    assert field.input_value() == text


def slid(window, label, value):
    window.get_by_label(label, exact=True).fill(str(value))


def cell(window, table, row, column):
    return (
        window.get_by_role("region", name=table)
        .locator("tbody tr")
        .nth(row)
        .locator("td")
        .nth(column)
    )


def test_angles_move_the_foot_and_the_foot_the_angles(page):
    window = bench_of(page)
    slid(window, "Tibia θ₃", -90)
    slid(window, "Femur θ₂", 0)
    # 52 + 82 mm out, the tibia of 140 mm straight down.
    reads(window, "Foot x in mm", "134.0")
    reads(window, "Foot z in mm", "-140.0")
    window.get_by_label("Foot z in mm", exact=True).fill("-100")
    window.keyboard.press("Enter")
    q = bench(ROBOT, Bench(leg=1, foot=(0.134, 0.0, -0.1)))["angles"]
    reads(window, "Femur θ₂ in °", f"{math.degrees(q[1]):.1f}")
    assert cell(window, "Denavit-Hartenberg parameters", 1, 1).text_content() == "52.0"


def test_the_force_turns_torques_and_its_arrow(page):
    window = bench_of(page)
    before = cell(window, "Torques", 1, 2).text_content()
    arrow = window.get_by_label("The leg in its own plane").locator(".bench-force text")
    assert arrow.text_content() == "8.7 N"
    slid(window, "Force x", 5)
    size = math.hypot(5, ROBOT.mass * 9.80665 / 3)
    arrow.filter(has_text=f"{size:.1f} N").wait_for()
    assert cell(window, "Torques", 1, 2).text_content() != before


def test_what_cannot_be_is_said_and_the_nearest_pose_stays(page):
    window = bench_of(page)
    slid(window, "Foot x", 280)
    told = window.get_by_role("status").filter(has_text="mm from the femur axis")
    told.wait_for()
    # The foot is hypot(228, 100) = 249.0 mm from the femur axis. The tibia bends by 23° at least:
    # the leg of 82 and 140 mm reaches 217.9 mm.
    reach = math.sqrt(82**2 + 140**2 + 2 * 82 * 140 * math.cos(math.radians(23)))
    assert f"{math.hypot(228, 100) - reach:.1f} mm too far" in told.text_content()
    # The slider keeps what is asked for; the table says where the foot is.
    reads(window, "Foot x in mm", "280.0")
    # On the line to the femur axis, 52 mm out, where the leg's reach ends.
    nearest = 52 + reach * 228 / math.hypot(228, 100)
    assert cell(window, "Foot", 0, 0).text_content() == f"{nearest:.1f}"
    window.get_by_role("button", name="Neutral foot").click()
    reads(window, "Foot x in mm", "150.0")
    assert told.count() == 0


def test_too_large_a_force_is_shown_on_bar_and_sentence(page):
    window = bench_of(page)
    slid(window, "Force z", 20)
    window.get_by_role("status").filter(has_text="the servo AX-12A gives 1.5 N·m").wait_for()
    share = cell(window, "Torques", 1, 3)
    assert int(re.sub(r"\D", "", share.text_content())) > 100
    assert "bench-bad" in share.get_attribute("class")
    assert window.locator(".bench-overloaded").count() == 2
