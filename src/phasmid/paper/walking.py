"""Statements of the paper on the walk, its torques and its foot forces (Figs 13 to 16)."""

from __future__ import annotations

import numpy as np

from phasmid import dynamics, kinematics
from phasmid.forces.analysis import planned_body
from phasmid.gait import shortfall
from phasmid.paper.evidence import GAITS, Evidence, Trial
from phasmid.paper.statement import Finding, Grade, Statement, judged
from phasmid.paper.trajectory import FIRST, SECOND
from phasmid.reporting.steps import SETTLING, away_from_switches, rms
from phasmid.servo.words import servo_quantity
from phasmid.units import STANDARD_GRAVITY

CLOSE = 0.1
"""Forces whose rms difference is less are alike [N]."""

NARROW = 0.0002
"""Width of feet that are nearly points [m]."""


def path(evidence: Evidence) -> Finding:
    """Way, drift, heading and tilt; and the way by the paper's own stance law."""
    way = evidence.walk.summary["travel"]
    other = evidence.variant("coxa-only", "as-given").summary["travel"]["forward"]
    far, ahead = way["commanded_forward"], way["forward"]
    drift, turn = way["sideways_drift"], np.degrees(way["heading_change"])
    tilt = np.degrees(way["largest_tilt"])
    straight = abs(ahead - far) < 0.01 * far and abs(drift) < 0.002 and abs(turn) < 0.2
    return judged(
        bool(straight),
        f"{1000 * ahead:.1f} of {1000 * far:.0f} mm in {evidence.scenario.duration:g} s, "
        f"{1000 * abs(drift):.2f} mm sideways, turned by {abs(turn):.3f}°, tilted by "
        f"{tilt:.2f}° at most; by the coxa alone {1000 * other:.0f} mm",
        "Feet move on straight lines; moved by the coxa alone, as in the paper, they slide.",
        best=Grade.HOLDS if abs(other - far) < 0.01 * far else Grade.WITH_A_LIMIT,
    )


def stable(evidence: Evidence) -> Finding:
    """Support margin of the tripod."""
    margin = evidence.walk.summary["support"]["least_margin"]
    return judged(
        margin > 0,
        f"the centre of mass stays {1000 * margin:.0f} mm inside the support triangle"
        if margin > 0
        else shortfall(margin),
    )


def swing_forces(evidence: Evidence) -> Finding:
    """Largest normal force of a swinging leg, away from its switches and near them."""
    trial = evidence.walk
    normal, swing = trial.channel("foot_normal_force"), ~trial.walk.stance
    away = away_from_switches(trial.walk.time, trial.walk.stance)
    amid, near = normal[swing & away].max(), normal[swing & ~away].max()
    return judged(
        bool(amid == 0),
        f"{amid:.2g} N from {1000 * SETTLING:g} ms after lift-off to {1000 * SETTLING:g} ms before "
        f"touchdown; up to {near:.1f} N closer to them",
        "The stance feet sink into the ground under the robot's weight. A foot that ends its "
        "transfer at rest therefore touches down some tens of milliseconds early.",
        best=Grade.HOLDS if near == 0 else Grade.WITH_A_LIMIT,
    )


def total(evidence: Evidence) -> Finding:
    """Sum of the bearing legs' normal forces, amid their stances and over all of them."""
    trial = evidence.walk
    normal, stance = trial.channel("foot_normal_force"), trial.walk.stance
    borne = np.where(stance, normal, 0.0).sum(axis=1)
    amid = borne[trial.amid_stance.any(axis=1)]
    mean = trial.summary["normal_force"]["simulation"]["mean_sum"]
    return judged(
        bool(np.abs(amid - 26).max() < 0.02 * 26),
        f"{amid.min():.2f} to {amid.max():.2f} N in mid-stance; {borne.min():.1f} to "
        f"{borne.max():.1f} N including the switches, when other feet also carry load; all six "
        f"{mean:.3f} N on average",
        best=Grade.HOLDS if np.abs(borne - 26).max() < 0.1 * 26 else Grade.WITH_A_LIMIT,
    )


def _middle_carries_most(evidence: Evidence, middle: int, others: tuple[int, int]) -> Finding:
    trial = evidence.walk
    normal, amid = trial.channel("foot_normal_force"), trial.amid_stance[:, middle]
    more = (normal[:, [middle]] - normal[:, others]).min(axis=1)
    means = normal[amid].mean(axis=0)
    least, ever = more[amid].min(), more[trial.walk.stance[:, middle]].min()
    a, b = others
    return judged(
        bool(least > 0),
        f"leg {middle + 1} {means[middle]:.2f} N, legs {a + 1} and {b + 1} {means[a]:.2f} and "
        f"{means[b]:.2f} N in mid-stance; the least difference is {least:.2f} N in mid-stance, "
        f"{ever:.2f} N at the switches",
        best=Grade.HOLDS if ever > 0 else Grade.WITH_A_LIMIT,
    )


def leg_two(evidence: Evidence) -> Finding:
    """Leg 2 against legs 4 and 6."""
    return _middle_carries_most(evidence, 1, (3, 5))


