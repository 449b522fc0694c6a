"""The locomotion engine: a controller that follows commands of velocity, pose and gait smoothly."""

from __future__ import annotations

import math
from functools import lru_cache
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from phasmid.arguments import checked
from phasmid.control.blocked_directions import BlockedDirections
from phasmid.control.constraints import REACH, SUPPORT, Constraint, VelocityLimit
from phasmid.control.estimation.state import DELAY_UPDATES
from phasmid.control.event_log import EventLog
from phasmid.control.gait_selection import GaitSelector
from phasmid.control.memory import MEMORY
from phasmid.control.records import MAX_LEGS, fill, record_behind, view_of
from phasmid.control.settings import EngineSettings, with_settings
from phasmid.control.terrain_map import SOURCES, TerrainMapView, clear_map
from phasmid.control.types import (
    STANDING,
    STATE,
    LegPhase,
    LegUse,
    Model,
    Reference,
    State,
    model_of,
)
from phasmid.errors import InvalidGait, InvalidInput
from phasmid.experiment.command import Command
from phasmid.experiment.observation import Observation
from phasmid.experiment.targets import JointTargets
from phasmid.gait import Gait
from phasmid.kinematics import (
    body_from_hip,
    foot_position,
    foot_violations,
    neutral_feet,
    posture_feet,
)
from phasmid.robot import Robot

if TYPE_CHECKING:
    from phasmid.control.estimation.estimator import GroundEstimator

PLAN_LASTS = 0.5
"""Time without ground points after which the plan on the height map is given up [s]."""


