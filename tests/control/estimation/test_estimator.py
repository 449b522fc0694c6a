"""What is felt as a whole: sensors that fail, lie and return, and never a jump."""

import dataclasses

import numpy as np
import pytest

from phasmid.control import Observation
from phasmid.control.estimation import EstimatorSettings
from phasmid.control.estimation.estimator import GroundEstimator
from phasmid.control.estimation.feeling import Intent, feel
from phasmid.control.estimation.state import SOURCE, leg_margin, state_at
from phasmid.errors import InvalidInput
from phasmid.kinematics import (
    hip_from_body,
    joint_angles,
    neutral_feet,
    quaternion_rotation,
    rpy_quaternion,
)
from phasmid.robot import load_robot
from phasmid.units import STANDARD_GRAVITY

ROBOT = load_robot("phantomx-mk4")
DT = 0.005
NEUTRAL = neutral_feet(ROBOT)
HEIGHT = -NEUTRAL[:, 2].mean()
Q = joint_angles(ROBOT.arrays, hip_from_body(ROBOT, NEUTRAL))
TRIPOD = np.array([True, False, True, False, True, False])


class World:
    """A robot that steps on the spot in a tripod, on ground that lies by roll and pitch."""

    def __init__(self, roll=0.0, pitch=0.0, **settings):
        self.stage = GroundEstimator(ROBOT, EstimatorSettings(**({"level": 1.0} | settings)), DT)
        self.slope = roll, pitch
        self.time = 0.0
        self.events, self.track = [], []
        self.stage.reset(self.observation(np.ones(6, dtype=bool)))

    def observation(self, down, **changed):
        # A sensor that lives is never quite still.
        tremor = 1e-6 * (self.time / DT % 7)
        q = rpy_quaternion(*(np.array(v) for v in (self.slope[0] + tremor, self.slope[1], 0.0)))
        o = Observation(
            time=self.time,
            joint_position=Q,
            orientation=q,
            angular_velocity=np.zeros(3),
            acceleration=STANDARD_GRAVITY * quaternion_rotation(q)[2],
            contact=down,
            foot_normal_force=np.where(down, 2 * ROBOT.mass * STANDARD_GRAVITY / 6, 0.0),
        )
        return dataclasses.replace(o, **changed)

    def walk(self, steps, change=lambda down: {}):
        """Steps of 0.3 s; a function tells what of the observation is another."""
        for n in range(steps):
            standing = TRIPOD if n % 2 else ~TRIPOD
            for k in range(60):
                self.time += DT
                share = k / 60
                down = standing | (share < 0.03)
                intent = Intent(
                    standing.copy(),
                    np.where(standing, 0.0, share),
                    NEUTRAL + np.array([0.0, 0.0, HEIGHT]),
                    np.zeros(3),
                    np.array([0.0, 0.0, HEIGHT]),
                    np.eye(3),
                    np.eye(3),
                    Q,
                    True,
                )
                self.stage.hear(self.observation(down, **change(down)))
                felt = self.stage.senses
                self.events += self.stage.tell(feel(felt, self.stage.tuning, intent))
                self.track.append(felt.correction.copy())
        return felt


@pytest.mark.parametrize(("legs", "late", "lag"), [(4, 1, 1), (6, 5, 9), (8, 3, 2)])
def test_the_senses_fill_their_rows(legs, late, lag):
    """Each number belongs to one array: none is left over, and none is in two."""
    numbers, codes = leg_margin(legs, late, lag)
    senses = state_at(numbers, codes, legs)
    for n, part in enumerate(senses):
        if part is not senses.counts:
            part[:] += n + 1
    told = np.concatenate([part.ravel() for part in senses])
    assert len(told) == len(numbers) + len(codes)
    assert all(np.unique(part).size == 1 for part in senses if part is not senses.counts)
    assert numbers.all()
    assert codes[len(senses.counts) :].all()


def test_admittance_listens_to_the_joints_where_no_foot_tells_its_force():
    """Switches tell of contact; what gives way needs forces, by the joints' loads."""
    world = World(admittance=True)
    everything = np.ones(6, dtype=bool)
    heavy = {"foot_normal_force": None, "joint_load": np.full((6, 3), -0.2)}
    world.stage.reset(world.observation(everything, **heavy))
    felt = world.walk(4, lambda down: heavy)
    assert felt.touch[~TRIPOD].tolist() == [0, 0, 0]
    before = felt.give[TRIPOD, 0].copy()
    assert np.abs(before).min() > 1e-4
    heavier = heavy | {"joint_load": np.full((6, 3), -0.3)}
    felt = world.walk(2, lambda down: heavier)
    # Within a stance of 0.3 s a foot of 22 ms has come to rest; by another force, elsewhere.
    assert np.abs(felt.give[TRIPOD, 0] - before).min() > 1e-4


def test_healthy_sensors_have_no_news():
    world = World()
    felt = world.walk(6)
    assert world.events == []
    assert set(felt.touch) == {0, 1}
    # The tremor of 7e-6 rad at most, and by it no more than the height times it.
    np.testing.assert_allclose(felt.correction, 0.0, atol=7e-6)


