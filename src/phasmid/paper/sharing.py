"""Force models compared with simulated contact, for each drive of the joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from phasmid.forces import Contacts, analyse, friction_statistics
from phasmid.forces.load import grasp_matrix
from phasmid.kinematics import jacobian, joint_angles
from phasmid.paper.evidence import DRIVES, Evidence, Trial
from phasmid.paper.walking import force_differences
from phasmid.reporting.steps import intervals
from phasmid.simulation import CONTACT_POINTS

CREEPS = (75.0, 150.0, 300.0, 600.0)
"""Friction dampings on which prescribed joints are tried [N·s/m]."""

AFTER_TOUCHDOWN = (0.1, 0.2, 0.3, 0.5, 0.7)
"""Times at which the squeeze of servos is measured [s]."""


@dataclass(frozen=True)
class Share:
    """One force model beside one simulation; everything amid the stances.

    Attributes:
        model: The force model.
        drive: Drive of the joints.
        normal: Rms difference of the normal forces [N].
        tangential: Rms difference of the tangential forces [N].
        torque: Rms difference of the torques, all joints [N·m].
    """

    model: str
    drive: str
    normal: float
    tangential: float
    torque: float


@dataclass(frozen=True)
class Grip:
    """Friction demand of the forces of a model or of a simulation, in mid-stance.

    Attributes:
        source: The force model, or the drive of the simulation.
        mean: Mean of tangential over normal force.
        high: 95th percentile of all samples.
        largest: Largest.
        margin: Least distance from the friction cone [N]; below 0 a foot slips.
    """

    source: str
    mean: float
    high: float
    largest: float
    margin: float


@dataclass(frozen=True)
class Squeeze:
    """Internal forces amid the stances: those that feet exert on each other through the robot.

    Attributes:
        source: Drive of the joints, or the ground.
        tangential: Rms of a foot's simulated tangential force [N].
        internal: Rms of a foot's simulated internal force [N].
        remainder: Rms of the part beyond internal forces and the minimum norm, such as
            a body that moves beside its plan [N].
        normal_part: Largest normal part of an internal force of 1 N, over all samples.
    """

    source: str
    tangential: float
    internal: float
    remainder: float
    normal_part: float


@dataclass(frozen=True)
class Relaxation:
    """How much of the minimum torque's squeeze servos show, from touchdown on.

    Attributes:
        drive: Drive of the joints.
        shares: At `AFTER_TOUCHDOWN`, the simulated tangential forces' part along those of the
            minimum torque, as a share of them.
        seen: Time in which it fades to 1/e, from the second to the last of them [s].
        expected: A foot's friction damping times its joints' give in the outward direction [s].
    """

    drive: str
    shares: tuple[float, ...]
    seen: float
    expected: float


def model_force_and_torque(trial: Trial, model: str) -> tuple[np.ndarray, np.ndarray]:
    """Foot forces [N] and joint torques [N·m] of a force model on a trial's plan."""
    if model not in trial.shared:
        found = analyse(trial.scenario.replace(force_model=model), trial.walk)
        force, torque = found["foot_force_model"], found["joint_torque_model"]
        trial.shared[model] = np.asarray(force.values), np.asarray(torque.values)
    return trial.shared[model]


def compare_models(evidence: Evidence, models: tuple[str, ...]) -> list[Share]:
    """Each force model beside each drive."""
    found = []
    for drive in DRIVES:
        trial = evidence.driven(drive)
        seen = trial.channel("joint_torque")[trial.amid_stance]
        for model in models:
            force, torque = model_force_and_torque(trial, model)
            normal, tangential, _ = force_differences(trial, force)
            gap = torque[trial.amid_stance] - seen
            found.append(Share(model, drive, normal, tangential, float(np.sqrt(np.mean(gap**2)))))
    return found


def compare_grips(evidence: Evidence, models: tuple[str, ...]) -> list[Grip]:
    """Measure the friction demand of each force model and of each simulation of the walk."""
    found = [
        _grip(model, evidence.walk, model_force_and_torque(evidence.walk, model)[0])
        for model in models
    ]
    for drive in DRIVES:
        trial = evidence.driven(drive)
        found.append(_grip(f"simulated, {drive}", trial, trial.channel("foot_force")))
    return found


