"""STEP files in and out: names, colours, geometry and inertias survive; what is wrong is told."""

import re
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("build123d")

from phasmid.errors import InvalidInput
from phasmid.formats import robot_from_tree
from phasmid.formats.solids import build, mass_properties
from phasmid.formats.solids import drawing as drawings
from phasmid.formats.solids.drawing import read_drawing
from phasmid.formats.step_in import SidecarReader, read_step, sidecar_of
from phasmid.formats.step_out import sidecar_text, step_files, step_text
from phasmid.robot import JOINTS, load_robot

ROBOT = load_robot("phantomx-paper")


@pytest.fixture(scope="module")
def assembly():
    return build(ROBOT)


@pytest.fixture(scope="module")
def folder(assembly, tmp_path_factory):
    """The paper's robot as a STEP file, with its sidecar."""
    folder = tmp_path_factory.mktemp("step")
    (folder / "robot.step").write_bytes(step_text(assembly))
    text = sidecar_text(ROBOT, assembly)
    (folder / "robot.step.toml").write_text(text, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def drawing(folder):
    return read_drawing(folder / "robot.step")


@pytest.fixture(scope="module")
def own_text(folder):
    """The robot's sidecar, with one axis that is a servo's."""
    text = (folder / "robot.step.toml").read_text(encoding="utf-8")
    head, joint, tail = text.partition("[joints.right_front_coxa]")
    return head + joint + re.sub(r"point_m = .*", 'axis_of = "body/servo"', tail, count=1)


@pytest.fixture(scope="module")
def imported(folder, drawing, own_text):
    robot = robot_from_tree(tree(folder, drawing, own_text)).robot
    assert robot is not None
    return robot


def tree(folder, drawing, text):
    """The tree that a changed sidecar makes of the drawing, which is read only once."""
    path = folder / "changed.step"
    sidecar_of(path).write_text(text, encoding="utf-8")
    return SidecarReader(path).tree(drawing)


def test_parts_keep_their_colours_and_volumes(assembly, drawing):
    drawn = [part for part in drawing if part.path.startswith("right_front/tibia/")]
    for part, placed in zip(drawn, assembly.links["right_front.tibia"], strict=True):
        assert part.product == placed.solid.name
        # The file holds colours in single precision.
        assert part.look.color == pytest.approx(placed.solid.material.color, abs=1e-6)
        # Volumes are integrals over the same faces, to the kernel's tolerance of 1e-6.
        assert 1e9 * part.solid.mass == pytest.approx(placed.solid.shape.volume, rel=1e-5)


def test_the_round_trip_keeps_geometry_and_inertias(imported, assembly):
    assert imported.leg_names == ROBOT.leg_names
    made = mass_properties(assembly)
    links = [(imported.body, made["body"])]
    for leg, own in zip(imported.legs, ROBOT.legs, strict=True):
        assert np.abs(leg.lengths - own.lengths).max() < 1e-6
        assert np.abs(leg.X_body_hip - own.X_body_hip).max() < 1e-6
        assert np.abs(leg.joint_limits - own.joint_limits).max() < 1e-6
        links += [(link, made[f"{leg.name}.{link.name}"]) for link in leg.links]
    assert imported.servo.stall_torque == ROBOT.servo.stall_torque
    for link, solid in links:
        assert link.mass == pytest.approx(solid.mass, rel=0.01)
        assert np.abs(link.com - solid.com).max() < 1e-6
        largest = np.abs(solid.inertia).max()
        assert np.abs(link.inertia - solid.inertia).max() < 0.01 * largest


def test_a_converted_robot_keeps_the_numbers_of_its_file_whatever_its_legs_are_called(tmp_path):
    """Names that are patterns, paths, the trunk's, another's, not of the first plane, and long."""
    names = ["leg[1]*?", "a/b", "a_b", "body", 'ü\U0001f600"', 64 * "l"]
    legs = tuple(replace(leg, name=name) for leg, name in zip(ROBOT.legs, names, strict=True))
    motor = replace(ROBOT.servo, name="of no maker", rated_stall_torque=1.7)
    changed = replace(ROBOT, legs=legs, servo=motor)
    drawn = build(changed).links
    for name, data in step_files(changed, "own.step").items():
        (tmp_path / name).write_bytes(data)
    robot = robot_from_tree(read_step(tmp_path / "own.step")).robot
    assert (robot.name, robot.servo) == (ROBOT.name, motor)
    # Round-off of a turn of the inertia there and back.
    for leg, own in zip(robot.legs, legs, strict=True):
        assert np.abs(leg.lengths - own.lengths).max() < 1e-6
        for link, given in zip(leg.links, own.links, strict=True):
            assert link.mass == pytest.approx(given.mass, rel=1e-12)
            assert np.abs(link.com - given.com).max() < 1e-9
            assert np.abs(link.inertia - given.inertia).max() < 1e-6 * given.inertia.max()
        for joint in JOINTS:
            # Each link shows the solids that were drawn for it.
            shown = robot.appearance.link(leg.name, joint)
            assert len(shown) == len(drawn[f"{own.name}.{joint}"])
    assert len(robot.appearance.body) == len(drawn["body"])
    assert robot.body.mass == pytest.approx(ROBOT.body.mass, rel=1e-12)


def test_a_weighed_link_has_that_mass_and_its_inertia_in_proportion(folder, drawing, own_text):
    before = tree(folder, drawing, own_text).links["right_front_coxa_link"].inertial
    head = "[links.right_front_coxa_link]\n"
    text = own_text.replace(head, f"{head}mass_g = 30\n")
    after = tree(folder, drawing, text).links["right_front_coxa_link"].inertial
    assert after.mass == pytest.approx(0.030, rel=1e-12)
    assert after.com == pytest.approx(before.com, rel=1e-12, abs=1e-15)
    assert after.inertia == pytest.approx(before.inertia * 0.030 / before.mass, rel=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('parts = ["body/*"]', 'parts = ["boddy/*"]', r'no part of the drawing is called "boddy'),
        ('"body/servo"', '"body/nothing"', r'axis_of names 0 parts of the drawing, "body/nothing"'),
        ('"body/servo"', '"body/servo*"', r"axis_of names 6 parts"),
        ('"body/servo"', '"body/battery"', r"has no round face"),
        ('axis_of = "body/servo"\n', "", r"must have axis_of, or point"),
        ('parent = "base_link"', 'parent = "base"', r'names "base", which is no link'),
        ("[parts.battery]", "[parts.cells]", r"part body/battery has neither a mass nor a density"),
        ("density_kg_m3 = 2000.0", "", r"must have either mass_g or density_kg_m3"),
        ("density_kg_m3 = 2000.0", "density_kg_m3 = -1", r"it must be greater than 0"),
        ("servo =", "motor =", r'unknown key "motor"'),
        ('link = "right_front_tibia_link"', 'link = "tibia"', r'names "tibia", which is no link'),
        ("direction = [0.0", "direction = [1.0", r"lies across the axis|some length"),
    ],
)
def test_a_sidecar_that_does_not_fit_gets_one_sentence(folder, drawing, own_text, old, new, said):
    assert old in own_text
    with pytest.raises(InvalidInput, match=said) as refused:
        tree(folder, drawing, own_text.replace(old, new, 1))
    assert "changed.step.toml" in refused.value.where


