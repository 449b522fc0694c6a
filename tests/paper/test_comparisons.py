"""The comparison of force models with simulated contact, on forces that are known."""

import numpy as np
import pytest

from phasmid import kinematics
from phasmid.motion import plan
from phasmid.paper import comparisons
from phasmid.paper.evidence import Trial
from phasmid.reporting import summarise
from phasmid.scenario import load_scenario
from phasmid.simulation import simulate

SHORT = load_scenario("paper").replace(duration=4.0)


@pytest.fixture(scope="module")
def trial():
    walk = plan(SHORT)
    recording = simulate(SHORT, walk)
    fine = walk.sample(np.asarray(recording["time"].values))
    return Trial(SHORT, fine, recording, summarise(recording))


def with_force(trial, force, torque=None):
    recording = trial.recording.copy(deep=True)
    recording["foot_force"].values[...] = force
    if torque is not None:
        recording["joint_torque"].values[...] = torque
    return Trial(trial.scenario, trial.walk, recording, trial.summary)


def test_models_are_compared_with_forces_and_torques(trial):
    # 3-4-5: (0.3, 0.4) N along the ground are 0.5 N, at every sample.
    force, torque = comparisons.model_force_and_torque(trial, "minimum-torque")
    own = with_force(trial, force + np.array([0.3, 0.4, 1.2]), torque + 0.1)
    assert comparisons.model_differences(own, "minimum-torque") == pytest.approx(
        (1.2, 0.5, 0.1), rel=1e-9
    )
    assert comparisons.model_differences(own, "minimum-norm")[1] > 1.0


def test_a_squeeze_is_told_from_what_is_none(trial):
    # The minimum torque's forces differ from those of minimum norm by a squeeze alone; an upward
    # newton on each foot is none.
    force, _ = comparisons.model_force_and_torque(trial, "minimum-torque")
    least = trial.channel("foot_force_model")
    amid = trial.amid_stance
    expected = np.sqrt(np.mean(np.sum((force - least)[amid] ** 2, axis=1)))
    pure = comparisons.squeeze(with_force(trial, force))
    # Feet are simulated a little beside their plan, by 1e-4 of their distances.
    assert pure.internal == pytest.approx(expected, rel=1e-3)
    assert pure.remainder < 1e-3 * expected
    lifted = comparisons.squeeze(with_force(trial, least + np.array([0, 0, 1.0])))
    assert lifted.remainder == pytest.approx(1.0, rel=1e-3)
    assert lifted.internal < 1e-3


def test_the_share_of_a_squeeze_and_its_fading_are_read_off(trial):
    # A squeeze that fades as exp(-t / 0.5 s) from touchdown on.
    force, _ = comparisons.model_force_and_torque(trial, "minimum-torque")
    since = (trial.walk.time % 1.0)[:, None, None]
    shares, fading = comparisons.relaxation(with_force(trial, force * np.exp(-since / 0.5)))
    assert shares == pytest.approx(np.exp(-np.array(comparisons.AFTER_TOUCHDOWN) / 0.5), rel=1e-9)
    assert fading == pytest.approx(0.5, rel=1e-9)


def test_a_squeeze_fades_with_damping_and_give(trial):
    # Four points of 500 N·s/m against joints of stiffness k. An outward push p on the foot turns
    # femur and tibia by Jᵀ p / k, with lever arms of their heights: 100 mm and that of the knee.
    robot = trial.walk.robot
    leg = robot.legs[0]
    q = kinematics.joint_angles(leg, leg.neutral_foot)
    knee = leg.femur.length * np.sin(q[1])
    give = (0.1**2 + (0.1 + knee) ** 2) / robot.servo.stiffness
    assert comparisons.fading_time(trial) == pytest.approx(4 * 500.0 * give, rel=1e-9)
