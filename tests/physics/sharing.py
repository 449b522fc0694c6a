"""How feet share a load: by the laws of the optimum, by a second method, and by hand."""

import numpy as np

from phasmid.forces import Contacts, minimum_norm, share_load
from phasmid.kinematics import centre_of_mass, quaternion_rotation, yaw_quaternion
from phasmid.motion import plan
from physics.rows import row
from physics.walking import amid_stance

LOADS, FRICTION = 20, 0.6  # number of loads on six feet, and the friction under them
ROUNDS = 4000  # steps of the second method


def force_sharing(bench):
    """Least forces within friction cones, on uneven ground."""
    contacts, wrench = _loads()
    force = share_load(contacts, wrench, "friction-cone")
    given = np.concatenate([force.sum(axis=1), np.cross(contacts.feet, force).sum(axis=1)], axis=-1)
    local = np.einsum("nlij,nli->nlj", contacts.axes, force)
    other = _second_method(contacts, wrench)
    other_local = np.einsum("nlij,nli->nlj", contacts.axes, other)
    why = "Equilibrium is eliminated first, so that it holds to round-off of 100 N."
    yield row("equilibrium", given - wrench, 1e-9, why, unit="N, N·m")
    why = (
        "F = Aᵀλ + z with z on the cones' inner normals where they are touched; the program is "
        "solved to 1e-11 of some 10 N."
    )
    yield row("KKT residual", _stationarity(contacts, local), 1e-9, why, unit="N")
    why = f"Alternating projections, {ROUNDS} rounds, end within 1e-8 N of the optimum."
    yield row("off a second method", local - other_local, 1e-7, why, unit="N")


def _loads():
    """Six feet on slopes, and the load of forces that use up to 95 % of the friction."""
    rng = np.random.default_rng(22)
    angle = 2 * np.pi * np.arange(6) / 6
    feet = np.stack([0.25 * np.cos(angle), 0.2 * np.sin(angle), -0.1 + 0 * angle], axis=-1)
    feet = feet + rng.normal(scale=0.03, size=(LOADS, 6, 3))
    normals = np.array([0, 0, 1.0]) + rng.normal(scale=0.2, size=feet.shape)
    contacts = Contacts(feet, np.ones(feet.shape[:2]), normals, FRICTION)
    normal = rng.uniform(0.5, 10.0, size=feet.shape[:2])
    along = FRICTION * normal * rng.uniform(0, 0.95, size=normal.shape)
    turn = rng.uniform(0, 2 * np.pi, size=normal.shape)
    force = np.stack([normal, along * np.cos(turn), along * np.sin(turn)], axis=-1)
    force = (contacts.axes @ force[..., None])[..., 0]
    wrench = [force.sum(axis=1), np.cross(feet, force).sum(axis=1)]
    return contacts, np.concatenate(wrench, axis=-1)


def _grasps(contacts):
    """From forces in contact axes to force and moment."""
    count, legs = contacts.feet.shape[:2]
    columns = np.swapaxes(contacts.axes, -1, -2)
    moments = np.cross(contacts.feet[:, :, None], columns)
    both = np.concatenate([columns, moments], axis=-1)
    return np.swapaxes(both.reshape(count, 3 * legs, 6), 1, 2)


def _stationarity(contacts, local):
    """Return the part of the forces that no multiplier of the right sign explains."""
    left = []
    for A, f in zip(_grasps(contacts), local, strict=True):
        columns = []
        for foot, (normal, *along) in enumerate(f):
            size = float(np.hypot(*along))
            at = np.zeros((len(f), 3))
            if normal < 1e-8:
                for axis in np.eye(3):
                    at = np.zeros((len(f), 3))
                    at[foot] = axis
                    columns.append(at.ravel())
            elif FRICTION * normal - size < 1e-8:
                at[foot] = [FRICTION, -along[0] / size, -along[1] / size]
                columns.append(at.ravel())
        basis = np.column_stack([A.T, *columns])
        fitted = np.linalg.lstsq(basis, f.ravel(), rcond=None)[0]
        left.append(np.abs(basis @ fitted - f.ravel()).max())
    return float(np.max(left))


