"""What keeps a robot from harm: looks at observations and commands before a controller does."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from enum import IntEnum
from types import MappingProxyType

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
"""For how soon a tilting robot is over its edge [m/s²]."""

LARGEST_LEAN = math.radians(60)
"""Roll, pitch and yaw of a commanded pose beyond this are slips [rad]."""


class Mode(IntEnum):
    """What safety lets the controller do, from all to nothing; told in channel ``safety_mode``."""

    FREE = 0
    SLOW = 1
    SIT = 2
    HOLD = 3


@dataclass(frozen=True, slots=True)
class SafetySettings:
    """When safety steps in, and when it lets go.

    Attributes:
        command_time: A command with a time stamp that is older than this is followed no more: the
            robot slows to a stop [s].
        sit_time: One older than this makes it sit down [s].
        observation_time: After a gap of this length in what sensors tell the robot stops [s].
        tilt_share: The robot stops and crouches where its tilt, as predicted, exceeds this share of
            the angle at which it tips over.
        hold_share: Beyond this share it holds still.
        load_share: A servo whose output exceeds this share for `load_time` is overloaded.
        load_time: See there [s].
        heat_margin: The robot sits where a servo is warmer than its limit less this [K].
        slow_factor: Of the velocity while a servo is overloaded.
        slow_time: In which the velocity is taken from full to nothing [s].
        crouch: By which the body is lowered where it tilts [m].
        clear_time: A reason must be gone for as long before safety lets go [s].
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
class _Reason:
    """Something that is or was wrong; `until` is when it is forgotten."""

    mode: Mode
    factor: float
    until: float


