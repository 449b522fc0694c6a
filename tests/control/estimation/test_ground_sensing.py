"""The engine senses the ground in simulation: slopes are levelled, ground off the plan is met."""

import numpy as np
import pytest

from phasmid.control import Command
from phasmid.control.engine import LocomotionEngine
from phasmid.control.estimation import EstimatorSettings
from phasmid.robot import load_robot
from phasmid.scenario import Scenario
from phasmid.simulation.drive import drive


def tilt(terrain, velocity, **settings):
    """Angle of the body's z off the vertical in 3 s on ground that the plan does not know [rad]."""
    scenario = Scenario().replace(
        robot="phantomx-mk4", drive="ideal-servo", duration=3.0, record_interval=0.01
    )
    scenario = scenario.replace(terrain=terrain | {"planned_on": "level"})
    settings = {"dynamics": "none", "step_height": 0.05, "period": 1.3} | settings
    engine = LocomotionEngine(load_robot("phantomx-mk4"), **settings)
    recording = drive(scenario, engine, Command(velocity=(velocity, 0.0, 0.0)))
    _, x, y, _ = recording["body_orientation"].values.T
    return np.arccos(np.clip(1 - 2 * (x * x + y * y), -1.0, 1.0))


def test_levelling_takes_away_nine_tenths_of_a_slope():
    """Of 10 deg one at most is left."""
    slope = {"kind": "slope", "slope_deg": 10}
    angle = np.degrees(tilt(slope, 0.0, estimator=EstimatorSettings(level=1.0)))
    assert angle[0] == pytest.approx(10.0, abs=0.2)
    assert angle[-20:].max() < 1.0


def test_blocks_tilt_a_body_that_senses_them_less():
    """Steps of up to 40 mm of which the plan knows nothing."""
    blocks = {"kind": "blocks", "block_height_mm": 40, "block_size_mm": 100, "terrain_start": 0.12}
    assert 1.5 * tilt(blocks, 0.1).max() < tilt(blocks, 0.1, ground_sensing=False).max()
