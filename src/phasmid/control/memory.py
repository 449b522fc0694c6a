"""Memory of the locomotion engine: records for compiled functions, and Python's views of them."""

from __future__ import annotations

import numpy as np

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


class Memory:
    """All that the engine's compiled functions work on.

    Args:
        model: The robot.
        parameters: The settings.

    Attributes:
        states: The state, and one to try in, shape (2,).
        references: The reference, and the same with the pending gait, shape (2,).
        models: The robot, shape (1,).
        parameter_records: The settings, shape (1,).
        state: View of the first of `states`.
        reference: View of the first of `references`.
        next_reference: View of the second of `references`.
        model: View of the first of `models`.
        parameters: The settings.
    """

    def __init__(self, model: Model, parameters: Parameters) -> None:
        legs = self._legs = model.leg_count
        self.parameters = parameters
        self.states, self.references = np.zeros(2, STATE), np.zeros(2, REFERENCE)
        self.models, self.parameter_records = np.zeros(1, MODEL), np.zeros(1, PARAMETERS)
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
        """Set all numbers of the state to zero, but the number of legs."""
        self.states[:] = np.zeros((), STATE)
        self.states["leg_count"] = self._legs


def clear(reference: Reference) -> None:
    """Make an reference one to stand, on level ground of which nothing is felt."""
    reference.velocity[:] = reference.pose[:] = reference.pose_correction[:] = reference.lift_phase[
        :
    ] = 0.0
    reference.duty_factor, reference.period, reference.sway, reference.gait_pending = (
        1.0,
        1.0,
        0.0,
        0,
    )
    reference.step_height = 0.0
    reference.used[:] = 1
    reference.contact[:] = -1
    reference.ground_normal[:] = 0.0, 0.0, 1.0
    reference.ground_height = 0.0
    reference.touchdown_height[:] = np.nan
    reference.foot_offset[:] = 0.0
    reference.foot_sag[:] = 0.0


def new_reference(legs: int) -> Reference:
    """An order to stand."""
    reference = view_of(np.zeros(1, REFERENCE), Reference, legs)
    clear(reference)
    return reference
