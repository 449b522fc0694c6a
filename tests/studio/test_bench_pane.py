"""The pane of the leg bench in a real browser, Python's numbers behind it, no server beside."""

import json
import math
import re
from pathlib import Path

import pytest

from browsers import NEEDED, started
from phasmid.errors import PhasmidError
from phasmid.robot import load_robot
from phasmid.studio import bench as room
from phasmid.studio.bench import bench
from phasmid.studio.messages import Bench

pytestmark = NEEDED

PAGE = Path(room.__file__).with_name("page")
FILES = {name: (PAGE / name).read_text("utf-8") for name in ("bench.css", "bench.js")}
FILES["bench-drawing.js"] = (PAGE / "bench-drawing.js").read_text("utf-8")
FILES[""] = """<!doctype html><html lang="en"><head><title>bench</title>
<link rel="icon" href="data:,"><link rel="stylesheet" href="/bench.css"></head>
<body><section id="bench"></section><script src="/bench-drawing.js"></script>
<script src="/bench.js"></script><script src="/start.js"></script></body></html>"""
FILES["start.js"] = """window.put = (legs) => phasmidBench.mount(document.getElementById("bench"), {
legs, request: (message) => window.python(JSON.stringify(message)).then(JSON.parse) });
put(["right_front", "right_middle", "right_rear", "left_rear", "left_middle", "left_front"]);"""
KINDS = {".css": "text/css", ".js": "text/javascript", "": "text/html"}
POLICY = "default-src 'none'; script-src 'self'; style-src 'self'; img-src data:"
ROBOT = load_robot("phantomx-paper")


@pytest.fixture(scope="module")
def browser():
    with started() as found:
        yield found


@pytest.fixture
def window(browser):
    """The pane, which must neither complain nor ask anything of another place."""
    context = browser.new_context(viewport={"width": 1400, "height": 900})
    window, wrong = context.new_page(), []
    window.on("console", lambda message: wrong.append(message.text))
    window.on("pageerror", lambda error: wrong.append(str(error)))
    window.expose_function("python", answered)
    window.route("**/*", served)
    window.goto("http://bench.invalid/")
    reads(window, "Force z [N], as a number", "8.7")
    yield window
    context.close()
    assert wrong == []


def served(route):
    name = route.request.url.removeprefix("http://bench.invalid/")
    kind = KINDS[Path(name).suffix]
    route.fulfill(
        body=FILES[name],
        content_type=f"{kind}; charset=utf-8",
        headers={"Content-Security-Policy": POLICY},
    )


def answered(text):
    message = json.loads(text)
    assert message.pop("do") == "bench"
    for name in {"angles", "foot", "force"} & set(message):
        message[name] = tuple(map(float, message[name]))
    try:
        reply = {"reply": 1, "status": 200, "answer": bench(ROBOT, Bench(**message))}
    except PhasmidError as error:
        reply = {"reply": 1, "status": 422, "text": error.what, "hint": error.hint}
    return json.dumps(reply, allow_nan=False)


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


def test_angles_move_the_foot_and_the_foot_the_angles(window):
    slid(window, "Tibia θ₃", -90)
    slid(window, "Femur θ₂", 0)
    # 52 + 82 mm out, the tibia of 140 mm straight down.
    reads(window, "Foot x [mm], as a number", "134.0")
    reads(window, "Foot z [mm], as a number", "-140.0")
    window.get_by_label("Foot z [mm], as a number", exact=True).fill("-100")
    window.keyboard.press("Enter")
    q = bench(ROBOT, Bench(leg=1, foot=(0.134, 0.0, -0.1)))["angles"]
    reads(window, "Femur θ₂ [°], as a number", f"{math.degrees(q[1]):.1f}")
    assert cell(window, "Denavit-Hartenberg parameters", 1, 1).text_content() == "52.0"


def centre(locator):
    box = locator.bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def dragged(window, label, dx, dy):
    x, y = centre(window.get_by_label(label, exact=True).locator("circle").last)
    window.mouse.move(x, y)
    window.mouse.down()
    window.mouse.move(x + dx, y + dy, steps=4)
    window.mouse.up()


def test_the_foot_follows_the_pointer(window):
    per_mm = scale(window)
    dragged(window, "Foot, in the leg's plane", 20 * per_mm, -30 * per_mm)
    reads(window, "Foot z [mm], as a number", "-70.0")
    # A pointer stands on whole pixels, of which one is about a millimetre.
    x = float(window.get_by_label("Foot x [mm], as a number", exact=True).input_value())
    assert x == pytest.approx(170, abs=1)


def scale(window):
    """Pixels of the drawing for a millimetre, by its own bar of 50 mm."""
    bar = window.get_by_label("The leg in its own plane").locator("path.bench-scale")
    # Its line is one and a half units wide, which the box of an element leaves out.
    return bar.evaluate("bar => bar.getBoundingClientRect().width") / 50


def test_the_force_s_tip_follows_the_pointer_and_turns_its_torques(window):
    before = cell(window, "Torques", 1, 2).text_content()
    dragged(window, "Force on the foot, in the leg's plane", 25, 0)
    for _ in range(100):
        if cell(window, "Torques", 1, 2).text_content() != before:
            break
        window.wait_for_timeout(50)
    assert cell(window, "Torques", 1, 2).text_content() != before
    assert float(window.get_by_label("Force x [N], as a number", exact=True).input_value()) > 1


def test_what_cannot_be_is_said_and_the_nearest_pose_stays(window):
    slid(window, "Foot x", 280)
    told = window.get_by_role("status").filter(has_text="mm from the femur axis")
    told.wait_for()
    assert "foot target (280.0, 0.0, -100.0) mm" in told.text_content()
    # The slider keeps what is asked for; the table says where the foot is.
    reads(window, "Foot x [mm], as a number", "280.0")
    # On the line to the femur axis, 52 mm out, where the leg of 222 mm ends.
    nearest = 52 + 222 * 228 / math.hypot(228, 100)
    assert cell(window, "Foot", 0, 0).text_content() == f"{nearest:.1f}"
    window.get_by_role("button", name="Neutral foot").click()
    reads(window, "Foot x [mm], as a number", "150.0")
    assert told.count() == 0


def test_too_large_a_force_is_shown_on_bar_and_sentence(window):
    slid(window, "Force z", 20)
    window.get_by_role("status").filter(has_text="the servo AX-12A gives 1.5 N·m").wait_for()
    share = cell(window, "Torques", 1, 3)
    assert int(re.sub(r"\D", "", share.text_content())) > 100
    assert "bench-bad" in share.get_attribute("class")
    assert window.locator(".bench-overloaded").count() == 2


def test_another_ground_leaves_the_bench_as_it_is_and_another_robot_begins_it_anew(window):
    slid(window, "Foot z", -80)
    reads(window, "Tibia θ₃ [°], as a number", tibia := tibia_at(-0.08))
    legs = [leg.name for leg in ROBOT.legs]
    window.evaluate("legs => { put(legs) }", legs)
    window.wait_for_timeout(300)
    reads(window, "Tibia θ₃ [°], as a number", tibia)
    window.evaluate("legs => { put(legs) }", legs[:4])
    reads(window, "Tibia θ₃ [°], as a number", tibia_at(-0.1))
    assert window.get_by_label("Leg", exact=True).locator("option").count() == 4


def tibia_at(height):
    q = bench(ROBOT, Bench(leg=1, foot=(0.15, 0.0, height)))["angles"]
    return f"{math.degrees(q[2]):.1f}"
