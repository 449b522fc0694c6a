"""Two descriptions that people use: the judge tells the sound one from the other."""

from pathlib import Path

import numpy as np
import pytest

from phasmid.formats import ImportOptions, Severity, robot_from_tree
from phasmid.formats.urdf_in import read_urdf
from phasmid.robot import load_robot

DATA = Path(__file__).parents[3] / "shared" / "data"
SOUND = DATA / "interbotix_xshexapod_descriptions" / "urdf" / "pxmark4.urdf"
UNSOUND = DATA / "phantomx_description" / "urdf" / "phantomx.urdf"

pytestmark = pytest.mark.skipif(
    not (SOUND.is_file() and UNSOUND.is_file()), reason="the descriptions are not at hand"
)


@pytest.fixture(scope="module")
def unsound():
    """The description whose inertias no body can have."""
    return read_urdf(UNSOUND)


@pytest.fixture(scope="module")
def sound():
    """What comes of the other one, with the servo that its maker builds in."""
    return robot_from_tree(read_urdf(SOUND), ImportOptions(servo_model="XL430-W250"))


def of(imported, severity):
    return [f.sentence for f in imported.findings if f.severity is severity]


def test_the_sound_description_has_no_fault(sound):
    assert sound.robot is not None
    assert not of(sound, Severity.IMPOSSIBLE)
    assert not of(sound, Severity.SUSPECT)


def test_the_sound_description_is_the_preset_that_was_made_of_it_by_hand(sound):
    """Within the preset's printed digits: nanometres, 1e-6 of a mass, 1e-6 degrees."""
    made, preset = sound.robot, load_robot("phantomx-mk4")
    assert made.leg_names == preset.leg_names
    assert made.servo == preset.servo
    a, b = made.arrays, preset.arrays
    np.testing.assert_allclose(a.lengths, b.lengths, rtol=0, atol=1e-11)
    np.testing.assert_allclose(a.mass, b.mass, rtol=1e-12)
    np.testing.assert_allclose(a.com, b.com, rtol=0, atol=6e-11)
    np.testing.assert_allclose(a.inertia, b.inertia, rtol=0, atol=6e-13)
    np.testing.assert_allclose(a.p_body_hip, b.p_body_hip, rtol=0, atol=1e-12)
    np.testing.assert_allclose(a.R_body_hip, b.R_body_hip, rtol=0, atol=1e-12)
    np.testing.assert_allclose(a.neutral_foot, b.neutral_foot, rtol=0, atol=1e-12)
    np.testing.assert_allclose(a.joint_limits, b.joint_limits, rtol=0, atol=1e-8)
    for leg, other in zip(made.legs, preset.legs, strict=True):
        assert leg.femur_bend == pytest.approx(other.femur_bend, abs=1e-9)
        assert leg.tibia_bend == pytest.approx(other.tibia_bend, abs=1e-9)
    assert made.body.mass == pytest.approx(preset.body.mass, rel=1e-12)
    np.testing.assert_allclose(made.body.com, preset.body.com, rtol=0, atol=1e-12)
    np.testing.assert_allclose(made.body.inertia, preset.body.inertia, rtol=1e-9)
    # Its mesh, in whole millimetres: how far it goes forward, aside and down.
    low, high = made.body.box
    reach = [max(-low[0], high[0]), max(-low[1], high[1]), -low[2]]
    np.testing.assert_allclose(reach, preset.body.size / 2, rtol=0, atol=1e-3)


def test_the_unsound_description_is_refused_with_each_fault_by_name(unsound):
    imported = robot_from_tree(unsound)
    assert imported.robot is None
    impossible, suspect = of(imported, Severity.IMPOSSIBLE), of(imported, Severity.SUSPECT)
    assert impossible[0] == (
        "link MP_BODY: inertia 6.5 kg m^2 gives a gyration radius of 2 600 mm for a 273 mm body; "
        "it must lie between 5.5 and 410 mm."
    )
    assert any(
        text.startswith("links thigh_rf, tibia_rf, thigh_rm and 9 more: principal moments 0.001138")
        for text in impossible
    )
    assert any("body.STL" in text for text in suspect)
    shown = "shows its collision shape, as no visual one was read."
    assert any(shown in finding.what for finding in imported.findings)
    assert (
        "legs 1, 2, 3 and 3 more: coxa, femur and tibia all have 24.36 g; unlike parts must have "
        "masses of their own."
    ) in suspect
    assert any(text.startswith("legs 1, 2, 3 and 3 more: no foot in the file;") for text in suspect)
