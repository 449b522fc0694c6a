"""Misprints of the paper: place, printed text, correction and cost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.dynamics import leg_torque
from phasmid.dynamics.printed import EQ_10, LegMisprint, printed_leg_torque
from phasmid.kinematics import body_from_hip, foot_position
from phasmid.kinematics.printed import (
    KinematicMisprint,
    printed_body_rotation,
    printed_dh_transform,
    printed_joint_angles,
    printed_leg_pose,
)
from phasmid.paper.states import States, random_states, walk_states
from phasmid.units import STANDARD_GRAVITY

Error = Callable[[States, frozenset[str]], np.ndarray]
"""Size of the error that some misprints make, for each state and leg, shape (N, L)."""


class Proof(StrEnum):
    """How a misprint was shown; the tests fail for the printed form and hold for the right one."""

    EQUATION_OF_MOTION = "equation of motion"
    LOADED_FOOT = "loaded foot"
    RIGID_BODY = "rigid body"
    CHAIN = "chain"
    ROTATION = "rotation"
    ROUND_TRIP = "round trip"


class Extent(NamedTuple):
    """How far wrong a print goes on a set of states.

    Attributes:
        largest: Largest error, of a torque [N·m] or of a foot's place [m]; NaN where none is
            left.
        without_angle: Part of the states for which the print gives no angle at all.
    """

    largest: float
    without_angle: float


class Cost(NamedTuple):
    """Cost of a misprint.

    Attributes:
        swing: On the paper's walk, of a leg in the air.
        stance: On the paper's walk, of a leg that stands.
        random: On random states.
    """

    swing: Extent
    stance: Extent
    random: Extent


ROUND_OFF = 1e-9
"""Errors below this are round-off [mm or mN·m]."""


def torque_error(states: States, switches: frozenset[str]) -> np.ndarray:
    """Largest error of a leg's three torques [N·m], shape (N, L)."""
    legs = states.robot.arrays
    motion = (legs, states.q, states.qd, states.qdd)
    printed = printed_leg_torque(
        *motion, foot_force=states.foot_force, misprints=switches, gravity=STANDARD_GRAVITY
    )
    right = leg_torque(*motion, foot_force=states.foot_force, gravity=STANDARD_GRAVITY)
    return np.asarray(np.abs(printed - right).max(axis=-1))


@dataclass(frozen=True)
class Misprint:
    """One line of the table.

    Attributes:
        name: Its name, unique in the table.
        where: The equation or entry.
        printed: As printed in the paper.
        right: The correction.
        proof: How it was shown.
        error: Measures it.
        together: Misprints of the printed form that stand together; by default its own.
    """

    name: str
    where: str
    printed: str
    right: str
    proof: Proof = Proof.EQUATION_OF_MOTION
    error: Error = torque_error
    together: frozenset[str] = frozenset()

    @property
    def switches(self) -> frozenset[str]:
        """Switches of the printed form that stand together in this line."""
        return self.together or frozenset({self.name})

    def cost(self) -> Cost:
        """Measure the cost of this misprint alone, with all others corrected."""
        walk = walk_states()
        on_walk = self.error(walk, self.switches)
        on_random = self.error(random_states(), self.switches)
        return Cost(*map(_extent, (on_walk[~walk.stance], on_walk[walk.stance], on_random)))


def _extent(error: Float[np.ndarray, "..."]) -> Extent:
    there = np.isfinite(error)
    largest = float(error[there].max()) if there.any() else float("nan")
    return Extent(largest, 1 - float(there.mean()))


def chain_error(states: States, switches: frozenset[str]) -> np.ndarray:
    """Distance of the foot at the end of Table 1's chain from the true foot [m], shape (N, L)."""
    legs, q = states.robot.arrays, states.q
    zero, right = np.zeros(q.shape[:-1]), np.full(q.shape[:-1], np.pi / 2)
    coxa, femur, tibia = (zero + length for length in legs.lengths.T)
    X = np.eye(4)
    table = (
        (zero, zero, q[..., 0]),
        (right, coxa, q[..., 1]),
        (zero, femur, q[..., 2]),
        (zero, tibia, zero),
    )
    for alpha, a, theta in table:
        X = X @ printed_dh_transform(alpha, a, zero, theta, misprints=switches)
    return _distance(X[..., :3, 3], foot_position(legs, q))


