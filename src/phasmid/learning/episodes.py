"""Episodes of a batch of robots: their arrays, their random draws, and the constants of a task."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from phasmid.compiled import compiled
from phasmid.gait import default_gait, load_gait
from phasmid.kinematics import body_height, hip_from_body, joint_angles, neutral_feet
from phasmid.learning.task import TERMS, Task
from phasmid.learning.terrain import Terrain, training_terrain
from phasmid.robot import Robot
from phasmid.tables import Table

UNDERSIDE = np.array([[0.0, 0.0, -1.0], *([x, y, -1.0] for y in (-1.0, 1.0) for x in (1.0, -1.0))])
"""Middle and corners of the trunk's underside, in halves of its size from its centre."""


class Constants(NamedTuple):
    """Numbers of a task and its robot with L legs, for compiled functions.

    Attributes:
        task: The task's numbers, by the names of its tables and fields; see `table_record`.
        dt: Control period [s].
        steps: Control periods of an episode.
        neutral: Joint angles of the neutral stance [rad], shape (3 L,).
        limits: Lowest and highest joint angle [rad], shape (2, 3 L).
        change: Largest change of a target in a period [rad].
        height: Height of the body frame in the neutral stance [m].
        underside: Middle and corners of the trunk's underside in the body frame [m], shape (5, 3).
        stall: Stall torque of the servos [N·m].
        largest: Largest velocities: forward, left [m/s], yaw rate [rad/s].
        command_steps: Control periods between commands.
        push_steps: Control periods between pushes.
        lifts: Phases at which legs lift, shape (L,).
        swing: Part of a cycle for which a foot is in the air.
        hips: Hip positions in the body frame [m], shape (L, 3).
        R_body_hip: Rotations of the hips, shape (L, 3, 3).
        feet: Neutral feet in the body frame [m], shape (L, 3).
        lengths: Of coxa, femur and tibia [m], shape (L, 3).
        left: Offsets of the feet from the legs' planes [m], shape (L,).
        mirror: Number of the leg opposite to each leg, shape (L,).
        weights: Of the reward terms, per control period, shape (T,).
        terrain: The ground.
        first_levels: Levels of difficulty on which robots begin.
        latest_damage: Latest control period in which servos die.
    """

    task: np.record
    dt: float
    steps: int
    neutral: np.ndarray
    limits: np.ndarray
    change: float
    height: float
    underside: np.ndarray
    stall: float
    largest: np.ndarray
    command_steps: int
    push_steps: int
    lifts: np.ndarray
    swing: float
    hips: np.ndarray
    R_body_hip: np.ndarray
    feet: np.ndarray
    lengths: np.ndarray
    left: np.ndarray
    mirror: np.ndarray
    weights: np.ndarray
    terrain: Terrain
    first_levels: int
    latest_damage: int


def table_record(table: Table) -> np.record:
    """Return the numbers of a table, and of the tables in it, by their names."""
    parts = {
        name: np.asarray(table_record(value) if isinstance(value, Table) else value)
        for name, value in table
    }
    parts = {name: part for name, part in parts.items() if part.dtype.kind in "bifV" and part.size}
    kinds = {name: part.dtype if part.dtype.names else np.float64 for name, part in parts.items()}
    fields = [(name, kinds[name], part.shape) for name, part in parts.items()]
    record: np.record = np.zeros(1, fields).view(np.recarray)[0]
    for name, part in parts.items():
        record[name] = part
    return record


def task_constants(task: Task, robot: Robot) -> Constants:
    """Return the constants of a task with a robot of L legs."""
    feet = neutral_feet(robot)
    legs = len(robot.legs)
    gait = load_gait(task.gait.name, legs) if task.gait.name else default_gait(legs)
    dt, table = 1 / task.rate, task.commands
    terrain = training_terrain(task.terrain)
    mirrored = feet * np.array([1.0, -1.0, 1.0])
    distance = np.linalg.norm(feet[:, None] - mirrored, axis=-1)
    return Constants(
        task=table_record(task),
        dt=dt,
        steps=max(1, round(task.duration / dt)),
        neutral=joint_angles(robot.arrays, hip_from_body(robot, feet)).ravel(),
        limits=np.vstack([leg.joint_limits for leg in robot.legs]).T.copy(),
        change=task.action.speed_share * robot.servo.no_load_speed * dt,
        height=body_height(robot),
        underside=robot.body.box_points(UNDERSIDE),
        stall=robot.servo.stall_torque,
        largest=np.array([table.forward, table.left, table.yaw]),
        command_steps=max(1, round(table.interval / dt)),
        push_steps=max(1, round(task.randomisation.push_interval / dt)),
        lifts=np.array(gait.offsets),
        swing=gait.swing_fraction,
        hips=np.array([leg.mount_position for leg in robot.legs]),
        R_body_hip=np.ascontiguousarray(robot.arrays.R_body_hip),
        feet=feet,
        lengths=robot.arrays.lengths,
        left=robot.arrays.lateral_offsets.sum(axis=1),
        mirror=distance.argmin(axis=1),
        weights=np.array([getattr(task.rewards, name) for name in TERMS]) * dt,
        terrain=terrain,
        first_levels=min(task.terrain.first_levels, len(terrain.origins)),
        latest_damage=round(task.damage.latest / dt),
    )