class Guard:
    """Looks at each observation and command before a controller does.

    Every reason to step in is an event, once when it begins and once when it has gone.

    Attributes:
        mode: What the controller may do.
        events: Times [s] and sentences since `reset`.
        tip_angle: Tilt at which the robot tips over its neutral feet [rad].
        tip_time: The time in which it would [s].
        time: Of the last observation [s].
        hot: Temperature from which on a servo is too warm [°C].
        since: How long outputs have been added up [s].
        loads: Of each servo: squares of its output added up [s], for how long it has given nearly
            all that it can [s], and its temperature [°C], shape (3, L, 3).
        heating: What `add_loads` has to know of the servos.
    """

    def __init__(self, robot: Robot, settings: SafetySettings | None = None) -> None:
        self.robot, self.settings = robot, settings or SafetySettings()
        self.events: list[tuple[float, str]] = []
        self.mode = Mode.FREE
        self.tip_angle, self.tip_time = tipping(robot)
        legs, lengths = len(robot.legs), robot.arrays.lengths.sum(axis=1)
        fastest = robot.servo.no_load_speed * float(lengths.max())
        hips = np.hypot(*robot.arrays.p_body_hip[:, :2].T)
        self._most = (fastest, fastest, fastest / float(max(hips.min(), 0.01)))
        self._farthest = float(lengths.max())
        self._look, self._add_loads = compiled(look), compiled(add_loads)
        self._zero, self.loads = np.zeros((legs, 3)), np.zeros((3, legs, 3))
        self.heating = heating(robot.servo, self.settings.load_share)
        self.hot = math.inf
        if robot.servo.stall_current is not None:
            self.hot = robot.servo.temperature_limit - self.settings.heat_margin
        self._upright = np.array([1.0, 0.0, 0.0, 0.0])
        self._still = np.zeros(3)
        self._names = [f"{leg}.{joint}" for leg in robot.leg_names for joint in JOINTS]
        self.reset(None)

    def reset(self, observation: Observation | None) -> None:
        """Forget all."""
        self.events.clear()
        self.mode = Mode.FREE
        self._reasons: dict[str, _Reason] = {}
        self._factor, self._crouch = 1.0, 0.0
        self.time = observation.time if observation else math.nan
        self._q = self._zero.copy()
        self.since = 0.0
        self.loads[:2], self.loads[2] = 0.0, AMBIENT
        self._checked: Command | None = None
        self._good: Command = Command()
        self._sent: tuple[Command, float, float, Mode] | None = None
        self._made: Command = self._good
        if observation is not None:
            good = np.isfinite(observation.joint_position)
            self._q[good] = observation.joint_position[good]

    def check(self, observation: Observation, command: Command) -> tuple[Observation, Command]:
        """What a controller may be told.

        Args:
            observation: As it came.
            command: As it came.

        Returns:
            The same where nothing is wrong; else with what is sound of them.
        """
        time, set_ = observation.time, self.settings
        dt = time - self.time
        if not dt <= set_.observation_time:
            if math.isfinite(time) and math.isfinite(dt):
                told = f"sensors told nothing for {dt:.2g} s"
                self._blame("gap", Mode.SLOW, 0.0, time, told)
            elif not math.isfinite(time):
                time, dt = self.time, 0.0
        # Older news than the last one, or the same again.
        dt = max(dt, 0.0) if math.isfinite(dt) else 0.0
        self.time = time
        load, turn, rate = (
            observation.joint_load,
            observation.orientation,
            observation.angular_velocity,
        )
        bad, tilt = self._look(
            observation.joint_position,
            self._zero if observation.joint_velocity is None else observation.joint_velocity,
            self._zero if load is None else load,
            self._upright if turn is None else turn,
            self._still if rate is None else rate,
            self.tip_time,
        )
        if bad:
            observation = self._mended(observation, time)
        if not bad & 1:
            self._q = observation.joint_position
        if tilt > set_.tilt_share * self.tip_angle:
            self._tilted(tilt, time)
        if load is not None and not bad & 4:
            self.loads[0] += dt * load * load
            self.since += dt
            if self.since >= HEAT_STEP:
                self._loads(load, time)
        if command is not self._checked:
            self._checked, self._good = command, self._in_range(command, time)
        age = time - self._good.time if self._good.time is not None else 0.0
        if age > set_.command_time:
            self._old(age, time)
        if self._reasons or self._factor < 1.0 or self._crouch > 0.0:
            return observation, self._limited(self._good, time, dt)
        return observation, self._good

    # Reasons -------------------------------------------------------------------------------------

    def _blame(self, key: str, mode: Mode, factor: float, time: float, why: str) -> None:
        """Note a reason that holds now; it is told when it is new or worse."""
        known = self._reasons.get(key)
        if known is None or mode > known.mode:
            does = {
                Mode.SLOW: "the robot stops" if factor == 0.0 else "the robot walks slower",
                Mode.SIT: "the robot sits down",
                Mode.HOLD: "the robot holds still",
            }
            self.events.append((time, f"{why}: {does[mode]}." if mode in does else f"{why}."))
        else:
            mode, factor = known.mode, min(known.factor, factor)
        self._reasons[key] = _Reason(mode, factor, time + self.settings.clear_time)

    def _tilted(self, tilt: float, time: float) -> None:
        degrees, most = math.degrees(tilt), math.degrees(self.tip_angle)
        mode = Mode.HOLD if tilt > self.settings.hold_share * self.tip_angle else Mode.SLOW
        why = f"the body tilts, soon by {degrees:.0f}°, and tips over at {most:.0f}°"
        self._blame("tilt", mode, 0.0, time, why)

    def _old(self, age: float, time: float) -> None:
        sit = age > self.settings.sit_time
        why = f"no command for {self.settings.sit_time if sit else self.settings.command_time:g} s"
        self._blame("command", Mode.SIT if sit else Mode.SLOW, 0.0, time, why)

    def _mended(self, observation: Observation, time: float) -> Observation:
        """An observation without what is not finite: the last joint angles, no other values."""
        changed: dict[str, object] = {}
        q = observation.joint_position
        good = np.isfinite(q)
        if not good.all():
            names = [name for name, fine in zip(self._names, good.ravel(), strict=True) if not fine]
            shown = ", ".join(names[:3]) + (" and others" if len(names) > 3 else "")
            self._blame("joints", Mode.SLOW, 0.0, time, f"no angle is known of {shown}")
            self._q = np.where(good, q, self._q)
            changed["joint_position"] = self._q
        for name in ("joint_velocity", "joint_load", "orientation", "angular_velocity"):
            value = getattr(observation, name)
            if value is not None and not np.isfinite(value).all():
                what = name.replace("_", " ")
                self._blame(name, Mode.FREE, 1.0, time, f"{what} is not finite and is left out")
                changed[name] = None
        return replace(observation, **changed)  # type: ignore[arg-type]

    def _loads(self, load: Float[np.ndarray, "legs 3"], time: float) -> None:
        set_ = self.settings
        self._add_loads(load, self.since, self.loads, self.heating)
        self.since = 0.0
        _, overloaded, warmth = self.loads
        if overloaded.max() > set_.load_time:
            name = self._names[int(np.argmax(overloaded))]
            why = f"servo {name} gives more than {set_.load_share:.0%} for {set_.load_time:g} s"
            self._blame("load", Mode.SLOW, set_.slow_factor, time, why)
        # Once it is too hot it must cool down by as much again.
        if warmth.max() > self.hot - (set_.heat_margin if "heat" in self._reasons else 0.0):
            worst = int(np.argmax(warmth))
            why = f"servo {self._names[worst]} is as warm as {warmth.flat[worst]:.0f} °C"
            self._blame("heat", Mode.SIT, 0.0, time, why)

    def _in_range(self, command: Command, time: float) -> Command:
        """A command without what no robot of this size could mean."""
        changed: dict[str, object] = {}
        kept = tuple(
            min(max(v, -m), m) if math.isfinite(v) else 0.0
            for v, m in zip(command.velocity, self._most, strict=True)
        )
        if kept != tuple(command.velocity):
            changed["velocity"] = kept
        most = (self._farthest,) * 3 + (LARGEST_LEAN,) * 3
        pose = tuple(
            min(max(v, -m), m) if math.isfinite(v) else 0.0
            for v, m in zip(command.pose, most, strict=True)
        )
        if pose != tuple(command.pose):
            changed["pose"] = pose
        numbers = range(1, len(self.robot.legs) + 1)
        if not command.lost_legs <= set(numbers):
            changed["lost_legs"] = command.lost_legs & set(numbers)
        if not set(command.legs) <= set(numbers):
            kept_legs = {leg: value for leg, value in command.legs.items() if leg in numbers}
            changed["legs"] = MappingProxyType(kept_legs)
        if not changed:
            return command
        what = " and ".join(name.replace("_", " ") for name in changed)
        self._blame(f"range of {what}", Mode.FREE, 1.0, time, f"{what} of a command out of range")
        return replace(command, **changed)  # type: ignore[arg-type]

    # Answers -------------------------------------------------------------------------------------

    def _limited(self, command: Command, time: float, dt: float) -> Command:
        """The command as far as the present reasons allow, changing no faster than is set."""
        set_ = self.settings
        for key in [key for key, reason in self._reasons.items() if time > reason.until]:
            if self._reasons.pop(key).mode is not Mode.FREE:
                self.events.append((time, f"{_GONE.get(key, key)}: all is well again."))
        reasons = self._reasons.values()
        self.mode = max((reason.mode for reason in reasons), default=Mode.FREE)
        goal = min((reason.factor for reason in reasons), default=1.0)
        step = dt / set_.slow_time
        self._factor += min(max(goal - self._factor, -step), step)
        low = set_.crouch if "tilt" in self._reasons else 0.0
        step *= set_.crouch
        self._crouch += min(max(low - self._crouch, -step), step)
        sent = (command, self._factor, self._crouch, self.mode)
        if self._sent and self._sent[0] is command and self._sent[1:] == sent[1:]:
            return self._made
        made = command
        if self._factor < 1.0:
            x, y, turn = (self._factor * v for v in command.velocity)
            made = replace(made, velocity=(x, y, turn))
        if self._crouch > 0.0:
            x, y, z, roll, pitch, yaw = command.pose
            made = replace(made, pose=(x, y, z - self._crouch, roll, pitch, yaw))
        if self.mode is Mode.SIT:
            made = replace(made, posture=Posture.PACKED, legs=MappingProxyType({}))
        self._sent, self._made = sent, made
        return made