def leg_pose_error(states: States, switches: frozenset[str]) -> np.ndarray:
    """Distance of the foot, brought into the body frame, from the true foot [m], shape (N, L)."""
    robot = states.robot
    p_hip_foot = foot_position(robot.arrays, states.q)
    yaw = np.array([leg.mount_yaw for leg in robot.legs])
    X = printed_leg_pose(robot.arrays.p_body_hip, yaw, misprints=switches)
    p_body_foot = np.einsum("lij,tlj->tli", X[:, :3, :3], p_hip_foot) + X[:, :3, 3]
    return _distance(p_body_foot, body_from_hip(robot, p_hip_foot))


def body_rotation_error(states: States, switches: frozenset[str]) -> np.ndarray:
    """Distance of the foot, turned into world axes, from the true foot [m], shape (N, L)."""
    p = body_from_hip(states.robot, foot_position(states.robot.arrays, states.q))
    # The paper's body has y ahead and x to the right.
    p = np.stack([-p[..., 1], p[..., 0], p[..., 2]], axis=-1)
    angles = tuple(states.attitude.T)
    wrong = printed_body_rotation(*angles, misprints=switches)
    right = printed_body_rotation(*angles, misprints=())
    return _distance(*(np.einsum("tij,tlj->tli", R, p) for R in (wrong, right)))


def joint_angle_error(states: States, switches: frozenset[str]) -> np.ndarray:
    """Return the distance between the commanded foot and that of the angles [m], shape (N, L)."""
    legs = states.robot.arrays
    p = foot_position(legs, states.q)
    return _distance(foot_position(legs, printed_joint_angles(legs, p, misprints=switches)), p)


def _distance(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.norm(a - b, axis=-1))


_K, _L = KinematicMisprint, LegMisprint
_ANGLES = (Proof.ROUND_TRIP, joint_angle_error)

