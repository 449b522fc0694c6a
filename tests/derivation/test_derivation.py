"""The leg's equations of motion in symbols."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from typing import Any

import pytest
import sympy as sp

from phasmid import derivation
from phasmid.derivation import SymbolicMatrices
from phasmid.derivation.__main__ import main
from phasmid.derivation.symbolic import ANGLES, GRAVITY, LENGTHS, LINKS, PRINTED_ANGLES, normal_form
from phasmid.errors import PhasmidError

# Normal forms are exact: equal functions have equal ones, so nothing here needs a tolerance.


def _single(expression: sp.Expr) -> sp.Expr:
    return normal_form(sp.Matrix([expression]))[0]


def test_newton_euler_and_lagrange_give_the_same_equations(derived: SymbolicMatrices) -> None:
    # Forces and moments against energies: every entry for every mass distribution.
    for newton_euler, lagrange in zip(derived, derivation.lagrange(), strict=True):
        assert newton_euler == lagrange
    assert sum(entry != 0 for part in derived for entry in part) == 9 + 4 + 6 + 2


def test_two_ways_of_writing_one_function_have_one_normal_form() -> None:
    c, s, x = sp.cos(ANGLES[1]), sp.sin(ANGLES[1]), LENGTHS[0]
    assert _single(x * (c**2 + s**2) ** 3 - x) == 0
    assert _single(s**3 * c) == _single(s * c - s * c**3)
    assert _single(s**2) != _single(s)


def test_the_tibia_by_itself_is_a_physical_pendulum(derived: SymbolicMatrices) -> None:
    # About its own axis: inertia I_zz + m (x² + y²), weight m g times the horizontal lever.
    link = LINKS[2]
    x, y, _ = link.com
    elevation = ANGLES[1] + ANGLES[2]
    lever = sp.expand_trig(x * sp.cos(elevation) - y * sp.sin(elevation))
    assert derived.M[2, 2] == _single(link.inertia[2, 2] + link.mass * (x**2 + y**2))
    assert derived.G[2] == _single(link.mass * GRAVITY * sp.expand(lever))


def test_the_papers_form_is_the_derived_equation(mid_length: SymbolicMatrices) -> None:
    theta2, theta3 = PRINTED_ANGLES
    signs = {theta2: ANGLES[1], theta3: -ANGLES[2]}
    for grouped, part in zip(derivation.paper_form(mid_length), mid_length, strict=True):
        assert normal_form(grouped.subs(signs).applyfunc(sp.expand_trig)) == part


def test_it_is_printed_as_the_paper_groups_it(capsys: pytest.CaptureFixture[str]) -> None:
    # The printed m33, b23, c32 and third of G, which need no correction, then three that do.
    assert main([]) == 0
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


def test_without_sympy_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def find_spec(name: str) -> Any:
        return None if name == "sympy" else importlib.util.find_spec(name)

    monkeypatch.setattr(derivation, "find_spec", find_spec)
    with pytest.raises(PhasmidError, match="the derivation needs sympy, which is not installed"):
        derivation.lagrange  # noqa: B018
    assert main([]) == 2
    assert "try  pip install sympy\n" in capsys.readouterr().err


def test_importing_it_loads_no_sympy() -> None:
    code = "import sys, phasmid.derivation; sys.exit('sympy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
