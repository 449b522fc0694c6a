"""Causes of failed walks over unknown ground, classified from recordings of repeated runs.

A fall has the cause *tilt* above that of a run that passes, or else *body collision*: the trunk's
underside meets the ground. Any other failure is a loss of way: commanded less actual forward
velocity, over the whole run. The loss at each sample counts for the first of these conditions that
holds there. The cause is the condition with the largest loss:

- *obstacle hits*: the force on a foot is outside the friction cone of the ground under it, as at a
  riser, or the foot draws back;
- *late touchdown*: a foot probes downwards or looks for ground;
- *torque limit*: a joint has `SATURATED` of the stall torque or more, or the engine slows down for
  its servos or ground;
- *slip*: the feet in contact move back, over a cycle, by more than `SLIPPING` of the commanded way;
- *reach*: feet or support allow less than `ALLOWED` of the commanded velocity;
- *progress*: none of these.
"""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
from scipy.ndimage import uniform_filter1d

import ground
from phasmid.control import LocomotionEngine
from phasmid.control.types import LegPhase, Manoeuvre, SearchStage
from phasmid.experiment import Command, JointTargets, Observation
from phasmid.recording import Recording
from phasmid.scenario import Scenario

from .study import Case, grouped, markdown
from .terrain import case_of

ENOUGH = 0.9
"""Share of runs that pass above which failures of a ground are not classified."""

OUTSIDE = 1.1
"""Tangent of the angle between force and ground normal, in coefficients of friction, from which the
force is that of a riser."""

LEAST_FORCE = 1.0
"""Force on a foot below which its direction does not count [N]."""

SATURATED, SLIPPING, ALLOWED = 0.98, 0.1, 0.95
"""Shares of the stall torque and of the commanded velocity."""

LOSSES = "obstacle hits", "late touchdown", "torque limit", "slip", "reach", "progress"
"""Conditions of a loss of way, in their order."""


class Observed:
    """Locomotion engine whose state is noted at each update.

    Args:
        engine: The engine.

    Attributes:
        rows: Per update: time [s]; whether a foot draws back; whether one probes or looks for
            ground; share of the velocity that feet and support allow; whether ground or servos
            limit the motion.
    """

    def __init__(self, engine: LocomotionEngine) -> None:
        self._engine = engine
        self.rows: list[tuple[float, bool, bool, float, bool]] = []

    def reset(self, observation: Observation) -> None:
        """Begin."""
        self._engine.reset(observation)

    def update(self, observation: Observation, command: Command) -> JointTargets:
        """Update the engine and note its state."""
        targets, state = self._engine.update(observation, command), self._engine.state
        draws_back = np.isin(state.manoeuvre, (Manoeuvre.DRAW_BACK, Manoeuvre.STOPPED))
        stage, forward = state.search_stage, self._engine.feed_forward
        looks = (stage > SearchStage.NONE) & (stage < SearchStage.RETURNED)
        self.rows.append(
            (
                float(observation.time),
                bool(draws_back.any()),
                bool((looks | (state.leg_phase == LegPhase.PROBING)).any()),
                float(state.clock.velocity_share),
                bool(forward is not None and forward.limit_reason),
            )
        )
        return targets


def lost_ways(scenario: Scenario, run: Recording, observed: Observed) -> dict[str, float]:
    """Return the way that a failed run lost by each condition [m].

    Args:
        scenario: Scenario of the run.
        run: Its recording, N samples, up to the time at which it is decided.
        observed: The engine's states.
    """
    robot, terrain = scenario.load_robot(), scenario.load_terrain()
    count, dt = len(run["time"]), scenario.record_steps * scenario.simulation.time_step
    contact, force, feet, torque = (
        run[name].values for name in ("contact", "foot_force", "foot_position", "joint_torque")
    )
    x = run["body_position"].values[:, 0]
    times, draws_back, looks, share, limited = map(np.array, zip(*observed.rows, strict=True))
    at = np.searchsorted(times, np.arange(count) * dt + 1e-9, side="right") - 1
    normal = terrain.normal(feet[..., 0], feet[..., 1])
    along = np.einsum("tlk,tlk->tl", force, normal)
    across = np.linalg.norm(force - along[..., None] * normal, axis=-1)
    cone = OUTSIDE * terrain.friction(feet[..., 0], feet[..., 1])
    side = (across > cone * along) & (np.linalg.norm(force, axis=-1) > LEAST_FORCE)
    touches = contact[1:] & contact[:-1]
    slid = -(np.diff(feet[..., 0], axis=0) * touches).sum(axis=1) / np.maximum(
        touches.sum(axis=1), 1
    )
    commanded = ground.SPEED * dt
    cycle = round(ground.PERIOD / dt)
    back = uniform_filter1d(np.append(0.0, slid), cycle, mode="nearest") / commanded
    saturated = np.abs(torque).max(axis=(1, 2)) >= SATURATED * robot.servo.stall_torque
    conditions = (
        side.any(axis=1) | draws_back[at],
        looks[at],
        saturated | limited[at],
        back > SLIPPING,
        share[at] < ALLOWED,
        np.ones(count, dtype=bool),
    )
    way = uniform_filter1d(np.diff(x, prepend=x[0] - commanded), cycle, mode="nearest")
    which = np.argmax(conditions, axis=0)
    lost = np.bincount(which, commanded - way, minlength=len(LOSSES))
    return dict(zip(LOSSES, lost.tolist(), strict=True))


def cases(results: list[Case]) -> list[Case]:
    """Return failed runs of grounds on which fewer than `ENOUGH` passed, blind or with a lidar."""
    names = "kind", "size", "mode", "seed"
    found = []
    for (*_, mode), runs in grouped(results, "kind", "size", "mode").items():
        if mode not in (ground.BLIND, ground.SEEING):
            continue
        mine = [run for run in runs if "passed" in run]
        if mine and sum(run["passed"] for run in mine) < ENOUGH * len(mine):
            failed = [run for run in mine if not run["passed"]]
            found += [{name: run[name] for name in names} for run in failed]
    return found


def measure(kind: str, size: float, mode: str, seed: int) -> Case:
    """Repeat a failed run and classify its failure."""
    scenario = ground.scenario_of(kind, size, seed).replace(**ground.MODES[mode].scenario)
    return explain(scenario, kind, size, mode)


def explain(scenario: Scenario, kind: str, size: float, mode: str) -> Case:
    """Walk over a scenario's ground and classify the failure, where it fails."""
    observed = Observed(ground.engine_of(scenario.load_robot(), kind, mode))
    task = ground.task_of(kind, size)
    outcome, run = ground.walk(scenario, observed, task)
    if not outcome.why:
        return case_of(outcome) | {"cause": "", "lost": {}}
    lost = lost_ways(scenario, run, observed)
    cause = max(lost, key=lost.__getitem__)
    if outcome.why == "fell":
        cause = "tilt" if math.radians(outcome.tilt) > task.tilt else "body collision"
    return case_of(outcome) | {"cause": cause, "lost": lost}


def table(results: list[Case]) -> str:
    """Return the table of the causes, by ground and mode."""
    rows = []
    for (kind, size, mode), runs in grouped(results, "kind", "size", "mode").items():
        counts = Counter(run["cause"] for run in runs if run["cause"]).most_common()
        words = ", ".join(f"{count} {cause}" for cause, count in counts)
        rows.append([ground.label(kind, size), mode, sum(n for _, n in counts), words])
    return markdown(["ground", "mode", "failed", "causes"], rows)
