"""The run of a walk in the physics engine."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.forces.analysis import model_channels, recording_attributes
from phasmid.kinematics import quaternion_rotation, yaw_quaternion
from phasmid.motion import Walk
from phasmid.recording import Recording, new_recording
from phasmid.robot import Robot
from phasmid.scenario import SETTLING_TIME, Scenario
from phasmid.sensors import measured_channels
from phasmid.simulation.drive import Drive, IdealServoDrive, PrescribedDrive
from phasmid.simulation.ending import Ending, Trouble, watch
from phasmid.simulation.model import build_model

if TYPE_CHECKING:
    import mujoco

WATCH_STEPS = 512
"""Steps between two looks of the watch, which sees every step in between."""

PLAN_STEPS = 32 * WATCH_STEPS
"""Steps for which the plan is evaluated at once, so that long runs do not fill the memory."""

Progress = Callable[[float], None]
"""Is told now and then how many seconds of the walk are done."""


def simulate(scenario: Scenario, walk: Walk, *, progress: Progress | None = None) -> Recording:
    """Run a walk in the physics engine.

    The robot starts at rest on its feet, in equilibrium. Interrupting the run (Ctrl-C) ends it
    and keeps what was recorded.

    Args:
        scenario: Its simulation, contact and terrain are used.
        walk: The plan that the joints follow.
        progress: Is told how far the run is.

    Returns:
        What physics made of the walk, beside the model's torques and forces at the same instants.
        How the run ended is in the attributes ``ending`` and ``ending_reason``.

    Raises:
        InvalidInput: The time step cannot resolve the contact, or the walk was planned for another
            robot, gait or stride.
        InfeasibleLoad: The feet cannot give what the motion needs within the force model's limits.
    """
    walk.check_planned_for(scenario)
    check_time_step(scenario, walk.robot)
    run = Run(scenario, walk)
    time = np.arange(run.steps // run.every + 1) * (run.every * scenario.simulation.dt)
    # Before the run: what the feet cannot share is refused at once, and an interrupted run has
    # little left to do.
    model = model_channels(scenario, walk.sample(time))
    trouble = run.advance(progress)
    return _record(scenario, walk, run, trouble, time, model)


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
    """Refuse a walk whose load the scenario's force model cannot share, by a look at one cycle.

    Raises:
        InvalidInput: The load transfer takes longer than the gait allows.
        InfeasibleLoad: The feet cannot give what the motion needs within the model's limits.
    """
    # Seen from the body all cycles are alike.
    interval = scenario.simulation.dt * scenario.record_steps
    duration = min(scenario.duration, scenario.stride.period)
    model_channels(scenario, walk.sample(np.arange(0.0, duration, interval)))


def longest_time_step(scenario: Scenario, mass: float) -> float:
    """Longest time step that resolves the contact of a robot on three feet [s].

    Args:
        scenario: Its contact is used.
        mass: Of the robot [kg].
    """
    # Each of twelve points carries its share of the mass. The engine takes a contact's spring and
    # damper at the start of a step, which is stable up to twice the time returned here.
    share = mass / 12
    frequency = math.sqrt(scenario.contact.stiffness / share)
    ratio = scenario.contact.damping / (2 * math.sqrt(scenario.contact.stiffness * share))
    return (math.sqrt(ratio**2 + 1) - ratio) / frequency


class Run:
    """A walk in the engine, step by step, with the log of every step.

    Attributes:
        model: The engine's model.
        data: The engine's state.
        steps: Number of steps.
        done: Number of samples logged, at least the first.
    """

    def __init__(self, scenario: Scenario, walk: Walk) -> None:
        import mujoco

        self.scenario, self.walk, self.robot = scenario, walk, walk.robot
        self.dt = scenario.simulation.dt
        self.steps = max(1, round(scenario.duration / self.dt))
        self.every = scenario.record_steps
        self.model = build_model(walk.robot, scenario)
        self.data = mujoco.MjData(self.model)
        prescribed = scenario.simulation.drive == "prescribed"
        kind = PrescribedDrive if prescribed else IdealServoDrive
        self.drive: Drive = kind(self.model, self.data, walk)
        self.log = _Log.empty(self.model, self.drive, self.steps // self.every + 1)
        self.buffer = _Log.empty(self.model, self.drive, WATCH_STEPS)
        self.done = 0
        self._one_cycle = self._repeated_targets()
        with _engine_warnings() as warnings:
            self._place(walk.sample(np.zeros(1)))
            self.trouble = self._settle(warnings)

    def targets(self, start: int, stop: int) -> Float[np.ndarray, "samples joints"]:
        """What the drive is told at the steps from one to before another, shape (N, 3 L)."""
        if self._one_cycle is not None:
            return self._one_cycle[np.arange(start, stop) % len(self._one_cycle)]
        return self.drive.targets(self.walk.sample(np.arange(start, stop) * self.dt), self.dt)

    def _repeated_targets(self) -> Float[np.ndarray, "samples joints"] | None:
        """The targets of one cycle, where it is a whole number of steps and not too many.

        Seen from the body all cycles are alike, so these serve them all.
        """
        cycle = self.scenario.stride.period / self.dt
        steps = round(cycle)
        if steps > PLAN_STEPS or abs(cycle - steps) > 1e-9 * cycle:
            return None
        return self.drive.targets(self.walk.sample(np.arange(steps) * self.dt), self.dt)

    def _place(self, start: Walk) -> None:
        """Put the robot where the plan starts, and log that as the first sample."""
        import mujoco

        data = self.data
        mujoco.mj_resetData(self.model, data)
        data.qpos[:3] = start.trunk.position[0]
        data.qpos[3:7] = yaw_quaternion(start.trunk.yaw)[0]
        data.qpos[7:] = start.q[0].ravel()
        self.drive.command(start.q[0].ravel())
        mujoco.mj_forward(self.model, data)
        self.buffer.write(0, data, self.drive)
        self._keep(0, 1)

    def _settle(self, warnings: list[str]) -> Trouble | None:
        """Let the robot come to rest on its feet, then set it going as the plan does."""
        start, data = self.walk.sample(np.zeros(1)), self.data
        still = np.repeat(start.q.reshape(1, -1), WATCH_STEPS, axis=0)
        for _ in range(math.ceil(SETTLING_TIME / self.dt / WATCH_STEPS)):
            self._advance(still)
            trouble = self._look(WATCH_STEPS, warnings)
            if trouble:
                return Trouble(trouble.ending, 0, f"before its first step {trouble.reason}")
        data.qpos[:2] = start.trunk.position[0, :2]
        data.qvel[:3] = start.trunk.velocity[0]
        data.qvel[3:6] = [0.0, 0.0, start.trunk.yaw_rate[0]]
        data.qvel[6:] = start.qd[0].ravel()
        data.time = 0.0
        self.done = 0
        return None

    def advance(self, progress: Progress | None = None) -> Trouble | None:
        """Run to the end, or to the first trouble.

        Returns:
            What ended the run early; None where it was completed.
        """
        if self.trouble:
            return self.trouble
        start, targets = 0, np.empty((0, 0))
        try:
            with _engine_warnings() as warnings:
                while start <= self.steps:
                    if start % PLAN_STEPS == 0:
                        targets = self.targets(start, min(start + PLAN_STEPS, self.steps + 1))
                    first = start % PLAN_STEPS
                    block = targets[first : first + WATCH_STEPS]
                    stop = start + len(block)
                    self._advance(block, last=stop > self.steps)
                    trouble = self._look(len(block), warnings)
                    if trouble:
                        self._keep(start, start + trouble.sample)
                        at = (start + trouble.sample) * self.dt
                        return Trouble(trouble.ending, self.done, f"at {at:.3f} s {trouble.reason}")
                    self._keep(start, stop)
                    start = stop
                    if progress:
                        progress(min(self.data.time, self.scenario.duration))
        except KeyboardInterrupt:
            # The last step may have moved the state without its row being written.
            self._keep(start, max(start, round(self.data.time / self.dt) - 1))
            return Trouble(Ending.STOPPED, self.done, f"at {self.data.time:.3f} s")
        return None

    def _look(self, count: int, warnings: list[str]) -> Trouble | None:
        """What the watch finds in the buffer's first samples, and what the engine complained of."""
        trouble = watch(self.robot, self.buffer.qpos[:count], self.buffer.qvel[:count])
        if trouble is None and warnings:
            return Trouble(Ending.DIVERGED, count, f"the engine says: {warnings[0]}")
        return trouble

    def _advance(self, targets: Float[np.ndarray, "samples joints"], *, last: bool = False) -> None:
        """Make a step for each target; what the engine measured goes into the buffer's start.

        Args:
            targets: What the drive is told at each step, at most as many as the buffer holds.
            last: Whether the last of them is the walk's end, which is measured and not stepped.
        """
        import mujoco

        # All names are local: the loop below is the simulation's whole cost beside the engine.
        model, data, log = self.model, self.data, self.buffer
        command, torque = self.drive.command, self.drive.torque
        qpos, qvel, sensordata = data.qpos, data.qvel, data.sensordata
        log_qpos, log_qvel, log_sensors, log_torque = log.qpos, log.qvel, log.sensors, log.torque
        log_state, state = log.drive, self.drive.state
        step, end = mujoco.mj_step, len(targets) - 1 if last else -1
        for k, target in enumerate(targets):
            log_qpos[k] = qpos
            log_qvel[k] = qvel
            command(target)
            if k == end:
                step = mujoco.mj_forward
            step(model, data)
            log_sensors[k] = sensordata
            log_torque[k] = torque()
            if len(state):
                log_state[k] = state

    def _keep(self, start: int, stop: int) -> None:
        """Move the buffer's samples that are recorded into the log, but never the first away."""
        first = -start % self.every
        kept = len(range(first, stop - start, self.every))
        for field in ("qpos", "qvel", "sensors", "torque", "drive"):
            chosen = getattr(self.buffer, field)[first : stop - start : self.every]
            getattr(self.log, field)[self.done : self.done + kept] = chosen
        self.done = max(self.done + kept, 1)


