"""Bounds of the grounds from geometry, static balance and static torque, without a controller.

Beyond the bound a necessary condition of a statically stable walk fails. Within it a walk may fail
all the same. The body moves forward over one period of the ground through neighbouring heights and
pitches at which all of these conditions hold:

- *reach*: the three legs of a tripod have footholds within their joint limits;
- *clearance*: the trunk's underside is above the ground;
- *tilt*: the pitch relative to the slope is at most that of a run that passes;
- *balance*: their footholds in reach surround the centre of mass;
- *friction*: the slope is within the friction cone;
- *torque*: a tripod can carry the weight within the stall torque, each leg at its best foothold.

At one of these poses at least, each leg must reach a point over the edge while the other tripod
stands (*lift*).

Assumptions: the robot walks straight along the ground, without roll and not back. Legs do not
collide. No foot stands on the floor of a gap or between stepping stones. The centre of mass of each
leg may be wherever its joints allow. Poses and footholds are sampled; bounds are the largest sizes
that pass.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_dilation, binary_propagation

from ground import GROUNDS, LARGEST_TILT, ROBOT
from phasmid.dynamics import BodyMotion, inverse_dynamics
from phasmid.kinematics import (
    centre_of_mass,
    hip_from_body,
    jacobian,
    joint_angles,
    link_frames,
    rotation_rpy,
    within_reach,
)
from phasmid.kinematics.workspace import usable_limits
from phasmid.robot import Robot, load_robot
from phasmid.scenario import Scenario
from phasmid.simulation.termination import UNDERSIDE
from phasmid.terrain import Blocks, Blocky, Flat, Shape, Slope, Steps
from phasmid.units import STANDARD_GRAVITY

from .study import Case, markdown

CONDITIONS = "clearance", "tilt", "balance", "friction", "torque", "lift"
"""Conditions that can be left out; balance and lift depend on reach."""

ALONG, ACROSS = np.linspace(-1, 1, 41), np.linspace(-0.2, 1, 9)
"""Footholds from the hip along the path and outwards, in lengths of the leg."""

HIGHEST, HEIGHT_STEP = 1.3, 0.05
"""Largest height of the body over the highest ground, and step of its heights, in lengths of the
leg."""

PITCHES = np.radians(np.arange(-60, 61, 5.0))
"""Pitches of the body relative to the slope [rad]."""

JOINT_ANGLES = 9
"""Angles of each joint at which a leg's centre of mass is computed."""

PLACES, TOLERANCE = 9, 0.5
"""Places of the body in a period; tolerance of a bound [mm or °]."""

APPROACH = 0.4
"""Way to the first beam [m]."""

BESIDE, NEAR = 1e-6, 0.5
"""Distance of the nearest foothold from an edge, and of the edges from the body [m]."""

DIRECTIONS = np.stack([f(2 * np.pi * np.arange(8) / 8) for f in (np.cos, np.sin)], axis=1)
"""Directions in which footholds must lie from the centre of mass, shape (8, 2)."""


@dataclass(frozen=True, eq=False)
class Obstacle:
    """Ground at one size, along x.

    Attributes:
        shape: Surface with footholds.
        places: Places of the body to be passed, from the first to the last [m].
        offsets: Lateral offsets of the path, one of which must do [m].
        floor: Height at and below which no foot stands [m].
        highest: Height of narrow ground below trunk and swings, without footholds [m].
        slope: Angle of the ground [rad].
    """

    shape: Shape
    places: Float[np.ndarray, " places"]
    offsets: tuple[float, ...] = (0.0,)
    floor: float = -math.inf
    highest: float = -math.inf
    slope: float = 0.0

    def height(
        self, points: Float[np.ndarray, "*batch axes"], offset: float
    ) -> Float[np.ndarray, "*batch"]:
        """Return the height of the ground at points beside the path [m], shape (...)."""
        x, y = points[..., 0], points[..., 1] + offset
        return self.shape.surface(x.ravel(), y.ravel())[0].reshape(x.shape)

    @cached_property
    def edges(self) -> Float[np.ndarray, " edges"]:
        """Places along x where the height changes [m]."""
        blocks = self.shape.blocks if isinstance(self.shape, Blocky) else ()
        return np.unique([u for block in blocks for u in block.u])

    @property
    def has_edges(self) -> bool:
        """Whether feet must be lifted over edges or narrow ground."""
        return bool(len(self.edges)) or math.isfinite(self.highest)

    def edges_near(self, place: float, legs: int) -> Float[np.ndarray, "edges legs"]:
        """Return the edges within `NEAR` of a place, once for each leg [m]."""
        near = self.edges[np.abs(self.edges - place) < NEAR]
        return np.repeat(near[:, None], legs, axis=1)


