"""Controller that stands up, lies down and moves legs on their own, around one that walks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import Enum
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.arguments import checked
from phasmid.control.sequences.ground import GroundPlane, knees_and_feet, resting_ground
from phasmid.control.sequences.joint_path import JointPath, Route, SetpointFilter, largest_speed
from phasmid.control.sequences.leg_loss import LegFaultDetector, lifted_leg
from phasmid.control.sequences.manual_leg import ManualLegs, lift_legs
from phasmid.control.sequences.posture import Packing, fold_legs, get_up, packing
from phasmid.control.sequences.stance import neutral_stance, stance_on, to_neutral
from phasmid.control.sequences.start import StartJudge
from phasmid.errors import InfeasibleWalk
from phasmid.experiment.command import Command, Posture
from phasmid.experiment.controller import Controller
from phasmid.experiment.observation import Observation
from phasmid.experiment.targets import JointTargets, checked_targets
from phasmid.robot import JOINTS, Robot

STILL_SPEED, STILL_TIME = 0.01, 0.1
"""The walking controller rests if its joints have been slower for that time [rad/s, s]."""

SAME_ANGLE = 1e-6
"""Deviation of joints that are in the neutral stance [rad]."""

AT_HOME = 1e-3
"""Deviation of feet from their commanded neutral places that needs no step [m]."""

LONGEST_STEP = 0.05
"""Longest time step; after a longer gap the motion continues as after this [s]."""


class Stage(Enum):
    """Stage of a sequence; channel ``sequence`` holds the value."""

    LYING = 0
    GETTING_UP = 1
    STANDING = 2
    STOPPING = 3
    LIFTING = 4
    MANUAL_LEG = 5
    GATHERING = 6
    STARTING = 7


class Sequencer:
    """Stands up, lies down and moves legs on their own; otherwise another controller walks.

    It begins with any joint angles, on the belly or on the feet. ``PACKED`` folds the legs under a
    lying robot; ``STANDING`` and ``WALKING`` raise it to the neutral stance, where the walking
    controller takes over. When the command changes during a sequence, the robot returns smoothly
    on the same path.

    Args:
        walker: The walking controller; it is reset in the neutral stance.
        robot: The robot, L legs.

    Attributes:
        events: Times [s] and sentences since `reset`, those of the walking controller included.
        stage: Present stage.
    """

    @checked
    def __init__(self, walker: Controller, robot: Robot) -> None:
        self.walker, self.robot = walker, robot
        self.events: list[tuple[float, str]] = []
        self._faults = LegFaultDetector(robot)
        self._neutral = neutral_stance(robot)
        self._shape = len(robot.legs), len(JOINTS)
        self._packing: Packing | None = None
        try:
            self._packing = packing(robot)
        except InfeasibleWalk as error:
            self._packing_error = error.what
        self._clear(0.0)

    def _clear(self, time: float) -> None:
        self._time, self._rest_time = time, 0.0
        self.stage, self._end = Stage.LYING, Stage.LYING
        self._faults.reset(time)
        self._targets = _at_rest(self._neutral.q)
        self._route: Route | None = None
        self._judge: StartJudge | None = None
        self._manual: ManualLegs | None = None
        self._filter: SetpointFilter | None = None
        self._lost: list[int] = []
        # Whether to lie down, numbers of manual legs, and of lost ones.
        self._request: tuple[bool, tuple[int, ...], frozenset[int]] = False, (), frozenset()
        self._refused: tuple[bool, tuple[int, ...], frozenset[int]] | None = None
        self._merged: tuple[Command, frozenset[int], Command] | None = None
        self._stop_command = Command(posture=Posture.STANDING)

    def reset(self, observation: Observation) -> None:
        """Begin with the robot as it is observed."""
        self._clear(observation.time)
        self.take_events()
        q = np.array(observation.joint_position, dtype=float)
        unknown = ~np.isfinite(q)
        if unknown.any():
            q[unknown] = (self._packing.folded if self._packing else self._neutral.q)[unknown]
            self._report("joint angles are not known; they are taken for folded.")
        self._targets = _at_rest(q)
        if self._packing is None or np.abs(q - self._neutral.q).max() < SAME_ANGLE:
            self._walk_on(observation)
            return
        self._judge, self.stage = StartJudge(self.robot, q, observation.time), Stage.STARTING
        self._start(observation)

    def _start(self, observation: Observation) -> None:
        """Begin to step to neutral or to fold, as soon as it is known whether the robot stands."""
        assert self._judge is not None
        stands, ground, q = self._judge.add(observation), self._judge.ground, self._targets.position
        if stands is None:
            return
        self.stage = Stage.LYING
        if stands and self._judge.at_home:
            path = JointPath.through([q, self._neutral.q], self.robot, loaded=True)
            self._begin([path], Stage.GATHERING)
        elif not (stands and self._gather(observation, ground)):
            assert self._packing is not None
            paths = fold_legs(self.robot, q, self._packing.folded, ground)
            if paths:
                self._begin(paths, Stage.GATHERING, Stage.LYING)

    def update(self, observation: Observation, command: Command) -> JointTargets:
        """Return joint targets until the next update."""
        dt = min(max(observation.time - self._time, 0.0), LONGEST_STEP)
        self._time = observation.time
        self._detect_faults(observation)
        command = self._with_lost_legs(command)
        packs, numbers = command.posture is Posture.PACKED, tuple(sorted(command.legs))
        self._request = packs, numbers, command.lost_legs
        self._lost = [i for i in range(len(self.robot.legs)) if i + 1 in command.lost_legs]
        if self.stage is Stage.STARTING:
            self._start(observation)
        if self.stage in (Stage.STANDING, Stage.STOPPING):
            if not (packs or numbers):
                self._refused = None
            elif self._request != self._refused:
                return self._stop(observation, command, dt)
            self.stage = Stage.STANDING
            return self._walk(observation, self._stop_command if packs else command)
        holds = self._manual is not None and not packs and numbers == self._manual.numbers
        if self.stage is Stage.LYING and not packs and self._request != self._refused:
            paths = self._rising_paths()
            if paths:
                self._begin(paths, Stage.GETTING_UP)
        if self.stage is Stage.MANUAL_LEG:
            self._move_legs(command if holds else None, dt)
        elif self.stage not in (Stage.STARTING, Stage.LYING):
            forward = {Stage.GETTING_UP: not packs, Stage.LIFTING: holds}.get(self.stage, True)
            self._follow_route(observation, dt, forward=forward)
        return self._targets

    def telemetry(self) -> Mapping[str, Any]:
        """Return the stage's value and the channels of the walking controller."""
        return {**getattr(self.walker, "telemetry", dict)(), "sequence": float(self.stage.value)}

    def take_events(self) -> list[tuple[float, str]]:
        """Return the events since the last call, and clear them."""
        self.events += self._call_walker("take_events") or []
        events, self.events = self.events, []
        return events

    def _report(self, sentence: str) -> None:
        self.events.append((self._time, sentence))

    def _refuse(self, sentence: str) -> None:
        """Report that the command is infeasible, and ignore it until it changes."""
        self._report(sentence)
        self._refused = self._request

    # Lost legs

    def _detect_faults(self, observation: Observation) -> None:
        was_doubtful, names = self._faults.doubtful, self.robot.leg_names
        lost = self._faults.update(observation)
        if self._faults.doubtful and not was_doubtful:
            # The leg may not carry load: swing legs land at once. Only at the beginning, because
            # on a slow bus some servo is always silent.
            self._call_walker("catch")
        for leg, joint in lost:
            self._report(f"servo {names[leg]}.{JOINTS[joint]} answers no more; its leg is lost.")
        for leg in sorted({leg for leg, _ in lost}):
            dead = np.flatnonzero(self._faults.lost[leg]).tolist()
            height, measured = float(self._neutral.pose[2]), observation.joint_position[leg]
            q, clearance = lifted_leg(self.robot, leg, height, dead, measured)
            if clearance <= 0:
                self._report(f"leg {names[leg]} may drag on the ground.")
            self._call_walker("fold", leg, q)

    def _with_lost_legs(self, command: Command) -> Command:
        """Return the command with detected faults; the same object while nothing changes."""
        lost = self._faults.legs
        if lost <= command.lost_legs:
            return command
        if not (self._merged and self._merged[0] is command and self._merged[1] == lost):
            merged = replace(command, lost_legs=command.lost_legs | lost)
            self._merged = command, lost, merged
        return self._merged[2]

    def _call_walker(self, method: str, *args: Any) -> Any:
        """Call a method that the walking controller may have; return its result, or None."""
        function = getattr(self.walker, method, None)
        return None if function is None else function(*args)

    # Stages

    def _walk(self, observation: Observation, command: Command) -> JointTargets:
        targets = self.walker.update(observation, command)
        self._targets = checked_targets(targets, self._shape)
        self.events += self._call_walker("take_events") or []
        return self._targets

    def _walk_on(self, observation: Observation) -> None:
        """Hand over to the walking controller, at rest."""
        self.events += self._call_walker("take_events") or []
        self.stage, self._route = Stage.STANDING, None
        q = self._targets.position.copy()
        # A lost leg that still stands is folded by the walking controller.
        away = np.abs(q - self._neutral.q).max(axis=1) >= SAME_ANGLE
        held = [leg for leg in self._lost if away[leg]] if hasattr(self.walker, "hold") else []
        q[held] = self._neutral.q[held]
        self.walker.reset(replace(observation, joint_position=q))
        for leg in held:
            self._call_walker("hold", leg, self._targets.position[leg])

    def _stop(self, observation: Observation, command: Command, dt: float) -> JointTargets:
        """Bring the walking controller to rest, then begin a sequence."""
        if self.stage is Stage.STANDING:
            self.stage, self._rest_time = Stage.STOPPING, 0.0
        stop = Command(
            posture=Posture.STANDING,
            gait=command.gait,
            period=command.period,
            lost_legs=command.lost_legs,
        )
        if stop != self._stop_command:
            self._stop_command = stop
        previous = self._targets.position
        targets = self._walk(observation, self._stop_command)
        step = float(np.abs(targets.position - previous).max())
        speed = max(float(np.abs(targets.velocity).max()), step / max(dt, 1e-9))
        self._rest_time = self._rest_time + dt if speed < STILL_SPEED else 0.0
        if self._rest_time < STILL_TIME:
            return targets
        self._targets = _at_rest(np.array(targets.position))
        ground = resting_ground(self.robot, self._targets.position)
        if command.posture is not Posture.PACKED:
            self._lift(sorted(command.legs), ground)
        elif self._at_home(AT_HOME):
            self._lie_down(observation)
        elif not self._gather(observation, ground):
            self._refuse("the robot cannot sit down from here: its feet cannot step home.")
        return targets

    def _begin(
        self,
        paths: Sequence[JointPath],
        stage: Stage,
        end: Stage = Stage.STANDING,
        *,
        backwards: bool = False,
    ) -> None:
        """Begin a stage along paths; another one follows at the end of the last path."""
        self._route = Route(paths, backwards=backwards)
        self.stage, self._end = stage, end

    def _follow_route(self, observation: Observation, dt: float, *, forward: bool) -> None:
        """Advance along the route; at its end begin the next stage."""
        assert self._route is not None
        self._targets = self._route.advance(dt, forward=forward)
        if not self._route.finished:
            return
        if self._end is Stage.MANUAL_LEG and forward:
            self.stage = Stage.MANUAL_LEG
            self._filter = SetpointFilter(self._targets.position, largest_speed(self.robot))
        elif self._end is Stage.LYING or (self.stage is Stage.GETTING_UP and not forward):
            self.stage = Stage.LYING
        elif self.stage is Stage.GATHERING and self._request[0]:
            self._lie_down(observation)
        else:
            self._walk_on(observation)

    def _gather(self, observation: Observation, ground: GroundPlane) -> bool:
        """Begin to step to the neutral stance; return whether that is possible."""
        stance = stance_on(self.robot, self._targets.position, ground)
        lifted = np.flatnonzero(~ground.contact).tolist()
        plan = to_neutral(self.robot, stance, lifted=lifted, lost=self._lost)
        if plan is None:
            return False
        if plan.paths:
            self._begin(plan.paths, Stage.GATHERING)
        else:
            self._walk_on(observation)
        return True

    def _lie_down(self, observation: Observation) -> None:
        """Begin to lie down on the reversed paths of getting up; go on walking without such."""
        paths = self._rising_paths()
        if not paths:
            self._walk_on(observation)
            return
        standing, present = paths[-1].at(paths[-1].duration).position, self._targets.position
        if not np.array_equal(standing, present):
            # The walking controller rests within a millimetre of the neutral stance.
            paths.append(JointPath.through([standing, present], self.robot, loaded=True))
        self._begin(paths, Stage.GETTING_UP, backwards=True)

    def _rising_paths(self) -> list[JointPath]:
        """Return paths from lying to standing; none, and refuse the command, if there is no way."""
        if self._packing is None:
            self._refuse(self._packing_error)
            return []
        held = {leg: self._targets.position[leg] for leg in self._lost}
        try:
            return get_up(self.robot, self._packing, held)
        except InfeasibleWalk as error:
            self._refuse(error.what)
            return []

    def _at_home(self, most: float) -> bool:
        """Return whether the feet in use are within a distance [m] of their neutral places."""
        q = self._targets.position, self._neutral.q
        feet, neutral = (knees_and_feet(self.robot, angles)[1] for angles in q)
        distances = np.abs(np.delete(feet - neutral, self._lost, axis=0))
        return bool(distances.max(initial=0.0) < most)

    # Manual legs

    def _lift(self, numbers: list[int], ground: GroundPlane) -> None:
        """Begin to lift manual legs, or refuse."""
        self._manual = None
        legs, lost = range(1, len(self.robot.legs) + 1), [leg + 1 for leg in self._lost]
        why, refused = "there is no such leg", [n for n in numbers if n not in legs]
        if not refused:
            why, refused = "it is lost", [n for n in numbers if n in lost]
        if not refused:
            stance = stance_on(self.robot, self._targets.position, ground)
            self._manual = lift_legs(self.robot, stance, numbers, self._lost)
            if self._manual is not None:
                self._begin(self._manual.paths, Stage.LIFTING, Stage.MANUAL_LEG)
                return
            why, refused = "the other legs would not hold the robot", numbers
        names = [self.robot.leg_names[n - 1] if n in legs else str(n) for n in refused]
        self._refuse(f"leg {' and '.join(names)} cannot be moved by hand: {why}.")

    def _move_legs(self, command: Command | None, dt: float) -> None:
        """Move lifted legs as commanded; without a command return to where they were lifted."""
        assert self._manual is not None
        assert self._filter is not None
        if command is not None:
            target, sentences = self._manual.target(command.legs)
            for sentence in sentences:
                self._report(sentence)
        else:
            target = self._manual.stance.q
            if self._filter.arrived(target):
                self.stage = Stage.LIFTING
                return
        self._targets = self._filter.advance(target, dt)


def _at_rest(q: Float[np.ndarray, "legs 3"]) -> JointTargets:
    return JointTargets(q, 0 * q)
