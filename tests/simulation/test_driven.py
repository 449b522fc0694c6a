"""A controller drives the simulated robot in closed loop, recorded."""

import math
import re

import numpy as np
import pytest

from phasmid import drive, load_scenario, plan, simulate
from phasmid.control import Player, SafetyFilter
from phasmid.errors import InvalidInput
from phasmid.experiment import Command, JointTargets
from phasmid.simulation.closed_loop import period_steps

PAPER = load_scenario("paper").replace(duration=1.2, drive="prescribed")
WALK = plan(PAPER)


class Still:
    """Holds the joints where they were when it took over."""

    def __init__(self):
        self.seen, self.commands = [], []

    def reset(self, observation):
        self.q = observation.joint_position

    def update(self, observation, command):
        self.seen.append(observation)
        self.commands.append(command)
        return JointTargets(self.q, np.zeros_like(self.q))


def test_a_played_walk_is_the_simulated_one():
    # Between updates T = 5 ms apart the cubic misses the plan by T^4/384 of its fourth derivative,
    # which jumps at the switches: some 1e4 rad/s^4 give 2e-8 rad, and with 0.3 m of leg 5e-9 m.
    walked = simulate(PAPER, WALK)
    driven = drive(PAPER, Player(WALK))
    assert driven.attrs["ending"] == "COMPLETED"
    assert np.array_equal(driven.time, walked.time)
    apart = np.abs(driven.joint_position_target - walked.joint_position_target).max()
    assert float(apart) < 2e-8
    assert np.abs(driven.body_position.values - walked.body_position.values).max() < 5e-9
    # What the plan says of the time at which the targets are reached, told one update before.
    stance = WALK.sample(np.arange(241) * 5e-3 + 5e-3).stance
    assert np.array_equal(driven.stance[::5], stance)


def test_with_an_update_at_each_step_servos_are_told_what_the_walk_tells_them():
    servos = PAPER.replace(drive="ideal-servo", duration=0.3)
    walked = simulate(servos, WALK)
    driven = drive(servos, Player(WALK, rate=1000, lead=0.0), rate=1000)
    # Times k/1000 and k 1e-3 s differ by round-off, and so do the goals.
    assert np.abs(driven.joint_position_target - walked.joint_position_target).max() < 1e-14
    for name in ("joint_position", "joint_torque", "body_position", "foot_force"):
        assert np.abs(driven[name] - walked[name]).max() < 1e-9, name


def test_the_controller_is_asked_at_its_own_rate_and_told_the_truth():
    still = Still()
    run = drive(PAPER.replace(duration=0.1), still, Command(velocity=(0.1, 0.0, 0.2)), rate=250)
    assert [o.time for o in still.seen] == pytest.approx(np.arange(26) * 4e-3, abs=1e-12)
    rows = run.isel(time=slice(0, None, 4))
    assert np.array_equal(np.stack([o.joint_position for o in still.seen]), rows.joint_position)
    assert np.array_equal(np.stack([o.orientation for o in still.seen]), rows.body_orientation)
    # Of forces and contacts the last step's are the newest there are.
    felt = np.stack([o.foot_normal_force for o in still.seen[1:]])
    assert np.array_equal(felt, run.foot_normal_force[3:-1:4])
    assert all(o.contact.all() and o.servo_running.all() for o in still.seen)
    # It stands: one g upwards, within the engine's creep.
    assert still.seen[-1].acceleration == pytest.approx([0, 0, 9.81], abs=0.01)
    assert np.array_equal(run.velocity_command, np.tile([0.1, 0.0, 0.2], (101, 1)))


def test_the_commands_may_follow_time_and_what_is_observed_and_end_the_run():
    still = Still()

    def commands(time, observation):
        assert observation.time == time
        return None if time > 0.05 else Command(velocity=(time, 0.0, 0.0))

    run = drive(PAPER.replace(duration=1.0), still, commands)
    assert run.attrs["ending"] == "COMPLETED"
    assert float(run.time[-1]) == pytest.approx(0.054, abs=1e-9)
    assert float(run.velocity_command[-1, 0]) == pytest.approx(0.05)


