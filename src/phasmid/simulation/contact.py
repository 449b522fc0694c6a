"""Feet and ground in MuJoCo: contact points, their spring-damper law, terrain geometry."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.experiment import ContactLaw, Experiment
from phasmid.kinematics import joint_angles, leg_frames
from phasmid.robot import Leg, Robot
from phasmid.terrain import Blocky, Ground, Slope

if TYPE_CHECKING:
    import mujoco

GROUND = "world"
"""MuJoCo body that holds all ground geometry and nothing else."""

CONTACT_POINTS = 4
"""Contact points of a foot, each a small sphere with a spring and a damper; four in one place are
the ball of a foot."""

POINT_PRIORITY = 1
"""Priority of contact points: their own spring counts, not a mixture with the ground's."""

SOFT_TIME = 0.02
"""Time constant of MuJoCo's own contact [s]."""

BLOCK_BOTTOM = 1.0
"""Depth of terrain blocks below the lowest top [m]."""


# Feet and trunk -----------------------------------------------------------------------------------


def point_radius(robot: Robot, law: ContactLaw) -> float:
    """Return the radius of a robot's contact points [m]: that of its feet, or of the law."""
    return robot.foot_radius or law.point_radius


def foot_points(robot: Robot, leg: Leg, law: ContactLaw) -> Float[np.ndarray, "points 3"]:
    """Return the centres of a foot's contact points.

    They are at the corners of a square that is level at the neutral stance, with the foot in its
    plane. The points of a ball are all at its centre, which is the foot.

    Args:
        robot: The radius of its feet is used.
        leg: One of its legs.
        law: Its tip width and point radius are used.

    Returns:
        In tibia axes [m], shape (4, 3).
    """
    tip = leg.tibia.end
    if robot.foot_radius:
        return np.repeat(tip[None], CONTACT_POINTS, axis=0)
    X_hip_tibia = leg_frames(leg, joint_angles(leg, leg.neutral_foot))[2]
    forward, left, up = leg.R_level_hip @ X_hip_tibia[:3, :3]
    return np.stack(
        [
            tip + law.tip_width / 2 * (a * forward + b * left) + law.point_radius * up
            for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))
        ]
    )


def trunk_points(robot: Robot, law: ContactLaw) -> Float[np.ndarray, "points 3"]:
    """Return the contact points under a trunk that can lie, body axes [m], shape (4, 3)."""
    corners = np.array([[1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, -1.0], [-1.0, 1.0, -1.0]])
    points = robot.body.box_points(corners)
    points[:, 2] += law.point_radius
    return points


def point_name(owner: str, point: int) -> str:
    """Return the geom name of a contact point; `owner` is a leg's name or ``trunk``."""
    return f"{owner}.point{point}"


def add_points(
    body: mujoco.MjsBody,
    owner: str,
    points: Float[np.ndarray, "points 3"],
    radius: float,
    friction: list[float],
) -> None:
    """Add contact points of a radius [m], which touch the ground and not each other, to a body."""
    import mujoco

    for i, position in enumerate(points):
        body.add_geom(
            name=point_name(owner, i),
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[radius, 0.0, 0.0],
            pos=position,
            mass=0.0,
            condim=3,
            friction=friction,
            priority=POINT_PRIORITY,
            contype=0,
            conaffinity=1,
        )


def set_contact_law(model: mujoco.MjModel, law: ContactLaw) -> None:
    """Make contact points linear springs and dampers with constants in N/m and N·s/m.

    With a constant impedance d MuJoCo's force on a point of mobility A is
    (reference acceleration - acceleration) d / ((1 - d) A). Direct ``solref`` values of
    -K (1 - d) A and -B (1 - d) A, which MuJoCo divides by d² and d, make this
    K depth + B speed - m acceleration with m = d / ((1 - d) A). It is exact at rest.
    """
    d = law.impedance
    if law.kind == "mujoco":
        return
    points = np.flatnonzero(model.geom_priority == POINT_PRIORITY)
    # MuJoCo's own measure of the mobility of each point's body is known after compilation only.
    scale = (1 - d) * model.body_invweight0[model.geom_bodyid[points], 0]
    model.geom_solimp[points] = d, d, 0.001, 0.5, 2.0
    model.geom_solref[points, 0] = -law.stiffness * scale
    model.geom_solref[points, 1] = -law.damping * scale


# Ground -------------------------------------------------------------------------------------------


