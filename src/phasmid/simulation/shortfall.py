"""Runs that make less than half of their commanded motion: the share, its cause and a remedy."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from phasmid.control import Command
from phasmid.gait import sway
from phasmid.kinematics import (
    CommandTracking,
    neutral_feet,
    quaternion_yaw,
    share_words,
    step_twist,
    track_command,
    track_velocity,
)
from phasmid.motion import Motion, Walk, progress
from phasmid.scenario import Scenario
from phasmid.scenario.tables import StrideTable

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


class Following:
    """How a run follows its command, and the joints their targets, summed block by block.

    Args:
        motion: The motion of a planned run; a walk commands its own mean velocity. None: the
            run is driven, and records the commanded velocity.

    Attributes:
        tracking: The commanded motion, and the body's.
        feasible: The commanded motion, and what the controller takes for feasible.
    """

    def __init__(self, motion: Motion | None) -> None:
        self.tracking = self.feasible = CommandTracking()
        self._squares = np.zeros(2)
        self._last: dict[str, np.ndarray] = {}
        self._walk = motion if isinstance(motion, Walk) else None
        if self._walk is not None:
            stride, duration = self._walk.scenario.planned_stride, self._walk.scenario.duration
            steps = float(progress(self._walk.gait, stride, np.array(duration)).position)
            self._planned = step_twist(stride.step) * steps / duration

    def add(self, time: Float[np.ndarray, " time"], channels: Mapping[str, np.ndarray]) -> None:
        """Add the next samples; the channels are those of a recording."""
        q, target = channels["joint_position"], channels["joint_position_target"]
        rest = self._last.setdefault("rest", target[:1].copy())
        self._squares += np.sum((q - target) ** 2), np.sum((target - rest) ** 2)
        names = ("body_position", "body_orientation", "velocity_command", "velocity_reference")
        now = {"time": time, **{name: channels[name] for name in names if name in channels}}
        part = {name: np.concatenate([self._last.get(name, a[:0]), a]) for name, a in now.items()}
        # The buffer behind the channels is used again.
        self._last |= {name: values[-1:].copy() for name, values in now.items()}
        time, orientation = part["time"], part["body_orientation"]
        if self._walk is not None:
            neutral, period = neutral_feet(self._walk.robot), self._walk.scenario.period
            aside = sway(self._walk.gait, neutral, period, time)
            path = aside.removed_from(part["body_position"], quaternion_yaw(orientation))
            command, heading = np.tile(self._planned, (len(time), 1)), self._planned[2] * time
            self.tracking += track_command(time, command, path, orientation, heading)
        elif "velocity_command" in part:
            command = part["velocity_command"]
            self.tracking += track_command(time, command, part["body_position"], orientation)
            reference = part.get("velocity_reference", command)
            self.feasible += track_velocity(time, command, reference)

    @property
    def joint_error(self) -> float:
        """Rms error of the joint angles, over the rms motion of their targets."""
        error, motion = self._squares
        return math.sqrt(error / motion) if motion > 0 else 0.0


def shortfall_reason(
    scenario: Scenario, following: Following, command: Command | None, event: str
) -> str | None:
    """Return why a run made less than half of its commanded motion; None where it made more.

    Args:
        scenario: Its gait, step height and friction are used.
        following: How the run followed its command.
        command: The only command of a driven run; None: there were several, or a plan.
        event: The controller's last event; empty where there is none.
    """
    share = following.tracking.least_share
    if share is None or share >= LEAST_SHARE:
        return None
    cause, remedy = _cause(scenario, following, command, event)
    made = share_words(following.tracking.way_share, following.tracking.turn_share)
    return f"it made {made}; {cause}{remedy and f'. Try {remedy}'}"


def _cause(
    scenario: Scenario, following: Following, command: Command | None, event: str
) -> tuple[str, str]:
    """Return the cause of a shortfall, and a remedy; it is empty where there is none."""
    feasible, stride = following.feasible.least_share, scenario.stride
    usual = StrideTable().step_height * scenario.scale(scenario.load_robot()).length
    if feasible is not None and feasible < LEAST_SHARE:
        why = f" ({event})" if event else ""
        remedy = feasible_options(scenario, command) if command else "slower commands"
        return f"its controller takes {100 * feasible:z.0f} % of that for feasible{why}", remedy
    if following.joint_error > LARGEST_JOINT_ERROR:
        return "its joints do not follow their targets", "a stronger or faster servo"
    if stride.step_height < LOW_STEP * usual:
        lift = f"its feet are lifted by {1000 * stride.step_height:g} mm only"
        return lift, f"--step-height-mm {1000 * usual:.2g}"
    friction = scenario.terrain.friction
    if friction < SLIPPERY:
        return f"its feet slip, with a friction of {friction:g}", f"--friction {2 * SLIPPERY:g}"
    return "its feet slip or are held up", "a higher step, or a slower walk"


def feasible_options(scenario: Scenario, command: Command) -> str:
    """Return options with which the controller follows a command's direction; empty for none.

    The period stays where it permits a tenth of the velocity; else it is the shortest that permits
    nearly the largest velocity.

    Args:
        scenario: Its robot, gait, period and step height are used.
        command: Its velocity is used.
    """
    # Lazy import: compiled functions take 0.2 s to load.
    from phasmid.control import LocomotionEngine

    if command.lost_legs:
        return ""
    robot, stride = scenario.load_robot(), scenario.planned_stride
    gait = scenario.load_gait(len(robot.legs))
    engine = LocomotionEngine(robot, gait=gait, step_height=stride.step_height)
    wanted = np.array(command.velocity)
    factors = LONGER ** np.arange(math.ceil(math.log(LONGEST, LONGER)))
    shares = {}
    for period in (command.period or stride.period) * factors:
        found = engine.largest_velocity(command.velocity, period=period).velocity
        shares[period] = float(wanted @ found / (wanted @ wanted))
        if len(shares) == 1 and shares[period] >= LEAST_SHARE:
            # Something else than the gait was in the way.
            return ""
        if len(shares) == 1 and shares[period] >= LEAST_WORTH:
            break
    most = max(shares.values())
    if most <= 0:
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
