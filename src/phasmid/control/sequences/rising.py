"""From lying on the belly to standing, whose way back is sitting down."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from phasmid.control.sequences.joint_path import JointPath, path_through
from phasmid.control.sequences.packed import Packing
from phasmid.control.sequences.reaching import angles_and_reach, knees_and_feet
from phasmid.control.sequences.resting import lying
from phasmid.control.sequences.settings import SequenceSettings
from phasmid.control.sequences.stance import KNOTS, Stance, Stepper, neutral_stance, to_neutral
from phasmid.errors import InfeasibleWalk
from phasmid.kinematics import body_from_hip, foot_position
from phasmid.robot import Robot


def rising(
    robot: Robot,
    packed: Packing,
    settings: SequenceSettings,
    lost: Mapping[int, Float[np.ndarray, "3"]] | None = None,
) -> tuple[JointPath, ...]:
    """Ways from folded legs on the belly to the neutral stance.

    The feet are put down beside the body, the body rises over them, and where they could not be
    put down at their neutral places they step there.

    Args:
        robot: The robot, L legs.
        packed: Where it begins.
        settings: Margins, speeds, heights.
        lost: Joint angles of legs that take no part, by index [rad], each of shape (3,).

    Raises:
        InfeasibleWalk: The legs at hand cannot carry the body there.
    """
    held = dict(lost or {})
    folded = packed.folded.copy()
    feet = packed.feet.copy()
    for leg, q in held.items():
        folded[leg] = q
        feet[leg] = body_from_hip(robot, foot_position(robot.arrays, folded))[leg]
    half = float(robot.body.size[2]) / 2
    ground = feet + np.array([0.0, 0.0, half])
    down = _put_down(robot, packed, settings)
    for leg, q in held.items():
        down[:, leg] = q
    pose = np.array([0.0, 0.0, half, 0.0, 0.0, 0.0])
    plan = Stepper(robot, Stance(pose, ground, down[-1]), settings, lifted=held)
    plan.paths.append(
        path_through("puts down its feet", down, settings.speed(robot), settings.acceleration)
    )
    up = neutral_stance(robot).pose
    if not plan.body(up, "raises its body") or plan.held() < 0:
        raise InfeasibleWalk("the legs that are left cannot raise the body.", where="robot")
    rest = to_neutral(robot, plan.stance, settings, lost=held)
    if rest is None:
        raise InfeasibleWalk("the feet cannot step to their neutral places.", where="robot")
    return (*plan.paths, *rest.paths)


def _put_down(
    robot: Robot, packed: Packing, settings: SequenceSettings
) -> Float[np.ndarray, "knots legs 3"]:
    """The feet from where they are folded to their places: over the ground, then straight down."""
    ground = lying(robot)
    goal, _ = angles_and_reach(robot, packed.feet)
    _, start = knees_and_feet(robot, packed.folded)
    s = np.linspace(0.0, 1.0, KNOTS)[:, None, None]
    best, deepest = None, np.inf
    # From the straight way in the joints, which may dip into the ground, to ever higher arcs.
    for lift in (0.0, 1.0, 2.0, 4.0):
        way = start + s * s * (3 - 2 * s) * (packed.feet - start)
        rest = (1 - s) ** 2 * (1 + 2 * s)
        way[..., 2] = (packed.feet + rest * (start - packed.feet))[..., 2]
        way[..., 2] += (16 * lift * settings.clearance * s**2 * (1 - s) ** 2)[..., 0]
        q, reached = angles_and_reach(robot, way)
        if not reached.all():
            continue
        knees, feet = knees_and_feet(robot, q)
        depth = -float(min(ground.over(knees).min(), ground.over(feet).min()))
        if depth < deepest - 1e-9:
            best, deepest = q, depth
    if best is None:
        best = packed.folded + s * (goal - packed.folded)
    best[0], best[-1] = packed.folded, goal
    return best
