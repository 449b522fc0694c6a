"""Paths and gaits as they are planned."""

from __future__ import annotations

import numpy as np

from phasmid.gait import HEXAPOD_GAITS
from phasmid.motion import blend, join, lift, plan
from phasmid.verification.laboratory import Laboratory
from phasmid.verification.row import Reading

PHASES = 6000
"""Instants of one cycle at which a gait is looked at; a multiple of all its fractions."""


def quintic(laboratory: Laboratory) -> list[Reading]:
    """Ends and joints of the quintic paths: position, velocity and acceleration."""
    del laboratory
    ends = blend("quintic", np.array([0.0, 1.0]))
    wanted = np.array([[0.0, 1.0], [0.0, 0.0], [0.0, 0.0]])
    top = np.nextafter(0.5, [0.0, 1.0])
    over = np.abs(np.diff(np.array(lift("quintic", top)), axis=1)).max()
    start, end, v0, v1 = (np.array([x]) for x in (0.3, -0.2, 1.5, -0.7))
    path = np.array(join("quintic", np.array([0.0, 1.0]), start, end, (v0, v1)))
    asked = np.array([[0.3, -0.2], [1.5, -0.7], [0.0, 0.0]])
    why = "Coefficients up to 60, each product rounded by 1e-16: 1e-13 at the most."
    return [
        Reading(float(np.abs(np.array(ends) - wanted).max()), 1e-12, why, case="ends of a blend"),
        Reading(float(over), 1e-12, why, case="over the top of a lift"),
        Reading(float(np.abs(path - asked).max()), 1e-12, why, case="ends of a join"),
    ]


def gaits(laboratory: Laboratory) -> list[Reading]:
    """Feet on the ground, margin of support and duty factor, all gaits of a hexapod."""
    phases = (np.arange(PHASES) + 0.5) / PHASES
    missing, shortfall, off = 0.0, 0.0, 0.0
    for name, gait in HEXAPOD_GAITS.items():
        stands = gait.stance(phases)
        missing = max(missing, float(3 - stands.sum(axis=1).min()))
        off = max(off, float(np.abs(stands.sum(axis=0) - gait.duty_factor * PHASES).max()))
        period = laboratory.scenario.stride.period
        walk = plan(laboratory.scenario.replace(gait=name)).sample(phases * period)
        shortfall = max(shortfall, -float(walk.support_margin.min()))
    return [
        Reading(max(missing, 0.0), 0.0, "Counted.", unit="feet", case="fewer than three feet down"),
        Reading(max(shortfall, 0.0), 0.0, "It must be positive.", unit="m", case="margin below 0"),
        Reading(
            off,
            1e-9,
            f"Counted at {PHASES} instants, which all fractions divide; 1e-9 is for a sixth.",
            unit="instants",
            case="standing, off the duty factor",
        ),
    ]
