"""The engine's arrays as views into one row of numbers and one of codes.

A compiled loop that is called from Python gets two rows where it would otherwise have to look at
nearly a hundred arrays, which takes longer than all that the engine computes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from phasmid.compiled import internal
from phasmid.control.bounds import BOUNDS
from phasmid.control.state import DIRECTIONS, Model, Order, State, Tuning
from phasmid.control.views import take

STATE, ORDER, MODEL = (93, 104), (24, 6), (3, 39 + 2 * BOUNDS)
"""Numbers in each, whatever the number of legs, and for each leg."""


@internal
def count_numbers(legs: int) -> tuple[int, int, int]:
    """Numbers in a state, in an order and in a model."""
    return (
        STATE[0] + STATE[1] * legs,
        ORDER[0] + ORDER[1] * legs,
        MODEL[0] + MODEL[1] * legs + 4,
    )


@internal
def state_at(numbers: np.ndarray, codes: np.ndarray, legs: int) -> State:
    """The state that a row of numbers and a row of codes hold."""
    a = 0
    path, a = take(numbers, a, (3,))
    speed, a = take(numbers, a, (3, 3))
    pose, a = take(numbers, a, (4, 6))
    sway, a = take(numbers, a, (4, 2))
    clock, a = take(numbers, a, (10,))
    foot, a = take(numbers, a, (legs, 3))
    line, a = take(numbers, a, (3, legs, 3))
    swing, a = take(numbers, a, (legs, 3))
    landing, a = take(numbers, a, (legs, 3))
    motion, a = take(numbers, a, (2, legs, 3))
    q, a = take(numbers, a, (3, legs, 3))
    retreat, a = take(numbers, a, (legs,))
    search, a = take(numbers, a, (legs,))
    sought, a = take(numbers, a, (3, legs, 3))
    body, a = take(numbers, a, (3, 3))
    trunk, a = take(numbers, a, (5, 3))
    com, a = take(numbers, a, (3,))
    region, a = take(numbers, a, (legs, DIRECTIONS, 3))
    posed, a = take(numbers, a, (legs, 9))
    ground, a = take(numbers, a, (4, 3))
    offset, a = take(numbers, a, (legs, 3))
    leg, b = take(codes, 0, (legs,))
    mode, b = take(codes, b, (4,))
    return State(
        path,
        speed,
        pose,
        sway,
        clock,
        foot,
        line,
        swing,
        landing,
        motion,
        q,
        retreat,
        search,
        sought,
        body,
        trunk,
        com,
        region,
        posed,
        ground,
        offset,
        leg,
        mode,
        numbers,
        codes,
    )


@internal
def order_at(numbers: np.ndarray, codes: np.ndarray, legs: int) -> Order:
    """The order that a row of numbers and a row of codes hold."""
    a = 0
    velocity, a = take(numbers, a, (3,))
    pose, a = take(numbers, a, (6,))
    correction, a = take(numbers, a, (6,))
    offsets, a = take(numbers, a, (legs,))
    gait, a = take(numbers, a, (4,))
    step, a = take(numbers, a, (1,))
    plane, a = take(numbers, a, (4,))
    landing, a = take(numbers, a, (legs,))
    foot_offset, a = take(numbers, a, (legs, 3))
    sag, a = take(numbers, a, (legs,))
    used, b = take(codes, 0, (legs,))
    touch, b = take(codes, b, (legs,))
    return Order(
        velocity,
        pose,
        correction,
        offsets,
        gait,
        step,
        used,
        touch,
        plane,
        landing,
        foot_offset,
        sag,
    )


@internal
def model_at(numbers: np.ndarray, legs: int) -> Model:
    """The robot that a row of numbers holds."""
    a = 0
    lengths, a = take(numbers, a, (legs, 3))
    R_body_hip, a = take(numbers, a, (legs, 3, 3))
    p_body_hip, a = take(numbers, a, (legs, 3))
    limits, a = take(numbers, a, (legs, 3, 2))
    neutral, a = take(numbers, a, (legs, 3))
    folded, a = take(numbers, a, (legs, 3))
    link_mass, a = take(numbers, a, (legs, 3))
    link_com, a = take(numbers, a, (legs, 3, 3))
    reach, a = take(numbers, a, (2, legs, BOUNDS))
    body_moment, a = take(numbers, a, (3,))
    b, a = take(numbers, a, (4,))
    return Model(
        lengths,
        R_body_hip,
        p_body_hip,
        limits,
        neutral,
        folded,
        link_mass,
        link_com,
        reach,
        body_moment,
        b[0],
        b[1],
        b[2],
        b[3],
    )


@internal
def tuning_at(row: np.ndarray) -> Tuning:
    """The settings that a row of numbers holds."""
    return Tuning(
        row[0],
        row[1],
        row[2],
        row[3],
        row[4],
        row[5],
        row[6],
        row[7],
        row[8],
        row[9],
        row[10],
        row[11],
        row[12],
        row[13],
        row[14],
    )


@internal
def all_at(
    numbers: np.ndarray, codes: np.ndarray, legs: int
) -> tuple[State, State, Order, Order, Model, Tuning]:
    """All that the rows of a `Memory` hold, in their order; see there."""
    states, orders, models = count_numbers(legs)
    row, a = take(numbers, 0, (states,))
    doing, b = take(codes, 0, (legs + 4,))
    state = state_at(row, doing, legs)
    row, a = take(numbers, a, (states,))
    doing, b = take(codes, b, (legs + 4,))
    trial = state_at(row, doing, legs)
    row, a = take(numbers, a, (orders,))
    feet, b = take(codes, b, (2 * legs,))
    order = order_at(row, feet, legs)
    row, a = take(numbers, a, (orders,))
    feet, b = take(codes, b, (2 * legs,))
    wanted = order_at(row, feet, legs)
    row, a = take(numbers, a, (models,))
    return state, trial, order, wanted, model_at(row, legs), tuning_at(numbers[a:])


class Memory:
    """All that the engine's loops work in.

    Args:
        model: The robot.
        tuning: The settings.

    Attributes:
        state: Where the engine is.
        trial: Where it would be.
        order: What is to be done.
        wanted: The same with the gait that is wanted.
        model: The robot.
        tuning: The settings.
        numbers: All of them as one row.
        codes: The same of those that are whole numbers.
    """

    def __init__(self, model: Model, tuning: Tuning) -> None:
        legs = self.legs = len(model.neutral)
        states, orders, _ = unwrapped(count_numbers)(legs)
        known = [np.ravel(values) for values in (*model, *tuning)]
        self.numbers = np.concatenate([np.zeros(2 * (states + orders)), *known])
        self.codes = np.zeros(2 * (legs + 4) + 4 * legs, dtype=np.int64)
        # Plain Python's own views: what is compiled would give Python the same ones. What is
        # changed in them counts in the loops.
        views = unwrapped(all_at)(self.numbers, self.codes, legs)
        self.state, self.trial, self.order, self.wanted, self.model, _ = views
        self.tuning = tuning
        for order in (self.order, self.wanted):
            clear(order)


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
    numbers, codes = np.zeros(unwrapped(count_numbers)(legs)[1]), np.zeros(2 * legs, dtype=np.int64)
    order: Order = unwrapped(order_at)(numbers, codes, legs)
    clear(order)
    return order


def unwrapped(function: Any) -> Any:
    """What was compiled, as the Python that it was."""
    return getattr(function, "py_func", function)
