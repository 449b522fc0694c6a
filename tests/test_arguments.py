"""Arguments of the package's public names: what is of another kind is refused in a sentence."""

import inspect
from collections.abc import Sequence
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

import phasmid
from phasmid import dynamics, kinematics
from phasmid.arguments import check_kind
from phasmid.control.player import Player
from phasmid.errors import InvalidInput
from phasmid.experiment import Command
from phasmid.units import STANDARD_GRAVITY

FUNCTIONS = """advise analyse compare drive export import_robot load_recording load_robot
load_scenario load_study load_trajectory plan plot replay report save_mcap save_recording save_robot
save_video sense simulate simulate_many study summarise""".split()  # noqa: SIM905
CLASSES = ["Body", "Gait", "JointTrajectory", "Leg", "Link", "Robot", "Servo"]


class Thing:
    """An object that no argument takes."""


WRONG = {
    "number": 0.5,
    "text": "no such thing",
    "None": None,
    "list": [1, 2],
    "array": np.zeros((2, 5)),
    "path": Path("no such thing"),
    "class": Thing,
    "object": Thing(),
    "scenario": phasmid.Scenario(),
    "robot": phasmid.load_robot("phantomx-ax"),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_first_argument_of_another_kind_is_refused_in_a_sentence(name, here):
    """An object of a class of its own is no scenario, recording, robot, file or list of these."""
    function = getattr(phasmid, name)
    first, *others = inspect.signature(function).parameters.values()
    required = [one.name for one in others if one.default is one.empty]
    for value in (Thing(), Thing, 0.5j):
        with pytest.raises(InvalidInput, match=rf"^{first.name} is .*; it must be .*\."):
            function(value, **dict.fromkeys(required, "x"))


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("drive", ("controller", "commands", "rate", "faults", "progress", "log")),
        ("simulate", ("walk", "progress", "log", "start")),
        ("simulate_many", ("scenarios", "workers")),
        ("analyse", ("walk",)),
        ("load_robot", ("source", "options")),
        ("load_trajectory", ("path", "robot", "unit")),
        ("plot", ("recordings", "name", "legs", "width")),
        ("report", ("recording", "folder")),
        ("export", ("recording", "path", "channels", "rate")),
        ("save_robot", ("robot", "path")),
        ("LocomotionEngine", ("robot", "settings", "gait", "period", "dynamics")),
    ],
)
def test_no_argument_ends_in_an_error_from_the_depth(name, arguments, wrong, here):
    """Each argument in turn has another kind: the call succeeds, or is refused in a sentence."""
    scenario = phasmid.load_scenario("paper").replace(duration=0.01, drive="ideal-servo")
    robot = scenario.load_robot()
    right = {
        "scenario": scenario,
        "scenarios": [scenario],
        "walk": phasmid.plan(scenario),
        "source": "phantomx-ax",
        "path": "no.csv",
        "robot": robot,
        "recording": WRONG["object"],
        "recordings": [],
        "name": "joint-torque",
        "folder": "folder",
    }
    function = getattr(phasmid, name)
    required = {"controller": Player(right["walk"])} if name == "drive" else {}
    required |= {
        one.name: right[one.name]
        for one in inspect.signature(function).parameters.values()
        if one.default is one.empty and one.kind is not one.VAR_KEYWORD
    }
    for argument in arguments:
        if (argument, wrong) == ("controller", "None"):
            # The locomotion engine, which takes a while.
            continue
        try:
            function(**{**required, argument: WRONG[wrong]})
        except phasmid.PhasmidError as error:
            assert str(error)


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize("name", CLASSES)
def test_no_field_ends_in_an_error_from_the_depth(name, wrong):
    """Each field of the robot's classes, a gait and a trajectory has another kind in turn."""
    robot = phasmid.load_robot("phantomx-ax")
    q = np.repeat(robot.arrays.joint_limits.mean(axis=-1)[None], 2, axis=0)
    leg = robot.legs[0]
    right = {
        "Body": robot.body,
        "Gait": phasmid.plan(phasmid.load_scenario("paper")).gait,
        "JointTrajectory": phasmid.JointTrajectory(robot, np.array([0.0, 1.0]), q),
        "Leg": leg,
        "Link": leg.femur,
        "Robot": robot,
        "Servo": robot.servo,
    }[name]
    values = {one.name: getattr(right, one.name) for one in fields(right)}
    for field in values:
        try:
            getattr(phasmid, name)(**{**values, field: WRONG[wrong]})
        except InvalidInput as error:
            assert str(error)


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize("field", [one.name for one in fields(Command)])
def test_field_of_a_command_is_of_its_kind(field, wrong):
    """A command that was made can be followed: what is of another kind is refused at once."""
    allowed = {
        "gait": {"None", "text"},
        "period": {"number", "None"},
        "step_height": {"number", "None"},
        "time": {"number", "None"},
        "lost_legs": {"list"},
    }
    if wrong in allowed.get(field, set()):
        Command(**{field: WRONG[wrong]})
        return
    with pytest.raises(InvalidInput, match=rf"^{field} is "):
        Command(**{field: WRONG[wrong]})


