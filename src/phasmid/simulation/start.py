"""Checks before a run: time step and start; the start of a robot that stands."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.experiment import Experiment, ScenarioLike, built
from phasmid.experiment.solver import USUAL_STEP
from phasmid.kinematics import (
    body_from_hip,
    foot_position,
    hip_from_body,
    joint_angles,
    neutral_feet,
    rotation_rpy,
)
from phasmid.motion import JointTrajectory, Motion, SampledMotion, SampledTrajectory, TrunkMotion
from phasmid.servo.law import longest_servo_step
from phasmid.servo.words import servo_words
from phasmid.simulation.contact import CONTACT_POINTS, SOFT_TIME
from phasmid.simulation.model import foot_mobility, joint_mobility

DEEPEST_START = 0.002
"""Allowed depth of a foot of ``phantomx-ax`` in the terrain at the start [m]; that of other robots
follows their leg length. The contact pushes a foot out gently."""

SAFETY_FACTOR = 0.9
"""Allowed share of the largest stable step: feet are lighter in other poses."""

SHORTEST_PRACTICAL = 2e-5
"""Time steps below this are not advised [s]: a walk takes fifty times as long as usual."""


def with_time_step(
    scenario: ScenarioLike | Experiment, walk: Motion, period: float = USUAL_STEP
) -> Experiment:
    """Choose the time step where the scenario gives none, else check the one that it gives.

    The chosen one is the longest, up to `USUAL_STEP`, that resolves the contact and the gears of
    the robot's own servos, and that divides the period and the interval of the recording.

    Args:
        scenario: The scenario, or its experiment.
        walk: A motion; its robot and first angles are used.
        period: Time between two updates of a controller [s]; of a planned walk, the usual step.

    Returns:
        The experiment with a time step.

    Raises:
        InvalidInput: The given step is too long, with the longest that would do; or the servos
            cannot be run.
    """
    experiment = built(scenario)
    longest, what = step_limit(experiment, walk.sample(np.zeros(1)).q[0])
    given = experiment.solver.dt
    if given is not None and given <= longest:
        return experiment
    common = _common_divisor(period, experiment.solver.record_interval or period)
    if common < SHORTEST_PRACTICAL:
        whole = max(1, round((experiment.solver.record_interval or period) / period))
        raise InvalidInput(
            f"no practical time step divides the period of {1000 * period:g} ms and the "
            f"record_interval of {1000 * (experiment.solver.record_interval or period):g} ms.",
            hint=f"record_interval = {whole * period:.9g}",
        )
    chosen = common / math.ceil(common / min(longest, USUAL_STEP) - 1e-9)
    if given is not None or chosen < SHORTEST_PRACTICAL:
        named = f"a time step of {given:g} s" if given is not None else "a time step"
        practical = chosen >= SHORTEST_PRACTICAL
        raise InvalidInput(
            f"{named} cannot resolve {what}; it needs {longest:.3g} s or less.",
            hint=f"dt = {chosen:.9g}" if practical else _softer(experiment),
        )
    return experiment.replace(dt=chosen)


def step_limit(experiment: Experiment, q: Float[np.ndarray, "legs 3"]) -> tuple[float, str]:
    """Return the longest time step that resolves contact and gears, and what limits it.

    Args:
        experiment: Its contact, drive and servo settings are used.
        q: Joint angles [rad], shape (L, 3).

    Returns:
        The step [s], and what limits it, in words.

    Raises:
        InvalidInput: The servos cannot be run.
    """
    contact, robot = longest_time_step(experiment), experiment.robot
    if experiment.solver.drive == "servo":
        if not robot.has_equal_servos:
            raise InvalidInput(
                'the servos of the joints differ; drive "servo" has one law for all of them.',
                hint='drive = "ideal-servo"',
            )
        gears = longest_servo_step(robot.servo, joint_mobility(experiment, q))
        if gears < contact:
            return gears, f"the gears of the {servo_words(robot.servo.name)}"
    return contact, "this contact"


CONTACT_NUMBERS = "stiffness", "damping", "friction_damping"
"""Numbers of a contact that limit the time step."""


def _softer(experiment: Experiment) -> str:
    """Return numbers of the contact, or a drive without gears, with which a step is practical."""
    law = experiment.replace(**dict.fromkeys(CONTACT_NUMBERS)).world.contact
    own = experiment.world.contact
    given = [name for name in CONTACT_NUMBERS if getattr(own, name) != getattr(law, name)]
    for count in range(1, len(given) + 1):
        for names in combinations(given, count):
            numbers = {name: float(f"{getattr(law, name):.3g}") for name in names}
            if longest_time_step(experiment.replace(**numbers)) >= SHORTEST_PRACTICAL:
                return ", ".join(f"{name} = {value:g}" for name, value in numbers.items())
    return 'drive = "ideal-servo"'


def _common_divisor(a: float, b: float) -> float:
    """Return the largest time of which both are whole multiples [s]."""
    x, y = (Fraction(each).limit_denominator(10**6) for each in (a, b))
    if not x or not y:
        return min(a, b)
    denominator = x.denominator * y.denominator
    return math.gcd(x.numerator * y.denominator, y.numerator * x.denominator) / denominator


def longest_time_step(experiment: Experiment) -> float:
    """Return the longest time step that resolves the contact with the ground [s].

    The robot stands on three feet, with the contact points of each.
    """
    law = experiment.world.contact
    if law.kind == "mujoco":
        # MuJoCo softens its contact where the time step is longer.
        return SOFT_TIME / 2
    mass = experiment.robot.mass / (3 * CONTACT_POINTS)
    frequency = math.sqrt(law.stiffness / mass)
    damping_ratio = law.damping / (2 * math.sqrt(law.stiffness * mass))
    # Half the stability limit of a spring and a damper that are evaluated at the start of a step.
    stance_limit = 1 / (frequency * (math.sqrt(damping_ratio**2 + 1) + damping_ratio))
    if law.kind != "spring-damper":
        return stance_limit
    return min(stance_limit, SAFETY_FACTOR * longest_foot_step(experiment))


def longest_foot_step(experiment: Experiment) -> float:
    """Return the longest time step with which the lightest foot does not chatter in MuJoCo [s].

    A foot of mobility A has the mass 1/A, and that with which its points resist their own
    acceleration: d/((1 - d) A) each along the normal, `friction_damping` over `damping` times that
    along the ground. A symplectic step of a mass m on a spring k and a damper c, both evaluated at
    its start, is stable where k dt² + 2 c dt < 4 m.
    """
    law, mobility = experiment.world.contact, float(foot_mobility(experiment).max())
    own, hardness = law.impedance / (1 - law.impedance), law.friction_hardness
    steps = []
    for k, c, hard in (
        (law.stiffness, law.damping, 1.0),
        (0.0, hardness * law.damping, hardness),
    ):
        k, c = CONTACT_POINTS * k, CONTACT_POINTS * c
        m = (1 + CONTACT_POINTS * hard * own) / mobility
        steps.append(4 * m / (math.sqrt(c * c + 4 * k * m) + c))
    return min(steps)


def start_offset(experiment: Experiment, start: SampledMotion) -> float:
    """Return how much higher than planned the robot starts [m]."""
    height = experiment.solver.start_height
    return 0.0 if height is None else height - float(start.trunk.position[0, 2])


def check_start(experiment: Experiment, walk: Motion) -> None:
    """Refuse a start in which a foot is inside the ground.

    Raises:
        InvalidInput: With the deepest foot, and the height at which none would be.
    """
    start = walk.sample(np.zeros(1))
    x, y, z = np.moveaxis(start.foot_position[0], -1, 0)
    offset = start_offset(experiment, start)
    ground = experiment.world.terrain.raised(walk.robot.foot_radius)
    depth = ground.height(x, y) - z - offset
    leg = int(np.argmax(depth))
    if depth[leg] > DEEPEST_START * experiment.scale.length:
        height = float(start.trunk.position[0, 2]) + offset + depth[leg]
        enough = math.ceil(1000 * height - 1e-6)
        raise InvalidInput(
            f"{walk.robot.legs[leg].name} foot starts {1000 * depth[leg]:.0f} mm below the "
            "terrain.",
            where="terrain",
            hint=f"start_height_mm = {enough}",
        )


@dataclass(frozen=True, eq=False)
class HeldPose(JointTrajectory):
    """A robot at rest.

    Attributes:
        trunk: Pose of the trunk, shapes (1, 3).
    """

    trunk: TrunkMotion

    def sample(self, time: Float[np.ndarray, " times"]) -> SampledTrajectory:
        """Return the pose at M times [s]."""
        time = np.asarray(time, dtype=float)
        still = np.zeros((len(time), 3))
        pose = still + self.trunk.position, still + self.trunk.attitude
        trunk = TrunkMotion(pose[0], still, still, pose[1], still, still)
        return SampledTrajectory(self.robot, time, *self.angles(time), trunk)


def standing(experiment: Experiment, q: Float[np.ndarray, "legs 3"] | None = None) -> HeldPose:
    """Place the robot at rest at the world's origin, with all feet near the ground.

    The trunk is parallel to the plane through the ground under the feet, as low as the highest
    ground under any foot and under the trunk allows.

    Args:
        experiment: Its terrain is used.
        q: Joint angles [rad], shape (L, 3); None: those of the neutral stance.

    Raises:
        InfeasibleWalk: They exceed the joints' limits.
    """
    robot = experiment.robot
    if q is None:
        q = joint_angles(robot.arrays, hip_from_body(robot, neutral_feet(robot)))
    ground = experiment.world.terrain
    centres = ground.raised(robot.foot_radius)
    feet = body_from_hip(robot, foot_position(robot.arrays, q))
    corners = np.array([[x, y, -1.0] for x in (-1.0, 1.0) for y in (-1.0, 1.0)])
    attitude = np.zeros(3)
    # Feet move a little with the tilt: the third iteration moves them by less than a micrometre.
    for _ in range(0 if ground.is_level else 3):
        x, y, _z = (feet @ rotation_rpy(*attitude[:, None])[0].T).T
        columns = np.stack([x, y, np.ones_like(x)], axis=-1)
        a, b, _c = np.linalg.lstsq(columns, centres.height(x, y), rcond=None)[0]
        attitude = np.array([math.asin(b / math.sqrt(1 + a * a + b * b)), math.atan2(-a, 1.0), 0.0])
    points = np.vstack([feet, robot.body.box_points(corners)])
    x, y, z = (points @ rotation_rpy(*attitude[:, None])[0].T).T
    is_foot = np.arange(len(points)) < len(feet)
    height = np.where(is_foot, centres.height(x, y), ground.height(x, y))
    position, still = np.zeros((1, 3)), np.zeros((1, 3))
    position[0, 2] = (height - z).max()
    trunk = TrunkMotion(position, still, still, attitude[None], still, still)
    return HeldPose(robot, np.array([0.0, 1.0]), np.stack([q, q]), trunk)
