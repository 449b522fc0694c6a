"""The share of the load that each foot of a tripod carries, by hand."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from phasmid.forces import minimum_norm
from phasmid.kinematics import centre_of_mass, quaternion_rotation, yaw_quaternion
from phasmid.motion import SampledMotion, plan
from phasmid.verification.laboratory import Laboratory
from phasmid.verification.row import Row, reading
from phasmid.verification.walking import amid_stance

TRIPODS = (((0, 2, 4), 4), ((1, 3, 5), 1))
"""Legs of each tripod and its middle leg, counted from 0."""


def tripod(laboratory: Laboratory) -> Iterator[Row]:
    """The middle foot's part of the weight: by areas, by the force model, in the walk."""
    recording, robot = laboratory.walk(), laboratory.scenario.load_robot()
    weight = robot.mass * laboratory.scenario.model.gravity
    yield reading(
        "statics: model off the areas' share",
        _model_error(laboratory),
        1e-9,
        "Three equations with three unknowns, of numbers about 1: round-off of 1e-15.",
    )
    rotation = quaternion_rotation(recording["body_orientation"].values)
    inside = centre_of_mass(robot, recording["joint_position"].values)
    centre = recording["body_position"].values + (rotation @ inside[..., None])[..., 0]
    for legs, middle in TRIPODS:
        rows = amid_stance(recording, legs)
        feet = recording["foot_position"].values[rows]
        share = _share_by_areas(feet, centre[rows], legs, middle)
        seen = recording["foot_normal_force"].values[rows, middle] / weight
        yield reading(
            f"leg {middle + 1}, simulated mean",
            seen.mean(),
            0.02 * float(share.mean()),
            "The charter's 2 %: what moves the body to and fro cancels over a stance.",
            expected=share.mean(),
        )


def _model_error(laboratory: Laboratory) -> float:
    """Largest difference of the force model's share of a middle foot from that by areas."""
    walk = plan(laboratory.scenario)
    centre = mass_centre(walk)
    weight = walk.robot.mass * laboratory.scenario.model.gravity
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


def mass_centre(walk: SampledMotion) -> Float[np.ndarray, "time 3"]:
    """Return the planned centre of mass of a robot whose trunk stays level, world axes [m]."""
    rotation = quaternion_rotation(yaw_quaternion(walk.trunk.yaw))
    inside = centre_of_mass(walk.robot, walk.q)
    return np.asarray(walk.trunk.position + (rotation @ inside[..., None])[..., 0])


def _share_by_areas(
    feet: Float[np.ndarray, "some legs 3"],
    centre: Float[np.ndarray, "some 3"],
    legs: tuple[int, ...],
    middle: int,
) -> Float[np.ndarray, " some"]:
    """A foot's share of the weight: the triangle of the centre of mass and the other two feet,
    as a part of the triangle of all three, both seen from above.
    """
    a, b = (feet[:, leg, :2] for leg in legs if leg != middle)
    return _area(centre[:, :2], a, b) / _area(feet[:, middle, :2], a, b)


def _area(
    a: Float[np.ndarray, "some 2"], b: Float[np.ndarray, "some 2"], c: Float[np.ndarray, "some 2"]
) -> Float[np.ndarray, " some"]:
    u, v = b - a, c - a
    return (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2
