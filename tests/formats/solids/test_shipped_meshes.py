"""The meshes that come with the package fit the robots' frames and need no CAD library."""

import numpy as np
import pytest

from phasmid.robot import JOINTS, load_robot, preset_names

WIDEST = 0.0235
"""Half a servo's depth with two sheets, and a horn's radius: nothing goes farther past an axis."""


def box(parts):
    """Lowest and highest corner, shape (2, 3)."""
    corners = np.concatenate([part.vertices for part in parts])
    return np.stack([corners.min(axis=0), corners.max(axis=0)])


def look(preset):
    found = load_robot(preset).appearance
    assert found is not None
    return found


@pytest.mark.parametrize("preset", preset_names())
def test_a_preset_s_meshes_fit_its_frames(preset):
    from importlib import resources

    robot, own = load_robot(preset), look(preset)
    file = resources.files("phasmid.robot") / "presets" / own.name
    assert len(file.read_bytes()) < 400_000
    assert set(own.parts) == {"body", *JOINTS}
    # A link of length L spans 0 to L along its x, and at each axis its bracket or servo goes past
    # it by less than WIDEST.
    leg = robot.legs[0]
    for joint, length in zip(JOINTS, leg.lengths, strict=True):
        (low, *_), (high, *_) = box(own.link(leg.name, joint))
        assert -WIDEST < low < -0.005
        if joint == "tibia":
            # Its end is the foot, which touches the ground there: to half the mesh's tolerance.
            assert high == pytest.approx(length, abs=0.2e-3)
        else:
            assert length + 0.005 < high < length + WIDEST
    # The body holds every hip between its plates, and the hip's axis goes through a servo.
    low, high = box(own.body)
    hips = robot.arrays.p_body_hip
    assert np.all(hips > low)
    assert np.all(hips < high)
    servos = [box((part,)) for part in own.body if part.name.endswith("servo")]
    assert len(servos) == len(robot.legs)
    for hip in hips:
        assert any(np.all(a[:2] < hip[:2]) and np.all(hip[:2] < b[:2]) for a, b in servos)
    # Faces look outwards. The divergence theorem: one sixth of the sum of a · (b × c) is the
    # volume, positive where corners run counter-clockwise seen from outside.
    for parts in own.parts.values():
        for part in parts:
            a, b, c = np.moveaxis(part.vertices[part.faces], 1, 0)
            assert np.sum(a * np.cross(b, c)) / 6 > 1e-9


def test_the_shipped_meshes_are_those_of_the_model():
    # make pages PAGE=meshes writes them; single precision of 0.2 m is 1.5e-8 m, and other
    # versions of the library may place corners on a round face elsewhere.
    pytest.importorskip("build123d")
    from phasmid.formats.solids import build, meshes

    own = meshes(build(load_robot("phantomx-paper")))
    for link, parts in look("phantomx-paper").parts.items():
        assert sorted(part.name for part in parts) == sorted(part.name for part in own[link])
        for part in parts:
            mate = next(p for p in own[link] if p.name == part.name)
            assert np.abs(box((part,)) - box((mate,))).max() < 0.3e-3
            assert np.abs(np.subtract(part.color, mate.color)).max() < 1 / 255
