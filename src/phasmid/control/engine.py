"""The locomotion engine: walks wherever it is told to, at once and without a jump."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from phasmid.arguments import check_type
from phasmid.control.blocked_directions import BlockedDirections
from phasmid.control.body_clearance import BodyClearance
from phasmid.control.command import Command
from phasmid.control.event_log import EventLog
from phasmid.control.landing import land_swing_legs
from phasmid.control.limiting_constraint import VelocityLimit, limiting_constraint
from phasmid.control.memory import Memory, Records, clear, new_reference
from phasmid.control.observation import Observation
from phasmid.control.pattern import Pattern
from phasmid.control.records import MAX_LEGS, record_behind
from phasmid.control.settings import EngineSettings
from phasmid.control.targets import JointTargets
from phasmid.control.types import LegPhase, Reference, State, model_of, parameters_of
from phasmid.errors import InvalidGait, InvalidInput
from phasmid.gait import Gait
from phasmid.kinematics import body_from_hip, foot_position
from phasmid.robot import Robot

if TYPE_CHECKING:
    from phasmid.control.estimation.estimator import GroundEstimator

SWAY_BANDWIDTH = 15.0
"""Of the filter of the body's way aside [1/s]."""


class LocomotionEngine:
    """A `Controller` that makes legs walk, omnidirectionally, in any gait of its robot.

    Its update takes the robot to be where it was last told to be: what the sensors say is used by
    the stages that estimate the ground.

    Args:
        robot: The robot, four or more legs.
        settings: How it walks; or its fields, as keywords.

    Attributes:
        memory: Where it is, and all else that its loops work on.
        estimator: Estimator of contact and ground; None: the plan is trusted.
        dynamics: The stage that finds torques; None: it does not.
        admitted: The velocity that the robot can keep to, shape (3,).
        had: Part of it that is in the reference; NaN: it is to be written anew.

    Raises:
        InvalidInput: A setting is out of range.
        InvalidGait: The gait does not fit the robot.
    """

    def __init__(
        self,
        robot: Robot,
        settings: EngineSettings | None = None,
        *,
        records: Records | None = None,
        **keywords: Any,
    ) -> None:
        check_type("robot", robot, (Robot,), "a Robot", 'phasmid.load_robot("phantomx-ax")')
        if settings is not None:
            check_type("settings", settings, (EngineSettings,), "EngineSettings")
        if settings is None:
            known = [field.name for field in fields(EngineSettings)]
            for name in keywords:
                if name not in known:
                    raise InvalidInput(
                        f'there is no setting "{name}" of the locomotion engine.',
                        hint=", ".join(known),
                    )
            settings = EngineSettings(**keywords)
        elif keywords:
            raise InvalidInput("settings are given as a whole or as keywords, not both.")
        if len(robot.legs) > MAX_LEGS:
            raise InvalidInput(
                f"the robot has {len(robot.legs)} legs; the locomotion engine walks robots with "
                f"{MAX_LEGS} legs or fewer.",
                hint="phasmid walk, which plans walks for any number of legs",
            )
        # Lazy import: numba takes 0.6 s.
        from phasmid.control import update, velocity_limits
        from phasmid.control.feed_forward.feed_forward import FeedForward
        from phasmid.control.foothold_region import FootholdRegions

        self._update, self._limits = update, velocity_limits
        self.robot = robot
        self.settings = settings
        memory = self.memory = Memory(
            model_of(robot, settings.joint_speed_share, settings.stretch, settings.joint_margin),
            parameters_of(settings, SWAY_BANDWIDTH),
            records,
        )
        self._model = memory.model
        # What compiled functions take.
        self._records = memory.models[0], memory.parameter_records[0]
        self.state: State = memory.state
        self.reference: Reference = memory.reference
        self._next_reference = memory.next_reference
        self._verdict = np.zeros(4)
        self._log = EventLog(self.state, robot.leg_names)
        self._blocked = BlockedDirections(self.state)
        self._pattern = Pattern(robot, settings, self._model)
        self.gait = self._pattern.gait
        self._command: Command | None = None
        self._at_home = np.array(robot.arrays.neutral_foot)
        self._clearance = BodyClearance(robot, self._model.height)
        self._regions = FootholdRegions(memory.models[0])
        self.feed_forward: FeedForward | None = None
        if settings.dynamics == "feed-forward":
            self.feed_forward = FeedForward(
                robot, settings.feed_forward, settings.update_period, records=memory.records
            )
            memory.records.stages[1] = 1
        self.estimator: GroundEstimator | None = None
        if settings.ground_sensing:
            from phasmid.control.estimation.estimator import GroundEstimator

            self.estimator = GroundEstimator(
                robot, settings.estimator, settings.update_period, memory.records
            )
        self.feasible_velocity, self.applied_scale = np.zeros(3), math.nan
        self._start()

    # What a user calls

    def reset(self, observation: Observation) -> None:
        """Forget all, and begin with the robot standing on the feet that it is seen to stand on.

        Args:
            observation: Its joint angles, and if it is told the body's orientation.
        """
        q = np.asarray(observation.joint_position, dtype=float)
        if not np.isfinite(q).all():
            raise InvalidInput("joint_position is not finite; the engine cannot begin with it.")
        self._start()
        feet = body_from_hip(self.robot, foot_position(self.robot.arrays, q))
        self.stand(feet, time=observation.time)
        if self.estimator is not None:
            self.estimator.reset(observation)
            self.memory.records.stages[0] = 1

    def update(self, observation: Observation, command: Command) -> JointTargets:
        """What the joints shall do until the next update.

        Args:
            observation: What the robot's sensors tell.
            command: Where to go, and how.
        """
        self.prepare(observation, command)
        dt = self.settings.update_period
        result, events = self._update.update(*self.memory.records, dt)
        return self.finish(command, result, events)

    def prepare(self, observation: Observation, command: Command) -> None:
        """Write observation and command into the records, before `phasmid.control.update.update`.

        Args:
            observation: Sensor readings.
            command: Where to go, and how.
        """
        clock, time = self.state.clock, float(observation.time)
        if math.isfinite(time) and time > clock.time:
            clock.time = time
        self._observed = clock.time
        if command is not self._command:
            self._take(command)
        if self.estimator is not None and self.memory.records.stages[0]:
            self.estimator.measure(observation)
        if self.feed_forward is not None and self.feed_forward.velocity_scale != self.applied_scale:
            self.applied_scale = self.feed_forward.velocity_scale
            velocity = self.applied_scale * self.feasible_velocity
            self.reference.velocity[:] = self._next_reference.velocity[:] = velocity

    def finish(self, command: Command, result: int, events: int) -> JointTargets:
        """Return the joint targets after an update, and handle its events.

        Args:
            command: Where to go, and how.
            result: Result of the update.
            events: Its `EstimatorEvent` bits.
        """
        state, clock = self.state, self.state.clock
        if events and self.estimator is not None:
            for sentence in self.estimator.describe(events):
                self._log.events.append((self._observed, sentence))
        changed = self._changing and not self.reference.gait_pending
        resting = not clock.gait_running
        if changed or self._resting != resting or self._blocked.update():
            # The feasible velocity was that of the old gait, or its direction is blocked now.
            self._take(command)
        torque, reason = None, ""
        if self.feed_forward is not None:
            torque = self.feed_forward.apply_limits()
            reason = self.feed_forward.limit_reason
        self._log.add_update(result, reason)
        return JointTargets(state.q.copy(), clock.time_scale * state.qd, torque)

    @property
    def events(self) -> list[tuple[float, str]]:
        """What was said since it was asked last: times [s] and sentences."""
        return self._log.events

    def take_events(self) -> list[tuple[float, str]]:
        """What was said since it was asked last; it is forgotten, so that no memory grows."""
        told, self._log.events = self._log.events, []
        return told

    def largest_velocity(
        self,
        direction: tuple[float, float, float],
        *,
        gait: str | Gait | None = None,
        period: float | None = None,
        step_height: float | None = None,
        pose: tuple[float, ...] = (0.0,) * 6,
        lost_legs: frozenset[int] = frozenset(),
    ) -> VelocityLimit:
        """The largest velocity in a direction at which the robot walks steadily.

        Args:
            direction: Ahead, left [m/s] and turn [rad/s]; their ratio counts.
            gait: Its name, or the gait; None: as the engine is set.
            period: Time of a cycle [s]; None: as the engine is set.
            step_height: Height of a step [m]; None: as the engine is set.
            pose: Of the body beside its path.
            lost_legs: Numbers of legs that are not walked on.

        Returns:
            The velocity, and what keeps the robot from a larger one.

        Raises:
            InvalidInput: The direction is no direction.
        """
        velocity = np.array(Command(velocity=direction).velocity, dtype=float)
        size = math.hypot(velocity[0], velocity[1], self._model.radius * velocity[2])
        if not size > 0:
            raise InvalidInput(
                "direction is (0, 0, 0), which is none; it must be ahead, left and turn.",
                hint="(1, 0, 0)",
            )
        reference = new_reference(len(self.robot.legs))
        shift = self._pattern.write(reference, gait, period, lost_legs)
        reference.step_height = self.settings.step_height if step_height is None else step_height
        reference.pose[:] = pose
        reference.pose[:2] += shift
        unit = velocity / size
        share = self._share(reference, unit, 100.0)
        vx, vy, wz = (float(x) for x in unit * share)
        return VelocityLimit((vx, vy, wz), *limiting_constraint(self._verdict, self.robot))

    def telemetry(self) -> dict[str, Any]:
        """Numbers of the last update by channel name, to be recorded."""
        state = self.state
        clock = state.clock
        phase, slow, margin = clock.phase, clock.time_scale, clock.support_margin
        return {
            "stance": state.leg_phase == LegPhase.STANCE,
            "velocity_command": np.array(self._asked),
            "velocity_reference": slow * state.velocity_filter[2],
            "slow_down": slow,
            "support_margin": margin,
            "gait_phase": phase,
        }

    # What other stages of the control call

    def stand(self, feet: Float[np.ndarray, "legs 3"], *, time: float = 0.0) -> None:
        """Take over a robot that stands with its feet at these places, at rest.

        Args:
            feet: In the body frame [m], shape (L, 3); the body is taken to be level.
            time: Of the engine's clock [s].
        """
        state, feet = self.state, np.asarray(feet, dtype=float)
        self.memory.clear_state()
        clock = state.clock
        clock.time, clock.time_scale, clock.velocity_share = time, 1.0, 1.0
        # The ground is where the feet are on average; odom begins under the body.
        ground = float(feet[:, 2].mean())
        state.pose_filter[:, 2] = -ground - self._model.height
        self.reference.ground_normal[:] = 0.0, 0.0, 1.0
        self.reference.ground_height = 0.0
        state.foot[:] = feet - [0.0, 0.0, ground]
        state.line_position[:] = state.touchdown[:] = state.last_foothold[:] = state.foot
        if self._place() != 0:
            raise InvalidInput("a foot stands where its leg cannot walk from.")

    def fold(self, leg: int, q: Float[np.ndarray, "3"]) -> None:
        """Tell how a leg is held in the air when it is lost.

        Args:
            leg: Its index.
            q: Its joint angles [rad], shape (3,).
        """
        self._model.folded[leg] = q

    def hold(self, leg: int, q: Float[np.ndarray, "3"]) -> None:
        """Take a leg as lost and held in the air already, at rest.

        Args:
            leg: Its index.
            q: Its joint angles [rad], shape (3,).
        """
        self.fold(leg, q)
        state = self.state
        state.leg_phase[leg] = LegPhase.HELD
        # Its folding is over.
        state.swing_elapsed[leg] = state.swing_duration[leg] = 1.0
        state.q[leg] = q
        state.qd[leg] = state.qdd[leg] = 0.0
        self.reference.used[leg] = self._next_reference.used[leg] = False
        self._place()

    def catch(self) -> None:
        """Let all feet that swing come down from where they are, at once and without a jump."""
        land_swing_legs(self.state, self.reference, self.settings.landing_depth)

    @property
    def is_standing(self) -> bool:
        """Whether all feet stand, near to their neutral places, and the body rests over them."""
        return bool(
            self.state.clock.gait_running == 0 and np.abs(self.state.velocity_filter).max() < 1e-4
        )

    @property
    def is_lame(self) -> bool:
        """Whether the legs that are left cannot walk, so that it stands as it did."""
        return self._log.is_active("lame")

    # The rest

    def _place(self) -> int:
        """Bend the legs to where the state says that body and feet are; 0: they reach it."""
        memory = self.memory
        return int(
            self._update.advance_engine(
                memory.states, memory.references, memory.models, memory.parameter_records, 0.0
            )
        )

    def _start(self) -> None:
        self._asked: tuple[float, float, float] = (0.0, 0.0, 0.0)
        self._command, self._observed = None, 0.0
        self._resting, self._changing = True, False
        if self.feed_forward is not None:
            self.feed_forward.reset()
        self._log.clear()
        self._blocked.clear()
        # The first observation has the sensors of the robot.
        self.memory.records.stages[0] = 0
        for reference in (self.reference, self._next_reference):
            clear(reference)
            self._pattern.write(reference, None, None, frozenset())
            reference.step_height = self.settings.step_height
        neutral = body_from_hip(self.robot, self._at_home)
        self.stand(neutral)

    def _take(self, command: Command) -> None:
        """Write the reference for a command, with a velocity that can be kept to."""
        reference, next_reference = self.reference, self._next_reference
        self._command = command
        try:
            shift = self._pattern.write(
                next_reference, command.gait, command.period, command.lost_legs
            )
        except InvalidGait as error:
            if not command.lost_legs:
                raise
            # Robots that cannot walk any more stand as they did.
            self._log.set("lame", True, f"stands: {error.what}")
            self._asked = command.velocity
            reference.velocity[:] = next_reference.velocity[:] = 0.0
            return
        self._log.set("lame", False, "")
        height = command.step_height
        reference.step_height = next_reference.step_height = (
            self.settings.step_height if height is None else height
        )
        resting = bool(self.state.clock.gait_running == 0)
        self._resting = resting
        standing = resting and not any(command.velocity)
        self._set_pose(np.array(command.pose, dtype=float), shift, standing)
        differs = (
            (next_reference.duty_factor, next_reference.period, next_reference.sway)
            != (reference.duty_factor, reference.period, reference.sway)
            or not np.array_equal(next_reference.lift_phase, reference.lift_phase)
            or not np.array_equal(next_reference.used, reference.used)
        )
        reference.gait_pending = int(differs)
        self._changing = differs
        asked = np.array(command.velocity, dtype=float)
        self._asked = command.velocity
        share = 1.0
        blocking = self._blocked.blocking_leg(asked)
        leg = self.robot.leg_names[blocking or 0]
        sentence = f"goes no farther: leg {leg} finds no ground there"
        self._log.set("edge", blocking is not None, sentence)
        if blocking is not None:
            share = 0.0
        elif asked.any():
            share = self._share(next_reference, asked, 1.0)
            reason = limiting_constraint(self._verdict, self.robot)[0]
            if differs:
                before = self._share(reference, asked, 1.0)
                if before < share:
                    # What is left of the gait, or of the step, that is being given up.
                    share, reason = before, limiting_constraint(self._verdict, self.robot)[0]
            self._log.set(
                "scaled", share < 1.0, f"the velocity was scaled by {share:.2f}: {reason}"
            )
        reference.velocity[:] = next_reference.velocity[:] = self.feasible_velocity[:] = (
            share * asked
        )
        self.applied_scale = math.nan

    def _set_pose(self, pose: np.ndarray, shift: np.ndarray, standing: bool) -> None:
        """Write the pose, or as much of it as the robot can stand or step in."""
        next_reference = self._next_reference
        share, base = 1.0, np.zeros(6)
        base[:2] = shift
        if pose.any():
            stepping = self.memory.references[1].copy()
            if standing:
                stepping["duty_factor"], stepping["sway"] = 1.0, 0.0
            share = float(
                self._limits.share_of_pose(
                    *self._records,
                    stepping,
                    base,
                    pose,
                    self._verdict,
                )
            )
            reason = limiting_constraint(self._verdict, self.robot)[0]
            above = self._clearance.feasible_pose_scale(base, pose)
            if above < share:
                share, reason = above, "the trunk would come too near to the ground"
            self._log.set("posed", share < 1.0, f"the pose was scaled by {share:.2f}: {reason}")
        self.reference.pose[:] = next_reference.pose[:] = base + share * pose

    def _share(self, reference: Reference, velocity: np.ndarray, most: float) -> float:
        region = self._regions.at(reference.pose)
        return float(
            self._limits.share_of_velocity(
                *self._records,
                region,
                record_behind(reference),
                reference.pose,
                velocity,
                most,
                self._verdict,
            )
        )