@dataclass(frozen=True, eq=False)
class _Log:
    """What the engine says at each sample, in its own order."""

    qpos: Float[np.ndarray, "samples q"]
    qvel: Float[np.ndarray, "samples v"]
    sensors: Float[np.ndarray, "samples sensors"]
    torque: Float[np.ndarray, "samples joints"]
    drive: Float[np.ndarray, "samples state"]

    @classmethod
    def empty(cls, model: mujoco.MjModel, drive: Drive, samples: int) -> _Log:
        widths = (model.nq, model.nv, model.nsensordata, model.nv - 6, len(drive.state))
        return cls(*(np.empty((samples, width)) for width in widths))

    def write(self, row: int, data: mujoco.MjData, drive: Drive) -> None:
        """Write one sample as the engine stands."""
        self.qpos[row], self.qvel[row] = data.qpos, data.qvel
        self.sensors[row], self.torque[row] = data.sensordata, drive.torque()
        self.drive[row] = drive.state


@contextmanager
def _engine_warnings() -> Iterator[list[str]]:
    """Collect the engine's warnings, which it would else print and write to a file."""
    import mujoco

    collected: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(collected.append)
    try:
        yield collected
    finally:
        mujoco.set_mju_user_warning(before)


def _record(
    scenario: Scenario,
    walk: Walk,
    run: Run,
    trouble: Trouble | None,
    time: Float[np.ndarray, " time"],
    model: dict[str, np.ndarray],
) -> Recording:
    """The engine's log and the model's figures under the names of the house.

    Time and model are those of the whole walk, of which the run may have made only a part.
    """
    import mujoco

    legs, n = len(walk.robot.legs), run.done
    log = run.log
    contact = log.sensors[:n, : 4 * legs].reshape(n, legs, 4)
    force = contact[..., 1:]
    channels = {name: values[:n] for name, values in model.items()} | {
        "joint_position": log.qpos[:n, 7:].reshape(n, legs, 3),
        "joint_velocity": log.qvel[:n, 6:].reshape(n, legs, 3),
        "joint_torque": log.torque[:n].reshape(n, legs, 3),
        "foot_force": force,
        "foot_normal_force": force[..., 2],
        "foot_position": log.sensors[:n, 4 * legs :].reshape(n, legs, 3),
        "contact": contact[..., 0] > 0,
        "body_position": log.qpos[:n, :3],
        "body_velocity": log.qvel[:n, :3],
        "body_orientation": log.qpos[:n, 3:7],
        # The engine keeps a free body's angular velocity in its own axes.
        "body_angular_velocity": np.einsum(
            "tij,tj->ti", quaternion_rotation(log.qpos[:n, 3:7]), log.qvel[:n, 3:6]
        ),
    }
    channels |= run.drive.channels(log.drive[:n])
    if scenario.sensors.measured == "everything":
        channels |= measured_channels(scenario, walk.robot, time[:n], channels)
    ending = trouble.ending if trouble else Ending.COMPLETED
    attributes = recording_attributes(scenario, walk) | {
        "kind": "simulation",
        "ending": ending.name,
        "ending_reason": f"{ending.value[:-1]} {trouble.reason}." if trouble else ending.value,
        "drive": scenario.simulation.drive,
        "time_step": scenario.simulation.dt,
        "mujoco_version": mujoco.__version__,
    }
    return new_recording(time[:n], channels, attributes)
