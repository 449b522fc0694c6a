"""The scene of the player: meshes once, and poses, forces and support for each frame."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from jaxtyping import Float, Integer

from phasmid.recording import Recording
from phasmid.recording.ros import rows_at
from phasmid.reporting.drawing import FORCE_COLOUR, FORCE_LENGTH, swing_moment
from phasmid.reporting.feet import centre_of_mass
from phasmid.reporting.robot_mesh import MeshPieces, link_poses, mesh_pieces, quaternions
from phasmid.reporting.source import Source, channel
from phasmid.reporting.style import leg_colour
from phasmid.reporting.support import margin_over_time
from phasmid.reporting.terrain_mesh import indexed, landscape
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


def replay(recording: Recording, source: Source) -> dict[str, Any]:
    """Return the scene of the player, as JSON.

    Args:
        recording: Finite part of a recording with the body's pose and joint angles.
        source: Its robot and experiment.
    """
    terrain = source.scenario.load_terrain()
    rows = frames(recording, len(source.robot.legs))
    kept = recording.isel(time=rows)
    time = np.asarray(kept["time"].values)
    body = np.asarray(kept["body_position"].values)
    angles = channel(kept, "joint_position")
    q = np.asarray(kept["joint_position_target"].values) if angles is None else angles
    pieces = mesh_pieces(source.robot)
    X_body_link = link_poses(source.robot, q, pieces.links)
    middle = body[:, :2].mean(axis=0)
    reach = float(np.ptp(body[:, :2], axis=0).max()) / 2 + ABOUT
    scene: dict[str, Any] = {
        "time": packed(time, "f32"),
        "body_position": packed(body, "f32"),
        "body_orientation": packed(np.asarray(kept["body_orientation"].values), "i16"),
        "link_position": packed(X_body_link[..., :3, 3], "i16"),
        "link_orientation": packed(quaternions(X_body_link[..., :3, :3]), "i16"),
        "weight": source.weight,
        "trail": 2 * source.scenario.stride.period,
        "start": int(np.argmin(np.abs(time - swing_moment(recording, source)))),
    }
    scene |= looks(source.robot, pieces) | surroundings(terrain, middle, reach)
    return scene | _support(kept, source, terrain, body)


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
    corners = landscape(terrain, middle, reach, 2 * reach / GROUND_CELLS)
    return found | {"level": None, "ground": _packed_mesh(*indexed(corners))}


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


def frames(recording: Recording, legs: int) -> Integer[np.ndarray, " frames"]:
    """Return the samples that become frames: `RATE` a second, or as many as fit."""
    time = np.asarray(recording["time"].values)
    each = 4 + 12 + 8 + legs * (4 * 14 + 6 + 6 + 2 + 1) + 12
    length = max(float(time[-1] - time[0]), 1 / RATE)
    rows = rows_at(time, min(RATE, MOST_BYTES / each / length))
    last = len(time) - 1
    return rows if rows[-1] == last else np.append(rows, last)


def _support(
    kept: Recording, source: Source, terrain: Ground, body: Float[np.ndarray, "frames 3"]
) -> dict[str, Any]:
    """Return feet, forces, contacts, centre of mass and margin, where recorded."""
    found: dict[str, Any] = {}
    feet = channel(kept, "foot_position")
    standing = next((n for n in ("contact", "stance") if n in kept.data_vars), None)
    if feet is not None:
        found["feet"] = packed(feet - body[:, None], "i16")
        name = next((n for n in ("foot_force", "foot_force_model") if n in kept.data_vars), None)
        if name is not None:
            found["forces"] = packed(np.asarray(kept[name].values), "i16")
            found["force_words"] = "simulated" if name == "foot_force" else "by the model"
            if name == "foot_force" and kept.attrs.get("kind") != "simulation":
                found["force_words"] = "as recorded"
    if standing is not None:
        found["down"] = packed(np.asarray(kept[standing].values), "u8")
    centre = centre_of_mass(kept, source)
    if centre is not None:
        found["centre"] = packed(centre - body, "i16")
        ground = terrain.height(centre[:, 0], centre[:, 1])
        found["below"] = packed(ground - body[:, 2], "i16")
    if feet is not None and standing is not None:
        margin, of_what = margin_over_time(kept, source, standing)
        known = np.isfinite(margin)
        found["margin"] = packed(np.where(known, margin, -1e9), "f32")
        found["margin_of"] = of_what
    return found
