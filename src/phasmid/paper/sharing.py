"""The force models against simulated contact: who comes nearest to which servos, and why."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from phasmid.forces import Contacts, analyse, friction_statistics
from phasmid.kinematics import jacobian, joint_angles
from phasmid.paper.evidence import Evidence, Trial
from phasmid.paper.walking import force_differences

DRIVES = ("prescribed", "soft", "AX-12A")
"""From joints that no torque moves off their plan to the robot's own servos."""


@dataclass(frozen=True)
class Share:
    """One force model beside one simulation; everything amid the stances.

    Attributes:
        model: The force model.
        drive: What moved the joints.
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
    """What friction the forces of a model or of a simulation need, amid the stances.

    Attributes:
        source: The force model, or the drive of the simulation.
        mean: Mean of tangential over normal force.
        high: What 95 % of all samples stay below.
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
    """Internal forces: those that feet exert on each other through the robot.

    Attributes:
        drive: What moved the joints.
        tangential: Rms of a foot's simulated tangential force [N].
        internal: Rms of a foot's simulated internal force [N].
        remainder: Rms of what neither internal forces nor the minimum norm explain, such as
            impacts and feet that stand beside their plan [N].
        normal_part: Largest normal part of an internal force of 1 N, over all samples.
        fading: Time in which a squeeze fades to 1/e, as the engine's friction creeps [s].
    """

    drive: str
    tangential: float
    internal: float
    remainder: float
    normal_part: float
    fading: float


def model_force_and_torque(trial: Trial, model: str) -> tuple[np.ndarray, np.ndarray]:
    """Foot forces [N] and joint torques [N·m] of a force model on a trial's plan."""
    recording = analyse(trial.scenario.replace(force_model=model), trial.walk)
    force, torque = recording["foot_force_model"], recording["joint_torque_model"]
    return np.asarray(force.values), np.asarray(torque.values)


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
    """What friction each force model asks for on the walk, and each simulation takes."""
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
    found = friction_statistics(contacts, force).summary(percentile=95.0)
    demand = found["demand"]
    margin = found["margin"]["min"]
    return Grip(source, demand["mean"], demand["percentile"], demand["max"], margin)


def compare_squeezes(evidence: Evidence) -> list[Squeeze]:
    """How much of the simulated foot forces is internal, under each drive."""
    found = []
    for drive in DRIVES:
        trial = evidence.driven(drive)
        seen, least = trial.channel("foot_force"), trial.channel("foot_force_model")
        inner, left, normal_part, count = 0.0, 0.0, 0.0, 0
        for legs in np.unique(trial.amid_stance, axis=0):
            if legs.sum() < 3:
                continue
            amid = (trial.amid_stance == legs).all(axis=1)
            basis = _internal_forces(trial.channel("foot_position")[amid][:, legs])
            gap = (seen - least)[amid][:, legs].reshape(len(basis), -1)
            along = (basis @ gap[..., None])[..., 0]
            inside = np.einsum("nij,ni->nj", basis, along)
            inner += float(np.sum(inside**2))
            left += float(np.sum((gap - inside) ** 2))
            normal_part = max(normal_part, float(np.abs(basis[..., 2::3]).max()))
            count += len(gap) * int(legs.sum())
        _, _, tangential = force_differences(trial)
        found.append(
            Squeeze(
                drive,
                tangential,
                (inner / count) ** 0.5,
                (left / count) ** 0.5,
                normal_part,
                _fading_time(trial),
            )
        )
    return found


def _fading_time(trial: Trial) -> float:
    """A foot's friction damping times its give in the outward direction [s]."""
    if trial.scenario.simulation.drive == "prescribed":
        return 0.0
    robot, points = trial.walk.robot, 4
    q = joint_angles(robot.arrays, robot.arrays.neutral_foot)
    outward = jacobian(robot.arrays, q)[:, 0]
    give = np.sum(outward**2, axis=-1).mean() / robot.servo.stiffness
    return float(points * trial.scenario.contact.friction_damping * give)


def _internal_forces(feet: np.ndarray) -> np.ndarray:
    """An orthonormal basis of the forces on feet (N, n, 3) that add up to nothing, (N, k, 3 n)."""
    count = feet.shape[1]
    x, y, z = np.moveaxis(feet - feet.mean(axis=1, keepdims=True), -1, 0)
    grasp = np.zeros((len(feet), 6, count, 3))
    for axis in range(3):
        grasp[:, axis, :, axis] = 1.0
    grasp[:, 3, :, 1], grasp[:, 3, :, 2] = -z, y
    grasp[:, 4, :, 0], grasp[:, 4, :, 2] = z, -x
    grasp[:, 5, :, 0], grasp[:, 5, :, 1] = -y, x
    _, _, rows = np.linalg.svd(grasp.reshape(len(feet), 6, 3 * count))
    return rows[:, 6:]
