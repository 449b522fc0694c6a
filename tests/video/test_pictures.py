"""What the engine draws is the robot where the camera says, in the colours of its legs."""

import colorsys
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import phasmid
from phasmid.errors import InvalidInput, OutputError
from phasmid.kinematics import leg_frames
from phasmid.reporting.machine import robot_mesh
from phasmid.reporting.shapes import rgb
from phasmid.reporting.style import leg_colour
from phasmid.video import painter
from phasmid.video.film import film_camera, scene
from phasmid.video.painter import painted

SIZE = (640, 360)


def cut(film, count):
    """A film's first frames."""
    parts = ("time", "body", "q", "feet", "force")
    return replace(film, **{name: getattr(film, name)[:count] for name in parts})


@pytest.fixture(scope="module")
def short(film):
    return cut(film, 2)


@pytest.fixture(scope="module")
def told(short):
    return scene(short, film_camera(short, SIZE))


@pytest.fixture(scope="module")
def pictures(told, backend):
    with painted(told, backend) as drawn:
        return [np.array(picture, dtype=float) for picture in drawn]


def test_frames_are_not_blank_and_differ(pictures):
    assert len(pictures) == 2
    for picture in pictures:
        assert picture.shape == (360, 640, 3)
        assert picture.std() > 20
    assert np.abs(pictures[1] - pictures[0]).mean() > 0.5


def test_the_robot_is_drawn_where_the_camera_says(short, told, pictures, backend):
    # With light from straight above, no shadow is wider or higher than the robot.
    above = dict(told) | {"light": np.array([1e-9, 0.0, 1.0])}
    away = dict(above) | {"position": told["position"] + [0.0, 0.0, 90.0]}
    seen = []
    for one in (above, away):
        with painted(one, backend) as drawn:
            seen.append(np.array(next(drawn), dtype=float))
    rows, columns = np.nonzero(np.abs(seen[0] - seen[1]).max(axis=-1) > 40)
    mesh = robot_mesh(short.source.robot, short.q[0], short.body[0])
    points = film_camera(short, SIZE).at(0).project(mesh.corners)[..., :2].reshape(-1, 2)
    low, high = points.min(axis=0), points.max(axis=0)
    # An edge lies within a pixel, and half of it may be too pale to count.
    np.testing.assert_allclose([columns.min(), columns.max() + 1], [low[0], high[0]], atol=2)
    assert abs(rows.min() - low[1]) <= 2
    assert abs((columns.min() + columns.max() + 1) / 2 - SIZE[0] / 2) <= 2


def test_each_leg_wears_its_colour(short, pictures):
    """Near each knee there are pixels of the leg's hue; light changes brightness, not hue."""
    robot, view = short.source.robot, film_camera(short, SIZE).at(0)
    hues = np.array([_hue(leg_colour(leg)) for leg in range(len(robot.legs))])
    found = 0
    for number, leg in enumerate(robot.legs):
        frames = short.body[0] @ leg.X_body_hip @ leg_frames(leg, short.q[0, number])
        knee, foot = frames[1, :3, 3], frames[3, :3, 3]
        x, y = view.project((knee + foot) / 2)[:2].astype(int)
        patch = pictures[0][max(y - 45, 0) : y + 45, max(x - 30, 0) : x + 30].reshape(-1, 3)
        vivid = patch[np.ptp(patch, axis=1) > 60]
        near = [abs(_hue_of(pixel) - hues[number]) for pixel in vivid]
        found += sum(min(off, 1 - off) < 0.03 for off in near) > 20
    # One leg in six may stand behind the trunk.
    assert found >= len(robot.legs) - 1


def _hue(colour: str) -> float:
    return colorsys.rgb_to_hsv(*rgb(colour))[0]


def _hue_of(pixel: np.ndarray) -> float:
    return colorsys.rgb_to_hsv(*(pixel / 255))[0]


def test_uneven_ground_is_drawn(film, backend):
    terrain = film.source.scenario.replace(terrain={"kind": "stairs"})
    source = replace(film.source, scenario=terrain)
    stairs = replace(cut(film, 1), source=source)
    with painted(scene(stairs, film_camera(stairs, SIZE)), backend) as drawn:
        picture = np.array(next(drawn), dtype=float)
    assert picture.std() > 20


def test_a_video_of_a_recording_is_what_was_asked_for(recording, backend, tmp_path):
    told = []
    path = phasmid.save_video(
        recording,
        tmp_path / "new" / "a.gif",
        size=(320, 240),
        fps=10,
        progress=lambda done, count: told.append((done, count)),
    )
    with Image.open(path) as stored:
        assert stored.size == (320, 240)
        assert stored.n_frames == 4
    assert told == [(k, 4) for k in range(1, 5)]
    with pytest.raises(InvalidInput, match=r"a\.gif exists; nothing was written\."):
        phasmid.save_video(recording, path)


def test_a_planned_walk_can_be_filmed(backend, tmp_path):
    scenario = phasmid.load_scenario("paper").replace(duration=0.2)
    walk = phasmid.plan(scenario)
    analysis = phasmid.analyse(scenario, walk)
    path = phasmid.save_video(analysis, tmp_path / "a.gif", size=(320, 240), fps=10)
    with Image.open(path) as stored:
        assert stored.n_frames == 2


def test_a_process_that_breaks_off_is_told_in_one_sentence(told, backend, monkeypatch, tmp_path):
    script = tmp_path / "draw.py"
    script.write_text("raise MemoryError('no room for\\x1b pictures')")
    monkeypatch.setattr(painter, "SCRIPT", script)
    with pytest.raises(OutputError, match=r"could not be drawn: MemoryError: no room for. pict"):
        _first(told, backend)


def _first(told, backend):
    with painted(told, backend) as drawn:
        return next(drawn)
