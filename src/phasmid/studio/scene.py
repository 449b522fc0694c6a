"""What a page shows of the live robot: the scene once, and thirty times a second a row of numbers.

The scene's keys are those of the report's replay; what the replay has for each frame, the rows
have. `Scene.layout` tells what stands where in a row.
"""

from __future__ import annotations

import math
import time
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid import kinematics
from phasmid.errors import PhasmidError
from phasmid.forces import ModelLoad, holding_forces
from phasmid.gait import support_margin
from phasmid.reporting.robot_mesh import Place, mesh_pieces, quaternions
from phasmid.reporting.webpage.replay import looks, surroundings
from phasmid.robot import Robot
from phasmid.studio.live import LiveRobot

REACH = 2.0
"""How far about the robot uneven ground is shown [m]; half way to there it is shown anew."""

LONGEST_MODEL = 2e-3
"""Time that the force model may take in a frame; one that takes longer is asked less often [s]."""


class Scene:
    """A robot and its ground, as they are drawn.

    Args:
        live: The robot.
        number: By which frames tell that they belong to it.

    Attributes:
        layout: Names of what stands in a row, and how many numbers each has.
        told: For a page, as JSON holds it.
    """

    def __init__(self, live: LiveRobot, number: int) -> None:
        self.source, self.number = live.source, number
        source, robot = live.source, live.source.robot
        self._terrain = live.run.ground
        looks_of = _looks(_Look(robot))
        self._places, legs = looks_of.places, len(robot.legs)
        links, joints = len(self._places), 3 * legs
        self.layout = [
            ("scene", 1),
            ("time", 1),
            ("pace_got", 1),
            ("body_position", 3),
            ("body_orientation", 4),
            ("link_position", 3 * links),
            ("link_orientation", 4 * links),
            ("foot_position", joints),
            ("foot_force", joints),
            ("foot_force_model", joints),
            ("contact", legs),
            ("stance", legs),
            ("joint_position", joints),
            ("joint_velocity", joints),
            ("joint_torque", joints),
            ("joint_torque_model", joints),
            ("centre", 3),
            ("below", 1),
            ("margin", 1),
            ("tilt", 1),
            ("velocity_asked", 3),
            ("velocity_admitted", 3),
            ("velocity", 3),
            ("power", 1),
            ("cost_of_transport", 1),
            ("worst_servo", 2),
            ("phase", 1),
        ]
        self._size = sum(count for _, count in self.layout)
        # What a reader is to hear of a motor's strength is that at its supply.
        self._limit = source.stall_torque
        gait = source.gait
        self.told: dict[str, Any] = looks_of.told | {
            "weight": source.weight,
            "trail": 2 * source.scenario.stride.period,
            "names": [name.replace("_", " ") for name in robot.leg_names],
            "friction": source.scenario.terrain.friction,
            "torque_limit": [[self._limit] * 3 for _ in range(legs)],
            "links": links,
            "layout": [[name, count] for name, count in self.layout],
            "number": number,
            "gait": {"duty": gait.duty_factor, "offsets": [float(o) for o in gait.offsets]},
        }
        self._legs, self._frames = np.array(self._places, dtype=int).reshape(-1, 2).T
        self._last: ModelLoad | None = None
        self._wait = 0
        self._middle = np.zeros(2)
        self._surround(live.sample["qpos"][0, :2])

    def _surround(self, middle: Float[np.ndarray, "2"]) -> None:
        self._middle = np.array(middle)
        self.told = self.told | surroundings(self._terrain, self._middle, REACH)

    def moved(self, live: LiveRobot) -> bool:
        """Whether the robot has come so far that its ground is to be told anew; it is then."""
        place = live.sample["qpos"][0, :2]
        is_same = self._terrain.is_level and not self._terrain.patches
        if is_same or not np.isfinite(place).all():
            return False
        if np.abs(place - self._middle).max() < REACH / 2:
            return False
        self._surround(place)
        return True

    def row(self, live: LiveRobot, pace: float) -> bytes:
        """A frame.

        Args:
            live: The robot, whose scene this is.
            pace: Simulated seconds in a second.

        Returns:
            Numbers of four bytes in the order of the layout, little end first; what is not known
            is not a number.
        """
        robot, sample, legs = self.source.robot, live.sample, len(self.source.robot.legs)
        qpos = sample["qpos"][0]
        if not (np.isfinite(qpos).all() and np.any(qpos[3:7])):
            # A run that diverged is shown nowhere.
            return self._packed({"scene": self.number, "time": live.time, "pace_got": pace})
        position, turn, q = qpos[:3], qpos[3:7], qpos[7:].reshape(legs, 3)
        qd, torque = sample["qvel"][0, 6:], sample["torque"][0]
        R = kinematics.quaternion_rotation(turn)
        contact = sample["sensors"][0, : 4 * legs].reshape(legs, 4)
        feet = sample["sensors"][0, 4 * legs : 7 * legs].reshape(legs, 3)
        touching = contact[:, 0] > 0
        at, turned = self._links(q)
        centre = position + R @ kinematics.centre_of_mass(robot, q)
        margin = float(support_margin(feet[:, :2], touching, centre[:2]))
        told, reading = live.telemetry, live.reading
        stance = np.asarray(told.get("stance", touching), dtype=bool)
        cycle = live.setting.scenario.stride.period
        worst = int(np.argmax(live.peak))
        found: dict[str, Any] = {
            "scene": self.number,
            "time": live.time,
            "pace_got": pace,
            "body_position": position,
            "body_orientation": turn,
            "link_position": at,
            "link_orientation": quaternions(turned),
            "foot_position": feet,
            "foot_force": contact[:, 1:],
            "contact": touching,
            "stance": stance,
            "joint_position": q,
            "joint_velocity": qd,
            "joint_torque": torque,
            "centre": centre,
            "below": self._terrain.height(centre[:1], centre[1:2])[0],
            "margin": margin if math.isfinite(margin) else math.nan,
            "tilt": math.acos(min(1.0, max(-1.0, float(R[2, 2])))),
            "velocity": reading.velocity,
            "power": reading.power,
            "cost_of_transport": reading.cost_of_transport,
            "worst_servo": (worst, live.peak[worst] / self._limit),
            "phase": told.get("gait_phase", live.time / cycle % 1.0),
        }
        if not live.plays:
            found["velocity_asked"] = live.command.velocity
            found["velocity_admitted"] = told.get("velocity_reference", (math.nan,) * 3)
        held = self._held(live, position, R, q, feet, stance)
        if held is not None:
            found |= {"foot_force_model": held.force, "joint_torque_model": held.torque}
        return self._packed(found)

    def _links(self, q: Float[np.ndarray, "legs 3"]) -> tuple[np.ndarray, np.ndarray]:
        """Positions and rotations of the links that are drawn, in the body's axes."""
        frames = kinematics.link_frames(self.source.robot, q)
        leg, link = self._legs, np.minimum(self._frames, 2)
        at, turned = frames.position[leg, link], frames.rotation[leg, link]
        # A foot's frame is its tibia's, at its end.
        ends = np.array([leg.tibia.end for leg in self.source.robot.legs])[leg]
        ends[self._frames != 3] = 0.0
        return at + (turned @ ends[..., None])[..., 0], turned

    def _held(
        self,
        live: LiveRobot,
        position: np.ndarray,
        rotation: np.ndarray,
        q: np.ndarray,
        feet: np.ndarray,
        stance: np.ndarray,
    ) -> ModelLoad | None:
        """What would hold the robot as it is; the last that is known while it is costly."""
        self._wait -= 1
        if self._wait > 0:
            return self._last
        scenario, begin = live.setting.scenario, time.thread_time()
        try:
            self._last = holding_forces(
                scenario, self.source.robot, position, rotation, q, feet, stance, self._terrain
            )
        except PhasmidError:
            # So few feet stand that no forces hold the robot at rest.
            self._last = None
        self._wait = math.ceil((time.thread_time() - begin) / LONGEST_MODEL)
        return self._last

    def _packed(self, found: dict[str, Any]) -> bytes:
        row, at = np.full(self._size, np.nan, dtype="<f4"), 0
        for name, count in self.layout:
            if name in found:
                row[at : at + count] = np.ravel(found[name])
            at += count
        return row.tobytes()


class _Look:
    """A robot by all that its look depends on."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        arrays, look = robot.arrays, robot.appearance
        numbers = (arrays.lengths, arrays.p_body_hip, arrays.R_body_hip, robot.body.size)
        self._key = (id(look), look is None, robot.leg_names, *(x.tobytes() for x in numbers))

    def __hash__(self) -> int:
        return hash(self._key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Look) and other._key == self._key


class _Looks(NamedTuple):
    """What is drawn of a robot: places of its links, and meshes as a scene tells them."""

    places: list[Place]
    told: dict[str, Any]


@lru_cache(maxsize=8)
def _looks(look: _Look) -> _Looks:
    """Meshes of a robot; they stay the same under any load and on any ground."""
    pieces = mesh_pieces(look.robot)
    return _Looks(pieces.links, looks(look.robot, pieces))
