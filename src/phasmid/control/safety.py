"""Safety monitor: checks observations and commands before a controller receives them."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from enum import IntEnum

import numpy as np
from jaxtyping import Float

from phasmid.arguments import check_number
from phasmid.compiled import compiled
from phasmid.control.command import Command, Posture
from phasmid.control.loads import AMBIENT, HEAT_STEP, add_loads, heating
from phasmid.control.observation import Observation
from phasmid.errors import InvalidInput
from phasmid.gait.support import support_margin
from phasmid.kinematics import centre_of_mass, joint_angles, neutral_feet
from phasmid.robot import JOINTS, Robot

GRAVITY = 9.81
"""Acceleration of free fall, for the time in which a robot tips over [m/s²]."""

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

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            check_number(field.name, value)
            most = 1.0 if field.name.endswith(("share", "factor")) else math.inf
            if not (math.isfinite(value) and 0 < value <= most):
                must = "greater than 0" + (" and 1 or less" if most == 1.0 else "")
                raise InvalidInput(
                    f"{field.name} is {value:g}; it must be a finite number, {must}."
                )


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
    "gap": "sensors tell again",
    "tilt": "the body tilts no more",
    "command": "there are commands again",
    "joints": "joint angles are known again",
    "load": "no servo is overloaded any more",
    "heat": "the servos have cooled down",
}


class SafetyMonitor:
    """Checks each observation and command, and restricts the command where something is wrong.

    Each cause adds an event when it begins and one when it has ended.

    Attributes:
        mode: Restriction of the controller.
        events: Times [s] and sentences since `reset`.
        tip_angle: Tilt at which the robot tips over its neutral feet [rad].
        tip_time: Time in which it would tip over [s].
        time: Time of the last observation [s].
        loads: Of each servo: integral of its squared output [s], time of overload [s], temperature
            [°C], shape (3, L, 3).
    """

    def __init__(self, robot: Robot, settings: SafetySettings | None = None) -> None:
        self.settings = settings or SafetySettings()
        self.events: list[tuple[float, str]] = []
        self.tip_angle, self.tip_time = tipping(robot)
        legs, reach = len(robot.legs), robot.arrays.lengths.sum(axis=1)
        fastest = robot.servo.no_load_speed * float(reach.max())
        nearest_hip = float(np.hypot(*robot.arrays.p_body_hip[:, :2].T).min())
        self._largest_velocity = (fastest, fastest, fastest / max(nearest_hip, 0.01))
        self._largest_pose = (float(reach.max()),) * 3 + (LARGEST_LEAN,) * 3
        self._legs = frozenset(range(1, legs + 1))
        self._zero, self.loads = np.zeros((legs, 3)), np.zeros((3, legs, 3))
        self._heating = heating(robot.servo, self.settings.load_share)
        self._heat_limit = math.inf
        if robot.servo.stall_current is not None:
            self._heat_limit = robot.servo.temperature_limit - self.settings.heat_margin
        self._names = [f"{leg}.{joint}" for leg in robot.leg_names for joint in JOINTS]
        self._validate, self._add_loads = compiled(validate_signals), compiled(add_loads)
        self.reset(None)

    def reset(self, observation: Observation | None) -> None:
        """Forget all events, causes and loads."""
        self.events.clear()
        self.mode = Mode.FREE
        self._restrictions: dict[str, _Restriction] = {}
        self._factor, self._crouch, self._load_interval = 1.0, 0.0, 0.0
        self.time = observation.time if observation else math.nan
        self._q = self._zero.copy()
        self.loads[:2], self.loads[2] = 0.0, AMBIENT
        self._checked: Command | None = None
        self._command, self._sent = Command(), Command()
        if observation is not None:
            finite = np.isfinite(observation.joint_position)
            self._q[finite] = observation.joint_position[finite]

    def check(self, observation: Observation, command: Command) -> tuple[Observation, Command]:
        """Return what a controller may use of an observation and a command.

        Args:
            observation: Observation, with values that may be missing or not finite.
            command: Command, of any age and size.

        Returns:
            Both unchanged where nothing is wrong.
        """
        time, set_ = observation.time, self.settings
        dt = time - self.time
        if not dt <= set_.observation_time:
            if not math.isfinite(time):
                time = self.time
            elif math.isfinite(dt):
                what = f"sensors told nothing for {dt:.2g} s"
                self._restrict("gap", Mode.SLOW, 0.0, time, what)
        # Observations may repeat, or arrive out of order.
        dt = max(time - self.time, 0.0) if math.isfinite(time - self.time) else 0.0
        self.time = time
        load, rate = observation.joint_load, observation.angular_velocity
        invalid, tilt = self._validate(
            observation.joint_position,
            self._zero if observation.joint_velocity is None else observation.joint_velocity,
            self._zero if load is None else load,
            _UPRIGHT if observation.orientation is None else observation.orientation,
            self._zero[0] if rate is None else rate,
            self.tip_time,
        )
        if invalid:
            observation = self._repaired(observation, time)
        if not invalid & 1:
            self._q = observation.joint_position
        if tilt > set_.tilt_share * self.tip_angle:
            mode = Mode.HOLD if tilt > set_.hold_share * self.tip_angle else Mode.SLOW
            now, most = math.degrees(tilt), math.degrees(self.tip_angle)
            what = f"the body tilts, soon by {now:.0f}°, and tips over at {most:.0f}°"
            self._restrict("tilt", mode, 0.0, time, what)
        if load is not None and not invalid & 4:
            self.loads[0] += dt * load * load
            self._load_interval += dt
            if self._load_interval >= HEAT_STEP:
                self._check_loads(load, time)
        if command is not self._checked:
            self._checked, self._command = command, self._in_range(command, time)
        age = 0.0 if self._command.time is None else time - self._command.time
        if age > set_.command_time:
            sit = age > set_.sit_time
            what = f"no command for {set_.sit_time if sit else set_.command_time:g} s"
            self._restrict("command", Mode.SIT if sit else Mode.SLOW, 0.0, time, what)
        if self._restrictions or self._factor < 1.0 or self._crouch > 0.0:
            return observation, self._restricted(self._command, time, dt)
        return observation, self._command

    def _restrict(self, cause: str, mode: Mode, factor: float, time: float, what: str) -> None:
        """Restrict by a cause; an event is added where it is new or worse."""
        before = self._restrictions.get(cause)
        if before is None or mode > before.mode:
            stops = mode is Mode.SLOW and factor == 0.0
            action = "the robot stops" if stops else _ACTION.get(mode)
            self.events.append((time, f"{what}: {action}." if action else f"{what}."))
        else:
            mode, factor = before.mode, min(before.factor, factor)
        self._restrictions[cause] = _Restriction(mode, factor, time + self.settings.clear_time)

    def _repaired(self, observation: Observation, time: float) -> Observation:
        """Return an observation with the last finite joint angles and only finite other values."""
        changes: dict[str, object] = {}
        q = observation.joint_position
        finite = np.isfinite(q)
        if not finite.all():
            names = [name for name, good in zip(self._names, finite.flat, strict=True) if not good]
            shown = ", ".join(names[:3]) + (" and others" if len(names) > 3 else "")
            self._restrict("joints", Mode.SLOW, 0.0, time, f"no angle is known of {shown}")
            changes["joint_position"] = self._q = np.where(finite, q, self._q)
        for name in ("joint_velocity", "joint_load", "orientation", "angular_velocity"):
            value = getattr(observation, name)
            if value is not None and not np.isfinite(value).all():
                what = f"{name.replace('_', ' ')} is not finite and is left out"
                self._restrict(name, Mode.FREE, 1.0, time, what)
                changes[name] = None
        return replace(observation, **changes)  # type: ignore[arg-type]

    def _check_loads(self, load: Float[np.ndarray, "legs 3"], time: float) -> None:
        set_ = self.settings
        self._add_loads(load, self._load_interval, self.loads, self._heating)
        self._load_interval = 0.0
        _, overload, temperature = self.loads
        if overload.max() > set_.load_time:
            name = self._names[int(np.argmax(overload))]
            what = f"servo {name} gives more than {set_.load_share:.0%} for {set_.load_time:g} s"
            self._restrict("load", Mode.SLOW, set_.slow_factor, time, what)
        # Hysteresis: a hot servo must cool down by the margin.
        limit = self._heat_limit - (set_.heat_margin if "heat" in self._restrictions else 0.0)
        if temperature.max() > limit:
            worst = int(np.argmax(temperature))
            what = f"servo {self._names[worst]} is as warm as {temperature.flat[worst]:.0f} °C"
            self._restrict("heat", Mode.SIT, 0.0, time, what)

    def _in_range(self, command: Command, time: float) -> Command:
        """Return a command within what a robot of this size can do."""
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
        self._restrict(
            f"range of {what}", Mode.FREE, 1.0, time, f"{what} of a command out of range"
        )
        return replace(command, **changes)  # type: ignore[arg-type]

    def _restricted(self, command: Command, time: float, dt: float) -> Command:
        """Return the command under the present restrictions, which take effect gradually."""
        set_ = self.settings
        for cause in [key for key, one in self._restrictions.items() if time > one.until]:
            if self._restrictions.pop(cause).mode is not Mode.FREE:
                self.events.append((time, f"{_ENDED.get(cause, cause)}: all is well again."))
        present = self._restrictions.values()
        self.mode = max((one.mode for one in present), default=Mode.FREE)
        goal = min((one.factor for one in present), default=1.0)
        low = set_.crouch if "tilt" in self._restrictions else 0.0
        step = dt / set_.slow_time
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


_UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


def _clipped(values: tuple[float, ...], most: tuple[float, ...]) -> tuple[float, ...]:
    """Return finite values within plus or minus their limits; 0 for those that are not finite."""
    limited = zip(values, most, strict=True)
    return type(values)(min(max(v, -m), m) if math.isfinite(v) else 0.0 for v, m in limited)


def tipping(robot: Robot) -> tuple[float, float]:
    """Return the tilt at which a robot tips over its neutral feet [rad], and the time it takes [s].

    The time is that of an inverted pendulum from edge to centre of mass: an upright body that tilts
    at a rate w comes to a tilt of w times this time, unless something stops it.

    Args:
        robot: The robot, L legs.
    """
    feet = neutral_feet(robot)
    arrays = robot.arrays
    com = centre_of_mass(robot, joint_angles(arrays, arrays.neutral_foot))
    every = np.ones(len(feet), dtype=bool)
    margin = max(float(support_margin(feet[:, :2], every, com[:2])), 0.0)
    height = float(com[2] - feet[:, 2].mean())
    return math.atan2(margin, height), math.sqrt(math.hypot(margin, height) / GRAVITY)


def validate_signals(
    q: np.ndarray,
    qd: np.ndarray,
    load: np.ndarray,
    orientation: np.ndarray,
    rate: np.ndarray,
    tip_time: float,
) -> tuple[int, float]:
    """Return which signals are not finite, one bit each, and the predicted tilt [rad].

    Args:
        q: Joint angles [rad].
        qd: Joint speeds [rad/s].
        load: Outputs of the servos.
        orientation: Orientation of the body, w x y z.
        rate: Its angular velocity, body axes [rad/s].
        tip_time: Time of the prediction [s].
    """
    invalid = 0
    for leg in range(q.shape[0]):
        for joint in range(3):
            if not math.isfinite(q[leg, joint]):
                invalid |= 1
            if not math.isfinite(qd[leg, joint]):
                invalid |= 2
            if not math.isfinite(load[leg, joint]):
                invalid |= 4
    w, x, y, z = orientation[0], orientation[1], orientation[2], orientation[3]
    size = w * w + x * x + y * y + z * z
    spin = rate[0] + rate[1] + rate[2]
    if not math.isfinite(size) or size < 0.25:
        return invalid | 8, 0.0
    # The vertical in body axes; it turns against the body.
    a, b = 2 * (x * z - w * y) / size, 2 * (y * z + w * x) / size
    c = (w * w - x * x - y * y + z * z) / size
    if math.isfinite(spin):
        da = (b * rate[2] - c * rate[1]) * tip_time
        db = (c * rate[0] - a * rate[2]) * tip_time
        dc = (a * rate[1] - b * rate[0]) * tip_time
        a, b, c = a + da, b + db, c + dc
    else:
        invalid |= 8
    return invalid, math.atan2(math.sqrt(a * a + b * b), c)