def _second_method(contacts, wrench):
    """Return the forces by ADMM (Boyd et al. 2011), in world axes.

    One half makes the least squares within equilibrium, the other projects on the cones.
    """
    A = _grasps(contacts)
    inverse = np.linalg.pinv(A)
    fixed = (inverse @ wrench[..., None])[..., 0]
    free = np.eye(A.shape[-1]) - inverse @ A
    z = np.zeros_like(fixed)
    u = np.zeros_like(fixed)
    for _ in range(ROUNDS):
        # The least of |x|² + |x - (z - u)|² within equilibrium.
        x = fixed + (free @ ((z - u) / 2)[..., None])[..., 0]
        z = _into_cones(x + u)
        u = u + x - z
    local = z.reshape(*contacts.feet.shape[:2], 3)
    return np.einsum("nlij,nlj->nli", contacts.axes, local)


def _into_cones(f):
    """Project forces onto the friction cones."""
    local = f.reshape(len(f), -1, 3)
    normal, along = local[..., 0], local[..., 1:]
    size = np.hypot(along[..., 0], along[..., 1])
    onto = np.maximum((normal + FRICTION * size) / (1 + FRICTION**2), 0.0)
    inside = size <= FRICTION * normal
    scale = np.where(inside, 1.0, FRICTION * onto / np.where(size > 0, size, 1.0))
    nearest = np.concatenate(
        [np.where(inside, normal, onto)[..., None], scale[..., None] * along], -1
    )
    return nearest.reshape(f.shape)


TRIPODS = (((0, 2, 4), 4), ((1, 3, 5), 1))  # legs of each tripod and its middle leg, counted from 0


def tripod(bench):
    """Compare the middle foot's share by areas, by the force model, and in the walk."""
    recording, robot = bench.walk(), bench.scenario.load_robot()
    weight = robot.mass * bench.scenario.model.gravity
    why = "Three equations with three unknowns, of numbers about 1: round-off of 1e-15."
    yield row("statics: model off the areas' share", _model_error(bench), 1e-9, why)
    rotation = quaternion_rotation(recording["body_orientation"].values)
    inside = centre_of_mass(robot, recording["joint_position"].values)
    centre = recording["body_position"].values + (rotation @ inside[..., None])[..., 0]
    for legs, middle in TRIPODS:
        rows = amid_stance(recording, legs)
        feet = recording["foot_position"].values[rows]
        share = _share_by_areas(feet, centre[rows], legs, middle)
        seen = recording["foot_normal_force"].values[rows, middle] / weight
        why = "The specified 2 %: accelerations of the body average out over a stance."
        yield row(
            f"leg {middle + 1}, simulated mean",
            seen.mean(),
            0.02 * float(share.mean()),
            why,
            expected=share.mean(),
        )


def _model_error(bench):
    """Largest difference of the force model's share of a middle foot from that by areas."""
    walk = plan(bench.scenario)
    centre = mass_centre(walk)
    weight = walk.robot.mass * bench.scenario.model.gravity
    # About the centre of mass the weight has no moment.
    wrench = np.array([0.0, 0.0, weight, 0.0, 0.0, 0.0])
    arms = walk.foot_position - centre[:, None]
    force = minimum_norm(arms, walk.stance, np.broadcast_to(wrench, (len(arms), 6)))
    apart = []
    for legs, middle in TRIPODS:
        rows = walk.stance[:, legs].all(axis=1)
        share = _share_by_areas(walk.foot_position[rows], centre[rows], legs, middle)
        apart.append(np.abs(force[rows, middle, 2] / weight - share).max())
    return float(np.max(apart))


def mass_centre(walk):
    """Return the planned centre of mass of a robot whose trunk stays level, world axes [m]."""
    rotation = quaternion_rotation(yaw_quaternion(walk.trunk.yaw))
    inside = centre_of_mass(walk.robot, walk.q)
    return np.asarray(walk.trunk.position + (rotation @ inside[..., None])[..., 0])


def _share_by_areas(feet, centre, legs, middle):
    """Return a foot's share of the weight.

    It is the area of the triangle of the centre of mass and the other two feet, divided by that of
    all three feet, both from above.
    """
    a, b = (feet[:, leg, :2] for leg in legs if leg != middle)
    return _area(centre[:, :2], a, b) / _area(feet[:, middle, :2], a, b)


def _area(a, b, c):
    u, v = b - a, c - a
    return (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2