def period(length: float) -> Float[np.ndarray, " places"]:
    """Return places of the body along one period of a ground [m]."""
    return np.linspace(0.0, length, PLACES)


def fixed(kind: str) -> dict[str, float]:
    """Return the other measures of a kind of ground [m]."""
    return {name: value / 1000 for name, value in GROUNDS[kind].fixed.items()}


def blocks(size: float) -> Obstacle:
    """Return the worst case: feet on the lowest blocks, and the highest ones between them."""
    height = size / 1000
    return Obstacle(Flat(), np.zeros(1), highest=height)


def slope(size: float) -> Obstacle:
    """Return a slope."""
    return Obstacle(Slope(math.radians(size)), np.zeros(1), slope=math.radians(size))


def stairs(size: float) -> Obstacle:
    """Return stairs without end."""
    rise, run, edges = size / 1000, fixed("stairs")["run_mm"], np.arange(-20, 20)
    shape = Steps(tuple(run * edges), tuple(rise * (edges + 1)))
    return Obstacle(shape, period(run))


def gap(size: float) -> Obstacle:
    """Return a gap."""
    width, depth = size / 1000, fixed("gap")["gap_depth_mm"]
    shape = Steps.gap(0.0, width=width, depth=depth)
    return Obstacle(shape, np.linspace(0.0, width, PLACES), floor=-depth)


def beams(size: float) -> Obstacle:
    """Return the way from level ground to behind the first beam."""
    height, width, distance = size / 1000, *fixed("beams").values()
    shape = Steps.beams(0.0, width=width, height=height, distance=distance, count=20)
    return Obstacle(shape, np.linspace(-APPROACH, distance, 15))


def stepping_stones(size: float) -> Obstacle:
    """Return level stones in the middle of their cells, every second row moved by half a cell."""
    distance, side = size / 1000, fixed("stepping stones")["stone_size_mm"]
    depth, length = fixed("stepping stones")["gap_depth_mm"], 20 * distance
    shape = Blocks(side, distance - side, 0.0, depth, -length / 2, length, length, jitter=0.0)
    # Other offsets mirror these.
    offsets = (0.0, distance / 4, distance / 2)
    return Obstacle(shape, period(2 * distance), offsets, floor=-depth)


KINDS: dict[str, tuple[Callable[[float], Obstacle], float, float]] = {
    "blocks": (blocks, 0.0, 400.0),
    "slope": (slope, 0.0, 45.0),
    "stairs": (stairs, 0.0, 400.0),
    "gap": (gap, 1.0, 1000.0),
    "beams": (beams, 0.0, 400.0),
    "stepping stones": (stepping_stones, 101.0, 1000.0),
}
"""Kinds of ground: obstacle of a size, and the least and largest size [mm or °]."""


