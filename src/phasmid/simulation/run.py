"""The run of a walk in the physics engine."""

from __future__ import annotations

import base64
import math
import platform
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.forces.analysis import model_channels, recording_attributes
from phasmid.kinematics import quaternion_rotation
from phasmid.motion import Walk
from phasmid.recording import Recording, RecordingLog, load_recording, new_recording
from phasmid.robot import Robot
from phasmid.scenario import SETTLING_TIME, Scenario
from phasmid.sensors import sense
from phasmid.simulation.complaint import collected_complaints
from phasmid.simulation.contact import SOFT_TIME
from phasmid.simulation.drive import Drive, IdealServoDrive, PrescribedDrive
from phasmid.simulation.ending import Ending, Trouble, watch
from phasmid.simulation.ground import Footing
from phasmid.simulation.interrupt import noticed_interrupts
from phasmid.simulation.model import build_model
from phasmid.simulation.servo import ServoDrive
from phasmid.simulation.start import check_start, raised
from phasmid.terrain import Ground

if TYPE_CHECKING:
    import mujoco

WATCH_STEPS = 512
"""Steps between two looks of the watch, which sees every step in between."""

PLAN_STEPS = 32 * WATCH_STEPS
"""Steps for which the plan is evaluated at once, so that long runs do not fill the memory."""

Progress = Callable[[float], None]
"""Is told now and then how many seconds of the walk are done."""


def simulate(
    scenario: Scenario,
    walk: Walk,
    *,
    progress: Progress | None = None,
    log: str | Path | None = None,
    force: bool = False,
    start: Float[np.ndarray, " state"] | None = None,
) -> Recording:
    """Run a walk in the physics engine.

    The robot starts at rest on its feet, in equilibrium. Interrupting the run (Ctrl-C) ends it
    and keeps what was recorded.

    Args:
        scenario: Its simulation, contact and terrain are used.
        walk: The plan that the joints follow.
        progress: Is told how far the run is.
        log: A file, by custom ``.rec``, that is written while the run goes on and outlives a
            killed process; `phasmid.load_recording` reads it.
        force: Whether an older file of that name is replaced.
        start: A state of an earlier run of the same walk, from `Run.state`, to go on from.

    Returns:
        What physics made of the walk, beside the model's torques and forces at the same instants.
        How the run ended is in the attributes ``ending`` and ``ending_reason``.

    Raises:
        InvalidInput: The time step cannot resolve the contact, or the walk was planned for another
            robot, gait or stride, or starts with a foot below the terrain, or the start is none
            of its states, or the log exists.
        InfeasibleLoad: The feet cannot give what the motion needs within the force model's limits.
        OutputError: The log cannot be written; what it holds until then can be read.
    """
    if log is not None:
        record(scenario, walk, log, progress=progress, force=force, start=start)
        return with_sensors(scenario, load_recording(log))
    with noticed_interrupts() as interrupted:
        return simulate_part(
            scenario, walk, progress=progress, start=start, interrupted=interrupted
        )


def simulate_part(
    scenario: Scenario,
    walk: Walk,
    samples: int | None = None,
    *,
    progress: Progress | None = None,
    start: Float[np.ndarray, " state"] | None = None,
    interrupted: Sequence[int] = (),
) -> Recording:
    """Run a walk as `simulate` does, or its beginning alone.

    Args:
        scenario: As in `simulate`.
        walk: As in `simulate`.
        samples: How many to record at most; None: all.
        progress: As in `simulate`.
        start: As in `simulate`.
        interrupted: The run is stopped as soon as this is not empty.

    Raises:
        InvalidInput: As in `simulate`.
        InfeasibleLoad: As in `simulate`.
    """
    run, model = _prepare(scenario, walk, start)
    until = None if samples is None else run.step_of(samples - 1) + 1
    trouble = run.advance(progress, interrupted=interrupted, until=until)
    n = run.done
    channels = _channels(run, run.log.part(slice(0, n)), model, slice(0, n))
    attributes = _attributes(scenario, walk, run) | _ending(trouble)
    return with_sensors(scenario, new_recording(run.time[:n], channels, attributes))


