"""A simulated run of a planned walk, block by block, recorded in memory or in a log."""

from __future__ import annotations

import base64
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Shaped

from phasmid.arguments import numbers
from phasmid.errors import InvalidInput
from phasmid.experiment import Command, Experiment, ScenarioLike, built
from phasmid.experiment.ending import Ending, Failure
from phasmid.experiment.solver import SETTLING_TIME
from phasmid.forces.analysis import recording_attributes
from phasmid.interrupts import held_signals
from phasmid.motion import JointTrajectory, Motion, SampledMotion, Walk
from phasmid.recording import Recording, RecordingLog, load_recording, new_recording
from phasmid.recording.provenance import ending_attributes, versions
from phasmid.recording.recording import Attributes
from phasmid.simulation.channels import sample_channels, with_sensors
from phasmid.simulation.contact import FootGround
from phasmid.simulation.drives import (
    Drive,
    IdealServoDrive,
    PrescribedDrive,
    Setpoints,
    TorqueDrive,
    standing_torque,
    walking_torque,
)
from phasmid.simulation.falls import Past
from phasmid.simulation.loop import (
    Keep,
    Samples,
    collect_engine_warnings,
    empty_samples,
    make_steps,
    present_sample,
)
from phasmid.simulation.model import build_model
from phasmid.simulation.model_reference import ModelReference
from phasmid.simulation.servo_drive import ServoDrive
from phasmid.simulation.shortfall import CommandFollowing, shortfall_cause
from phasmid.simulation.start import start_offset
from phasmid.simulation.termination import check_termination

if TYPE_CHECKING:
    import mujoco

BLOCK_STEPS = 512
"""Steps of a block; failures are looked for, and samples recorded, after each block."""

LONGEST_CYCLE = 32 * BLOCK_STEPS
"""Steps of the longest cycle whose commands are kept."""

ENDLESS = 2**62
"""Steps of a run without an end."""

Progress = Callable[[float], None]
"""Receives the simulated time [s] now and then."""

Watcher = Callable[[np.ndarray, Mapping[str, np.ndarray]], None]
"""Receives times [s] and channels of new samples, as `RecordingLog.append` does."""


