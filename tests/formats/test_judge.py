"""The judge names what no body, joint or servo can be, with the number that shows it."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from formats.trees import block, joined, pose, with_joint, with_joints, with_link
from phasmid.formats import (
    Finding,
    ImportOptions,
    Inertial,
    Severity,
    Tree,
    TreeJoint,
    TreeLink,
    judge,
    judge_robot,
    read_urdf,
    robot_from_tree,
    tree_of,
)
from phasmid.formats.bodies import bounds, judge_body
from phasmid.formats.judge import judge_standing, scaled_masses
from phasmid.formats.mjcf_in import read_mjcf
from phasmid.robot import Robot, load_robot, preset_names

MK4 = replace(load_robot("phantomx-mk4"), appearance=None)
TREE = tree_of(MK4)
TIBIA, FEMUR = "left_front_tibia_link", "left_rear_femur"
SHAPE = block((0, -0.01, -0.01), (0.1, 0.01, 0.01))
"""A bar of 100 x 20 x 20 mm, 40 cm³."""


def of(mass: float, com: tuple[float, ...], moments: object) -> Inertial:
    inertia = np.array(moments, dtype=float)
    return Inertial(
        mass, np.array(com, dtype=float), np.diag(inertia) if inertia.ndim == 1 else inertia
    )


BAR = of(0.1, (0.05, 0, 0), (6.7e-6, 8.7e-5, 8.7e-5))
"""What the bar has at 2500 kg/m³: m/12 (b² + c²)."""


def told(inertial: Inertial) -> list[tuple[str, str]]:
    found = judge_body("link bar", inertial, bounds((SHAPE,), ()), "")
    return [(finding.severity.value, finding.what) for finding in found]


def faults(tree: Tree) -> list[Finding]:
    return [finding for finding in judge(tree) if finding.severity is not Severity.NOTE]


@pytest.mark.parametrize("preset", preset_names())
def test_the_judge_has_nothing_against_the_presets(preset: str) -> None:
    robot = load_robot(preset)
    assert not judge(tree_of(robot))
    assert {finding.severity for finding in judge_robot(robot)} <= {Severity.NOTE}


@pytest.mark.parametrize(
    ("inertial", "severity", "what"),
    [
        (
            of(0.1, (0.05, 0, 0), (6.7e-3, 8.7e-2, 8.7e-2)),
            "impossible",
            "inertia 0.087 kg m² with 100 g gives a gyration radius of 933 mm to a 100 mm body; it "
            "must be between 2 mm and 150 mm; the inertia times 0.001 would give 29.5 mm.",
        ),
        (
            of(0.1, (0.05, 0, 0), (1e-6, 8.7e-5, 9.7e-5)),
            "impossible",
            "principal moments 1e-06, 8.7e-05, 9.7e-05 kg m² belong to no body; the largest may "
            "not exceed the sum of the others.",
        ),
        (
            of(0.1, (0.05, 0, 0), (-1e-6, 8.7e-5, 8.7e-5)),
            "impossible",
            "principal moments -1e-06, 8.7e-05, 8.7e-05 kg m² must all be greater than 0.",
        ),
        (
            of(-0.1, (0, 0, 0), (1, 1, 1)),
            "impossible",
            "mass is -0.1 kg; it must be greater than 0.",
        ),
        (
            of(0.0, (0, 0, 0), (1, 1, 1)),
            "suspect",
            "has an inertia and no mass; it must have both or neither.",
        ),
        (
            of(0.1, (50, 0, 0), (6.7e-6, 8.7e-5, 8.7e-5)),
            "impossible",
            "centre of mass is 49 900 mm outside its 100 mm box.",
        ),
        (
            of(0.1, (0.13, 0, 0), (6.7e-6, 8.7e-5, 8.7e-5)),
            "suspect",
            "centre of mass is 30 mm outside its 100 mm box.",
        ),
        (
            of(100, (0.05, 0, 0), (6.7e-3, 8.7e-2, 8.7e-2)),
            "suspect",
            "100 000 g in 40 cm³ of mesh is 2 500 000 kg/m³; robots are made of 100 to 9 000 "
            "kg/m³.",
        ),
        (
            of(0.1, (0.05, 0, 0), (6.7e-6, 8.7e-4, 8.7e-4)),
            "suspect",
            "inertia 0.00087 kg m² with 100 g gives a gyration radius of 93.3 mm to a 100 mm body; "
            "its matter is at most 52 mm from its centre of mass.",
        ),
    ],
)
def test_an_impossible_body_is_named_by_the_number(
    inertial: Inertial, severity: str, what: str
) -> None:
    assert told(inertial) == [(severity, what)]
    assert not told(BAR)


COPIES = TREE
for part in ("coxa", "femur", "tibia"):
    COPIES = with_link(COPIES, f"left_front_{part}_link", inertial=BAR)
    COPIES = with_link(COPIES, f"right_front_{part}_link", inertial=BAR)

IN_GRAMS = scaled_masses(TREE, 1e3, inertias=False)
"""N4: masses in grams, inertias in kg m²."""


def unlike_pair() -> Tree:
    m = TREE.links[TIBIA].inertial
    assert m is not None
    return with_link(TREE, TIBIA, inertial=Inertial(1.2 * m.mass, m.com, 1.2 * m.inertia))


@pytest.mark.parametrize(
    ("tree", "subject", "what"),
    [
        (
            COPIES,
            "legs 1, 6",
            "coxa, femur and tibia all have 100 g and the same inertia; unlike parts must have "
            "masses of their own.",
        ),
        (
            unlike_pair(),
            "leg 1",
            "its tibia has 171.8 g, and that of leg 6, across the body, 206.2 g; a pair should "
            "weigh the same.",
        ),
        (
            IN_GRAMS,
            "robot",
            "weighs 3 216 kg in all, and its inertias are those of 3.216 kg; masses must be in "
            "kilograms, and these look like grams.",
        ),
        (
            with_joint(TREE, FEMUR, lower=0.0, upper=0.0),
            f"joint {FEMUR}",
            "its limits are [0°, 0°]; the upper must be larger.",
        ),
        (
            with_joint(TREE, FEMUR, lower=-75.0, upper=75.0),
            f"joint {FEMUR}",
            "its limits reach 75 rad; a leg's joint turns by one turn at most."
            " 1.309, if these are degrees",
        ),
        (
            with_joints(TREE, lambda j: replace(j, effort=0.0)),
            "joints",
            "its effort is 0; it must be finite and greater than 0.",
        ),
    ],
)
def test_what_no_description_can_be_is_one_finding(tree: Tree, subject: str, what: str) -> None:
    (found,) = faults(tree)
    assert found.subject.startswith(subject)
    assert f"{found.what} {found.hint}".startswith(what)


def test_masses_in_grams_are_judged_as_a_person_weighed_them() -> None:
    """N4: the links' inertias are in the proportion of their masses, 3.2 kg to 3.216 kg."""
    imported = robot_from_tree(IN_GRAMS, ImportOptions(total_mass=3.2))
    subjects = [f.subject for f in imported.findings if f.severity is not Severity.NOTE]
    assert not [subject for subject in subjects if subject.startswith(("link", "robot:"))]
    assert imported.facts is not None
    assert imported.facts.mass == pytest.approx(3.2, rel=1e-12)


