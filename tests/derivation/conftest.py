"""The derivations, made once."""

from __future__ import annotations

import pytest

from phasmid import derivation
from phasmid.derivation import SymbolicMatrices


@pytest.fixture(scope="session")
def derived() -> SymbolicMatrices:
    """By Newton and Euler's recursion, for any mass distribution."""
    return derivation.newton_euler()


@pytest.fixture(scope="session")
def mid_length(derived: SymbolicMatrices) -> SymbolicMatrices:
    """The same for the mass distribution that Eq. 10 assumes."""
    return derivation.mid_length(derived)
