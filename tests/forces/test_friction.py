"""What friction a distribution of forces asks for."""

import numpy as np
import pytest

from phasmid.forces import Contacts, friction_statistics


def feet(count):
    return np.zeros((count, 3)) + np.arange(count)[:, None]


def test_demand_and_margin_follow_from_normal_and_tangential_force():
    # Forces (3, 4, 10), (0, 0, 10), one that pulls and none in the air; demand 5/10, margin 7 - 5.
    contacts = Contacts(feet(4), np.array([True, True, True, False]), friction=0.7)
    force = np.array([[3.0, 4, 10], [0, 0, 10], [0, 0, -1], [5, 0, 0]])
    found = friction_statistics(contacts, force)
    assert found.normal_force == pytest.approx([10, 10, -1, np.nan], nan_ok=True)
    assert found.tangential_force == pytest.approx([5, 0, 0, np.nan], nan_ok=True)
    assert found.demand == pytest.approx([0.5, 0, np.inf, np.nan], nan_ok=True)
    assert found.margin == pytest.approx([2, 7, -0.7, np.nan], nan_ok=True)


def test_a_vertical_force_on_a_slope_needs_its_tangent():
    slope = np.radians(25)
    contacts = Contacts(feet(1), np.ones(1), np.array([0, -np.sin(slope), np.cos(slope)]))
    found = friction_statistics(contacts, np.array([[0, 0, 10.0]]))
    assert found.demand[0] == pytest.approx(np.tan(slope), abs=1e-12)


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