def leg_five(evidence: Evidence) -> Finding:
    """Leg 5 against legs 1 and 3."""
    return _middle_carries_most(evidence, 4, (0, 2))


def lever(evidence: Evidence) -> Finding:
    """Compare the middle leg's share by the lever rule with the simulated one."""
    trial = evidence.walk
    amid = trial.amid_stance[:, 1]
    feet = trial.walk.foot_position[amid] - trial.walk.trunk.position[amid, None]
    side = kinematics.centre_of_mass(trial.walk.robot, trial.walk.q[amid])[:, 1]
    left = feet[:, SECOND[1:], 1].mean(axis=1)
    share = trial.summary["robot"]["weight"] * (left - side) / (left - feet[:, 1, 1])
    seen = trial.channel("foot_normal_force")[amid, 1]
    miss = np.abs(share - seen).max()
    return judged(
        bool(miss < 0.05 * share.mean()),
        f"lever rule {share.mean():.2f} N, simulated {seen.mean():.2f} N for leg 2; "
        f"{miss:.2f} N apart at most",
    )


def minimum_norm(evidence: Evidence) -> Finding:
    """Compare minimum-norm and simulated forces, normal and tangential."""
    normal, tangential, size = force_differences(evidence.walk)
    _, servos, servos_size = force_differences(evidence.driven("AX-12A"))
    return judged(
        normal < CLOSE,
        f"normal forces within {normal:.3f} N rms; the error of the tangential ones is "
        f"{100 * tangential / size:.0f} % of {size:.2f} N rms, with AX-12A servos "
        f"{100 * servos / servos_size:.0f} % of {servos_size:.2f} N",
        "Statics alone determines the normal forces. The principle selects the tangential ones "
        "only; see the comparison below.",
        best=Grade.HOLDS if tangential < 0.1 * size else Grade.WITH_A_LIMIT,
    )


def force_differences(trial: Trial, model: np.ndarray | None = None) -> tuple[float, float, float]:
    """Return the differences of modelled and simulated foot forces in mid-stance.

    Args:
        trial: The walk.
        model: Foot forces [N], shape (N, L, 3); the recorded model's by default.

    Returns:
        Rms difference of the normal and of the tangential forces, and rms of the simulated
        tangential forces [N].
    """
    seen, amid = trial.channel("foot_force"), trial.amid_stance
    model = trial.channel("foot_force_model") if model is None else model
    gap, tangential = (model - seen)[amid], seen[amid][:, :2]
    return (
        float(np.sqrt(np.mean(gap[:, 2] ** 2))),
        float(np.sqrt(np.mean(np.sum(gap[:, :2] ** 2, axis=1)))),
        float(np.sqrt(np.mean(np.sum(tangential**2, axis=1)))),
    )


def verified(evidence: Evidence) -> Finding:
    """Compare the computed torques with the simulated ones, and explain the difference."""
    wide, narrow = evidence.walk, evidence.trial("feet of 0.2 mm", tip_width=NARROW)
    against = wide.summary["model_against_simulation"]["torque"]["rms_mid_stance"]
    alone = np.max(against)
    swing, support = (_torque_gap(wide, standing=standing) for standing in (False, True))
    point = _torque_gap(narrow, standing=True)
    size = 1000 * evidence.planned.experiment.world.contact.tip_width
    return judged(
        max(swing, point) < 0.001,
        f"worst joint {1000 * swing:.2f} mN·m rms in swing; in mid-stance {1000 * alone:.1f} with "
        f"minimum-norm forces, {1000 * support:.1f} with the simulated ones, {1000 * point:.2f} "
        f"with these on feet of {1000 * NARROW:g} mm",
        f"Prescribed joints. The differences in support come from the distribution of tangential "
        f"forces and from the centre of pressure on feet of {size:g} mm; the equations assume "
        f"point feet.",
        best=Grade.HOLDS if alone < 0.001 else Grade.WITH_A_LIMIT,
    )


def _torque_gap(trial: Trial, *, standing: bool) -> float:
    """Return the worst joint's rms residual of the equations, in stance or in swing [N·m]."""
    stance = trial.walk.stance
    calm = away_from_switches(trial.walk.time, stance).all(axis=1, keepdims=True)
    mask = (trial.amid_stance if standing else calm & ~stance)[..., None]
    gap = torque_from_simulated_forces(trial) - trial.channel("joint_torque")
    return float(rms(gap, np.broadcast_to(mask, gap.shape)).max())


def torque_from_simulated_forces(trial: Trial) -> np.ndarray:
    """Torques that the planned motion needs under the simulated foot forces [N·m], (N, L, 3).

    Eq. 11, corrected, for hips that move with the trunk: the whole robot's recursion.
    """
    walk, force = trial.walk, trial.channel("foot_force")
    motion = (walk.robot, planned_body(walk), walk.q, walk.qd, walk.qdd)
    return dynamics.inverse_dynamics(
        *motion, foot_force=force, gravity=STANDARD_GRAVITY
    ).joint_torque


