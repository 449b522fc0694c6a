"""The run of a walk in the physics engine."""

from __future__ import annotations

import base64
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from phasmid.arguments import numbers
from phasmid.errors import InvalidInput
from phasmid.motion import Motion, SampledMotion, Walk
from phasmid.scenario import SETTLING_TIME, Scenario
from phasmid.simulation.drives import (
    Drive,
    IdealServoDrive,
    LostConstraints,
    PrescribedDrive,
    Setpoints,
)
from phasmid.simulation.engine_warnings import EngineWarnings
from phasmid.simulation.ground import Footing
from phasmid.simulation.loop import Loop
from phasmid.simulation.model import build_model
from phasmid.simulation.samples import Keep, Samples
from phasmid.simulation.servo import ServoDrive
from phasmid.simulation.start import raised
from phasmid.simulation.termination import Ending, Failure, check_termination
from phasmid.simulation.torque import TorqueDrive, standing_torque, walking_torque

if TYPE_CHECKING:
    import mujoco


WATCH_STEPS = 512
"""Steps between two looks of the check_termination, which sees every step in between."""

PLAN_STEPS = 32 * WATCH_STEPS
"""Steps for which the plan is evaluated at once, so that long runs do not fill the memory."""

ENDLESS = 2**62
"""Steps of a run that goes on until nobody advances it any more."""

Progress = Callable[[float], None]
"""Is told now and then how many seconds of the walk are done."""


