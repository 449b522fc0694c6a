"""The ground in the engine is the ground of the planner, and its contact law that of the plane."""

import math

import mujoco
import numpy as np
import pytest

from phasmid.errors import InvalidInput
from phasmid.kinematics import yaw_quaternion
from phasmid.motion import plan
from phasmid.recording import load_recording, save_recording
from phasmid.reporting import report
from phasmid.scenario import load_scenario, replay
from phasmid.simulation import Run, simulate
from phasmid.simulation.contact import FootGround
from phasmid.simulation.model import build_model
from phasmid.terrain import Blocky, height_text, heights_from_text

PAPER = load_scenario("paper").replace(planned_on="level")
HILLS = height_text(0.026 * np.random.default_rng(3).uniform(size=(17, 24)))
KINDS = {
    "flat": {},
    "slope": {"slope_deg": 20},
    "slope-from-a-place": {"terrain": "slope", "terrain_start_mm": 300},
    "stairs": {},
    "stairs-down": {"terrain": "stairs", "rise_mm": -15},
    "step": {},
    "gap": {},
    "blocks": {"block_gap_mm": 5},
    "beams": {},
    "stepping-stones": {},
    "course": {},
    "waves": {},
    "rough": {},
    "height-map": {"height_map": HILLS, "map_cell_mm": 40},
    "ice": {},
}


def on(kind, **changes):
    return PAPER.replace(**{"terrain": kind, **KINDS[kind], **changes})


@pytest.fixture(scope="module")
def robot():
    return PAPER.load_robot()


def placed(robot, scenario, x, y, yaw, z):
    """The engine with the robot at its neutral stance there, the ground under its feet set."""
    walk = plan(PAPER)
    model = build_model(scenario)
    data = mujoco.MjData(model)
    foot_ground = FootGround(model, data, robot, scenario.load_terrain())

    def place(x, y, yaw, z):
        data.qpos[:3] = x, y, z
        data.qpos[3:7] = yaw_quaternion(np.array(yaw))
        data.qpos[7:] = walk.q[0].ravel()
        if foot_ground.varies:
            foot_ground.update()
        mujoco.mj_forward(model, data)

    place(x, y, yaw, z)
    return model, data, place


@pytest.mark.parametrize("yaw", [0.0, 0.7])
@pytest.mark.parametrize("kind", KINDS)
def test_engine_and_planner_have_one_height(robot, kind, yaw):
    # A ray from above meets blocks and planes at the planner's height, but for rounding. Where each
    # foot has a plane of its own, the robot is let down until its lowest foot is 1 mm deep, and
    # the engine's contact lies at the planner's height: under the point's centre by its radius and
    # the distance, along the contact's normal. A tangent plane is off by curvature times the square
    # of 3.3 mm (the farthest point of a foot, on a slope of 30°) over 2: by 1 mm for a curvature of
    # 180/m. The waves have 4/m, the map 4 * 26 mm/(40 mm)² = 65/m.
    scenario = on(kind, terrain_yaw=yaw)
    ground, random = scenario.load_terrain(), np.random.default_rng(1)
    model, data, place = placed(robot, scenario, 0.0, 0.0, 0.0, 5.0)
    if isinstance(ground.shape, Blocky) or kind in ("flat", "slope", "ice"):
        met = np.zeros(1, np.int32)
        places = random.uniform((-0.5, -1), (2.5, 1), (500, 2))
        heights = ground.height(*places.T)
        for (x, y), height in zip(places, heights, strict=True):
            way = mujoco.mj_ray(model, data, [x, y, 3.0], [0.0, 0.0, -1.0], None, 1, -1, met, None)
            assert 3.0 - way == pytest.approx(height, abs=1e-9)
        return
    worst = []
    for x, y, turn in random.uniform((-0.5, -0.7, -3), (2, 0.7, 3), (100, 3)):
        place(x, y, turn, 1.0)
        feet = data.site_xpos
        place(x, y, turn, 0.999 - (feet[:, 2] - ground.height(feet[:, 0], feet[:, 1])).min())
        assert data.ncon > 0
        for contact in data.contact:
            met = contact.pos - contact.frame[:3] * contact.dist / 2
            worst.append(abs(met[2] - ground.height(met[:1], met[1:2])[0]))
    assert max(worst) < 1e-3