_GONE = {
    "gap": "sensors tell again",
    "tilt": "the body tilts no more",
    "command": "there are commands again",
    "joints": "joint angles are known again",
    "load": "no servo is overloaded any more",
    "heat": "the servos have cooled down",
}


def tipping(robot: Robot) -> tuple[float, float]:
    """Tilt at which a robot tips over its neutral feet [rad], and the time in which it would [s].

    An upright body tilting at a rate w is, unless something stops it, as far as one that tilts by
    w times that time more: that of an inverted pendulum from edge to centre of mass.

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


def look(
    q: np.ndarray,
    qd: np.ndarray,
    load: np.ndarray,
    turn: np.ndarray,
    rate: np.ndarray,
    tip_time: float,
) -> tuple[int, float]:
    """Which of the values are not finite, one bit each; and the tilt after the time to tip [rad].

    Args:
        q: Joint angles [rad].
        qd: Joint speeds [rad/s].
        load: Outputs of the servos.
        turn: The body's orientation, w x y z.
        rate: Its angular velocity, body axes [rad/s].
        tip_time: The time [s].
    """
    bad = 0
    for leg in range(q.shape[0]):
        for joint in range(3):
            if not math.isfinite(q[leg, joint]):
                bad |= 1
            if not math.isfinite(qd[leg, joint]):
                bad |= 2
            if not math.isfinite(load[leg, joint]):
                bad |= 4
    w, x, y, z = turn[0], turn[1], turn[2], turn[3]
    size = w * w + x * x + y * y + z * z
    spin = rate[0] + rate[1] + rate[2]
    if not math.isfinite(size) or size < 0.25:
        return bad | 8, 0.0
    # The vertical in body axes; it turns against the body.
    a, b = 2 * (x * z - w * y) / size, 2 * (y * z + w * x) / size
    c = (w * w - x * x - y * y + z * z) / size
    if math.isfinite(spin):
        da = (b * rate[2] - c * rate[1]) * tip_time
        db = (c * rate[0] - a * rate[2]) * tip_time
        dc = (a * rate[1] - b * rate[0]) * tip_time
        a, b, c = a + da, b + db, c + dc
    else:
        bad |= 8
    return bad, math.atan2(math.sqrt(a * a + b * b), c)
