"""Where the robot stands before it walks."""

from __future__ import annotations

import math

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.motion import Motion, SampledMotion
from phasmid.scenario import Scenario

DEEPEST_START = 0.002
"""How far a foot may start below the terrain; so far its contact gently pushes it out [m]."""


def raised(scenario: Scenario, start: SampledMotion) -> float:
    """How much higher than planned the robot starts [m].

    Args:
        scenario: Tells the height of the start.
        start: The walk, sampled at its start.
    """
    height = scenario.simulation.start_height
    return 0.0 if height is None else height - float(start.trunk.position[0, 2])


def check_start(scenario: Scenario, walk: Motion) -> None:
    """Refuse a start in which a foot is inside the ground.

    Raises:
        InvalidInput: With the deepest foot, and the height at which none would be.
    """
    start = walk.sample(np.zeros(1))
    x, y, z = np.moveaxis(start.foot_position[0], -1, 0)
    depth = scenario.load_terrain().height(x, y) - z - raised(scenario, start)
    leg = int(np.argmax(depth))
    if depth[leg] > DEEPEST_START:
        height = float(start.trunk.position[0, 2]) + raised(scenario, start) + depth[leg]
        enough = math.ceil(1000 * height - 1e-6)
        raise InvalidInput(
            f"{walk.robot.legs[leg].name} foot starts {1000 * depth[leg]:.0f} mm below the "
            "terrain.",
            where="terrain",
            hint=f"raise start height to {enough / 1000:.3f} m (start_height_mm = {enough})",
        )