class Run:
    """A walk in the engine, step by step.

    Attributes:
        model: The engine's model.
        data: The engine's state.
        steps: Number of steps.
        step: The next of them.
        first: The state in which the robot is put, before it settles.
        log: Samples of the run, where they are kept in memory.
        done: Number of samples recorded.
        ended: Whether the run is over before its last step, without trouble.
        lies: Whether the trunk may touch the ground at present.
        simulator: What makes the steps.
    """

    simulator = "MuJoCo"
    block_steps = WATCH_STEPS

    def __init__(
        self,
        scenario: Scenario,
        walk: Motion,
        *,
        start: Float[np.ndarray, " state"] | None = None,
        interrupted: Sequence[int] = (),
        endless: bool = False,
    ) -> None:
        self.scenario, self.walk, self.robot = scenario, walk, walk.robot
        self.dt = scenario.simulation.dt
        self.steps = ENDLESS if endless else max(1, round(scenario.duration / self.dt))
        self.every = scenario.record_steps
        self.ground = scenario.load_terrain()
        self._set_up()
        self.buffer = Samples.empty(self.model, self.drive, self.block_steps)
        self.log = Samples.empty(self.model, self.drive, 0)
        self.done = self.step = 0
        self.trouble: Failure | None = None
        self.ended = False
        self._fed = scenario.simulation.drive == "torque"
        self.lies = scenario.simulation.can_lie
        self._one_cycle = self._repeated_targets()
        self._targets, self._targets_of = np.empty((0, 0)), (0, 0)
        self._complaints: list[str] = []
        self._lost: LostConstraints | None = None
        self._place(walk.sample(np.zeros(1)))
        if start is None:
            self.trouble = self._settle(interrupted)
        else:
            self.restore(start)
        self._start = start
        self._begin = -(-self.step // self.every)

    @cached_property
    def time(self) -> Float[np.ndarray, " time"]:
        """Of all samples that are to be recorded [s], shape (N,); a run without an end has none."""
        if self.steps == ENDLESS:
            return np.empty(0)
        return np.arange(self._begin, self.steps // self.every + 1) * (self.every * self.dt)

    def _set_up(self) -> None:
        """Build what is simulated."""
        import mujoco

        self.model = build_model(self.robot, self.scenario)
        self.data = mujoco.MjData(self.model)
        self.drive: Drive = _drive(self.scenario, self.model, self.data, self.walk)
        self.footing = Footing(self.model, self.data, self.robot, self.ground)

    @cached_property
    def _loop(self) -> Loop:
        return Loop(self.model, self.data, self.drive, self.footing, self.buffer)

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
        state = numbers(state, "start")
        if state.shape != (1 + size + own,) or not np.isfinite(state).all():
            raise InvalidInput(
                f"start has shape {state.shape}; it must be {1 + size + own} finite numbers, "
                "a state of a run of this walk.",
                hint="Run.state() of the same scenario and walk",
            )
        last = self.steps // self.every * self.every
        if not (state[0] == round(state[0]) and 0 <= state[0] <= last):
            raise InvalidInput(
                f"start is at step {state[0]:g}; it must be one of 0 to {last}, the last that is "
                "recorded.",
                hint="a longer duration",
            )
        self.step = int(state[0])
        self._set_physics(state[1 : 1 + size])
        self.drive.state[:] = state[1 + size :]

    def step_of(self, sample: int) -> int:
        """Index of the step at which a sample is recorded."""
        return (self._begin + sample) * self.every

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
        walk = self.walk.sample(np.arange(start, stop) * self.dt)
        torque = None
        if self._fed:
            assert isinstance(walk, Walk)
            torque = walking_torque(self.scenario, walk)
        return self.drive.targets(Setpoints(walk.q, walk.qd, walk.qdd, torque), self.dt)

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

    def _place(self, start: SampledMotion) -> None:
        """Put the robot where the plan starts."""
        import mujoco

        data = self.data
        mujoco.mj_resetData(self.model, data)
        data.qpos[:3] = start.trunk.position[0]
        data.qpos[2] += raised(self.scenario, start)
        data.qpos[3:7] = start.trunk.quaternion[0]
        data.qpos[7:] = start.q[0].ravel()
        self.drive.command(self._still(start, 1)[0])
        if self.footing.needed:
            self.footing.follow()
        mujoco.mj_forward(self.model, data)
        self.first = Samples.empty(self.model, self.drive, 1)
        self.first.write(0, data, self.drive)

    def _settle(self, interrupted: Sequence[int]) -> Failure | None:
        """Let the robot come to rest on its feet, then set it going as the plan does."""
        start = self.walk.sample(np.zeros(1))
        still = self._still(start, WATCH_STEPS)
        for _ in range(math.ceil(SETTLING_TIME / self.dt / WATCH_STEPS)):
            if interrupted:
                return Failure(Ending.STOPPED, 0, "before its first step")
            self._advance(still)
            trouble = self._look(WATCH_STEPS)
            if trouble:
                return Failure(trouble.ending, 0, f"before its first step: {trouble.reason}")
        self._set_going(start)
        return None

    def _still(self, start: SampledMotion, count: int) -> Float[np.ndarray, "samples joints"]:
        """Targets of joints that stay where they start, for a number of steps."""
        still = np.zeros_like(start.q)
        torque = standing_torque(self.scenario, start) if self._fed else None
        return np.repeat(
            self.drive.targets(Setpoints(start.q, still, still, torque), self.dt), count, axis=0
        )

    def _set_going(self, start: SampledMotion) -> None:
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
    ) -> Failure | None:
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
        trouble = self.trouble
        while self.step < end and trouble is None and not self.ended:
            made = self._make_block(end, interrupted)
            trouble = self._look(made)
            self._keep(self._finite(trouble.sample) if trouble else made, keep)
            if trouble:
                trouble = self._placed(trouble)
            self.step += made
            if progress:
                progress(min(self.step * self.dt, self.scenario.duration))
            if interrupted and trouble is None and self.step < end and not self.ended:
                trouble = Failure(Ending.STOPPED, self.step, f"at {self.step * self.dt:.3f} s")
        if trouble and self.done == 0:
            # There shall be something to look at.
            keep(self.first)
            self.done = 1
        return trouble

    def _make_block(self, end: int, interrupted: Sequence[int]) -> int:
        """Make the steps up to the watch's next look, before a step at the latest.

        Returns:
            Number of steps made; their samples are the buffer's first.
        """
        first = self.step // PLAN_STEPS * PLAN_STEPS
        part = first, min(first + PLAN_STEPS, end)
        if part != self._targets_of:
            self._targets, self._targets_of = self.targets(*part), part
        begin = self.step - first
        block = self._targets[begin : begin + min(WATCH_STEPS, end - self.step)]
        last = self.step + len(block) > self.steps
        return self._advance(block, last=last, interrupted=interrupted)

    def _finite(self, sample: int) -> int:
        """Number of the buffer's samples up to and with one, or before it where it is no number."""
        state = self.buffer.qpos[sample], self.buffer.qvel[sample]
        return sample + all(np.isfinite(part).all() for part in state)

    def _placed(self, trouble: Failure) -> Failure:
        """What the watch found in the buffer, with its time and its place in the recording."""
        at = (self.step + trouble.sample) * self.dt
        kept = self.step_of(self.done - 1) * self.dt if self.done else math.nan
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

    def _look(self, count: int) -> Failure | None:
        """What the watch finds in the buffer's first samples, and what the engine complained of."""
        seen = self.buffer.qpos[:count], self.buffer.qvel[:count]
        trouble = (
            check_termination(self.robot, *seen, self.ground, lies=self.lies) if count else None
        )
        if trouble:
            return trouble
        if self._complaints:
            said = f"the engine says: {self._complaints[0]}"
            return Failure(Ending.DIVERGED, max(0, count - 1), said)
        if self._lost:
            return Failure(Ending.DIVERGED, max(0, count - 1), self._lost.what.rstrip("."))
        return None

    def _advance(
        self,
        targets: Float[np.ndarray, "samples joints"],
        *,
        at: int = 0,
        last: bool = False,
        interrupted: Sequence[int] = (),
    ) -> int:
        """Make a step for each target; what the engine measured goes into the buffer.

        Args:
            targets: What the drive is told at each step, at most as many as the buffer holds.
            at: Where in the buffer the first sample goes.
            last: Whether the last of them is the walk's end, which is measured and not stepped.
            interrupted: No further step is begun once this is not empty.

        Returns:
            Number of steps that were made.
        """
        end = len(targets) - last
        with EngineWarnings(self._complaints):
            made = self._loop.advance(targets, end, at, interrupted)
        if made.error:
            self._complaints.append(" ".join(made.error.split()))
        if made.lost:
            self._lost = LostConstraints()
        return made.steps

    def _keep(self, count: int, keep: Keep) -> None:
        """Hand on those of the buffer's first samples that are recorded."""
        rows = self.buffer.part(slice(-self.step % self.every, count, self.every))
        if len(rows.qpos):
            keep(rows)
            self.done += len(rows.qpos)


def _drive(scenario: Scenario, model: mujoco.MjModel, data: mujoco.MjData, walk: Motion) -> Drive:
    """What moves the joints in this scenario."""
    kind = scenario.simulation.planned_drive
    if kind == "servo":
        return ServoDrive(model, data, walk, scenario)
    if kind == "torque":
        return TorqueDrive(model, data, walk, scenario)
    return (PrescribedDrive if kind == "prescribed" else IdealServoDrive)(model, data, walk)
