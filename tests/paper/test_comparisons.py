"""The comparison of force models with simulated contact, on forces that are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from phasmid.motion import plan
from phasmid.paper import comparisons
from phasmid.paper.evidence import Trial
from phasmid.paper.walking import force_differences
from phasmid.reporting import summarise
from phasmid.scenario import load_scenario
from phasmid.simulation import simulate

SHORT = load_scenario("paper").replace(duration=4.0)


@pytest.fixture(scope="module")
def trial() -> Trial:
    walk = plan(SHORT)
    recording = simulate(SHORT, walk)
    fine = walk.sample(np.asarray(recording["time"].values))
    return Trial(SHORT, fine, recording, summarise(recording))


def with_force(trial: Trial, force: np.ndarray, torque: np.ndarray | None = None) -> Trial:
    recording = trial.recording.copy(deep=True)
    recording["foot_force"].values[...] = force
    if torque is not None:
        recording["joint_torque"].values[...] = torque
    return Trial(trial.scenario, trial.walk, recording, trial.summary)


def test_differences_are_rms_of_normal_and_of_tangential_vectors(trial: Trial) -> None:
    # 3-4-5: (0.3, 0.4) N along the ground are 0.5 N, at every sample.
    model = trial.channel("foot_force_model")
    seen = with_force(trial, model + np.array([0.3, 0.4, 1.2]))
    normal, tangential, _ = force_differences(seen)
    assert (normal, tangential) == pytest.approx((1.2, 0.5), rel=1e-12)


def test_models_are_compared_with_forces_and_torques(trial: Trial) -> None:
    force, torque = comparisons.model_force_and_torque(trial, "minimum-torque")
    own = with_force(trial, force, torque + 0.1)
    assert comparisons.model_differences(own, "minimum-torque") == pytest.approx(
        (0.0, 0.0, 0.1), rel=1e-9, abs=1e-12
    )
    assert comparisons.model_differences(own, "minimum-norm")[1] > 1.0


def test_a_squeeze_is_told_from_what_is_none(trial: Trial) -> None:
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


def test_the_share_of_a_squeeze_and_its_fading_are_read_off(trial: Trial) -> None:
    # A squeeze that fades as exp(-t / 0.5 s) from touchdown on.
    force, _ = comparisons.model_force_and_torque(trial, "minimum-torque")
    since = (trial.walk.time % 1.0)[:, None, None]
    shares, fading = comparisons.relaxation(with_force(trial, force * np.exp(-since / 0.5)))
    assert shares == pytest.approx(np.exp(-np.array(comparisons.AFTER_TOUCHDOWN) / 0.5), rel=1e-9)
    assert fading == pytest.approx(0.5, rel=1e-9)


def test_a_squeeze_fades_with_damping_and_give(trial: Trial) -> None:
    # Four points of 500 N·s/m against joints of stiffness k at lever arms of about a decimetre:
    # twice the damping or half the stiffness is twice the time.
    base = comparisons.fading_time(trial)
    robot = replace(trial.walk.robot, servo=replace(trial.walk.robot.servo, stiffness=2 * 9.2))
    stiffer = Trial(trial.scenario, replace(trial.walk, robot=robot), trial.recording, {})
    assert comparisons.fading_time(stiffer) == pytest.approx(base / 2, rel=1e-12)
    sticky = Trial(SHORT.replace(friction_damping=1000.0), trial.walk, trial.recording, {})
    assert comparisons.fading_time(sticky) == pytest.approx(2 * base, rel=1e-12)
    # An outward push p on the foot turns femur and tibia by Jᵀ p / k: with Lf = 82 mm and
    # Lt = 140 mm both have lever arms of their heights, 100 mm and that of the knee.
    leg = trial.walk.robot.legs[0]
    from phasmid import kinematics

    q = kinematics.joint_angles(leg, leg.neutral_foot)
    knee = leg.femur.length * np.sin(q[1])
    give = (0.1**2 + (0.1 + knee) ** 2) / trial.walk.robot.servo.stiffness
    assert base == pytest.approx(4 * 500.0 * give, rel=1e-9)


def spread_feet(seed: int, count: int) -> np.ndarray:
    """Feet about a circle of 0.2 m, some centimetres off it."""
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * np.arange(count) / count
    circle = 0.2 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    return circle + rng.normal(scale=0.02, size=(20, count, 3))


# A basis by singular values is right to their round-off, some 1e-15 of the largest, which is 2,
# over the least, which is above 0.1 for feet so far apart: 2e-14.
BASIS = 1e-13


def test_internal_forces_add_up_to_nothing() -> None:
    feet = spread_feet(0, 4)
    basis = comparisons.internal_forces(feet)
    assert basis.shape == (20, 12 - 6, 12)
    forces = basis.reshape(20, 6, 4, 3)
    assert np.abs(forces.sum(axis=2)).max() < BASIS
    assert np.abs(np.cross(feet[:, None], forces).sum(axis=2)).max() < BASIS
    unit = np.einsum("nij,nkj->nik", basis, basis)
    np.testing.assert_allclose(unit, np.broadcast_to(np.eye(6), unit.shape), atol=BASIS)
