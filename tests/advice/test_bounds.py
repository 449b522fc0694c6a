"""Bounds of the static torques: by hand, by a linear programme, and around simulated walks."""

import numpy as np
import pytest

import phasmid
from phasmid.advice.bounds import Postures, static_loads

FILTERED = 0.1
"""Part of a stance over which the simulated torques are averaged."""

CONTACT = 0.02
"""Normal force of a foot in contact, as a share of the weight per leg."""


def averaged(values, samples):
    kernel = np.ones(samples) / samples
    return np.apply_along_axis(lambda row: np.convolve(row, kernel, "same"), 0, values)


def outside(robot, load):
    """Samples of a simulated walk, and those whose largest load is not between the bounds."""
    scenario = phasmid.Scenario(robot=robot)
    mass = scenario.build().robot.mass
    scenario = scenario.replace(payload=load * mass, drive="servo")
    period = scenario.build().course.stride.period
    experiment = scenario.replace(duration=2 * period).build()
    walk = phasmid.plan(experiment)
    recording = phasmid.simulate(experiment, walk)
    time = recording.time.values
    stance_time = experiment.course.gait.duty_factor * period
    window = max(round(FILTERED * stance_time / (time[1] - time[0])), 1)
    torque = averaged(recording.joint_torque.values.reshape(len(time), -1), window)
    force = averaged(recording.foot_normal_force.values, window)
    # Averages need half of a window on either side.
    chosen = slice(window, len(time) - window, 25)
    limit = experiment.robot.arrays.stall_torque
    largest = (np.abs(torque[chosen]) / limit.ravel()).max(axis=1)
    planned = walk.sample(time[chosen])
    friction = experiment.world.terrain.coefficient

    def bounds(q, stance):
        postures = Postures(q, planned.qd, stance, *np.zeros((2, len(q))), np.zeros(1))
        return static_loads(experiment, chosen=postures)

    # Without help the planned feet carry. Any foot that touches the ground may help.
    unaided = bounds(planned.q, planned.stance).unaided()
    touching = planned.stance | (
        force[chosen] > CONTACT * mass * experiment.world.gravity / planned.stance.shape[1]
    )
    aided = bounds(recording.joint_position.values[chosen], touching).aided(friction)
    high, low = (np.nanmax(np.abs(each) / limit, axis=(1, 2)) for each in (unaided, aided))
    return len(largest), int(((largest > high) | (largest < low)).sum())


@pytest.mark.parametrize(
    "robot", ["phantomx-ax", "phantomx-paper", "phantomx-mk4", "quadruped", "octopod"]
)
def test_the_largest_simulated_load_is_between_the_bounds(robot):
    """At most a twentieth of the time is outside, over loads of 0 to 3 times the robot's weight.

    Feet work against one another around touchdown, and a light robot's swinging legs need torque
    for their own motion.
    """
    found = [outside(robot, load) for load in (0, 1, 2, 3)]
    samples, beyond = (sum(each) for each in zip(*found, strict=True))
    assert samples >= 4 * 30
    assert beyond <= 0.05 * samples
