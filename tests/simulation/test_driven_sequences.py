"""Getting up, walking, sitting down and walking on with a dead servo, in the physics engine."""

import json

import numpy as np
import pytest

from phasmid import load_robot
from phasmid.control import CommandScript, LocomotionEngine, SafetyFilter, Sequencer
from phasmid.control.types import LegUse
from phasmid.experiment import Command, Posture
from phasmid.scenario import Scenario
from phasmid.simulation import drive

pytestmark = pytest.mark.usefixtures("compiled_engine")

ROBOT = load_robot("phantomx-ax")
UP, LIE = Command(posture=Posture.STANDING), Command(posture=Posture.PACKED)


def controller():
    return SafetyFilter(Sequencer(LocomotionEngine(ROBOT), ROBOT), ROBOT)


def scenario(kind, duration, **fields):
    return Scenario().replace(
        robot="phantomx-ax", drive=kind, duration=duration, record_interval_ms=10, **fields
    )


@pytest.mark.parametrize("kind", ["prescribed", "servo"])
def test_a_robot_gets_up_from_its_belly_walks_and_lies_down_again(kind):
    """Half of 25 mm is the height at which the body lies; servos sag, prescribed joints do not."""

    def commands(time, _):
        if time < 0.3 or time >= 6:
            return LIE
        return UP if time < 3.2 else Command(velocity=(0.08, 0.0, 0.0))

    # With soft and slow servos the feet step to their places before the body goes down.
    run = drive(scenario(kind, 14.0, start_posture="packed"), controller(), commands)
    assert run.attrs["ending"] == "COMPLETED"
    assert json.loads(run.attrs["events"]) == []
    z, x = run["body_position"].values[:, 2], run["body_position"].values[:, 0]
    lying = float(ROBOT.body.size[2]) / 2
    assert abs(z[0] - lying) < 1e-3
    assert abs(z[-1] - lying) < 1e-3
    assert z.max() > 0.095
    assert 0.18 < x[-1] < 0.25
    assert run["sequence"].values[-1] == 0
    assert np.abs(run["body_orientation"].values[:, 1:3]).max() < np.sin(np.radians(3) / 2) * 2


@pytest.mark.parametrize("place", ["right_front.tibia", "right_middle.femur", "left_front.coxa"])
def test_with_one_servo_dead_a_robot_walks_on_on_five_legs(place):
    engine = LocomotionEngine(ROBOT)
    half = engine.largest_velocity((1.0, 0.0, 0.0)).velocity[0] / 2
    run = drive(
        scenario("ideal-servo", 11.0),
        controller(),
        Command(velocity=(half, 0.0, 0.0)),
        faults=[f"{place} dead at 4 s"],
    )
    assert run.attrs["ending"] == "COMPLETED"
    said = [sentence for _, sentence in json.loads(run.attrs["events"])]
    assert f"servo {place} answers no more; its leg is lost." in said
    time, x = run["time"].values, run["body_position"].values[:, 0]
    since = np.searchsorted(time, 6.0)
    assert x[-1] - x[since] > 0.02 * (time[-1] - time[since])
    leg = [leg.name for leg in ROBOT.legs].index(place.split(".")[0])
    assert not run["stance"].values[since:, leg].any()


def test_by_default_a_robot_gets_up_and_its_safety_and_its_sequences_are_recorded():
    """From 25 mm of belly height to 100 mm less sag; a servo that dies is noticed after 0.2 s."""
    script = CommandScript(
        command=[
            {"posture": "packed"},
            {"time": 0.2, "posture": "standing"},
        ]
    )
    run = drive(
        scenario("ideal-servo", 3.5, start_posture="packed"),
        None,
        script,
        faults=["right_front.tibia dead at 3.1 s"],
    )
    assert run.attrs["ending"] == "COMPLETED"
    assert run.attrs["controller"] == "scenario's own"
    assert {"safety_mode", "sequence", "velocity_reference"} <= set(run.data_vars)
    assert run["sequence"].values[[10, 340]].tolist() == [0, 2]
    assert run["body_position"].values[300, 2] > 0.095
    said = [sentence for _, sentence in json.loads(run.attrs["events"])]
    assert "servo right_front.tibia answers no more; its leg is lost." in said


def test_a_robot_that_loses_its_third_leg_while_it_walks_stands():
    """It walks on four legs. A cycle of these later, 4 s, it rests and lost feet bear no load.

    Of the feet that it lifts, none touches the ground. In the two seconds that follow, levelling
    on the estimated ground may move the body by 1 mm; on the lost leg's gait it went 30 mm.
    """
    losses = {2.0: [5], 5.0: [2, 5], 9.0: [2, 5, 6]}
    script = CommandScript(
        command=[
            {"time": 0.0, "ahead_mm_per_s": 80},
            *({"time": time, "lost_legs": legs} for time, legs in losses.items()),
        ]
    )
    run = drive(scenario("servo", 15.0), None, script)
    after = run["time"].values >= 13.0
    use, force = run["leg_use"].values[after], run["foot_normal_force"].values[after]
    assert set(np.unique(use[:, [1, 4, 5]])) <= {LegUse.LOST, LegUse.NEEDED}
    assert (use[:, [0, 2, 3]] == LegUse.IN_USE).all()
    assert force[use == LegUse.LOST].max() == 0.0
    places = run["body_position"].values[after]
    assert np.linalg.norm(places - places[0], axis=1).max() < 1e-3
