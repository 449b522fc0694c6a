"""Links that can and cannot exist."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phasmid.errors import InvalidRobot
from phasmid.robot import Link, load_robot, with_mass_model, with_mounts
from phasmid.robot.link import solid_box


@given(
    st.lists(
        st.tuples(*[st.floats(-0.05, 0.05)] * 3, st.floats(0.001, 0.1)), min_size=4, max_size=9
    )
)
def test_any_cloud_of_point_masses_is_a_link_or_is_flat(points):
    # The inertia of real matter satisfies the triangle inequality by construction; it fails to be
    # positive only where the points lie on a line, and has a tiny radius only where they coincide.
    p, m = np.array([q[:3] for q in points]), np.array([q[3] for q in points])
    com = m @ p / m.sum()
    d = p - com
    inertia = sum(w * (v @ v * np.eye(3) - np.outer(v, v)) for v, w in zip(d, m, strict=True))
    moments = np.linalg.eigvalsh(inertia)
    if moments[0] < 1e-9 * m.sum() or np.sqrt(moments[2] / m.sum()) < 0.003:
        return
    Link("femur", 0.1, float(m.sum()), com + np.array([0.05, 0, 0]), inertia)


def test_a_link_cannot_be_changed():
    link = load_robot("phantomx-paper").legs[0].femur
    with pytest.raises(FrozenInstanceError):
        link.mass = 1.0
    with pytest.raises(ValueError, match="read-only"):
        link.com[0] = 1.0


def test_an_inertia_with_a_negative_moment_is_refused():
    with pytest.raises(InvalidRobot, match="are not all positive"):
        Link("femur", 0.1, 0.1, np.array([0.05, 0, 0]), np.diag([1e-5, -1e-5, 1e-5]))


def test_a_centre_of_mass_beyond_any_measure_is_refused_without_a_warning():
    com = np.array([1e300, 0.0, 1e300])
    with pytest.raises(InvalidRobot, match=r"centre of mass lies 1\.4e\+300 m"):
        Link("femur", 0.1, 0.1, com, np.eye(3) * 1e-5)
    body = load_robot("phantomx-paper").body
    with pytest.raises(InvalidRobot, match=r"centre of mass lies 1\.4e\+300 m"):
        replace(body, com=com)


@pytest.mark.parametrize("entry", [1e300, 1e308])
def test_an_inertia_beyond_any_measure_is_refused_without_a_warning(entry):
    skew = np.eye(3) * entry
    skew[0, 1], skew[1, 0] = entry, -entry
    for inertia in (skew, np.eye(3) * entry):
        with pytest.raises(InvalidRobot, match=r"is not symmetric|gyration radius"):
            Link("femur", 0.1, 0.01, np.array([0.05, 0, 0]), inertia)


def test_a_box_beyond_any_measure_has_no_inertia_and_warns_of_nothing():
    assert np.isnan(solid_box((0.1, 1e300, 1e300), 0.0)).any()


def test_a_mass_in_grams_taken_for_kilograms_is_refused():
    with pytest.raises(InvalidRobot, match="masses above 200 kg are refused"):
        Link("femur", 0.1, 1500.0, np.array([0.05, 0, 0]), np.eye(3))


def test_mid_length_puts_the_mass_where_the_printed_equation_has_it():
    robot = with_mass_model(load_robot("phantomx-paper"), "mid-length")
    for leg in robot.legs:
        for link in leg.links:
            assert link.com.tolist() == [link.length / 2, 0, 0]
            assert np.count_nonzero(link.inertia - np.diag(np.diag(link.inertia))) == 0
    assert robot.mass == load_robot("phantomx-paper").mass


def test_perpendicular_mounts_turn_every_leg_square_to_the_walk():
    robot = with_mounts(load_robot("phantomx-paper"), "perpendicular")
    assert np.degrees([leg.mount_yaw for leg in robot.legs]) == pytest.approx(
        [-90, -90, -90, 90, 90, 90]
    )