def with_sensors(scenario: Scenario, recording: Recording) -> Recording:
    """A recording with what its sensors would have told, where the scenario asks for that.

    A log does not hold it, since it follows from the rest.
    """
    wanted = scenario.sensors.measured == "everything"
    return sense(scenario, recording) if wanted else recording


def record(
    scenario: Scenario,
    walk: Walk,
    path: str | Path,
    *,
    progress: Progress | None = None,
    force: bool = False,
    start: Float[np.ndarray, " state"] | None = None,
) -> Trouble | None:
    """Run a walk as `simulate` does, into a log file alone, in memory that does not grow with it.

    Args:
        scenario: As in `simulate`.
        walk: As in `simulate`.
        path: The log file.
        progress: As in `simulate`.
        force: As in `simulate`.
        start: As in `simulate`.

    Returns:
        What ended the run early; None where it was completed.

    Raises:
        InvalidInput: As in `simulate`.
        InfeasibleLoad: As in `simulate`.
        OutputError: As in `simulate`.
    """
    run, model = _prepare(scenario, walk, start)
    done = 0

    def keep(rows: Samples) -> None:
        nonlocal done
        part = slice(done, done + len(rows.qpos))
        log.append(run.time[part], _channels(run, rows, model, part))
        done = part.stop

    first = _channels(run, run.first, model, slice(0, 1))
    attributes = _attributes(scenario, walk, run) | {
        "ending": Ending.CUT.name,
        "ending_reason": Ending.CUT.value,
    }
    with (
        noticed_interrupts() as interrupted,
        RecordingLog(path, first, attributes, time=run.time, force=force) as log,
    ):
        trouble = run.advance(progress, keep=keep, interrupted=interrupted)
        log.finish(_ending(trouble))
    return trouble


def _prepare(
    scenario: Scenario, walk: Walk, start: Float[np.ndarray, " state"] | None
) -> tuple[Run, dict[str, np.ndarray]]:
    """The run, ready to start, and the model's channels at all of its samples."""
    walk.check_planned_for(scenario)
    check_time_step(scenario, walk.robot)
    if start is None:
        check_start(scenario, walk)
    run = new_run(scenario, walk, start=start)
    # Before the run: what the feet cannot share is refused at once, and an interrupted run has
    # little left to do.
    return run, model_channels(scenario, walk.sample(run.time))


def new_run(
    scenario: Scenario, walk: Walk, *, start: Float[np.ndarray, " state"] | None = None
) -> Run:
    """The run of a walk, about to start, in the simulator that knows the contact law.

    Args:
        scenario: As in `simulate`.
        walk: As in `simulate`.
        start: As in `simulate`.

    Raises:
        InvalidInput: That simulator cannot do something else that the scenario asks for, or the
            start is none of its states.
    """
    if scenario.contact.contact_law != "simscape":
        return Run(scenario, walk, start=start)
    # Here, since it readies its loops for the compiler when it is first imported.
    from phasmid.simulation.prescribed.run import TrunkRun

    return TrunkRun(scenario, walk, start=start)


def check_time_step(scenario: Scenario, robot: Robot) -> None:
    """Refuse a time step that cannot resolve the contact.

    Raises:
        InvalidInput: With the longest one that can.
    """
    longest = longest_time_step(scenario, robot.mass)
    if scenario.simulation.dt > longest:
        raise InvalidInput(
            f"--dt {scenario.simulation.dt:g} s cannot resolve this contact "
            f"(needs <= {longest:.2g} s).",
            hint=f"--dt {longest / 2:.1g}",
        )