def test_a_robot_must_stand_over_its_feet() -> None:
    """A robot that topples on feet that phasmid assumed is not impossible."""
    for aside, severity in ((0.08, "suspect"), (1.5, "impossible")):
        body = replace(
            MK4.body, com=np.array([0, aside, 0]), size=np.full(3, 2.0), inertia=np.eye(3) * 0.1
        )
        found = [f for f in judge_robot(replace(MK4, body=body)) if f.subject == "robot"]
        assert [f.severity.value for f in found] == [severity]
    (found,) = judge_standing(replace(MK4, body=body), assumed=True)
    assert found.severity is Severity.SUSPECT


def test_a_light_link_that_is_fixed_makes_no_robot_impossible() -> None:
    """Inertias of 1 g sensors: 1e-4 of a trunk of 1e-2 kg m², but ten times that of a tibia."""
    for carrier, moment, fine in (("base_link", 1e-4, True), (TIBIA, 1e-2, False)):
        sensor = TreeLink("imu", of(0.001, (0, 0, 0), (moment,) * 3))
        tree = joined(
            TREE, TreeJoint("imu_joint", "fixed", carrier, "imu", pose()), links=(sensor,)
        )
        imported = robot_from_tree(tree)
        assert (imported.robot is not None) is fine
        (found,) = [f for f in imported.findings if f.subject == "link imu"]
        assert found.severity is (Severity.SUSPECT if fine else Severity.IMPOSSIBLE)
        assert found.what.endswith("with the links that it is fixed to it is possible.") is fine


