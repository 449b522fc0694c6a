"""The paper's walk under three laws of contact, in two simulators: what agrees, what does not, why.

Everything is looked at in the middle half of each whole stance ("amid stance"), away from the
switches of legs, unless it says otherwise.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from phasmid.dynamics import foot_jacobian
from phasmid.forces.analysis import planned_body
from phasmid.forces.load import grasp_matrix
from phasmid.kinematics import link_frames
from phasmid.motion import Walk, plan
from phasmid.recording import Recording
from phasmid.reporting.steps import intervals, middle_halves, rms
from phasmid.scenario import Scenario, load_scenario
from phasmid.simulation import CONTACT_POINTS, build_model, new_run, simulate

LAWS = ("spring-damper", "mujoco", "simscape")
"""In the order in which they are shown; the first is the default."""

POINT_FOOT = 1e-4
"""Width of a foot that is nearly a point: its four points share its load evenly [m]."""

TOUCHDOWN = 0.08
"""Time after a touchdown in which impacts are looked for [s]."""

ROUNDS = 3
"""Runs of which the quickest tells the time of a step."""

IMPEDANCES = (0.1, 0.2, 0.5, 0.8)
"""Of the engine's d, on which the squeeze of prescribed joints is tried."""

THRESHOLDS = (1e-4, 1e-3, 1e-2)
"""Of the library's friction, on which the squeeze is tried [m/s]."""

Announce = Callable[[str], object]
"""Is told what is being done now."""


@dataclass(frozen=True, eq=False)
class Trial:
    """One simulated walk.

    Attributes:
        scenario: What was walked.
        walk: The plan at the recorded instants.
        recording: What physics made of it.
    """

    scenario: Scenario
    walk: Walk
    recording: Recording

    @cached_property
    def amid(self) -> Bool[np.ndarray, "time legs"]:
        """Samples amid the stances of each leg."""
        return middle_halves(self.walk.stance)

    def channel(self, name: str) -> np.ndarray:
        """A channel of the recording as an array."""
        return np.asarray(self.recording[name].values)

    @property
    def mean_load(self) -> Float[np.ndarray, " legs"]:
        """Mean normal force on each foot amid its stances [N], shape (L,)."""
        normal = self.channel("foot_normal_force")
        return np.sum(normal, axis=0, where=self.amid) / self.amid.sum(axis=0)

    def load_gap(self, other: Trial) -> float:
        """Largest difference of a normal force amid stance from another trial's, as a share of
        the mean load of its foot.
        """
        gap = self.channel("foot_normal_force") - other.channel("foot_normal_force")
        return float(np.abs(gap / other.mean_load)[other.amid].max())

    @property
    def touchdown(self) -> Float[np.ndarray, " legs"]:
        """Largest normal force on each foot soon after one of its touchdowns [N], shape (L,)."""
        normal = self.channel("foot_normal_force")
        found = np.zeros(normal.shape[1])
        for leg in range(normal.shape[1]):
            for start, _ in intervals(self.walk.stance[:, leg]):
                stop = np.searchsorted(self.walk.time, self.walk.time[start] + TOUCHDOWN)
                if start > 0:
                    found[leg] = max(found[leg], float(normal[start:stop, leg].max()))
        return found

    @property
    def early(self) -> float:
        """Mean time by which feet touch the ground before the plan sets them down [s]."""
        contact, leads = self.channel("contact"), []
        for leg in range(contact.shape[1]):
            for start, _ in intervals(self.walk.stance[:, leg]):
                apart = np.flatnonzero(~contact[:start, leg])
                if start > 0 and len(apart):
                    leads.append(self.walk.time[start] - self.walk.time[apart[-1] + 1])
        return float(np.mean(leads))

    @property
    def sinkage(self) -> float:
        """Mean depth of the tips amid stance [m]."""
        return -float(self.channel("foot_position")[self.amid][:, 2].mean())

    @property
    def creep(self) -> float:
        """Mean speed of standing feet over the ground, from the first to the last sample amid each
        stance [m/s].
        """
        place, speeds = self.channel("foot_position"), []
        for leg in range(place.shape[1]):
            for start, stop in intervals(self.amid[:, leg]):
                way = place[stop - 1, leg, :2] - place[start, leg, :2]
                span = self.walk.time[stop - 1] - self.walk.time[start]
                speeds.append(float(np.hypot(*way) / span))
        return float(np.mean(speeds))

    @property
    def way(self) -> float:
        """How far the trunk got ahead [m]."""
        return float(self.channel("body_position")[-1, 0])

    @property
    def tangential(self) -> float:
        """Rms of a foot's tangential force amid stance [N]."""
        return _size(self.channel("foot_force")[self.amid][:, :2])

    @property
    def squeeze(self) -> float:
        """Rms of a foot's internal force amid stance [N]: what feet exert on each other."""
        return _size(self.internal(self.channel("foot_force"))[self.amid])

    @property
    def torque_gap(self) -> float:
        """Rms difference of the torques from the model's amid stance, worst joint [N·m]."""
        gap = self.channel("joint_torque") - self.channel("joint_torque_model")
        mask = np.broadcast_to(self.amid[..., None], gap.shape)
        return float(rms(gap, mask).max())

    def internal(self, force: Float[np.ndarray, "time legs 3"]) -> np.ndarray:
        """The part of forces on standing feet that adds up to no force and no moment.

        Args:
            force: On each foot [N], or any other vector for each.

        Returns:
            Zero where fewer than three feet stand, shape (N, L, 3).
        """
        found = np.zeros(force.shape)
        for legs in np.unique(self.amid, axis=0):
            if legs.sum() < 3:
                continue
            at = np.ix_((self.amid == legs).all(axis=1), legs)
            feet = self.channel("foot_position")[at]
            grasp = grasp_matrix(feet - feet.mean(axis=1, keepdims=True))
            flat = force[at].reshape(len(feet), -1, 1)
            outer = np.linalg.pinv(grasp) @ (grasp @ flat)
            found[at] = (flat - outer).reshape(feet.shape)
        return found


