"""Feet that give way to forces: a virtual mass, spring and damper each."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float, Shaped

from phasmid.compiled import internal

# Columns of a foot's memory.
OFFSET, SPEED = 0, 1


def transition(
    mass: float, stiffness: float, damping_ratio: float, dt: float
) -> tuple[Float[np.ndarray, "2 2"], Float[np.ndarray, "2"]]:
    """Exact step of m x'' + d x' + k x = f with f constant over it; stable for any step.

    Args:
        mass: m [kg].
        stiffness: k [N/m].
        damping_ratio: d over 2 √(k m).
        dt: Time step [s].

    Returns:
        A and b with (x, x') after the step = A (x, x') + b f.
    """
    w, zeta = math.sqrt(stiffness / mass), damping_ratio
    if abs(zeta - 1) < 1e-6:
        c, s = 1.0, dt
        decay = math.exp(-w * dt)
    elif zeta < 1:
        wd = w * math.sqrt(1 - zeta * zeta)
        c, s = math.cos(wd * dt), math.sin(wd * dt) / wd
        decay = math.exp(-zeta * w * dt)
    else:
        # By single exponentials, which do not overflow for long steps.
        wd = w * math.sqrt(zeta * zeta - 1)
        slow, fast = math.exp((wd - zeta * w) * dt), math.exp((-wd - zeta * w) * dt)
        c, s, decay = (slow + fast) / 2, (slow - fast) / (2 * wd), 1.0
    A = decay * np.array([[c + zeta * w * s, s], [-w * w * s, c - zeta * w * s]])
    b = (np.array([1.0, 0.0]) - A[:, 0]) / stiffness
    return A, b


@internal
def share_weight(
    weight: float,
    com: Float[np.ndarray, " place"],
    feet: Float[np.ndarray, "legs 3"],
    standing: Shaped[np.ndarray, " legs"],
    force: Float[np.ndarray, " legs"],
) -> None:
    """Vertical forces of the standing feet with the least sum of squares that bear the weight.

    Args:
        weight: To be borne [N].
        com: Place of the centre of mass [m]; its x and y are used.
        feet: Places [m], shape (L, 3).
        standing: Which stand, shape (L,).
        force: Is written [N], 0 or more, shape (L,).
    """
    n = xx = xy = yy = sx = sy = 0.0
    for i in range(force.shape[0]):
        if standing[i]:
            x, y = feet[i, 0] - com[0], feet[i, 1] - com[1]
            n += 1.0
            sx += x
            sy += y
            xx += x * x
            xy += x * y
            yy += y * y
    # f = p + q x + r y with (p, q, r) from the sums; those about the feet's own middle decouple.
    for i in range(force.shape[0]):
        force[i] = 0.0
    if n < 1.0:
        return
    mx, my = sx / n, sy / n
    cxx, cxy, cyy = xx - n * mx * mx, xy - n * mx * my, yy - n * my * my
    det = cxx * cyy - cxy * cxy
    q = r = 0.0
    if det > 1e-9:
        q = weight * (-mx * cyy + my * cxy) / det
        r = weight * (-my * cxx + mx * cxy) / det
    for i in range(force.shape[0]):
        if standing[i]:
            x, y = feet[i, 0] - com[0] - mx, feet[i, 1] - com[1] - my
            force[i] = max(weight / n + q * x + r * y, 0.0)


@internal
def give_way(
    measured: Float[np.ndarray, " legs"],
    wanted: Float[np.ndarray, " legs"],
    standing: Shaped[np.ndarray, " legs"],
    swing: Float[np.ndarray, "2 3"],
    stance: Float[np.ndarray, "2 3"],
    limit: float,
    feet: Float[np.ndarray, "legs 2"],
) -> None:
    """Step the feet's offsets: upwards where a foot carries more than it should.

    Args:
        measured: Normal forces [N]; NaN: unknown, taken for what is wanted, shape (L,).
        wanted: Normal forces [N], shape (L,).
        standing: Which stand, shape (L,).
        swing: A and b of `transition` side by side, for swinging feet, shape (2, 3).
        stance: The same for standing ones.
        limit: Largest offset [m].
        feet: Offset [m] and speed [m/s], is changed, shape (L, 2).
    """
    for i in range(wanted.shape[0]):
        law = stance if standing[i] else swing
        force = measured[i] - wanted[i] if standing[i] else 0.0
        if not math.isfinite(force):
            force = 0.0
        x, v = feet[i, OFFSET], feet[i, SPEED]
        feet[i, OFFSET] = law[0, 0] * x + law[0, 1] * v + law[0, 2] * force
        feet[i, SPEED] = law[1, 0] * x + law[1, 1] * v + law[1, 2] * force
        if abs(feet[i, OFFSET]) > limit:
            feet[i, OFFSET] = math.copysign(limit, feet[i, OFFSET])
            feet[i, SPEED] = 0.0
