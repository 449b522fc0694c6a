"""An engine on level ground with a trench across its way, whose feet feel what they touch."""

import numpy as np

from phasmid.control.engine import LocomotionEngine
from phasmid.control.types import LegPhase
from phasmid.experiment import Command, Observation
from phasmid.kinematics import joint_angles
from phasmid.robot import load_robot

ROBOT = load_robot("phantomx-mk4")
DT, SPEED = 0.005, 0.05
DEPTH = 0.3
WAYS = {"ahead": (1, 0), "back": (-1, 0), "left": (0, 1), "right": (0, -1)}


class Walker:
    """The engine, its command, and what each foot is told to feel: nan for what it touches."""

    def __init__(self, way="ahead", trench=(0.0, 0.0), *, robot=ROBOT, speed=SPEED, **settings):
        settings = {"ground_sensing": False, "dynamics": "none", "period": 1.0} | settings
        self.engine = LocomotionEngine(robot, **settings)
        self.q = joint_angles(robot.arrays, robot.arrays.neutral_foot)
        self.way, self.trench, self.time = np.array(WAYS[way]), trench, 0.0
        self.command = Command(velocity=(*(speed * self.way), 0.0))
        self.told = np.full(len(robot.legs), np.nan)

    @property
    def state(self):
        return self.engine.state

    @property
    def said(self):
        return [sentence for _, sentence in self.engine.events]

    def along(self, foot):
        return foot[..., :2] @ self.way

    @property
    def front(self):
        return float(self.along(self.state.foot).max())

    def is_over_trench(self, foot):
        return (self.trench[0] < self.along(foot)) & (self.along(foot) < self.trench[1])

    def step(self):
        self.time += DT
        engine, foot = self.engine, self.state.foot
        ground = np.where(self.is_over_trench(foot), -DEPTH, 0.0)
        felt = (foot[:, 2] <= ground + 1e-4).astype(float)
        engine.reference.contact[:] = np.where(np.isnan(self.told), felt, self.told)
        engine.update(Observation(time=self.time, joint_position=self.q), self.command)
        return engine.state

    def until(self, happens, most=6000):
        """Walk until something of the state is so, or so of any leg."""
        for _ in range(most):
            if np.any(happens(self.state)):
                return self.state
            self.step()
        raise AssertionError("it did not happen")

    def amid_swing(self, share):
        """Walk until a leg has swung for a share of its time; return its number."""
        state = self.until(
            lambda s: (s.leg_phase == LegPhase.SWING) & (s.swing_elapsed > share * s.swing_duration)
        )
        return int(np.argmax(state.leg_phase == LegPhase.SWING))

    def walk(self, seconds):
        """What legs do, feet, their speeds, joint angles, margin, search and path each update."""
        rows = []
        for _ in range(round(seconds / DT)):
            s = self.step()
            speed = np.linalg.norm(s.foot_velocity, axis=1)
            path, margin = self.along(s.path), s.clock.support_margin
            legs = s.leg_phase.copy(), s.foot.copy(), speed, s.q.copy()
            rows.append((*legs, margin, s.search_stage.copy(), path))
        return [np.array(column) for column in zip(*rows, strict=True)]
