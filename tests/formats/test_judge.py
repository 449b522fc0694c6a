"""The judge names what no body, joint or servo can be, with the number that shows it."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from formats.trees import block, joined, pose, with_joint, with_joints, with_link
from phasmid.errors import InvalidRobot
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
from phasmid.formats.bodies import bounds, judge_body, possible
from phasmid.formats.judge import judge_standing, scaled_masses
from phasmid.formats.mjcf_in import read_mjcf
from phasmid.robot import Link, Robot, load_robot, preset_names
from phasmid.units import plain_number

MK4 = replace(load_robot("phantomx-mk4"), appearance=None)
TREE = tree_of(MK4)
TIBIA = "left_front_tibia_link"
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


def test_the_judge_has_nothing_against_a_bar() -> None:
    assert not told(BAR)


@pytest.mark.parametrize(
    ("inertial", "severity", "what"),
    [
        (
            of(0.1, (0.05, 0, 0), (6.7e-3, 8.7e-2, 8.7e-2)),
            "impossible",
            "inertia 0.087 kg m² with 100 g gives a gyration radius of 933 mm to a 100 mm body; it "
            "must lie between 2 mm and 150 mm; the inertia times 0.001 would give 29.5 mm.",
        ),
        (
            of(0.1, (0.05, 0, 0), (6.7, 87, 87)),
            "impossible",
            "inertia 87 kg m² with 100 g gives a gyration radius of 29 500 mm to a 100 mm body; it "
            "must lie between 2 mm and 150 mm; the inertia times 0.000001 would give 29.5 mm.",
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
            of(0.1, (0.05, 0, 0), [[8e-5, 5e-5, 0], [5e-5, 8e-5, 0], [0, 0, 8e-5]]),
            "impossible",
            "principal moments 3e-05, 8e-05, 0.00013 kg m² belong to no body; the largest may not "
            "exceed the sum of the others; product xy is 5e-05, and no body's is more than half "
            "of zz, 4e-05.",
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
            "centre of mass lies 49 900 mm outside its 100 mm box; times 0.001 it would lie "
            "inside.",
        ),
        (
            of(0.1, (0.13, 0, 0), (6.7e-6, 8.7e-5, 8.7e-5)),
            "suspect",
            "centre of mass lies 30 mm outside its 100 mm box; it must lie inside.",
        ),
        (
            of(100, (0.05, 0, 0), (6.7e-3, 8.7e-2, 8.7e-2)),
            "suspect",
            "100 000 g in 40 cm³ of mesh is 2 500 000 kg/m³; what robots are made of has 100 to "
            "9 000; the mass times 0.001 would fit.",
        ),
        (
            of(0.1, (0.05, 0, 0), (6.7e-6, 8.7e-4, 8.7e-4)),
            "suspect",
            "inertia 0.00087 kg m² with 100 g gives a gyration radius of 93.3 mm to a 100 mm body; "
            "no point of it lies that far from its centre of mass, but at most 52 mm.",
        ),
    ],
    ids=[
        "unit-of-inertia",
        "unit-of-both",
        "triangle",
        "negative-moment",
        "product",
        "negative-mass",
        "inertia-alone",
        "unit-of-centre",
        "centre-outside",
        "density",
        "wide-inertia",
    ],
)
def test_an_impossible_body_is_named_by_the_number(
    inertial: Inertial, severity: str, what: str
) -> None:
    assert told(inertial) == [(severity, what)]


def test_a_plate_with_rounded_digits_is_possible() -> None:
    """1 and 2 parts, rounded to 3.001: more than their sum by 0.033 % of itself."""
    plate = of(0.1, (0.05, 0, 0), (2.9e-5, 5.8e-5, 8.703e-5))
    assert told(plate) == [
        (
            "note",
            "principal moments 2.9e-05, 5.8e-05, 8.703e-05 kg m² are those of a plate, rounded; "
            "they were raised by 0.034 % of the largest.",
        )
    ]
    moments = np.linalg.eigvalsh(possible(plate).inertia)
    assert moments[2] <= moments[0] + moments[1] + 1e-18
    np.testing.assert_allclose(moments, [2.9e-5, 5.8e-5, 8.703e-5], rtol=1.1e-3)
    assert possible(BAR) is BAR


def test_links_that_share_one_mass_and_inertia_are_copies() -> None:
    tree = TREE
    for joint in ("coxa", "femur", "tibia"):
        tree = with_link(tree, f"left_front_{joint}_link", inertial=BAR)
        tree = with_link(tree, f"right_front_{joint}_link", inertial=BAR)
    assert [(f.subject, f.what) for f in faults(tree)] == [
        (
            "legs 1 and 6",
            "coxa, femur and tibia all have 100 g and the same inertia; unlike parts must have "
            "masses of their own.",
        )
    ]


def test_a_pair_of_legs_weighs_the_same() -> None:
    m = TREE.links[TIBIA].inertial
    assert m is not None
    tree = with_link(TREE, TIBIA, inertial=Inertial(1.2 * m.mass, m.com, 1.2 * m.inertia))
    assert [(f.subject, f.what) for f in faults(tree)] == [
        (
            "leg 1",
            "its tibia has 171.8 g, and that of leg 6, across the body, 206.2 g; a pair should "
            "weigh the same.",
        )
    ]


def test_what_a_whole_robot_weighs_is_plausible() -> None:
    heavy = {
        name: replace(
            link,
            inertial=link.inertial
            and Inertial(1e3 * link.inertial.mass, link.inertial.com, 1e3 * link.inertial.inertia),
        )
        for name, link in TREE.links.items()
    }
    assert [f.what for f in faults(replace(TREE, links=heavy))] == [
        "weighs 3 216 kg in all; walking robots weigh 0.05 to 200 kg; times 0.001 it would."
    ]


def in_grams() -> Tree:
    """N4: masses in grams, inertias in kg m²."""
    return scaled_masses(TREE, 1e3, inertias=False)


def test_masses_in_grams_are_one_finding_and_not_one_of_every_link() -> None:
    assert [f.what for f in faults(in_grams())] == [
        "weighs 3 216 kg in all, and its inertias are those of 3.216 kg; masses must be in "
        "kilograms, and these look like grams."
    ]


def test_masses_in_grams_are_judged_as_a_person_weighed_them() -> None:
    """N4: the links' inertias are in the proportion of their masses, 3.2 kg to 3.216 kg."""
    imported = robot_from_tree(in_grams(), ImportOptions(total_mass=3.2))
    subjects = [f.subject for f in imported.findings if f.severity is not Severity.NOTE]
    assert not [subject for subject in subjects if subject.startswith(("link", "robot:"))]
    assert imported.facts is not None
    assert imported.facts.mass == pytest.approx(3.2, rel=1e-12)


