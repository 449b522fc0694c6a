"""A simulated run in which a controller drives the robot."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from jaxtyping import Float

from phasmid.arguments import described
from phasmid.control import CommandScript, Player, commands_to_text
from phasmid.control.waypoints import WaypointFollower, plane_pose
from phasmid.errors import InvalidInput, nearest
from phasmid.experiment import Command, Controller, Experiment, JointTargets, Observation, Posture
from phasmid.experiment.contact_law import STANDING_SPEED
from phasmid.experiment.ending import Ending, Failure
from phasmid.experiment.targets import checked_targets
from phasmid.kinematics import quaternion_rotation
from phasmid.motion import Motion, Walk
from phasmid.recording.channels import CHANNELS, COMMANDED, COORDINATES
from phasmid.recording.recording import Attributes
from phasmid.robot import JOINTS
from phasmid.simulation.channels import sample_channels
from phasmid.simulation.drives import Setpoints
from phasmid.simulation.faults import Faults
from phasmid.simulation.loop import Samples
from phasmid.simulation.observation import Observer
from phasmid.simulation.run import BLOCK_STEPS, Run, Watcher
from phasmid.simulation.start import SHORTEST_PRACTICAL
from phasmid.simulation.termination import trunk_clearance

if TYPE_CHECKING:
    from phasmid.control.estimation import BodyStateEstimator

Commanded: TypeAlias = Command | CommandScript | Callable[[float, Observation], Command | None]
"""A constant command, a script, or a function of time [s] and observation; None ends the run."""

MOST_EVENTS = 10_000
"""Most events of a controller that a recording keeps."""

RISEN = 0.01
"""Height over the ground above which the trunk of ``phantomx-ax`` no longer lies [m]; that of other
robots follows their leg length."""

STANDING_HARDNESS = 10.0
"""Hardness of the friction under a robot that stands on ground that is not level, over that under a
moving one. It divides the creep, and multiplies the mass with which a contact point resists its
acceleration along the ground; a standing foot has none."""

LIMITS = "the velocity was scaled", "goes no farther", "slow", "a lift waits"
"""Beginnings of the events that tell why a controller is slower than its command."""

TARGETS = "joint_position_target", "joint_velocity_target", "joint_acceleration_target"


def period_steps(experiment: Experiment, rate: float) -> int:
    """Return the number of time steps of a controller period of 1/rate.

    Raises:
        InvalidInput: It is no whole number.
    """
    if not (math.isfinite(rate) and rate > 0):
        raise InvalidInput(f"rate is {rate:g}; it must be a finite number greater than 0.")
    dt = experiment.solver.time_step
    if experiment.solver.dt is None and rate * SHORTEST_PRACTICAL <= 1:
        # The chosen step will divide the period.
        dt = 1 / (rate * math.ceil(1 / (rate * dt) - 1e-9))
    exact = 1 / (rate * dt)
    steps = max(1, round(exact))
    if abs(exact - steps) > 1e-6 * exact:
        raise InvalidInput(
            f"rate is {rate:g} updates a second, {exact:.4g} time steps of {1000 * dt:g} ms; it "
            "must be a whole number of them.",
            hint=f"rate = {1 / (steps * dt):.9g}",
        )
    return steps


def interpolation_weights(drive: str, steps: int, dt: float) -> Float[np.ndarray, "3 steps 4"]:
    """Return the weights that interpolate targets at the time steps of a period.

    Goals of servos stay until the next update, as on a servo's bus. Those of joints driven by
    torque go on with the targets' velocities. Prescribed joints go from the last targets to the new
    ones by a cubic, and reach them with the targets' velocities at the next update.

    Args:
        drive: Kind of drive.
        steps: Time steps of a period.
        dt: Time step [s].

    Returns:
        For angle, velocity and acceleration: weights of angle and velocity of the last targets, and
        of angle and velocity of the new ones.
    """
    s, T = np.arange(steps) / steps, steps * dt
    weights = np.zeros((3, steps, 4))
    if drive == "prescribed":
        # Hermite's basis in powers of s, and its derivatives.
        basis = np.array([[1, 0, -3, 2], [0, T, -2 * T, T], [0, 0, 3, -2], [0, 0, -T, T]])
        powers = np.stack([s**0, s, s**2, s**3])
        weights[0] = (basis @ powers).T
        weights[1] = (basis[:, 1:] @ (powers[:3] * [[1], [2], [3]]) / T).T
        weights[2] = (basis[:, 2:] @ (powers[:2] * [[2], [6]]) / T**2).T
        return weights
    weights[0, :, 2] = weights[1, :, 3] = 1.0
    if drive == "torque":
        weights[0, :, 3] = T * s
    return weights


class Decision(NamedTuple):
    """Command, targets and telemetry of one update."""

    command: Command
    targets: JointTargets
    telemetry: Mapping[str, Any]


class ClosedLoopRun(Run):
    """A controller that drives the robot in MuJoCo, updated at a fixed rate.

    Args:
        experiment: Its robot, ground, drive, time step and duration are used.
        begin: A motion at whose first instant the robot begins.
        controller: Returns the targets.
        commands: A command, a script, or a function that returns the command at each update.
        rate: Updates per second [1/s]; a period is a whole number of time steps.
        faults: Faults of sensors and servos with their times.
        attributes: Further attributes of the recording.
        endless: Whether the run goes on for as long as it is advanced.

    Attributes:
        controller: The controller.
        period_steps: Time steps from one update to the next.
        now: Index of the next time step.
        override: Returns a velocity that replaces that of the next command, or None.
        command_changes: Every command that differs from the one before it, with its time [s].

    Raises:
        InvalidInput: The rate does not fit the time step, or the controller returns something
            else than targets and channels.
    """

    def __init__(
        self,
        experiment: Experiment,
        begin: Motion,
        controller: Controller,
        commands: Commanded,
        *,
        rate: float,
        faults: Faults,
        attributes: Attributes | None = None,
        endless: bool = False,
    ) -> None:
        self.period_steps = period_steps(experiment, rate)
        # Each block begins with an update.
        updates = math.ceil(BLOCK_STEPS / self.period_steps)
        self.block_steps = updates * self.period_steps
        self._controller_failure: Failure | None = None
        self._must_lie = True
        self.controller = controller
        super().__init__(experiment, begin, endless=endless)
        self.now = self.step
        self._commands, self._attributes = commands, attributes or {}
        self.override: Callable[[], tuple[float, float, float] | None] | None = None
        self._overridden = False
        self._follower: WaypointFollower | None = None
        if isinstance(commands, CommandScript) and commands.waypoint:
            self._follower = WaypointFollower(commands)
        self._shape = len(self.robot.legs), 3
        self._works = np.ones(self._shape, dtype=bool)
        self._qpos, self._qvel = self.data.qpos, self.data.qvel
        self._velocities = self.buffer["qvel"][:, :3]
        self._velocity_before = self._qvel[:3].copy()
        self._observer = Observer(self, faults)
        self._estimator: BodyStateEstimator | None = None
        if experiment.sensors.body_state == "estimated":
            # Lazy import: compiled functions take 0.2 s to load.
            from phasmid.control.estimation import BodyStateEstimator, BodyStateSettings

            noise = BodyStateSettings(gravity=experiment.world.gravity)
            self._estimator = BodyStateEstimator(self.robot, noise, self.period_steps * self.dt)
        self._servo_failures = sorted(faults.servos())
        self._pushes: list[tuple[int, np.ndarray]] = []
        self._hardness = float(self.model.opt.impratio)
        first = begin.sample(np.zeros(1))
        start = first.q[0], first.qd[0]
        kind = experiment.solver.planned_drive
        self._weights = interpolation_weights(kind, self.period_steps, self.dt)
        # Angles and velocities of the last targets but one, then of the last targets.
        self._ends = np.stack([*start, *start])
        self._setpoints = np.zeros((updates, 3, self.period_steps, *self._shape))
        self._setpoints[0, :2, 0] = start
        self._torque = np.zeros((self.period_steps, *self._shape))
        self.command_changes: list[tuple[float, Command]] = []
        self._newest: Command | None = None
        observation = self._observe()
        controller.reset(observation)
        self._decision = self._decide(observation)
        if self._decision is None:
            raise InvalidInput("the commands ended before their first one.")
        self._check_telemetry(self._decision)
        # Of the latest update, and of each update of the present block.
        self._latest: dict[str, np.ndarray] = {}
        self._telemetry: list[dict[str, np.ndarray]] = []
        self._record_telemetry(self._decision)

    def _commanding_walk(self) -> Walk | None:
        # A player follows its plan whatever is commanded.
        return super()._commanding_walk() if isinstance(self.controller, Player) else None

    # Disturbances --------------------------------------------------------------------------------

    def push(self, impulse: tuple[float, float, float], duration: float = 0.05) -> float:
        """Push the trunk at its centre of mass with a constant force, from the next update on.

        Args:
            impulse: In the body axes of now [N·s]; several pushes add up.
            duration: Rounded up to whole periods of the controller [s].

        Returns:
            The rounded duration [s].
        """
        period = self.period_steps
        steps = max(1, math.ceil(duration / (period * self.dt) - 1e-9)) * period
        R_world_body = quaternion_rotation(self._qpos[3:7])
        self._pushes.append(
            (self.now + steps, R_world_body @ np.array(impulse) / (steps * self.dt))
        )
        return steps * self.dt

    def fail_servo(self, leg: int, joint: int) -> None:
        """Make the servo of a joint fail at the next update, for good."""
        self._servo_failures.insert(0, (self.now * self.dt, leg, joint))

    def _apply_pushes(self) -> None:
        if self._pushes:
            self._pushes = [push for push in self._pushes if push[0] > self.now]
            force = np.sum([force for _, force in self._pushes], axis=0) if self._pushes else 0.0
            self.data.xfrc_applied[self.data.body("trunk").id, :3] = force

    def watch(self, watcher: Watcher, interval: float) -> None:
        """Pass on what is recorded, in blocks of whole controller periods; see `Run.watch`."""
        super().watch(watcher, interval)
        self.block_steps = max(1, self.block_steps // self.period_steps) * self.period_steps

    # Updates -------------------------------------------------------------------------------------

    def _observe(self) -> Observation:
        """Apply the servo failures that are due, and return the observation of now."""
        time, failures = self.now * self.dt, self._servo_failures
        while failures and failures[0][0] <= time + 1e-9:
            _, leg, joint = failures.pop(0)
            self._works[leg, joint] = False
            self.drive.fail(3 * leg + joint)
        observation = self._observer.observe(time, self._works, self._velocity_before)
        return self._estimator.observe(observation) if self._estimator else observation

    def _command(self, observation: Observation) -> Command | None:
        """Return the command at an observation; None where the commands end."""
        commands, time = self._commands, observation.time
        if isinstance(commands, Command):
            return commands
        if self._follower:
            position, orientation = observation.body_position, observation.body_orientation
            if position is None or orientation is None:
                # Nothing estimates the pose: the true one.
                position, orientation = self._qpos[:3], self._qpos[3:7]
            return self._follower.command(time, plane_pose(position, orientation))
        if isinstance(commands, CommandScript):
            return commands.at(time)
        command = commands(time, observation)
        if command is not None and not isinstance(command, Command):
            raise InvalidInput(
                f"the function of commands returned {described(command)}; it must return a "
                "phasmid.experiment.Command, or None to end the run.",
                hint="return Command(velocity=(0.05, 0, 0))",
            )
        return command

    def _decide(self, observation: Observation) -> Decision | None:
        """Return command, targets and telemetry of an update; None where the commands end."""
        command = self._command(observation)
        if command is None:
            return None
        velocity = self.override() if self.override else None
        if velocity is not None:
            command, self._overridden = replace(command, velocity=velocity), True
        if command is not self._newest:
            self._newest = command
            timeless = command if command.time is None else replace(command, time=None)
            if not self.command_changes or timeless != self.command_changes[-1][1]:
                self.command_changes.append((observation.time, timeless))
        self._must_lie = command.posture is Posture.PACKED
        if self._must_lie:
            self.lies = self.experiment.solver.can_lie
        targets = checked_targets(self.controller.update(observation, command), self._shape)
        telemetry: Mapping[str, Any] = getattr(self.controller, "telemetry", dict)()
        if not isinstance(telemetry, Mapping):
            raise InvalidInput(
                f"the controller's telemetry returned {described(telemetry)}; it must return "
                "numbers by channel name."
            )
        if self._estimator:
            telemetry = {**telemetry, **self._estimator.channels()}
        return Decision(command, targets, telemetry)

    def _make_block(self, end: int, interrupted: Sequence[int]) -> int:
        """Make the steps of one block, with an update before each period."""
        made, count = 0, min(self.block_steps, end - self.step)
        self._telemetry.clear()
        while made < count and not (interrupted or self._controller_failure):
            # The first decision was made before the run.
            decision = self._decision if self.now == 0 else self._decide(self._observe())
            if decision is None:
                self.ended = True
                break
            self._apply_pushes()
            targets = self._period_targets(decision, made)[: count - made]
            # A controller may use MuJoCo too; its warnings do not count.
            self._warnings.clear()
            last = self.now + len(targets) > self.steps
            steps = self._advance(targets, at=made, last=last)
            if steps:
                self._observer.take(made, made + steps, self.now)
                made += steps
                self.now += steps
                self._velocity_before = self._velocities[made - 1]
            size = np.vdot(self._qpos, self._qpos) + np.vdot(self._qvel, self._qvel)
            if steps < len(targets) or self._error() or not math.isfinite(size):
                break
        return made

    def _period_targets(self, decision: Decision, at: int) -> Float[np.ndarray, "steps joints"]:
        """Return the commands of the drive in the period that begins at row `at` of the buffer."""
        torque, count, ends = decision.targets.torque, self.period_steps, self._ends
        ends[:2] = ends[2:]
        ends[2], ends[3] = decision.targets.position, decision.targets.velocity
        if not math.isfinite(np.vdot(ends, ends)):
            ends[2:] = ends[:2]
            reason = _not_finite(decision.targets, self.robot.leg_names)
            self._controller_failure = Failure(Ending.FAILED, at, reason)
            # One more step with the last targets, so that there is a sample to report.
            torque, count = None, 1
        rows = self._setpoints[at // self.period_steps]
        np.matmul(self._weights, ends.reshape(4, -1), out=rows.reshape(3, len(rows[0]), -1))
        self._harden_friction()
        self._record_telemetry(decision)
        if torque is not None:
            self._torque[:] = torque
        q, qd, qdd = rows
        setpoints = Setpoints(q, qd, qdd, None if torque is None else self._torque)
        return self.drive.targets(setpoints)[:count]

    def _harden_friction(self) -> None:
        """Harden the friction where the robot stands on ground down which it could creep."""
        if not self.ground.is_level and self.experiment.world.contact.kind == "spring-damper":
            # A controller may move the positions and leave the velocities 0.
            moved = np.abs(self._ends[2] - self._ends[0]).max() / (self.period_steps * self.dt)
            stands = max(moved, np.abs(self._ends[1::2]).max()) < STANDING_SPEED
            self.model.opt.impratio = self._hardness * (STANDING_HARDNESS if stands else 1.0)

    def _check(self, count: int) -> Failure | None:
        """Return the first failure of the block, or why the controller cannot be followed."""
        failure = super()._check(count) or self._controller_failure
        if self.lies and count and not self._must_lie:
            # Once it has risen, a trunk that touches the ground has fallen.
            qpos = self.buffer["qpos"][count - 1 : count]
            risen = RISEN * self.experiment.scale.length
            self.lies = bool(trunk_clearance(self.robot, qpos, self.ground)[0] < risen)
        return failure

    # Recording -----------------------------------------------------------------------------------

    def channels(self, samples: Samples) -> dict[str, np.ndarray]:
        """Return all channels at the samples that are recorded next."""
        rows = -self.step % self.every + np.arange(len(samples)) * self.every
        update = np.minimum(rows // self.period_steps, len(self._telemetry) - 1)
        telemetry = {
            name: np.stack([row[name] for row in self._telemetry])[update]
            for name in self._telemetry[0]
        }
        setpoints = np.moveaxis(self._setpoints, 1, 0).reshape(3, -1, *self._shape)
        targets = dict(zip(TARGETS, setpoints[:, rows], strict=True))
        return {**telemetry, **targets, **sample_channels(self, samples)}

    def attributes(self) -> Attributes:
        """Return the attributes of run, controller, commands and faults."""
        attributes = {**super().attributes(), **self._attributes}
        if not isinstance(self.controller, Player):
            attributes.pop("trajectory", None)
        if isinstance(self._commands, CommandScript):
            attributes["commands"] = self._commands.to_text()
        return attributes

    def final_attributes(self) -> Attributes:
        """Return the controller's events, the waypoints reached, and the commands."""
        all_events = list(getattr(self.controller, "events", ()))
        events = [[float(time), str(sentence)] for time, sentence in all_events[:MOST_EVENTS]]
        if len(all_events) > MOST_EVENTS:
            events.append([events[-1][0], f"{len(all_events) - MOST_EVENTS} more were not kept"])
        final = {"events": json.dumps(events, ensure_ascii=False)}
        if self._overridden or not isinstance(self._commands, CommandScript):
            # The run ended after the last update with a command, before the one without.
            end = (self.step - 0.5 * self.period_steps) * self.dt if self.ended else None
            final["commands"] = commands_to_text(self.command_changes, end)
        if self._follower and isinstance(self._commands, CommandScript):
            places = self._commands.waypoint
            times = [*self._follower.reached, *[None] * len(places)]
            rows = [
                {"x": place.x, "y": place.y, "heading": place.heading, "reached": time}
                for place, time in zip(places, times, strict=False)
            ]
            final["waypoints"] = json.dumps(rows)
        return final

    def shortfall(self, command: Command | None = None, event: str = "") -> Failure | None:
        """Return which waypoint was not reached, or why the robot fell short of its command."""
        follower, commands = self._follower, self._commands
        if follower is None or not isinstance(commands, CommandScript):
            if len(self.command_changes) == 1:
                command = self.command_changes[0][1]
            told = [str(text) for _, text in getattr(self.controller, "events", ())]
            lame = [text for text in told if text.startswith("stands:")]
            limits = [text for text in told if text.startswith(LIMITS)]
            return super().shortfall(command, (lame or limits or [event])[-1])
        reached, count = len(follower.reached), len(commands.waypoint)
        if reached == count:
            return None
        reason = (
            f"by {min(self.step, self.steps) * self.dt:.4g} s: {reached} of {count} reached, "
            f"waypoint {reached + 1} is {follower.remaining}"
        )
        return Failure(Ending.INCOMPLETE, self.step, reason, "a longer --duration")

    def _check_telemetry(self, decision: Decision) -> None:
        """Refuse telemetry with other channels than those of a controller, or of another shape."""
        sizes = {"leg": len(self.robot.legs), **{k: len(v) for k, v in COORDINATES.items()}}
        known = CHANNELS.keys() - {*TARGETS, *sample_channels(self, self.first)}
        for name in decision.telemetry:
            if name not in known:
                guess = nearest(name, known)
                raise InvalidInput(
                    f'the controller\'s telemetry has the channel "{name}"; it must be one of '
                    "phasmid.recording.CHANNELS that the simulation does not record.",
                    hint=f'"{guess}"' if guess else "",
                )
            shape = _as_sample(name, decision.telemetry[name]).shape
            wanted = tuple(sizes[axis] for axis in CHANNELS[name].dims[1:])
            if shape != wanted:
                raise InvalidInput(
                    f"{name} of the controller's telemetry has shape {shape}; it must have shape "
                    f"{wanted}."
                )

    def _record_telemetry(self, decision: Decision) -> None:
        """Record command and telemetry of an update; absent channels keep their last values."""
        row = {**decision.telemetry, COMMANDED: decision.command.velocity}
        for name in row.keys() & (self._latest or row).keys():
            array = _as_sample(name, row[name])
            shape = self._latest.get(name, array).shape
            if array.shape != shape:
                raise InvalidInput(
                    f"{name} of the controller's telemetry has shape {array.shape}; before, it had "
                    f"shape {shape}."
                )
            self._latest[name] = array
        self._telemetry.append(dict(self._latest))


def _as_sample(name: str, values: object) -> np.ndarray:
    """Return the sample of a channel of telemetry."""
    try:
        return np.array(values, bool if CHANNELS[name].kind == "bool" else float)
    except (TypeError, ValueError):
        raise InvalidInput(
            f"{name} of the controller's telemetry is {described(values)}; it must be a number or "
            "an array of numbers."
        ) from None


def _not_finite(targets: JointTargets, legs: Sequence[str]) -> str:
    """Return which target is no finite number."""
    for leg, joint in np.argwhere(~np.isfinite(targets.position + targets.velocity)):
        return f"its target is not finite at {legs[leg]}.{JOINTS[joint]}"
    return "its targets are too large to add up"
