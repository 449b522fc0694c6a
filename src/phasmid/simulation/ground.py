"""The ground in the engine."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.robot import Robot
from phasmid.scenario import Scenario
from phasmid.simulation.contact import CONTACT_POINTS, point_name
from phasmid.terrain import Blocky, Ground, Slope

if TYPE_CHECKING:
    import mujoco

GROUND = "world"
"""Body to which all that the feet stand on belongs in the engine's model, and nothing else."""

BLOCK_BOTTOM = 1.0
"""How far the blocks of a terrain reach below its lowest point [m]."""


def add_ground(spec: mujoco.MjSpec, scenario: Scenario) -> list[float]:
    """Put the ground into the engine's model.

    Level ground and a plane slope are one plane; what is built of blocks is boxes. Curved ground
    is not there before `follow_feet` gives each foot a plane of its own.

    Returns:
        Friction coefficients as the engine takes them: sliding, torsional, rolling.
    """
    import mujoco

    ground = scenario.load_terrain()
    friction = [scenario.terrain.friction, 0.005, 0.0001]
    shape = ground.shape
    if isinstance(shape, Blocky):
        half = ground.yaw / 2
        turn = [np.cos(half), 0.0, 0.0, np.sin(half)]
        bottom = min(block.top for block in shape.blocks) - BLOCK_BOTTOM
        for block in shape.blocks:
            low = np.array([block.u[0], block.v[0], bottom])
            high = np.array([block.u[1], block.v[1], block.top])
            spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX,
                size=(high - low) / 2,
                pos=_turned((high + low) / 2, ground.yaw),
                quat=turn,
                friction=friction,
            )
    elif not _has_tangents(ground):
        here = np.zeros(())
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[0, 0, 0.1],
            quat=_tilt(ground.surface(here, here)[1]),
            friction=friction,
        )
    return friction


def check_flat(scenario: Scenario) -> None:
    """Refuse ground on which no trunk can lie.

    Raises:
        InvalidInput: It is curved: each foot stands on a plane of its own there, the trunk on none.
    """
    if _has_tangents(scenario.load_terrain()):
        raise InvalidInput(
            f'terrain is "{scenario.terrain.kind}"; a trunk can lie on flat ground, on a slope '
            "and on what is built of blocks alone.",
            where="simulation",
            hint='start_posture = "standing" and belly_contact = false',
        )


def _has_tangents(ground: Ground) -> bool:
    """Whether the ground is curved, so that each foot stands on a tangent plane of its own."""
    plane = ground.is_level or (isinstance(ground.shape, Slope) and ground.shape.start is None)
    return not plane and not isinstance(ground.shape, Blocky)


def _turned(point: Float[np.ndarray, "3"], yaw: float) -> Float[np.ndarray, "3"]:
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([c * point[0] - s * point[1], s * point[0] + c * point[1], point[2]])


def _tilt(slope: Float[np.ndarray, "*batch 2"]) -> Float[np.ndarray, "*batch 4"]:
    """Quaternion that tilts the vertical to a slope's normal the shortest way, shape (..., 4)."""
    p, q = slope[..., 0], slope[..., 1]
    up = 1 / np.sqrt(1 + p * p + q * q)
    half = 1 / np.sqrt(2 + 2 * up)
    turn = np.zeros((*slope.shape[:-1], 4))
    turn[..., 0] = (1 + up) * half
    turn[..., 1] = q * up * half
    turn[..., 2] = -p * up * half
    return turn


def add_tangents(spec: mujoco.MjSpec, robot: Robot, scenario: Scenario) -> None:
    """Give each foot a plane of its own where the ground is curved.

    A height field of the engine would touch a small contact point with several prisms at once, and
    push it sideways at their inner edges; on a plane the contact law is that of level ground.
    """
    import mujoco

    if not _has_tangents(scenario.load_terrain()):
        return
    # The engine sorts out far pairs by boxes about geoms as they lay when the model was compiled.
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_MIDPHASE)
    for number, leg in enumerate(robot.legs):
        spec.worldbody.add_geom(
            name=_tangent(leg.name),
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[0, 0, 0.1],
            contype=1 << number,
            conaffinity=0,
        )
        for i in range(CONTACT_POINTS):
            spec.geom(point_name(leg, i)).conaffinity = 1 << number


def _tangent(leg: str) -> str:
    return f"{leg}.ground"


class Footing:
    """What of the ground depends on where the feet are: their tangent planes, and friction.

    Attributes:
        needed: Whether anything does; `follow` is called before each step only then.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, ground: Ground
    ) -> None:
        self._model, self._data, self._ground = model, data, ground
        names = [point_name(leg, i) for leg in robot.legs for i in range(CONTACT_POINTS)]
        self._points = np.array([model.geom(name).id for name in names])
        self._sites = np.array([model.site(f"{leg.name}.foot").id for leg in robot.legs])
        self._planes = None
        if _has_tangents(ground):
            self._planes = np.array([model.geom(_tangent(leg.name)).id for leg in robot.legs])
            # The engine must not take them for planes that stay at their body's origin.
            model.geom_sameframe[self._planes] = 0
        self.needed = self._planes is not None or bool(ground.patches)

    def follow(self) -> None:
        """Set the planes' places and the points' friction by where the feet are now."""
        import mujoco

        model, data, ground = self._model, self._data, self._ground
        # A step leaves the feet's places as they were at its beginning.
        mujoco.mj_kinematics(model, data)
        if self._planes is not None:
            place = data.site_xpos[self._sites]
            place[:, 2], slope = ground.surface(place[:, 0], place[:, 1])
            model.geom_pos[self._planes] = place
            model.geom_quat[self._planes] = _tilt(slope)
        if ground.patches:
            x, y, _ = data.geom_xpos[self._points].T
            model.geom_friction[self._points, 0] = ground.friction(x, y)