def test_lengths_in_millimetres_are_one_finding() -> None:
    def longer(joint: TreeJoint) -> TreeJoint:
        X = joint.X_parent_child.copy()
        X[:3, 3] *= 1000
        return replace(joint, X_parent_child=X)

    (found,) = faults(with_joints(TREE, longer))
    assert found.subject == "robot"
    assert found.what.endswith("lengths above 2 m are refused. They look like millimetres.")
    assert found.hint == "divide every length by 1000: xyz of all origins are metres"


def test_limits_and_strengths_of_joints_are_possible() -> None:
    name = "left_rear_femur"
    assert [f.what for f in faults(with_joint(TREE, name, lower=0.0, upper=0.0))] == [
        "its limits 0° to 0° leave it no way; the upper must be above the lower."
    ]
    (found,) = faults(with_joint(TREE, name, lower=-75.0, upper=75.0))
    assert found.severity is Severity.IMPOSSIBLE
    assert found.what == (
        "its limits reach 75 rad, 11.9 turns; a leg's joint turns by one at most. "
        "75° would be 1.309 rad."
    )
    assert found.hint == "1.309, in radians"
    assert [f.what for f in faults(with_joints(TREE, lambda j: replace(j, effort=0.0)))] == [
        "its effort is 0; it must be finite and greater than 0."
    ]


