"""Legs in the air that follow commands of their own while the others stand."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from jaxtyping import Float

from phasmid.control.sequences.ground import knees_and_feet, knees_and_soles, solve_feet
from phasmid.control.sequences.stance import SMOOTH, STEP_HEIGHT, Stance, StancePlanner
from phasmid.experiment.command import LegCommand
from phasmid.kinematics import rotation_rpy
from phasmid.robot import Robot

LEG_CLEARANCE = 0.005
"""Least height of foot and knee of a manual leg over the ground [m]."""


class ManualLegs:
    """Some legs in the air, and the body where the others support it.

    Args:
        plan: Motions that lift these legs.
        numbers: Of the legs, from 1.

    Attributes:
        stance: With these legs lifted.
        paths: Paths to it: the body shifts, then the feet lift.
    """

    def __init__(self, plan: StancePlanner, numbers: Collection[int]) -> None:
        self.numbers, self.stance, self.paths = tuple(numbers), plan.stance, plan.paths
        self._robot, self._clearance = plan.robot, LEG_CLEARANCE
        self._up = rotation_rpy(*plan.stance.pose[3:, None])[0][2]
        self._reported: set[str] = set()

    def target(
        self, commands: Mapping[int, LegCommand]
    ) -> tuple[Float[np.ndarray, "legs 3"], list[str]]:
        """Return joint angles for commands, within reach, joint limits and above the ground.

        Args:
            commands: By leg number from 1, for all of `numbers`.

        Returns:
            Joint angles [rad], shape (L, 3), and new sentences on what is infeasible.
        """
        robot, q, infeasible = self._robot, self.stance.q.copy(), []
        for number in self.numbers:
            leg, command, angles = number - 1, commands[number], q.copy()
            name = f"leg {robot.leg_names[leg]} by hand"
            if command.joints is not None:
                angles[leg] = np.clip(command.joints, *robot.arrays.joint_limits[leg].T)
                if not np.array_equal(angles[leg], command.joints):
                    infeasible.append(f"{name}: an angle is beyond its joint's limits.")
            else:
                feet = knees_and_feet(robot, q)[1]
                feet[leg] = command.foot
                solution, reached = solve_feet(robot, feet)
                if not reached[leg]:
                    infeasible.append(f"{name}: its foot cannot be put there; it waits.")
                    continue
                angles[leg] = solution[leg]
            points = np.stack(knees_and_soles(robot, angles, self._up))[:, leg]
            if (points @ self._up).min() + self.stance.pose[2] < self._clearance:
                infeasible.append(f"{name}: that is in the ground; it waits.")
                continue
            q = angles
        new = [sentence for sentence in infeasible if sentence not in self._reported]
        self._reported.update(new)
        return q, new


def lift_legs(
    robot: Robot,
    stance: Stance,
    numbers: Collection[int],
    lost: Collection[int],
) -> ManualLegs | None:
    """Plan to lift legs of a standing robot; None if the others would not support it.

    The support must hold with these legs as they are lifted, and stretched outwards.
    """
    plan = StancePlanner(robot, stance, lost)
    feet, legs = np.repeat(stance.feet[None], len(SMOOTH), axis=0), [n - 1 for n in numbers]
    feet[:, legs, 2] += STEP_HEIGHT * SMOOTH[:, 0]
    return ManualLegs(plan, numbers) if plan.swing(legs, feet, stretched=True) else None
