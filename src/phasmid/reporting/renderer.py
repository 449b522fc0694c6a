"""Pictures of a robot on its terrain, by the engine's renderer.

The figure of a walk, the video and the documentation draw with it. Where there is no OpenGL,
`opengl_lack` names the missing package.
"""

from __future__ import annotations

import ctypes
import math
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float, UInt8

from phasmid.errors import OutputError, plain
from phasmid.extras import install_hint
from phasmid.reporting.camera import FAR, View
from phasmid.reporting.robot_mesh import link_poses, mesh_pieces, quaternions
from phasmid.reporting.style import rgb
from phasmid.reporting.terrain_mesh import CELL, floor_image, landscape
from phasmid.robot import Robot
from phasmid.terrain import Blocky, Ground

if TYPE_CHECKING:
    import mujoco

SURROUNDINGS = 2.6
"""Distance from the robot's path to the edge of uneven ground [m]."""

MOST_CELLS = 280
"""Most cells along a side of curved ground."""

TILE, PIXELS = 256, 2048
"""Pixels along the side of the ground's texture: repeated on level ground, and elsewhere."""

OFF = ("disable", "disabled", "off", "false", "0")
"""Values of ``MUJOCO_GL`` that forbid all drawing."""

Segment = tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"], float, str]
"""Start and end [m], radius [m] and colour of a rod without a shadow."""


@dataclass(frozen=True)
class Lack:
    """A prerequisite of drawing that this machine lacks.

    Attributes:
        what: Its name, to follow "needs".
        advice: Remedy.
        why: Reason, to follow the name.
    """

    what: str
    advice: str
    why: str = "which was not found"

    @property
    def sentence(self) -> str:
        """The lack in words, without a full stop."""
        return f"video needs {self.what}, {self.why}"


def gl_backend() -> str:
    """Return the engine's GL backend: that of ``MUJOCO_GL``, or one without a window."""
    own = os.environ.get("MUJOCO_GL", "").lower().strip()
    if own:
        return own
    if sys.platform == "linux":
        try:
            ctypes.CDLL("libEGL.so.1")
        except OSError:
            return "osmesa"
        return "egl"
    return "cgl" if sys.platform == "darwin" else "glfw"


@cache
def opengl_lack() -> Lack | None:
    """Return the missing requirement of the renderer, or None; a failing driver is absent."""
    backend = gl_backend()
    if backend in OFF:
        return Lack("OpenGL", "unset MUJOCO_GL", f"which MUJOCO_GL={backend} forbids")
    if backend == "glfw" and find_spec("glfw") is None:
        return Lack("glfw", install_hint("video"))
    try:
        import mujoco

        _renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), (16, 16)).close()
    except Exception:  # Drivers and their loaders raise errors of all kinds.
        if sys.platform == "linux":
            advice = "apt install libegl1 libgl1-mesa-dri, or libosmesa6"
            return Lack("OpenGL without a window (EGL or OSMesa)", advice)
        return Lack("OpenGL", "a driver of the graphics card")
    return None


def _renderer(model: mujoco.MjModel, size: tuple[int, int]) -> mujoco.Renderer:
    import mujoco
    from mujoco.rendering.classic import gl_context

    # The engine chooses its context when it is imported, by default one that needs a window.
    gl_context.GLContext = import_module(f"mujoco.{gl_backend()}").GLContext
    return mujoco.Renderer(model, size[1], size[0])


