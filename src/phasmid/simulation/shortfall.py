"""Runs that make less than half of their commanded motion: the share, its cause and a remedy."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.experiment import Command, Experiment
from phasmid.experiment.course import StrideTable
from phasmid.gait import sway
from phasmid.kinematics import (
    CommandTracking,
    neutral_feet,
    quaternion_yaw,
    step_twist,
    track_command,
    track_twist,
    track_velocity,
)
from phasmid.motion import Walk, progress
from phasmid.recording.channels import walking_command

LEAST_SHARE = 0.5
"""Share of the commanded motion below which a run fell short."""

LARGEST_JOINT_ERROR = 0.5
"""Rms error of the joint angles, over the rms motion of their targets, above which the servos are
named as the cause; joints that stand still have an error of about 1."""

LOW_STEP, SLIPPERY = 0.2, 0.3
"""Causes that are named: a step height below this share of the usual one, and less friction than
half of that of rubber on dry ground."""

LONGER, LONGEST = 1.25, 15.0
"""Periods that are tried as a remedy: factor from one to the next; longest over the scenario's."""

LEAST_WORTH, USABLE_SHARE = 0.1, 0.9
"""Share of the commanded velocity from which on the period stays; share of the largest velocity at
any period with which a shorter period will do."""


class CommandFollowing:
    """How a run follows its command, and the joints their targets, summed block by block.

    Args:
        walk: The plan that the run follows, which commands its own mean velocity; None: the
            commanded velocity is recorded.

    Attributes:
        tracking: The commanded motion, and the body's.
        feasible: The commanded motion, and what the controller takes for feasible.
    """

    def __init__(self, walk: Walk | None) -> None:
        self.tracking = self.feasible = CommandTracking()
        self._squares = np.zeros(2)
        self._last: dict[str, np.ndarray] = {}
        self._walk = walk
        if walk is not None:
            stride, duration = walk.experiment.course.stride, walk.experiment.duration
            steps = float(progress(walk.gait, stride, np.array(duration)).position)
            self._twist = step_twist(stride.step) * steps / duration
            self._neutral, self._period = neutral_feet(walk.robot), stride.period

    def add(self, time: Float[np.ndarray, " time"], channels: Mapping[str, np.ndarray]) -> None:
        """Add the next samples; the channels are those of a recording."""
        q, target = channels["joint_position"], channels["joint_position_target"]
        rest = self._last.setdefault("rest", target[:1].copy())
        self._squares += np.sum((q - target) ** 2), np.sum((target - rest) ** 2)
        names = "body_position", "body_orientation", "velocity_command", "velocity_reference"
        now = {"time": time, **{name: channels[name] for name in names if name in channels}}
        if "velocity_command" in now:
            sequence = channels.get("sequence")
            now["velocity_command"] = walking_command(now["velocity_command"], sequence)
        part = {name: np.concatenate([self._last.get(name, a[:0]), a]) for name, a in now.items()}
        # The buffer behind the channels is used again.
        self._last |= {name: values[-1:].copy() for name, values in now.items()}
        time, path, orientation = (part[name] for name in ("time", *names[:2]))
        if self._walk is not None:
            aside = sway(self._walk.gait, self._neutral, self._period, time)
            path = aside.removed_from(path, quaternion_yaw(orientation))
            self.tracking += track_twist(time, self._twist, path, orientation)
        elif "velocity_command" in part:
            command = part["velocity_command"]
            self.tracking += track_command(time, command, path, orientation)
            reference = part.get("velocity_reference", command)
            self.feasible += track_velocity(time, command, reference)

    @property
    def joint_error(self) -> float:
        """Rms error of the joint angles, over the rms motion of their targets."""
        error, motion = self._squares
        return math.sqrt(error / motion) if motion > 0 else 0.0