def test_between_updates_joints_hold_go_on_or_reach_their_targets():
    # A joint asked for 0.01 rad further, and 2 rad/s, at each update of 5 ms.
    class Turning(Still):
        def update(self, observation, command):
            q = self.q.copy()
            q[0, 0] += 2.0 * observation.time
            qd = np.zeros_like(q)
            qd[0, 0] = 2.0
            return JointTargets(q, qd)

    servos, torques, prescribed = (
        drive(PAPER.replace(duration=0.02, drive=kind), Turning()).joint_position_target[:, 0, 0]
        for kind in ("ideal-servo", "torque", "prescribed")
    )
    step = np.arange(21)
    assert (servos - servos[0]).values == pytest.approx(2e-3 * (step // 5 * 5), abs=1e-12)
    assert (torques - torques[0]).values == pytest.approx(2e-3 * step, abs=1e-12)
    # One update late, and straight once the first period has brought it up to speed. It took over
    # where prescribed joints stood after 1 s: some nrad from where they were held.
    reached = (prescribed - prescribed[0]).values
    assert reached[10:] == pytest.approx(2e-3 * (step[10:] - 5), abs=1e-8)


def test_telemetry_is_recorded_as_it_stood_and_events_are_kept():
    class Telling(Still):
        events = ((0.0, "it began"),)

        def telemetry(self):
            return {"stance": np.arange(6) < len(self.seen)}

    run = drive(PAPER.replace(duration=0.02), Telling())
    assert run.stance.dtype == bool
    assert run.stance.sum("leg").values.tolist() == [1] * 5 + [2] * 5 + [3] * 5 + [4] * 5 + [5]
    assert run.attrs["events"] == '[[0.0, "it began"]]'


def test_a_controller_that_fails_ends_the_run_with_its_reason():
    class Failing(Still):
        def update(self, observation, command):
            targets = super().update(observation, command)
            if observation.time > 0.03:
                targets.position[2, 1] = np.nan
            return targets

    run = drive(PAPER, Failing())
    assert run.attrs["ending"] == "FAILED"
    assert run.attrs["ending_reason"].startswith("The controller failed at 0.035 s")
    leg = WALK.robot.leg_names[2]
    assert f"its target is not finite at {leg}.femur" in run.attrs["ending_reason"]
    assert np.isfinite(run.joint_position).all()


class Chatty(Still):
    def telemetry(self):
        return {"stanze": np.ones(6, dtype=bool)}


class Impostor(Still):
    def telemetry(self):
        return {"joint_position": self.q}


@pytest.mark.parametrize(
    ("controller", "options", "what"),
    [
        (
            Chatty(),
            {},
            'the controller\'s telemetry has the channel "stanze"; it must be one of '
            "phasmid.recording.CHANNELS that the simulation does not record.",
        ),
        (
            Impostor(),
            {},
            'the controller\'s telemetry has the channel "joint_position"; it must be one of '
            "phasmid.recording.CHANNELS that the simulation does not record.",
        ),
        (
            Still(),
            {"rate": math.nan},
            "rate is nan; it must be a finite number greater than 0.",
        ),
        (Still(), {"rate": -1}, "rate is -1; it must be a finite number greater than 0."),
    ],
)
def test_what_cannot_be_driven_is_refused_in_one_sentence(controller, options, what):
    with pytest.raises(InvalidInput) as caught:
        drive(PAPER, controller, **options)
    assert caught.value.what == what


def test_a_robot_begins_with_all_feet_near_a_slope_and_the_trunk_along_it():
    terrain = {"terrain": "slope", "slope": np.radians(10), "terrain_start": -50.0}
    slope = PAPER.replace(duration=0.5, drive="ideal-servo", **terrain)
    run = drive(slope, Still())
    assert run.attrs["ending"] == "COMPLETED"
    assert run.contact[0].all()
    w, _, y, _ = run.body_orientation[0].values
    assert 2 * np.degrees(np.arctan2(y, w)) == pytest.approx(-10, abs=0.1)


class Returning(Still):
    def __init__(self, targets):
        self.targets = targets

    def update(self, observation, command):
        return self.targets


Q = WALK.q[0]


@pytest.mark.parametrize("wrap", [lambda c: c, lambda c: SafetyFilter(c, WALK.robot)])
@pytest.mark.parametrize(
    ("targets", "words"),
    [
        (Q, "returned an array of shape (6, 3); it must return a phasmid.experiment.JointTargets"),
        (None, "returned None; it must return a phasmid.experiment.JointTargets"),
        ([0.0, 1.0], "returned [0.0, 1.0]; it must return a phasmid.experiment.JointTargets"),
        ({"position": Q}, "it must return a phasmid.experiment.JointTargets"),
        (JointTargets(Q[:5], Q[:5]), "has shape (5, 3); it must have shape (6, 3)"),
        (JointTargets(Q.ravel(), Q.ravel()), "has shape (18,); it must have shape (6, 3)"),
        (JointTargets(Q, 0.0), "velocity of the controller's JointTargets has shape ()"),
        (JointTargets(Q, Q, Q[0]), "torque of the controller's JointTargets has shape (3,)"),
        (JointTargets(None, None, Q), "position of the controller's JointTargets is None"),
        (JointTargets("q", Q), 'position of the controller\'s JointTargets is "q"'),
    ],
)
def test_what_a_controller_returns_beside_targets_is_named(targets, words, wrap):
    """Alone and within the safety filter, in place of an AttributeError or a broadcast."""
    with pytest.raises(InvalidInput, match=re.escape(words)):
        drive(PAPER, wrap(Returning(targets)))


def test_lists_are_targets():
    """Lists of the right shape are the same targets as arrays."""
    lists = drive(
        PAPER.replace(duration=0.02), Returning(JointTargets(Q.tolist(), (0 * Q).tolist()))
    )
    arrays = drive(PAPER.replace(duration=0.02), Returning(JointTargets(Q, 0 * Q)))
    assert (lists.joint_position.values == arrays.joint_position.values).all()


@pytest.mark.parametrize(
    ("command", "words"),
    [((0.1, 0, 0), "returned (0.1, 0, 0)"), ("walk", 'returned "walk"')],
)
def test_a_function_of_commands_returns_commands(command, words):
    """A velocity alone is no command."""
    with pytest.raises(InvalidInput, match=re.escape(f"the function of commands {words}; it must")):
        drive(PAPER, Still(), lambda time, observation: command)


@pytest.mark.parametrize(
    ("telemetry", "words"),
    [
        ({"stance": np.ones(5, bool)}, "has shape (5,); it must have shape (6,)"),
        ([1.0], "telemetry returned [1.0]; it must return numbers by channel name"),
        (
            {"gait_phase": "x"},
            'gait_phase of the controller\'s telemetry is "x"; it must be a number',
        ),
    ],
)
def test_telemetry_is_numbers_by_name(telemetry, words):
    """What is none is named at the first update."""
    controller = Still()
    controller.telemetry = lambda: telemetry
    with pytest.raises(InvalidInput, match=re.escape(words)):
        drive(PAPER, controller)


@pytest.mark.parametrize("dt", [0.0003, 0.00035, 0.0007, 0.0009])
@pytest.mark.parametrize("rate", [200.0, 123.0, 30.0])
def test_a_rate_that_is_proposed_is_accepted_as_printed(dt, rate):
    """Enough digits are printed for a whole number of steps."""
    scenario = PAPER.replace(dt=dt)
    with pytest.raises(InvalidInput) as refusal:
        period_steps(scenario.build(), rate)
    proposed = float(refusal.value.hint.removeprefix("rate = "))
    assert period_steps(scenario.build(), proposed) == round(1 / (rate * dt))
