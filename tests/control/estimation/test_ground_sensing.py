"""The engine senses the ground in simulation: slopes are levelled, ground off the plan is met."""

import numpy as np
import pytest

from phasmid.control.engine import LocomotionEngine
from phasmid.control.estimation import EstimatorSettings
from phasmid.experiment import Command
from phasmid.robot import load_robot
from phasmid.scenario import Scenario
from phasmid.simulation.drive import drive

LEVEL = EstimatorSettings(level=1.0)
ROBOT = load_robot("phantomx-mk4")


def walked(terrain, *, duration, velocity=0.06, engine=None, **settings):
    scenario = Scenario().replace(
        robot="phantomx-mk4",
        duration=duration,
        terrain=terrain | {"planned_on": "level"},
        simulation={
            # Prescribed joints need level ground, or a plan that knows it.
            "drive": "prescribed" if terrain["kind"] == "flat" else "ideal-servo",
            "record_interval": 0.01,
        },
    )
    settings = {"dynamics": "none", "step_height": 0.05, "period": 1.3} | settings
    engine = LocomotionEngine(ROBOT, **settings)
    return drive(scenario, engine, Command(velocity=(velocity, 0.0, 0.0))), engine


def tilt(recording):
    """Angle of the body's z off the vertical [rad]."""
    _, x, y, _ = recording["body_orientation"].values.T
    return np.arccos(np.clip(1 - 2 * (x * x + y * y), -1.0, 1.0))


def test_levelling_takes_away_nine_tenths_of_a_slope():
    """Of 10 deg one at most is left: prescribed joints do not give way, the contact does."""
    recording, _ = walked(
        {"kind": "slope", "slope_deg": 10}, duration=3.0, velocity=0.0, estimator=LEVEL
    )
    angle = np.degrees(tilt(recording))
    assert angle[0] == pytest.approx(10.0, abs=0.2)
    assert angle[-20:].max() < 1.0


def test_blocks_tilt_a_body_that_senses_them_less_than_half_as_much():
    """Steps of up to 40 mm of which the plan knows nothing."""
    blocks = {"kind": "blocks", "block_height_mm": 40, "block_size_mm": 100, "terrain_start": 0.12}
    sensed, _ = walked(blocks, duration=5.0, estimator=LEVEL)
    blind, _ = walked(blocks, duration=5.0, ground_sensing=False)
    assert 2 * tilt(sensed).max() < tilt(blind).max()
