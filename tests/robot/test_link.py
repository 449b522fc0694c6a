"""Links that can and cannot exist, and variants of robots."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phasmid.errors import InvalidInput, InvalidRobot
from phasmid.robot import Link, load_robot, with_mass_model, with_mounts, with_payload
from support.general_robot import general_robot


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


SKEW = np.array([[1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize(
    ("mass", "com", "inertia", "said"),
    [
        (0.1, [0.05, 0, 0], np.diag([1e-5, -1e-5, 1e-5]), "are not all positive"),
        (0.1, [1e300, 0, 1e300], np.eye(3) * 1e-5, r"centre of mass lies 1\.4e\+300 m"),
        (0.01, [0.05, 0, 0], np.eye(3) * 1e300, "gyration radius"),
        (0.01, [0.05, 0, 0], np.eye(3) * 1e308, "gyration radius"),
        (0.01, [0.05, 0, 0], SKEW * 1e300, "is not symmetric"),
        (0.01, [0.05, 0, 0], SKEW * 1e308, "is not symmetric"),
        (1500.0, [0.05, 0, 0], np.eye(3), "masses above 200 kg are refused"),
    ],
)
def test_an_impossible_link_is_refused_without_a_warning(mass, com, inertia, said):
    with pytest.raises(InvalidRobot, match=said):
        Link("femur", 0.1, mass, np.array(com, dtype=float), inertia)


@pytest.mark.parametrize("robot", [load_robot("phantomx-ax"), general_robot()])
def test_a_load_moves_the_trunks_centre_and_adds_to_its_inertia(robot):
    loaded = with_payload(robot, 0.8)
    assert loaded.mass == pytest.approx(robot.mass + 0.8, rel=1e-14)
    # First and second moments about the body's origin are sums over both parts.
    load = np.array([0.0, 0.0, robot.body.size[2] / 2])

    def moments(body):
        m, c = body.mass, body.com
        return m * c, body.inertia + m * ((c @ c) * np.eye(3) - np.outer(c, c))

    first, second = moments(robot.body)
    assert moments(loaded.body)[0] == pytest.approx(first + 0.8 * load, abs=1e-14)
    own = 0.8 * ((load @ load) * np.eye(3) - np.outer(load, load))
    assert moments(loaded.body)[1] == pytest.approx(second + own, abs=1e-14)
    assert loaded.legs is robot.legs
    assert with_payload(robot, 0.0) is robot
    with pytest.raises(InvalidInput, match=r"payload is nan kg; it must be a finite number"):
        with_payload(robot, math.nan)
