"""Robots that begin on slopes stand, or slide upright, and what they are told when they fall."""

import math
import re

import numpy as np
import pytest

from phasmid.experiment import Command
from phasmid.kinematics import quaternion_rotation
from phasmid.reporting import summarise
from phasmid.reporting.run import read_run
from phasmid.scenario import Scenario
from phasmid.simulation import drive
from phasmid.terrain.sliding import Slide

pytestmark = pytest.mark.usefixtures("compiled_engine")

PRESETS = (
    *("phantomx-paper", "phantomx-ax", "phantomx-mk4", "markwtech", "freenove-big"),
    *("lynxmotion-ch3r", "quadruped", "octopod"),
)
GAITS = {"quadruped": "crawl", "octopod": "tetrapod"}
MEASURED = {"measured": "everything", "body_state": "estimated"}


def start(robot="phantomx-ax", slope=20.0, friction=0.7, kind="ideal-servo", **fields):
    """A robot that is told to stand on a slope for a second."""
    scenario = Scenario(robot=robot).replace(
        drive=kind,
        terrain="slope",
        slope=math.radians(slope),
        friction=friction,
        gait=GAITS.get(robot, "tripod"),
        **{"duration": 1.0, **fields},
    )
    return drive(scenario, None, Command())


@pytest.mark.parametrize(
    ("slope", "friction", "fields"),
    [
        *[(30, 0.7, {"robot": robot}) for robot in PRESETS],
        *[(35, 0.1, {"robot": robot}) for robot in ("phantomx-mk4", "quadruped", "octopod")],
        (30, 0.7, {"kind": "servo"}),
        (30, 0.7, {"kind": "torque"}),
        (30, 0.7, MEASURED),
        (20, 0.28, MEASURED),
        (-35, 0.8, {}),
        (35, 0.28, {"terrain_yaw_deg": 90}),
        (10, 0.1, {"kind": "servo"}),
    ],
)
def test_a_robot_that_begins_on_its_feet_stands_or_slides_upright(slope, friction, fields):
    """Below the friction angle it stays in place, above it slides with its trunk off the ground.

    The trunk stays within 15° of the ground: as much as servos give way at 35°. A robot that stands
    moves by creep and settling alone. One that slides from rest with g (sin a - f cos a) makes
    more than a tenth of a metre.
    """
    run = start(slope=slope, friction=friction, **fields)
    assert run.attrs["ending"] == "COMPLETED"
    assert 0 not in run["sequence"].values
    ground = read_run(run).experiment.world.terrain
    normal = ground.normal(*run["body_position"].values[:, :2].T)
    up = quaternion_rotation(run["body_orientation"].values)[:, :, 2]
    assert np.sum(up * normal, axis=1).min() > math.cos(math.radians(15))
    feet = run["foot_position"].values.mean(axis=1)
    moved = float(np.linalg.norm(feet[-1] - feet[0]))
    stands = math.tan(math.radians(abs(slope))) < friction
    assert moved < 0.02 if stands else moved > 0.1
    slides = [each for each in summarise(run)["warnings"] if each.startswith("The robot slides at")]
    assert len(slides) == (0 if stands else 1)
    for sentence in slides:
        assert f"{abs(slope):g}° steep and its friction of {friction:g} holds up to" in sentence
        assert "servo" not in sentence


def test_what_is_told_against_sliding_helps():
    """Both options of the remedy let the robot stand."""
    run = start(slope=20, friction=0.28)
    (sentence,) = [each for each in summarise(run)["warnings"] if "slides" in each]
    assert "holds up to 15.6°. Try --friction 0.5 or --slope-deg 12." in sentence
    for options in ({"friction": 0.5}, {"slope": 12, "friction": 0.28}):
        assert "slide" not in summarise(start(**options)).get("standing", {})


@pytest.mark.parametrize("slope", [20, -20])
def test_a_remedy_has_the_slope_s_sign(slope):
    scenario = Scenario().replace(terrain="slope", slope=math.radians(slope))
    remedy = Slide(1.0, math.radians(20), 0.28).remedy(scenario.load_terrain())
    assert remedy == f"--friction 0.5 or --slope-deg {math.copysign(12, slope):g}"


def test_a_slide_that_ends_a_run_is_no_matter_of_the_time_step():
    """From rest with g (sin a - f cos a) = 4.8 m/s² it has 20 m/s after 4.1 s."""
    run = start(slope=35, friction=0.1, duration=6.0)
    assert run.attrs["ending"] == "FELL"
    reason = run.attrs["ending_reason"]
    assert "the ground is 35° steep and its friction of 0.1 holds up to 5.71°. Try --" in reason
    assert "servo" not in reason
    assert "time step" not in reason


@pytest.mark.parametrize(
    ("kind", "load"),
    [("ideal-servo", {"payload": 12.0}), ("servo", {"voltage": 4.0, "payload": 6.0})],
)
def test_a_servo_is_to_blame_only_where_it_gave_all_it_had(kind, load):
    """Five times its weight, or thrice on a third of the supply, is more than legs hold at 20°."""
    reason = start(kind=kind, **load).attrs["ending_reason"]
    assert re.search(
        r"touched the ground: servo \w+\.\w+ was at its largest torque for 0\.\d+ s\.", reason
    )
    assert reason.endswith("Try a stronger servo, or a higher stance.")


def test_a_high_robot_that_tips_on_a_slope_is_told_of_its_centre_of_mass():
    """With 3 kg on top it is higher over its feet than they reach downhill at 44°."""
    stance = {"stance_radius": 0.075, "body_height": 0.165, "payload": 3.0}
    reason = start(slope=44, friction=3.0, **stance).attrs["ending_reason"]
    assert re.search(r"on ground 44° steep its centre of mass was \d+ mm beyond its feet", reason)
    assert "servo" not in reason
