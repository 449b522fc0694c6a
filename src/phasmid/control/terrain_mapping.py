"""Write depth readings and footholds of the engine into its height map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from phasmid.compiled import compiled
from phasmid.control.estimation.odometry_alignment import rotate_points
from phasmid.control.terrain_map import (
    ATTITUDE_NOISE,
    FOOT_RADIUS,
    LEAST_NOISE,
    RANGE_NOISE,
    TerrainMap,
    TerrainSource,
    add_foothold,
    add_points,
    recentre,
    rotate_map,
)
from phasmid.control.types import Contact, LegPhase, Reference, State


@dataclass(eq=False)
class BodyPoses:
    """Delay line of the body's commanded pose, and the feet whose footholds are in the map."""

    R_odom_body: Float[np.ndarray, "128 3 3"]
    p_odom_body: Float[np.ndarray, "128 3"]  # [m]
    updates: int  # Number of updates
    delay: int  # From a reading's pose to its arrival [updates]
    mapped: Int[np.ndarray, " legs"]  # 1 from a touchdown to the next lift-off


@compiled
def update_map(
    state: State,
    reference: Reference,
    terrain_map: TerrainMap,
    poses: BodyPoses,
    source: int,
) -> None:
    """Write the footholds of feet that have touched down, and keep the pose of the body."""
    if source == TerrainSource.POINTS:
        now = poses.updates % (poses.delay + 1)
        poses.R_odom_body[now], poses.p_odom_body[now] = state.R_odom_body, state.body_position
    poses.updates += 1
    centred = False
    for leg in range(state.leg_count):
        if state.leg_phase[leg] != LegPhase.STANCE:
            poses.mapped[leg] = 0
        elif poses.mapped[leg] == 0 and reference.contact[leg] == Contact.GROUND:
            if not centred:
                recentre(terrain_map, state.body_position, state.clock.time)
                centred = True
            foot = state.foot[leg]
            add_foothold(terrain_map, foot[0], foot[1], foot[2], FOOT_RADIUS, state.clock.time)
            poses.mapped[leg] = 1


@compiled
def align_map(
    R_before: Float[np.ndarray, "3 3"],
    state: State,
    terrain_map: TerrainMap,
    poses: BodyPoses,
    source: int,
) -> None:
    """Rotate the map and the kept poses about the body, as `align_odometry` has rotated odom.

    Args:
        R_before: Rotation of the body before the alignment.
        state: State of the engine after it.
        terrain_map: Changed.
        poses: Changed.
        source: `TerrainSource` of the map.
    """
    if (R_before == state.R_odom_body).all():
        return
    R, p = state.R_odom_body @ R_before.T, state.body_position
    rotate_map(terrain_map, R, p)
    if source == TerrainSource.POINTS:
        count, origin = min(poses.updates, poses.delay + 1), np.zeros(3)
        rotate_points(R, p, poses.p_odom_body[:count])
        for k in range(count):
            rotate_points(R, origin, poses.R_odom_body[k].T)


@compiled
def map_points(
    state: State,
    terrain_map: TerrainMap,
    poses: BodyPoses,
    points: Float[np.ndarray, "points 3"],
    age: float,
) -> None:
    """Take ground points into the map with the pose that the body had at their reading.

    Args:
        state: State of the engine.
        terrain_map: Changed.
        poses: Kept poses.
        points: In body axes [m].
        age: Time since the reading [s].
    """
    R, p, now = state.R_odom_body.copy(), state.body_position.copy(), state.clock.time
    recentre(terrain_map, p, now)
    if poses.updates > 0:
        length = poses.delay + 1
        oldest = 0 if poses.updates < length else poses.updates % length
        R[:], p[:] = poses.R_odom_body[oldest], poses.p_odom_body[oldest]
    add_points(terrain_map, points, R, p, (RANGE_NOISE, ATTITUDE_NOISE, LEAST_NOISE), now - age)