class SceneRenderer:
    """Pictures of a robot on its terrain.

    Args:
        robot: The robot.
        terrain: The terrain.
        path: Positions of the body, around which uneven ground is drawn [m], shape (N, 2).
        view: The camera; each picture has its size.
        square: Side of the squares on the ground [m].

    Raises:
        OutputError: The renderer fails.
    """

    def __init__(
        self,
        robot: Robot,
        terrain: Ground,
        path: Float[np.ndarray, "time 2"],
        view: View,
        square: float,
    ) -> None:
        import mujoco

        self._robot, self._size = robot, view.size
        self._pieces = mesh_pieces(robot)
        spec = self._specification(view)
        _add_floor(spec, terrain, path, square)
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        try:
            self._renderer = _renderer(self._model, view.size)
        except Exception as error:
            raise OutputError(f"the renderer could not be created: {plain(str(error))}.") from error
        flags = self._renderer.scene.flags
        flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 1
        flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
        flags[mujoco.mjtRndFlag.mjRND_FOG] = 1
        flags[mujoco.mjtRndFlag.mjRND_HAZE] = 0

    def picture(
        self,
        view: View,
        X_world_body: Float[np.ndarray, "4 4"],
        q: Float[np.ndarray, "legs 3"],
        segments: Sequence[Segment] = (),
    ) -> UInt8[np.ndarray, "height width 3"]:
        """Return the robot at one moment, row by row from the top.

        Args:
            view: The camera, of the renderer's size.
            X_world_body: Pose of the body.
            q: Joint angles [rad], shape (L, 3).
            segments: Rods drawn besides.
        """
        import mujoco

        X = np.concatenate(
            [np.eye(4)[None], link_poses(self._robot, q[None], self._pieces.links)[0]]
        )
        X = X_world_body @ X
        self._data.mocap_pos[:] = X[:, :3, 3]
        self._data.mocap_quat[:] = quaternions(X[:, :3, :3])
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        camera = mujoco.MjvCamera()
        x, y, z = view.axes[2]
        camera.lookat, camera.distance = view.middle, view.distance
        camera.azimuth = math.degrees(math.atan2(-y, -x))
        camera.elevation = -math.degrees(math.asin(z))
        self._renderer.update_scene(self._data, camera)
        scene = self._renderer.scene
        floor = self._model.geom("floor").id
        for geom in scene.geoms[: scene.ngeom]:
            if geom.objid == floor:
                # The ground casts no shadow: rounding would speckle it with its own.
                geom.category = mujoco.mjtCatBit.mjCAT_DECOR
        for light in scene.lights[: scene.nlight]:
            light.pos = view.middle - view.distance * light.dir
        for start, end, radius, colour in segments:
            _add_rod(scene, start, end, radius, colour)
        return np.asarray(self._renderer.render())

    def close(self) -> None:
        """Free the renderer's memory."""
        self._renderer.close()

    def _specification(self, view: View) -> mujoco.MjSpec:
        """Return the robot as a model of bodies that are placed directly, under a light."""
        import mujoco

        spec: Any = mujoco.MjSpec.from_file(str(Path(__file__).with_name("scene.xml")))
        look = spec.visual.global_
        look.offwidth, look.offheight = view.size
        look.fovy = math.degrees(2 * math.atan(view.size[1] / 2 / view.focal))
        spec.stat.extent, spec.stat.center = 1.5 * view.distance / FAR, view.middle
        for k, (vertices, faces) in enumerate(self._pieces.meshes):
            _add_mesh(spec, f"mesh{k}", vertices, faces)
        bodies = [
            spec.worldbody.add_body(name=f"link{k}", mocap=True)
            for k in range(1 + len(self._pieces.links))
        ]
        for k, (link, mesh, colour) in enumerate(self._pieces.pieces):
            name = f"material{k}"
            spec.add_material(name=name, rgba=(*colour, 1.0), specular=0.5, shininess=0.35)
            _add_geom(bodies[link + 1], f"piece{k}", name, meshname=f"mesh{mesh}")
        return spec


def _add_rod(scene: Any, start: np.ndarray, end: np.ndarray, radius: float, colour: str) -> None:
    import mujoco

    kind = mujoco.mjtGeom.mjGEOM_CAPSULE
    geom = scene.geoms[scene.ngeom]
    rgba = np.array([*rgb(colour), 1.0], dtype=np.float32)
    mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), rgba)
    mujoco.mjv_connector(geom, kind, radius, start, end)
    geom.category = mujoco.mjtCatBit.mjCAT_DECOR
    scene.ngeom += 1


def _add_floor(
    spec: Any, terrain: Ground, path: Float[np.ndarray, "time 2"], square: float
) -> None:
    """Add the ground: a plane of squares, or a mesh with its colours as a texture."""
    import mujoco

    is_plane = terrain.is_level and not terrain.patches
    low, high = path.min(axis=0), path.max(axis=0)
    size = 2 * square if is_plane else float((high - low).max()) + 2 * SURROUNDINGS
    corner = np.zeros(2) if is_plane else (low + high - size) / 2
    image = floor_image(corner, size, TILE if is_plane else PIXELS, square, terrain)
    texture = spec.add_texture(name="floor", type=mujoco.mjtTexture.mjTEXTURE_2D)
    texture.height, texture.width, texture.nchannel = image.shape
    texture.data = image.tobytes()
    material = spec.add_material(name="floor", specular=0.0, shininess=0.0)
    roles = [""] * int(mujoco.mjtTextureRole.mjNTEXROLE)
    roles[int(mujoco.mjtTextureRole.mjTEXROLE_RGB)] = "floor"
    material.textures = roles
    if is_plane:
        material.texuniform, material.texrepeat = True, [1 / size] * 2
        plane = mujoco.mjtGeom.mjGEOM_PLANE
        _add_geom(spec.worldbody, "floor", "floor", type=plane, size=[0, 0, 0.1])
        return
    cell = max(CELL, size / MOST_CELLS)
    vertices, faces = landscape(terrain, corner + size / 2, size / 2, cell)
    if isinstance(terrain.shape, Blocky):
        # MuJoCo shades across the edges of triangles that share vertices.
        vertices, faces = vertices[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)
    _add_mesh(spec, "floor", vertices, faces, (vertices[:, :2] - corner) / size)
    _add_geom(spec.worldbody, "floor", "floor", meshname="floor")


def _add_mesh(
    spec: Any,
    name: str,
    vertices: np.ndarray,
    faces: np.ndarray,
    texture_places: np.ndarray | None = None,
) -> None:
    import mujoco

    mesh = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    mesh.uservert, mesh.userface = vertices.ravel(), faces.ravel().astype(np.int32)
    if texture_places is not None:
        mesh.usertexcoord, mesh.userfacetexcoord = texture_places.ravel(), mesh.userface


def _add_geom(body: Any, name: str, material: str, **shape: Any) -> None:
    """Add a geom that touches nothing, by default a mesh."""
    import mujoco

    shape = {"type": mujoco.mjtGeom.mjGEOM_MESH, "mass": 0.0} | shape
    body.add_geom(name=name, material=material, contype=0, conaffinity=0, **shape)
