"""Path of the body, and the commanded one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid import kinematics
from phasmid.gait import sway
from phasmid.recording import Recording
from phasmid.reporting.source import Source, channel
from phasmid.reporting.steps import durations


def commanded_way(source: Source, duration: float) -> dict[str, float]:
    """Return the displacement of the body by the stride's steps, at constant pace.

    Args:
        source: Its robot and experiment.
        duration: Time from the start [s].

    Returns:
        ``steps`` made; ``forward`` and ``sideways`` (left) from the start, in its axes [m];
        ``turn`` to the left [rad]; ``distance`` along the way [m].

    Each step takes the body by the stride's step, forward, left and around, from where the last
    one left it; in between the body follows the arc through these places. A rest-to-rest walk is
    on the pace after every whole step, and a little before or behind it within a step.
    """
    stride = source.scenario.stride
    steps = duration / source.step_time
    step = np.array([stride.step_length, stride.step_sideways, stride.step_turn])
    forward, sideways, turn = kinematics.step_pose(step, np.array([steps]))[0].tolist()
    return {
        "steps": steps,
        "forward": forward,
        "sideways": sideways,
        "turn": turn,
        "distance": steps * math.hypot(stride.step_length, stride.step_sideways),
    }


def driven_way(recording: Recording, source: Source) -> dict[str, float] | None:
    """Return the displacement of the body by the commanded velocities, as `commanded_way`.

    None without a velocity command.
    """
    velocity = channel(recording, "velocity_command")
    if velocity is None:
        return None
    time = np.asarray(recording["time"].values)
    held, v = np.diff(time), velocity[:-1]
    yaw = np.cumsum(held * v[:, 2]) - held * v[:, 2] / 2
    c, s = np.cos(yaw), np.sin(yaw)
    return {
        "steps": float(time[-1] - time[0]) / source.step_time,
        "forward": float(held @ (c * v[:, 0] - s * v[:, 1])),
        "sideways": float(held @ (s * v[:, 0] + c * v[:, 1])),
        "turn": float(held @ v[:, 2]),
        "distance": float(held @ np.hypot(v[:, 0], v[:, 1])),
    }


def velocity(recording: Recording) -> dict[str, Any]:
    """Return mean velocities of a driven run in the body's heading: vx, vy [m/s], wz [rad/s].

    Returns:
        The ``commanded`` velocity, the ``feasible`` one where the controller gives it, and the
        ``actual`` one; empty where none was commanded.
    """
    commanded = channel(recording, "velocity_command")
    if commanded is None:
        return {}
    time = np.asarray(recording["time"].values)
    weights = durations(time)
    weights /= weights.sum()
    found: dict[str, Any] = {"commanded": (weights @ commanded).tolist()}
    feasible = channel(recording, "velocity_reference")
    if feasible is not None:
        found["feasible"] = (weights @ feasible).tolist()
    v, orientation = channel(recording, "body_velocity"), channel(recording, "body_orientation")
    if v is not None and orientation is not None and len(time) > 1:
        yaw = np.unwrap(kinematics.quaternion_yaw(orientation))
        c, s = np.cos(yaw), np.sin(yaw)
        vx, vy = c * v[:, 0] + s * v[:, 1], c * v[:, 1] - s * v[:, 0]
        wz = (yaw[-1] - yaw[0]) / (time[-1] - time[0])
        found["actual"] = [float(weights @ vx), float(weights @ vy), float(wz)]
    return found


def travel(recording: Recording, source: Source) -> dict[str, Any]:
    """Return distance, drift, heading and tilt of the body; what is not recorded is absent."""
    time = np.asarray(recording["time"].values)
    duration = float(time[-1] - time[0])
    # Between waypoints the velocity follows from where the robot is: it commands no path.
    way = {}
    if "waypoints" not in recording.attrs:
        way = driven_way(recording, source) or commanded_way(source, duration)
    found: dict[str, Any] = {f"commanded_{name}": value for name, value in way.items()}
    position = channel(recording, "body_position")
    orientation = channel(recording, "body_orientation")
    if position is not None:
        yaw = np.zeros(len(time))
        if orientation is not None:
            yaw = np.unwrap(kinematics.quaternion_yaw(orientation))
        first = float(yaw[0])
        # The sway of a driven robot follows its controller's clock.
        if not {"trajectory", "controller"} & set(recording.attrs):
            position = _without_sway(source, time, position, yaw)
        dx, dy = (position[-1] - position[0])[:2]
        forward = math.cos(first) * dx + math.sin(first) * dy
        sideways = math.cos(first) * dy - math.sin(first) * dx
        # Chords of one step each follow a curved path without the oscillation within a step.
        marks = np.append(np.arange(time[0], time[-1] - 1e-9, source.step_time), time[-1])
        places = np.stack([np.interp(marks, time, position[:, k]) for k in range(2)], axis=-1)
        distance = float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())
        height = position[:, 2]
        found |= {
            "distance": distance,
            "forward": forward,
            "sideways": sideways,
            "mean_speed": distance / duration if duration > 0 else math.nan,
            "sideways_drift": sideways - way["sideways"] if way else math.nan,
            "body_height_change": float(height[-1] - height[0]),
            "body_height_range": float(height.max() - height.min()),
        }
    if orientation is not None:
        yaw = np.unwrap(kinematics.quaternion_yaw(orientation))
        upright = kinematics.quaternion_rotation(orientation)[:, 2, 2]
        found |= {
            "heading_change": float(yaw[-1] - yaw[0]),
            "largest_tilt": float(np.arccos(np.clip(upright, -1, 1)).max()),
        }
    return found


def _without_sway(
    source: Source,
    time: Float[np.ndarray, " time"],
    position: Float[np.ndarray, "time 3"],
    yaw: Float[np.ndarray, " time"],
) -> Float[np.ndarray, "time 3"]:
    """Return the body's position without the gait's sway about its path."""
    if not source.gait.sway:
        return position
    neutral, period = kinematics.neutral_feet(source.robot), source.scenario.stride.period
    ahead, left = sway(source.gait, neutral, period, time).way.T
    c, s = np.cos(yaw), np.sin(yaw)
    aside = [c * ahead - s * left, s * ahead + c * left, np.zeros(len(time))]
    return np.asarray(position - np.stack(aside, axis=-1))