@pytest.mark.parametrize(
    ("value", "kind", "sentence"),
    [
        ("200", float, 'rate is "200"; it must be a number.'),
        (True, float, "rate is True; it must be a number."),
        (2.5, int | None, "rate is 2.5; it must be a whole number or None."),
        ("a", Sequence[str], 'rate is "a"; it must be a list of texts.'),
        ([1, "a"], Sequence[int], "rate is [1, 'a']; it must be a list of whole numbers."),
        (
            (1,),
            tuple[int, int],
            "rate is (1,); it must be 2 values: a whole number, a whole number.",
        ),
        (1, Literal["rad", "deg"], 'rate is 1; it must be "rad" or "deg".'),
        (1, str | Path, "rate is 1; it must be text or a path."),
        ({}, Thing, "rate is {}; it must be a Thing."),
    ],
)
def test_sentence_names_the_expected_kind(value, kind, sentence):
    """The kind is in words, not in Python's notation of types."""
    with pytest.raises(InvalidInput) as refusal:
        check_kind(value, kind, "rate")
    assert refusal.value.what == sentence


@pytest.mark.parametrize(
    ("value", "kind"),
    [
        (3, float),
        (np.float32(0.5), float),
        (np.array(0.5), float),
        (np.int64(3), int),
        (np.bool_(True), bool),
        (np.array([1, 2]), Sequence[int]),
        ([1, 2], tuple[int, int]),
        ([], Sequence[str]),
        (None, str | None),
    ],
)
def test_numbers_and_lists_of_numpy_are_of_the_kinds_of_python(value, kind):
    """Only what cannot be meant is refused."""
    check_kind(value, kind, "rate")


def test_remedies_are_accepted_as_printed():
    """A text in place of a list, a class in place of a controller: the hint is what is meant."""
    scenario = phasmid.load_scenario("paper")
    with pytest.raises(InvalidInput) as refusal:
        phasmid.drive("paper")
    assert type(eval(refusal.value.hint)) is phasmid.Scenario
    with pytest.raises(InvalidInput, match="controller is the class LocomotionEngine") as refusal:
        phasmid.drive(scenario, phasmid.LocomotionEngine)
    assert refusal.value.hint == "LocomotionEngine(...), an object of this class"


def test_tables_made_by_name_refuse_in_a_sentence():
    """As keys of a file, so keywords."""
    with pytest.raises(InvalidInput, match="total_mass is -1 kg; it must be greater"):
        phasmid.ImportOptions(total_mass=-1)
    with pytest.raises(InvalidInput, match='unknown key "mass"'):
        phasmid.ImportOptions(mass=1)


ROBOT = phasmid.load_robot("phantomx-ax")
LEG, Q = ROBOT.legs[0], np.zeros((6, 3))
INVERSE = partial(dynamics.inverse_dynamics, gravity=STANDARD_GRAVITY)
AT_REST = dynamics.BodyMotion.at_rest
BODY = AT_REST()
LEGS_3, AXES = (f"it must have shape (..., {shape})." for shape in ("6, 3", "3"))


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: INVERSE(WRONG["scenario"], BODY, Q, Q, Q), "robot is of"),
        (lambda: INVERSE(ROBOT, None, Q, Q, Q), "body is None; it must be"),
        (lambda: INVERSE(ROBOT, BODY, Q.ravel(), Q, Q), f"q has shape (18,); {LEGS_3}"),
        (
            lambda: INVERSE(ROBOT, BODY, Q, Q, Q, foot_force=Q[0]),
            f"foot_force has shape (3,); {LEGS_3}",
        ),
        (
            lambda: dynamics.leg_torque(LEG, None, Q[0], Q[0], gravity=STANDARD_GRAVITY),
            "q is None; it must be an array of",
        ),
        (lambda: kinematics.foot_position(ROBOT, Q), "leg is of type Robot; it must be a Leg"),
        (lambda: kinematics.joint_angles(LEG, [0.1, 0.2]), f"p_hip_foot has shape (2,); {AXES}"),
        (lambda: AT_REST(position=[0, 0]), f"position has shape (2,); {AXES}"),
    ],
)
def test_arrays_of_another_shape_are_refused_with_the_right_one(call, sentence):
    """NumPy's words name operands of a compiled function; these name the argument."""
    with pytest.raises(InvalidInput) as refusal:
        call()
    assert refusal.value.what.startswith(sentence)
