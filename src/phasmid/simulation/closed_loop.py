"""The run of a controller in the physics engine, in closed loop."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from jaxtyping import Float

from phasmid.arguments import check_number, check_type, described, numbers
from phasmid.control import Command, Controller, JointTargets, Observation, Posture
from phasmid.errors import InvalidInput, nearest
from phasmid.kinematics import quaternion_rotation
from phasmid.motion import Motion
from phasmid.recording.channels import CHANNELS, COORDINATES
from phasmid.robot import JOINTS
from phasmid.scenario import Scenario
from phasmid.simulation.channels import run_channels
from phasmid.simulation.faults import Faults
from phasmid.simulation.interpolation import Between, SetpointInterpolator
from phasmid.simulation.observation import MeasuredObservation
from phasmid.simulation.run import WATCH_STEPS, Run
from phasmid.simulation.samples import Keep, Samples
from phasmid.simulation.termination import Ending, Failure, trunk_clearance

Pose: TypeAlias = tuple[float, float, float]
"""Where the body truly is: x, y [m] and yaw [rad] in the world."""

Commands: TypeAlias = Callable[[float, Observation, Pose], Command | None]
"""Tells what the robot shall do at a time on the controller's clock [s]; None ends the run."""

RISEN = 0.01
"""A trunk higher over the ground than this no longer lies [m]."""


class Decision(NamedTuple):
    """What was asked and answered at one update."""

    command: Command
    targets: JointTargets
    telemetry: Mapping[str, Any]