def contact_points(evidence: Evidence) -> Finding:
    """Compare the contact points of the engine's model with their readings."""
    from phasmid.simulation import build_model

    model = build_model(evidence.scenario)
    points = int(np.sum(model.geom_bodyid > 0)) / len(evidence.robot.legs)
    force = evidence.walk.channel("foot_force")
    normal, friction = force[..., 2].max(), np.hypot(force[..., 0], force[..., 1]).max()
    return judged(
        bool(points == 4 and normal > 0 and friction > 0),
        f"{points:g} points a foot; normal forces up to {normal:.1f} N and friction up to "
        f"{friction:.1f} N are logged",
        best=Grade.BY_CONSTRUCTION,
    )


def torques(evidence: Evidence) -> Finding:
    """Peak torques in swing and in support, and near the switches."""
    trial = evidence.walk
    size, stance = np.abs(trial.channel("joint_torque")), trial.walk.stance
    calm = away_from_switches(trial.walk.time, stance)
    swing, support = (size[mask].max(axis=0) for mask in (calm & ~stance, calm & stance))
    peak = size.max(axis=(0, 1))
    start = size[(trial.walk.time < 1.0) & calm.all(axis=1)]
    first, second = start[:, FIRST].max(), start[:, SECOND].max()
    stall, ms = evidence.robot.servo.stall_torque, 1000 * SETTLING
    return judged(
        bool(first < second),
        f"coxa, femur, tibia in swing up to {_listed(swing)}, in support {_listed(support)}, "
        f"within {ms:g} ms of the switches {_listed(peak)} N·m",
        f"Prescribed joints; at most {100 * peak.max() / stall:.0f} % of the "
        f"{servo_quantity(evidence.robot.servo.name, 'stall torque')}.",
    )


def _listed(values: np.ndarray) -> str:
    return ", ".join(f"{value:.3f}" for value in values)


def gaits(evidence: Evidence) -> Finding:
    """Ways of the other gaits."""
    found = []
    for gait in GAITS:
        way = evidence.gait(gait).summary["travel"]
        found.append((gait, way["forward"] / way["commanded_forward"]))
    listed = ", ".join(f"{gait} {100 * share:.1f} %" for gait, share in found)
    good = all(abs(share - 1) < 0.05 for _, share in found)
    return judged(good, f"distance relative to the plan: {listed}")


def terrains(evidence: Evidence) -> Finding:
    """Measure walks on known uneven ground, and on level ground with other friction."""
    trials = {name: evidence.trial(name, terrain=name) for name in TERRAINS}
    for friction in (0.3, 1.0):
        trials[f"friction {friction:g}"] = evidence.trial(
            f"friction {friction:g}", friction=friction
        )
    found = []
    for name, trial in trials.items():
        way = trial.summary["travel"]
        completed = trial.recording.attrs["ending"] == "COMPLETED"
        found.append((name, way["forward"] / way["commanded_forward"] if completed else 0.0))
    listed = ", ".join(f"{name} {100 * share:.1f} %" for name, share in found)
    return judged(
        all(abs(share - 1) < 0.05 for _, share in found),
        f"distance relative to the plan: {listed}",
        "The plan uses the shape of the ground to select footholds; the paper's plan does not.",
        best=Grade.WITH_A_LIMIT,
    )


def independent(evidence: Evidence) -> Finding:
    """List the parts of the engine's model."""
    from phasmid.simulation import build_model

    model = build_model(evidence.scenario)
    hinges = int(model.nv) - 6
    return judged(
        hinges == evidence.robot.arrays.lengths.size,
        f"{int(model.nbody) - 1} bodies, {hinges} hinges and their contact points",
        "The engine is given no dynamic equation; the motion of its joints is planned by Eqs 3-9.",
        best=Grade.BY_CONSTRUCTION,
    )


TERRAINS = ("slope", "stairs", "waves", "rough")
"""Ground on which the paper's walk is tried besides its own."""

WALKING = (
    Statement("results", "it walks straight on level ground for 10 s", path),
    Statement("introduction", "the tripod gait is stable on level ground", stable),
    Statement(
        "Figs 9-10", "a foot is four contact points that report their forces", contact_points
    ),
    Statement("abstract", "the simulation verifies the computed joint torques", verified),
    Statement(
        "Figs 13-14", "joint torques: legs 1, 3, 5 begin in swing, the others in support", torques
    ),
    Statement("Figs 15-16", "in transfer the normal force is zero", swing_forces),
    Statement("Figs 15-16", "in support the three normal forces add up to about 26 N", total),
    Statement("Figs 15-16", "leg 2 carries more than legs 4 and 6", leg_two),
    Statement("Figs 15-16", "leg 5 carries more than legs 1 and 3", leg_five),
    Statement("Figs 15-16", "legs 2 and 5 do so because they are alone on their side", lever),
    Statement("abstract", "foot forces follow from their minimum norm", minimum_norm),
    Statement("conclusions", "the simulation needs no dynamic equations of the robot", independent),
    Statement("conclusions", "other gaits are easily applied", gaits),
    Statement("conclusions", "other terrains are easily applied", terrains),
)
"""In the paper's order."""