def _grip(source: str, trial: Trial, force: np.ndarray) -> Grip:
    feet, friction = trial.channel("foot_position"), trial.scenario.terrain.friction
    contacts = Contacts(feet, trial.amid_stance, friction=friction)
    found = friction_statistics(contacts, force).summary()
    demand = found["demand"]
    margin = found["margin"]["min"]
    return Grip(source, demand["mean"], demand["p95"], demand["max"], margin)


def compare_squeezes(evidence: Evidence) -> list[Squeeze]:
    """Return the internal part of the simulated foot forces for each drive."""
    return [squeeze(evidence.driven(drive), drive) for drive in DRIVES]


def compare_creeps(evidence: Evidence) -> list[Squeeze]:
    """Return the internal part for prescribed joints and several friction dampings."""
    return [squeeze(evidence.creeping(c), f"{c:g} N·s/m a point") for c in CREEPS]


def squeeze(trial: Trial, source: str) -> Squeeze:
    """Split a trial's tangential foot forces.

    Args:
        trial: The walk; its recorded model is the minimum norm.
        source: Label of the trial.
    """
    seen, least = trial.channel("foot_force"), trial.channel("foot_force_model")
    inner, left, normal_part, count = 0.0, 0.0, 0.0, 0
    for legs in np.unique(trial.amid_stance, axis=0):
        if legs.sum() < 3:
            continue
        amid = (trial.amid_stance == legs).all(axis=1)
        basis = internal_forces(trial.channel("foot_position")[amid][:, legs])
        gap = (seen - least)[amid][:, legs].reshape(len(basis), -1)
        along = (basis @ gap[..., None])[..., 0]
        inside = np.einsum("nij,ni->nj", basis, along)
        inner += float(np.sum(inside**2))
        left += float(np.sum((gap - inside) ** 2))
        normal_part = max(normal_part, float(np.abs(basis[..., 2::3]).max()))
        count += len(gap) * int(legs.sum())
    _, _, tangential = force_differences(trial)
    return Squeeze(source, tangential, (inner / count) ** 0.5, (left / count) ** 0.5, normal_part)


def internal_forces(feet: np.ndarray) -> np.ndarray:
    """Return an orthonormal basis (N, k, 3 n) of internal forces of the feet (N, n, 3)."""
    grasp = grasp_matrix(feet - feet.mean(axis=1, keepdims=True))
    _, _, rows = np.linalg.svd(grasp)
    return np.asarray(rows[:, 6:])


def compare_relaxations(evidence: Evidence) -> list[Relaxation]:
    """Return the decay of internal forces after touchdown, with ideal servos."""
    return [relaxation(evidence.driven(drive), drive) for drive in DRIVES[1:3]]


def relaxation(trial: Trial, drive: str) -> Relaxation:
    """Return simulated and minimum-torque tangential forces by the time since touchdown.

    Args:
        trial: A walk on servos.
        drive: Label of the trial.
    """
    seen = trial.channel("foot_force")[..., :2]
    least = model_force_and_torque(trial, "minimum-torque")[0][..., :2]
    shares = []
    for after in AFTER_TOUCHDOWN:
        along, size = 0.0, 0.0
        for leg in range(seen.shape[1]):
            for start, stop in intervals(trial.walk.stance[:, leg]):
                at = int(np.searchsorted(trial.walk.time, trial.walk.time[start] + after - 1e-9))
                # The first stance begins in the middle of things, the last may be cut short.
                if start > 0 and at < stop:
                    along += float(seen[at, leg] @ least[at, leg])
                    size += float(least[at, leg] @ least[at, leg])
        shares.append(along / size)
    faded = np.log(shares[1] / shares[-1])
    seconds = (AFTER_TOUCHDOWN[-1] - AFTER_TOUCHDOWN[1]) / faded
    return Relaxation(drive, tuple(shares), float(seconds), fading_time(trial))


def fading_time(trial: Trial) -> float:
    """Return a foot's friction damping times its outward compliance [s]."""
    robot = trial.walk.robot
    q = joint_angles(robot.arrays, robot.arrays.neutral_foot)
    outward = jacobian(robot.arrays, q)[:, 0]
    give = np.sum(outward**2, axis=-1).mean() / robot.servo.stiffness
    return float(CONTACT_POINTS * trial.scenario.contact.friction_damping * give)
