"""Gates for a walking policy: does it walk as commanded, and does it walk at all?

A policy can earn reward by sliding, shuffling on two legs or leaning on its torque limits. The
gates measure how the robot walks, whatever the reward was.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from rich.table import Table as TextTable

from phasmid.learning.environment import WalkVectorEnv
from phasmid.learning.task import Task

Policy = Callable[[np.ndarray], np.ndarray]
"""Returns actions (N, 3 L) for observations (N, A)."""

DIRECTIONS = {
    "forward": (1.0, 0.0, 0.0),
    "backward": (-1.0, 0.0, 0.0),
    "left": (0.0, 1.0, 0.0),
    "right": (0.0, -1.0, 0.0),
    "turn left": (0.0, 0.0, 1.0),
    "turn right": (0.0, 0.0, -1.0),
}
"""Commands of an assessment, as shares of the task's largest velocities."""

SPEED_SHARE = 0.8
"""Assessed share of the task's largest velocities."""

SETTLING = 2.0
"""Time from the start that is not assessed [s]."""


@dataclass(frozen=True)
class Limit:
    """Range in which a measured quantity must lie.

    Attributes:
        low: Lowest value that passes.
        high: Highest value that passes.
        unit: Of the values.
        meaning: What is measured.
    """

    low: float
    high: float
    unit: str
    meaning: str


LIMITS = {
    "velocity": Limit(90.0, 110.0, "%", "velocity along the command, of the commanded one"),
    "least_duty": Limit(0.4, 0.9, "", "least duty factor of a leg"),
    "largest_duty": Limit(0.4, 0.9, "", "largest duty factor of a leg"),
    "slip": Limit(0.0, 8.0, "mm", "distance that a foot slides per step"),
    "height": Limit(-15.0, 15.0, "mm", "mean height of the body above that of the neutral stance"),
    "saturated": Limit(0.0, 10.0, "%", "time that a joint is at its torque limit"),
    "cost_of_transport": Limit(0.0, 3.0, "", "positive work of the joints per weight and distance"),
    "asymmetry": Limit(0.0, 0.1, "", "largest difference between the duty factors of two sides"),
    "survival": Limit(100.0, 100.0, "%", "robots that do not fall"),
    "standing_joints": Limit(0.0, 5.0, "deg/s", "speed of the joints while the command is zero"),
    "standing_drift": Limit(0.0, 2.0, "mm/s", "speed of the body while the command is zero"),
}
"""Gates by name. Duty factors: those of walking gaits with three to five feet on the ground. Slip:
half as much again as that of the reference motion, 5.6 mm. Cost of transport: seven times that of
the reference motion, 0.4."""


@dataclass(frozen=True)
class Assessment:
    """Measured quantities of a policy, in the units of `LIMITS`.

    Attributes:
        walks: Quantities by direction and name.
        standing: Quantities at a zero command, by name.
        policy: Name of the policy.
    """

    walks: dict[str, dict[str, float]]
    standing: dict[str, float]
    policy: str = "policy"

    def failures(self) -> list[str]:
        """Return the gates that are not passed, one sentence each."""
        rows = [*self.walks.items(), ("standing", self.standing)]
        return [
            f"{direction}: {LIMITS[name].meaning} is {value:.3g} {LIMITS[name].unit}".rstrip()
            + f"; it must be {LIMITS[name].low:g} to {LIMITS[name].high:g}."
            for direction, values in rows
            for name, value in values.items()
            if not LIMITS[name].low <= value <= LIMITS[name].high
        ]

    def table(self) -> TextTable:
        """Return the quantities as a table for a terminal; those beyond a limit have a mark."""
        names = list(next(iter(self.walks.values())))
        table = TextTable("gate", *self.walks, "standing", "passes", title=self.policy)
        for name in [*names, *(name for name in self.standing if name not in names)]:
            limit = LIMITS[name]
            cells = [
                "" if name not in values else _cell(values[name], limit)
                for values in [*self.walks.values(), self.standing]
            ]
            table.add_row(
                f"{name} {limit.unit}".rstrip(), *cells, f"{limit.low:g} to {limit.high:g}"
            )
        return table


