"""What the paper says of the walk, its torques and its foot forces (Figs 13 to 16)."""

from __future__ import annotations

import numpy as np

from phasmid import dynamics, kinematics
from phasmid.forces.analysis import planned_body
from phasmid.paper.evidence import GAITS, Evidence, Trial
from phasmid.paper.statement import Finding, Grade, Statement, judged
from phasmid.paper.trajectory import FIRST, SECOND
from phasmid.reporting.steps import away_from_switches, rms

CLOSE = 0.1
"""Forces whose rms difference is less are alike [N]."""

NARROW = 0.0002
"""Width of feet that are nearly points [m]."""


def path(evidence: Evidence) -> Finding:
    """Way, drift, heading and tilt."""
    way = evidence.walk.summary["travel"]
    far, ahead = way["commanded_forward"], way["forward"]
    drift, turn = way["sideways_drift"], np.degrees(way["heading_change"])
    tilt = np.degrees(way["largest_tilt"])
    return judged(
        bool(abs(ahead - far) < 0.01 * far and abs(drift) < 0.002 and abs(turn) < 0.2),
        f"{1000 * ahead:.1f} of {1000 * far:.0f} mm in {evidence.scenario.duration:g} s, "
        f"{1000 * abs(drift):.2f} mm aside, turned by {abs(turn):.3f}°, tilted by "
        f"{tilt:.2f}° at most",
    )


def stable(evidence: Evidence) -> Finding:
    """Support margin of the tripod."""
    margin = evidence.walk.summary["support"]["least_margin"]
    return judged(
        margin > 0, f"the centre of mass stays {1000 * margin:.0f} mm inside the support triangle"
    )


def swing_forces(evidence: Evidence) -> Finding:
    """Largest normal force of a swinging leg."""
    trial = evidence.walk
    largest = trial.summary["normal_force"]["simulation"]["largest_in_swing"]
    margin = trial.summary["normal_force"]["simulation"]["swing_margin_time"]
    return judged(
        largest == 0, f"{largest:.2g} N at most, {1000 * margin:g} ms after lift-off and later"
    )


def total(evidence: Evidence) -> Finding:
    """Sum of the normal forces over whole cycles, and amid the stances."""
    load = evidence.walk.summary["normal_force"]["simulation"]
    normal, amid = evidence.walk.channel("foot_normal_force"), evidence.walk.amid_stance
    spread = normal.sum(axis=1)[amid.any(axis=1)]
    return judged(
        abs(load["mean_sum"] - 26) < 0.05,
        f"mean sum {load['mean_sum']:.3f} N; between {spread.min():.2f} and {spread.max():.2f} N "
        "amid the stances",
    )


def _middle_carries_most(evidence: Evidence, middle: int, others: tuple[int, int]) -> Finding:
    normal, amid = evidence.walk.channel("foot_normal_force"), evidence.walk.amid_stance
    held = normal[amid[:, middle]]
    means = held.mean(axis=0)
    margin = (held[:, [middle]] - held[:, others]).min()
    a, b = others
    return judged(
        bool(margin > 0),
        f"leg {middle + 1} {means[middle]:.2f} N, legs {a + 1} and {b + 1} {means[a]:.2f} and "
        f"{means[b]:.2f} N amid stance; at every instant at least {margin:.2f} N more",
    )


def leg_two(evidence: Evidence) -> Finding:
    """Leg 2 against legs 4 and 6."""
    return _middle_carries_most(evidence, 1, (3, 5))


def leg_five(evidence: Evidence) -> Finding:
    """Leg 5 against legs 1 and 3."""
    return _middle_carries_most(evidence, 4, (0, 2))


def lever(evidence: Evidence) -> Finding:
    """The middle leg's share by the lever rule, against the simulated one."""
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
    """The minimum-norm forces against the simulated ones, normal and tangential."""
    normal, tangential, size = force_differences(evidence.walk)
    grade = Grade.HOLDS if tangential < 0.1 * size else Grade.WITH_A_LIMIT
    return Finding(
        f"normal forces within {normal:.3f} N rms; tangential ones {tangential:.3f} N rms apart, "
        f"where the simulated ones are {size:.3f} N rms",
        grade if normal < CLOSE else Grade.FAILS,
        "Normal forces are what statics leaves no choice of. Tangential ones depend on servos and "
        "friction; see the comparison below.",
    )