class ClosedLoopRun(Run):
    """A controller that drives the robot in the engine.

    The controller is asked at a fixed rate; in between, the engine makes its steps with the
    targets filled in.

    Args:
        scenario: Tells robot, ground, drive, time step and duration.
        begin: A motion with whose first instant the robot begins.
        controller: What decides.
        commands: What it is told to do.
        rate: Updates a second [1/s]; a period is a whole number of time steps.
        between: How targets are filled in between updates.
        faults: What fails, when.
        interrupted: The robot comes to rest no further as soon as this is not empty.
        endless: Whether it goes on for as long as it is advanced, whatever the scenario's duration.

    Attributes:
        controller: What decides.
        period_steps: Time steps from one update to the next.
        now: Index of the next time step.
        hold: Fills in targets between updates.
        wanted: What joints shall do in each period of a block, as the interpolator writes it.
        told_now: What each update of a block has told, by channel.
        asked: Every command that differed from the one before it, with its time [s].

    Raises:
        InvalidInput: The rate does not fit the time step, or the controller answers with something
            else than targets and channels.
    """

    def __init__(
        self,
        scenario: Scenario,
        begin: Motion,
        controller: Controller,
        commands: Commands,
        *,
        rate: float,
        between: Between,
        faults: Faults,
        interrupted: Sequence[int] = (),
        endless: bool = False,
    ) -> None:
        self.period_steps = period_steps(scenario, rate)
        self._shall_lie = True
        # Whole periods alone, so that each block begins with an update.
        self.block_steps = math.ceil(WATCH_STEPS / self.period_steps) * self.period_steps
        self._failure: Failure | None = None
        self._pushes: list[tuple[int, np.ndarray]] = []
        super().__init__(scenario, begin, interrupted=interrupted, endless=endless)
        self.controller, self.commands = controller, commands
        self._shape, self.now = (len(self.robot.legs), 3), self.step
        self._running = np.ones(self._shape, dtype=bool)
        # Views of the engine's memory, which stays: it takes long to make a new one.
        self._moves = self.data.qpos, self.data.qvel
        self._whereabouts = self._moves[0][:7]
        self._velocity_before = self.data.qvel[:3].copy()
        self._senses = MeasuredObservation(self, faults)
        self._deaths = sorted(faults.servos())
        start = begin.sample(np.zeros(1))
        self.hold = SetpointInterpolator(
            between, self.period_steps, self.dt, start.q[0], start.qd[0]
        )
        updates = self.block_steps // self.period_steps
        self.wanted = np.zeros((updates, 3, self.period_steps, *self._shape))
        self.wanted[0, :2, 0] = start.q[0], start.qd[0]
        self._kept = slice(0, 1)
        self.asked: list[tuple[float, Command]] = []
        self._newest: Command | None = None
        observation = self._observe()
        controller.reset(observation)
        self._decision = self._decide(observation)
        if self._decision is None:
            raise InvalidInput("the commands ended before their first one.")
        self.told_now = self._room_for(self._decision)

    def push(self, impulse: tuple[float, float, float], duration: float = 0.05) -> float:
        """Push the trunk at its centre of mass, from the next update on.

        The force is constant in the world's axes; several pushes add up.

        Args:
            impulse: Of the push, in the body's axes at its beginning [N·s].
            duration: How long it takes, rounded up to whole periods of the controller [s].

        Returns:
            How long it does take [s].

        Raises:
            InvalidInput: A number is not finite, or the duration not greater than 0.
        """
        wanted = numbers(impulse, "impulse")
        if wanted.shape != (3,) or not np.isfinite(wanted).all():
            raise InvalidInput("impulse must be three finite numbers: ahead, left, up [N·s].")
        check_number("duration", duration)
        if not (math.isfinite(duration) and duration > 0):
            raise InvalidInput(f"duration is {duration:g} s; it must be greater than 0.")
        period = self.period_steps
        steps = max(1, math.ceil(duration / (period * self.dt) - 1e-9)) * period
        R_world_body = quaternion_rotation(self.data.qpos[3:7])
        self._pushes.append((self.now + steps, R_world_body @ wanted / (steps * self.dt)))
        return steps * self.dt

    def let_die(self, leg: int, joint: int) -> None:
        """Let a servo die at the next update, for as long as the run lasts.

        Args:
            leg: The leg's index.
            joint: The joint's index.
        """
        self._deaths.insert(0, (self.now * self.dt, leg, joint))

    def _push_on(self) -> None:
        """Set the force of all pushes that go on, at an update."""
        if not self._pushes:
            return
        self._pushes = [push for push in self._pushes if push[0] > self.now]
        force = np.sum([force for _, force in self._pushes], axis=0) if self._pushes else 0.0
        self.data.xfrc_applied[self.data.body("trunk").id, :3] = force

    def _observe(self) -> Observation:
        """What the controller is told now, of servos that live."""
        self._let_die(self.now * self.dt)
        # A copy, since the controller may keep it.
        return self._senses.observe(self.now * self.dt, self._running.copy(), self._velocity_before)

    def _pose(self) -> Pose:
        x, y, _, w, i, j, k = self._whereabouts.tolist()
        return x, y, math.atan2(2 * (w * k + i * j), 1 - 2 * (j * j + k * k))

    def _decide(self, observation: Observation) -> Decision | None:
        """Ask for a command, and the controller for its targets; None where the run shall end."""
        command = self.commands(observation.time, observation, self._pose())
        if command is None:
            return None
        if command is not self._newest:
            check_type("command", command, (Command,), "a Command", "Command(velocity=(0.1, 0, 0))")
            self._newest = command
            # When it was given is no part of what it asks for.
            ageless = command if command.time is None else replace(command, time=None)
            if not self.asked or ageless != self.asked[-1][1]:
                self.asked.append((observation.time, ageless))
        self._shall_lie = command.posture is Posture.PACKED
        if self._shall_lie:
            self.lies = self.scenario.simulation.can_lie
        targets = self.controller.update(observation, command)
        _check_targets(targets, self._shape)
        tell = getattr(self.controller, "telemetry", None)
        return Decision(command, targets, {} if tell is None else tell())

    def _make_block(self, end: int, interrupted: Sequence[int]) -> int:
        """Make the steps up to the watch's next look, asking the controller before each period."""
        made, count = 0, min(self.block_steps, end - self.step)
        while made < count and not (interrupted or self._failure or self.ended):
            # The first decision was made before the run.
            decision = self._decision if self.now == 0 else self._decide(self._observe())
            if decision is None:
                self.ended = True
                break
            self._push_on()
            rows = self._rows_of(decision, made, count - made)
            last = self.now + len(rows) > self.steps
            now = self._advance(rows, at=made, last=last, interrupted=interrupted)
            if now:
                self._senses.take(made, made + now, self.now)
                made += now
                self.now += now
                self._velocity_before = self.buffer.qvel[made - 1, :3]
            if now < len(rows) or self._failure or self._in_trouble():
                break
        return made

    def _rows_of(self, decision: Decision, at: int, count: int) -> np.ndarray:
        """What the drive is told in the period that begins now, for some steps at most."""
        targets = decision.targets
        if not _adds_up(targets.position, targets.velocity):
            # One more step with what was asked last, so that there is a sample to tell it of.
            self._failure = Failure(Ending.FAILED, at, _not_finite(targets, self.robot.leg_names))
            targets, count = self.hold.last, 1
        update = at // self.period_steps
        wanted = self.hold.setpoints(targets, self.wanted[update])
        self._tell(update, decision)
        return self.drive.targets(wanted, self.dt)[:count]

    def _let_die(self, time: float) -> None:
        """Let those servos die whose time has come, at an update."""
        while self._deaths and self._deaths[0][0] <= time + 1e-9:
            _, leg, joint = self._deaths.pop(0)
            self._running[leg, joint] = False
            self.drive.fail(3 * leg + joint)

    def _in_trouble(self) -> bool:
        """Whether the engine has complained, or its state is none to tell a controller of."""
        return bool(self._complaints or self._lost or not _adds_up(*self._moves))

    def _look(self, count: int) -> Failure | None:
        """What the watch finds, or why the controller cannot be followed."""
        trouble = super()._look(count) or self._failure
        if self.lies and count and not self._shall_lie:
            # Once it has risen, a trunk that touches the ground has fallen.
            height = trunk_clearance(self.robot, self.buffer.qpos[count - 1 : count], self.ground)
            self.lies = bool(height[0] < RISEN)
        return trouble

    def _keep(self, count: int, keep: Keep) -> None:
        """Hand on what is recorded; `told` then knows which of the block's samples these are."""
        self._kept = slice(-self.step % self.every, count, self.every)
        super()._keep(count, keep)

    def told(self, rows: Samples, time: Float[np.ndarray, " time"]) -> dict[str, np.ndarray]:
        """All channels at the samples that were handed on last.

        Args:
            rows: These samples.
            time: Their times [s].
        """
        del time
        update = np.arange(self._kept.start, self._kept.stop, self._kept.step) // self.period_steps
        told = {name: values[update] for name, values in self.told_now.items()}
        names = ("joint_position_target", "joint_velocity_target", "joint_acceleration_target")
        wanted = np.moveaxis(self.wanted, 1, 0).reshape(3, self.block_steps, *self._shape)
        wanted = wanted[:, self._kept].copy()
        return run_channels(self, rows, told | dict(zip(names, wanted, strict=True)))

    def _room_for(self, decision: Decision) -> dict[str, np.ndarray]:
        """Memory of a block's telemetry, with that of the first update in its first place."""
        updates, legs = len(self.wanted), len(self.robot.legs)
        sizes = {"leg": legs} | {dim: len(labels) for dim, labels in COORDINATES.items()}
        own = run_channels(self, self.first, {}).keys()
        room: dict[str, np.ndarray] = {}
        for name in {COMMANDED: None, **decision.telemetry}:
            if name not in CHANNELS or name in own:
                guess = nearest(name, CHANNELS.keys() - own)
                what = "which the simulation tells" if name in own else "which is none"
                raise InvalidInput(
                    f'the controller\'s telemetry has the channel "{name}", {what}.',
                    hint=f'"{guess}"' if guess else "a name of phasmid.recording.CHANNELS",
                )
            shape = tuple(sizes[dim] for dim in CHANNELS[name].dims[1:])
            kind = np.bool_ if CHANNELS[name].kind == "bool" else np.float64
            room[name] = np.zeros((updates, *shape), kind)
        self.told_now = room
        self._tell(0, decision)
        return room

    def _tell(self, update: int, decision: Decision) -> None:
        """Note an update's command and telemetry; what it does not tell stays as it was."""
        told = {**decision.telemetry, COMMANDED: decision.command.velocity}
        if len(told) > len(self.told_now) or not told.keys() <= self.told_now.keys():
            name = next(iter(told.keys() - self.told_now.keys()))
            raise InvalidInput(
                f'the controller\'s telemetry has the channel "{name}", which its first did not '
                "have; it must tell the same channels at every update."
            )
        for name, room in self.told_now.items():
            value = told.get(name)
            if value is None:
                room[update] = room[update - 1]
                continue
            try:
                room[update] = value
            except (TypeError, ValueError):
                raise InvalidInput(
                    f'the controller\'s telemetry "{name}" is {described(value)}; it must be '
                    f"numbers of shape {room.shape[1:]}."
                ) from None


