"""A driven robot stops at an edge of the ground, in physics."""

import json

import numpy as np
import pytest

from phasmid import Scenario, drive
from phasmid.experiment import Command

EDGE, DROP = 0.3, 0.25


@pytest.mark.parametrize(
    ("robot", "gait"),
    [("phantomx-mk4", "ripple"), ("octopod", "tetrapod")],
)
def test_a_robot_that_is_told_to_walk_over_an_edge_stops_there(robot, gait):
    """It stands level before the edge and says why; without it, it falls within these 20 s."""
    terrain = {
        "kind": "step",
        "rise_mm": -1000 * DROP,
        "terrain_start_mm": 1000 * EDGE,
        "planned_on": "level",
    }
    scenario = Scenario().replace(
        robot=robot,
        gait=gait,
        drive="ideal-servo",
        duration=20.0,
        period=1.3,
        record_interval_ms=20,
        terrain=terrain,
    )
    run = drive(scenario, None, Command(velocity=(0.06, 0.0, 0.0)))
    assert run.attrs["ending"] == "SHORT"
    x, y = np.moveaxis(run.body_orientation.values[:, 1:3], -1, 0)
    # Feet settle by a few millimetres, legs are some 250 mm apart.
    assert np.degrees(np.arccos(1 - 2 * (x**2 + y**2))).max() < 5.0
    # In the last second the body rests.
    ahead = run.body_position.values[:, 0]
    assert abs(ahead[-1] - ahead[-50]) < 1e-3
    assert 0.0 < ahead[-1] < EDGE
    # The feet stand before the edge, or a contact's rounding beyond it.
    assert run.foot_position.values[-1, :, 2].min() > -0.01
    told = [sentence for _, sentence in json.loads(run.attrs["events"])]
    assert any(sentence.startswith("goes no farther: leg ") for sentence in told)
