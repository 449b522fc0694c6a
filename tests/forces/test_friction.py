"""What friction a distribution of forces asks for."""

import numpy as np
import pytest

from phasmid.forces import Contacts, friction_statistics


def feet(count):
    return np.zeros((count, 3)) + np.arange(count)[:, None]


def test_demand_and_margin_follow_from_normal_and_tangential_force():
    # Forces (3, 4, 10), (0, 0, 10): tangential 5 and 0; demand 5/10; margin 0.7 * 10 - 5.
    contacts = Contacts(feet(3), np.array([True, True, False]), friction=0.7)
    force = np.array([[3.0, 4, 10], [0, 0, 10], [0, 0, 0]])
    found = friction_statistics(contacts, force)
    assert found.normal_force[:2] == pytest.approx([10, 10])
    assert found.tangential_force[:2] == pytest.approx([5, 0])
    assert found.demand[:2] == pytest.approx([0.5, 0])
    assert found.margin[:2] == pytest.approx([2, 7])
    assert np.isnan(found.demand[2])
    assert np.isnan(found.margin[2])


def test_a_vertical_force_on_a_slope_asks_for_its_tangent():
    slope = np.radians(25)
    contacts = Contacts(feet(1), np.ones(1), np.array([0, -np.sin(slope), np.cos(slope)]))
    found = friction_statistics(contacts, np.array([[0, 0, 10.0]]))
    assert found.demand[0] == pytest.approx(np.tan(slope), abs=1e-12)
    assert found.normal_force[0] == pytest.approx(10 * np.cos(slope), abs=1e-12)


def test_a_foot_that_pulls_needs_more_friction_than_there_is():
    contacts = Contacts(feet(2), np.ones(2))
    found = friction_statistics(contacts, np.array([[0, 0, -1.0], [1, 0, 0]]))
    assert (found.demand == np.inf).all()
    assert found.margin == pytest.approx([-0.7, -1])


def test_the_summary_counts_standing_feet_only():
    share = np.array([[1.0, 1, 0], [1, 0, 1]])
    contacts = Contacts(np.tile(feet(3), (2, 1, 1)), share, friction=0.5)
    force = np.zeros((2, 3, 3))
    force[..., 2] = [[10.0, 20, 0], [30, 0, 40]]
    force[..., 0] = [[1.0, 4, 0], [9, 0, 16]]
    # Demands 0.1, 0.2, 0.3, 0.4; margins 4, 6, 6, 4.
    summary = friction_statistics(contacts, force).summary()
    expected = {"mean": 0.25, "min": 0.1, "max": 0.4, "p5": 0.1, "p95": 0.4}
    assert summary["demand"] == pytest.approx(expected)
    assert summary["margin"] == pytest.approx({"mean": 5, "min": 4, "max": 6, "p5": 4, "p95": 6})
    assert summary["normal_force"]["mean"] == pytest.approx(25)
