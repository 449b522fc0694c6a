"""Both backends, and robots to run them on."""

from __future__ import annotations

import numpy as np
import pytest

from general_robot import general_robot
from phasmid.batch import compiled
from phasmid.robot import Robot, load_robot, preset_names


@pytest.fixture(params=[*preset_names(), "general"])
def robot(request: pytest.FixtureRequest) -> Robot:
    """Every preset, and a robot without any symmetry."""
    return general_robot() if request.param == "general" else load_robot(request.param)


@pytest.fixture(params=["numba", "NumPy"])
def backend(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Machine code, and NumPy as where numba is not installed."""
    if request.param == "NumPy":
        monkeypatch.setattr(compiled, "numba", lambda: None)
    return request.param


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(3)
