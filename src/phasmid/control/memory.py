"""Memory of the locomotion engine: records for compiled functions, and Python's views of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from phasmid.control.estimation.state import ESTIMATOR_PARAMETERS, ESTIMATOR_STATE, MEASUREMENTS
from phasmid.control.feed_forward import state as feed_forward
from phasmid.control.records import fill, view_of
from phasmid.control.types import (
    MODEL,
    PARAMETERS,
    REFERENCE,
    STATE,
    Model,
    Parameters,
    Reference,
    State,
)


class Records(NamedTuple):
    """Records of N engines, on which compiled functions work.

    Attributes:
        states: State, and one for trials, shape (N, 2).
        references: Reference, and the same with the pending gait, shape (N, 2).
        models: Robot, shape (N, 1).
        parameters: Settings, shape (N, 1).
        estimators: State of the ground estimator, shape (N, 1).
        estimator_parameters: Its settings, shape (N, 1).
        measurements: Its sensor readings, shape (N, 1).
        feed_forwards: State of the feed-forward, shape (N, 1).
        feed_forward_parameters: Its settings, shape (N, 1).
        stages: 1 where ground is estimated, and where feed-forward is computed, shape (N, 2).
    """

    states: np.ndarray
    references: np.ndarray
    models: np.ndarray
    parameters: np.ndarray
    estimators: np.ndarray
    estimator_parameters: np.ndarray
    measurements: np.ndarray
    feed_forwards: np.ndarray
    feed_forward_parameters: np.ndarray
    stages: np.ndarray

    @classmethod
    def zeros(cls, count: int) -> Records:
        """Return records of zeros for a number of engines."""
        return cls(
            np.zeros((count, 2), STATE),
            np.zeros((count, 2), REFERENCE),
            np.zeros((count, 1), MODEL),
            np.zeros((count, 1), PARAMETERS),
            np.zeros((count, 1), ESTIMATOR_STATE),
            np.zeros((count, 1), ESTIMATOR_PARAMETERS),
            np.zeros((count, 1), MEASUREMENTS),
            np.zeros((count, 1), feed_forward.STATE),
            np.zeros((count, 1), feed_forward.PARAMETERS),
            np.zeros((count, 2), np.int64),
        )

    def of(self, index: int) -> Records:
        """Return the records of one engine, which share memory with these."""
        return Records(*(array[index] for array in self))


class Memory:
    """Records of one engine, and views of them for Python.

    Args:
        model: The robot.
        parameters: The settings.
        records: Records of one engine, as `Records.of` returns; None for new ones.

    Attributes:
        records: The records.
        states: State, and one for trials, shape (2,).
        references: Reference, and the same with the pending gait, shape (2,).
        models: The robot, shape (1,).
        parameter_records: The settings, shape (1,).
        state: View of the first of `states`.
        reference: View of the first of `references`.
        next_reference: View of the second of `references`.
        model: View of the first of `models`.
        parameters: The settings.
    """

    def __init__(
        self, model: Model, parameters: Parameters, records: Records | None = None
    ) -> None:
        legs = self._legs = model.leg_count
        self.parameters = parameters
        self.records = Records.zeros(1).of(0) if records is None else records
        self.states, self.references, self.models, self.parameter_records = self.records[:4]
        self.clear_state()
        self.state: State = view_of(self.states, State, legs)
        self.reference, self.next_reference = (
            view_of(self.references[i:], Reference, legs) for i in range(2)
        )
        self.model: Model = view_of(self.models, Model, legs)
        fill(self.model, model)
        fill(view_of(self.parameter_records, Parameters, legs), parameters)
        for reference in (self.reference, self.next_reference):
            clear(reference)

    def clear_state(self) -> None:
        """Set all numbers of the state to zero except the number of legs."""
        self.states[:] = np.zeros((), STATE)
        self.states["leg_count"] = self._legs


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
    reference.foot_offset[:] = 0.0
    reference.foot_sag[:] = 0.0


def new_reference(legs: int) -> Reference:
    """Return a reference that stands."""
    reference = view_of(np.zeros(1, REFERENCE), Reference, legs)
    clear(reference)
    return reference