MISPRINTS = (
    Misprint(_K.EQ_1_OFFSET, "Eq 1, entry (1,4)", "α of the previous link",
             "a of the previous link", Proof.CHAIN, chain_error),
    Misprint(_K.EQ_2_HEIGHT, "Eq 2, row 3", "0 0 0 0", "0 0 1 z",
             Proof.ROTATION, leg_pose_error),
    Misprint(_K.BODY_ROTATION, "body rotation T_B^G, entry (2,1)", "c(α)c(γ) + …",
             "c(α)s(γ) + …; the rest is Rz(γ)Rx(β)Ry(α)",
             Proof.ROTATION, body_rotation_error),
    Misprint(_K.EQ_3_QUADRANT, "Eq 3", "tan⁻¹ (Y/X)", "atan2(Y, X)", *_ANGLES),
    Misprint(_K.EQ_4_DISTANCE, "Eqs 4, 5", "L1, which is the coxa's length elsewhere",
             "horizontal distance of the foot from the coxa axis", *_ANGLES),
    Misprint(_K.EQ_5_QUADRANT, "Eq 5", "tan⁻¹ (Z/(L1 − Lc))", "atan2(Z, L1 − Lc)", *_ANGLES),
    Misprint(_K.EQ_6_ROOT, "Eq 6", "a root over the numerator", "no root", *_ANGLES),
    Misprint(_K.EQ_7_HEIGHT, "Eqs 5, 7", "q1 of the body height, which is positive",
             "q1 of the foot's height, negative below the hip", *_ANGLES),
    Misprint(_K.EQ_8_ROOT, "Eq 8", "a root over the numerator", "no root", *_ANGLES),
    Misprint("eqs-3-to-9", "Eqs 3 to 9 together", "the six above", "all corrected",
             *_ANGLES, frozenset(k for k in _K if k.name.startswith("EQ_") and k.name > "EQ_3")),
    Misprint(_L.M11_COXA_SIGN, "m11", "− I_zz1", "+ I_zz1"),
    Misprint(_L.M11_HALF_TIBIA_BRACKET, "m11, in the bracket of cos(2θ2 − 2θ3)/2",
             "L3² m3/8", "L3² m3/4"),
    Misprint(_L.M11_HALF_TIBIA_MASS, "m11, at L1 L2 cos θ2", "(m2 + m3)", "(m2 + 2 m3)"),
    Misprint(_L.M11_NO_FEMUR, "m11, at cos² θ2", "no masses", "+ L2² (m2/4 + m3)"),
    Misprint(_L.M11_NO_KNEE, "m11, in the bracket of L3 m3", "nothing", "+ L2 cos(2θ2 − θ3)/2"),
    Misprint(_L.M22_NO_TIBIA, "m22", "no I_zz3", "+ I_zz3"),
    Misprint(_L.B11_HALF, "b11", "half of it", "twice what is printed"),
    Misprint(_L.B12_SAME_INERTIA, "b12, in the bracket of sin(2θ2 − 2θ3)",
             "I_xx3 − I_xx3", "I_xx3 − I_yy3"),
    Misprint(_L.B12_SIGN, "b12, in the bracket of L3 m3", "+ L2 sin θ3/2", "− L2 sin θ3/2"),
    Misprint(_L.C21_NO_PLUS, "c21, in the bracket of sin 2θ2/2", "− I_xx2 L2² m2/4",
             "− I_xx2 + L2² m2/4"),
    Misprint(_L.C21_EXTRA_TERM, "c21", "+ L2 L3 m3 sin θ3/2", "no such term"),
    Misprint(_L.C23_TWICE, "c23", "L2 L3 m3 sin θ3", "L2 L3 m3 sin θ3/2"),
    Misprint(_L.C31_NO_PLUS, "c31, at the line break", "L1 sin(θ2 − θ3) L2 sin(2θ2 − θ3)/2",
             "L1 sin(θ2 − θ3) + L2 sin(2θ2 − θ3)/2"),
    Misprint("eq-10", "Eq 10 as printed, all together", "the 13 above", "all corrected",
             Proof.EQUATION_OF_MOTION, torque_error, frozenset(EQ_10)),
    Misprint(_L.THETA_3_AS_FED, "Eq 10 with θ3 of Eq 9",
             "θ3 = φ − 180° in Eq 9, cos(θ2 − θ3) in Eq 10",
             "one sign of θ3: that of Table 1, negated in Eq 10's sines and cosines only"),
    Misprint("eq-10-as-fed", "Eq 10 as printed, fed with θ3 of Eq 9", "all of these",
             "all corrected", Proof.EQUATION_OF_MOTION, torque_error,
             frozenset({*EQ_10, _L.THETA_3_AS_FED})),
    Misprint(_L.EQ_11_SIGN, "Eq 11", "+ JᵀF", "− JᵀF, F being the force of the ground on the foot",
             Proof.LOADED_FOOT),
    Misprint(_L.TABLE_2_UNIT, "Table 2", "inertias in 10⁻⁶ g·mm²", "inertias in g·mm²",
             Proof.RIGID_BODY),
)  # fmt: skip
"""The table: each misprint alone, and Eqs 3 to 9 and Eq 10 as they stand."""


class Slip(NamedTuple):
    """A slip of the pen or of the setting, which changes no number once it is understood."""

    where: str
    printed: str
    meant: str


SLIPS = (
    Slip("Eq 2", "i, l and γ_k for one and the same leg", "one index"),
    Slip("body rotation T_B^G, entry (2,1)", "S(β)", "s(β)"),
    Slip("Eq 9", "180", "180°"),
    Slip("b11", "I with the subscript xx3 − Iyy3", "I_xx3 − I_yy3"),
    Slip("b11, c21, c31", "l2, l3", "L2, L3"),
    Slip(
        "Table 2, I_yz",
        "−0.734 for femur and tibia alike",
        "perhaps one copied from the other; on this walk it is below 10⁻⁵ N·m",
    ),
    Slip("after Eq 10", "C is an n × matrix", "n × n"),
    Slip("[Θ̇Θ̇], [Θ̇²]", "rows", "columns: they are multiplied from the left"),
)
"""Slips of the print that change no number."""


def two_digits(value: float) -> str:
    """Format a number with two significant digits, without an exponent; round-off is 0."""
    return "0" if abs(value) < ROUND_OFF else f"{float(f'{value:.2g}'):g}"