@dataclass(frozen=True, eq=False)
class Walker:
    """A robot whose poses and footholds are tested.

    Attributes:
        robot: The robot, L legs.
        friction: Coefficient of Coulomb friction.
    """

    robot: Robot
    friction: float = Scenario().terrain.friction

    @cached_property
    def reach(self) -> float:
        """Length of the longest leg [m]."""
        return float(self.robot.arrays.lengths.sum(axis=1).max())

    @property
    def height_step(self) -> float:
        """Step of the heights of the body [m]."""
        return HEIGHT_STEP * self.reach

    @cached_property
    def neutral(self) -> Float[np.ndarray, "legs 3"]:
        """Joint angles of the neutral feet [rad], shape (L, 3)."""
        return joint_angles(self.robot.arrays, self.robot.arrays.neutral_foot)

    @cached_property
    def com_shift(self) -> float:
        """Farthest displacement of the centre of mass by the legs [m]."""
        angles = [
            np.meshgrid(*(np.linspace(*pair, JOINT_ANGLES) for pair in usable_limits(leg)))
            for leg in self.robot.legs
        ]
        q = np.stack([np.reshape(grid, (3, -1)).T for grid in angles], axis=1)
        arrays = self.robot.arrays

        def moments(q: np.ndarray) -> np.ndarray:
            frames = link_frames(self.robot, q)
            links = frames.position + (frames.rotation @ arrays.com[..., None])[..., 0]
            return np.einsum("lk,...lki->...li", arrays.mass, links)

        away = np.linalg.norm(moments(q) - moments(self.neutral), axis=-1)
        return float(away.max(axis=0).sum() / self.robot.mass)

    def passes(self, obstacle: Obstacle, ignored: str = "") -> bool:
        """Return whether all conditions hold on a ground, with one of `CONDITIONS` ignored."""
        if ignored != "friction" and math.tan(obstacle.slope) > self.friction:
            return False
        return any(self._passes(obstacle, offset, ignored) for offset in obstacle.offsets)

    def _passes(self, obstacle: Obstacle, offset: float, ignored: str) -> bool:
        legs = np.arange(len(self.robot.legs))
        lifts = np.full(len(legs), ignored == "lift" or not obstacle.has_edges)
        x, step = obstacle.places, self.height_step
        ground = obstacle.height(np.stack([x, 0 * x], axis=1), offset)
        top = max(ground.max(), obstacle.highest) + HIGHEST * self.reach
        heights = np.arange(ground.min(), top, step)
        pitches = PITCHES if ignored == "tilt" else PITCHES[np.abs(PITCHES) <= LARGEST_TILT + 1e-9]
        # From place to place a body rises by no more than it moves ahead.
        rise = math.ceil(np.diff(x, append=x[-1]).max() / step)
        beside = np.ones((1 + 2 * rise, 3))
        connected = np.ones((len(heights), len(pitches)), dtype=bool)
        for place in x:
            height, pitch = np.meshgrid(heights, pitches, indexing="ij")
            position = np.stack([np.full(height.shape, place), 0 * height, height], axis=-1)
            R = rotation_rpy(0 * pitch, pitch - obstacle.slope, 0 * pitch)
            clear = ignored == "clearance" or self._clear(obstacle, offset, position, R)
            at = np.nonzero(np.broadcast_to(clear, height.shape))
            position, R = position[at], R[at]
            feet = self._footholds(obstacle, place, offset)
            reached = self._reached(feet, position, R)
            com = (position + R @ centre_of_mass(self.robot, self.neutral))[:, :2] @ DIRECTIONS.T
            least = com - (math.inf if ignored == "balance" else self.com_shift)
            along = [np.where(reached, feet[..., :2] @ way, -math.inf) for way in DIRECTIONS]
            farthest = np.stack([each.max(axis=1) for each in along], axis=-1)
            # Of a hexapod every second leg belongs to a tripod.
            stands = [
                (farthest[:, k::2].max(axis=1) >= least).all(axis=1)
                & np.isfinite(farthest[:, k::2, 0]).all(axis=1)
                for k in range(2)
            ]
            good = np.zeros_like(connected)
            good[at] = stands[0] | stands[1]
            connected = binary_propagation(binary_dilation(connected, beside) & good, mask=good)
            good = connected[at]
            if ignored != "torque" and not any(
                self._carry(feet, reached[pose], position[pose], R[pose])
                for pose in np.flatnonzero(good)
            ):
                return False
            if not good.any():
                return False
            over = self._crests(obstacle, place, offset)
            for leg in legs[~lifts]:
                free = good & stands[1 - leg % 2]
                lifts[leg] = self._reached(over, position[free], R[free])[..., leg].any()
        return bool(lifts.all())

    def _clear(
        self,
        obstacle: Obstacle,
        offset: float,
        position: Float[np.ndarray, "*poses 3"],
        R: Float[np.ndarray, "*poses 3 3"],
    ) -> Bool[np.ndarray, "*poses"]:
        """Return the poses at which the trunk's underside is above the ground."""
        points = UNDERSIDE * self.robot.body.size / 2
        under = position[..., None, :] + points @ np.swapaxes(R, -1, -2)
        ground = np.maximum(obstacle.height(under, offset), obstacle.highest)
        return np.asarray((under[..., 2] >= ground).all(axis=-1))

    def _points(
        self, obstacle: Obstacle, x: Float[np.ndarray, "along legs"], offset: float
    ) -> Float[np.ndarray, "footholds legs 3"]:
        """Return points of the ground at places along x and at all distances outwards [m]."""
        hips = self.robot.arrays.p_body_hip
        y = hips[:, 1] + ACROSS[:, None] * self.reach * np.sign(hips[:, 1])
        points = np.zeros((len(x), len(y), len(hips), 3))
        points[..., 0], points[..., 1] = x[:, None], y
        points[..., 2] = obstacle.height(points, offset)
        return points.reshape(-1, len(hips), 3)

    def _footholds(
        self, obstacle: Obstacle, place: float, offset: float
    ) -> Float[np.ndarray, "footholds legs 3"]:
        """Return points of the ground around the hips [m]; NaN heights where no foot stands."""
        around = place + self.robot.arrays.p_body_hip[:, 0] + ALONG[:, None] * self.reach
        edges = obstacle.edges_near(place, len(self.robot.legs))
        x = np.concatenate([around, edges - BESIDE, edges + BESIDE])
        feet = self._points(obstacle, x, offset)
        feet[feet[..., 2] <= obstacle.floor + BESIDE, 2] = math.nan
        return feet

    def _crests(
        self, obstacle: Obstacle, place: float, offset: float
    ) -> Float[np.ndarray, "crests legs 3"]:
        """Return points over the edges, or over the narrow ground between the footholds [m]."""
        if math.isfinite(obstacle.highest):
            over = self._footholds(obstacle, place, offset)
            over[..., 2] = obstacle.highest
            return over
        edges = obstacle.edges_near(place, len(self.robot.legs))
        before, over = (self._points(obstacle, edges + side, offset) for side in (-BESIDE, BESIDE))
        over[..., 2] = np.maximum(before[..., 2], over[..., 2])
        return over

    def _reached(
        self,
        feet: Float[np.ndarray, "footholds legs 3"],
        position: Float[np.ndarray, "poses 3"],
        R: Float[np.ndarray, "poses 3 3"],
    ) -> Bool[np.ndarray, "poses footholds legs"]:
        """Return which points each leg reaches within its joint limits."""
        p_body = (feet - position[:, None, None]) @ R[:, None]
        return within_reach(self.robot, hip_from_body(self.robot, p_body)) > 0

    def _carry(
        self,
        feet: Float[np.ndarray, "footholds legs 3"],
        reached: Bool[np.ndarray, "footholds legs"],
        position: Float[np.ndarray, "3"],
        R: Float[np.ndarray, "3 3"],
    ) -> bool:
        """Return whether the largest vertical forces of a tripod's legs add up to the weight.

        Each is the largest component of F = J⁻ᵀ (free - torque) within the stall torque, at any
        foothold and regardless of the horizontal components. A straight leg needs no torque.
        """
        robot = self.robot
        p_hip = hip_from_body(robot, (feet - position) @ R)
        q = joint_angles(
            robot.arrays, np.where(reached[..., None], p_hip, robot.arrays.neutral_foot)
        )
        count, still = len(q), np.zeros_like(q)
        at_rest = BodyMotion.at_rest(np.tile(position, (count, 1)), np.tile(R, (count, 1, 1)))
        free = inverse_dynamics(robot, at_rest, q, still, still).joint_torque
        up = np.linalg.inv(R @ robot.arrays.R_body_hip @ jacobian(robot.arrays, q))[..., :, 2]
        force = (up * free).sum(axis=-1) + np.abs(up).sum(axis=-1) * robot.servo.stall_torque
        largest = np.where(reached, force, 0.0).max(axis=0)
        return bool(max(largest[::2].sum(), largest[1::2].sum()) >= robot.mass * STANDARD_GRAVITY)