def test_feet_without_switches_and_forces_are_felt_by_the_joints():
    """Torques of the plan's statics, for a foot that carries twice its share, and for none."""
    from phasmid.dynamics import leg_torque

    def loads(down):
        force = np.zeros((6, 3))
        force[:, 2] = np.where(down, 2 * ROBOT.mass * STANDARD_GRAVITY / 6, 0.0)
        still = np.zeros((6, 3))
        torque = leg_torque(ROBOT.arrays, Q, still, still, foot_force=force)
        return torque / ROBOT.servo.stall_torque

    world = World()
    everything = np.ones(6, dtype=bool)
    none = {"contact": None, "foot_normal_force": None}
    world.stage.reset(world.observation(everything, **none, joint_load=loads(everything)))
    felt = world.walk(5, lambda down: {**none, "joint_load": loads(down)})
    np.testing.assert_array_equal(felt.touch, np.where(TRIPOD, 0, 1))
    assert world.events == []


def test_soft_servos_feel_by_what_they_give_way():
    """A load of tau turns a servo of stiffness k by tau / k off its target."""
    from phasmid.dynamics import leg_torque

    def angles(down):
        force = np.zeros((6, 3))
        force[:, 2] = np.where(down, 2 * ROBOT.mass * STANDARD_GRAVITY / 6, 0.0)
        still = np.zeros((6, 3))
        torque = leg_torque(ROBOT.arrays, Q, still, still, foot_force=force)
        return Q - torque / ROBOT.servo.stiffness

    world = World()
    everything = np.ones(6, dtype=bool)
    none = {"contact": None, "foot_normal_force": None}
    world.stage.reset(world.observation(everything, **none))
    felt = world.walk(5, lambda down: {**none, "joint_position": angles(down)})
    np.testing.assert_array_equal(felt.touch, np.where(TRIPOD, 0, 1))
    # What the legs give way is made up for by raising the body.
    assert 0 < felt.correction[2] <= EstimatorSettings().height_limit


@pytest.mark.parametrize(
    ("lie", "said"),
    [
        (lambda down: {"contact": None}, "contact switch of leg right_front tells no number"),
        (
            lambda down: {"contact": np.ones(6, dtype=bool)},
            "contact switch of leg right_front feels the ground all through swings",
        ),
        (
            lambda down: {"contact": np.zeros(6, dtype=bool)},
            "contact switch of leg right_front never feels the ground",
        ),
    ],
)
def test_switches_that_fail_are_said_once_and_forces_are_heard(lie, said):
    world = World()
    world.walk(3)
    felt = world.walk(9, lie)
    assert sum(event.startswith(said) for event in world.events) == 1
    # The walk ends in the stance of every second foot.
    np.testing.assert_array_equal(felt.touch, np.where(~TRIPOD, 1, 0))


def test_without_any_sensor_the_plan_is_trusted():
    blind = dict.fromkeys(
        ("contact", "foot_normal_force", "orientation", "angular_velocity", "acceleration")
    )
    world = World()
    felt = world.walk(4, lambda down: blind | {"joint_position": np.full((6, 3), np.nan)})
    assert set(felt.touch) == {-1}
    assert felt.counts[SOURCE] == 0
    np.testing.assert_array_equal(felt.correction, 0.0)


def test_no_failure_makes_the_correction_jump():
    """Bounded by its largest speeds, whatever dies, lies or returns."""
    world, s = World(0.1, -0.15), EstimatorSettings()
    nothing = np.full(4, np.nan)
    upside_down = np.array([0.0, 1.0, 0.0, 0.0])
    world.walk(8)
    for wrong in (
        {"orientation": None},
        {"orientation": nothing, "acceleration": np.full(3, np.nan)},
        {"orientation": upside_down},
        {"orientation": nothing, "angular_velocity": np.full(3, 1e9)},
        {"orientation": None, "angular_velocity": None, "acceleration": None},
        {},
    ):
        world.walk(4, lambda down, wrong=wrong: wrong)
    speed = np.diff(np.array(world.track), axis=0) / DT
    assert np.isfinite(speed).all()
    assert np.hypot(speed[:, 3], speed[:, 4]).max() <= s.level_rate * (1 + 1e-9)
    assert np.hypot(speed[:, 0], speed[:, 1]).max() <= s.shift_rate * (1 + 1e-9)


def test_a_dead_inertial_sensor_lets_levelling_ease_out():
    world = World(0.0, -0.15)
    held = world.walk(20)
    assert held.correction[4] == pytest.approx(0.15, abs=1e-3)
    dead = {"orientation": None, "angular_velocity": None, "acceleration": None}
    world.walk(1, lambda down: dead)
    assert world.events == ["no inertial sensor is to be believed; levelling eases out"]
    felt = world.walk(40, lambda down: dead)
    # 12 s of a time of 2 s, twice in a row.
    assert abs(felt.correction[4]) < 0.15 * 0.02
    world.walk(1)
    assert world.events[1:] == ["the inertial sensor's orientation is heard"]


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"force_on": 0.1}, "force_off is 0.16; it must be at most force_on, 0.1."),
        ({"level": 1.5}, "level is 1.5; it must be 1 or less."),
        ({"level_time": 0.0}, "level_time is 0; it must be a finite number, greater than 0."),
        ({"shift": float("nan")}, "shift is nan; it must be a finite number, 0 or more."),
    ],
)
def test_settings_that_cannot_be_are_refused(settings, said):
    with pytest.raises(InvalidInput) as error:
        EstimatorSettings(**settings)
    assert error.value.what == said
