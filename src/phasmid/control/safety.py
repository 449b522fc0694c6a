"""Safety monitor: checks observations and commands before a controller receives them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from enum import IntEnum

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.experiment.command import Command, Posture
from phasmid.experiment.observation import Observation
from phasmid.gait.support import support_margin
from phasmid.kinematics import centre_of_mass, joint_angles, neutral_feet
from phasmid.robot import JOINTS, Robot
from phasmid.servo.heat import temperature_after
from phasmid.units import STANDARD_GRAVITY

HEAT_STEP = 0.1
"""Time step of overload and temperature [s]."""

LARGEST_LEAN = math.radians(60)
"""Largest roll, pitch and yaw of a commanded pose [rad]."""


class Mode(IntEnum):
    """Restriction of the controller, recorded as channel ``safety_mode``."""

    FREE = 0
    SLOW = 1
    SIT = 2
    HOLD = 3


@dataclass(frozen=True, slots=True)
class SafetySettings:
    """Thresholds at which the safety monitor acts, and times after which it stops acting.

    Attributes:
        command_time: Age of a command with a time stamp from which on the robot stops [s].
        sit_time: Age from which on it sits down [s].
        observation_time: Gap between observations after which the robot stops [s].
        tilt_share: The robot stops and crouches where its predicted tilt exceeds this share of the
            angle at which it tips over.
        hold_share: It holds still beyond this share.
        load_share: A servo whose output exceeds this share for `load_time` is overloaded.
        load_time: See `load_share` [s].
        heat_margin: The robot sits down where a servo is warmer than its limit less this [K].
        slow_factor: Factor of the velocity while a servo is overloaded.
        slow_time: Time in which the velocity goes from full to zero [s].
        crouch: Distance by which the body is lowered where it tilts [m].
        clear_time: Time for which a cause must be absent before its restriction ends [s].
        gravity: Gravitational acceleration [m/s²].
    """

    command_time: float = 0.5
    sit_time: float = 5.0
    observation_time: float = 0.1
    tilt_share: float = 0.5
    hold_share: float = 0.85
    load_share: float = 0.9
    load_time: float = 1.0
    heat_margin: float = 5.0
    slow_factor: float = 0.5
    slow_time: float = 0.5
    crouch: float = 0.015
    clear_time: float = 1.0
    gravity: float = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            most = 1.0 if field.name.endswith(("share", "factor")) else math.inf
            if not (math.isfinite(value) and 0 < value <= most):
                must = "greater than 0" + (" and 1 or less" if most == 1.0 else "")
                raise InvalidInput(
                    f"{field.name} is {value:g}; it must be a finite number, {must}."
                )


OPTIONAL = "joint_velocity", "joint_load", "orientation", "angular_velocity"
"""Sensor values that a controller does without where they are invalid."""


@dataclass(slots=True)
class _Restriction:
    """Restriction by one cause; it ends `clear_time` after the cause was last seen."""

    mode: Mode
    factor: float
    until: float


_ACTION = {
    Mode.SLOW: "the robot walks slower",
    Mode.SIT: "the robot sits down",
    Mode.HOLD: "the robot holds still",
}

_ENDED = {
    "gap": "observations arrive again",
    "tilt": "the body is level enough again",
    "command": "commands arrive again",
    "joints": "all joint angles are valid again",
    "load": "no servo is overloaded",
    "heat": "the servos have cooled down",
}


class SafetyMonitor:
    """Safety monitor: checks each observation and command, and restricts the command.

    Each cause adds an event when it begins and one when it has ended.

    Attributes:
        mode: Restriction of the controller.
        events: Times [s] and sentences since `reset`.
        tip_angle: Tilt at which the robot tips over its neutral feet [rad].
        tip_time: Time that tipping over takes [s].
        time: Time of the last observation [s].
        dt: Time since the one before [s].
        tilt: Predicted angle of the body's z axis to the vertical [rad].
        temperature: Temperatures of the servos [°C], shape (L, 3).
    """

    def __init__(self, robot: Robot, settings: SafetySettings | None = None) -> None:
        self.settings = settings or SafetySettings()
        self.events: list[tuple[float, str]] = []
        self.tip_angle, self.tip_time = tipping(robot, self.settings.gravity)
        self._servo, legs = robot.servo, len(robot.legs)
        reach = float(robot.arrays.lengths.sum(axis=1).max())
        # One bound for the whole body: that of its slowest joint.
        fastest = float(robot.arrays.no_load_speed.min()) * reach
        nearest_hip = float(np.hypot(*robot.arrays.p_body_hip[:, :2].T).min())
        self._largest_velocity = (fastest, fastest, fastest / max(nearest_hip, 0.01))
        self._largest_pose = (reach,) * 3 + (LARGEST_LEAN,) * 3
        self._legs, self._zero = frozenset(range(1, legs + 1)), np.zeros((legs, 3))
        self._names = [f"{leg}.{joint}" for leg in robot.leg_names for joint in JOINTS]
        self.reset(None)

    def reset(self, observation: Observation | None) -> None:
        """Forget all events, causes and loads."""
        self.events.clear()
        self.mode, self.dt = Mode.FREE, 0.0
        self._restrictions: dict[str, _Restriction] = {}
        self._factor, self._crouch = 1.0, 0.0
        self.tilt, self.temperature = 0.0, self._zero + self._servo.ambient_temperature
        self._overload_time, self._squared_load = self._zero, self._zero
        self._load_interval, self._hot = 0.0, False
        self._checked: Command | None = None
        self._command, self._sent = Command(), Command()
        self.time, self._q = math.nan, self._zero
        if observation is not None:
            q = observation.joint_position
            self.time, self._q = observation.time, np.where(np.isfinite(q), q, 0.0)

    def check(self, observation: Observation, command: Command) -> tuple[Observation, Command]:
        """Return the observation and the command that a controller may use.

        Args:
            observation: Observation, with values that may be missing or not finite.
            command: Command, of any age and size.

        Returns:
            Both unchanged where nothing is wrong.
        """
        time = observation.time if math.isfinite(observation.time) else self.time
        gap = time - self.time
        # Observations may repeat, or arrive out of order.
        self.time, self.dt = time, max(0.0, gap)
        if gap > self.settings.observation_time:
            self._restrict("gap", Mode.SLOW, 0.0, f"no observation for {gap:.2g} s")
        observation = self._valid(observation)
        self._q = observation.joint_position
        self._check_tilt(observation)
        if observation.joint_load is not None:
            self._check_loads(observation.joint_load)
        if command is not self._checked:
            self._checked, self._command = command, self._in_range(command)
        if self._command.time is not None:
            self._check_age(time - self._command.time)
        if self._restrictions or self._factor < 1.0 or self._crouch > 0.0:
            return observation, self._restricted(self._command)
        return observation, self._command

    def _valid(self, observation: Observation) -> Observation:
        """Return an observation with the last valid joint angles, and without invalid values."""
        changes: dict[str, object] = {}
        finite = np.isfinite(observation.joint_position)
        if not finite.all():
            names = [name for name, good in zip(self._names, finite.flat, strict=True) if not good]
            shown = ", ".join(names[:3]) + (" and others" if len(names) > 3 else "")
            self._restrict("joints", Mode.SLOW, 0.0, f"no valid joint angle of {shown}")
            changes["joint_position"] = np.where(finite, observation.joint_position, self._q)
        for name in OPTIONAL:
            value = getattr(observation, name)
            if value is None or _is_valid(name, value):
                continue
            words = name.replace("_", " ")
            self._restrict(name, Mode.FREE, 1.0, f"{words} is not valid and is not used")
            changes[name] = None
        return replace(observation, **changes) if changes else observation  # type: ignore[arg-type]

    def _check_tilt(self, observation: Observation) -> None:
        """Restrict by the tilt of the body after the time in which it would tip over."""
        set_ = self.settings
        orientation, rate = observation.orientation, observation.angular_velocity
        self.tilt = predicted_tilt(
            (1.0, 0.0, 0.0, 0.0) if orientation is None else orientation.tolist(),
            (0.0, 0.0, 0.0) if rate is None else (self.tip_time * rate).tolist(),
        )
        if self.tilt > set_.tilt_share * self.tip_angle:
            mode = Mode.HOLD if self.tilt > set_.hold_share * self.tip_angle else Mode.SLOW
            now, most = math.degrees(self.tilt), math.degrees(self.tip_angle)
            what = f"the predicted tilt of the body is {now:.0f}°; it tips over at {most:.0f}°"
            self._restrict("tilt", mode, 0.0, what)

    def add_load(self, load: Float[np.ndarray, "legs 3"], duration: float) -> None:
        """Add the heat of a time without an observation, while the controller's clock stands still.

        Args:
            load: Output of the servos, as a share of the largest, shape (L, 3).
            duration: The time [s].
        """
        self._load_interval += duration
        self._squared_load = self._squared_load + duration * load**2

    def _check_loads(self, load: Float[np.ndarray, "legs 3"]) -> None:
        """Integrate overload and temperature of the servos; restrict by both."""
        set_, servo = self.settings, self._servo
        self.add_load(load, self.dt)
        if self._load_interval < HEAT_STEP:
            return
        interval, self._load_interval = self._load_interval, 0.0
        overloaded = np.abs(load) > set_.load_share
        self._overload_time = np.where(overloaded, self._overload_time + interval, 0.0)
        # A share of the output draws that share of the stall current at the supply.
        power = servo.voltage**2 / servo.rated_voltage * (servo.stall_current or 0.0)
        self.temperature = temperature_after(
            servo, interval, self.temperature, power * self._squared_load / interval
        )
        self._squared_load = self._zero
        if self._overload_time.max() > set_.load_time:
            name = self._names[int(np.argmax(self._overload_time))]
            what = (
                f"the output of servo {name} exceeds {set_.load_share:.0%} for {set_.load_time:g} s"
            )
            self._restrict("load", Mode.SLOW, set_.slow_factor, what)
        hottest = float(self.temperature.max())
        # A hot servo must cool down by the margin once more.
        limit = servo.temperature_limit - set_.heat_margin * (2 if self._hot else 1)
        self._hot = servo.stall_current is not None and hottest > limit
        if self._hot:
            name = self._names[int(np.argmax(self.temperature))]
            what = f"the temperature of servo {name} is {hottest:.0f} °C"
            self._restrict("heat", Mode.SIT, 0.0, what)

    def _check_age(self, age: float) -> None:
        """Restrict by the age of the command [s]."""
        set_ = self.settings
        if age > set_.sit_time:
            self._restrict("command", Mode.SIT, 0.0, f"no command for {set_.sit_time:g} s")
        elif age > set_.command_time:
            self._restrict("command", Mode.SLOW, 0.0, f"no command for {set_.command_time:g} s")

    def _restrict(self, cause: str, mode: Mode, factor: float, what: str) -> None:
        """Restrict by a cause; an event is added where it is new or worse."""
        before = self._restrictions.get(cause)
        if before is None or mode > before.mode:
            stops = mode is Mode.SLOW and factor == 0.0
            action = "the robot stops" if stops else _ACTION.get(mode)
            self.events.append((self.time, f"{what}: {action}." if action else f"{what}."))
        else:
            mode, factor = before.mode, min(before.factor, factor)
        self._restrictions[cause] = _Restriction(mode, factor, self.time + self.settings.clear_time)

    def _in_range(self, command: Command) -> Command:
        """Return a command within the limits of a robot of this size."""
        changes: dict[str, object] = {
            "velocity": _clipped(command.velocity, self._largest_velocity),
            "pose": _clipped(command.pose, self._largest_pose),
            "lost_legs": command.lost_legs & self._legs,
            "legs": {leg: value for leg, value in command.legs.items() if leg in self._legs},
        }
        changes = {name: new for name, new in changes.items() if new != getattr(command, name)}
        if not changes:
            return command
        what = " and ".join(name.replace("_", " ") for name in changes)
        self._restrict(f"range of {what}", Mode.FREE, 1.0, f"{what} of a command out of range")
        return replace(command, **changes)  # type: ignore[arg-type]

    def _restricted(self, command: Command) -> Command:
        """Return the command under the present restrictions, which take effect gradually."""
        set_ = self.settings
        for cause in [key for key, one in self._restrictions.items() if self.time > one.until]:
            if self._restrictions.pop(cause).mode is not Mode.FREE:
                self.events.append((self.time, f"{_ENDED[cause]}: the restriction ends."))
        present = self._restrictions.values()
        self.mode = max((one.mode for one in present), default=Mode.FREE)
        goal = min((one.factor for one in present), default=1.0)
        low = set_.crouch if "tilt" in self._restrictions else 0.0
        step = self.dt / set_.slow_time
        self._factor += min(max(goal - self._factor, -step), step)
        step *= set_.crouch
        self._crouch += min(max(low - self._crouch, -step), step)
        changes: dict[str, object] = {}
        if self._factor < 1.0:
            changes["velocity"] = tuple(self._factor * v for v in command.velocity)
        if self._crouch > 0.0:
            x, y, z, *lean = command.pose
            changes["pose"] = (x, y, z - self._crouch, *lean)
        if self.mode is Mode.SIT:
            changes |= {"posture": Posture.PACKED, "legs": {}}
        if not changes:
            return command
        restricted = replace(command, **changes)  # type: ignore[arg-type]
        # A controller compares commands by identity.
        if restricted != self._sent:
            self._sent = restricted
        return self._sent


def _is_valid(name: str, value: np.ndarray) -> bool:
    """Return whether sensor values are finite; an orientation without a reading may be zeros."""
    # A sum of squares is finite where all values are, and takes a third of `isfinite`'s time.
    if not math.isfinite(np.vdot(value, value)):
        return False
    return name != "orientation" or bool(value @ value >= 0.25)


def _clipped(values: tuple[float, ...], most: tuple[float, ...]) -> tuple[float, ...]:
    """Return finite values within plus or minus their limits; 0 for those that are not finite."""
    limited = zip(values, most, strict=True)
    return type(values)(min(max(v, -m), m) if math.isfinite(v) else 0.0 for v, m in limited)


def predicted_tilt(orientation: Sequence[float], turn: Sequence[float]) -> float:
    """Return the angle of the body's z axis to the vertical after a turn along its tangent [rad].

    Args:
        orientation: Orientation of the body, w x y z, of any norm.
        turn: Angular velocity times the time of the turn, body axes [rad].
    """
    w, x, y, z = orientation
    # The vertical in body axes, times the squared norm; it turns against the body: u + u x turn.
    a, b, c = 2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z
    p, q, r = turn
    return math.atan2(math.hypot(a + b * r - c * q, b + c * p - a * r), c + a * q - b * p)


def tipping(robot: Robot, gravity: float) -> tuple[float, float]:
    """Return the tilt at which a robot tips over its neutral feet [rad], and the time it takes [s].

    The time is that of an inverted pendulum from edge to centre of mass: an upright body that tilts
    at a rate w comes to a tilt of w times this time, unless something stops it.

    Args:
        robot: The robot, L legs.
        gravity: Gravitational acceleration [m/s²].
    """
    feet = neutral_feet(robot)
    arrays = robot.arrays
    com = centre_of_mass(robot, joint_angles(arrays, arrays.neutral_foot))
    every = np.ones(len(feet), dtype=bool)
    margin = max(float(support_margin(feet[:, :2], every, com[:2])), 0.0)
    height = float(com[2] - feet[:, 2].mean())
    return math.atan2(margin, height), math.sqrt(math.hypot(margin, height) / gravity)
