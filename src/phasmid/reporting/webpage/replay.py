"""What the player shows: meshes once, and poses, forces and support for each of its frames."""

from __future__ import annotations

import hashlib
import math
from typing import Any

import numpy as np
from jaxtyping import Float, Integer

from phasmid import kinematics
from phasmid.recording import Recording
from phasmid.recording.ros import rows_at
from phasmid.reporting.drawing import FORCE_COLOUR, FORCE_LENGTH, telling_moment
from phasmid.reporting.feet import centre_of_mass
from phasmid.reporting.landscape import landscape
from phasmid.reporting.machine import link_meshes
from phasmid.reporting.shapes import Mesh
from phasmid.reporting.source import Source, channel
from phasmid.reporting.style import leg_colour
from phasmid.reporting.support import margin_over_time
from phasmid.reporting.webpage.packing import packed
from phasmid.robot import Robot
from phasmid.terrain import Blocky, Ground

RATE = 30.0
"""Frames per second; the player draws what lies between them."""

MOST_BYTES = 1_200_000
"""Most bytes of all frames: a longer run has fewer a second."""

GROUND_CELLS = 110
"""Most cells along a side of curved ground."""

ABOUT = 0.8
"""How far about the robot's way uneven ground is shown [m]."""


def replay(recording: Recording, source: Source) -> dict[str, Any]:
    """The scene that the player shows, as JSON holds it.

    Args:
        recording: Its finite part, with the body's pose and joint angles, seen or planned.
        source: The machine and the experiment behind it.
    """
    terrain = source.scenario.load_terrain()
    rows = frames(recording, len(source.robot.legs))
    kept = recording.isel(time=rows)
    time = np.asarray(kept["time"].values)
    body = np.asarray(kept["body_position"].values)
    angles = channel(kept, "joint_position")
    q = np.asarray(kept["joint_position_target"].values) if angles is None else angles
    solids = solids_of(source.robot)
    places = [place for place in solids if place is not None]
    X_body_link = link_poses(source.robot, q, places)
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
        "start": int(np.argmin(np.abs(time - telling_moment(recording, source)))),
    }
    scene |= looks(source.robot, solids, places) | surroundings(terrain, middle, reach)
    return scene | _support(kept, source, terrain, body)


def looks(
    robot: Robot, solids: dict[Place | None, list[Mesh]], places: list[Place]
) -> dict[str, Any]:
    """What a scene tells of its robot's look.

    Args:
        robot: The robot.
        solids: As `solids_of` gives them.
        places: Those of its links, in the order of the frames' poses.
    """
    legs = range(len(robot.legs))
    told: dict[str, Any] = {
        "legs": [leg_colour(leg) for leg in legs],
        "knees": [places.index((leg, 2)) if (leg, 2) in places else -1 for leg in legs],
        "span": float(np.ptp(robot.arrays.p_body_hip[:, :2], axis=0).max()),
        "force_length": FORCE_LENGTH,
        "force_colour": FORCE_COLOUR,
    }
    told["meshes"], told["pieces"] = _pieces(solids, places)
    return told


def surroundings(terrain: Ground, middle: Float[np.ndarray, "2"], reach: float) -> dict[str, Any]:
    """The ground of a scene: its height where it is level, or else its surface; and its patches.

    Args:
        terrain: The ground.
        middle: Where it is shown [m], shape (2,).
        reach: How far from there, along both axes [m].
    """
    told: dict[str, Any] = {"patches": _patches(terrain, middle, reach)}
    if terrain.is_level:
        return told | {"level": float(terrain.height(*middle[:, None])[0]), "ground": None}
    return told | {"level": None, "ground": _indexed(_ground(terrain, middle, reach))}