def _size(vectors: np.ndarray) -> float:
    """Root mean square length of vectors, shape (N, k)."""
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=-1))))


@dataclass(frozen=True)
class Squeeze:
    """The internal tangential forces of one walk, and what they are computed to be.

    Attributes:
        law: The law of contact.
        varied: What is varied, in words.
        width: Of the feet [m].
        simulated: Rms of a foot's internal force amid stance [N].
        mass: With which the engine's friction resists that a foot is moved, mean of all feet [kg].
        by_mass: The internal part of that mass times J' q' [N]; zero outside the engine.
        by_slip: The internal part of friction on the slip of feet that turn in the ground [N].
        missed: Rms of what both together miss [N].
    """

    law: str
    varied: str
    width: float
    simulated: float
    mass: float
    by_mass: float
    by_slip: float
    missed: float


@dataclass(frozen=True, eq=False)
class Comparison:
    """Everything that the page on the laws shows.

    Attributes:
        trials: The paper's walk, by law.
        step_times: Time of a step, every channel recorded [s], by law.
        squeezes: Internal forces on feet that are nearly points, and on those of the scenario.
    """

    trials: dict[str, Trial]
    step_times: dict[str, float]
    squeezes: list[Squeeze]

    @property
    def largest_load_gap(self) -> float:
        """Largest `Trial.load_gap` of any law from the default."""
        return max(each.load_gap(self.trials[LAWS[0]]) for each in self.trials.values())


def trial(scenario: Scenario, **changes: Any) -> Trial:
    """Simulate a scenario with some changes.

    Args:
        scenario: What is walked, but for the changes.
        **changes: As of `Scenario.replace`.
    """
    scenario = scenario.replace(**changes)
    walk = plan(scenario)
    recording = simulate(scenario, walk)
    return Trial(scenario, walk.sample(np.asarray(recording["time"].values)), recording)


def compare(scenario: Scenario | None = None, *, announce: Announce | None = None) -> Comparison:
    """Walk under all laws, and look for what their tangential forces come from.

    Args:
        scenario: The paper's by default; joints must be prescribed.
        announce: Is told what is being done.
    """
    scenario = scenario or load_scenario("paper")
    tell = announce or (lambda _: None)
    trials, times = {}, {}
    for law in LAWS:
        tell(f"walking under {law}")
        trials[law] = trial(scenario, contact_law=law)
        times[law] = step_time(trials[law].scenario)
    # Two cycles have whole stances of all legs.
    brief = scenario.replace(duration=2 * scenario.period)
    squeezes = []
    widths = POINT_FOOT, scenario.contact_law(scenario.load_robot()).tip_width
    for impedance in IMPEDANCES:
        tell(f"the engine with an impedance of {impedance:g}")
        for width in widths:
            found = trial(brief, impedance=impedance, tip_width=width)
            squeezes.append(squeeze(found, f"impedance {impedance:g}"))
    for threshold in THRESHOLDS:
        tell(f"the library's law with a threshold of {threshold:g} m/s")
        for width in widths:
            terms = {"friction_threshold": threshold, "tip_width": width}
            found = trial(brief, contact_law="simscape", **terms)
            squeezes.append(squeeze(found, f"threshold {1000 * threshold:g} mm/s"))
    return Comparison(trials, times, squeezes)