def assess(
    policy: Policy,
    task: Task,
    *,
    robots: int = 4,
    seconds: float = 8.0,
    seed: int = 1000,
    name: str = "policy",
    threads: int = 1,
) -> Assessment:
    """Let a policy walk in six directions and stand, on level ground, and measure how it does.

    Args:
        policy: Returns actions for observations.
        task: The task; its terrain and damage are left out.
        robots: Robots for each direction.
        seconds: Assessed time, after two seconds of settling [s].
        seed: Seed of the first robot.
        name: Of the policy.
        threads: Of the physics.
    """
    steps = round((SETTLING + seconds) * task.rate)
    duration = (steps + 1) / task.rate
    task = task.replace(
        duration=2 * duration,
        commands={"interval": 2 * duration},
        terrain={"kinds": ()},
        damage={"dead_servo": 0.0, "lost_leg": 0.0},
    )
    largest = np.array([task.commands.forward, task.commands.left, task.commands.yaw])
    wanted = np.array([*DIRECTIONS.values(), (0.0, 0.0, 0.0)]) * SPEED_SHARE * largest
    env = WalkVectorEnv(len(wanted) * robots, task=task, threads=threads, autoreset_mode="Disabled")
    command = np.repeat(wanted, robots, axis=0)
    samples = _walk(env, policy, command, seed, steps, round(SETTLING * task.rate))
    weight = env.physics.robot.mass * 9.81
    measured = _measure(samples, command, weight, 1 / task.rate, env.physics.constants.mirror)
    env.close()
    means = {key: value.reshape(-1, robots).mean(axis=1) for key, value in measured.items()}
    standing = ("survival", "saturated", "standing_joints", "standing_drift")
    walking = [key for key in means if not key.startswith("standing")]
    return Assessment(
        {
            direction: {key: float(means[key][i]) for key in walking}
            for i, direction in enumerate(DIRECTIONS)
        },
        {key: float(means[key][-1]) for key in standing},
        name,
    )


def _walk(
    env: WalkVectorEnv, policy: Policy, command: np.ndarray, seed: int, steps: int, settling: int
) -> dict[str, np.ndarray]:
    """Return samples of the control periods after settling, each of shape (T, N, ...)."""
    observation, _ = env.reset(seed=seed, options={"command": command})
    e, physics = env.physics.episodes, env.physics
    parts: list[dict[str, np.ndarray]] = []
    survives = np.ones(env.num_envs, bool)
    for step in range(steps):
        observation, _, fell, _, information = env.step(policy(observation))
        survives &= ~fell
        if step < settling:
            continue
        parts.append(
            {
                "velocity": information["privileged_observation"][:, :3].astype(float),
                "yaw_rate": physics.qvel[:, 5].copy(),
                "height": physics.qpos[:, 2] - physics.constants.height,
                "joint_speed": np.sqrt(np.mean(physics.qvel[:, 6:] ** 2, axis=1)),
                "contact": e.contact > 0,
                "foot": e.foot.copy(),
                "work": e.work.copy(),
                "saturated": e.saturated.mean(axis=1),
                "survives": survives.copy(),
            }
        )
    return {name: np.stack([part[name] for part in parts]) for name in parts[0]}


def _measure(
    s: dict[str, np.ndarray],
    command: Float[np.ndarray, "robots 3"],
    weight: float,
    dt: float,
    mirror: np.ndarray,
) -> dict[str, Float[np.ndarray, " robots"]]:
    twist = np.concatenate([s["velocity"][..., :2], s["yaw_rate"][..., None]], axis=-1).mean(axis=0)
    length = np.sum(command**2, axis=1)
    along = np.sum(twist * command, axis=1) / np.where(length > 0, length, 1.0)
    contact = s["contact"]
    duty = contact.mean(axis=0)
    slides = np.linalg.norm(np.diff(s["foot"][..., :2], axis=0), axis=-1)
    slides *= contact[1:] & contact[:-1]
    steps = np.maximum(np.sum(contact[1:] & ~contact[:-1], axis=(0, 2)), 1)
    # Turning on the spot moves the body by the feet's way: the cost is per way of the feet.
    radius = np.linalg.norm(
        s["foot"][0, :, :, :2] - s["foot"][0, :, :, :2].mean(axis=1)[:, None], axis=-1
    ).mean(axis=1)
    way = np.hypot(np.hypot(twist[:, 0], twist[:, 1]), twist[:, 2] * radius) * dt * len(contact)
    return {
        "velocity": 100 * along,
        "least_duty": duty.min(axis=1),
        "largest_duty": duty.max(axis=1),
        "slip": 1000 * slides.sum(axis=(0, 2)) / steps,
        "height": 1000 * s["height"].mean(axis=0),
        "saturated": 100 * s["saturated"].mean(axis=0) / dt,
        "cost_of_transport": s["work"].sum(axis=0) / (weight * np.maximum(way, 1e-3)),
        "asymmetry": np.abs(duty - duty[:, mirror]).max(axis=1),
        "survival": 100.0 * s["survives"][-1],
        "standing_joints": np.degrees(s["joint_speed"].mean(axis=0)),
        "standing_drift": 1000 * np.linalg.norm(s["velocity"][..., :2].mean(axis=0), axis=1),
    }


def _cell(value: float, limit: Limit) -> str:
    mark = "" if limit.low <= value <= limit.high else " ✗"
    return f"{value:.3g}{mark}"
