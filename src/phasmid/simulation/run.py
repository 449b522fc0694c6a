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
from phasmid.kinematics import yaw_quaternion
from phasmid.motion import Walk
from phasmid.recording import Recording, new_recording
from phasmid.scenario import Scenario
from phasmid.simulation.drive import Drive, PrescribedDrive, ServoDrive
from phasmid.simulation.ending import Ending, Trouble, watch
from phasmid.simulation.model import build_model

if TYPE_CHECKING:
    import mujoco

SETTLING_TIME = 1.0
"""Time for which the robot stands still before the walk, to find its equilibrium [s]."""

WATCH_STEPS = 256
"""Steps between two looks of the watch, which sees every step in between."""

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
        InvalidInput: The time step cannot resolve the contact.
    """
    _check_time_step(scenario, walk)
    run = Run(scenario, walk)
    trouble = run.advance(progress)
    return _record(scenario, walk, run, trouble)


def _check_time_step(scenario: Scenario, walk: Walk) -> None:
    longest = longest_time_step(scenario, walk.robot.mass)
    if scenario.simulation.dt > longest:
        raise InvalidInput(
            f"--dt {scenario.simulation.dt:g} s cannot resolve this contact "
            f"(needs <= {longest:.2g} s).",
            hint=f"--dt {longest / 2:.1g}",
        )


def longest_time_step(scenario: Scenario, mass: float) -> float:
    """Longest time step that resolves the contact of a robot on three feet [s].

    Args:
        scenario: Its contact is used.
        mass: Of the robot [kg].
    """
    # Each of twelve points carries its share of the mass; the engine takes the contact's spring
    # and damper at the start of a step, which is stable up to about two time constants.
    share = mass / 12
    frequency = math.sqrt(scenario.contact.stiffness / share)
    ratio = scenario.contact.damping / (2 * math.sqrt(scenario.contact.stiffness * share))
    return 2 * (math.sqrt(ratio**2 + 1) - ratio) / frequency


class Run:
    """A walk in the engine, step by step, with the log of every step.

    Attributes:
        model: The engine's model.
        data: The engine's state.
        plan: The walk at the steps' times.
        targets: What the drive is told at each step, shape (steps + 1, 3 L).
        log: What each step left behind.
        done: Number of samples logged.
    """

    def __init__(self, scenario: Scenario, walk: Walk) -> None:
        import mujoco

        self.scenario, self.robot = scenario, walk.robot
        dt = scenario.simulation.dt
        self.steps = round(scenario.duration / dt)
        self.every = scenario.record_steps
        self.plan = walk.sample(np.arange(self.steps + 1) * dt)
        self.model = build_model(walk.robot, scenario)
        self.data = mujoco.MjData(self.model)
        self.drive: Drive
        if scenario.simulation.drive == "prescribed":
            self.drive = PrescribedDrive(self.model, self.data)
            self.targets = PrescribedDrive.targets(self.plan, dt)
        else:
            self.drive = ServoDrive(self.model, self.data, walk)
            self.targets = ServoDrive.targets(self.plan)
        self.log = _Log.empty(self.model, 3 * len(walk.robot.legs), self.steps // self.every + 1)
        self.done = 0
        self._settle()

    def _settle(self) -> None:
        """Put the robot on its feet and let it come to rest, at the start of the plan."""
        import mujoco

        data, plan = self.data, self.plan
        mujoco.mj_resetData(self.model, data)
        data.qpos[:3] = plan.trunk.position[0]
        data.qpos[3:7] = yaw_quaternion(plan.trunk.yaw[:1])[0]
        data.qpos[7:] = plan.q[0].ravel()
        still = plan.q[0].ravel()
        for _ in range(math.ceil(SETTLING_TIME / self.model.opt.timestep)):
            self.drive.command(still)
            mujoco.mj_step(self.model, data)
        data.qpos[:2] = plan.trunk.position[0, :2]
        data.qvel[:3] = plan.trunk.velocity[0]
        data.qvel[3:6] = [0.0, 0.0, plan.trunk.yaw_rate[0]]
        data.qvel[6:] = plan.qd[0].ravel()
        data.time = 0.0

    def advance(self, progress: Progress | None = None) -> Trouble | None:
        """Run to the end, or to the first trouble.

        Returns:
            What ended the run early; None where it was completed.
        """
        start = 0
        buffer = _Log.empty(self.model, self.log.torque.shape[1], WATCH_STEPS)
        try:
            with _engine_warnings() as warnings:
                while start <= self.steps:
                    stop = min(start + WATCH_STEPS, self.steps + 1)
                    self._advance(buffer, start, stop)
                    trouble = self._look(buffer, stop - start, warnings)
                    if trouble:
                        self._keep(buffer, start, start + trouble.sample)
                        at = (start + trouble.sample) * self.scenario.simulation.dt
                        reason = f"at {at:.3f} s {trouble.reason}"
                        return Trouble(trouble.ending, self.done, reason)
                    self._keep(buffer, start, stop)
                    start = stop
                    if progress:
                        progress(min(self.data.time, self.scenario.duration))
        except KeyboardInterrupt:
            # The last step may have moved the state without its row being written.
            whole = round(self.data.time / self.model.opt.timestep) - 1
            self._keep(buffer, start, max(start, whole))
            return Trouble(Ending.STOPPED, self.done, f"at {self.data.time:.3f} s")
        return None

    def _look(self, buffer: _Log, count: int, warnings: list[str]) -> Trouble | None:
        """What the watch finds in the buffer's first samples, and what the engine complained of."""
        trouble = watch(self.robot, buffer.qpos[:count], buffer.qvel[:count])
        if trouble is None and warnings:
            return Trouble(Ending.DIVERGED, count, f"the engine says: {warnings[0]}")
        return trouble

    def _advance(self, log: _Log, start: int, stop: int) -> None:
        """Step from one sample to another; what the engine measured goes into the log's start."""
        import mujoco

        # All names are local: the loop below is the simulation's whole cost beside the engine.
        model, data, targets = self.model, self.data, self.targets
        command, torque = self.drive.command, self.drive.torque
        qpos, qvel, sensordata = data.qpos, data.qvel, data.sensordata
        log_qpos, log_qvel, log_sensors, log_torque = log.qpos, log.qvel, log.sensors, log.torque
        step = mujoco.mj_step
        for k, i in enumerate(range(start, stop)):
            log_qpos[k] = qpos
            log_qvel[k] = qvel
            command(targets[i])
            if i == self.steps:
                step = mujoco.mj_forward
            step(model, data)
            log_sensors[k] = sensordata
            log_torque[k] = torque()

    def _keep(self, buffer: _Log, start: int, stop: int) -> None:
        """Move the samples that are recorded from the buffer into the log."""
        first = -start % self.every
        kept = range(first, stop - start, self.every)
        end = self.done + len(kept)
        for field in ("qpos", "qvel", "sensors", "torque"):
            chosen = getattr(buffer, field)[first : stop - start : self.every]
            getattr(self.log, field)[self.done : end] = chosen
        self.done = end


