"""A controller that stands up, sits down and moves legs by hand, around one that walks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.control.command import Command, Posture
from phasmid.control.controller import Controller
from phasmid.control.observation import Observation
from phasmid.control.sequences.folding import folding
from phasmid.control.sequences.joint_path import JointMotion, path_through
from phasmid.control.sequences.lameness import Lameness
from phasmid.control.sequences.manual_leg import ManualLeg, SetpointFilter, plan_manual_leg
from phasmid.control.sequences.packed import Packing, packing
from phasmid.control.sequences.reaching import knees_and_feet
from phasmid.control.sequences.resting import Resting, resting, upwards
from phasmid.control.sequences.rising import rising
from phasmid.control.sequences.route import Route
from phasmid.control.sequences.settings import SequenceSettings
from phasmid.control.sequences.stage import Stage
from phasmid.control.sequences.stance import (
    Stance,
    neutral_stance,
    stance_on,
    to_neutral,
)
from phasmid.control.targets import JointTargets
from phasmid.errors import InfeasibleWalk
from phasmid.robot import Robot

STILL_SPEED = 0.01
"""A walking controller whose joints are slower than this is at rest: one that feels the ground is
never wholly, and joints may change their speed by many times that from update to update [rad/s]."""

STILL_TIME = 0.1
"""It must have been so for as long as this [s]."""

SAME_ANGLE = 1e-6
"""Angles closer than this are the same [rad]."""

AT_HOME = 1e-3
"""Feet nearer to their neutral places than this need no step [m]."""

SAG = 8e-3
"""And nearer than this need none where servos give way under the load that they carry [m]."""

STEEPEST_HOLD = math.cos(math.radians(20))
"""A body that leans further is not held well by its feet."""

LEVEL_ERROR = math.cos(math.radians(10))
"""Where the inertial sensor says otherwise by more, the ground is not where the feet say; unless
they feel it."""

STEEPEST_GROUND = math.cos(math.radians(30))
"""A slope that feet feel is one to stand on up to here; further, the robot has fallen."""

LONGEST_STEP = 0.05
"""A controller that is updated after a longer time than this goes on as after this [s]."""


class Sequencer:
    """Stands up, sits down and moves legs by hand; in between another controller has the joints.

    It begins with the robot as it is: lying or held by its feet, its joints at any angles.
    ``PACKED`` folds the legs under a robot that lies; ``STANDING`` and ``WALKING`` raise it to the
    neutral stance, from where the walking controller goes on. A change of mind at any moment is
    answered by going back on the way that was come, smoothly.

    Attributes:
        events: What was refused or noticed since `reset`, by the walking controller too: times
            [s] and sentences.
        stage: What the robot is about.
    """

    def __init__(
        self, walker: Controller, robot: Robot, settings: SequenceSettings | None = None
    ) -> None:
        """Begin.

        Args:
            walker: What walks; it is reset with the robot in its neutral stance.
            robot: The robot, L legs.
            settings: How carefully; None: the usual.
        """
        self.walker, self.robot = walker, robot
        self.settings = settings or SequenceSettings()
        self.events: list[tuple[float, str]] = []
        self.stage = Stage.LYING
        self._lameness = Lameness(walker, robot, self.settings)
        self._home = neutral_stance(robot).q
        self._packing: Packing | None = None
        self._why_not = ""
        try:
            self._packing = packing(robot, self.settings)
        except InfeasibleWalk as error:
            self._why_not = error.what
        self._motion = JointMotion(self._home, 0 * self._home, 0 * self._home)
        self._walked = JointTargets(self._home, 0 * self._home)
        self._route: Route | None = None
        self._goal = Stage.STANDING
        self._hand: ManualLeg | None = None
        self._follower: SetpointFilter | None = None
        self._told: set[str] = set()
        self._heard = 0
        self._time = self._at_rest = 0.0
        self._ignored: tuple[int, ...] = ()
        self._refused: tuple[int, ...] | None = None
        self._quiet = Command(posture=Posture.STANDING)

    def reset(self, observation: Observation) -> None:
        """Forget all, and begin with the robot as it is observed."""
        self.events.clear()
        self._heard = len(getattr(self.walker, "events", ()))
        self._lameness.reset(observation.time)
        self._time, self._at_rest = observation.time, 0.0
        self._ignored, self._refused = (), None
        self._hand = self._follower = None
        q = np.array(observation.joint_position, dtype=float)
        bad = ~np.isfinite(q)
        if bad.any():
            q[bad] = (self._packing.folded if self._packing else self._home)[bad]
            self._say(observation.time, "joint angles are not known; they are taken for folded.")
        self._rest_at(q)
        up = upwards(observation)
        ground = resting(self.robot, q, up)
        if np.abs(q - self._home).max() < SAME_ANGLE or not self._packing:
            self._stand(observation)
            return
        if self._is_held(ground, observation, up):
            if ground.feet.all() and self._is_home(q, [], SAG):
                ends = np.stack([q, self._home])
                speed = self.settings.speed(self.robot, loaded=True)
                way = path_through("comes to rest", ends, speed, self.settings.acceleration)
                self._set_out(Route([way]), Stage.GATHERING, Stage.STANDING)
                return
            if self._gather(q, ground, observation):
                return
        paths = folding(self.robot, q, self._packing.folded, ground, self.settings)
        self._set_out(Route(paths) if paths else None, Stage.GATHERING, Stage.LYING)

    def update(self, observation: Observation, command: Command) -> JointTargets:
        """What the joints shall do until the next update."""
        dt = min(max(observation.time - self._time, 0.0), LONGEST_STEP)
        self._time = observation.time
        self._lameness.notice(observation)
        command = self._lameness.adapt(self._time, command)
        if self._lameness.events:
            self.events += self._lameness.events
            self._lameness.events.clear()
        stage = self.stage
        if stage is Stage.STANDING:
            by_hand = tuple(sorted(command.legs)) if command.legs else ()
            if command.posture is not Posture.PACKED and by_hand == self._ignored:
                return self._walk(observation, command)
            if not by_hand:
                self._ignored = ()
            if command.posture is Posture.PACKED and self._packing is None:
                if self._why_not:
                    self._say(self._time, self._why_not)
                    self._why_not = ""
                return self._walk(observation, replace(command, posture=Posture.STANDING))
            if command.posture is not Posture.PACKED and not by_hand:
                return self._walk(observation, command)
            self.stage, self._at_rest = Stage.STOPPING, 0.0
            stage = self.stage
        if stage is Stage.STOPPING:
            return self._stop(observation, command, dt)
        if stage is Stage.LYING:
            if command.posture is not Posture.PACKED:
                self._get_up(command)
            if self._route is None:
                return _targets(self._motion)
        if stage is Stage.MANUAL_LEG:
            self._follow(command, dt)
            return _targets(self._motion)
        self._go(observation, command, dt)
        return _targets(self._motion)

    def telemetry(self) -> Mapping[str, Any]:
        """The stage by number, beside what the walking controller tells."""
        inner = getattr(self.walker, "telemetry", None)
        told = inner() if callable(inner) else {}
        return {**told, "sequence": float(self.stage.value)}

    def take_events(self) -> list[tuple[float, str]]:
        """What was said since it was asked last, by the walking controller too; it is forgotten."""
        self._hear()
        told, self.events = self.events, []
        if self._heard and hasattr(self.walker, "take_events"):
            self.walker.take_events()
            self._heard = 0
        return told

    def _walk(self, observation: Observation, command: Command) -> JointTargets:
        if command.legs:
            command = replace(command, legs=MappingProxyType({}))
        targets = self.walker.update(observation, command)
        self._walked = targets
        self._hear()
        return targets

    def _hear(self) -> None:
        """Note what the walking controller has said since it was heard last."""
        said = getattr(self.walker, "events", ())
        if len(said) > self._heard:
            self.events += said[self._heard :]
            self._heard = len(said)

    def _stand(self, observation: Observation, lost: list[int] | None = None) -> None:
        """Hand the joints to the walking controller, as they are."""
        self._hear()
        self.stage, self._route = Stage.STANDING, None
        q = self._motion.position.copy()
        self._walked = JointTargets(q, 0 * q)
        hold = getattr(self.walker, "hold", None)
        self._heard = 0
        if not (lost and callable(hold)):
            self.walker.reset(replace(observation, joint_position=q))
            return
        whole = q.copy()
        whole[lost] = self._home[lost]
        self.walker.reset(replace(observation, joint_position=whole))
        for leg in lost:
            hold(leg, q[leg])

    def _stop(self, observation: Observation, command: Command, dt: float) -> JointTargets:
        """Bring the walking controller to rest, and go on from there."""
        by_hand = tuple(sorted(command.legs)) if command.legs else ()
        if command.posture is not Posture.PACKED and (not by_hand or by_hand == self._ignored):
            self.stage = Stage.STANDING
            return self._walk(observation, command)
        before = self._walked.position
        quiet = self._quiet
        if command.lost_legs != quiet.lost_legs or command.gait is not quiet.gait:
            quiet = self._quiet = replace(
                quiet,
                lost_legs=command.lost_legs,
                gait=command.gait,
                period=command.period,
                pose=command.pose if command.lost_legs else quiet.pose,
            )
        targets = self._walk(observation, quiet)
        moving = max(
            float(np.abs(targets.velocity).max()),
            float(np.abs(targets.position - before).max()) / max(dt, 1e-9),
        )
        self._at_rest = self._at_rest + dt if moving < STILL_SPEED else 0.0
        if self._at_rest < STILL_TIME:
            return targets
        lost = self._lost(command)
        q = np.array(targets.position)
        self._rest_at(q)
        ground = resting(self.robot, q, None)
        if command.posture is not Posture.PACKED:
            self._take_in_hand(by_hand, stance_on(self.robot, q, ground), lost)
        elif self._is_home(q, lost, AT_HOME):
            self._sit(lost, observation)
        elif not self._gather(q, ground, observation, lost):
            self._say(self._time, "the robot cannot sit down from here: its feet cannot step home.")
            self.stage = Stage.STANDING
        return targets

    def _is_held(
        self, ground: Resting, observation: Observation, up: Float[np.ndarray, "3"] | None
    ) -> bool:
        """Whether the robot stands on its feet already, as far as can be told."""
        if ground.on_belly or ground.feet.sum() < 3 or ground.normal[2] < STEEPEST_HOLD:
            return False
        contact = observation.contact
        steepest = LEVEL_ERROR if contact is None else STEEPEST_GROUND
        if up is not None and float(ground.normal @ up) < steepest:
            return False
        return contact is None or int((contact & ground.feet).sum()) >= 3

    def _gather(
        self,
        q: Float[np.ndarray, "legs 3"],
        ground: Resting,
        observation: Observation,
        lost: list[int] | None = None,
    ) -> bool:
        """Set out to the neutral stance on the feet that hold the robot."""
        lost = lost or []
        air = [int(leg) for leg in np.flatnonzero(~ground.feet)]
        plan = to_neutral(
            self.robot, stance_on(self.robot, q, ground), self.settings, air=air, lost=lost
        )
        if plan is None:
            return False
        if plan.paths:
            self._set_out(Route(plan.paths), Stage.GATHERING, Stage.STANDING)
        else:
            self._stand(observation, lost)
        return True

    def _chain(self, lost: list[int]) -> Route | None:
        assert self._packing is not None
        q = self._motion.position
        try:
            paths = rising(self.robot, self._packing, self.settings, {i: q[i] for i in lost})
        except InfeasibleWalk as error:
            self._say(self._time, error.what)
            return None
        return Route(paths)

    def _get_up(self, command: Command) -> None:
        lost = self._lost(command)
        if tuple(lost) == self._refused:
            return
        route = self._chain(lost)
        self._refused = None if route else tuple(lost)
        self._set_out(route, Stage.GETTING_UP, Stage.STANDING if route else Stage.LYING)

    def _sit(self, lost: list[int], observation: Observation) -> None:
        """Set out from standing to lying."""
        route = self._chain(lost)
        if route is None:
            self._stand(observation, lost)
            return
        paths, q = list(route.paths), self._motion.position
        if not np.array_equal(paths[-1].end, q):
            # The walker ends within a millimetre; what lies between is gone as well.
            ends = np.stack([paths[-1].end, q])
            speed = self.settings.speed(self.robot, loaded=True)
            paths.append(path_through("comes to rest", ends, speed, self.settings.acceleration))
        self._set_out(Route(paths, backwards=True), Stage.GETTING_UP, Stage.STANDING)

    def _set_out(self, route: Route | None, stage: Stage, goal: Stage) -> None:
        self._route, self._goal = route, goal
        self.stage = stage if route else goal

    def _go(self, observation: Observation, command: Command, dt: float) -> None:
        """Go on along the route; at its end the next stage begins."""
        route = self._route
        assert route is not None
        up = command.posture is not Posture.PACKED
        if self.stage is Stage.GETTING_UP:
            route.turn(forward=up)
        elif self.stage is Stage.LIFTING:
            assert self._hand is not None
            same = {leg - 1 for leg in command.legs} == set(self._hand.legs)
            route.turn(forward=up and same)
            # It stays at rest, and its clock goes on.
            self.walker.update(observation, self._quiet)
        self._motion = route.advance(dt)
        if not route.finished:
            return
        self._rest_at(self._motion.position)
        self._route = None
        if self.stage is Stage.LIFTING:
            if route.forward:
                self.stage = Stage.MANUAL_LEG
                speed = self.settings.speed(self.robot)
                self._follower = SetpointFilter(self._motion, speed, self.settings.acceleration)
                self._route = route
            else:
                self._hand = None
                self._stand(observation, self._lost(command))
        elif (self.stage is Stage.GETTING_UP and not route.forward) or self._goal is Stage.LYING:
            self.stage = Stage.LYING
        elif self.stage is Stage.GATHERING and not up and self._packing:
            self._sit(self._lost(command), observation)
        else:
            self._stand(observation, self._lost(command))

    def _take_in_hand(self, numbers: tuple[int, ...], stance: Stance, lost: list[int]) -> None:
        legs = [number - 1 for number in numbers if 1 <= number <= len(self.robot.legs)]
        names = " and ".join(self.robot.leg_names[leg] for leg in legs)
        move = None
        if len(legs) == len(numbers) and not set(legs) & set(lost):
            move = plan_manual_leg(self.robot, stance, legs, self.settings, lost)
        if move is None:
            self.stage, self._ignored = Stage.STANDING, numbers
            why = "the other legs would not hold the robot" if names else "there is no such leg"
            self._say(self._time, f"leg {names or numbers} cannot be moved by hand: {why}.")
            return
        self._hand = move
        self._told = set()
        self._set_out(Route(move.paths), Stage.LIFTING, Stage.MANUAL_LEG)

    def _follow(self, command: Command, dt: float) -> None:
        hand, follower, route = self._hand, self._follower, self._route
        assert hand is not None
        assert follower is not None
        assert route is not None
        same = {leg - 1 for leg in command.legs} == set(hand.legs)
        if same and command.posture is not Posture.PACKED:
            asked, said = hand.asked(command.legs, self.settings)
            for sentence in said:
                if sentence not in self._told:
                    self._told.add(sentence)
                    self._say(self._time, sentence)
        else:
            asked = route.paths[-1].end
            if follower.arrived(asked):
                self.stage = Stage.LIFTING
                route.turn(forward=False)
                return
        self._motion = follower.follow(asked, dt)

    def _is_home(self, q: Float[np.ndarray, "legs 3"], lost: list[int], most: float) -> bool:
        """Whether the feet of all legs at hand are within a distance [m] of neutral."""
        away = knees_and_feet(self.robot, q)[1] - knees_and_feet(self.robot, self._home)[1]
        return bool(np.abs(np.delete(away, lost, axis=0)).max() < most)

    def _rest_at(self, q: Float[np.ndarray, "legs 3"]) -> None:
        self._motion = JointMotion(q, 0 * q, 0 * q)

    def _say(self, time: float, sentence: str) -> None:
        self.events.append((time, sentence))

    def _lost(self, command: Command) -> list[int]:
        legs = len(self.robot.legs)
        return sorted(leg - 1 for leg in command.lost_legs if 1 <= leg <= legs)


def _targets(motion: JointMotion) -> JointTargets:
    return JointTargets(motion.position, motion.velocity)