def test_lengths_in_millimetres_are_told() -> None:
    long = block((0.0, -10.0, -10.0), (100.0, 10.0, 10.0))
    tree = with_link(TREE, TIBIA, parts=(long,), inertial=None)
    assert "its mesh is 100 m long; lengths above 2 m are refused. In millimetres it would be " + (
        "100 mm."
    ) in [f.what for f in faults(tree)]
    X = np.eye(4)
    X[0, 3] = 52.9
    tree = with_joint(TREE, "left_rear_femur", X_parent_child=X)
    (found,) = [f for f in faults(tree) if f.subject == "joint left_rear_femur"]
    assert found.severity is Severity.IMPOSSIBLE
    assert found.what == (
        "it stands 52.9 m from its parent's frame; lengths above 2 m are refused. In millimetres "
        "it would be 52.9 mm."
    )


def test_a_servo_far_too_strong_or_fast_is_taken_for_a_placeholder() -> None:
    """Times of the weight at a leg's length: 1000 N·m over 31.6 N times 0.246 m."""
    servo = replace(MK4.servo, stall_torque=1000.0, no_load_speed=100.0)
    found = judge_robot(replace(MK4, servo=servo))
    assert [f.severity.value for f in found] == ["suspect", "suspect"]
    assert found[0].what == (
        "effort 1000 N·m would lift 129 such robots at a leg's length; it is hardly a servo's."
    )


def test_a_robot_must_stand_over_its_feet() -> None:
    for aside, severity in ((0.08, "suspect"), (1.5, "impossible")):
        body = replace(
            MK4.body, com=np.array([0, aside, 0]), size=np.full(3, 2.0), inertia=np.eye(3) * 0.1
        )
        found = [f for f in judge_robot(replace(MK4, body=body)) if f.subject == "robot"]
        assert [f.severity.value for f in found] == [severity]


def test_a_robot_that_topples_on_feet_that_phasmid_assumed_is_not_impossible() -> None:
    body = replace(
        MK4.body, com=np.array([1.5, 0, 0]), size=np.full(3, 2.0), inertia=np.eye(3) * 0.1
    )
    robot = replace(MK4, body=body)
    for assumed, severity in ((True, Severity.SUSPECT), (False, Severity.IMPOSSIBLE)):
        (found,) = [f for f in judge_standing(robot, assumed=assumed) if "topples" in f.what]
        assert found.severity is severity


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
        assert found.what.endswith("fixed to base_link and light beside it.") is fine


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


def test_masses_that_are_kept_are_judged_and_inertias_that_are_not_are_counted() -> None:
    """A left tibia heavier by a fifth and made of lead; a femur whose moments are negative."""
    tibia, femur = TREE.links[TIBIA], TREE.links["left_rear_femur_link"]
    assert tibia.inertial
    assert femur.inertial
    heavy = replace(tibia.inertial, mass=1.2 * tibia.inertial.mass)
    tree = with_link(TREE, TIBIA, inertial=heavy, parts=(block((0, 0, 0), (0.05, 0.01, 0.01)),))
    wrong = replace(femur.inertial, inertia=-femur.inertial.inertia)
    tree = with_link(tree, "left_rear_femur_link", inertial=wrong)
    found = robot_from_tree(tree, ImportOptions(masses="geometry")).findings
    suspect = [f.what for f in found if f.severity is Severity.SUSPECT]
    assert any(what.startswith("its tibia has 171.8 g, and that of leg 6") for what in suspect)
    assert any(what.startswith("206.2 g in 5 cm³ of mesh") for what in suspect)
    assert any("centres of mass and inertias, which are not used." in f.what for f in found)
    assert not any("principal moments" in f.what for f in found)
    # With another robot's masses none of this counts.
    found = robot_from_tree(tree, ImportOptions(masses="phantomx-mk4")).findings
    assert {f.severity for f in found} == {Severity.NOTE}


def leg_changed(**fields: object) -> Robot:
    """The Mark IV with another left rear leg."""
    legs = [replace(leg, **fields) if leg.name == "left_rear" else leg for leg in MK4.legs]  # type: ignore[arg-type]
    return replace(MK4, legs=tuple(legs))