class States(NamedTuple):
    """States of N robots in MuJoCo.

    Attributes:
        qpos: Positions of the bodies, orientations and joint angles, shape (N, 7 + 3 L).
        qvel: Velocities, shape (N, 6 + 3 L).
        sensors: Readings as of `learning_model`, shape (N, 7 L).
        force: Applied forces and torques, shape (N, 6 + 3 L).
    """

    qpos: np.ndarray
    qvel: np.ndarray
    sensors: np.ndarray
    force: np.ndarray


class Episodes(NamedTuple):
    """Episodes of N robots with L legs and B actions; one row per robot.

    Attributes:
        random: State of each robot's random numbers, shape (N,).
        step: Control periods since the start, shape (N,).
        command: Velocity forward, left [m/s] and yaw rate [rad/s], shape (N, 3).
        phase: Of the gait's clock, in cycles, shape (N,).
        action: Latest action, shape (N, B).
        previous_action: The action before it, shape (N, B).
        target: Latest joint targets [rad], shape (N, 3 L).
        previous_target: The targets before them [rad], shape (N, 3 L).
        reference: Joint angles of the reference motion [rad], shape (N, 3 L).
        position: Position of the body at the end of the previous period [m], shape (N, 3).
        foot: Feet at the end of the previous period, world axes [m], shape (N, L, 3).
        contact: Contact of each foot, shape (N, L).
        force: Normal force of each foot [N], shape (N, L).
        duty: Duty factor of each leg, averaged over about two cycles, shape (N, L).
        torque: Joint torques of the last time step, behind friction [N·m], shape (N, 3 L). At fast
            fidelity they include the torque that turns the rotors.
        work: Positive work of those torques in the period [J], shape (N,).
        saturated: Part of the period in which each joint is at its torque limit, shape (N, 3 L).
        strength: Factor on the servos' supply voltage, shape (N,).
        gain: Factor on the servos' gains, shape (N,).
        joint_offset: Error of each joint's zero [rad], shape (N, 3 L).
        latency: Delay of the targets [s], shape (N,).
        friction: Coefficient of friction, shape (N,).
        mass: Factor on masses and inertias, shape (N,).
        payload: Mass on the trunk [kg], shape (N,).
        centre_of_mass: Shift of the trunk's centre of mass [m], shape (N, 3).
        level: Level of difficulty; -1 before the first episode, shape (N,).
        kind: Number of the kind of ground, shape (N,).
        heading: Yaw at the start [rad], shape (N,).
        progress: Way along the commands [m], with yaw at the feet's distance, shape (N,).
        wanted: Commanded way [m], shape (N,).
        fell: Whether the robot fell in the period, shape (N,).
        reward: Reward of the period, shape (N,).
        damage_step: Control period in which servos die, shape (N,).
        dies: 1 for the servos that die, shape (N, 3 L).
        sums: Sums of the reward terms over the episode, shape (N, T).
    """

    random: np.ndarray
    step: np.ndarray
    command: np.ndarray
    phase: np.ndarray
    action: np.ndarray
    previous_action: np.ndarray
    target: np.ndarray
    previous_target: np.ndarray
    reference: np.ndarray
    position: np.ndarray
    foot: np.ndarray
    contact: np.ndarray
    force: np.ndarray
    duty: np.ndarray
    torque: np.ndarray
    work: np.ndarray
    saturated: np.ndarray
    strength: np.ndarray
    gain: np.ndarray
    joint_offset: np.ndarray
    latency: np.ndarray
    friction: np.ndarray
    mass: np.ndarray
    payload: np.ndarray
    centre_of_mass: np.ndarray
    level: np.ndarray
    kind: np.ndarray
    heading: np.ndarray
    progress: np.ndarray
    wanted: np.ndarray
    fell: np.ndarray
    reward: np.ndarray
    damage_step: np.ndarray
    dies: np.ndarray
    sums: np.ndarray


PER_JOINT = (
    *("target", "previous_target", "reference"),
    *("torque", "saturated", "joint_offset", "dies"),
)
"""Arrays of episodes with one number per joint."""


def empty_episodes(count: int, legs: int, actions: int) -> Episodes:
    """Allocate episodes of N robots with L legs and B actions."""
    shapes = {
        "command": (3,),
        "position": (3,),
        "foot": (legs, 3),
        "centre_of_mass": (3,),
        "sums": (len(TERMS),),
    }
    shapes |= dict.fromkeys(("contact", "force", "duty"), (legs,))
    shapes |= dict.fromkeys(PER_JOINT, (3 * legs,))
    shapes |= dict.fromkeys(("action", "previous_action"), (actions,))
    kinds = {"random": np.uint64, "fell": np.bool_}
    kinds |= dict.fromkeys(("step", "level", "kind", "damage_step"), np.int64)
    episodes = Episodes(
        **{
            name: np.zeros((count, *shapes.get(name, ())), kinds.get(name, np.float64))
            for name in Episodes._fields
        }
    )
    episodes.level[:] = -1
    return episodes


