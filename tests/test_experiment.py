"""Experiments: what a scenario is composed to, and how two are compared."""

import numpy as np
import pytest

import phasmid
from phasmid.errors import InvalidInput
from phasmid.scenario import Scenario
from phasmid.servo import load_servo


def parts(experiment):
    return experiment.world, experiment.course, experiment.solver, experiment.sensors


def test_equal_scenarios_give_equal_parts(tmp_path):
    """Also where a height map is read twice: heights are compared by value, not by file."""
    heights = np.zeros((5, 5))
    heights[:, 2:] = 0.01
    scenarios = []
    for name in ("one.npy", "other.npy"):
        np.save(tmp_path / name, heights)
        changes = {"height_map": str(tmp_path / name), "map_cell": 0.1}
        scenarios.append(Scenario().replace(terrain="height-map", **changes))
    one, other = (scenario.build() for scenario in scenarios)
    assert parts(one) == parts(other)
    assert hash(one.world) == hash(other.world)
    higher = scenarios[0].replace(map_cell=0.2).build()
    assert one.world != higher.world


def test_a_change_composes_the_experiment_anew():
    """Every part that depends on a value follows it: voltage the robot, payload its mass."""
    scenario = Scenario(robot="phantomx-ax")
    one = scenario.build()
    weak = one.replace(voltage=9.0, payload=0.5, duration=4)
    assert weak.robot.servo.no_load_speed == one.robot.servo.at(9.0).no_load_speed
    assert weak.robot.mass == pytest.approx(one.robot.mass + 0.5, rel=1e-12)
    assert weak.scale == one.scale
    assert weak.duration == 4
    assert weak.replace(servo="MX-28").robot.servo == load_servo("MX-28").at(9.0)
    assert one.replace() is one
    with pytest.raises(InvalidInput, match="no field"):
        one.replace(volts=9.0)


@pytest.mark.parametrize(("planned_on", "is_planned"), [("terrain", True), ("level", False)])
def test_the_plan_knows_the_ground_or_takes_it_for_level(planned_on, is_planned):
    world = Scenario().replace(terrain="stairs", planned_on=planned_on).build().world
    assert world.is_planned is is_planned
    assert world.planned_terrain.is_level is not is_planned
    assert not world.terrain.is_level


def test_public_functions_take_a_scenario_or_its_experiment():
    scenario = Scenario().replace(duration=0.2)
    experiment = scenario.build()
    walks = phasmid.plan(scenario), phasmid.plan(experiment)
    np.testing.assert_array_equal(walks[0].q, walks[1].q)
    runs = [phasmid.simulate(one, walks[0]) for one in (scenario, experiment)]
    np.testing.assert_array_equal(*(run["joint_torque"].values for run in runs))
    loads = [phasmid.analyse(one, walks[0]) for one in (scenario, experiment)]
    np.testing.assert_array_equal(*(load["joint_torque_model"].values for load in loads))
    with pytest.raises(InvalidInput, match="scenario is 3; it must be a Scenario or an Experiment"):
        phasmid.plan(3)


def test_the_recorded_scenario_is_that_of_the_run():
    """The time step that a run has chosen is in its recording, so that it repeats by itself."""
    scenario = Scenario().replace(duration=0.1)
    run = phasmid.simulate(scenario, phasmid.plan(scenario))
    assert "dt = 0.001" in run.attrs["scenario"]
    assert phasmid.replay(run).difference is None