def bound(kind: str, walker: Walker) -> tuple[float, tuple[str, ...]]:
    """Return the bound of a kind of ground [mm or °], and the conditions that bind.

    A condition binds if the ground just beyond the bound passes without it. Without such a
    condition it is reach, or several at once. The bound is infinite where the largest size passes.
    """
    obstacle, low, high = KINDS[kind]
    if walker.passes(obstacle(high)):
        return math.inf, ()
    while high - low > TOLERANCE:
        middle = (low + high) / 2
        low, high = (middle, high) if walker.passes(obstacle(middle)) else (low, middle)
    beyond = obstacle(high + TOLERANCE)
    binding = tuple(name for name in CONDITIONS if walker.passes(beyond, name))
    return high, binding or ("reach",)


def cases(robots: tuple[str, ...] = (ROBOT,)) -> list[Case]:
    """Return every robot and kind of ground."""
    return [{"robot": robot, "kind": kind} for robot in robots for kind in KINDS]


def measure(robot: str, kind: str) -> Case:
    """Return the bound of one kind of ground for one robot."""
    size, binding = bound(kind, Walker(load_robot(robot)))
    return {"bound": size, "binding": list(binding)}


def table(results: list[Case]) -> str:
    """Return the table of the bounds."""
    rows = []
    for row in results:
        kind = GROUNDS[row["kind"]]
        unit = "°" if kind.unit == "°" else f" {kind.unit}"
        size = "none" if row["bound"] is None else f"{row['bound']:.0f}{unit}"
        what = kind.field.rpartition("_")[0].replace("_", " ")
        rows.append([row["kind"], what, size, ", ".join(row["binding"]) or "–"])
    return markdown(["ground", "size", "bound", "binding conditions"], rows)
