"""Memory of the locomotion engine: one record of all that compiled functions read and write."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from phasmid.control.estimation.state import EstimatorParameters, EstimatorState, Measurements
from phasmid.control.feed_forward.state import Parameters as FeedForwardParameters
from phasmid.control.feed_forward.state import State as FeedForwardState
from phasmid.control.records import record_of, view_of
from phasmid.control.types import REFERENCE, Model, Reference, State


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


MEMORY = record_of(Memory)


def clear(reference: Reference) -> None:
    """Set a reference to standing on level ground without contact sensing."""
    for array in (reference.velocity, reference.pose, reference.pose_correction):
        array[:] = 0.0
    reference.lift_phase[:] = reference.sway = 0.0
    reference.duty_factor = reference.period = 1.0
    reference.gait_pending = 0
    reference.step_height = 0.0
    reference.used[:] = 1
    reference.contact[:] = -1
    reference.ground_normal[:] = 0.0, 0.0, 1.0
    reference.ground_height = 0.0
    reference.touchdown_height[:] = np.nan
    reference.foot_sag[:] = 0.0


def new_reference(legs: int) -> Reference:
    """Return a reference that stands."""
    reference = view_of(np.zeros(1, REFERENCE), Reference, legs)
    clear(reference)
    return reference