def test_parts_of_no_link_are_told(folder, drawing, own_text):
    text = own_text.replace('parts = ["body/*"]', 'parts = ["body/servo*", "body/plate*"]')
    (finding,) = tree(folder, drawing, text).findings
    assert "belong to no link and were left out: body/post, body/post_2" in finding.what


@pytest.mark.parametrize(
    ("raw", "said"),
    [
        (b"solid cube\n", r"is no STEP file; it must begin with ISO-10303-21"),
        (b"ISO-10303-21;\nHEADER;\n", r"is damaged|holds no shapes that can be read"),
        (b"ISO-10303-21;", r"has no bad\.step\.toml beside it"),
    ],
)
def test_what_is_no_step_file_or_has_no_sidecar_gets_one_sentence(tmp_path, raw, said):
    (tmp_path / "bad.step").write_bytes(raw)
    with pytest.raises(InvalidInput, match=said):
        (read_step if "sidecar" in said or "toml" in said else read_drawing)(tmp_path / "bad.step")


@pytest.mark.parametrize("name", ["../away/secret.stp", "beside.stp"])
def test_parts_in_other_files_are_not_fetched(folder, tmp_path, name):
    text = (folder / "robot.step").read_text(encoding="utf-8")
    product = next(line.split()[0] for line in text.splitlines() if "= PRODUCT_DEFINITION(" in line)
    text = text.replace(
        "ENDSEC;\nEND-ISO",
        f"#900001 = DOCUMENT_TYPE('');\n#900002 = DOCUMENT_FILE('{name}','',$,#900001,'',$);\n"
        "#900003 = IDENTIFICATION_ROLE('external document id and location',$);\n"
        f"#900004 = EXTERNAL_SOURCE(IDENTIFIER('{name}'));\n"
        f"#900005 = APPLIED_EXTERNAL_IDENTIFICATION_ASSIGNMENT('{name}',#900003,#900004,"
        "(#900002));\n"
        f"#900006 = APPLIED_DOCUMENT_REFERENCE(#900002,'',({product}));\n"
        "ENDSEC;\nEND-ISO",
    )
    (tmp_path / "robot.step").write_text(text, encoding="utf-8")
    with pytest.raises(InvalidInput, match=f"has parts in other files, such as {name}; write"):
        read_drawing(tmp_path / "robot.step")


def test_a_file_that_takes_too_long_is_given_up(folder, monkeypatch):
    monkeypatch.setattr(drawings, "LONGEST", 0.05)
    with pytest.raises(InvalidInput, match=r"takes longer than 0\.05 s"):
        read_drawing(folder / "robot.step")
