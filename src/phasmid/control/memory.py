"""Memory of the locomotion engine: one record of all that compiled functions read and write."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from phasmid.control.estimation.state import EstimatorParameters, EstimatorState, Measurements
from phasmid.control.feed_forward.state import Parameters as FeedForwardParameters
from phasmid.control.feed_forward.state import State as FeedForwardState
from phasmid.control.records import record_of
from phasmid.control.terrain_map import TerrainMap
from phasmid.control.terrain_mapping import BodyPoses
from phasmid.control.types import Model, Reference, State


@dataclass(eq=False)
class Memory:
    """Memory of one engine."""

    states: Annotated[list[State], "2"]  # State, and one for trials
    references: Annotated[list[Reference], "2"]  # Reference, and the same with the pending gait
    model: Model  # Robot and settings
    estimator: EstimatorState  # State of the ground estimator
    estimator_parameters: EstimatorParameters
    measurements: Measurements  # Its sensor readings
    feed_forward: FeedForwardState  # State of the feed-forward
    feed_forward_parameters: FeedForwardParameters
    estimates_ground: int  # 1 where ground is estimated
    computes_torque: int  # 1 where feed-forward is computed
    terrain_map: TerrainMap  # Heights around the robot
    body_poses: BodyPoses  # At which depth readings are made
    maps_terrain: int  # `TerrainSource` of the map


MEMORY = record_of(Memory)
