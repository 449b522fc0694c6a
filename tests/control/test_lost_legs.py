"""A robot whose remaining legs cannot walk stands, on lost legs only where it would fall."""

from dataclasses import replace

import numpy as np
import pytest

from phasmid.control import LocomotionEngine
from phasmid.control.types import SUPPORT_MARGIN, LegPhase, LegUse
from phasmid.experiment import Command, Observation
from phasmid.gait import default_gait, limp, load_gait, support_margin
from phasmid.kinematics import centre_of_mass, joint_angles
from phasmid.robot import load_robot
from support.kinematic_world import drive

WALKING = 3.0
"""Time for which the robot walks before each loss [s]."""

CRAWL = 4.0
"""Cycle of four legs [s]: their swing of 2/3 s is 1/6 of it."""

ENGINES = {}


def engine_of(name):
    """Return an engine that rests, in a world without contacts; the next test reuses it."""
    if name not in ENGINES:
        ENGINES[name] = LocomotionEngine(load_robot(name), ground_sensing=False)
    engine = ENGINES[name]
    home = joint_angles(engine.robot.arrays, engine.robot.arrays.neutral_foot)
    engine.reset(Observation(0.0, home))
    return engine


class Recorder:
    """Engine that keeps the use of its legs, update by update."""

    def __init__(self, engine):
        self.engine, self.use = engine, []

    def __getattr__(self, name):
        return getattr(self.engine, name)

    def update(self, observation, command):
        targets = self.engine.update(observation, command)
        self.use.append(self.engine.telemetry()["leg_use"])
        return targets


@pytest.mark.parametrize(
    ("name", "gait", "losses"),
    [
        ("phantomx-ax", "tripod", [(5,), (2, 5), (2, 5, 6)]),
        ("phantomx-ax", "tripod", [(1,), (1, 4), (1, 4, 3)]),
        ("phantomx-ax", "wave", [(2, 5, 6)]),
        ("phantomx-ax", "ripple", [(1, 2)]),
        ("phantomx-ax", "tripod", [(2, 4, 6)]),
        ("lynxmotion-ch3r", "tripod", [(1, 2, 3)]),
        ("lynxmotion-ch3r", "wave", [(4,), (4, 6), (2, 4, 6)]),
        ("quadruped", "crawl", [(2,)]),
        ("octopod", "tetrapod", [(1, 2, 3), (1, 2, 3, 5, 6)]),
    ],
)
def test_it_stands_after_a_cycle_and_walks_again_with_all_its_legs(name, gait, losses):
    """After a cycle the body moves no more, and lost feet are in the air or needed.

    A foot counts as needed if the centre of mass is not `SUPPORT_MARGIN` inside the polygon of the
    others; legs that fold meanwhile move it by 2 mm.
    """
    engine = engine_of(name)
    velocity = (0.5 * engine.largest_velocity((1.0, 0.0, 0.0), gait=gait).velocity[0], 0.0, 0.0)
    commands = [(0.0, Command(velocity=velocity, gait=gait))]
    commands += [
        (WALKING * (1 + k), Command(velocity=velocity, gait=gait, lost_legs=frozenset(legs)))
        for k, legs in enumerate(losses)
    ]
    loss = WALKING * len(losses)
    cycle = 0.5 / load_gait(gait, len(engine.robot.legs)).swing_fraction
    settled = loss + (cycle if len(losses) == 1 else max(cycle, CRAWL))
    restored = settled + 2.0
    commands += [
        (restored, Command(velocity=velocity, gait=gait)),
        (restored + 3.0, Command(gait=gait)),
    ]
    recorder = Recorder(engine)
    seen = drive(recorder, commands, restored + 13.0)
    begin, end = round(settled / seen.dt), round(restored / seen.dt)
    assert seen.margin[:end].min() > 0
    moved = np.linalg.norm(seen.place[begin:end] - seen.place[begin], axis=1).max()
    assert moved < 1e-5
    lost, use = np.array(losses[-1]) - 1, np.array(recorder.use)[begin:end]
    needed, in_air = use[:, lost] == LegUse.NEEDED, ~seen.stance[begin:end, lost]
    assert (needed != in_air).all()
    assert (use[:, lost] != LegUse.IN_USE).all()
    assert (needed == needed[-1]).all()
    com = seen.body[end - 1] @ centre_of_mass(engine.robot, seen.q[end - 1]) + seen.place[end - 1]
    for leg in lost[needed[-1]]:
        others = seen.stance[end - 1].copy()
        others[leg] = False
        margin = support_margin(seen.feet[end - 1, :, :2], others, com[:2])
        assert margin < SUPPORT_MARGIN + 2e-3
    sentences = [sentence for time, sentence in seen.events if loss <= time < restored]
    names = engine.robot.leg_names
    for leg in lost:
        said = f"leg {names[leg]} is lost and stays on the ground: without it the robot falls"
        assert (said in sentences) == needed[-1, list(lost).index(leg)]
    assert any(sentence.startswith("stands: ") for _, sentence in seen.events)
    assert not any("lift waits" in sentence for sentence in sentences)
    assert engine.is_standing
    assert (seen.leg[-1] == LegPhase.STANCE).all()


@pytest.mark.parametrize("is_new", [False, True], ids=["same-command", "new-commands"])
def test_a_robot_that_stands_searches_no_gait_anew(is_new, monkeypatch):
    """The search for a gait on legs 3 to 6 takes as long as 20 updates, and is made once.

    A search is counted by the lift orders that it tries; the robot walks before it stands.
    """
    engine = engine_of("phantomx-ax")
    searches, best_order = [], limp.best_order
    monkeypatch.setattr(
        limp, "best_order", lambda *a, **k: searches.append(0) or best_order(*a, **k)
    )
    # Gaits without legs are kept by their gait.
    gait = replace(default_gait(6), name=f"of {is_new}")
    walks = Command(velocity=(0.05, 0.0, 0.0), gait=gait)
    command, first = replace(walks, lost_legs=frozenset({1, 2})), 0
    for k in range(600):
        if is_new:
            command = replace(command, velocity=(0.05 + 1e-5 * k, 0.0, 0.0))
        observation = Observation(0.005 * k, engine.state.q.copy())
        engine.update(observation, walks if k < 200 else command)
        first = first or len(searches)
    assert engine.is_lame
    assert engine.is_standing
    assert 0 < first == len(searches)