URDF_BOX = """<robot name="r"><link name="base"><inertial><mass value="1"/>
<inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><box size="0.01 0.01 0.01"/></geometry></visual>
<visual><geometry><mesh filename="case.stl"/></geometry></visual></link></robot>"""

MJCF_BOX = """<mujoco><asset><mesh name="case" file="case.stl"/></asset>
<worldbody><body name="base">
<inertial pos="0 0 0" mass="1" diaginertia="1e-3 1e-3 1e-3"/>
<geom type="box" size=".005 .005 .005"/><geom type="mesh" mesh="case"/>
<body name="leg"><joint axis="0 0 1"/><geom type="sphere" size=".01"/></body>
</body></worldbody></mujoco>"""


@pytest.mark.parametrize("kind", ["urdf", "xml"])
def test_density_is_not_judged_where_a_mesh_of_the_link_is_missing(tmp_path, kind: str) -> None:
    """1 kg in a box of 1 cm³, 1e6 kg/m³; with a mesh that is not there it may be larger."""
    for missing in (False, True):
        text = URDF_BOX if kind == "urdf" else MJCF_BOX
        if not missing:
            text = re.sub("<visual><geometry><mesh.*?</visual>|<geom type=.mesh.*?/>", "", text)
        path = tmp_path / f"robot.{kind}"
        path.write_text(text, encoding="utf-8")
        tree = (read_urdf if kind == "urdf" else read_mjcf)(path)
        assert tree.links["base"].complete is not missing
        assert any("kg/m³" in found.what for found in judge(tree)) is not missing


def changed(legs: tuple[str, ...] = ("left_rear",), **fields: object) -> Robot:
    """The Mark IV with some other legs."""
    made = [replace(leg, **fields) if leg.name in legs else leg for leg in MK4.legs]  # type: ignore[arg-type]
    return replace(MK4, legs=tuple(made))


def with_range(row: int, low: float, high: float) -> dict[str, object]:
    limits = MK4.legs[0].joint_limits.copy()
    limits[row] = np.radians([low, high])
    return {"joint_limits": limits}


REAR = MK4.leg("left_rear")


@pytest.mark.parametrize(
    ("robot", "subject", "what"),
    [
        (
            changed(mount_yaw=math.radians(-135)),
            "leg left_rear",
            "points across the body: its hip is on the left and its yaw is -135°.",
        ),
        (
            changed(
                tibia=replace(REAR.tibia, length=REAR.tibia.length + 0.02),
                mount_position=REAR.mount_position + np.array([0.01, 0, 0]),
                mount_yaw=REAR.mount_yaw - math.radians(10),
            ),
            "leg right_rear",
            "is not the mirror image of leg left_rear: the hips' places differ by 10 mm; their "
            "directions differ by 10°; its tibia is 130.9 mm long and that one's 150.9 mm.",
        ),
        (
            changed(("right_front",), **with_range(2, -60, 0)),
            "joint right_front.tibia",
            "stands at",
        ),
        # N11: coxa_deg = [-1.3, 1.3] with radians for degrees.
        (
            changed(MK4.leg_names, **with_range(0, -1.3, 1.3)),
            "joints",
            "turns by 2.6° in all, [-1.3°, 1.3°].",
        ),
        # Times of the weight at a leg's length: 1000 N·m over 31.6 N times 0.246 m.
        (
            replace(MK4, servo=replace(MK4.servo, stall_torque=1000.0)),
            "servo",
            "effort 1000 N·m would lift 129 such robots at a leg's length; the limit is 10.",
        ),
        (
            replace(MK4, servo=replace(MK4.servo, no_load_speed=100.0)),
            "servo",
            "speed is 100 rad/s; the limit is",
        ),
    ],
)
def test_what_is_suspect_of_a_robot_is_told(robot: Robot, subject: str, what: str) -> None:
    found = [f for f in judge_robot(robot) if f.what.startswith(what)]
    assert [f.subject.startswith(subject) for f in found] == [True], judge_robot(robot)
    assert found[0].severity is not Severity.NOTE


def test_a_tree_without_legs_is_judged_all_the_same() -> None:
    tree = Tree("bar", {"bar": TreeLink("bar", of(-1, (0, 0, 0), (1, 1, 1)))}, ())
    assert [f.what for f in judge(tree)] == [
        "bar has 0 chains of three hinges that leave bar; a walking robot here has 4 legs or more.",
        "mass is -1 kg; it must be greater than 0.",
    ]
