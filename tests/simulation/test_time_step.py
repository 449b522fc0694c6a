"""The time step that is chosen from contact, gears, rate and recording."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest

from phasmid import Scenario, load_robot, plan
from phasmid.errors import InvalidInput
from phasmid.experiment import Command
from phasmid.kinematics import joint_angles
from phasmid.servo import load_servo
from phasmid.simulation import with_time_step
from phasmid.simulation.drive import new_drive
from phasmid.simulation.start import step_limit
from support.walks import scaled_robot

AX = load_robot("phantomx-ax")
SMALL = replace(scaled_robot(AX, 0.4), servo=AX.servo)
"""Light legs of 100 mm on servos of the usual size."""


def own_law(robot=AX, **changes):
    return Scenario(robot=robot).replace(
        drive="servo", step_length=0.01, step_height=0.01, **changes
    )


def limit(scenario, robot):
    return step_limit(scenario.build(), joint_angles(robot.arrays, robot.arrays.neutral_foot))[0]


def test_the_usual_step_is_taken_where_it_resolves_all():
    for name in ("AX-12A", "STS3215", "DS3218"):
        scenario = own_law(replace(AX, servo=load_servo(name)))
        assert with_time_step(scenario.build(), plan(scenario)).solver.dt == 0.001


@pytest.mark.parametrize("rate", [200.0, 150.0, 1000.0, 2000.0])
@pytest.mark.parametrize("interval", [None, 0.002, 0.01])
def test_the_step_of_light_legs_divides_period_and_interval(rate, interval):
    robot = SMALL
    scenario = own_law(robot, record_interval=interval)
    chosen = with_time_step(scenario.build(), plan(scenario), 1 / rate).solver.dt
    longest = limit(scenario, robot)
    assert longest < 0.001
    assert chosen <= longest
    for time in (1 / rate, interval or 1 / rate):
        assert time / chosen == pytest.approx(round(time / chosen), abs=1e-6)
    # Twice the step would not do, or divides nothing.
    assert chosen > longest / 2 or 1 / rate / chosen < 2


def test_a_given_step_that_is_too_long_is_refused_with_one_that_works():
    robot = SMALL
    scenario = own_law(robot, dt=0.001)
    with pytest.raises(InvalidInput, match="cannot resolve the gears of the servo") as caught:
        with_time_step(scenario.build(), plan(scenario), 1 / 150)
    step = float(caught.value.hint.removeprefix("dt = "))
    assert step <= limit(scenario, robot)
    scenario = scenario.replace(dt=step, duration=0.05)
    run = new_drive(scenario, None, Command(), rate=150.0)
    assert run.period_steps * step == pytest.approx(1 / 150)


def test_a_given_step_that_resolves_all_stays():
    scenario = own_law(dt=0.0005)
    experiment = scenario.build()
    assert with_time_step(experiment, plan(scenario)) is experiment


def test_a_contact_that_no_practical_step_resolves_is_refused():
    scenario = Scenario(robot=AX).replace(stiffness=1e9, damping=1e6)
    with pytest.raises(InvalidInput, match="a time step cannot resolve this contact") as caught:
        with_time_step(scenario.build(), plan(scenario))
    assert caught.value.hint == "stiffness = 10000, damping = 30"
    numbers = tomllib.loads(f"x = {{ {caught.value.hint} }}")["x"]
    with_time_step(scenario.replace(**numbers).build(), plan(scenario))


def test_a_robot_of_its_own_servos_walks_at_the_chosen_step():
    # The run has the chosen step, and its samples are a step apart.
    robot = SMALL
    run = new_drive(own_law(robot, duration=0.05), None, Command())
    assert run.dt == run.experiment.solver.dt < 0.001
    assert np.allclose(np.diff(run.time), run.every * run.dt)


def test_a_rate_that_shares_no_step_with_the_recording_is_refused_by_both():
    scenario = own_law(record_interval=0.001)
    with pytest.raises(InvalidInput, match="no practical time step divides the period"):
        with_time_step(scenario.build(), plan(scenario), 1 / 333)


def test_joints_of_different_servos_have_no_servo_of_one_law():
    legs = tuple(replace(leg, strength=np.array([1.0, 1.0, 2.0])) for leg in AX.legs)
    scenario = own_law(replace(AX, legs=legs))
    with pytest.raises(InvalidInput, match='drive "servo" has one law for all of them'):
        with_time_step(scenario.build(), plan(scenario))
    assert Scenario(robot=replace(AX, legs=legs)).driven().simulation.drive == "ideal-servo"
