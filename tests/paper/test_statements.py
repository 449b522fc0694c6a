"""The grades of the paper's statements: each of them can be lost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from phasmid.paper import equations, structure, trajectory, walking
from phasmid.paper.evidence import Evidence
from phasmid.paper.reproduction import STATEMENTS
from phasmid.paper.statement import Finding, Grade
from phasmid.scenario import Scenario, load_scenario

PAPER = load_scenario("paper")
SHORT = PAPER.replace(duration=4.0)
"""Two cycles: enough for one whole stance of each leg."""


def lopsided() -> Scenario:
    """The paper's robot with its trunk's centre of mass 80 mm to the left."""
    robot = PAPER.load_robot()
    body = replace(robot.body, com=np.array([0.0, 0.080, 0.0]))
    return SHORT.replace(robot=replace(robot, body=body))


@pytest.mark.parametrize(
    ("measure", "wrong"),
    [
        (structure.joint_count, {"robot": "quadruped"}),
        (trajectory.inputs, {"step_length": 0.05}),
        (trajectory.inputs, {"step_height": 0.02}),
        (trajectory.smooth, {"curve": "cubic-spline"}),
        (trajectory.first_half, {"gait": "wave"}),
        (trajectory.repeats, {"period": 2.5}),
        (trajectory.reverses, {"gait": "amble"}),
        (walking.path, {"stance_law": "coxa-only"}),
        (walking.total, {"gravity": 5.0}),
        (equations.weight, {"gravity": 5.0}),
    ],
    ids=lambda value: value.__name__ if callable(value) else str(value),
)
def test_a_statement_that_is_not_so_is_graded_so(
    measure: Callable[[Evidence], Finding], wrong: dict[str, object]
) -> None:
    if wrong.get("robot") == "quadruped":
        robot = PAPER.load_robot()
        wrong = {"robot": replace(robot, legs=tuple(robot.legs[i] for i in (0, 2, 3, 5)))}
    assert measure(Evidence(SHORT)).grade is Grade.HOLDS
    assert measure(Evidence(SHORT.replace(**wrong))).grade is Grade.FAILS


@pytest.mark.parametrize("measure", [walking.leg_two, walking.leg_five])
def test_the_middle_leg_may_also_bear_less(measure: Callable[[Evidence], Finding]) -> None:
    # A trunk that weighs to the left takes load from leg 2 and gives it to leg 5.
    assert measure(Evidence(SHORT)).grade is Grade.HOLDS
    expected = Grade.FAILS if measure is walking.leg_two else Grade.HOLDS
    assert measure(Evidence(lopsided())).grade is expected


def test_feet_that_are_points_are_what_the_equations_mean() -> None:
    # With simulated forces the equations miss 10 mN·m on feet 4 mm wide: 7 N held up to 2 mm
    # beside the foot's middle, by statics; and next to nothing on points.
    evidence = Evidence(SHORT)
    assert walking.verified(evidence).grade is Grade.HOLDS
    wide = walking._torque_gap(evidence.walk, standing=True)
    load = evidence.walk.channel("foot_normal_force").max()
    assert 0.001 < wide < load * SHORT.contact.tip_width / 2


def test_walking_by_the_coxa_alone_keeps_femur_and_tibia_still() -> None:
    # By construction of that law; the paper's words then hold, and its straight walk does not.
    evidence = Evidence(SHORT)
    walk = evidence.variant("coxa-only", "as-given").walk
    standing = walk.stance[:1000, 1]
    angles = walk.q[:1000][standing][:, (1, 3, 5), 1:]
    assert np.ptp(angles, axis=0).max() < 1e-12
    assert trajectory.coxa_only(evidence).grade is Grade.FAILS


def test_masses_at_mid_length_leave_the_coxa_uncoupled() -> None:
    assert equations.uncoupled(Evidence(SHORT)).grade is Grade.WITH_A_LIMIT


@pytest.mark.parametrize(
    "name", ["eq-1-offset", "eq-2-height", "body-rotation", "eqs-3-to-9", "eq-10", "eq-11-sign"]
)
def test_an_equation_with_misprints_is_graded_so(name: str) -> None:
    assert equations.as_printed(name).grade is Grade.MISPRINTED


def test_statements_are_told_apart_and_have_a_place() -> None:
    statements = [s for part in STATEMENTS.values() for s in part]
    assert len({(s.where, s.says) for s in statements}) == len(statements)
    assert all(s.where and s.says for s in statements)
