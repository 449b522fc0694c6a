"""A run's page is one file that needs no network, and nothing in a user's file runs in it."""

import base64
import hashlib
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest

from phasmid import kinematics
from phasmid.reporting import report, summarise
from phasmid.reporting.robot_mesh import robot_corners
from phasmid.reporting.run import read_run
from phasmid.reporting.webpage import page_html
from phasmid.reporting.webpage.packing import FORMS, LARGEST, json_block
from phasmid.reporting.webpage.replay import MOST_BYTES, frames, replay
from support.hostile import HOSTILE, LEG_NAMES, NAME, UNSEEN, hostile_walk

VOID = {"meta", "link", "img", "input", "br"}
LOADING = ("src", "href", "srcset", "poster", "data", "action", "background")


class Reader(HTMLParser):
    """Walks a page: its tags are balanced, and what they load is noted."""

    def __init__(self):
        super().__init__()
        self.open, self.tags, self.loads, self.handlers, self.text = ([] for _ in range(5))

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        for name, value in attrs:
            if name in LOADING:
                self.loads.append(value)
            if name.startswith("on") or name == "style":
                self.handlers.append((tag, name))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def read(page):
    reader = Reader()
    reader.feed(page)
    reader.close()
    assert reader.open == []
    return reader


def scene_of(page):
    return json.loads(re.search(r'id="scene">(.*?)</script>', page, re.DOTALL).group(1))


@pytest.fixture(scope="module")
def folder(walk, tmp_path_factory):
    """Of a walk of two seconds."""
    with pytest.MonkeyPatch.context() as patch:
        # A small picture is drawn as a large one is, but sooner.
        patch.setattr("phasmid.reporting.drawing.DPI", 60)
        return report(walk(duration=2.0, interval=0.01), tmp_path_factory.mktemp("page") / "walk")


@pytest.fixture(scope="module")
def page(folder):
    return (folder / "report.html").read_text(encoding="utf-8")


def test_the_page_loads_nothing_from_elsewhere(page):
    reader = read(page)
    assert reader.loads
    for place in reader.loads:
        assert place.startswith(("data:", "#")), place
    style = re.search(r"<style>(.*?)</style>", page, re.DOTALL).group(1)
    assert "url(" not in style
    assert "@import" not in style
    assert "default-src 'none'" in page


def test_its_policy_admits_its_own_script_and_no_other(page):
    own = page.rpartition("<script>")[2].partition("</script>")[0]
    digest = base64.b64encode(hashlib.sha256(own.encode()).digest()).decode()
    policy = next(a["content"] for t, a in read(page).tags if "http-equiv" in a)
    assert f"script-src 'sha256-{digest}';" in policy
    assert "unsafe" not in policy


def test_every_figure_of_the_folder_and_those_beyond_the_papers_are_in_the_page(page, folder):
    names = set(re.findall(r'<figure id="figure-([^"]*)"', page))
    assert {path.stem for path in (folder / "figures").glob("*.svg")} <= names
    beyond = {"gait-diagram", "support-margin", "servo-envelope", "friction-demand"}
    assert names >= beyond | {"foot-path", "power"}
    drawn = re.findall(r'src="data:image/svg\+xml;base64,([^"]*)"', page)
    assert len(drawn) == len(names)
    fig12 = (folder / "figures" / "fig12.svg").read_bytes()
    assert fig12 in [base64.b64decode(text) for text in drawn]


def test_without_scripts_the_still_picture_and_all_numbers_are_there(page, folder):
    still = base64.b64encode((folder / "figures" / "walk.png").read_bytes()).decode()
    assert 'class="still" alt="' in page
    assert still in page
    text = " ".join(read(page).text)
    for words in (
        "Servos hold?",
        "phasmid walk scenario.toml",
        "How far?",
    ):
        assert words in text


def test_a_drive_is_repeated_with_its_commands(walk):
    recording = walk(duration=2.0, interval=0.02)
    recording.attrs["commands"] = "format = 1\ncommand = [{time = 0.0}]\n"
    page = page_html(recording, summarise(recording), [])
    assert "phasmid replay recording.nc" in page
    assert "phasmid walk scenario.toml" not in page


def test_hostile_names_are_text_W11(walk):
    recording = hostile_walk(walk(duration=2.0, interval=0.02))
    recording.attrs["phasmid_version"] = HOSTILE
    recording.attrs["ending_reason"] = HOSTILE
    picture = ("fig12", HOSTILE, b"<svg xmlns='http://www.w3.org/2000/svg'/>")
    page = page_html(recording, summarise(recording), [picture])
    reader = read(page)
    assert [tag for tag, _ in reader.tags].count("script") == 2
    assert reader.handlers == []
    assert not [a for t, a in reader.tags if t == "img" and a.get("src") == "x"]
    text = " ".join(reader.text)
    for name in (NAME, *LEG_NAMES):
        assert name.replace("_", " ") in text
    # Neither what drives a terminal nor what turns the direction of writing is shown as it is.
    assert not set(UNSEEN) & set(page)


