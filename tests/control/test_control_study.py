"""A few cases of the studies of docs/control.md keep the limits of the page."""

import sys
from pathlib import Path

import pytest

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")
sys.path.append(BENCHMARKS)

from control_study import ground, sequences, velocity  # noqa: E402, needs the path above

# Scripts there have the names of packages of tests.
sys.path.remove(BENCHMARKS)

FEW = [
    ("tripod", "0°", (1.0, 0.0, 0.0), 0.9),
    ("tripod", "turn left", (0.0, 0.0, 1.0), 0.5),
]


@pytest.mark.parametrize(("gait", "way", "direction", "share"), FEW)
def test_ideal_servos_with_torque_keep_the_commanded_velocity(gait, way, direction, share):
    """The goals of the page: |mean - commanded| <= 3 % of it, slip under 1 mm a step."""
    found = velocity.measure(gait, way, direction, share, "ideal, with torque")
    assert found["ending"] == "COMPLETED"
    assert found["error"] < velocity.ERROR
    assert found["slip_mean"] < velocity.SLIP


def test_random_commands_do_no_harm_in_either_world():
    """No fall, no joint beyond speed or limit, support margin never negative, comes to rest."""
    for world, duration in (("forces-free", 15.0), ("ideal-servo", 11.0)):
        assert sequences.measure(world, 0, duration)["wrong"] == [], world


def test_a_foot_that_cannot_go_on_stands_on_what_it_has_met(monkeypatch):
    """On this ground a robot once stayed for good where a foot had met a block as it rose."""
    monkeypatch.setattr(ground, "DRIVE", "servo")
    assert ground.measure("blocks", 60, "ground sensing and dynamics", 4)["passed"]
