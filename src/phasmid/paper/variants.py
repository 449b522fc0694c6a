"""The two stance laws and the two layouts of the hips, side by side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from phasmid.kinematics import quaternion_yaw
from phasmid.paper.evidence import Evidence

LAWS = ("straight", "coxa-only")
LAYOUTS = ("as-given", "perpendicular")


@dataclass(frozen=True)
class Variant:
    """How one reading of the paper walks.

    Attributes:
        stance_law: ``straight`` or ``coxa-only``.
        mounts: ``as-given``, corners at 45 degrees, or ``perpendicular``.
        slip: Mean way of a standing foot over the ground, per step [m].
        distance: Way of the body [m].
        drift: Sideways [m].
        heading_change: [rad].
        heading_wobble: Between the leftmost and the rightmost heading [rad].
        peak: Largest torque of coxa, femur and tibia, simulated with prescribed joints [N·m].
        peak_model: The same by the model, with minimum-norm forces [N·m].
    """

    stance_law: str
    mounts: str
    slip: float
    distance: float
    drift: float
    heading_change: float
    heading_wobble: float
    peak: tuple[float, float, float]
    peak_model: tuple[float, float, float]


def compare_variants(evidence: Evidence) -> list[Variant]:
    """Walk all four readings."""
    found = []
    for law in LAWS:
        for mounts in LAYOUTS:
            trial = evidence.variant(law, mounts)
            way, torque = trial.summary["travel"], trial.summary["torque"]
            heading = np.unwrap(quaternion_yaw(trial.channel("body_orientation")))
            peak, model = (
                np.array(torque[kind]["peak"]).max(axis=0) for kind in ("simulation", "model")
            )
            found.append(
                Variant(
                    law,
                    mounts,
                    trial.summary["slip"]["mean"],
                    way["forward"],
                    way["sideways_drift"],
                    way["heading_change"],
                    float(np.ptp(heading)),
                    (float(peak[0]), float(peak[1]), float(peak[2])),
                    (float(model[0]), float(model[1]), float(model[2])),
                )
            )
    return found