def add_ground(spec: mujoco.MjSpec, experiment: Experiment) -> list[float]:
    """Add the ground: a plane, or boxes; `add_foot_planes` adds curved ground.

    Returns:
        Friction coefficients: sliding, torsional, rolling.
    """
    import mujoco

    ground = experiment.world.terrain
    friction = [experiment.world.terrain.coefficient, 0.005, 0.0001]
    shape = ground.shape
    if isinstance(shape, Blocky):
        c, s = np.cos(ground.yaw), np.sin(ground.yaw)
        R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        bottom = min(block.top for block in shape.blocks) - BLOCK_BOTTOM
        for block in shape.blocks:
            low = np.array([block.u[0], block.v[0], bottom])
            high = np.array([block.u[1], block.v[1], block.top])
            spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX,
                size=(high - low) / 2,
                pos=R @ (high + low) / 2,
                quat=[np.cos(ground.yaw / 2), 0.0, 0.0, np.sin(ground.yaw / 2)],
                friction=friction,
            )
    elif not _is_curved(ground):
        origin = np.zeros(())
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[0, 0, 0.1],
            quat=_slope_quaternion(ground.surface(origin, origin)[1]),
            friction=friction,
        )
    return friction


def check_flat(experiment: Experiment) -> None:
    """Refuse curved ground, which has planes for the feet only, for a trunk that can lie.

    Raises:
        InvalidInput: The ground is curved.
    """
    if _is_curved(experiment.world.terrain):
        raise InvalidInput(
            f'terrain is "{experiment.world.kind}"; a trunk can lie on flat ground, on a slope '
            "and on what is built of blocks alone.",
            where="simulation",
            hint='start_posture = "standing" and belly_contact = false',
        )


def add_foot_planes(spec: mujoco.MjSpec, experiment: Experiment) -> None:
    """Give each foot a tangent plane of its own where the ground is curved.

    A height field would touch a small contact point with several prisms at once and push it
    sideways at their inner edges; on a plane the contact law is that of level ground.
    """
    import mujoco

    if not _is_curved(experiment.world.terrain):
        return
    # MuJoCo's midphase uses bounding boxes of the geoms as they lay when the model was compiled.
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_MIDPHASE)
    for number, leg in enumerate(experiment.robot.legs):
        spec.worldbody.add_geom(
            name=_plane_name(leg),
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[0, 0, 0.1],
            contype=1 << number,
            conaffinity=0,
        )
        for i in range(CONTACT_POINTS):
            spec.geom(point_name(leg.name, i)).conaffinity = 1 << number


class FootGround:
    """Tangent planes and friction coefficients under the feet, where they depend on the place.

    Attributes:
        varies: Whether `update` must be called before each step.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, ground: Ground
    ) -> None:
        self._model, self._data, self._ground = model, data, ground
        self._radius = robot.foot_radius
        names = [point_name(leg.name, i) for leg in robot.legs for i in range(CONTACT_POINTS)]
        self._points = np.array([model.geom(name).id for name in names])
        self._sites = np.array([model.site(f"{leg.name}.foot").id for leg in robot.legs])
        self._planes = None
        if _is_curved(ground):
            self._planes = np.array([model.geom(_plane_name(leg)).id for leg in robot.legs])
            # The planes move, so that they have not their body's frame.
            model.geom_sameframe[self._planes] = 0
        self.varies = self._planes is not None or bool(ground.patches)

    def update(self) -> None:
        """Place the planes and set the friction for the present positions of the feet."""
        import mujoco

        model, data, ground = self._model, self._data, self._ground
        # mj_step leaves the positions of the feet as they were at its beginning.
        mujoco.mj_kinematics(model, data)
        if self._planes is not None:
            position = data.site_xpos[self._sites]
            if self._radius:
                # A ball touches beneath its centre along the normal.
                normal = ground.normal(position[:, 0], position[:, 1])
                position[:, :2] -= self._radius * normal[:, :2]
            position[:, 2], slope = ground.surface(position[:, 0], position[:, 1])
            model.geom_pos[self._planes] = position
            model.geom_quat[self._planes] = _slope_quaternion(slope)
        if ground.patches:
            x, y, _ = data.geom_xpos[self._points].T
            model.geom_friction[self._points, 0] = ground.friction(x, y)


def _is_curved(ground: Ground) -> bool:
    is_plane = ground.is_level or (isinstance(ground.shape, Slope) and ground.shape.start is None)
    return not is_plane and not isinstance(ground.shape, Blocky)


def _plane_name(leg: Leg) -> str:
    return f"{leg.name}.ground"


def _slope_quaternion(slope: Float[np.ndarray, "*batch 2"]) -> Float[np.ndarray, "*batch 4"]:
    """Return the shortest rotation from the vertical to the normal of a slope, (..., 4)."""
    p, q = slope[..., 0], slope[..., 1]
    up = 1 / np.sqrt(1 + p * p + q * q)
    half = 1 / np.sqrt(2 + 2 * up)
    return np.stack([(1 + up) * half, q * up * half, -p * up * half, np.zeros_like(p)], axis=-1)
