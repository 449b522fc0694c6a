"""The scene of the player: meshes once, and poses, forces and support for each frame."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float, Integer

from phasmid.recording.ros import rows_at
from phasmid.reporting.drawing import FORCE_COLOUR, FORCE_LENGTH, mid_walk_swing_time
from phasmid.reporting.numbers import centre_of_mass, margin_over_time
from phasmid.reporting.robot_mesh import MeshPieces, link_poses, mesh_pieces, quaternions
from phasmid.reporting.run import Run
from phasmid.reporting.style import leg_colour
from phasmid.reporting.terrain_mesh import landscape
from phasmid.reporting.webpage.packing import packed
from phasmid.robot import Robot
from phasmid.terrain import Ground

RATE = 30.0
"""Frames per second; the player draws what lies between them."""

MOST_BYTES = 1_200_000
"""Most bytes of all frames: a longer run has fewer a second."""

GROUND_CELLS = 110
"""Most cells along a side of curved ground."""

ABOUT = 0.8
"""Distance from the robot's path to the edge of uneven ground [m]."""


def replay(run: Run) -> dict[str, Any]:
    """Return the scene of the player, as JSON.

    Args:
        run: A run with the body's pose and joint angles.
    """
    terrain = run.experiment.world.terrain
    kept = replace(run, recording=run.recording.isel(time=frames(run)))
    body, orientation, q = kept.pose("the replay")
    pieces = mesh_pieces(run.robot)
    X_body_link = link_poses(run.robot, q, pieces.links)
    middle = body[:, :2].mean(axis=0)
    reach = float(np.ptp(body[:, :2], axis=0).max()) / 2 + ABOUT
    scene: dict[str, Any] = {
        "time": packed(kept.time, "f32"),
        "body_position": packed(body, "f32"),
        "body_orientation": packed(orientation, "i16"),
        "link_position": packed(X_body_link[..., :3, 3], "i16"),
        "link_orientation": packed(quaternions(X_body_link[..., :3, :3]), "i16"),
        "weight": run.weight,
        "trail": 2 * run.experiment.course.stride.period,
        "start": int(np.argmin(np.abs(kept.time - mid_walk_swing_time(run)))),
    }
    scene |= looks(run.robot, pieces) | surroundings(terrain, middle, reach)
    return scene | _support(kept, terrain, body)


def looks(robot: Robot, pieces: MeshPieces) -> dict[str, Any]:
    """Return a robot's meshes, colours and sizes for the page.

    Args:
        robot: The robot.
        pieces: Its `mesh_pieces`; poses of a frame follow their links.
    """
    links, legs = pieces.links, range(len(robot.legs))
    return {
        "legs": [leg_colour(leg) for leg in legs],
        "knees": [links.index((leg, 2)) if (leg, 2) in links else -1 for leg in legs],
        "span": float(np.ptp(robot.arrays.p_body_hip[:, :2], axis=0).max()),
        "force_length": FORCE_LENGTH,
        "force_colour": FORCE_COLOUR,
        "meshes": [_packed_mesh(*mesh) for mesh in pieces.meshes],
        "pieces": [
            {"link": link, "mesh": mesh, "colour": list(colour)}
            for link, mesh, colour in pieces.pieces
        ],
    }


def _packed_mesh(vertices: np.ndarray, faces: np.ndarray) -> dict[str, Any]:
    kind = "u16" if len(vertices) <= 65536 else "u32"
    return {"vertices": packed(vertices, "i16"), "faces": packed(faces, kind)}


def surroundings(terrain: Ground, middle: Float[np.ndarray, "2"], reach: float) -> dict[str, Any]:
    """Return the ground of a scene: its level or its surface, and its patches.

    Args:
        terrain: The ground.
        middle: Middle of the part that is shown [m], shape (2,).
        reach: Half the side of that part [m].
    """
    found: dict[str, Any] = {"patches": _patches(terrain, middle, reach)}
    if terrain.is_level:
        return found | {"level": float(terrain.height(*middle[:, None])[0]), "ground": None}
    ground = landscape(terrain, middle, reach, 2 * reach / GROUND_CELLS)
    return found | {"level": None, "ground": _packed_mesh(*ground)}


def _patches(
    terrain: Ground, middle: Float[np.ndarray, "2"], reach: float
) -> dict[str, Any] | None:
    """Return rectangles of other friction, in the terrain's axes; None where there is none near.

    ``box`` holds those that are shown: from x, to x, from y, to y [m]. ``each`` holds the same of
    each and its friction over that of the ground; the last one counts. ``yaw`` turns them [rad].
    """
    if not terrain.patches or terrain.coefficient == 0:
        return None
    c, s = math.cos(terrain.yaw), math.sin(terrain.yaw)
    own = np.array([c * middle[0] + s * middle[1], c * middle[1] - s * middle[0]])
    each = np.array([(*patch.x, *patch.y, patch.coefficient) for patch in terrain.patches])
    each[:, 4] /= terrain.coefficient
    low = np.maximum(each[:, [0, 2]].min(axis=0), own - reach)
    high = np.minimum(each[:, [1, 3]].max(axis=0), own + reach)
    if (low >= high).any():
        return None
    return {
        "box": np.round([low[0], high[0], low[1], high[1]], 4).tolist(),
        "each": np.round(each, 4).tolist(),
        "yaw": terrain.yaw,
    }


def frames(run: Run) -> Integer[np.ndarray, " frames"]:
    """Return the samples that become frames: `RATE` a second, or as many as fit."""
    time = run.time
    each = 4 + 12 + 8 + len(run.robot.legs) * (4 * 14 + 6 + 6 + 2 + 1) + 12
    length = max(float(time[-1] - time[0]), 1 / RATE)
    rows = rows_at(time, min(RATE, MOST_BYTES / each / length))
    last = len(time) - 1
    return rows if rows[-1] == last else np.append(rows, last)


def _support(kept: Run, terrain: Ground, body: Float[np.ndarray, "frames 3"]) -> dict[str, Any]:
    """Return feet, forces, contacts, centre of mass and margin, where recorded."""
    found: dict[str, Any] = {}
    feet, standing = kept.channel("foot_position"), kept.channel("contact", "stance")
    if feet is not None:
        found["feet"] = packed(feet - body[:, None], "i16")
        if kept.foot_force is not None:
            found["forces"] = packed(kept.foot_force, "i16")
            found["force_words"] = kept.force_words
    if standing is not None:
        found["down"] = packed(standing, "u8")
    centre = centre_of_mass(kept)
    if centre is not None:
        found["centre"] = packed(centre - body, "i16")
        ground = terrain.height(centre[:, 0], centre[:, 1])
        found["below"] = packed(ground - body[:, 2], "i16")
    if feet is not None and standing is not None:
        name = "contact" if kept.has("contact") else "stance"
        margin, of_what = margin_over_time(kept, name)
        found["margin"] = packed(np.where(np.isfinite(margin), margin, -1e9), "f32")
        found["margin_of"] = of_what
    return found