class Run:
    """A planned walk in MuJoCo.

    The robot is placed at the start of the plan and settles on its feet before the first step.

    Args:
        scenario: The scenario, or its experiment.
        walk: The motion that the joints follow.
        start: State of a run of the same walk to continue from, see `state`; None: the robot is
            placed and settles.
        endless: Run until the caller stops it; `time` is empty.

    Attributes:
        model: MuJoCo's model.
        data: MuJoCo's state.
        steps: Number of steps.
        step: Index of the next step.
        first: The state in which the robot is placed, before it settles.
        buffer: Samples of the present block.
        log: Recorded samples, where `advance` keeps them.
        done: Number of samples recorded.
        failure: Why the robot could not settle, or None.
        ended: Whether the run is over before its last step, without a failure.
        lies: Whether the trunk may touch the ground at present.
        following: How the recorded part follows its command.
        simulator: Name of the simulator.
    """

    simulator = "MuJoCo"
    block_steps = BLOCK_STEPS

    def __init__(
        self,
        scenario: ScenarioLike | Experiment,
        walk: Motion,
        *,
        start: Float[np.ndarray, " state"] | None = None,
        endless: bool = False,
    ) -> None:
        self.experiment = experiment = built(scenario)
        self.walk, self.robot = walk, walk.robot
        self.dt = experiment.solver.time_step
        self.steps = ENDLESS if endless else max(1, round(experiment.duration / self.dt))
        self.every = experiment.solver.record_steps
        self.ground = experiment.world.terrain
        self._set_up()
        self.buffer = empty_samples(self.model, self.drive, self.block_steps)
        self.log = self.buffer[:0]
        self.done = self.step = 0
        self.failure: Failure | None = None
        self.ended = False
        self._watcher: Watcher | None = None
        self.following = CommandFollowing(self._commanding_walk())
        self.lies = experiment.solver.can_lie
        self._warnings: list[str] = []
        self._step_error = ""
        self._past = Past(self)
        self._cycle = self._cycle_targets()
        self._place(walk.sample(np.zeros(1)))
        if start is None:
            self.failure = self._settle()
        else:
            self.restore(start)
        self._start = start
        # Index of the first sample, rounded up.
        self._begin = -(-self.step // self.every)

    @cached_property
    def time(self) -> Float[np.ndarray, " time"]:
        """Times of all samples to be recorded [s], shape (N,); empty for a run without an end."""
        if self.steps == ENDLESS:
            return np.empty(0)
        return np.arange(self._begin, self.steps // self.every + 1) * (self.every * self.dt)

    # State ---------------------------------------------------------------------------------------

    def state(self) -> Float[np.ndarray, " state"]:
        """Return the index of the next step, the simulator's state and the drive's, as one row."""
        return np.concatenate([[float(self.step)], self._physics(), self.drive.state])

    def restore(self, state: Float[np.ndarray, " state"]) -> None:
        """Continue from a state of a run of the same walk, bit by bit.

        Raises:
            InvalidInput: It is no state of this run.
        """
        state, own = numbers(state, "start"), self.state()
        last = self.steps // self.every * self.every
        if not (
            state.shape == own.shape
            and np.isfinite(state).all()
            and state[0] == round(state[0])
            and 0 <= state[0] <= last
        ):
            raise InvalidInput(
                f"start is no state of a run of this walk; it must be {len(own)} finite numbers, "
                f"the first of them a step from 0 to {last}, the last that is recorded.",
                hint="Run.state() of the same scenario and walk",
            )
        self.step = int(state[0])
        size = len(own) - len(self.drive.state)
        self._set_physics(state[1:size])
        self.drive.state[:] = state[size:]

    def _physics(self) -> Float[np.ndarray, " physics"]:
        import mujoco

        kind = mujoco.mjtState.mjSTATE_INTEGRATION
        state = np.empty(mujoco.mj_stateSize(self.model, kind))
        mujoco.mj_getState(self.model, self.data, state, kind)
        return state

    def _set_physics(self, state: Float[np.ndarray, " physics"]) -> None:
        import mujoco

        mujoco.mj_setState(self.model, self.data, state, mujoco.mjtState.mjSTATE_INTEGRATION)

    # Start ---------------------------------------------------------------------------------------

    def _commanding_walk(self) -> Walk | None:
        """Return the plan that tells where the robot should go, or None."""
        return self.walk if isinstance(self.walk, Walk) else None

    def _set_up(self) -> None:
        import mujoco

        self.model = build_model(self.experiment)
        self.data = mujoco.MjData(self.model)
        self.drive: Drive = _new_drive(self.experiment, self.model, self.data, self.walk)
        self.foot_ground = FootGround(self.model, self.data, self.robot, self.ground)

    def _place(self, start: SampledMotion) -> None:
        """Place the robot where the plan starts."""
        import mujoco

        data = self.data
        mujoco.mj_resetData(self.model, data)
        data.qpos[:3] = start.trunk.position[0]
        data.qpos[2] += start_offset(self.experiment, start)
        data.qpos[3:7] = start.trunk.quaternion[0]
        data.qpos[7:] = start.q[0].ravel()
        self.drive.command(self._still(start, 1)[0])
        if self.foot_ground.varies:
            self.foot_ground.update()
        mujoco.mj_forward(self.model, data)
        self.first = present_sample(self.model, data, self.drive)

    def _settle(self) -> Failure | None:
        """Let the robot come to rest on its feet, then give it the velocities of the plan."""
        start = self.walk.sample(np.zeros(1))
        still = self._still(start, BLOCK_STEPS)
        with collect_engine_warnings(self._warnings):
            for _ in range(math.ceil(SETTLING_TIME / self.dt / BLOCK_STEPS)):
                self._advance(still)
                failure = self._check(BLOCK_STEPS)
                if failure:
                    return replace(
                        failure, sample=0, reason=f"before its first step: {failure.reason}"
                    )
        self._set_going(start)
        return None

    def _still(self, start: SampledMotion, count: int) -> Float[np.ndarray, "samples joints"]:
        """Return the commands of joints that stay where they start, for a number of steps."""
        still = np.zeros_like(start.q)
        torque = None
        if self.experiment.solver.drive == "torque":
            torque = standing_torque(self.experiment, start)
        targets = self.drive.targets(Setpoints(start.q, still, still, torque))
        return np.repeat(targets, count, axis=0)

    def _set_going(self, start: SampledMotion) -> None:
        """Give the settled robot the position and velocities with which the plan starts."""
        data = self.data
        # On a slope it creeps while it settles; moved back, its feet would be in the ground.
        if self.ground.is_level:
            data.qpos[:2] = start.trunk.position[0, :2]
        data.qvel[:3] = start.trunk.velocity[0]
        # MuJoCo takes a free body's angular velocity in body axes.
        data.qvel[3:6] = start.trunk.rotation[0].T @ start.trunk.angular_velocity[0]
        data.qvel[6:] = start.qd[0].ravel()
        self.drive.begin(start.qd[0].ravel())
        data.time = 0.0

    # Plan ----------------------------------------------------------------------------------------

    def targets(self, start: int, stop: int) -> Shaped[np.ndarray, "..."]:
        """Return the commands of the drive at the steps from `start` to before `stop`, (N, 3 L)."""
        if self._cycle is not None:
            return self._cycle[np.arange(start, stop) % len(self._cycle)]
        return self._planned_targets(start, stop)

    def _planned_targets(self, start: int, stop: int) -> Float[np.ndarray, "samples joints"]:
        walk, torque = self.walk.sample(np.arange(start, stop) * self.dt), None
        if self.experiment.solver.drive == "torque":
            assert isinstance(walk, Walk)
            torque = walking_torque(self.experiment, walk)
        return self.drive.targets(Setpoints(walk.q, walk.qd, walk.qdd, torque))

    def _cycle_targets(self) -> Shaped[np.ndarray, "..."] | None:
        """Return the commands of one cycle, where it serves all and is a whole number of steps."""
        if not self.walk.is_periodic:
            return None
        cycle = self.experiment.course.stride.period / self.dt
        steps = round(cycle)
        if steps > LONGEST_CYCLE or abs(cycle - steps) > 1e-9 * cycle:
            return None
        return self._planned_targets(0, steps)

    # Steps ---------------------------------------------------------------------------------------

    def watch(self, watcher: Watcher, interval: float) -> None:
        """Pass on the samples that are recorded, block by block.

        Args:
            watcher: Receives each block's samples; the run waits for it.
            interval: Longest block, unless one step or update takes longer [s].
        """
        self._watcher = watcher
        self.block_steps = max(1, int(min(interval / self.dt + 1e-9, self.block_steps)))

    def advance(
        self,
        progress: Progress | None = None,
        *,
        keep: Keep | None = None,
        interrupted: Sequence[int] | None = None,
        until: int | None = None,
    ) -> Failure | None:
        """Run to the end, or to the first failure.

        Args:
            progress: Receives the simulated time [s].
            keep: Receives the recorded samples of each block; None: they go into `log`.
            interrupted: The run stops as soon as this is not empty, with the ending ``STOPPED``, at
                which the caller must look; None: Ctrl-C raises after the block.
            until: The step before which to pause; None: go to the end.

        Returns:
            What ended the run early; None where it was completed, or paused.

        Raises:
            KeyboardInterrupt: It was stopped by Ctrl-C.
        """
        if interrupted is None:
            with held_signals() as signals:
                return self.advance(progress, keep=keep, interrupted=signals, until=until)
        if keep is None:
            if len(self.log) != len(self.time):
                self.log = empty_samples(self.model, self.drive, len(self.time))
            keep = self._into_log
        end = self.steps + 1 if until is None else min(until, self.steps + 1)
        failure = self.failure
        with collect_engine_warnings(self._warnings):
            while self.step < end and failure is None and not self.ended:
                if interrupted:
                    failure = Failure(Ending.STOPPED, 0, f"at {self.step * self.dt:.3f} s")
                    break
                made = self._make_block(end, interrupted)
                failure = self._check(made)
                self._keep(self._finite(failure.sample) if failure else made, keep)
                if failure:
                    failure = self._with_time(failure)
                self.step += made
                if progress:
                    progress(min(self.step * self.dt, self.experiment.duration))
        if failure and self.done == 0:
            # A recording has at least one sample.
            keep(self.first)
            self.done = 1
        return failure

    def _make_block(self, end: int, interrupted: Sequence[int]) -> int:
        """Make the steps of one block, before step `end` at the latest; return their number."""
        del interrupted
        stop = min(self.step + self.block_steps, end)
        return self._advance(self.targets(self.step, stop), last=stop > self.steps)

    def _advance(
        self, targets: Float[np.ndarray, "samples joints"], *, at: int = 0, last: bool = False
    ) -> int:
        """Make one step per row of targets into the buffer from row `at` on; see `make_steps`."""
        made, self._step_error = make_steps(self, targets, self.buffer[at:], last=last)
        return made

    def _error(self) -> str:
        """Return why MuJoCo cannot go on: its error, its first warning, or nothing."""
        if self._warnings and self.data.warning.number.any():
            return f"the engine reports: {self._warnings[0]}"
        return self._step_error

    def _check(self, count: int) -> Failure | None:
        """Return the first failure in the buffer's first samples."""
        states = self.buffer["qpos"][:count], self.buffer["qvel"][:count]
        failure = None
        if count:
            failure = check_termination(self.robot, *states, self.ground, lies=self.lies)
        error = "" if failure else self._error()
        if error:
            failure = Failure(Ending.DIVERGED, max(0, count - 1), error)
        self._past.add(self.buffer[: failure.sample if failure else count])
        return self._past.explain(failure) if failure else None

    def _finite(self, sample: int) -> int:
        """Return how many of the buffer's samples to keep: up to one, if its state is finite."""
        state = self.buffer["qpos"][sample], self.buffer["qvel"][sample]
        return sample + all(np.isfinite(part).all() for part in state)

    def _with_time(self, failure: Failure) -> Failure:
        """Add time, place in the recording and drive failures to a failure in the buffer."""
        at = (self.step + failure.sample) * self.dt
        place = "at once"
        if self.done:
            kept = (self._begin + self.done - 1) * self.every * self.dt
            place = f"after the recording's last sample at {kept:.3f} s"
            if abs(kept - at) < self.dt / 2:
                place = "the recording's last sample"
        remark = self.drive.remark(self.buffer["drive"][failure.sample])
        reason = f"{remark}; {failure.reason}" if remark else failure.reason
        return replace(failure, reason=f"at {at:.3f} s, {place}: {reason}")

    def _keep(self, count: int, keep: Keep) -> None:
        """Pass on those of the buffer's first samples that are recorded."""
        rows = self.buffer[-self.step % self.every : count : self.every]
        if len(rows):
            keep(rows)
            self.done += len(rows)

    def _into_log(self, rows: Samples) -> None:
        self.log[self.done : self.done + len(rows)] = rows

    # Recording -----------------------------------------------------------------------------------

    def simulate(
        self, *, progress: Progress | None = None, interrupted: Sequence[int] | None = None
    ) -> Recording:
        """Make the run, recorded in memory.

        Args:
            progress: Receives the simulated time [s].
            interrupted: The run stops as soon as this is not empty; None: at Ctrl-C.

        Raises:
            InfeasibleLoad: The feet cannot give what the motion needs within the model's limits.
            KeyboardInterrupt: It was stopped.
        """
        # A plan whose load the feet cannot share is refused here.
        first = self.channels(self.first)
        blocks: list[dict[str, np.ndarray]] = []

        def keep(rows: Samples) -> None:
            blocks.append({name: a.copy() for name, a in self._watched(rows)[1].items()})

        with held_signals() if interrupted is None else nullcontext(interrupted) as signals:
            failure = self.advance(progress, keep=keep, interrupted=signals) or self.shortfall()
            _raise_if_stopped(failure)
        attributes = {**self.attributes(), **self._outcome(failure)}
        channels = {name: np.concatenate([each[name] for each in blocks]) for name in first}
        recording = new_recording(self.time[: self.done], channels, attributes)
        return with_sensors(self.experiment, recording)

    def record(
        self, path: str | Path, *, progress: Progress | None = None, force: bool = False
    ) -> Failure | None:
        """Make the run, recorded into a log file only, in memory that does not grow with it.

        Args:
            path: The log file.
            progress: Receives the simulated time [s].
            force: Whether an older file of that name is replaced.

        Returns:
            What ended the run early; None where it was completed.

        Raises:
            InfeasibleLoad: The feet cannot give what the motion needs within the model's limits.
            InvalidInput: The file exists and may not be replaced.
            OutputError: It cannot be written.
            KeyboardInterrupt: The run was stopped by Ctrl-C. The log is complete until then, and
                has the ending ``STOPPED``.
        """

        def keep(rows: Samples) -> None:
            log.append(*self._watched(rows))

        cut = {"ending": Ending.CUT.name, "ending_reason": Ending.CUT.value}
        attributes = {**self.attributes(), **cut}
        first = self.channels(self.first)
        with (
            held_signals() as signals,
            RecordingLog(path, first, attributes, time=self.time, force=force) as log,
        ):
            failure = self.advance(progress, keep=keep, interrupted=signals)
            failure = failure or self.shortfall()
            log.finish(self._outcome(failure))
            _raise_if_stopped(failure)
        return failure

    def _watched(self, rows: Samples) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Return times and channels of the samples that are recorded next, and pass them on."""
        time, channels = self.time[self.done : self.done + len(rows)], self.channels(rows)
        self.following.add(time, channels)
        if self._watcher:
            self._watcher(time, channels)
        return time, channels

    def make(self, *, progress: Progress | None, log: str | Path | None, force: bool) -> Recording:
        """Make the run, in memory or through a log; arguments as in `phasmid.simulate`."""
        if log is None:
            return self.simulate(progress=progress)
        self.record(log, progress=progress, force=force)
        return with_sensors(self.experiment, load_recording(log))

    def channels(self, samples: Samples) -> dict[str, np.ndarray]:
        """Return the channels of the samples that are recorded next, with those of the model.

        Raises:
            InfeasibleLoad: The feet cannot give what the motion needs within the model's limits.
        """
        walk, time = self.walk, self.time[self.done : self.done + len(samples)]
        model = walk.channels(time) if isinstance(walk, JointTrajectory) else self._model.at(time)
        return {**model, **sample_channels(self, samples)}

    @cached_property
    def _model(self) -> ModelReference:
        assert isinstance(self.walk, Walk)
        return ModelReference(self.experiment, self.walk, float(self.time[-1]))

    def attributes(self) -> Attributes:
        """Return the recording's attributes, except for how the run ended."""
        experiment, walk = self.experiment, self.walk
        attributes = {
            **recording_attributes(experiment, walk),
            "kind": "simulation",
            "drive": experiment.solver.planned_drive,
            "contact_law": experiment.world.contact.kind,
            "simulator": self.simulator,
            "time_step": experiment.solver.time_step,
            **versions(),
        }
        if isinstance(walk, JointTrajectory):
            attributes["trajectory"] = walk.to_text()
        if self._start is not None:
            state = np.asarray(self._start, "<f8").tobytes()
            attributes["start"] = base64.b64encode(state).decode()
        return attributes

    def final_attributes(self) -> Attributes:
        """Return attributes that are known at the end of the run only."""
        return {}

    def shortfall(self, command: Command | None = None, event: str = "") -> Failure | None:
        """Return why a run that came to its end did not do what it should, or None.

        Args:
            command: As in `shortfall_cause`.
            event: The controller's last event.
        """
        time = min(self.step, self.steps) * self.dt
        # The gait begins in the first cycle.
        if time < self.experiment.course.stride.period:
            return None
        found = shortfall_cause(self.experiment, self.following, command, event)
        if found is None:
            return None
        cause, remedy = found
        slide = self._past.slide()
        if slide is not None:
            cause, remedy = f"it slides, since {slide.cause}", slide.flatter(self.ground)
        return Failure(Ending.SHORT, self.step, f"in {time:.4g} s: {cause}", remedy)

    def _outcome(self, failure: Failure | None) -> Attributes:
        return {**ending_attributes(failure), **self.final_attributes()}


def _new_drive(
    experiment: Experiment, model: mujoco.MjModel, data: mujoco.MjData, walk: Motion
) -> Drive:
    kind = experiment.solver.planned_drive
    if kind == "servo":
        return ServoDrive(model, data, walk)
    if kind == "torque":
        return TorqueDrive(model, data, walk, experiment)
    return (PrescribedDrive if kind == "prescribed" else IdealServoDrive)(model, data, walk)


def _raise_if_stopped(failure: Failure | None) -> None:
    """Raise KeyboardInterrupt with the sentence of a run that was stopped: it is no result."""
    if failure is not None and failure.ending is Ending.STOPPED:
        raise KeyboardInterrupt(failure.sentence)