def shortfall_cause(
    experiment: Experiment, following: CommandFollowing, command: Command | None, event: str
) -> tuple[str, str] | None:
    """Return why a run made less than half of its commanded motion, and a remedy.

    Args:
        experiment: Its gait, step height and friction are used.
        following: How the run followed its command.
        command: The only command of a driven run; None: there were several, or a plan.
        event: The controller's last event; empty where there is none.

    Returns:
        Cause and remedy, which is empty where none is known; None where the run made half or more.
    """
    share = following.tracking.smallest_share
    if share is None or share >= LEAST_SHARE:
        return None
    feasible, stride = following.feasible.smallest_share, experiment.course.stride
    usual, friction = usual_step_height(experiment), experiment.world.terrain.coefficient
    if feasible is not None and feasible < LEAST_SHARE:
        why = f" ({event})" if event else ""
        remedy = feasible_options(experiment, command) if command else "slower commands"
        if event.startswith("stands:"):
            # The legs that are left cannot walk at any velocity.
            remedy = ""
        return f"its controller takes {100 * feasible:z.0f} % of that for feasible{why}", remedy
    if following.joint_error > LARGEST_JOINT_ERROR:
        return "its joints do not follow their targets", "a stronger or faster servo"
    if stride.step_height < LOW_STEP * usual:
        lift = f"its feet are lifted by {1000 * stride.step_height:g} mm only"
        return lift, f"--step-height-mm {1000 * usual:.2g}"
    if friction < SLIPPERY:
        return f"its feet slip, with a friction of {friction:g}", f"--friction {2 * SLIPPERY:g}"
    return "its feet slip or are held up", "a higher step, or a slower walk"


def usual_step_height(experiment: Experiment) -> float:
    """Return the default step height, scaled with the robot's legs [m]."""
    return StrideTable().step_height * experiment.scale.length


def feasible_options(experiment: Experiment, command: Command) -> str:
    """Return options with which the locomotion engine follows a command's direction.

    The period stays where it permits a tenth of the velocity; else it is the shortest that permits
    nearly the largest velocity.

    Args:
        experiment: Its robot, gait, period and step height are used.
        command: Its own take their place where it has them.

    Returns:
        The options; empty where there are none, or the velocity is feasible as it is.
    """
    # Lazy import: compiled functions take 0.2 s to load.
    from phasmid.control import LocomotionEngine

    robot, stride = experiment.robot, experiment.course.stride
    wanted, gait = np.array(command.velocity), experiment.course.gait
    factors = LONGER ** np.arange(math.ceil(math.log(LONGEST, LONGER)))
    shares: dict[float, float] = {}
    try:
        engine = LocomotionEngine(
            robot, gait=gait, step_height=stride.step_height, gravity=experiment.world.gravity
        )
        for period in (command.period or stride.period) * factors:
            limit = engine.largest_velocity(
                command.velocity,
                gait=command.gait,
                period=float(period),
                step_height=command.step_height,
                pose=command.pose,
                lost_legs=command.lost_legs,
            )
            shares[period] = float(wanted @ limit.velocity / (wanted @ wanted))
            if len(shares) == 1 and shares[period] >= LEAST_WORTH:
                break
    except InvalidInput:
        # The run was another controller's, or its legs cannot walk.
        return ""
    most = max(shares.values())
    if most <= 0:
        lower = usual_step_height(experiment)
        limit = engine.largest_velocity(command.velocity, step_height=lower)
        return f"--step-height-mm {1000 * lower:.2g}" if any(limit.velocity) else ""
    if len(shares) == 1 and most >= LEAST_SHARE:
        return ""
    period = next(each for each, share in shares.items() if share >= USABLE_SHARE * most)
    options = [f"--period {_digits(period)}"] * (len(shares) > 1)
    if shares[period] < 1:
        velocity = ",".join(_digits(x) for x in shares[period] * wanted)
        options.append(f"--velocity {velocity}")
    return " ".join(options)


def _digits(value: float) -> str:
    """Return the first two digits of a number."""
    size = 10.0 ** (math.floor(math.log10(abs(value))) - 1) if value else 1.0
    return f"{math.trunc(value / size) * size:.6g}"
