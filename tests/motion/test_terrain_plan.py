"""Walks over uneven ground that the planner knows: where feet stand, and where they pass."""

import numpy as np
import pytest

from phasmid.errors import InfeasibleWalk, InvalidInput
from phasmid.motion import LevelCourse, UnevenCourse, plan
from phasmid.motion.swing import CLEARANCE
from phasmid.scenario import load_scenario
from support.terrains import TERRAINS

PAPER = load_scenario("paper").replace(step_length_mm=80, duration=6.0)
STRAIGHT = {"step_length_mm": 80}
ARC = {"step_length_mm": 60, "step_sideways_mm": 10, "step_turn_deg": 6}


def walk_over(name, **changes):
    scenario = PAPER.replace(**(TERRAINS[name] | changes))
    return scenario.load_terrain(), plan(scenario)


def over_ground(terrain, points):
    return points[..., 2] - terrain.height(points[..., 0], points[..., 1])


def standing_fixed(walk):
    """How far the standing feet of a walk move from one sample to the next."""
    feet = walk.foot_position
    both = walk.stance[1:] & walk.stance[:-1]
    return np.abs(np.diff(feet, axis=0)[both]).max()


WAYS = [
    {"gait": "wave", "period": 4.0, "step_length_mm": 40},
    {"gait": "ripple", "stance_timing": "constant-speed", "period": 4.0},
    ARC,
    {"trunk_attitude": "level", "step_length_mm": 40, "slope_deg": 8},
]


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        *((name, {}) for name in TERRAINS),
        *((name, way) for name in ("slope-up", "stairs", "rough") for way in WAYS),
    ],
)
def test_standing_feet_stand_on_the_ground_and_stay_there(name, changes):
    # z = h(x, y) for the feet that the planned angles and trunk give. 1e-12: round-off of lengths
    # below 1 m through the inverse and back.
    terrain, walk = walk_over(name, **changes)
    walk = walk.sample(np.linspace(0, 6, 1201))
    assert np.abs(over_ground(terrain, walk.foot_position)[walk.stance]).max() < 1e-12
    assert standing_fixed(walk) < 1e-12


@pytest.mark.parametrize("name", TERRAINS)
def test_swinging_feet_pass_over_the_ground_beside_them_with_clearance(name):
    # Farther than the margin (10 mm) from both footholds a foot is a tenth of the step height
    # above all ground within half the margin. The planner looks at 161 places of a way of 160 mm,
    # each of which counts for its neighbours; what is steep between two rays of its ring it may
    # miss by the sagitta 5 mm (1 - cos 22.5 degrees) = 0.4 mm times a slope below 1.
    terrain, walk = walk_over(name)
    walk = walk.sample(np.linspace(0, 6, 2401))
    feet, footing = walk.foot_position, walk.experiment.course.footing
    margin, width = footing.foothold_margin, footing.foothold_margin / 2
    cycle = np.floor(walk.time[:, None] / 2 - np.asarray(walk.gait.offsets) + 1e-9).astype(int)
    places = walk.course.footholds.place[..., :2]
    legs = np.arange(6)
    away = np.minimum(
        *(np.linalg.norm(feet[..., :2] - places[cycle + k, legs], axis=-1) for k in (1, 2))
    )
    angle = 2 * np.pi * np.arange(12) / 12
    beside = feet[..., None, :2] + width * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    highest = terrain.height(beside[..., 0], beside[..., 1]).max(axis=-1)
    far = ~walk.stance & (away > margin + 1e-6)
    assert far.sum() > 1000
    least = CLEARANCE * walk.experiment.course.stride.step_height
    assert (feet[..., 2] - highest)[far].min() > least - 0.0004
    # Nearer the ground is even: no edge there is higher than a quarter of the margin under the
    # steepest slope, 1.4 mm.
    near = 0.25 * margin * np.tan(footing.steepest_foothold)
    assert over_ground(terrain, feet)[~walk.stance].min() > -near


@pytest.mark.parametrize(
    ("name", "changes"), [("stairs", {"run_mm": 100}), ("gap", {}), ("steps", {})]
)
def test_no_foot_stands_within_the_margin_of_an_edge(name, changes):
    # Sixteen directions see an edge that is nearer than the margin times cos(11.25 degrees).
    terrain, walk = walk_over(name, **changes)
    x = walk.foot_position[walk.stance][:, 0]
    nearest = np.abs(x[:, None] - np.array(terrain.shape.x)).min()
    assert nearest >= 0.010 * np.cos(np.pi / 16) - 1e-12
    if name == "gap":
        assert walk.foot_position[walk.stance][:, 2].min() > -1e-12


