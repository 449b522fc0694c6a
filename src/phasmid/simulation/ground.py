"""The ground in the engine."""

from __future__ import annotations

from typing import TYPE_CHECKING

from phasmid.scenario import Scenario

if TYPE_CHECKING:
    import mujoco

GROUND = "ground"
"""Name of what the feet stand on in the engine's model."""


def add_ground(spec: mujoco.MjSpec, scenario: Scenario) -> list[float]:
    """Put the ground into the engine's model.

    Returns:
        Friction coefficients as the engine takes them: sliding, torsional, rolling.
    """
    import mujoco

    friction = [scenario.terrain.friction, 0.005, 0.0001]
    spec.worldbody.add_geom(
        name=GROUND, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.1], friction=friction
    )
    return friction
