"""The trunk's box keeps its own lowest and highest corner wherever it counts.

The box of every test is off the body's origin in all directions; a box about the origin that has
its size, or reaches as far, fails each of them by 10 mm or more.
"""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from formats.trees import block, with_link
from phasmid.control import LocomotionEngine
from phasmid.control.foothold_planning import TRUNK_CLEARANCE
from phasmid.control.sequences import packing
from phasmid.control.sequences.ground import belly_ground, resting_ground
from phasmid.errors import InvalidRobot
from phasmid.experiment import Command, Observation
from phasmid.formats import robot_from_tree, tree_of
from phasmid.kinematics import neutral_feet, rotation_rpy, rpy_quaternion, trunk_clearance
from phasmid.reporting.robot_mesh import link_meshes
from phasmid.robot import load_robot, robot_to_toml
from phasmid.robot.variants import with_payload
from phasmid.scenario import Scenario
from phasmid.simulation.contact import trunk_points
from phasmid.simulation.sensors.depth import DepthSensor
from phasmid.simulation.start import standing
from phasmid.simulation.termination import trunk_clearance as clearance_in_run

LOW, HIGH = np.array([-0.09, -0.08, -0.03]), np.array([0.11, 0.04, 0.13])
CORNERS = np.array(list(product(*zip(LOW, HIGH, strict=True))))
TOP = np.array([0.01, -0.02, 0.13])
PLAIN = load_robot("phantomx-ax")
ROBOT = replace(
    PLAIN,
    body=replace(PLAIN.body, size=HIGH - LOW, box_centre=(LOW + HIGH) / 2),
    appearance=None,
)
HEIGHT = -float(neutral_feet(ROBOT)[:, 2].mean())


def test_the_box_is_that_of_its_corners():
    np.testing.assert_allclose(ROBOT.body.box, [LOW, HIGH], atol=1e-15)
    assert (load_robot("phantomx-ax").body.box_centre == 0).all()


def test_a_payload_stands_in_the_middle_of_its_top():
    loaded, body = with_payload(ROBOT, 0.5).body, ROBOT.body
    moment = loaded.mass * loaded.com - body.mass * body.com
    np.testing.assert_allclose(moment / 0.5, TOP, atol=1e-14)
    np.testing.assert_array_equal(loaded.box, body.box)


def test_its_clearance_is_that_of_its_lowest_corner():
    """In any pose, for the plan and for the end of a run, against all eight corners turned."""
    ground = Scenario().load_terrain()
    for pose in np.random.default_rng(1).uniform(-0.5, 0.5, (20, 6)):
        lowest = HEIGHT + pose[2] + (CORNERS @ rotation_rpy(*pose[3:, None])[0].T)[:, 2].min()
        assert trunk_clearance(ROBOT, HEIGHT, pose) == pytest.approx(lowest, abs=1e-14)
        state = [*pose[:2], HEIGHT + pose[2], *rpy_quaternion(*pose[3:, None])[0], *[0.0] * 18]
        found = clearance_in_run(ROBOT, np.array([state]), ground)
        assert found[0] == pytest.approx(lowest, abs=1e-14)


def test_the_robot_lies_on_its_bottom():
    packed = packing(ROBOT)
    assert belly_ground(ROBOT).body_height == pytest.approx(0.03, abs=1e-15)
    assert resting_ground(ROBOT, packed.folded).body_height == pytest.approx(0.03, abs=1e-15)
    np.testing.assert_allclose(packed.feet[:, 2], -0.03, atol=1e-15)
    start = standing(Scenario(robot=ROBOT).build(), packed.folded).trunk.position[0, 2]
    assert start == pytest.approx(0.03, abs=1e-15)
    scenario = Scenario().replace(robot=ROBOT)
    law = scenario.build().world.contact
    bottom = trunk_points(ROBOT, law) - [0.0, 0.0, law.point_radius]
    assert {tuple(p) for p in bottom.round(9)} == {tuple(p) for p in CORNERS.round(9) if p[2] < 0}


def test_the_engine_keeps_its_bottom_above_a_map():
    """A wall of 20 mm under the box's right edge; a box about the origin would not be over it."""
    engine = LocomotionEngine(ROBOT, terrain_map="points")
    x, y = (w.ravel() for w in np.meshgrid(*[np.arange(-0.3, 0.3, 0.005) + 0.002] * 2))
    points = np.column_stack([x, y, np.where(y < -0.065, 0.02, 0.0) - HEIGHT])
    readings = {"joint_position": engine.state.q.copy(), "contact": np.ones(6, dtype=bool)}
    engine.reset(Observation(time=0.0, **readings))
    for k in range(40):
        engine.update(Observation(time=0.005 * k, ground_points=points, **readings), Command())
    lacks = 0.02 + 0.03 + TRUNK_CLEARANCE - HEIGHT
    assert engine.reference.least_rise == pytest.approx(lacks, abs=1e-3)


@pytest.mark.parametrize(
    ("kind", "mount"), [("camera", [0.11, -0.02, 0.16]), ("lidar", [0.01, -0.02, 0.19])]
)
def test_a_depth_sensor_is_on_its_top(kind, mount):
    """Errors of distances move points along the rays, which meet in the sensor."""
    scenario = Scenario().replace(depth=kind, depth_dropout=0.0, depth_drift=0.0)
    rays = []
    for noise in (0.0, 0.02):
        table = scenario.replace(depth_noise=noise).sensors
        sensor = DepthSensor(table, ROBOT, scenario.load_terrain())
        ray = sensor.read(np.array([0.0, 0.0, HEIGHT, 1.0, 0.0, 0.0, 0.0])) - mount
        rays.append(ray / np.linalg.norm(ray, axis=1)[:, None])
    np.testing.assert_allclose(rays[0], rays[1], atol=1e-12)