def check_load(scenario: Scenario, walk: Walk) -> None:
    """Refuse a walk whose load the scenario's force model cannot share.

    Where all cycles are alike, one of them is looked at.

    Raises:
        InvalidInput: The load transfer takes longer than the gait allows.
        InfeasibleLoad: The feet cannot give what the motion needs within the model's limits.
    """
    interval = scenario.simulation.dt * scenario.record_steps
    period, duration = scenario.stride.period, scenario.duration
    for start in np.arange(0.0, period if walk.is_periodic else duration, period):
        stop = min(start + period, duration)
        model_channels(scenario, walk.sample(np.arange(start, stop, interval)))


def longest_time_step(scenario: Scenario, mass: float) -> float:
    """Longest time step that resolves the contact of a robot on three feet [s].

    Args:
        scenario: Its contact is used.
        mass: Of the robot [kg].
    """
    if scenario.contact.contact_law == "mujoco":
        # With longer ones the engine would make its contact softer by itself.
        return SOFT_TIME / 2
    # Each of twelve points carries its share of the mass. The engine takes a contact's spring and
    # damper at the start of a step, which is stable up to twice the time returned here.
    share = mass / 12
    frequency = math.sqrt(scenario.contact.stiffness / share)
    ratio = scenario.contact.law_damping / (2 * math.sqrt(scenario.contact.stiffness * share))
    return (math.sqrt(ratio**2 + 1) - ratio) / frequency


