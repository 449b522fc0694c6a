"""Feet that find no ground where they come down look for it elsewhere."""

import numpy as np
import pytest

from phasmid.control import Command, Observation
from phasmid.control.engine import LocomotionEngine
from phasmid.control.feet import ELSEWHERE
from phasmid.control.state import PROBING, STANCE, SWING
from phasmid.kinematics import joint_angles
from phasmid.robot import load_robot

ROBOT = load_robot("phantomx-mk4")
NAMES = ROBOT.leg_names
DT = 0.005
DEPTH = 0.3
AHEAD = Command(velocity=(0.05, 0.0, 0.0))


class Walker:
    """An engine on level ground with a hole, whose feet feel what they touch, without sensors."""

    def __init__(self, begin, width):
        self.engine = LocomotionEngine(ROBOT, feeling=False, dynamics="none", period=1.0)
        self.q = joint_angles(ROBOT.arrays, ROBOT.arrays.neutral_foot)
        self.hole, self.time = (begin, begin + width), 0.0
        self.feels = True

    def is_over_hole(self, x):
        return (self.hole[0] < x) & (x < self.hole[1])

    def step(self):
        self.time += DT
        engine, foot = self.engine, self.engine.state.foot
        ground = np.where(self.is_over_hole(foot[:, 0]), -DEPTH, 0.0)
        engine.order.touch[:] = (foot[:, 2] <= ground + 1e-4) if self.feels else -1
        engine.update(Observation(time=self.time, joint_position=self.q), AHEAD)
        return engine.state


def front(walker):
    return float(walker.engine.state.foot[:, 0].max())


def walked(walker, seconds):
    """The state at each update: doing, feet, joint angles, support margin, how often it looked."""
    rows = []
    for _ in range(round(seconds / DT)):
        s = walker.step()
        rows.append((s.leg.copy(), s.foot.copy(), s.q[0].copy(), s.clock[5], s.search[:, 0].copy()))
    return [np.array(column) for column in zip(*rows, strict=True)]


@pytest.mark.parametrize("width", [0.03, 0.06])
@pytest.mark.parametrize("start", np.linspace(0.02, 0.08, 4))
def test_a_gap_is_stepped_over(start, width):
    """Every foot comes to stand beyond the gap, none in it, the body over those that stand."""
    walker = Walker(0.0, 0.0)
    begin = front(walker) + start
    walker.hole = begin, begin + width
    leg, foot, q, margin, search = walked(walker, 25.0)
    assert (foot[-1, :, 0] > walker.hole[1]).all()
    stands = leg == STANCE
    assert not (stands & walker.is_over_hole(foot[..., 0])).any()
    np.testing.assert_allclose(foot[stands, 2], 0.0, atol=2e-3)
    assert margin.min() >= 0.0
    most = ROBOT.servo.no_load_speed * DT
    assert np.abs(np.diff(q, axis=0)).max() <= most * (1 + 1e-9)
    # The gap lies where some foot would have landed, or it proves nothing.
    assert search.max() > 0
    assert (search[-1] == 0).all()


def test_a_foot_looks_ahead_first_and_then_as_far_behind():
    walker = Walker(0.0, 0.0)
    # Of all feet only those in front are over it, and find no ground on either side.
    walker.hole = front(walker) - 0.15, front(walker) + 1.0
    leg, foot, _, _, search = walked(walker, 3.0)
    looks = int(np.argmax(search[-1]))
    last = (leg[:-1, looks] == PROBING) & (leg[1:, looks] != PROBING)
    first, ahead, behind = foot[1:][last, looks, 0][:3]
    assert ahead - first == pytest.approx(ELSEWHERE[0], abs=1e-6)
    assert behind - ahead == pytest.approx(ELSEWHERE[1], abs=1e-6)


def test_it_gives_up_until_it_has_found_ground_again():
    walker = Walker(-10.0, 20.0)
    leg, _, _, _, search = walked(walker, 25.0)
    assert search.max() == len(ELSEWHERE) + 1
    # Each leg has told once; one that its reach stops on its way down does not tell the end of it.
    told = [sentence for _, sentence in walker.engine.events]
    ends = [f"leg {name} finds no ground there either: stands as planned" for name in NAMES]
    assert all(told.count(f"leg {name} finds no ground: looks elsewhere") == 1 for name in NAMES)
    assert [told.count(end) for end in ends] == (search[-1] > len(ELSEWHERE)).tolist()
    assert (np.diff(search, axis=0) >= 0).all()
    swings = (np.diff(leg, axis=0) != 0) & (leg[1:] == SWING)
    # Without ground it walks on as planned, as blind as before.
    assert swings.sum() > len(ELSEWHERE) * len(ROBOT.legs)
    walker.hole = 0.0, 0.0
    _, _, _, _, search = walked(walker, 5.0)
    assert (search[-1] == 0).all()


def test_feet_that_feel_nothing_do_not_look():
    walker = Walker(-10.0, 20.0)
    walker.feels = False
    *_, search = walked(walker, 5.0)
    assert (search == 0).all()
