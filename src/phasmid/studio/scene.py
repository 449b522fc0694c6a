"""Pictures of the live robot: a scene once, and thirty times a second a frame of numbers.

The scene's keys are those of a report's replay. A frame is a row of four-byte floats; the scene's
``layout`` names its fields.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid import kinematics
from phasmid.errors import PhasmidError
from phasmid.forces import ModelLoad, holding_forces
from phasmid.gait import Gait, support_margin
from phasmid.reporting.robot_mesh import mesh_pieces, quaternions
from phasmid.reporting.webpage.replay import looks, surroundings
from phasmid.studio.live import LiveRobot

REACH = 2.0
"""Distance around the robot to which uneven ground is drawn [m]; half way there it is renewed."""

LONGEST_MODEL = 2e-3
"""Time that the force model may take per frame; a slower one is evaluated less often [s]."""


class Scene:
    """Drawing of a robot and its ground.

    Args:
        live: Robot.
        number: Number of the scene, which its frames repeat.

    Attributes:
        layout: Names of a frame's fields, and their numbers of values.
        table: Scene for the page, as JSON holds it.
    """

    def __init__(self, live: LiveRobot, number: int) -> None:
        self.source, self.number = live.source, number
        source, robot = live.source, live.source.robot
        self._terrain = live.run.ground
        pieces = mesh_pieces(robot)
        # The servos' limits at their present supply.
        self._limits = source.robot.arrays.stall_torque
        self.table: dict[str, Any] = looks(robot, pieces) | {
            "weight": source.weight,
            "trail": 2 * source.experiment.course.stride.period,
            "names": [name.replace("_", " ") for name in robot.leg_names],
            "hips": robot.arrays.p_body_hip[:, :2].tolist(),
            "friction": source.experiment.world.terrain.coefficient,
            "torque_limit": self._limits.tolist(),
            "links": len(pieces.links),
            "number": number,
            "gait": gait_table(source.gait),
        }
        self._legs, self._frames = np.array(pieces.links, dtype=int).reshape(-1, 2).T
        self._held: ModelLoad | None = None
        self._wait = 0
        self._draw_ground(live.sample["qpos"][0, :2])
        numbers = self._numbers(live, math.nan)
        self.layout = [(name, np.size(values)) for name, values in numbers.items()]
        self.table["layout"] = self.layout

    def _draw_ground(self, middle: Float[np.ndarray, "2"]) -> None:
        self._middle = np.array(middle)
        self.table = self.table | surroundings(self._terrain, self._middle, REACH)

    def follow_ground(self, live: LiveRobot) -> bool:
        """Renew the ground around a robot that has come far; return True if it was renewed."""
        position = live.sample["qpos"][0, :2]
        is_uniform = self._terrain.is_level and not self._terrain.patches
        if is_uniform or not np.isfinite(position).all():
            return False
        if np.abs(position - self._middle).max() < REACH / 2:
            return False
        self._draw_ground(position)
        return True

    def frame(self, live: LiveRobot, pace: float) -> bytes:
        """Return a frame; unknown values are NaN.

        Args:
            live: Robot of this scene.
            pace: Simulated seconds per second.
        """
        qpos = live.sample["qpos"][0]
        if np.isfinite(qpos).all() and np.any(qpos[3:7]):
            values = [np.ravel(each) for each in self._numbers(live, pace).values()]
            return np.concatenate(values).astype("<f4").tobytes()
        # A run that diverged has no pose.
        row = np.full(sum(count for _, count in self.layout), np.nan, "<f4")
        row[:3] = self.number, live.time, pace
        return row.tobytes()

    def _numbers(self, live: LiveRobot, pace: float) -> dict[str, Any]:
        """Return the numbers of a frame."""
        robot, sample, legs = self.source.robot, live.sample, len(self.source.robot.legs)
        qpos = sample["qpos"][0]
        position, q = qpos[:3], qpos[7:].reshape(legs, 3)
        R = kinematics.quaternion_rotation(qpos[3:7])
        contact = sample["sensors"][0, : 4 * legs].reshape(legs, 4)
        feet = sample["sensors"][0, 4 * legs : 7 * legs].reshape(legs, 3)
        touching = contact[:, 0] > 0
        p_links, R_links = self._links(q)
        centre = position + R @ kinematics.centre_of_mass(robot, q)
        margin = float(support_margin(feet[:, :2], touching, centre[:2]))
        telemetry, metrics = live.telemetry, live.metrics
        stance = np.asarray(telemetry.get("stance", touching), dtype=bool)
        held = self._holding_forces(live, position, R, q, feet, stance)
        unknown = np.full((legs, 3), np.nan)
        load = live.peak / self._limits.ravel()
        worst = int(np.argmax(load))
        command = admitted = np.full(3, np.nan)
        if not live.plays:
            command = np.array(live.command.velocity)
            admitted = np.array(telemetry.get("velocity_reference", admitted))
        phase = live.time / live.setting.experiment.course.stride.period % 1.0
        return {
            "scene": self.number,
            "time": live.time,
            "pace_got": pace,
            "body_position": position,
            "body_orientation": qpos[3:7],
            "link_position": p_links,
            "link_orientation": quaternions(R_links),
            "foot_position": feet,
            "foot_normal": self._terrain.normal(feet[:, 0], feet[:, 1]),
            "foot_force": contact[:, 1:],
            "foot_force_model": unknown if held is None else held.force,
            "contact": touching,
            "stance": stance,
            "joint_position": q,
            "joint_velocity": sample["qvel"][0, 6:],
            "joint_torque": sample["torque"][0],
            "joint_torque_model": unknown if held is None else held.torque,
            "centre": centre,
            "below": self._terrain.height(centre[:1], centre[1:2]),
            "margin": margin if math.isfinite(margin) else math.nan,
            "tilt": math.acos(min(1.0, max(-1.0, float(R[2, 2])))),
            "velocity_command": command,
            "velocity_admitted": admitted,
            "velocity": metrics.velocity,
            "power": metrics.power,
            "cost_of_transport": metrics.cost_of_transport,
            "worst_servo": (worst, load[worst]),
            "phase": telemetry.get("gait_phase", phase),
        }

    def _links(self, q: Float[np.ndarray, "legs 3"]) -> tuple[np.ndarray, np.ndarray]:
        """Return positions and rotations of the drawn links in body axes."""
        frames = kinematics.link_frames(self.source.robot, q)
        leg, link = self._legs, np.minimum(self._frames, 2)
        position, rotation = frames.position[leg, link], frames.rotation[leg, link]
        # The frame of a foot is that of its tibia, at the tibia's end.
        ends = np.array([leg.tibia.end for leg in self.source.robot.legs])[leg]
        ends[self._frames != 3] = 0.0
        return position + (rotation @ ends[..., None])[..., 0], rotation

    def _holding_forces(
        self,
        live: LiveRobot,
        position: np.ndarray,
        rotation: np.ndarray,
        q: np.ndarray,
        feet: np.ndarray,
        stance: np.ndarray,
    ) -> ModelLoad | None:
        """Return the forces that hold the robot at rest; the last known while they are costly."""
        self._wait -= 1
        if self._wait > 0:
            return self._held
        begin = time.thread_time()
        try:
            self._held = holding_forces(
                live.setting.experiment, position, rotation, q, feet, stance, self._terrain
            )
        except PhasmidError:
            # Too few stance feet to hold the robot at rest.
            self._held = None
        self._wait = math.ceil((time.thread_time() - begin) / LONGEST_MODEL)
        return self._held


def gait_table(gait: Gait) -> dict[str, Any]:
    """Return the gait schedule for the page."""
    return {"duty": gait.duty_factor, "offsets": [float(offset) for offset in gait.offsets]}