def test_its_drawing_has_its_bottom_and_top():
    plate, arrow = link_meshes(ROBOT)[None]
    low, high = plate.vertices[:, 2].min(), plate.vertices[:, 2].max()
    assert [low, high] == pytest.approx([-0.03, 0.13], abs=1e-12)
    assert arrow.vertices[:, 1:].mean(axis=0) == pytest.approx(TOP[1:], abs=1e-3)


def test_a_file_states_its_centre(tmp_path):
    file = tmp_path / "robot.toml"
    text = robot_to_toml(ROBOT)
    file.write_text(text, encoding="utf-8")
    again = load_robot(file)
    assert robot_to_toml(again) == text
    np.testing.assert_array_equal(again.body.box, ROBOT.body.box)
    assert "box_centre" not in robot_to_toml(PLAIN)
    rows = [line for line in text.splitlines() if not line.startswith(("box_centre", "com"))]
    rows.insert(rows.index("[body]") + 1, "box_centre_mm = [10, -20, 50]")
    file.write_text("\n".join(rows), encoding="utf-8")
    body = load_robot(file).body
    np.testing.assert_allclose(body.box, [LOW, HIGH], atol=1e-15)
    # A solid box has its mass about its centre.
    np.testing.assert_array_equal(body.com, [0.01, -0.02, 0.05])


def test_a_centre_in_the_wrong_unit_is_refused():
    with pytest.raises(InvalidRobot, match=r"centre of mass lies 50 m from the centre of a 0\.2 m"):
        replace(ROBOT.body, box_centre=np.array([0.0, 0.0, 50.0]))


def imported(tree):
    robot = robot_from_tree(tree).robot
    assert robot is not None
    return robot


def test_a_file_read_gives_the_box_of_the_trunks_meshes():
    """A trunk of 400 mm about a point above the hips, and a mast on it."""
    parts = block((-0.115, -0.075, -0.15), (0.115, 0.075, 0.25)), block((0, 0, 0.2), (0, 0, 0.3))
    body = imported(with_link(tree_of(ROBOT), "base_link", parts=parts[:1])).body
    np.testing.assert_allclose(body.size, [0.23, 0.15, 0.4], atol=1e-15)
    np.testing.assert_allclose(body.box_centre, [0.0, 0.0, 0.05], atol=1e-15)
    body = imported(with_link(tree_of(ROBOT), "base_link", parts=parts)).body
    np.testing.assert_allclose(body.box[:, 2], [-0.15, 0.3], atol=1e-15)


def test_a_thin_trunk_stays_thin_and_hips_alone_give_one_of_a_servos_height():
    plate = (block((-0.1, -0.1, 0.02), (0.1, 0.1, 0.03)),)
    body = imported(with_link(tree_of(ROBOT), "base_link", parts=plate)).body
    np.testing.assert_allclose(body.box[:, 2], [0.02, 0.03], atol=1e-15)
    hips = ROBOT.arrays.p_body_hip
    box = imported(tree_of(ROBOT)).body.box
    np.testing.assert_allclose(box[:, :2], [hips[:, :2].min(axis=0), hips[:, :2].max(axis=0)])
    np.testing.assert_allclose(box[:, 2], [-0.025, 0.025], atol=1e-15)


@pytest.mark.usefixtures("compiled_engine")
def test_a_packed_robot_rests_on_it():
    """In the physics engine: the contact's springs give less than a millimetre."""
    from phasmid.control import SafetyFilter, Sequencer
    from phasmid.experiment import Posture
    from phasmid.simulation import drive

    scenario = Scenario().replace(
        robot=ROBOT, drive="ideal-servo", duration=0.3, start_posture="packed"
    )
    controller = SafetyFilter(Sequencer(LocomotionEngine(ROBOT), ROBOT), ROBOT)
    run = drive(scenario, controller, Command(posture=Posture.PACKED))
    assert run.attrs["ending"] == "COMPLETED"
    assert run["body_position"].values[:, 2] == pytest.approx(0.03, abs=1e-3)
    # Legs hold an upright trunk.
    assert np.abs(run["body_orientation"].values[:, 1:3]).max() < 1e-2


def test_learning_measures_from_its_bottom_and_loads_its_top():
    from phasmid.learning.episodes import task_constants
    from phasmid.learning.model import PAYLOAD_SIDE, fast_specification
    from phasmid.learning.task import load_task

    task = load_task("walk")
    constants = task_constants(task, ROBOT)
    assert len(constants.underside) == 5
    assert {tuple(p) for p in constants.underside.round(9)} == {
        tuple(p) for p in [*CORNERS[CORNERS[:, 2] < 0].round(9), (0.01, -0.02, -0.03)]
    }
    scenario = Scenario().replace(robot=ROBOT)
    payload = fast_specification(scenario.build(), constants.terrain).body("payload")
    np.testing.assert_allclose(payload.pos, TOP + np.array([0, 0, PAYLOAD_SIDE / 2]), atol=1e-15)
