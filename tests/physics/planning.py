"""Paths and gaits as they are planned."""

from itertools import permutations

import numpy as np

from phasmid.gait import HEXAPOD_GAITS
from phasmid.motion import blend, join, lift, plan
from physics.equations import derivative
from physics.rows import row
from physics.sharing import mass_centre

PHASES = 6000  # samples of one cycle of a gait; a multiple of all its fractions


def quintic(bench):
    """Ends, seams and derivatives of the quintic paths."""
    ends = blend("quintic", np.array([0.0, 1.0]))
    wanted = np.array([[0.0, 1.0], [0.0, 0.0], [0.0, 0.0]])
    top = np.nextafter(0.5, [0.0, 1.0])
    over = np.abs(np.diff(np.array(lift("quintic", top)), axis=1)).max()
    start, end, v0, v1 = (np.array([x]) for x in (0.3, -0.2, 1.5, -0.7))
    path = np.array(join("quintic", np.array([0.0, 1.0]), start, end, (v0, v1)))
    # The quotient looks 0.04 to either side, which must not cross the seam of a lift.
    inside = np.linspace(0.05, 0.95, 91)
    slopes = (
        _slope_error(lambda u: blend("quintic", u), inside),
        _slope_error(lambda u: lift("quintic", u), inside[np.abs(inside - 0.5) > 0.045]),
        _slope_error(lambda u: join("quintic", u, start, end, (v0, v1)), inside),
    )
    target = np.array([[0.3, -0.2], [1.5, -0.7], [0.0, 0.0]])
    why = "Coefficients up to 60, each product rounded by 1e-16: 1e-13 at the most."
    yield row("ends of a blend", np.array(ends) - wanted, 1e-12, why)
    yield row("over the top of a lift", over, 1e-12, why)
    yield row("ends of a join", path - target, 1e-12, why)
    why = (
        "The difference quotient is exact for a quintic but for round-off: some 20 terms up to "
        "10 rounded by 1e-15, over a step of 0.01, are 1e-12."
    )
    yield row("derivatives, off the difference quotient", np.max(slopes), 1e-11, why)


def gaits(bench):
    """Feet on the ground, margin of support and duty factor, all gaits of a hexapod."""
    phases = (np.arange(PHASES) + 0.5) / PHASES
    missing, without, apart, off = 0.0, 0, [], 0.0
    for name, gait in HEXAPOD_GAITS.items():
        stands = gait.stance(phases)
        missing = max(missing, float(3 - stands.sum(axis=1).min()))
        off = max(off, float(np.abs(stands.sum(axis=0) - gait.duty_factor * PHASES).max()))
        period = bench.scenario.build().course.stride.period
        walk = plan(bench.scenario.replace(gait=name)).sample(phases * period)
        margin = _margin(walk.foot_position[..., :2], walk.stance, mass_centre(walk)[:, :2])
        without += int(np.count_nonzero(~(margin > 0)))
        apart.append(np.abs(margin - walk.support_margin).max())
    yield row("fewer than three feet down", max(missing, 0.0), 0.0, "Counted.", unit="feet")
    yield row("no margin", without, 0.0, "Counted: it must be positive.", unit="instants")
    why = "Some ten operations on lengths below 0.3 m."
    yield row("margin, off the support function's", np.max(apart), 1e-12, why, unit="m")
    why = f"Counted at {PHASES} instants, which all fractions divide; 1e-9 is for a sixth."
    yield row("standing, off the duty factor", off, 1e-9, why, unit="instants")


def _slope_error(curve, u):
    """Return the differences of velocity and acceleration from numerical derivatives."""
    rates = derivative(lambda h: np.array(curve(u + h)[:2]), 0.0)
    return float(np.abs(rates - np.array(curve(u)[1:])).max())


def _margin(feet, stance, centre):
    """Return the distance of a centre within the standing feet's polygon from its edge [m].

    It is the least value of the polygon's support function about the centre, h(n) = max p·n.
    Among the normals of all lines through two standing feet are those of the edges.
    """
    arms = feet - centre[:, None]
    first, second = np.array(list(permutations(range(feet.shape[1]), 2))).T
    along = arms[:, second] - arms[:, first]
    normal = np.stack([along[..., 1], -along[..., 0]], axis=-1)
    normal /= np.linalg.norm(along, axis=-1, keepdims=True)
    reach = np.where(stance[:, None], normal @ np.swapaxes(arms, 1, 2), -np.inf).max(axis=-1)
    return np.where(stance[:, first] & stance[:, second], reach, np.inf).min(axis=-1)
