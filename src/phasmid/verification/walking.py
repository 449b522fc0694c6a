"""Checks of the paper's walk: ground reaction and error of the time step."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Bool, Float

from phasmid.motion import plan
from phasmid.recording import Recording
from phasmid.reporting import summarise
from phasmid.reporting.steps import away_from_switches
from phasmid.robot import JOINTS
from phasmid.scenario import Scenario
from phasmid.simulation import time_step_refinement
from phasmid.simulation.walks import REFINED_CYCLES
from phasmid.verification.laboratory import CannotMeasure, Laboratory
from phasmid.verification.row import Row, reading, seen


def mean_load(laboratory: Laboratory) -> Iterator[Row]:
    """Mean sum of all normal forces over whole cycles, beside the weight."""
    scenario, recording = laboratory.scenario, laboratory.walk()
    weight = scenario.load_robot().mass * scenario.model.gravity
    # The last sample begins the next cycle.
    total = recording["foot_normal_force"].sum("leg").values[:-1]
    why = (
        "Height and speed of the body repeat after each cycle, so that the mean force is the "
        "weight; touchdowns change them by 0.1 mm and some mm/s."
    )
    yield reading(
        f"over {scenario.duration / scenario.period:g} cycles",
        float(total.mean()) / weight,
        0.002,
        why,
        expected=1.0,
    )


def swing_load(laboratory: Laboratory) -> Iterator[Row]:
    """Check the largest force on a swing foot, 80 ms away from its switches.

    That standing feet are loaded shows that the forces are measured at all.
    """
    recording = laboratory.walk()
    force = np.linalg.norm(recording["foot_force"].values, axis=-1)
    stance, away = recording["stance"].values, calm(recording)
    swinging, standing = away & ~stance, away & stance
    why = "A foot in the air touches nothing: exactly none."
    yield reading("largest on any foot", force[swinging].max(initial=0.0), 0.0, why, unit="N")
    why = "Counted: every foot of a tripod carries a part of the weight."
    yield reading(
        "standing feet without load",
        np.count_nonzero(~(force[standing] > 0)),
        0.0,
        why,
        unit="samples",
    )
    yield seen(int(swinging.sum()), "samples of feet in swing")


def refinement(laboratory: Laboratory) -> Iterator[Row]:
    """Compare two cycles at the scenario's time step and at half of it."""
    scenario = laboratory.scenario
    found = time_step_refinement(scenario, plan(scenario))
    if found is None:
        raise CannotMeasure("the walk did not come to its end at half the time step.")
    why = "The specified 0.5 %: rms of the difference over rms, touchdowns included."
    half = f"{1000 * found.time_step:g} ms and half"
    yield reading(f"normal forces, {half}", 100 * found.normal_force, 0.5, why, unit="%")
    yield reading(f"joint torques, {half}", 100 * found.joint_torque, 0.5, why, unit="%")
    why = "The specified 0.5 %, of the distance itself."
    yield reading(
        f"way of the body, {half}",
        100 * found.way / float(np.linalg.norm(_way(scenario))),
        0.5,
        why,
        unit="%",
    )


def model_against_simulation(laboratory: Laboratory) -> Iterator[Row]:
    """Rms difference of torques, model and simulation, amid stance; the worst leg of each joint."""
    compared = summarise(laboratory.walk())["model_against_simulation"]["torque"]
    for name, key in (("whole walk", "rms"), ("mid-stance", "rms_mid_stance")):
        worst = np.array(compared[key], dtype=float).max(axis=0)
        for joint, value in zip(JOINTS, worst, strict=True):
            why = (
                "Reported: statics does not determine the internal forces of the feet, so "
                "nothing is claimed beyond this number."
            )
            yield reading(f"{joint}, {name}, worst leg", value, None, why, unit="N·m")


def calm(recording: Recording) -> Bool[np.ndarray, "time legs"]:
    """Samples of each leg that are 80 ms and more away from its switches."""
    return away_from_switches(recording["time"].values, recording["stance"].values)


def amid_stance(recording: Recording, legs: Sequence[int]) -> Bool[np.ndarray, " time"]:
    """Samples in which exactly these legs (from 0) stand, away from all switches."""
    wanted = np.zeros(recording.sizes["leg"], dtype=bool)
    wanted[list(legs)] = True
    return (recording["stance"].values == wanted).all(axis=1) & calm(recording).all(axis=1)


def _way(scenario: Scenario) -> Float[np.ndarray, "3"]:
    """Return the planned displacement in the compared cycles [m]."""
    end = min(scenario.duration, REFINED_CYCLES * scenario.period)
    return plan(scenario).sample(np.array([end])).trunk.position[0] * [1, 1, 0]