@pytest.mark.parametrize(("friction", "sticks"), [(0.7, True), (0.1, False)])
def test_what_stands_on_ice_slides_and_on_rubber_sticks(friction, sticks):
    # With gravity tilted by 15° a body slides where tan 15° = 0.27 exceeds the friction of the
    # place, with the acceleration g (sin a - μ cos a); elsewhere it creeps by its weight's part
    # along the ground over 300 N s/m for each point that touches, of which at least twelve do.
    # The ground's own friction, outside of the patch, would do the opposite.
    scenario = PAPER.replace(friction=0.8 - friction, patches=[[-5, 5, -5, 5, friction]])
    run = Run(scenario, plan(scenario))
    a, g, steps = math.radians(15), 9.81, 300
    run.model.opt.gravity = [g * math.sin(a), 0, -g * math.cos(a)]
    still = np.repeat(run.walk.q[:1].reshape(1, -1), steps, axis=0)
    run._advance(still)
    speed = float(run.data.qvel[0])
    if sticks:
        assert 0 < speed < run.robot.mass * g * math.sin(a) / (300 * 12)
    else:
        # At first the robot leans into its springs, within a few of the 300 steps.
        slides = g * (math.sin(a) - friction * math.cos(a)) * steps * run.dt
        assert speed == pytest.approx(slides, rel=0.03)


def test_friction_changes_where_the_patch_ends():
    # Right feet (y < 0) stand on ice, left ones on rubber: the engine's points say so.
    scenario = PAPER.replace(patches=[[-5, 5, -5, 0, 0.1]])
    run = Run(scenario, plan(scenario))
    for leg in run.robot.legs:
        for i in range(4):
            friction = run.model.geom(f"{leg.name}.point{i}").friction[0]
            assert friction == (0.1 if leg.name.startswith("right") else 0.7)


def test_normal_force_is_along_the_normal_of_the_ground():
    # Dropped onto a slope of angle a, level ground planned, the robot lies on it and walks on the
    # spot. Over whole cycles the sum of normal forces is m g cos a in the mean, and that of the
    # vertical forces m g. Speeds at the ends differ by some mm/s: 2.65 kg * 5 mm/s / 2 s = 7 mN
    # of 26 N, 3e-4.
    scenario = on("slope", slope_deg=10, step_length=0, duration=4, start_height_mm=150)
    recording = simulate(scenario, plan(scenario)).isel(time=slice(2000, 4000))
    weight = 26.0
    normal = recording["foot_normal_force"].sum("leg").mean()
    vertical = recording["foot_force"].sel(axis="z").sum("leg").mean()
    assert float(normal) == pytest.approx(weight * math.cos(math.radians(10)), rel=1e-3)
    assert float(vertical) == pytest.approx(weight, rel=1e-3)


def test_t7_a_start_inside_the_ground():
    # The hips are 100 mm over the feet's plane; the left rear foot (x < 0) stands deepest in ground
    # that rises backwards and to the left. Its depth is tan(slope) times its way along it.
    scenario = on("slope", slope_deg=5, terrain_yaw_deg=140)
    walk = plan(scenario)
    x, y, z = walk.sample(np.zeros(1)).foot_position[0][3]
    along = x * math.cos(math.radians(140)) + y * math.sin(math.radians(140))
    depth = math.tan(math.radians(5)) * along - z
    with pytest.raises(InvalidInput) as caught:
        simulate(scenario, walk)
    height = math.ceil(1000 * (0.1 + depth))
    assert caught.value.what == f"left_rear foot starts {1000 * depth:.0f} mm below the terrain."
    assert caught.value.hint == (f"start_height_mm = {height}")
    assert simulate(scenario.replace(start_height_mm=height, duration=0.1), walk)


def test_a_recording_carries_its_height_map_to_its_replay_and_its_folder(tmp_path):
    # The file is gone after the run; what was recorded is enough to do it again, bit by bit.
    np.save(tmp_path / "hills.npy", heights_from_text(HILLS))
    (tmp_path / "mine.toml").write_text(
        '[terrain]\nkind = "height-map"\nheight_map = "hills.npy"\nmap_cell_mm = 40\n'
        'terrain_start_mm = 360\nplanned_on = "level"\n[stride]\nstep_length_mm = 80\nperiod = 1\n'
    )
    scenario = load_scenario(tmp_path / "mine.toml").replace(duration=1.0)
    recording = simulate(scenario, plan(scenario))
    (tmp_path / "hills.npy").unlink()
    save_recording(recording, tmp_path / "run.nc")
    assert replay(tmp_path / "run.nc").difference is None
    folder = report(load_recording(tmp_path / "run.nc"), tmp_path / "run", figures=False)
    again = load_scenario(folder / "scenario.toml")
    assert again.terrain == scenario.terrain
