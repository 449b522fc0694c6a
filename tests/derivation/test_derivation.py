"""The leg's equations of motion in symbols."""

from __future__ import annotations

import subprocess
import sys

import pytest
import sympy as sp

from phasmid import derivation
from phasmid.derivation import SymbolicMatrices
from phasmid.derivation.__main__ import main
from phasmid.derivation.symbolic import ANGLES, PRINTED_ANGLES, normal_form

# Normal forms are exact: equal functions have equal ones, so nothing here needs a tolerance.


@pytest.fixture(scope="module")
def derived() -> SymbolicMatrices:
    """Equations by the recursion of Newton and Euler, for any mass distribution."""
    return derivation.newton_euler()


def test_newton_euler_and_lagrange_give_the_same_equations(derived: SymbolicMatrices) -> None:
    # Forces and moments against energies: every entry for every mass distribution.
    for newton_euler, lagrange in zip(derived, derivation.lagrange(), strict=True):
        assert newton_euler == lagrange
    assert sum(entry != 0 for part in derived for entry in part) == 9 + 4 + 6 + 2


def test_the_papers_form_is_the_derived_equation(derived: SymbolicMatrices) -> None:
    mid_length = derivation.mid_length(derived)
    theta2, theta3 = PRINTED_ANGLES
    signs = {theta2: ANGLES[1], theta3: -ANGLES[2]}
    for grouped, part in zip(derivation.paper_form(mid_length), mid_length, strict=True):
        assert normal_form(grouped.subs(signs).applyfunc(sp.expand_trig)) == part


def test_it_is_printed_as_the_paper_groups_it(capsys: pytest.CaptureFixture[str]) -> None:
    # The printed m33, b23, c32 and third of G, which need no correction, then three that do.
    assert main() == 0
    text = capsys.readouterr().out
    assert "Newton-Euler and Lagrange give the same matrices" in text
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
        assert f"\n{line}\n" in text


def test_without_sympy_one_sentence_says_what_to_install() -> None:
    code = (
        "import runpy, sys; sys.modules['sympy'] = None\n"
        "runpy.run_module('phasmid.derivation', run_name='__main__')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    said = (
        "phasmid: the derivation needs sympy, which is not installed.\n  try  pip install sympy\n"
    )
    assert (done.returncode, done.stdout, done.stderr) == (2, "", said)