class LocomotionEngine:
    """Controller that walks in any direction with any gait of its robot.

    It assumes that the joints follow their last targets; sensors serve ground estimation.

    Args:
        robot: The robot, four to eight legs.
        settings: Settings of the engine.
        keywords: Fields of the settings that replace those of `settings`.

    Attributes:
        memory: Record that compiled functions work on, shape (1,).
        model: The robot.
        state: State of the engine.
        reference: Feasible reference of the present command.
        gait: Gait of the engine.
        estimator: Ground estimator; None where contacts are assumed as planned.
        feed_forward: Feed-forward torques; None where none are computed.
        terrain_map: Heights around the robot in odom; None where none are mapped.

    Raises:
        InvalidInput: A setting is out of range.
        InvalidGait: The gait does not fit the robot.
    """

    @checked
    def __init__(
        self,
        robot: Robot,
        settings: EngineSettings | None = None,
        **keywords: Any,
    ) -> None:
        settings = with_settings(settings or EngineSettings(), keywords)
        if len(robot.legs) > MAX_LEGS:
            raise InvalidInput(
                f"the robot has {len(robot.legs)} legs; the locomotion engine walks robots with "
                f"{MAX_LEGS} legs or fewer.",
                hint="phasmid walk, which plans walks for any number of legs",
            )
        # Lazy import: compiled functions take 0.2 s to load.
        from phasmid.control import update, velocity_limits
        from phasmid.control.feed_forward.feed_forward import FeedForward
        from phasmid.control.foothold_planning import forget_plan, plan_footholds
        from phasmid.control.reach import foothold_regions
        from phasmid.control.terrain_mapping import map_points

        self._map_points, self._plan_footholds = map_points, plan_footholds
        self._forget_plan = forget_plan
        self._update, self._limits = update, velocity_limits
        self.robot = robot
        self.settings = settings
        legs = len(robot.legs)
        self.memory = memory = np.zeros(1, MEMORY)
        self.model = view_of(memory["model"], Model, legs)
        fill(self.model, model_of(robot, settings))
        self.state = view_of(memory["states"][0], State, legs)
        self.reference, self._next_reference = (
            view_of(memory["references"][0, i:], Reference, legs) for i in range(2)
        )
        self._log = EventLog(self.state, robot.leg_names)
        self._blocked = BlockedDirections(self.state)
        self._gaits = GaitSelector(robot, settings, self.model)
        self.gait = self._gaits.gait
        self._command: Command | None = None
        # The last poses, since every change of the command needs the regions.
        self._stance = lru_cache(maxsize=8)(self._bound_stance)
        self._foothold_regions = foothold_regions
        self.feed_forward: FeedForward | None = None
        if settings.dynamics == "feed-forward":
            self.feed_forward = FeedForward(
                robot,
                settings.feed_forward,
                settings.update_period,
                gravity=settings.gravity,
                memory=memory,
            )
            memory["computes_torque"] = 1
        self.estimator: GroundEstimator | None = None
        if settings.ground_sensing:
            from phasmid.control.estimation.estimator import GroundEstimator

            self.estimator = GroundEstimator(
                robot, settings.estimator, settings.update_period, memory, settings.gravity
            )
        self.terrain_map: TerrainMapView | None = None
        clear_map(memory["terrain_map"])
        if settings.terrain_map != "none":
            self.terrain_map = TerrainMapView(memory["terrain_map"], lambda: self.state.clock.time)
            delay = settings.estimator.depth_delay + settings.estimator.motion_lag
            self._pose_delay = round(delay / settings.update_period)
            if self._pose_delay >= DELAY_UPDATES:
                raise InvalidInput(
                    f"depth_delay and motion_lag are {delay:g} s together; they must be at most "
                    f"{DELAY_UPDATES - 1} update periods."
                )
        self._feasible_velocity, self._applied_scale = np.zeros(3), math.nan
        self._begin(neutral_feet(robot), 0.0)

    # What a user calls

    def reset(self, observation: Observation) -> None:
        """Begin with the robot at rest on its feet at the observed joint angles.

        Args:
            observation: Joint angles, and the sensors that the robot has.
        """
        q = np.asarray(observation.joint_position, dtype=float)
        if not np.isfinite(q).all():
            raise InvalidInput("joint_position is not finite; the engine cannot begin with it.")
        self._begin(
            body_from_hip(self.robot, foot_position(self.robot.arrays, q)), observation.time
        )
        if self.estimator is not None:
            # The first observation has the sensors of the robot.
            self.estimator.reset(observation)
            self.memory["estimates_ground"] = 1

    def update(self, observation: Observation, command: Command) -> JointTargets:
        """Return the joint targets until the next update.

        Args:
            observation: Sensor readings.
            command: Velocity, pose and gait.
        """
        state, clock, time = self.state, self.state.clock, float(observation.time)
        if math.isfinite(time) and time > clock.time:
            clock.time = time
        observed = clock.time
        if command is not self._command:
            self._take(command)
        if self.estimator is not None and self.memory["estimates_ground"][0]:
            self.estimator.measure(observation)
        points = observation.ground_points if self.settings.terrain_map == "points" else None
        # A covered sensor has no points to send.
        if points is not None and np.isfinite(points).all(axis=1).any():
            # The map has the surface of the feet, which balls raise over the ground.
            up = self.reference.ground_normal @ state.R_odom_body
            points = np.ascontiguousarray(points + self.robot.foot_radius * up, dtype=float)
            memory, age = self.memory[0], self.settings.estimator.depth_delay
            state_record, terrain_map = memory["states"][0], memory["terrain_map"]
            self._map_points(state_record, terrain_map, memory["body_poses"], points, age)
            self._plan_footholds(
                state_record, memory["model"], memory["references"][0], terrain_map
            )
            self._planned = observed
            self._log.set("blind", False, "")
        elif observed - self._planned > PLAN_LASTS:
            self._planned = math.inf
            self._forget_plan(state, self.reference)
            self._log.set("blind", True, "no ground points arrive; the feet alone sense the ground")
        if (
            self.feed_forward is not None
            and self.feed_forward.velocity_scale != self._applied_scale
        ):
            self._applied_scale = self.feed_forward.velocity_scale
            velocity = self._applied_scale * self._feasible_velocity
            self.reference.velocity[:] = self._next_reference.velocity[:] = velocity
        result, events = self._update.update(self.memory, self.settings.update_period)
        if events and self.estimator is not None:
            for sentence in self.estimator.describe(events):
                self._log.events.append((observed, sentence))
        changed = self._changing and not self.reference.gait_pending
        resting = not clock.gait_running
        rough = 0.0 if self.estimator is None else self.estimator.state.roughness
        blocked = self._blocked.update(rough, math.isfinite(self._planned))
        if changed or self._resting != resting or blocked:
            # The feasible velocity was that of the old gait, or its direction is blocked now.
            self._take(command)
        torque, reason = None, ""
        if self.feed_forward is not None:
            torque = self.feed_forward.apply_limits()
            reason = self.feed_forward.limit_reason
        self._log.add_update(result, reason, self.reference.tipping == 1)
        return JointTargets(state.q.copy(), clock.time_scale * state.qd, torque)

    @property
    def events(self) -> list[tuple[float, str]]:
        """Events since the last call of `take_events`: times [s] and sentences."""
        return self._log.events

    def take_events(self) -> list[tuple[float, str]]:
        """Return the events since the last call, and forget them."""
        events, self._log.events = self._log.events, []
        return events

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
        """Return the largest feasible velocity of a steady walk in a direction.

        Args:
            direction: vx, vy [m/s] and wz [rad/s]; only their ratio counts.
            gait: Name of a gait, or the gait; None for the engine's.
            period: Time of a cycle [s]; None for the engine's.
            step_height: Height of a step [m]; None for the engine's.
            pose: Pose of the body relative to its path [m, rad].
            lost_legs: Numbers of legs that are not used, from 1.

        Returns:
            The velocity, and the constraint that limits it.

        Raises:
            InvalidInput: The direction is zero or not finite.
        """
        velocity = np.array(Command(velocity=direction).velocity, dtype=float)
        size = math.hypot(velocity[0], velocity[1], self.model.radius * velocity[2])
        if not size > 0:
            raise InvalidInput(
                "direction is (0, 0, 0), which is none; it must be ahead, left and turn.",
                hint="(1, 0, 0)",
            )
        reference = view_of(STANDING.copy(), Reference, len(self.robot.legs))
        shift, nominal = self._gaits.write(reference, gait, period, lost_legs)
        reference.step_height = self.settings.step_height if step_height is None else step_height
        reference.pose[:] = pose
        reference.pose[:2] += shift
        unit = velocity / size
        share, limit = self._scale(reference, unit, nominal, 100.0)
        vx, vy, wz = (float(x) for x in unit * share)
        leg = None if limit.leg < 0 else limit.leg + 1
        joint = None if limit.joint < 0 else limit.joint
        return VelocityLimit((vx, vy, wz), limit.sentence(self.robot), leg, joint)

    def largest_pose_share(self, pose: Float[np.ndarray, "6"]) -> tuple[float, str]:
        """Return the feasible share of a pose of the body while all feet stand.

        Args:
            pose: Forward, left, up [m], roll, pitch, yaw [rad], as in `Command`, shape (6,).

        Returns:
            The share, from 0 to 1, and the reason why it is not larger.
        """
        wanted, base = np.array(pose, dtype=float), np.zeros(6)
        share, limit = self._pose_scale(base, wanted, standing=True)
        return share, self._pose_reason(limit, wanted)

    def telemetry(self) -> dict[str, Any]:
        """Return the recorded channels of the last update."""
        state, clock = self.state, self.state.clock
        return {
            "stance": state.leg_phase == LegPhase.STANCE,
            "leg_use": np.where(self.reference.used, LegUse.IN_USE, state.needed * LegUse.NEEDED),
            "velocity_command": np.array(self._commanded),
            "velocity_reference": clock.time_scale * state.velocity_filter[2],
            "slow_down": clock.time_scale,
            "support_margin": clock.support_margin,
            "gait_phase": clock.phase,
        }

    # Methods for posture sequences

    def fold(self, leg: int, q: Float[np.ndarray, "3"]) -> None:
        """Set the joint angles at which a leg is held in the air when it is lost.

        Args:
            leg: Its index.
            q: Its joint angles [rad], shape (3,).
        """
        self.model.folded[leg] = q

    def hold(self, leg: int, q: Float[np.ndarray, "3"]) -> None:
        """Set a leg as lost and held in the air already, at rest.

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
        self._update.place(self.memory)

    def catch(self) -> None:
        """Land all swing legs at once, without a jump of their motion."""
        self._update.land(self.memory)

    @property
    def is_standing(self) -> bool:
        """Whether all feet stand near their neutral positions, with the body at rest."""
        return bool(
            self.state.clock.gait_running == 0 and np.abs(self.state.velocity_filter).max() < 1e-4
        )

    @property
    def is_lame(self) -> bool:
        """Whether the remaining legs cannot walk, so that the robot stands still."""
        return not self._next_reference.walks

    # Reference of a command

    def _begin(self, feet: Float[np.ndarray, "legs 3"], time: float) -> None:
        """Begin with the robot at rest on feet in the body frame [m], level, at a time [s]."""
        self._commanded: tuple[float, float, float] = (0.0, 0.0, 0.0)
        self._command = None
        self._resting, self._changing = True, False
        if self.feed_forward is not None:
            self.feed_forward.reset()
        memory, state, clock = self.memory, self.state, self.state.clock
        memory["estimates_ground"] = 0
        memory["maps_terrain"] = SOURCES.index(self.settings.terrain_map)
        if self.terrain_map is not None:
            clear_map(memory["terrain_map"])
            memory["body_poses"] = np.zeros((), memory.dtype["body_poses"])
            memory["body_poses"]["delay"] = self._pose_delay
        memory["references"], memory["states"] = STANDING, np.zeros((), STATE)
        memory["states"]["leg_count"] = len(self.robot.legs)
        self._log.clear()
        self._blocked.clear()
        for reference in (self.reference, self._next_reference):
            _, nominal = self._gaits.write(reference, None, None, frozenset())
            reference.step_height = self.settings.step_height
            reference.landing_depth = self.settings.landing_depth
        clock.time, clock.time_scale, clock.velocity_share = time, 1.0, 1.0
        # The ground is where the feet are on average; odom begins under the body.
        ground = float(feet[:, 2].mean())
        state.pose_filter[:, 2] = -ground - self.model.height
        state.foot[:] = feet - [0.0, 0.0, ground]
        # A sensor that never sends points is reported like one that stops.
        self._planned = time if self.settings.terrain_map == "points" else math.inf
        state.next_foothold[:] = math.nan
        self.model.neutral[:] = self.model.nominal[:] = nominal
        state.line_position[:] = state.touchdown[:] = state.last_foothold[:] = state.foot
        if not self._update.place(memory):
            raise InvalidInput("a foot stands where its leg cannot walk from.")
        # No foot swings: this compiles `land`, for which `catch` has no time.
        self._update.land(memory)

    def _take(self, command: Command) -> None:
        """Write the reference of a command, with its feasible velocity."""
        reference, next_reference = self.reference, self._next_reference
        self._command, self._commanded = command, command.velocity
        shift, nominal = self._write_gait(command)
        commanded, share = float(next_reference.walks) * np.array(command.velocity), 1.0
        if not np.array_equal(nominal, self.model.nominal):
            self.model.nominal[:] = self.model.neutral[:] = nominal
            # The foothold regions are other ones.
            self.state.region_pose[:] = math.inf
        height = command.step_height
        reference.step_height = next_reference.step_height = (
            self.settings.step_height if height is None else height
        )
        self._resting = not self.state.clock.gait_running
        if next_reference.walks:
            standing = self._resting and not commanded.any()
            self._set_pose(np.array(command.pose, dtype=float), shift, standing)
        differs = any(
            not np.array_equal(getattr(next_reference, name), getattr(reference, name))
            for name in ("duty_factor", "period", "sway", "lift_phase", "used", "walks")
        )
        reference.gait_pending = int(differs)
        self._changing = differs
        blocking = self._blocked.blocking_leg(commanded)
        leg = self.robot.leg_names[blocking or 0]
        sentence = f"goes no farther: leg {leg} finds no ground there"
        self._log.set("edge", blocking is not None, sentence)
        if blocking is not None:
            share = 0.0
        elif commanded.any():
            share, limit = self._scale(next_reference, commanded, nominal)
            if differs:
                # The present gait limits the velocity until the change.
                share, limit = min(
                    (share, limit),
                    self._scale(reference, commanded, nominal),
                    key=itemgetter(0),
                )
            reason = limit.sentence(self.robot)
            self._log.set(
                "scaled", share < 1.0, f"the velocity was scaled by {share:.2f}: {reason}"
            )
        reference.velocity[:] = next_reference.velocity[:] = self._feasible_velocity[:] = (
            share * commanded
        )
        self._applied_scale = math.nan

    def _write_gait(
        self, command: Command
    ) -> tuple[Float[np.ndarray, "2"], Float[np.ndarray, "legs 3"]]:
        """Write the gait of a command, or a stance where the remaining legs cannot walk.

        Returns:
            Shift of the body [m] and neutral feet, as of `GaitSelector.write`.
        """
        following, lost = self._next_reference, command.lost_legs
        shift, nominal, reason = np.zeros(2), self.model.nominal, ""
        try:
            shift, nominal = self._gaits.write(following, command.gait, command.period, lost)
            if lost:
                self._require_steps(following, shift, nominal)
        except InvalidGait as error:
            if not lost:
                raise
            reason, nominal = f"stands: {error.what}", self.model.nominal
            self._gaits.write_stance(following, self.reference, lost)
        self._log.set("lame", bool(reason), reason)
        for name, needed in zip(self.robot.leg_names, self.state.needed, strict=True):
            sentence = f"leg {name} is lost and stays on the ground: without it the robot falls"
            self._log.set(f"{name} needed", needed and self.is_standing, sentence)
        return shift, nominal

    def _require_steps(
        self,
        reference: Reference,
        shift: Float[np.ndarray, "2"],
        nominal: Float[np.ndarray, "legs 3"],
    ) -> None:
        """Raise InvalidGait where the remaining legs cannot step on the spot."""
        base = np.zeros(6)
        base[:2] = shift
        model, regions = self._stance(tuple(base), nominal.tobytes())
        limit = self._limits.steady_walk_constraint(
            model, regions, record_behind(reference), base, np.zeros(3)
        )
        if limit.kind in (REACH, SUPPORT):
            legs = ", ".join(self.robot.leg_names[i] for i in np.flatnonzero(reference.used == 0))
            raise InvalidGait(f"without {legs} it cannot step: {limit.sentence(self.robot)}.")

    def _set_pose(self, pose: np.ndarray, shift: np.ndarray, standing: bool) -> None:
        """Write the feasible part of a pose for standing or stepping."""
        share, base = 1.0, np.zeros(6)
        base[:2] = shift
        if pose.any():
            share, limit = self._pose_scale(base, pose, standing)
            reason = self._pose_reason(limit, base + pose) if share < 1.0 else ""
            self._log.set("posed", share < 1.0, f"the pose was scaled by {share:.2f}: {reason}")
        self.reference.pose[:] = self._next_reference.pose[:] = base + share * pose

    def _pose_scale(
        self, base: np.ndarray, pose: np.ndarray, standing: bool
    ) -> tuple[float, Constraint]:
        """Return the feasible share of a pose, and the constraint that limits it."""
        stepping = self.memory["references"][0, 1].copy()
        if standing:
            stepping["duty_factor"], stepping["sway"] = 1.0, 0.0
        return self._limits.feasible_pose_scale(
            self.robot, record_behind(self.model), stepping, base, pose
        )

    def _pose_reason(self, limit: Constraint, pose: np.ndarray) -> str:
        """Return the limit that a neutral foot violates at a pose, or the constraint in words."""
        if limit.kind == REACH:
            leg = self.robot.legs[limit.leg]
            found = foot_violations(leg, posture_feet(self.robot, pose)[limit.leg])
            if found:
                return f"{leg.name}: {found[0].reason}"
        return limit.sentence(self.robot)

    def _scale(
        self,
        reference: Reference,
        velocity: Float[np.ndarray, "3"],
        nominal: Float[np.ndarray, "legs 3"],
        most: float = 1.0,
    ) -> tuple[float, Constraint]:
        """Return the feasible share of a velocity on neutral feet, and what limits it."""
        model, regions = self._stance(tuple(reference.pose), nominal.tobytes())
        return self._limits.feasible_velocity_scale(
            model, regions, record_behind(reference), reference.pose, velocity, most
        )

    def _bound_stance(
        self, pose: tuple[float, ...], nominal: bytes
    ) -> tuple[np.void, Float[np.ndarray, "legs 16 3"]]:
        """Return the robot's numbers with neutral feet, and its foothold regions at a pose."""
        model = record_behind(self.model).copy()
        feet = np.frombuffer(nominal).reshape(-1, 3)
        model["neutral"][: len(feet)] = feet
        return model, self._foothold_regions(model, pose)
