"""Comparisons on the page: readings of the paper, and force models beside simulated contact."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from phasmid.forces import FORCE_MODELS, Contacts, analyse, friction_statistics
from phasmid.forces.load import grasp_matrix
from phasmid.kinematics import jacobian, joint_angles, quaternion_yaw
from phasmid.paper.evidence import DRIVES, Evidence, Trial
from phasmid.paper.walking import force_differences
from phasmid.reporting.steps import intervals
from phasmid.simulation import CONTACT_POINTS

CREEPS = (75.0, 150.0, 300.0, 600.0)
"""Friction dampings on which prescribed joints are tried [N·s/m]."""

AFTER_TOUCHDOWN = (0.1, 0.2, 0.3, 0.5, 0.7)
"""Times at which the squeeze of servos is measured [s]."""


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def variants_table(evidence: Evidence) -> str:
    """Walk under both stance laws on both layouts of the hips."""
    head = ("stance law", "mounts", "way [mm]", "drift [mm]", "heading [°]", "slip a step [mm]")
    joints = ("coxa [N·m]", "femur [N·m]", "tibia [N·m]")
    rows = []
    for law in ("straight", "coxa-only"):
        for mounts in ("as-given", "perpendicular"):
            trial = evidence.variant(law, mounts)
            way, torque = trial.summary["travel"], trial.summary["torque"]
            heading = np.unwrap(quaternion_yaw(trial.channel("body_orientation")))
            turn, wobble = np.degrees([way["heading_change"], np.ptp(heading) / 2])
            peak, model = (
                np.array(torque[kind]["peak"]).max(axis=0) for kind in ("simulation", "model")
            )
            rows.append(
                (
                    law,
                    mounts,
                    f"{1000 * way['forward']:.0f}",
                    f"{round(1000 * way['sideways_drift'], 1) + 0.0:.1f}",
                    f"{round(float(turn), 2) + 0.0:.2f} ± {wobble:.2f}",
                    f"{1000 * trial.summary['slip']['mean']:.1f}",
                    *(f"{a:.2f} / {b:.2f}" for a, b in zip(peak, model, strict=True)),
                )
            )
    return table((*head, *joints), rows)


@cache
def model_force_and_torque(trial: Trial, model: str) -> tuple[np.ndarray, np.ndarray]:
    """Foot forces [N] and joint torques [N·m] of a force model on a trial's plan."""
    found = analyse(trial.scenario.replace(force_model=model), trial.walk)
    return found["foot_force_model"].values, found["joint_torque_model"].values


def model_differences(trial: Trial, model: str) -> tuple[float, float, float]:
    """Rms differences of a model's normal and tangential forces [N] and of its torques [N·m]."""
    force, torque = model_force_and_torque(trial, model)
    normal, tangential, _ = force_differences(trial, force)
    gap = (torque - trial.channel("joint_torque"))[trial.amid_stance]
    return normal, tangential, float(np.sqrt(np.mean(gap**2)))


def shares_tables(evidence: Evidence) -> str:
    """Compare each force model with each drive; the nearest models of a drive are bold."""
    gap = [[model_differences(evidence.driven(d), m) for m in FORCE_MODELS] for d in DRIVES]
    kinds = ("normal forces [N]", "tangential forces [N]", "joint torques [N·m]")
    tables = []
    for kind, values in zip(kinds, np.array(gap).T, strict=True):
        # Models that differ by less than a hundredth come equally near.
        near = values <= 1.01 * values.min(axis=0)
        cells = np.where(near, "**{:.3f}**", "{:.3f}")
        rows = [
            (model, *(cell.format(value) for cell, value in zip(*row, strict=True)))
            for model, *row in zip(FORCE_MODELS, cells, values, strict=True)
        ]
        tables.append(table((kind, *DRIVES), rows))
    return "\n\n".join(tables)