def suspected(robot: Robot) -> list[tuple[str, str]]:
    """What is suspect about a robot's legs, said alike of a robot and of its description."""
    said = [f for f in judge_robot(robot) if f.severity is Severity.SUSPECT]
    read = robot_from_tree(tree_of(robot)).findings
    assert {f.what for f in said} <= {f.what for f in read}
    return [(f.subject, f.what) for f in said]


def test_a_leg_that_points_across_the_body_is_told() -> None:
    assert suspected(leg_changed(mount_yaw=math.radians(-135))) == [
        (
            "leg left_rear",
            "points across the body: its hip lies on the left and its yaw is -135°.",
        )
    ]


def test_sides_that_do_not_mirror_each_other_are_told() -> None:
    leg = MK4.leg("left_rear")
    longer = replace(leg.tibia, length=leg.tibia.length + 0.02)
    place = leg.mount_position + np.array([0.01, 0, 0])
    yaw = leg.mount_yaw - math.radians(10)
    assert suspected(leg_changed(tibia=longer, mount_position=place, mount_yaw=yaw)) == [
        (
            "leg right_rear",
            "is not the mirror image of leg left_rear: the hips' places differ by 10 mm; their "
            "directions differ by 10°; its tibia is 130.9 mm long and that one's 150.9 mm.",
        )
    ]


def test_joints_stand_within_their_limits() -> None:
    leg = MK4.legs[0]
    limits = leg.joint_limits.copy()
    limits[2] = [-1.0, 0.0]
    legs = (replace(leg, joint_limits=limits), *MK4.legs[1:])
    (found,) = [f for f in judge_robot(replace(MK4, legs=legs)) if "joint" in f.subject]
    assert found.subject == "joint right_front.tibia"
    assert found.what.endswith("°, outside its limits [-57.3°, 0°].")


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(140.2, 2, "140"), (12345, 3, "12 300"), (1e-4, 4, "0.0001"), (0.0, 4, "0")],
)
def test_numbers_in_findings_have_no_powers_of_ten(value: float, digits: int, text: str) -> None:
    assert plain_number(value, digits) == text
    # A link of 140 mm with the inertia of a wheel: its radius of gyration is sqrt(I / m).
    with pytest.raises(InvalidRobot, match=r"radius of 320 mm for a 140 mm link; .* and 210 mm"):
        Link("tibia", 0.14, 0.1, np.zeros(3), np.eye(3) * 0.01)


def test_a_tree_without_legs_is_judged_all_the_same() -> None:
    tree = Tree("bar", {"bar": TreeLink("bar", of(-1, (0, 0, 0), (1, 1, 1)))}, ())
    assert [f.what for f in judge(tree)] == [
        "mass is -1 kg; it must be greater than 0.",
        "bar has 0 chains of three hinges that leave bar; a walking robot here has 4 legs or more.",
    ]


def test_radians_for_degrees_in_joint_limits_are_suspect() -> None:
    """N11: coxa_deg = [-1.3, 1.3] is 2.6° in all."""
    legs = []
    for leg in MK4.legs:
        limits = leg.joint_limits.copy()
        limits[0] = np.radians([-1.3, 1.3])
        legs.append(replace(leg, joint_limits=limits))
    (found,) = [f for f in judge_robot(replace(MK4, legs=tuple(legs))) if "turns" in f.what]
    assert found.severity is Severity.SUSPECT
    assert found.subject.startswith("joints right_front.coxa, right_middle.coxa, ")
    assert found.what == "turns by 2.6° in all, [-1.3°, 1.3°]."


def test_a_stride_of_some_millimetres_is_suspect() -> None:
    """The coxae turn by 5.2° in all about neutral feet 150 mm out: ±2.6° are ±6.8 mm, and the
    stride ahead of the corner legs is less as they stand aslant."""
    legs = []
    for leg in MK4.legs:
        limits = leg.joint_limits.copy()
        limits[0] = np.radians([-0.6, 4.6])
        legs.append(replace(leg, joint_limits=limits))
    (found,) = [f for f in judge_robot(replace(MK4, legs=tuple(legs))) if "stride" in f.what]
    assert found.severity is Severity.SUSPECT
    assert found.what.endswith("a walking robot's is 10 mm or more.")