COMMANDED = "velocity_command"
"""The channel that tells what was commanded, beside the controller's telemetry."""


def period_steps(scenario: Scenario, rate: float) -> int:
    """Time steps from one update of a controller to the next.

    Args:
        scenario: Its time step is used.
        rate: Updates a second [1/s].

    Raises:
        InvalidInput: That is no whole number.
    """
    check_number("rate", rate)
    if not (math.isfinite(rate) and rate > 0):
        raise InvalidInput(f"rate is {rate:g}; it must be a finite number greater than 0.")
    dt = scenario.simulation.dt
    exact = 1 / (rate * dt)
    steps = max(1, round(exact))
    if abs(exact - steps) > 1e-6 * exact:
        raise InvalidInput(
            f"rate is {rate:g} updates a second, {exact:.4g} time steps of {1000 * dt:g} ms; it "
            "must be a whole number of them.",
            hint=f"rate = {1 / (steps * dt):.6g}",
        )
    return steps


def _check_targets(targets: object, shape: tuple[int, int]) -> None:
    """Refuse an answer that is no targets for this robot."""
    if not isinstance(targets, JointTargets):
        must, hint = "JointTargets", "phasmid.control.JointTargets(position, velocity)"
        check_type("what the controller's update returns", targets, (JointTargets,), must, hint)
    assert isinstance(targets, JointTargets)
    for name in ("position", "velocity", "torque"):
        value = getattr(targets, name)
        if value is None and name == "torque":
            continue
        if not isinstance(value, np.ndarray) or value.shape != shape:
            raise InvalidInput(
                f"the controller's target {name} is {described(value)}; it must be an array of "
                f"shape {shape}."
            )


def _adds_up(*arrays: np.ndarray) -> bool:
    """Whether arrays hold nothing but finite numbers, whose squares can be added up."""
    return all(math.isfinite(np.vdot(array, array)) for array in arrays)


def _not_finite(targets: JointTargets, legs: Sequence[str]) -> str:
    """Which target is no finite number."""
    for name in ("position", "velocity"):
        values = getattr(targets, name)
        for leg, joint in np.argwhere(~np.isfinite(values)):
            return (
                f"it asked for a {name} of {values[leg, joint]} at {legs[leg]}.{JOINTS[joint]}; "
                "targets must be finite"
            )
    return "its targets are too large to add up"