def grips_table(evidence: Evidence) -> str:
    """Measure the friction demand of each force model and of each simulation of the walk."""
    rows = []
    for model in FORCE_MODELS:
        force, _ = model_force_and_torque(evidence.walk, model)
        rows.append((model, *_grip(evidence.walk, force)))
    for drive in DRIVES:
        trial = evidence.driven(drive)
        rows.append((f"simulated, {drive}", *_grip(trial, trial.channel("foot_force"))))
    return table(("forces", "mean", "95 %", "largest", "margin [N]"), rows)


def _grip(trial: Trial, force: np.ndarray) -> list[str]:
    feet, friction = trial.channel("foot_position"), trial.scenario.terrain.friction
    contacts = Contacts(feet, trial.amid_stance, friction=friction)
    found = friction_statistics(contacts, force).summary()
    demand = found["demand"]
    values = demand["mean"], demand["p95"], demand["max"], found["margin"]["min"]
    return [f"{value:.3f}" for value in values]


class Squeeze(NamedTuple):
    """Internal forces amid the stances: those that feet exert on each other through the robot.

    Attributes:
        tangential: Rms of a foot's simulated tangential force [N].
        internal: Rms of a foot's simulated internal force [N].
        remainder: Rms of the part beyond internal forces and the minimum norm [N].
        normal_part: Largest normal part of an internal force of 1 N, over all samples.
    """

    tangential: float
    internal: float
    remainder: float
    normal_part: float


def squeezes_table(what: str, trials: dict[str, Trial]) -> str:
    """Measure the internal forces of trials by their labels."""
    head = (what, "tangential", "internal", "remainder", "normal part of a squeeze of 1 N")
    rows = []
    for label, trial in trials.items():
        *forces, normal_part = squeeze(trial)
        rows.append((label, *(f"{force:.2f}" for force in forces), f"{normal_part:.4f}"))
    return table(head, rows)


def squeeze(trial: Trial) -> Squeeze:
    """Split the tangential foot forces of a walk whose recorded model is the minimum norm."""
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
    return Squeeze(tangential, (inner / count) ** 0.5, (left / count) ** 0.5, normal_part)


def internal_forces(feet: np.ndarray) -> np.ndarray:
    """Return an orthonormal basis (N, k, 3 n) of internal forces of the feet (N, n, 3)."""
    grasp = grasp_matrix(feet - feet.mean(axis=1, keepdims=True))
    _, _, rows = np.linalg.svd(grasp)
    return np.asarray(rows[:, 6:])


def relaxations_table(evidence: Evidence) -> str:
    """Measure how the squeeze of servos that give like springs fades from touchdown on."""
    rows = []
    for drive in list(DRIVES)[1:3]:
        trial = evidence.driven(drive)
        shares, seen = relaxation(trial)
        cells = [f"{share:.2f}" for share in shares]
        rows.append((drive, *cells, f"{seen:.1f} s", f"{fading_time(trial):.1f} s"))
    times = [f"{time:g} s" for time in AFTER_TOUCHDOWN]
    return table(("joints", *times, "decay time", "damping × compliance"), rows)


def relaxation(trial: Trial) -> tuple[list[float], float]:
    """Return how much of the minimum torque's squeeze servos show, from touchdown on.

    Returns:
        At `AFTER_TOUCHDOWN`, the simulated tangential forces' part along those of the minimum
        torque, as a share of them; and the time in which it fades to 1/e, from the second to the
        last of them [s].
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
    return shares, float((AFTER_TOUCHDOWN[-1] - AFTER_TOUCHDOWN[1]) / faded)


def fading_time(trial: Trial) -> float:
    """Return a foot's friction damping times its outward compliance [s]."""
    robot = trial.walk.robot
    q = joint_angles(robot.arrays, robot.arrays.neutral_foot)
    outward = jacobian(robot.arrays, q)[:, 0]
    give = np.sum(outward**2, axis=-1).mean() / robot.servo.stiffness
    return float(CONTACT_POINTS * trial.walk.experiment.world.contact.friction_damping * give)