class Run:
    """A walk in the engine, step by step.

    Attributes:
        model: The engine's model.
        data: The engine's state.
        steps: Number of steps.
        step: The next of them.
        time: Of all samples that are to be recorded [s], shape (N,).
        first: The state in which the robot is put, before it settles.
        log: Samples of the run, where they are kept in memory.
        done: Number of samples recorded.
        simulator: What makes the steps.
    """

    simulator = "MuJoCo"

    def __init__(
        self,
        scenario: Scenario,
        walk: Walk,
        *,
        start: Float[np.ndarray, " state"] | None = None,
    ) -> None:
        self.scenario, self.walk, self.robot = scenario, walk, walk.robot
        self.dt = scenario.simulation.dt
        self.steps = max(1, round(scenario.duration / self.dt))
        self.every = scenario.record_steps
        self.ground = scenario.load_terrain()
        self._set_up()
        self.buffer = Samples.empty(self.model, self.drive, WATCH_STEPS)
        self.log = Samples.empty(self.model, self.drive, 0)
        self.done = self.step = 0
        self.trouble: Trouble | None = None
        self._one_cycle = self._repeated_targets()
        self._complaints: list[str] = []
        self._rows = self.buffer.rows()
        self._place(walk.sample(np.zeros(1)))
        if start is None:
            self.trouble = self._settle()
        else:
            self.restore(start)
        self._start = start
        begin = -(-self.step // self.every)
        self.time = np.arange(begin, self.steps // self.every + 1) * (self.every * self.dt)

    def _set_up(self) -> None:
        """Build what is simulated."""
        import mujoco

        self.model = build_model(self.robot, self.scenario)
        self.data = mujoco.MjData(self.model)
        self.drive: Drive = _drive(self.scenario, self.model, self.data, self.walk)
        self.footing = Footing(self.model, self.data, self.robot, self.ground)
        arrays = (self.data.qpos, self.data.qvel, self.data.sensordata, self.drive.state)
        self._views = tuple(array.data for array in arrays)

    def state(self) -> Float[np.ndarray, " state"]:
        """All that the rest of the run depends on, one row of numbers; see `restore`.

        The numbers are the next step's index, the engine's state and the drive's.
        """
        return np.concatenate([[float(self.step)], self._physics(), self.drive.state])

    def _physics(self) -> Float[np.ndarray, " physics"]:
        """The engine's state."""
        import mujoco

        kind = mujoco.mjtState.mjSTATE_INTEGRATION
        engine = np.empty(mujoco.mj_stateSize(self.model, kind))
        mujoco.mj_getState(self.model, self.data, engine, kind)
        return engine

    def _set_physics(self, state: Float[np.ndarray, " physics"]) -> None:
        """Give the engine a state."""
        import mujoco

        mujoco.mj_setState(self.model, self.data, state, mujoco.mjtState.mjSTATE_INTEGRATION)

    def restore(self, state: Float[np.ndarray, " state"]) -> None:
        """Go back, or forth, to a state of a run of the same walk; what follows is the same.

        Args:
            state: From `state`.

        Raises:
            InvalidInput: It is no state of this run.
        """
        size, own = len(self._physics()), len(self.drive.state)
        state = np.asarray(state, dtype=np.float64)
        if state.shape != (1 + size + own,) or not np.isfinite(state).all():
            raise InvalidInput(
                f"start has shape {state.shape}; it must be {1 + size + own} finite numbers, "
                "a state of a run of this walk.",
                hint="Run.state() of the same scenario and walk",
            )
        if not (state[0] == round(state[0]) and 0 <= state[0] <= self.steps):
            raise InvalidInput(
                f"start is at step {state[0]:g}; it must be one of 0 to {self.steps}.",
                hint="a longer duration",
            )
        self.step = int(state[0])
        self._set_physics(state[1 : 1 + size])
        self.drive.state[:] = state[1 + size :]

    def step_of(self, sample: int) -> int:
        """Index of the step at which a sample is recorded."""
        return round(float(self.time[0]) / self.dt) + sample * self.every

    def start_attribute(self) -> dict[str, str]:
        """The state that the run was begun from, for a recording's attributes."""
        if self._start is None:
            return {}
        return {"start": base64.b64encode(np.asarray(self._start, "<f8").tobytes()).decode()}

    def targets(self, start: int, stop: int) -> Float[np.ndarray, "samples joints"]:
        """What the drive is told at the steps from one to before another, shape (N, 3 L)."""
        if self._one_cycle is not None:
            return self._one_cycle[np.arange(start, stop) % len(self._one_cycle)]
        return self._planned_targets(start, stop)

    def _planned_targets(self, start: int, stop: int) -> Float[np.ndarray, "samples joints"]:
        """The targets of some steps, evaluated from the plan."""
        return self.drive.targets(self.walk.sample(np.arange(start, stop) * self.dt), self.dt)

    def _repeated_targets(self) -> Float[np.ndarray, "samples joints"] | None:
        """The targets of one cycle, where it is a whole number of steps and not too many.

        Where all cycles are alike, seen from the body, these serve them all.
        """
        if not self.walk.is_periodic:
            return None
        cycle = self.scenario.stride.period / self.dt
        steps = round(cycle)
        if steps > PLAN_STEPS or abs(cycle - steps) > 1e-9 * cycle:
            return None
        return self._planned_targets(0, steps)

    def _place(self, start: Walk) -> None:
        """Put the robot where the plan starts."""
        import mujoco

        data = self.data
        mujoco.mj_resetData(self.model, data)
        data.qpos[:3] = start.trunk.position[0]
        data.qpos[2] += raised(self.scenario, start)
        data.qpos[3:7] = start.trunk.quaternion[0]
        data.qpos[7:] = start.q[0].ravel()
        self.drive.command(start.q[0].ravel())
        if self.footing.needed:
            self.footing.follow()
        mujoco.mj_forward(self.model, data)
        self.first = Samples.empty(self.model, self.drive, 1)
        self.first.write(0, data, self.drive)

    def _settle(self) -> Trouble | None:
        """Let the robot come to rest on its feet, then set it going as the plan does."""
        start = self.walk.sample(np.zeros(1))
        still = self._still(start, WATCH_STEPS)
        for _ in range(math.ceil(SETTLING_TIME / self.dt / WATCH_STEPS)):
            self._advance(still)
            trouble = self._look(WATCH_STEPS)
            if trouble:
                return Trouble(trouble.ending, 0, f"before its first step: {trouble.reason}")
        self._set_going(start)
        return None

    def _still(self, start: Walk, count: int) -> Float[np.ndarray, "samples joints"]:
        """Targets of joints that stay where they start, for a number of steps."""
        return np.repeat(start.q.reshape(1, -1), count, axis=0)

    def _set_going(self, start: Walk) -> None:
        """Give the robot at rest the place and the speeds with which the plan starts."""
        data = self.data
        # On a slope it creeps meanwhile; put back, its feet would stand in the ground.
        if self.ground.is_level:
            data.qpos[:2] = start.trunk.position[0, :2]
        data.qvel[:3] = start.trunk.velocity[0]
        # The engine takes a free body's angular velocity in the body's own axes.
        data.qvel[3:6] = start.trunk.rotation[0].T @ start.trunk.angular_velocity[0]
        data.qvel[6:] = start.qd[0].ravel()
        self.drive.begin(start.qd[0].ravel())
        data.time = 0.0

    def advance(
        self,
        progress: Progress | None = None,
        *,
        keep: Keep | None = None,
        interrupted: Sequence[int] = (),
        until: int | None = None,
    ) -> Trouble | None:
        """Run to the end, or to the first trouble.

        Args:
            progress: Is told how far the run is.
            keep: Takes the recorded samples of each block of steps; they go into `log` where None.
            interrupted: The run is stopped as soon as this is not empty.
            until: The step before which to pause; None: go to the end.

        Returns:
            What ended the run early; None where it was completed, or paused.
        """
        keep = keep or self._into_log()
        end = self.steps + 1 if until is None else min(until, self.steps + 1)
        trouble, targets, chunk = self.trouble, np.empty((0, 0)), -1
        while self.step < end and trouble is None:
            if self.step // PLAN_STEPS != chunk:
                chunk = self.step // PLAN_STEPS
                first = chunk * PLAN_STEPS
                targets = self.targets(first, min(first + PLAN_STEPS, self.steps + 1))
            begin = self.step - chunk * PLAN_STEPS
            block = targets[begin : begin + min(WATCH_STEPS, end - self.step)]
            made = self._advance(
                block, last=self.step + len(block) > self.steps, interrupted=interrupted
            )
            trouble = self._look(made)
            self._keep(self._finite(trouble.sample) if trouble else made, keep)
            if trouble:
                trouble = self._placed(trouble)
            self.step += made
            if progress:
                progress(min(self.step * self.dt, self.scenario.duration))
            if interrupted and trouble is None and self.step < end:
                trouble = Trouble(Ending.STOPPED, self.step, f"at {self.step * self.dt:.3f} s")
        if trouble and self.done == 0:
            # There shall be something to look at.
            keep(self.first)
            self.done = 1
        return trouble

    def _finite(self, sample: int) -> int:
        """Number of the buffer's samples up to and with one, or before it where it is no number."""
        state = self.buffer.qpos[sample], self.buffer.qvel[sample]
        return sample + all(np.isfinite(part).all() for part in state)

    def _placed(self, trouble: Trouble) -> Trouble:
        """What the watch found in the buffer, with its time and its place in the recording."""
        at = (self.step + trouble.sample) * self.dt
        kept = self.time[self.done - 1] if self.done else math.nan
        place = (
            "the recording's last sample"
            if abs(kept - at) < self.dt / 2
            else (f"after the recording's last sample at {kept:.3f} s" if self.done else "at once")
        )
        remark = self.drive.remark(self.buffer.drive[trouble.sample])
        reason = f"{remark}; {trouble.reason}" if remark else trouble.reason
        return replace(trouble, reason=f"at {at:.3f} s, {place}: {reason}")

    def _into_log(self) -> Keep:
        """What keeps samples in memory."""
        if len(self.log.qpos) != len(self.time):
            self.log = Samples.empty(self.model, self.drive, len(self.time))
        return lambda rows: self.log.put(self.done, rows)

    def _look(self, count: int) -> Trouble | None:
        """What the watch finds in the buffer's first samples, and what the engine complained of."""
        seen = self.buffer.qpos[:count], self.buffer.qvel[:count]
        trouble = watch(self.robot, *seen, self.ground) if count else None
        if trouble:
            return trouble
        if self._complaints:
            said = f"the engine says: {self._complaints[0]}"
            return Trouble(Ending.DIVERGED, max(0, count - 1), said)
        return None

    # A state that is not finite is for the watch to find.
    @np.errstate(invalid="ignore", over="ignore")
    def _advance(
        self,
        targets: Float[np.ndarray, "samples joints"],
        *,
        last: bool = False,
        interrupted: Sequence[int] = (),
    ) -> int:
        """Make a step for each target; what the engine measured goes into the buffer's start.

        Args:
            targets: What the drive is told at each step, at most as many as the buffer holds.
            last: Whether the last of them is the walk's end, which is measured and not stepped.
            interrupted: No further step is begun once this is not empty.

        Returns:
            Number of steps that were made.
        """
        import mujoco

        # All names are local, and views of memory are copied, which is quicker than arrays: the
        # loop below is the simulation's whole cost beside the engine.
        model, data, step, end = self.model, self.data, mujoco.mj_step, len(targets) - last
        command, torque = self.drive.command, self.drive.torque
        follow = self.footing.follow if self.footing.needed else None
        qpos, qvel, sensors, state = self._views
        made = 0
        with collected_complaints(self._complaints):
            try:
                for target, to_qpos, to_qvel, to_sensors, to_torque, to_state in zip(
                    targets, *self._rows, strict=False
                ):
                    if interrupted:
                        break
                    to_qpos[:] = qpos
                    to_qvel[:] = qvel
                    command(target)
                    if follow:
                        follow()
                    if made == end:
                        step = mujoco.mj_forward
                    step(model, data)
                    to_sensors[:] = sensors
                    to_torque[:] = torque()
                    if state:
                        to_state[:] = state
                    made += 1
            except mujoco.FatalError as error:
                self._complaints.append(" ".join(str(error).split()))
        return made

    def _keep(self, count: int, keep: Keep) -> None:
        """Hand on those of the buffer's first samples that are recorded."""
        rows = self.buffer.part(slice(-self.step % self.every, count, self.every))
        if len(rows.qpos):
            keep(rows)
            self.done += len(rows.qpos)


def _drive(scenario: Scenario, model: mujoco.MjModel, data: mujoco.MjData, walk: Walk) -> Drive:
    """What moves the joints in this scenario."""
    kind = scenario.simulation.drive
    if kind == "servo":
        return ServoDrive(model, data, walk, scenario)
    return (PrescribedDrive if kind == "prescribed" else IdealServoDrive)(model, data, walk)


@dataclass(frozen=True, eq=False)
class Samples:
    """What the engine says at each sample, in its own order."""

    qpos: Float[np.ndarray, "samples q"]
    qvel: Float[np.ndarray, "samples v"]
    sensors: Float[np.ndarray, "samples sensors"]
    torque: Float[np.ndarray, "samples joints"]
    drive: Float[np.ndarray, "samples state"]

    @classmethod
    def empty(cls, model: mujoco.MjModel, drive: Drive, samples: int) -> Samples:
        """Room for a number of samples."""
        widths = (model.nq, model.nv, model.nsensordata, model.nv - 6, len(drive.state))
        return cls(*(np.empty((samples, width)) for width in widths))

    def part(self, which: slice) -> Samples:
        """Some of the samples, in the same memory."""
        return Samples(*(getattr(self, field.name)[which] for field in fields(self)))

    def put(self, at: int, samples: Samples) -> None:
        """Copy samples to a place in these."""
        for field in fields(self):
            rows = getattr(samples, field.name)
            getattr(self, field.name)[at : at + len(rows)] = rows

    def rows(self) -> list[list[Any]]:
        """Memory of each sample, field by field; that of the torques as arrays."""
        return [
            [array[k] if field.name == "torque" else array[k].data for k in range(len(array))]
            for field, array in ((field, getattr(self, field.name)) for field in fields(self))
        ]

    def write(self, row: int, data: mujoco.MjData, drive: Drive) -> None:
        """Write one sample as the engine stands."""
        self.qpos[row], self.qvel[row] = data.qpos, data.qvel
        self.sensors[row], self.torque[row] = data.sensordata, drive.torque()
        self.drive[row] = drive.state


Keep = Callable[[Samples], None]
"""Takes samples that are recorded, in their order; their memory is used again afterwards."""


def _channels(
    run: Run, log: Samples, model: dict[str, np.ndarray], part: slice
) -> dict[str, np.ndarray]:
    """The engine's samples and the model's figures under the names of the house.

    Args:
        run: Whose samples they are.
        log: The samples.
        model: The model's channels at all samples of the run.
        part: Which of these the samples are.
    """
    legs, n = len(run.robot.legs), len(log.qpos)
    contact = log.sensors[:, : 4 * legs].reshape(n, legs, 4)
    force = contact[..., 1:]
    position = log.sensors[:, 4 * legs :].reshape(n, legs, 3)
    channels = {name: values[part] for name, values in model.items()} | {
        "joint_position": log.qpos[:, 7:].reshape(n, legs, 3),
        "joint_velocity": log.qvel[:, 6:].reshape(n, legs, 3),
        "joint_torque": log.torque.reshape(n, legs, 3),
        "foot_force": force,
        "foot_normal_force": _normal_part(force, position, run.ground),
        "foot_position": position,
        "contact": contact[..., 0] > 0,
        "body_position": log.qpos[:, :3],
        "body_velocity": log.qvel[:, :3],
        "body_orientation": log.qpos[:, 3:7],
        # The engine keeps a free body's angular velocity in its own axes.
        "body_angular_velocity": np.einsum(
            "tij,tj->ti", quaternion_rotation(log.qpos[:, 3:7]), log.qvel[:, 3:6]
        ),
    }
    return channels | run.drive.channels(log.drive)


@cache
def versions() -> dict[str, str]:
    """What a run's bits depend on besides its scenario and its robot, by attribute."""
    import mujoco

    try:
        numba = version("numba")
    except PackageNotFoundError:
        numba = "none"
    return {
        "phasmid_version": version("phasmid"),
        "mujoco_version": mujoco.__version__,
        "numpy_version": np.__version__,
        "numba_version": numba,
        "machine": f"{platform.system()} {platform.machine()}",
    }


def _attributes(scenario: Scenario, walk: Walk, run: Run) -> dict[str, str | int | float]:
    """What a recording says of its run, but for how it ended."""
    return (
        recording_attributes(scenario, walk)
        | {
            "kind": "simulation",
            "drive": scenario.simulation.drive,
            "contact_law": scenario.contact.contact_law,
            "simulator": run.simulator,
            "time_step": scenario.simulation.dt,
        }
        | versions()
        | run.start_attribute()
    )


def _ending(trouble: Trouble | None) -> dict[str, str | int | float]:
    """How a run ended, in a recording's attributes."""
    ending = trouble.ending if trouble else Ending.COMPLETED
    reason = trouble.sentence if trouble else ending.value
    return {"ending": ending.name, "ending_reason": reason}


def _normal_part(
    force: Float[np.ndarray, "time legs 3"],
    position: Float[np.ndarray, "time legs 3"],
    ground: Ground,
) -> Float[np.ndarray, "time legs"]:
    """Part of the forces along the ground's normal at the feet [N]."""
    if ground.is_level:
        return force[..., 2]
    normal = ground.normal(position[..., 0], position[..., 1])
    return np.einsum("tlk,tlk->tl", force, normal)
