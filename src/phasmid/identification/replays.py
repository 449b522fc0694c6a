"""Replays of a log's joint targets in simulation, with other servos."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from phasmid.errors import InvalidInput
from phasmid.experiment import Ending
from phasmid.identification.robot_log import RobotLog, body_measurements
from phasmid.motion import JointTrajectory
from phasmid.recording import Recording
from phasmid.scenario import Scenario
from phasmid.servo import Servo
from phasmid.simulation import simulate
from phasmid.simulation.sensors.models import Sampling


@dataclass(frozen=True, eq=False)
class Replay:
    """Simulated motion at the times of a log.

    Attributes:
        position: Joint angles [rad], shape (N, L, 3).
        torque: Joint torques [N·m], shape (N, L, 3).
        contact: Whether feet touch the ground, shape (N, L).
        measured: The log's further measurements, simulated.
    """

    position: Float[np.ndarray, "time legs 3"]
    torque: Float[np.ndarray, "time legs 3"]
    contact: Bool[np.ndarray, "time legs"]
    measured: dict[str, Float[np.ndarray, " time"]]


class Replayer:
    """Simulates the targets of a log with any servo.

    A delay of the servos shifts the whole simulated motion in time: nothing else depends on time.

    Args:
        log: The log.
        scenario: Robot, ground and payload.
        progress: Receives how many replays are done.

    Attributes:
        lag: Time by which the scenario's sensors report the joints late, seen in the log [s].

    Raises:
        InvalidInput: The robot cannot follow the log's targets, or the time step is too long.
    """

    def __init__(
        self,
        log: RobotLog,
        scenario: Scenario,
        progress: Callable[[float], None] | None = None,
    ) -> None:
        self._log, self._progress = log, progress
        self._done = 0
        self._knots, self._targets = command_knots(log)
        dt = scenario.simulation.time_step
        self._scenario = scenario.replace(
            drive="servo", record_interval=dt, duration=float(self._knots[-1])
        )
        self.lag = reading_lag(log, scenario)

    def replay(self, servo: Servo) -> Simulated:
        """Simulate the log's targets with a servo.

        Raises:
            InvalidInput: The robot falls.
        """
        robot = replace(self._scenario.base_robot(), servo=servo)
        scenario = self._scenario.replace(robot=robot, servo=None)
        motion = JointTrajectory(scenario.load_robot(), self._knots, self._targets)
        run = simulate(scenario, motion)
        self._done += 1
        if self._progress is not None:
            self._progress(self._done)
        if not Ending[run.attrs["ending"]].is_full_length:
            raise InvalidInput(
                f"the replay did not come to its end: {run.attrs['ending_reason']}",
                hint="a log of a walk, from the beginning, and the robot's own scenario",
            )
        return Simulated(run, self._log, self.lag)


class Simulated:
    """Recorded replay that is read at the times of a log, shifted in time."""

    def __init__(self, run: Recording, log: RobotLog, lag: float) -> None:
        channels = {str(name): np.asarray(run[name].values) for name in run.data_vars}
        self._time, self._lag = np.asarray(run["time"].values), lag
        self._wanted, self._read_time = log.time, log.read_time
        self._channels = {n: channels[n] for n in ("joint_position", "joint_torque", "contact")}
        rate = channels.get("imu_angular_velocity", channels["body_angular_velocity"])
        self._measured = body_measurements(channels)
        self._measured |= {"roll_rate": rate[:, 0], "pitch_rate": rate[:, 1]}

    def position(self, shift: float) -> Float[np.ndarray, "time legs 3"]:
        """Return the joint angles at the log's times, later by a shift [s], shape (N, L, 3)."""
        values, shift = self._channels["joint_position"], shift + self._lag
        if self._read_time is None:
            return self._at(values, shift)
        return interpolated(self._read_time - shift, self._time, values)

    def at(self, shift: float) -> Replay:
        """Return the replay at the log's times, later by a shift [s]."""
        contact = self._at(self._channels["contact"].astype(float), shift)
        return Replay(
            self.position(shift),
            self._at(self._channels["joint_torque"], shift),
            contact > 0.5,
            {name: self._at(values, shift) for name, values in self._measured.items()},
        )

    def _at(self, values: np.ndarray, shift: float) -> np.ndarray:
        """Interpolate linearly; before its beginning and after its end the motion rests."""
        place = np.interp(self._wanted - shift, self._time, np.arange(len(self._time)))
        row = np.minimum(place.astype(int), len(values) - 2)
        part = (place - row).reshape(-1, *[1] * (values.ndim - 1))
        return np.asarray((1 - part) * values[row] + part * values[row + 1])


def interpolated(
    at: Float[np.ndarray, "times legs 3"],
    time: Float[np.ndarray, " time"],
    values: Float[np.ndarray, "time legs 3"],
) -> Float[np.ndarray, "times legs 3"]:
    """Interpolate joints linearly, each at times of its own; constant before and after."""
    found = np.empty(at.shape)
    for joint in np.ndindex(*at.shape[1:]):
        found[:, *joint] = np.interp(at[:, *joint], time, values[:, *joint])
    return found


def reading_lag(log: RobotLog, scenario: Scenario) -> float:
    """Return the mean age of the scenario's joint readings at the log's times [s]."""
    sensors = scenario.sensors
    if not log.is_read or sensors.measured != "everything":
        return 0.0
    latest = Sampling(sensors.joint_rate, sensors.joint_delay).latest(log.time)
    return float(np.mean(np.maximum(log.time - latest / sensors.joint_rate, 0.0)))


def command_knots(
    log: RobotLog,
) -> tuple[Float[np.ndarray, " knots"], Float[np.ndarray, "knots legs 3"]]:
    """Return times and angles of the commands in a log, to be joined by splines.

    A log that is faster than the controller repeats each target, and on a servo bus a target holds
    until the next row. The mean of a held target is in the middle of its hold, where its knot is
    placed; otherwise every row is a knot.
    """
    moves = (np.diff(log.target, axis=0) != 0).any(axis=(1, 2))
    starts = np.flatnonzero(np.concatenate([[True], moves]))
    lengths = np.diff(np.append(starts, len(log.time)))
    held = int(np.median(lengths))
    if held < 2 and not log.targets_hold:
        return log.time, log.target
    # A target that is kept for long is several commands.
    rows = np.concatenate(
        [
            np.arange(start, start + length, held)
            for start, length in zip(starts, lengths, strict=True)
        ]
    )
    middle = log.time[rows] + 0.5 * held * float(np.median(np.diff(log.time)))
    time = np.concatenate([[0.0], middle])
    return time, np.concatenate([log.target[:1], log.target[rows]])