def step_time(scenario: Scenario) -> float:
    """Time of a step of a run, every channel recorded [s]; the quickest of some runs."""
    walk, found = plan(scenario), []
    for _ in range(ROUNDS):
        run = new_run(scenario, walk)
        start = time.perf_counter()
        run.advance()
        found.append((time.perf_counter() - start) / run.steps)
    return min(found)


def squeeze(found: Trial, varied: str) -> Squeeze:
    """A walk's internal forces beside two causes that are computed from its plan.

    The engine takes the acceleration of a contact for J q'', and leaves out J' q'. A standing foot
    does not accelerate, so that J q'' = -J' q' there, which its friction resists with a mass. And
    under any law a foot touches half its depth above its tip, a point that the turning tibia moves
    over the ground, against its friction.

    Args:
        found: A walk with prescribed joints.
        varied: What is varied, in words.
    """
    contact, walk = found.scenario.contact, found.walk
    law = found.scenario.contact_law(walk.robot)
    normal = found.channel("foot_normal_force")
    mass = np.zeros(len(walk.robot.legs))
    drag = found.scenario.terrain.friction * normal / contact.friction_threshold
    if law.kind != "simscape":
        model = build_model(walk.robot, found.scenario)
        names, d = walk.robot.leg_names, law.impedance
        mobility = np.array([model.body(f"{name}.tibia").invweight0[0] for name in names])
        mass = CONTACT_POINTS * law.friction_hardness * d / ((1 - d) * mobility)
        drag = np.full(normal.shape, CONTACT_POINTS * law.friction_damping)
    by_mass = found.internal(_level(mass[:, None] * _turning_acceleration(walk)))
    by_slip = found.internal(_level(-drag[..., None] * _turning_slip(found)))
    seen, amid = found.internal(found.channel("foot_force")), found.amid
    return Squeeze(
        law.kind,
        varied,
        law.tip_width,
        _size(seen[amid]),
        float(mass.mean()),
        _size(by_mass[amid]),
        _size(by_slip[amid]),
        _size((seen - by_mass - by_slip)[amid]),
    )


def _level(vectors: np.ndarray) -> np.ndarray:
    """The vectors without their upright component."""
    return vectors * [1.0, 1.0, 0.0]


def _turning_slip(found: Trial) -> Float[np.ndarray, "time legs 3"]:
    """Speed over the ground of the points half their depth above the tips [m/s]."""
    walk = found.walk
    axes = link_frames(walk.robot, walk.q).rotation[..., 2]
    turning = np.einsum("tlki,tlk->tli", axes, walk.qd)
    body = planned_body(walk)
    turning = np.einsum("tij,tlj->tli", body.rotation, turning) + body.angular_velocity[:, None]
    arm = np.zeros(turning.shape)
    arm[..., 2] = -found.channel("foot_position")[..., 2] / 2
    return np.cross(turning, arm)


def _turning_acceleration(walk: Walk) -> Float[np.ndarray, "time legs 3"]:
    """J' q' of the plan's feet in world axes [m/s²], by central differences of the Jacobian."""
    # The plan is smooth over milliseconds; a difference over 2e-5 s leaves 1e-8 of it.
    half = 1e-5
    late, early = (walk.sample(np.maximum(walk.time + off, 0.0)) for off in (half, -half))
    J, K = (foot_jacobian(w.robot, planned_body(w), w.q) for w in (late, early))
    body = planned_body(walk)
    speeds = np.hstack([body.velocity, body.angular_velocity, walk.qd.reshape(len(walk.time), -1)])
    span = (late.time - early.time)[:, None, None]
    return ((J - K) @ speeds[:, None, :, None])[..., 0] / span