def force_differences(trial: Trial, model: np.ndarray | None = None) -> tuple[float, float, float]:
    """How far a model's foot forces are from the simulated ones, amid the stances of all legs.

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
    """The equations fed with the simulated foot forces, against the simulated torques."""
    wide, narrow = evidence.walk, evidence.trial("feet of 0.2 mm", tip_width=NARROW)
    swing, support = (_torque_gap(wide, standing=standing) for standing in (False, True))
    point = _torque_gap(narrow, standing=True)
    size = 1000 * evidence.scenario.contact.tip_width
    return judged(
        max(swing, point) < 0.001,
        f"worst joint in swing {1000 * swing:.2f} mN·m rms; in support, with the simulated foot "
        f"forces, {1000 * support:.1f} on feet {size:g} mm wide and {1000 * point:.2f} on feet of "
        f"{1000 * NARROW:g} mm",
        "Prescribed joints. The equations take a foot for a point; the rest is where on its "
        "four points the load stands.",
    )


def _torque_gap(trial: Trial, *, standing: bool) -> float:
    """Rms over the worst joint of what the equations miss, away from the switches [N·m]."""
    stance = trial.walk.stance
    calm = away_from_switches(trial.walk.time, stance).all(axis=1, keepdims=True)
    mask = (calm & (stance == standing))[..., None]
    gap = torque_from_simulated_forces(trial) - trial.channel("joint_torque")
    return float(rms(gap, np.broadcast_to(mask, gap.shape)).max())


def torque_from_simulated_forces(trial: Trial) -> np.ndarray:
    """Torques that the planned motion needs under the simulated foot forces [N·m], (N, L, 3).

    Eq. 11, corrected, for hips that move with the trunk: the whole robot's recursion.
    """
    walk, force = trial.walk, trial.channel("foot_force")
    motion = (walk.robot, planned_body(walk), walk.q, walk.qd, walk.qdd)
    return dynamics.inverse_dynamics(*motion, foot_force=force).joint_torque


def contact_points(evidence: Evidence) -> Finding:
    """Contact points of the engine's model, and what they report."""
    from phasmid.simulation import build_model

    model = build_model(evidence.robot, evidence.scenario)
    points = int(np.sum(model.geom_bodyid > 0))
    channels = evidence.walk.recording.data_vars
    both = {"foot_force", "foot_normal_force"} <= set(map(str, channels))
    return judged(
        points == 24 and both,
        f"{points // 6} points a foot, whose sum is logged as force and as normal force",
    )


def torques(evidence: Evidence) -> Finding:
    """Peak torques in swing and in support."""
    trial = evidence.walk
    size, stance = np.abs(trial.channel("joint_torque")), trial.walk.stance
    calm = away_from_switches(trial.walk.time, stance)
    swing, support = (size[mask].max(axis=0) for mask in (calm & ~stance, calm & stance))
    start = size[(trial.walk.time < 1.0) & calm.all(axis=1)]
    first, second = start[:, FIRST].max(), start[:, SECOND].max()
    stall = evidence.robot.servo.stall_torque
    return judged(
        bool(first < second),
        "swing: coxa {:.3f}, femur {:.3f}, tibia {:.3f}; support: {:.3f}, {:.3f}, {:.3f} N·m at "
        "most".format(*swing, *support),
        f"Servo: prescribed joints; {100 * support.max() / stall:.0f} % of the "
        f"{evidence.robot.servo.name}'s stall torque.",
    )


def gaits(evidence: Evidence) -> Finding:
    """Ways of the other gaits."""
    found = []
    for gait in GAITS:
        way = evidence.gait(gait).summary["travel"]
        found.append((gait, way["forward"] / way["commanded_forward"]))
    listed = ", ".join(f"{gait} {100 * share:.1f} %" for gait, share in found)
    good = all(abs(share - 1) < 0.05 for _, share in found)
    return judged(good, f"way against the plan: {listed}")


def terrains(evidence: Evidence) -> Finding:
    """Ways on other ground; only its friction can be changed so far."""
    found = []
    for friction in (0.3, 1.0):
        way = evidence.trial(f"friction {friction:g}", friction=friction).summary["travel"]
        found.append((friction, way["forward"] / way["commanded_forward"]))
    listed = ", ".join(f"{friction:g}: {100 * share:.1f} %" for friction, share in found)
    good = all(abs(share - 1) < 0.05 for _, share in found)
    return Finding(
        f"way against the plan at a friction of {listed}",
        Grade.WITH_A_LIMIT if good else Grade.FAILS,
        "Level ground of any friction; slopes, steps and height maps are not built yet.",
    )


def independent(evidence: Evidence) -> Finding:
    """What the simulation and the equations share: the links, and nothing else."""
    trial = evidence.walk
    energy = trial.summary["energy"]["work"]
    tau, qd = trial.channel("joint_torque_model"), trial.channel("joint_velocity_target")
    power = np.maximum(tau * qd, 0).sum(axis=(1, 2))
    model = float(np.trapezoid(power, trial.walk.time))
    return judged(
        abs(energy - model) < 0.1 * model,
        f"positive joint work {energy:.2f} J simulated, {model:.2f} J by the equations",
        "The engine is given links, joints and contact, and none of Eqs. 3-11.",
    )


WALKING = (
    Statement("results", "it walks straight on level ground for 10 s", path),
    Statement("introduction", "the tripod gait is stable on level ground", stable),
    Statement(
        "Figs 9-10", "a foot is four contact points that report their forces", contact_points
    ),
    Statement("abstract", "the simulation verifies the computed joint torques", verified),
    Statement("Figs 13-14", "joint torques: legs 1, 3, 5 begin in swing, the others bear", torques),
    Statement("Figs 15-16", "in transfer the normal force is zero", swing_forces),
    Statement("Figs 15-16", "in support the three normal forces add up to about 26 N", total),
    Statement("Figs 15-16", "leg 2 bears more than legs 4 and 6", leg_two),
    Statement("Figs 15-16", "leg 5 bears more than legs 1 and 3", leg_five),
    Statement("Figs 15-16", "because it is alone on its side", lever),
    Statement("abstract", "foot forces follow from their minimum norm", minimum_norm),
    Statement("conclusions", "the simulation does without the robot's equations", independent),
    Statement("conclusions", "other gaits are easily applied", gaits),
    Statement("conclusions", "other terrains are easily applied", terrains),
)
"""In the paper's order."""