def _patches(
    terrain: Ground, middle: Float[np.ndarray, "2"], reach: float
) -> dict[str, Any] | None:
    """Rectangles of other friction, in the terrain's own axes; None where there is none near.

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
    """Samples of a recording that become frames: `RATE` a second, or as many as fit."""
    time = np.asarray(recording["time"].values)
    each = 4 + 12 + 8 + legs * (4 * 14 + 6 + 6 + 2 + 1) + 12
    length = max(float(time[-1] - time[0]), 1 / RATE)
    rows = rows_at(time, min(RATE, MOST_BYTES / each / length))
    last = len(time) - 1
    return rows if rows[-1] == last else np.append(rows, last)


def _support(
    kept: Recording, source: Source, terrain: Ground, body: Float[np.ndarray, "frames 3"]
) -> dict[str, Any]:
    """Feet, forces on them and what they hold, where the recording tells it."""
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


Place = tuple[int, int]
"""A leg's number and its frame's: coxa, femur, tibia, foot."""


def solids_of(robot: Robot) -> dict[Place | None, list[Mesh]]:
    """What moves as one piece: the trunk by None, links by leg and frame."""
    links = link_meshes(robot)
    found: dict[Place | None, list[Mesh]] = {None: links.body}
    for leg, parts in enumerate(links.legs):
        found |= {(leg, frame): pieces for frame, pieces in enumerate(parts) if pieces}
    return found


def link_poses(
    robot: Robot, q: Float[np.ndarray, "frames legs 3"], places: list[Place]
) -> Float[np.ndarray, "frames links 4 4"]:
    """``X_body_link`` of each frame and link."""
    poses = [
        leg.X_body_hip @ kinematics.leg_frames(leg, q[:, number])
        if any(place[0] == number for place in places)
        else None
        for number, leg in enumerate(robot.legs)
    ]
    chosen = [pose[:, frame] for leg, frame in places if (pose := poses[leg]) is not None]
    return np.stack(chosen, axis=1) if chosen else np.zeros((len(q), 0, 4, 4))


def _pieces(
    solids: dict[Place | None, list[Mesh]], places: list[Place]
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Meshes, each once, and where each is shown in which colour; link -1 is the trunk."""
    meshes: dict[bytes, dict[str, Any]] = {}
    pieces = []
    for place, solid in solids.items():
        link = -1 if place is None else places.index(place)
        for mesh in solid:
            for colour, corners in _by_colour(mesh):
                key = hashlib.sha256(np.ascontiguousarray(corners).tobytes()).digest()
                if key not in meshes:
                    meshes[key] = _indexed(corners)
                index = list(meshes).index(key)
                shade = [round(float(c), 4) for c in colour]
                pieces.append({"link": link, "mesh": index, "colour": shade})
    return list(meshes.values()), pieces


def _by_colour(mesh: Mesh) -> list[tuple[np.ndarray, np.ndarray]]:
    """Colours of a mesh, and the corners of the triangles that have each."""
    # Most parts have one, and to sort thousands of colours takes long.
    if np.all(mesh.colours == mesh.colours[:1]):
        return [(mesh.colours[0], mesh.corners)] if len(mesh.corners) else []
    colours, which = np.unique(mesh.colours, axis=0, return_inverse=True)
    return [(colour, mesh.corners[which.ravel() == k]) for k, colour in enumerate(colours)]


def _indexed(corners: Float[np.ndarray, "triangles 3 3"]) -> dict[str, Any]:
    """Triangles with each corner once."""
    step = max(float(np.abs(corners).max()), 1e-9) / 32767
    steps = np.rint(corners.reshape(-1, 3) / step).astype(np.int64)
    keys = (steps + 32768) @ np.array([1 << 34, 1 << 17, 1])
    _, first, faces = np.unique(keys, return_index=True, return_inverse=True)
    vertices = steps[first] * step
    faces = faces.reshape(-1, 3)
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    kind = "u16" if len(vertices) <= 65536 else "u32"
    return {"vertices": packed(vertices, "i16"), "faces": packed(faces, kind)}


def _ground(
    terrain: Ground, middle: Float[np.ndarray, "2"], reach: float
) -> Float[np.ndarray, "triangles 3 3"]:
    """Uneven ground about the robot's way."""
    if isinstance(terrain.shape, Blocky):
        return landscape(terrain, middle, reach).corners
    side = np.linspace(-reach, reach, GROUND_CELLS + 1)
    x, y = np.meshgrid(middle[0] + side, middle[1] + side, indexing="ij")
    grid = np.stack([x, y, terrain.height(x, y)], axis=-1)
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    halves = [np.stack([a, b, c], axis=-2), np.stack([a, c, d], axis=-2)]
    return np.concatenate([half.reshape(-1, 3, 3) for half in halves])


def quaternions(R: Float[np.ndarray, "*batch 3 3"]) -> Float[np.ndarray, "*batch 4"]:
    """Unit quaternions of rotations, w x y z, shape (..., 4).

    Source: Shepperd (1978), the largest of the four squares first.
    """
    xx, yy, zz = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    products = np.empty((*R.shape[:-2], 4, 4))
    products[..., 0, 0], products[..., 1, 1] = 1 + xx + yy + zz, 1 + xx - yy - zz
    products[..., 2, 2], products[..., 3, 3] = 1 - xx + yy - zz, 1 - xx - yy + zz
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1)), start=1):
        products[..., 0, k] = products[..., k, 0] = R[..., j, i] - R[..., i, j]
        products[..., i + 1, j + 1] = products[..., j + 1, i + 1] = R[..., i, j] + R[..., j, i]
    largest = np.argmax(np.einsum("...kk->...k", products), axis=-1)
    row = np.take_along_axis(products, largest[..., None, None], axis=-2)[..., 0, :]
    return row / np.linalg.norm(row, axis=-1, keepdims=True)