def test_a_file_that_was_recorded_elsewhere_is_shown_without_what_cannot_be_seen(walk):
    # Our own files tell such letters by their numbers; another program may have written them.
    recording = walk(duration=2.0, interval=0.02)
    recording.attrs["scenario"] += "# \x9b\u202e\n# end\n"
    page = page_html(recording, summarise(recording), [])
    assert not set(UNSEEN) & set(page)
    assert "# \N{REPLACEMENT CHARACTER}" in page
    assert "\n# end\n</pre>" in page


def test_json_in_the_page_cannot_end_its_script():
    value = {"name": HOSTILE, "&": ["<!--", "\u2029"]}
    text = json_block(value)
    assert not set("<>&\u2028\u2029") & set(text)
    assert json.loads(text) == value


@pytest.mark.parametrize("legs", [6, 8])
def test_frames_decode_to_the_recordings_poses(walk, eight_legs, legs):
    robot, scenario = eight_legs if legs == 8 else (None, None)
    recording = walk(duration=2.0, interval=0.01, robot=robot, scenario=scenario)
    source = read_run(recording)
    scene = replay(source)
    rows = frames(source)
    frame = len(rows) // 3
    sample = recording.isel(time=rows[frame])
    assert unpacked(scene["time"])[frame] == pytest.approx(float(sample["time"]), rel=1e-6)

    p_body_link = unpacked(scene["link_position"])[frame]
    R_body_link = kinematics.quaternion_rotation(unit(unpacked(scene["link_orientation"])[frame]))
    R_world_body = kinematics.quaternion_rotation(unit(unpacked(scene["body_orientation"])[frame]))
    p_world_body = unpacked(scene["body_position"])[frame]
    corners = []
    for piece in scene["pieces"]:
        mesh = scene["meshes"][piece["mesh"]]
        points = unpacked(mesh["vertices"])[unpacked(mesh["faces"]).astype(int)]
        link = piece["link"]
        if link >= 0:
            points = points @ R_body_link[link].T + p_body_link[link]
        corners.append(points @ R_world_body.T + p_world_body)
    shown = np.concatenate(corners).reshape(-1, 3)
    X_world_body = np.eye(4)
    X_world_body[:3, :3] = kinematics.quaternion_rotation(sample["body_orientation"].values)
    X_world_body[:3, 3] = sample["body_position"].values
    truth = robot_corners(source.robot, sample["joint_position"].values, X_world_body)
    # Half a step of a vertex and of a link's place, each below 0.5 m over 32767, on each of three
    # axes; and half a step of a quaternion's four entries, which turns by at most 4 / 32767 over
    # an arm below 0.5 m, for the link and for the body.
    allowed = np.sqrt(3) * (0.5 / LARGEST) + 2 * 0.5 * 4 / LARGEST
    for low_or_high in (np.min, np.max):
        assert low_or_high(shown, axis=0) == pytest.approx(low_or_high(truth, axis=0), abs=allowed)
    assert shown.mean(axis=0) == pytest.approx(truth.mean(axis=0), abs=0.02)

    feet = unpacked(scene["feet"])[frame] + p_world_body
    assert feet == pytest.approx(sample["foot_position"].values, abs=scene["feet"]["step"])
    forces = unpacked(scene["forces"])[frame]
    assert forces == pytest.approx(sample["foot_force"].values, abs=scene["forces"]["step"])
    assert np.array_equal(unpacked(scene["down"])[frame], sample["contact"].values)


def unpacked(array):
    """The array of `packed`, within half a step, as the player reads it."""
    numbers = np.frombuffer(base64.b64decode(array["data"]), dtype=FORMS[array["kind"]])
    return numbers.reshape(array["shape"]).astype(float) * array["step"]


def unit(q):
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def test_a_long_run_has_fewer_frames_and_a_page_of_bounded_size(walk):
    recording = walk(duration=900.0, interval=0.02)
    rows = frames(read_run(recording))
    scene = replay(read_run(recording))
    arrays = [value for value in scene.values() if isinstance(value, dict) and "data" in value]
    held = sum(len(array["data"]) for array in arrays)
    # Base64 has four letters for three bytes; the samples' grid keeps fewer, never more.
    assert held <= 1.01 * MOST_BYTES * 4 / 3
    assert len(rows) < 900 * 30


def test_without_a_pose_the_page_says_so(walk):
    recording = walk(duration=2.0, interval=0.02, drop=["body_position", "body_orientation"])
    page = page_html(recording, summarise(recording), [])
    assert scene_of(page) is None
    assert "robot's pose is not recorded" in page
    read(page)
