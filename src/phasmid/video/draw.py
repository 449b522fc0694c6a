"""The process that draws: a scene comes in, pictures go out; it knows the engine and nothing else.

A driver that crashes ends this process and not the program that asked; and the engine chooses its
way to draw when it is imported, which the program may have done long ago.
"""

from __future__ import annotations

import io
import os
import signal
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import mujoco

NEAR, FAR = 0.3, 3.0
"""Nearest and farthest that is drawn, in distances of the camera."""

SAMPLES, SHADOW_PIXELS = 4, 2048
"""Samples of each pixel, and pixels along the side of the map of shadows."""

WHITE = (1.0, 1.0, 1.0)


def main() -> int:
    """Read a scene from the standard input; write its pictures, red, green, blue, to the output."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with np.load(io.BytesIO(sys.stdin.buffer.read()), allow_pickle=False) as stored:
        scene = dict(stored)
    out = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    painter = Painter(scene)
    try:
        for frame in range(len(scene["eye"])):
            out.write(painter.picture(frame))
            out.flush()
    except BrokenPipeError:
        # Whoever asked wants no more.
        return 0
    return 0


class Painter:
    """Draws a scene's frames."""

    def __init__(self, scene: Mapping[str, np.ndarray]) -> None:
        import mujoco

        self._scene = scene
        self._width, self._height = (int(n) for n in scene["size"])
        self._model = _specification(scene).compile()
        self._data = mujoco.MjData(self._model)
        self._floor = self._model.geom("floor").id
        self._renderer = mujoco.Renderer(self._model, self._height, self._width)
        flags = self._renderer.scene.flags
        flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 1
        flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
        flags[mujoco.mjtRndFlag.mjRND_FOG] = 1
        flags[mujoco.mjtRndFlag.mjRND_HAZE] = 0

    def picture(self, frame: int) -> bytes:
        """One frame, row by row from the top."""
        import mujoco

        data, scene = self._data, self._scene
        data.mocap_pos[:] = scene["position"][frame]
        data.mocap_quat[:] = scene["orientation"][frame]
        mujoco.mj_kinematics(self._model, data)
        mujoco.mj_camlight(self._model, data)
        renderer = self._renderer
        renderer.update_scene(data)
        eye, (_, up, back) = scene["eye"][frame], scene["axes"][frame]
        focal, (across, down) = float(scene["focal"]), scene["shift"]
        near = NEAR * float(scene["distance"])
        for camera in renderer.scene.camera:
            camera.pos, camera.forward, camera.up = eye, -back, up
            camera.frustum_near, camera.frustum_far = near, FAR * float(scene["distance"])
            camera.frustum_top = down / focal * near
            camera.frustum_bottom = (down - self._height) / focal * near
            camera.frustum_center = (self._width / 2 - across) / focal * near
            camera.frustum_width = self._width / 2 / focal * near
            camera.orthographic = 0
        for geom in renderer.scene.geoms[: renderer.scene.ngeom]:
            if geom.objid == self._floor:
                # The ground casts no shadow: rounding would speckle it with its own.
                geom.category = mujoco.mjtCatBit.mjCAT_DECOR
        for light in renderer.scene.lights[: renderer.scene.nlight]:
            light.pos = scene["middle"][frame] + scene["light"] * float(scene["distance"])
        return bytes(renderer.render().tobytes())


def _specification(scene: Mapping[str, np.ndarray]) -> mujoco.MjSpec:
    """The scene as a model of the engine: bodies that are put where they are told."""
    import mujoco

    spec: Any = mujoco.MjSpec()
    width, height = (int(n) for n in scene["size"])
    visual = spec.visual
    visual.global_.offwidth, visual.global_.offheight = width, height
    visual.quality.offsamples, visual.quality.shadowsize = SAMPLES, SHADOW_PIXELS
    # These are told in multiples of the extent, which is the robot's size.
    spec.stat.extent = float(scene["reach"])
    spec.stat.center = scene["middle"][0]
    visual.map.shadowclip = 1.0
    visual.map.fogstart, visual.map.fogend = (float(d) / spec.stat.extent for d in scene["fog"])
    visual.rgba.fog = (*WHITE, 1.0)
    visual.headlight.ambient, visual.headlight.diffuse = [0.52] * 3, [0.18] * 3
    visual.headlight.specular = [0.08] * 3
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT,
        rgb1=WHITE,
        rgb2=WHITE,
        width=16,
        height=96,
    )
    spec.worldbody.add_light(
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        pos=scene["light"],
        dir=-scene["light"],
        diffuse=[0.44] * 3,
        ambient=[0.0] * 3,
        specular=[0.22] * 3,
        castshadow=True,
    )
    _add_floor(spec, scene)
    for body in range(scene["position"].shape[1]):
        spec.worldbody.add_body(name=f"link{body}", mocap=True)
    for k, (link, *colour) in enumerate(scene["pieces"]):
        name = f"piece{k}"
        _add_mesh(spec, name, scene)
        spec.add_material(name=name, rgba=(*colour, 1.0), specular=0.5, shininess=0.35)
        _add_geom(spec.body(f"link{int(link)}"), name)
    return spec


def _add_floor(spec: Any, scene: Mapping[str, np.ndarray]) -> None:
    import mujoco

    image = scene["floor_image"]
    texture = spec.add_texture(name="floor", type=mujoco.mjtTexture.mjTEXTURE_2D)
    texture.height, texture.width, texture.nchannel = image.shape
    texture.data = image.tobytes()
    material = spec.add_material(name="floor", specular=0.0, shininess=0.0)
    roles = [""] * int(mujoco.mjtTextureRole.mjNTEXROLE)
    roles[int(mujoco.mjtTextureRole.mjTEXROLE_RGB)] = "floor"
    material.textures = roles
    if "floor_vertices" in scene:
        _add_mesh(spec, "floor", scene)
        _add_geom(spec.worldbody, "floor")
        return
    # A plane without an end, whose picture is repeated.
    material.texuniform = True
    material.texrepeat = [1 / float(scene["floor_side"])] * 2
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0, 0, 0.1],
        pos=[0, 0, float(scene["floor_level"])],
        material="floor",
        contype=0,
        conaffinity=0,
    )


def _add_mesh(spec: Any, name: str, scene: Mapping[str, np.ndarray]) -> None:
    import mujoco

    mesh = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    mesh.uservert = scene[f"{name}_vertices"].ravel()
    mesh.usernormal = scene[f"{name}_normals"].ravel()
    mesh.userface = scene[f"{name}_faces"].ravel()
    mesh.userfacenormal = scene[f"{name}_faces"].ravel()
    if f"{name}_places" in scene:
        mesh.usertexcoord = scene[f"{name}_places"].ravel()
        mesh.userfacetexcoord = scene[f"{name}_faces"].ravel()


def _add_geom(body: Any, name: str) -> None:
    import mujoco

    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        material=name,
        contype=0,
        conaffinity=0,
        mass=0.0,
    )


if __name__ == "__main__":
    raise SystemExit(main())
