"""The parametric model: real servos, every part once, any robot, and masses that add up."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("build123d")

from phasmid.formats.solids import Assembly, build, mass_properties, meshes
from phasmid.formats.solids.assembly import MM
from phasmid.robot import JOINTS, load_robot
from support.general_robot import general_robot


@pytest.fixture(scope="module")
def paper():
    return build(load_robot("phantomx-paper"))


def test_the_paper_s_robot_has_eighteen_servos_of_one_solid_of_real_size(paper):
    servos = [p for parts in paper.links.values() for p in parts if p.name.endswith("servo")]
    assert len(servos) == 18
    assert len({id(p.solid.shape) for p in servos}) == 1
    # Table 2 gives the femur 120 g: it holds two of them.
    assert sum(p.name.endswith("servo") for p in paper.links["right_front.femur"]) == 2
    # An AX-12: 32 x 50 x 38 mm and 54.6 g.
    size = servos[0].solid.shape.bounding_box().size
    # The box of the kernel is widened by the tolerance of the solid's corners, 1e-7 mm.
    assert [size.Y, size.X, size.Z] == pytest.approx([32, 50, 38], abs=1e-6)
    alone = Assembly("", {"body": (servos[0],)}, {})
    assert mass_properties(alone)["body"].mass == pytest.approx(0.0546, rel=1e-12)


def test_plates_are_at_the_bottom_and_the_top_of_the_trunks_box():
    """A box off the origin, whose sides are where plates hold the servos: 24 to 31 mm away."""
    robot = load_robot("phantomx-ax")
    body = replace(
        robot.body, size=np.array([0.2, 0.12, 0.055]), box_centre=np.array([0, 0, 2.5e-3])
    )
    placed = {p.name: p for p in build(replace(robot, body=body)).links["body"]}
    for name, side, height in (("lower_plate", "min", -0.025), ("upper_plate", "max", 0.030)):
        box = placed[name].solid.shape.bounding_box()
        found = placed[name].X_link_part[2, 3] + getattr(box, side).Z / MM
        # The kernel's tolerance is 1e-7 mm.
        assert found == pytest.approx(height, abs=1e-9)


def test_legs_of_one_kind_share_their_meshes_and_others_do_not(paper):
    assert set(meshes(paper)) == {"body", *JOINTS}
    robot = load_robot("phantomx-paper")
    first = robot.legs[0]
    longer = replace(first, tibia=replace(first.tibia, length=0.15))
    own = meshes(build(replace(robot, legs=(longer, *robot.legs[1:]))))
    assert {"coxa", "femur", "right_front.tibia", "left_rear.tibia"} <= set(own)
    assert "tibia" not in own


def test_a_mesh_is_its_solid_within_the_tolerance(paper):
    # Chords of a round face lie inside by 0.15 mm at most, so that a mesh's volume differs by less
    # than that depth times the part's surface.
    look = meshes(paper)["femur"]
    for part, placed in zip(look, paper.links["right_front.femur"], strict=True):
        a, b, c = np.moveaxis(part.vertices[part.faces], 1, 0)
        volume = np.sum(a * np.cross(b, c)) / 6 * 1e9
        shape = placed.solid.shape
        assert shape.is_valid
        assert volume == pytest.approx(shape.volume, abs=0.15 * shape.area)
        assert volume == pytest.approx(shape.volume, rel=0.02)


def test_any_robot_can_be_drawn():
    # Five unlike legs on tilted hips.
    robot = general_robot()
    assembly = build(robot)
    assert len(assembly.links) == 1 + 3 * len(robot.legs)
    look = meshes(assembly)
    for leg in robot.legs:
        # The foot's ball ends at the foot, but for the mesh's tolerance.
        tip = [leg.tibia.length, 0, 0]
        corners = np.concatenate([part.vertices for part in look[f"{leg.name}.tibia"]])
        assert np.linalg.norm(corners - tip, axis=1).min() < 0.3e-3


WALKS = """
import sys
import phasmid
scenario = phasmid.load_scenario("paper")
walk = phasmid.plan(scenario.replace(duration=1.0))
assert scenario.load_robot().appearance.parts
loaded = [name for name in sys.modules if name.partition(".")[0] in ("build123d", "OCP")]
print(loaded)
"""


def test_walking_and_the_robot_s_look_load_no_cad_library():
    run = subprocess.run([sys.executable, "-c", WALKS], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