def random_states(seeds: np.ndarray) -> np.ndarray:
    """Return the first state of each robot's random numbers, from its seed, shape (N,)."""
    return np.array(
        [np.random.SeedSequence(int(seed)).generate_state(1, np.uint64)[0] for seed in seeds]
    )


@compiled
def uniform(random: np.ndarray, n: int, low: float, high: float) -> float:
    """Draw a number from robot n's stream of random numbers.

    The generator is SplitMix64, whose whole state is one 64-bit number per robot.

    Source: G. Steele, D. Lea, C. Flood, "Fast splittable pseudorandom number generators", 2014.
    """
    random[n] += np.uint64(0x9E3779B97F4A7C15)
    z = random[n]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z ^= z >> np.uint64(31)
    return low + (high - low) * float(z >> np.uint64(11)) * 2.0**-53


@compiled
def draw_command(c: Constants, e: Episodes, n: int) -> None:
    """Draw robot n's command: zero, along one direction, or any."""
    zero, single = c.task.commands.zero_share, c.task.commands.single_share
    kind, only = uniform(e.random, n, 0.0, 1.0), int(uniform(e.random, n, 0.0, 3.0))
    for i in range(3):
        value = uniform(e.random, n, -1.0, 1.0) * c.largest[i]
        is_zero = kind < zero or (kind < zero + single and i != only)
        e.command[n, i] = 0.0 if is_zero else value


@compiled
def draw_ground(c: Constants, e: Episodes, n: int) -> None:
    """Draw the tile on which robot n begins, by how far it came in its last episode."""
    levels, kinds = c.terrain.origins.shape[:2]
    first = int(uniform(e.random, n, 0.0, float(c.first_levels)))
    anywhere = int(uniform(e.random, n, 0.0, float(levels)))
    if e.level[n] < 0:
        e.level[n] = first
    elif e.wanted[n] > 0.0:
        if e.fell[n] or e.progress[n] < 0.5 * e.wanted[n]:
            e.level[n] = max(e.level[n] - 1, 0)
        elif e.progress[n] > 0.8 * e.wanted[n]:
            # Past the last level all levels come again, lest the easy ones be forgotten.
            e.level[n] = e.level[n] + 1 if e.level[n] + 1 < levels else anywhere
    e.kind[n] = int(uniform(e.random, n, 0.0, float(kinds)))
    e.heading[n] = uniform(e.random, n, -math.pi, math.pi) if levels * kinds > 1 else 0.0


@compiled
def draw_damage(c: Constants, e: Episodes, n: int) -> None:
    """Draw which servos of robot n die, and when."""
    legs, which = len(c.lifts), uniform(e.random, n, 0.0, 1.0)
    leg = int(uniform(e.random, n, 0.0, float(legs)))
    joint = int(uniform(e.random, n, 0.0, 3.0))
    e.damage_step[n] = int(uniform(e.random, n, 0.0, c.latest_damage + 1.0))
    e.dies[n] = 0.0
    if which < c.task.damage.lost_leg:
        e.dies[n, 3 * leg : 3 * leg + 3] = 1.0
    elif which < c.task.damage.lost_leg + c.task.damage.dead_servo:
        e.dies[n, 3 * leg + joint] = 1.0


@compiled
def draw_episodes(c: Constants, e: Episodes, ids: np.ndarray) -> None:
    """Begin episodes: draw properties of the robot and the first command.

    Args:
        c: Constants of the task.
        e: Episodes, changed in place.
        ids: The robots.
    """
    r = c.task.randomisation
    for n in ids:
        e.strength[n] = uniform(e.random, n, 1 - r.strength, 1 + r.strength)
        e.gain[n] = uniform(e.random, n, 1 - r.gain, 1 + r.gain)
        e.latency[n] = uniform(e.random, n, 0.0, r.latency)
        e.friction[n] = uniform(e.random, n, r.friction[0], r.friction[1])
        e.mass[n] = uniform(e.random, n, 1 - r.mass, 1 + r.mass)
        e.payload[n] = uniform(e.random, n, 0.0, r.payload)
        for i in range(3):
            e.centre_of_mass[n, i] = uniform(e.random, n, -r.centre_of_mass, r.centre_of_mass)
        for j in range(len(c.neutral)):
            e.joint_offset[n, j] = uniform(e.random, n, -r.joint_offset, r.joint_offset)
            e.target[n, j] = e.previous_target[n, j] = e.reference[n, j] = c.neutral[j]
            e.torque[n, j] = e.saturated[n, j] = 0.0
        e.action[n] = e.previous_action[n] = 0.0
        draw_ground(c, e, n)
        draw_damage(c, e, n)
        e.phase[n] = uniform(e.random, n, 0.0, 1.0)
        e.step[n], e.work[n], e.progress[n], e.wanted[n], e.fell[n] = 0, 0.0, 0.0, 0.0, False
        e.reward[n], e.sums[n] = 0.0, 0.0
        e.contact[n], e.force[n], e.duty[n] = 1.0, 0.0, 1.0 - c.swing
        draw_command(c, e, n)