def test_no_foot_stands_on_ice_or_farther_off_than_the_search_radius():
    terrain, walk = walk_over("ice", search_radius_mm=60)
    x, y, _ = walk.foot_position[walk.stance].T
    assert terrain.friction(x, y).min() == 0.7
    level = plan(PAPER)
    both = walk.stance & level.stance
    way = np.linalg.norm(walk.foot_position - level.foot_position, axis=-1)[both]
    assert 0 < way.max() <= 0.060 + 1e-12


def test_level_ground_that_is_told_is_walked_as_level_ground_that_is_not():
    # A slope of 0 degrees goes through the planner for uneven ground.
    for changes in (STRAIGHT, ARC, {"gait": "wave", "period": 4.0, "curve": "cubic-spline"}):
        told = plan(PAPER.replace(**changes, terrain="slope", slope=0.0))
        level = plan(PAPER.replace(**changes))
        assert isinstance(told.course, UnevenCourse)
        assert isinstance(level.course, LevelCourse)
        for name in ("q", "qd", "qdd"):
            # Accelerations up to 100 rad/s^2 from sums of about ten terms.
            assert np.abs(getattr(told, name) - getattr(level, name)).max() < 1e-10


def test_a_walk_can_be_sampled_beyond_its_duration():
    # A place's foothold depends on the place alone, so a longer plan begins with the shorter one.
    _, short = walk_over("waves", duration=3.0)
    _, long = walk_over("waves", duration=8.0)
    time = np.linspace(0, 8, 161)
    assert np.array_equal(short.sample(time).q, long.sample(time).q)


def test_a_walk_over_terrain_serves_no_other_terrain():
    _, walk = walk_over("stairs")
    same = PAPER.replace(**TERRAINS["stairs"])
    walk.for_experiment(same)
    with pytest.raises(InvalidInput, match="planned with another terrain"):
        walk.for_experiment(PAPER.replace(**TERRAINS["step"]))
    with pytest.raises(InvalidInput, match="planned with another footing"):
        walk.for_experiment(same.replace(search_radius_mm=30))
    with pytest.raises(InvalidInput, match="planned with another terrain"):
        plan(PAPER).for_experiment(same)
    # A plan that assumes level ground is the level walk.
    unaware = plan(PAPER.replace(**TERRAINS["stairs"], planned_on="level"))
    assert np.array_equal(unaware.q, plan(PAPER).q)
    # On ground that both take for level friction may differ.
    plan(PAPER).for_experiment(PAPER.replace(friction=0.5))


COXA_ONLY = {"stance_law": "coxa-only", "step_length_mm": 40}
TOO_HIGH = {"rise_mm": 110, "step_height_mm": 40, "period": 6, "duration": 30}


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        (
            {"terrain": "gap", "gap_width_mm": 120},
            "at 1.00 s right_front finds no foothold within 40 mm of (0.351, -0.168) m.",
        ),
        (
            {"terrain": "slope", "slope_deg": 31},
            "at the start right_middle finds no foothold within 40 mm of (-0.120, -0.253) m.",
        ),
        (
            # A load slides where friction is below tan 25° = 0.466.
            {"terrain": "slope", "slope_deg": 25, "friction": 0.3},
            "every foot would slide: friction is 0.3 at the most, and the slope takes 0.47.",
        ),
        ({"terrain": "stairs", **COXA_ONLY}, "feet cannot slide as the stance law coxa-only has"),
        ({"terrain": "step", **TOO_HIGH}, "the step of 80 mm"),
        ({"terrain": "stairs", "period": 1.0}, "the servo AX-12A allows 6.18 rad/s."),
        (
            {"terrain": "steps", "edge_x_mm": [330, 340], "edge_z_mm": [30, 0], "step_height": 0.0},
            "would strike the ground in its swing, or wait for too much of it.",
        ),
    ],
)
def test_what_cannot_be_walked_is_told_with_its_time_and_terrain(changes, what):
    with pytest.raises(InfeasibleWalk) as caught:
        plan(PAPER.replace(**changes))
    assert what in caught.value.what
    assert caught.value.what.startswith(f"on this {changes['terrain']} terrain")


def test_the_friction_of_a_refusal_holds():
    slippery = PAPER.replace(terrain="slope", slope_deg=25, friction=0.3)
    plan(slippery.replace(friction=0.47))
    # One firm strip under the left feet: not every foot slides.
    plan(slippery.replace(patches=[(-1, 3, 0, 1, 0.7)]))
