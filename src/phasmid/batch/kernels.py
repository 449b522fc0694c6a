"""The kernels: which of the readable equations each one is made of, and over which arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from phasmid.dynamics.components import apply
from phasmid.dynamics.inertia import moments_about_origin
from phasmid.dynamics.leg import torque_of
from phasmid.dynamics.recursion import Moments
from phasmid.dynamics.whole_body import Mount, leg_share, trunk_share
from phasmid.kinematics.leg import angles_of, foot_of, jacobian_of

Shapes = Mapping[str, tuple[int, ...]]
Values = Mapping[str, Any]

LEG: Shapes = {"gravity": (), "lengths": (3,), "mass": (3,), "com": (3, 3), "inertia": (3, 3, 3)}
MOUNTED: Shapes = {**LEG, "R_body_hip": (3, 3), "p_body_hip": (3,)}
TILTED: Shapes = {**LEG, "gravity": (3,)}
TRUNK: Shapes = {"gravity": (), "mass": (1,), "com": (1, 3), "inertia": (1, 3, 3)}
"""Shapes of what is known of a leg or a trunk, in the order in which it lies flat."""


@dataclass(frozen=True)
class Block:
    """Equations that are evaluated together.

    Attributes:
        constants: Shapes of what is the same for all samples.
        inputs: Names of the arrays that it reads.
        compute: Outputs by name, from constants and inputs by name.
    """

    constants: Shapes
    inputs: tuple[str, ...]
    compute: Callable[[Values, Values], Values]


@dataclass(frozen=True)
class Kernel:
    """A function over arrays of any length, one block of samples after the other.

    Attributes:
        name: Of the function.
        leg_inputs: Arrays with an entry per sample and leg, and the shape of an entry.
        leg_outputs: What it gives per sample and leg. ``margin`` is not given out: where it is
            not at least zero there is no solution.
        each: Evaluated for each leg.
        sample_inputs: Arrays with an entry per sample.
        sample_outputs: What it gives per sample.
        between: What the trunk's block hands to the legs' blocks, and these to the last.
        before: Evaluated before the legs, for the trunk.
        after: Evaluated after the legs.
    """

    name: str
    leg_inputs: Shapes
    leg_outputs: Shapes
    each: Block
    sample_inputs: Shapes = field(default_factory=dict)
    sample_outputs: Shapes = field(default_factory=dict)
    between: Shapes = field(default_factory=dict)
    before: Block | None = None
    after: Block | None = None


def _leg_torque(c: Values, x: Values) -> Values:
    links = c["lengths"], c["mass"], c["com"], c["inertia"]
    force = x.get("foot_force")
    return {"torque": torque_of(*links, x["q"], x["qd"], x["qdd"], force, c["gravity"])}


def _tilted_leg_torque(c: Values, x: Values) -> Values:
    links, (*aside, along) = (c["lengths"], c["mass"], c["com"], c["inertia"]), c["gravity"]
    motion = x["q"], x["qd"], x["qdd"], x.get("foot_force")
    return {"torque": torque_of(*links, *motion, along, (aside[0], aside[1]))}


def _foot_position(c: Values, x: Values) -> Values:
    return {"p_hip_foot": foot_of(c["lengths"], x["q"])}


def _joint_angles(c: Values, x: Values) -> Values:
    q, margin = angles_of(c["lengths"], x["p_hip_foot"])
    return {"q": q, "margin": margin}


def _jacobian(c: Values, x: Values) -> Values:
    return {"J": jacobian_of(c["lengths"], x["q"])}


def _moments(c: Values) -> list[Moments]:
    moments = moments_about_origin(c["mass"], c["com"], c["inertia"])
    return [Moments(*body) for body in zip(c["mass"], *moments, strict=True)]


def _trunk(c: Values, x: Values) -> Values:
    felt = x["acceleration"] + np.array([0.0, 0.0, c["gravity"]])
    (trunk,) = _moments(c)
    turning = x["angular_velocity"], x["angular_acceleration"]
    motion, needs = trunk_share(trunk, x["rotation"], *turning, felt)
    return {"motion": motion, "needs": needs}


def _upright_leg(c: Values, x: Values) -> Values:
    # The hip is turned about its z alone; nothing is multiplied by zero.
    (cos, _, _), (sin, _, _), _ = c["R_body_hip"]
    R_body_hip = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    return _mounted_leg({**c, "R_body_hip": R_body_hip}, x)


def _mounted_leg(c: Values, x: Values) -> Values:
    mount = Mount(c["R_body_hip"], c["p_body_hip"])
    inputs = x["foot_force"], x["q"], x["qd"], x["qdd"]
    lengths, links = c["lengths"], _moments(c)
    w, dw, a = x["motion"]
    torque, *share = leg_share(mount, lengths, links, x["rotation"], w, dw, a, *inputs)
    return {"torque": torque, "needs": x["needs"] + np.array(share)}


def _wrench(_: Values, x: Values) -> Values:
    return {"wrench": [apply(x["rotation"], v) for v in x["needs"]]}


THREE: Shapes = {"q": (3,), "qd": (3,), "qdd": (3,)}
LENGTHS: Shapes = {"lengths": (3,)}


def _inverse_dynamics(name: str, leg: Callable[[Values, Values], Values]) -> Kernel:
    inputs = ("rotation", "motion", "needs", "q", "qd", "qdd", "foot_force")
    turning = ("rotation", "angular_velocity", "angular_acceleration", "acceleration")
    return Kernel(
        name,
        {**THREE, "foot_force": (3,)},
        {"torque": (3,)},
        Block(MOUNTED, inputs, leg),
        sample_inputs={"rotation": (3, 3), **dict.fromkeys(turning[1:], (3,))},
        sample_outputs={"wrench": (2, 3)},
        between={"motion": (3, 3), "needs": (2, 3)},
        before=Block(TRUNK, turning, _trunk),
        after=Block({}, ("rotation", "needs"), _wrench),
    )


KERNELS = (
    Kernel("leg_torque", THREE, {"torque": (3,)}, Block(LEG, ("q", "qd", "qdd"), _leg_torque)),
    Kernel(
        "loaded_leg_torque",
        {**THREE, "foot_force": (3,)},
        {"torque": (3,)},
        Block(LEG, ("q", "qd", "qdd", "foot_force"), _leg_torque),
    ),
    Kernel(
        "foot_position", {"q": (3,)}, {"p_hip_foot": (3,)}, Block(LENGTHS, ("q",), _foot_position)
    ),
    Kernel(
        "joint_angles",
        {"p_hip_foot": (3,)},
        {"q": (3,), "margin": ()},
        Block(LENGTHS, ("p_hip_foot",), _joint_angles),
    ),
    Kernel("jacobian", {"q": (3,)}, {"J": (3, 3)}, Block(LENGTHS, ("q",), _jacobian)),
    Kernel(
        "tilted_leg_torque",
        THREE,
        {"torque": (3,)},
        Block(TILTED, ("q", "qd", "qdd"), _tilted_leg_torque),
    ),
    Kernel(
        "tilted_loaded_leg_torque",
        {**THREE, "foot_force": (3,)},
        {"torque": (3,)},
        Block(TILTED, ("q", "qd", "qdd", "foot_force"), _tilted_leg_torque),
    ),
    _inverse_dynamics("inverse_dynamics", _upright_leg),
    _inverse_dynamics("tilted_inverse_dynamics", _mounted_leg),
)
