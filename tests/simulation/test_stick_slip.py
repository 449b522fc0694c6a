"""The contact law of the paper's library, piece by piece against its definition (MODEL, Figs 9-11):
stiffness 1e4 N/m, damping 1e2 N·s/m while sinking further, friction 0.7 and 0.5 at 1e-3 m/s.
"""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from phasmid.scenario.contact import ContactTable
from phasmid.simulation.simscape.trunk import friction_coefficient, normal_force

K, B = 1e4, 1e2
STATIC, KINETIC, THRESHOLD = 0.7, 0.5, 1e-3

depths = st.floats(-0.01, 0.01)
speeds = st.floats(-2.0, 2.0)


def test_a_point_that_sinks_further_is_a_spring_and_a_damper():
    # K 0.2 mm + B 10 mm/s = 2 N + 1 N; one rounding of each product.
    assert normal_force(2e-4, 0.01, K, B) == pytest.approx(3.0, rel=1e-15)


@pytest.mark.parametrize("sinking", [0.0, -0.01, -1.0])
def test_a_point_at_rest_or_leaving_is_a_spring_alone(sinking):
    assert normal_force(2e-4, sinking, K, B) == 2.0


@pytest.mark.parametrize("depth", [0.0, -1e-9, -0.1])
def test_a_point_over_the_ground_feels_nothing(depth):
    assert normal_force(depth, 1.0, K, B) == 0.0


@given(depths, speeds)
def test_the_ground_never_pulls(depth, sinking):
    assert normal_force(depth, sinking, K, B) >= 0.0


@given(depths, st.floats(0.0, 0.01), speeds)
def test_a_deeper_point_is_pushed_harder(depth, more, sinking):
    assert normal_force(depth + more, sinking, K, B) >= normal_force(depth, sinking, K, B)


@pytest.mark.parametrize(
    ("thresholds", "coefficient"),
    [(0, 0.0), (0.5, 0.35), (1, 0.7), (1.25, 0.6), (1.5, 0.5), (2, 0.5), (1000, 0.5)],
)
def test_friction_rises_to_static_falls_to_kinetic_and_stays(thresholds, coefficient):
    # Linear between (0, 0), (1, 0.7) and (1.5, 0.5) thresholds; rounding only.
    found = friction_coefficient(thresholds * THRESHOLD, STATIC, KINETIC, THRESHOLD)
    assert found == pytest.approx(coefficient, abs=1e-12)


@given(st.floats(0.0, 2.0))
def test_friction_stays_within_its_cone(speed):
    found = friction_coefficient(speed, STATIC, KINETIC, THRESHOLD)
    assert 0.0 <= found <= STATIC


@pytest.mark.parametrize("thresholds", [1.0, 1.5])
def test_friction_makes_no_jump(thresholds):
    # The steepest piece is 0.7 a threshold: 1e-9 of one to either side is 2 x 0.7e-9 at most.
    below, above = (
        friction_coefficient((thresholds + off) * THRESHOLD, STATIC, KINETIC, THRESHOLD)
        for off in (-1e-9, 1e-9)
    )
    assert abs(above - below) < 1.5e-9


def test_each_law_has_its_own_damping():
    # 30 N·s/m both ways in the engine, 100 one way as the paper's library has it.
    assert ContactTable().law_damping == 30.0
    assert ContactTable(contact_law="simscape").law_damping == 100.0
    assert ContactTable(contact_law="simscape", damping=50.0).law_damping == 50.0
