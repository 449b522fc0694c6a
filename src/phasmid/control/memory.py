"""Memory of the locomotion engine: records for compiled functions, and Python's views of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from phasmid.control.records import fill, view_of
from phasmid.control.state import MODEL, ORDER, STATE, TUNING, Model, Order, State, Tuning


class Memory:
    """All that the engine's compiled functions work on.

    Args:
        model: The robot.
        tuning: The settings.

    Attributes:
        states: The state, and one to try in, shape (2,).
        orders: What is to be done, and the same with the gait that is wanted, shape (2,).
        models: The robot, shape (1,).
        tunings: The settings, shape (1,).
        state: View of the first of `states`.
        order: View of the first of `orders`.
        wanted: View of the second of `orders`.
        model: View of the first of `models`.
        tuning: The settings.
    """

    def __init__(self, model: Model, tuning: Tuning) -> None:
        legs = self._legs = model.leg_count
        self.tuning = tuning
        self.states, self.orders = np.zeros(2, STATE), np.zeros(2, ORDER)
        self.models, self.tunings = np.zeros(1, MODEL), np.zeros(1, TUNING)
        self.clear_state()
        self.state: State = view_of(self.states[0], State, legs)
        self.order, self.wanted = (view_of(order, Order, legs) for order in self.orders)
        self.model: Model = view_of(self.models[0], Model, legs)
        fill(self.model, model)
        fill(view_of(self.tunings[0], Tuning, legs), tuning)
        for order in (self.order, self.wanted):
            clear(order)

    def clear_state(self) -> None:
        """Set all numbers of the state to zero, but the number of legs."""
        self.states[:] = np.zeros((), STATE)
        self.states["leg_count"] = self._legs


def clear(order: Order) -> None:
    """Make an order one to stand, on level ground of which nothing is felt."""
    order.velocity[:] = order.pose[:] = order.correction[:] = order.offsets[:] = 0.0
    order.gait[:] = 1.0, 1.0, 0.0, 0.0
    order.step[:] = 0.0
    order.used[:] = 1
    order.touch[:] = -1
    order.plane[:] = 0.0, 0.0, 1.0, 0.0
    order.landing[:] = np.nan
    order.foot_offset[:] = 0.0
    order.sag[:] = 0.0


def new_order(legs: int) -> Order:
    """An order to stand."""
    order = view_of(np.zeros(1, ORDER)[0], Order, legs)
    clear(order)
    return order


def unwrapped(function: Any) -> Any:
    """What was compiled, as the Python that it was."""
    return getattr(function, "py_func", function)
