"""Ground force on a foot from the torques of its joints, and deflection of the legs.

The vertical is the body's z axis, in the axes of each hip.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.control.estimation.ground_plane import fit_plane
from phasmid.control.estimation.state import EstimatorParameters, EstimatorState
from phasmid.dynamics.leg_kernels import elevated, into_coxa
from phasmid.kinematics.leg_kernels import forward_kinematics, joint_motion, sincos

LEAST_BEND = 0.2
"""Sine of the knee angle below which the leg is stretched and torques do not determine the
force."""


@compiled
def normal_force(
    parameters: EstimatorParameters,
    leg: int,
    q: Float[np.ndarray, "3"],
    torque: Float[np.ndarray, "3"],
) -> float:
    """Return the vertical ground force on a foot at rest [N]; NaN where the leg is stretched.

    Virtual power: while the foot moves along the vertical, the force has the power of the torques
    that hold the links' weight, less that of the actual torques.
    """
    if abs(math.sin(q[2])) < LEAST_BEND:
        return math.nan
    lengths, up = parameters.lengths[leg], parameters.up[leg]
    rate, acceleration, g = np.empty(3), np.empty(3), parameters.gravity * up
    joint_motion(lengths, lengths[3], q, up, np.zeros(3), rate, acceleration)
    s1, c1 = sincos(q[0])
    weight = elevated(
        lengths,
        parameters.link_mass[leg],
        parameters.link_moment[leg],
        parameters.link_inertia[leg],
        into_coxa(g[0], g[1], g[2], s1, c1),
        sincos(q[1]),
        sincos(q[1] + q[2]),
    )
    holding = np.array([weight.g1, weight.g2 + weight.g3, weight.g3])
    return rate @ (holding - torque)


@compiled
def estimate_compliance(
    target: Float[np.ndarray, "legs 3"],
    measured: Float[np.ndarray, "legs 3"],
    p_odom_foot: Float[np.ndarray, "legs 3"],
    estimator: EstimatorState,
    parameters: EstimatorParameters,
) -> float:
    """Estimate the height that each foot in the air lacks; return the mean that the body lacks [m].

    The joints of the bearing legs show how much lower the body is over their feet. The body is
    rigid, so that a plane through these heights holds at the other feet. Those hang lower by it and
    by the deflection of their own joints.
    """
    legs = parameters.leg_count
    points, weights = np.empty((legs, 3)), np.zeros(legs)
    for leg in range(legs):
        foot = estimator.feet[leg]
        foot.deflection = foot_height(parameters, leg, measured[leg]) - foot_height(
            parameters, leg, target[leg]
        )
        points[leg] = p_odom_foot[leg]
        points[leg, 2] = 0.0
        if foot.bearing != 0 and math.isfinite(foot.deflection):
            points[leg, 2] = foot.deflection
            weights[leg] = 1.0
    if weights.sum() == 0.0:
        return 0.0
    centre, a, b = fit_plane(points, weights, 0.0, 0.0)
    for leg in range(legs):
        foot = estimator.feet[leg]
        if foot.standing == 0:
            x, y = points[leg, 0] - centre[0], points[leg, 1] - centre[1]
            sag = centre[2] + a * x + b * y - foot.deflection
            foot.sag = sag if math.isfinite(sag) else 0.0
    return centre[2]


@compiled
def foot_height(parameters: EstimatorParameters, leg: int, q: Float[np.ndarray, "3"]) -> float:
    """Return the height of a foot over its hip [m]."""
    lengths, up = parameters.lengths[leg], parameters.up[leg]
    return up @ np.array(forward_kinematics(lengths, lengths[3], q[0], q[1], q[2]))
