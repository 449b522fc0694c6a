"""How feet share a load: by a second solver, and by hand."""

import numpy as np

from forces.loads import random_load, reference, wrench_of
from phasmid.forces import minimum_norm, share_load
from phasmid.kinematics import centre_of_mass, quaternion_rotation, yaw_quaternion
from phasmid.motion import plan
from physics.rows import row
from physics.walking import amid_stance

LOADS = 20  # number of loads on six feet


def force_sharing(bench):
    """Least forces within friction cones, on uneven ground."""
    contacts, wrench, _, _ = random_load(LOADS, 6, 6, seed=22, full=True)
    force = share_load(contacts, wrench, "friction-cone")
    other = np.array([reference(contacts, wrench, sample) for sample in range(LOADS)])
    why = "Equilibrium is eliminated first, so that it holds to round-off of 100 N."
    given = wrench_of(contacts.feet, force)
    yield row("equilibrium", given - wrench, 1e-9, why, unit="N, N·m")
    why = (
        "Clarabel, an interior-point method, ends with a gap of 1e-13 of a cost of 1e2, which is "
        "1e-6 N of the forces."
    )
    yield row("off a second solver", force - other, 1e-6, why, unit="N")


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
        mean = float(share.mean())
        yield row(f"leg {middle + 1}, simulated mean", seen.mean(), 0.02 * mean, why, expected=mean)


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
