"""The leg's equations of motion in symbols."""

import pytest
import sympy as sp

from pages.derivation import (
    ANGLES,
    PRINTED_ANGLES,
    lagrange,
    mid_length,
    newton_euler,
    normal_form,
    paper_form,
    paper_text,
)

# Normal forms are exact: equal functions have equal ones, so nothing here needs a tolerance.


@pytest.fixture(scope="module")
def derived():
    """Equations by the recursion of Newton and Euler, for any mass distribution."""
    return newton_euler()


def test_newton_euler_and_lagrange_give_the_same_equations(derived):
    # Forces and moments against energies: every entry for every mass distribution.
    for ours, energies in zip(derived, lagrange(), strict=True):
        assert ours == energies
    assert sum(entry != 0 for part in derived for entry in part) == 9 + 4 + 6 + 2


def test_the_papers_form_is_the_derived_equation(derived):
    special = mid_length(derived)
    theta2, theta3 = PRINTED_ANGLES
    signs = {theta2: ANGLES[1], theta3: -ANGLES[2]}
    for grouped, part in zip(paper_form(special), special, strict=True):
        assert normal_form(grouped.subs(signs).applyfunc(sp.expand_trig)) == part


def test_it_is_printed_as_the_paper_groups_it(derived):
    # The printed m33, b23, c32 and third of G, which need no correction, then three that do.
    lines = paper_text(mid_length(derived)).splitlines()
    for line in (
        "m33 = I_zz3 + L3² m3/4",
        "b23 = sin(θ3) L2 L3 m3",
        "c32 = -sin(θ3) L2 L3 m3/2",
        "g3 = cos(θ2 - θ3) L3 g m3/2",
        "m22 = I_zz2 + I_zz3 + L2² (m2/4 + m3) + L3² m3/4 + cos(θ3) L2 L3 m3",
        "c23 = sin(θ3) L2 L3 m3/2",
        "c31 = sin(2θ2 - 2θ3)/2 (-I_xx3 + I_yy3 + L3² m3/4) - sin(θ3) L2 L3 m3/4 "
        "+ sin(θ2 - θ3) L1 L3 m3/2 + sin(2θ2 - θ3) L2 L3 m3/4",
    ):
        assert line in lines
