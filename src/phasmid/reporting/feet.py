"""Slip, load and support of the feet, and the model's load beside the simulated one."""

from __future__ import annotations

from typing import Any

import numpy as np

from phasmid import kinematics
from phasmid.gait import support_margin
from phasmid.recording import Recording
from phasmid.reporting.source import Source, channel
from phasmid.reporting.steps import SETTLING, away_from_switches, durations, intervals, rms


def slip(recording: Recording, source: Source) -> dict[str, Any]:
    """Return the horizontal displacement of stance feet from touchdown to lift-off, in whole steps.

    Returns:
        Mean and largest over all steps [m] and the mean of each leg [m]; empty without feet.
    """
    time = np.asarray(recording["time"].values)
    feet, stance = channel(recording, "foot_position"), channel(recording, "stance")
    if feet is None or stance is None or len(time) < 2:
        return {}
    touching = channel(recording, "contact")
    standing = stance if touching is None else stance & touching
    moved = np.linalg.norm(np.diff(feet[..., :2], axis=0), axis=-1)
    moved = np.where(standing[1:] & standing[:-1], moved, 0.0)
    widest = float(np.diff(time).max())
    paths: list[list[float]] = []
    for leg in range(stance.shape[1]):
        paths.append([])
        for start, stop in intervals(stance[:, leg]):
            # A whole stance may miss one sample at either end. In a driven run its
            # duration is unknown: stances cut by the ends of the run are left out.
            missing = source.step_time - (time[stop - 1] - time[start])
            whole = missing <= 2.001 * widest
            if "controller" in recording.attrs:
                whole = start > 0 and stop < len(stance)
            if whole:
                paths[-1].append(float(moved[start : stop - 1, leg].sum()))
    everything = [path for leg in paths for path in leg]
    if not everything:
        return {}
    return {
        "steps": len(everything),
        "mean": float(np.mean(everything)),
        "largest": max(everything),
        "mean_by_leg": [float(np.mean(leg)) if leg else np.nan for leg in paths],
    }


def load(recording: Recording, source: Source, name: str) -> dict[str, Any]:
    """Return the normal forces of one channel.

    Args:
        recording: The recording.
        source: Its robot and experiment.
        name: ``foot_normal_force`` or ``foot_normal_force_model``.

    Returns:
        ``mean_in_stance`` of each leg [N]; ``mean_sum`` over whole cycles [N] and
        ``sum_over_weight``; ``largest_in_swing`` [N] outside `SETTLING` of the leg's switches;
        empty without the channel.
    """
    normal, stance = channel(recording, name), channel(recording, "stance")
    if normal is None:
        return {}
    time = np.asarray(recording["time"].values)
    found: dict[str, Any] = {"largest": float(normal.max())}
    period = source.scenario.stride.period
    cycles = int((time[-1] - time[0]) / period + 1e-9)
    if cycles > 0:
        whole = time <= time[0] + cycles * period + 1e-9
        total = normal.sum(axis=1)[whole]
        weights = durations(time[whole])
        found["cycles"] = cycles
        found["mean_sum"] = float(total @ weights / weights.sum())
        found["sum_over_weight"] = found["mean_sum"] / source.weight
    if stance is not None:
        held = durations(time)[:, None] * stance
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = (normal * held).sum(axis=0) / held.sum(axis=0)
        found["mean_in_stance"] = mean.tolist()
        swinging = ~stance & away_from_switches(time, stance)
        if swinging.any():
            found["largest_in_swing"] = float(normal[swinging].max())
            found["swing_margin_time"] = SETTLING
    return found


def load_difference(recording: Recording) -> list[float] | None:
    """Return the rms difference of normal forces, model less simulation, of each leg [N].

    Samples within `SETTLING` of any leg's switch are left out.
    """
    seen = channel(recording, "foot_normal_force")
    model = channel(recording, "foot_normal_force_model")
    stance = channel(recording, "stance")
    if seen is None or model is None or stance is None:
        return None
    time = np.asarray(recording["time"].values)
    calm = np.all(away_from_switches(time, stance), axis=1, keepdims=True)
    difference: list[float] = rms(model - seen, np.broadcast_to(calm, seen.shape)).tolist()
    return difference


def least_support(recording: Recording, source: Source) -> float | None:
    """Return the smallest static stability margin in planned stance [m]; None where unknown."""
    feet, stance = channel(recording, "foot_position"), channel(recording, "stance")
    p_world_com = centre_of_mass(recording, source)
    if feet is None or stance is None or p_world_com is None:
        return None
    margin = support_margin(feet[..., :2], stance, p_world_com[..., :2])
    return float(margin.min())


def centre_of_mass(recording: Recording, source: Source) -> np.ndarray | None:
    """Return the centre of mass of the whole robot in the world [m], shape (N, 3).

    Joint angles are the recorded or else the planned ones; None where the pose is not recorded.
    """
    position = channel(recording, "body_position")
    orientation = channel(recording, "body_orientation")
    angles = channel(recording, "joint_position")
    if angles is None:
        angles = channel(recording, "joint_position_target")
    if position is None or orientation is None or angles is None:
        return None
    p_body_com = kinematics.centre_of_mass(source.robot, angles)
    R_world_body = kinematics.quaternion_rotation(orientation)
    p_world_com: np.ndarray = position + np.einsum("nij,nj->ni", R_world_body, p_body_com)
    return p_world_com