@dataclass(frozen=True, eq=False)
class _Log:
    """What the engine says at each sample, in its own order."""

    qpos: Float[np.ndarray, "samples q"]
    qvel: Float[np.ndarray, "samples v"]
    sensors: Float[np.ndarray, "samples sensors"]
    torque: Float[np.ndarray, "samples joints"]

    @classmethod
    def empty(cls, model: mujoco.MjModel, joints: int, samples: int) -> _Log:
        widths = (model.nq, model.nv, model.nsensordata, joints)
        return cls(*(np.empty((samples, width)) for width in widths))


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


def _record(scenario: Scenario, walk: Walk, run: Run, trouble: Trouble | None) -> Recording:
    """The engine's log and the model's figures under the names of the house."""
    import mujoco

    legs, n = len(walk.robot.legs), run.done
    time = np.arange(n) * (run.every * scenario.simulation.dt)
    log = run.log
    contact = log.sensors[:n, : 4 * legs].reshape(n, legs, 4)
    force = contact[..., 1:]
    channels = model_channels(walk.sample(time)) | {
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
    }
    ending = trouble.ending if trouble else Ending.COMPLETED
    attributes = recording_attributes(scenario, walk) | {
        "kind": "simulation",
        "ending": ending.name,
        "ending_reason": f"{ending.value[:-1]} {trouble.reason}." if trouble else ending.value,
        "drive": scenario.simulation.drive,
        "time_step": scenario.simulation.dt,
        "mujoco_version": mujoco.__version__,
    }
    return new_recording(time, channels, attributes)
