"""Shapes of the ground: height and slope belong together, and a seed is a place."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phasmid.errors import InvalidInput
from phasmid.terrain import (
    Blocks,
    Course,
    Flat,
    Ground,
    HeightMap,
    Patch,
    Rough,
    Section,
    Slope,
    Steps,
    Waves,
)

HILLS = 0.02 * np.random.default_rng(3).uniform(size=(7, 9))
EAST, NORTH = np.meshgrid(np.arange(31) * 0.02, np.arange(31) * 0.02)
CURVED = [
    Slope(0.2),
    Slope(-0.3, start=0.4),
    Waves(0.03, 0.4, 0.3),
    Rough(0.006, 0.15, 0.3),
    HeightMap(HILLS, 0.05, 0.4),
]
STONES = Blocks.stones(0.3, size=0.1, distance=0.16, height_range=0.02, depth=0.1)
LEVEL = [
    Flat(),
    Steps.stairs(0.3, rise=0.02, run=0.1, count=4),
    Steps.beams(0.3, width=0.05, height=0.03, distance=0.3, count=4),
    Blocks(0.08, 0.01, 0.02, 0.1, 0.3),
    STONES,
    Course.mixed(0.3, difficulty=0.7),
]


def places(count, seed=0):
    return np.random.default_rng(seed).uniform((-0.5, -1), (2, 1), (count, 2)).T


@pytest.mark.parametrize("yaw", [0.0, 2.1])
@pytest.mark.parametrize("shape", CURVED, ids=lambda s: type(s).__name__)
def test_the_normal_stands_on_the_surface(shape, yaw):
    # n = (-dz/dx, -dz/dy, 1) over its length. Central differences over 2e: truncation
    # e² z'''/6, with z''' below 1e4/m² here 2e-9 at e = 1e-6, and rounding 1e-16 z/e = 1e-11.
    # No place lies within e of a kink.
    ground, (x, y), e = Ground(shape, 0.7, yaw=yaw), places(400), 1e-6
    dx = (ground.height(x + e, y) - ground.height(x - e, y)) / (2 * e)
    dy = (ground.height(x, y + e) - ground.height(x, y - e)) / (2 * e)
    normal = ground.normal(x, y)
    assert np.abs(normal[:, 0] / normal[:, 2] + dx).max() < 1e-8
    assert np.abs(normal[:, 1] / normal[:, 2] + dy).max() < 1e-8
    assert np.abs(np.linalg.norm(normal, axis=1) - 1).max() < 1e-15


@pytest.mark.parametrize("shape", CURVED[2:] + LEVEL, ids=lambda s: type(s).__name__)
def test_the_robot_starts_on_level_ground(shape):
    # z = 0 for all x up to the start, however the terrain goes on.
    x, y = places(300)
    assert np.abs(Ground(shape, 0.7).height(np.minimum(x, 0.3 - 1e-9), y)).max() == 0


@pytest.mark.parametrize("shape", CURVED + LEVEL, ids=lambda s: type(s).__name__)
def test_a_height_does_not_depend_on_what_else_is_asked(shape):
    # z = z(x, y), bit by bit: one by one, turned round, or in a square.
    ground, (x, y) = Ground(shape, 0.7, yaw=0.3), places(36)
    together = ground.height(x, y)
    alone = [float(ground.height(np.array(a), np.array(b))) for a, b in zip(x, y, strict=True)]
    assert together.tolist() == alone
    assert ground.height(x[::-1], y[::-1])[::-1].tolist() == alone
    assert ground.height(x.reshape(6, 6), y.reshape(6, 6)).ravel().tolist() == alone


def test_rough_ground_is_the_same_for_the_same_seed_and_another_for_another():
    x, y = places(100)
    first, again, other = (Rough(0.006, 0.15, 0.3, seed).surface(x, y)[0] for seed in (5, 5, 6))
    assert (first == again).all()
    # Two independent grounds of deviation s differ by s √2; over 60 places on rough ground that
    # is hardly ever less than half of it.
    assert np.std((first - other)[x > 0.4]) > 0.5 * math.sqrt(2) * 0.006


def test_rough_ground_has_the_roughness_that_is_asked():
    # A sum of waves of amplitudes a has the variance Σ a²/2, and a are so chosen that this is the
    # roughness squared. Over a square of side S a wave's mean square is off by up to λ/(2π S) and
    # products of two by about as much each: with λ <= 0.6 m and S = 60 m, 0.2 % times a few.
    side = np.linspace(1, 61, 700)
    height = Ground(Rough(0.006, 0.15, 0.0), 0.7).height(*np.meshgrid(side, side))
    assert np.std(height) == pytest.approx(0.006, rel=0.02)


def test_stairs_rise_by_their_rise_at_each_run():
    # z = rise * number of edges passed.
    stairs = Ground(Steps.stairs(0.3, rise=0.02, run=0.1, count=3), 0.7)
    x = np.array([0.29, 0.3, 0.39, 0.41, 0.55, 5.0])
    assert stairs.height(x, 0 * x).tolist() == [0, 0.02, 0.02, 0.04, 0.06, 0.06]


def test_beams_stand_on_level_ground():
    # z = height within the width of each beam, else 0.
    beams = Ground(Steps.beams(0.3, width=0.05, height=0.03, distance=0.2, count=2), 0.7)
    x = np.array([0.29, 0.31, 0.34, 0.36, 0.49, 0.51, 0.56, 0.71])
    assert beams.height(x, 0 * x).tolist() == [0, 0.03, 0.03, 0, 0, 0.03, 0, 0]


@pytest.mark.parametrize("shape", LEVEL[1:], ids=lambda s: type(s).__name__)
def test_the_height_is_the_top_of_the_highest_block_at_a_place(shape):
    # MuJoCo's boxes reach from far below up to the tops; none of the places lies on an edge.
    u, v = places(2000)
    tops = [
        np.where((b.u[0] < u) & (u < b.u[1]) & (b.v[0] < v) & (v < b.v[1]), b.top, -np.inf)
        for b in shape.blocks
    ]
    assert np.array_equal(np.max(tops, axis=0), shape.surface(u, v)[0])


def test_stones_lie_on_a_staggered_lattice_within_a_quarter_of_their_gap():
    # 15 rows of 10 and 9 stones in turn, 0.16 m apart; each centre is off its place of the lattice
    # by up to 0.06 m / 4 along u and v, the farthest of 285 numbers hardly by less than 90 % of it.
    stones = [b for b in STONES.blocks if b.u[1] - b.u[0] < 0.11]
    assert len(stones) == 8 * 10 + 7 * 9
    u, v = (
        np.array([sum(ends) / 2 for ends in axis])
        for axis in zip(*((b.u, b.v) for b in stones), strict=True)
    )
    row = np.floor((u - 0.3) / 0.16)
    along = u - 0.3 - 0.16 * (row + 0.5)
    across = (v - 0.08 * (row % 2 == 0)) / 0.16
    across = 0.16 * (across - np.round(across))
    for off in (along, across):
        assert 0.9 * 0.015 < np.abs(off).max() <= 0.015 + 1e-12
    assert np.ptp([b.top for b in stones]) <= 0.02
    other = Blocks.stones(0.3, size=0.1, distance=0.16, height_range=0.02, depth=0.1, seed=2)
    assert other.blocks != STONES.blocks


@pytest.mark.parametrize("difficulty", [0.5, 1.0])
def test_a_course_climbs_two_stairs_and_ends_on_level_ground(difficulty):
    # Stairs of 60 mm times the difficulty; blocks, stones and rubble have tops within half of
    # their range of heights around the plateau or the ground; the gap and the floor between stones
    # are 0.1 m deep.
    course = Ground(Course.mixed(0.3, difficulty=difficulty), 0.7)
    assert len(course.shape.blocks) < 1500
    rise = 0.06 * difficulty

    def heights(begin, end):
        x, y = np.random.default_rng(1).uniform((0.3 + begin, -1.9), (0.3 + end, 1.9), (999, 2)).T
        return course.height(x, y)

    def all_near(values, level, within=1e-12):
        return np.abs(values - level).max() <= within

    assert all_near(heights(0, 0.15), rise)
    assert all_near(heights(0.15, 0.35), 2 * rise)
    assert all_near(heights(0.35, 0.85), 2 * rise, rise / 2)
    assert all_near(heights(0.95, 0.95 + rise), 2 * rise - 0.1)
    stones = heights(1.1, 1.7)
    floor = stones < 2 * rise - 0.05
    assert all_near(stones[floor], 2 * rise - 0.1)
    assert all_near(stones[~floor], 2 * rise, rise / 4)
    assert all_near(heights(1.7, 1.8), 2 * rise)
    assert all_near(heights(1.8, 1.95), rise)
    assert all_near(heights(1.95, 2.1), 0)
    assert all_near(heights(2.1, 2.5), 0, rise / 2)
    assert all_near(heights(2.5, 9), 0)


def test_a_course_without_difficulty_is_level():
    assert not Course.mixed(0.3, difficulty=0.0).surface(*places(99))[0].any()


def test_waves_run_from_trough_to_crest():
    # z = h/2 (1 - cos(2π x/λ)): 0 at the start, h after half a wave.
    waves = Ground(Waves(0.03, 0.4, 0.3), 0.7)
    x = np.array([0.3, 0.4, 0.5, 0.7])
    assert waves.height(x, 0 * x) == pytest.approx([0, 0.015, 0.03, 0], abs=1e-15)


def test_a_height_map_is_met_at_its_samples_and_halfway_between_them():
    # The height at a sample is the sample, and where samples rise evenly it is linear between,
    # also in the first cell; beyond the edges they go on. The first row is the left one (largest
    # y).
    heights = np.array([[0.0, 0.01, 0.02, 0.03], [0.0, 0.0, 0.04, 0.04]])
    ground = Ground(HeightMap(heights, 0.1, 0.0), 0.7)
    x = np.array([0.2, 0.3, 0.2, 0.05, 0.15, 9.0])
    y = np.array([0.05, 0.05, -0.05, 0.05, 0.05, 9.0])
    assert ground.height(x, y) == pytest.approx([0.02, 0.03, 0.04, 0.005, 0.015, 0.03], abs=1e-15)


@pytest.mark.parametrize("yaw", [0.0, 0.5, -2.0])
def test_each_sample_of_a_height_map_lies_at_its_row_and_column(yaw):
    # Row r and column c lie at u = start + c cell, v = (middle row - r) cell, turned by the yaw. No
    # two of the samples are equal, so that no other place has them.
    heights = 0.02 * np.random.default_rng(1).permutation(35).reshape(5, 7) / 35
    ground = Ground(HeightMap(heights, 0.03, 0.4), 0.7, yaw=yaw)
    row, column = np.indices(heights.shape)
    place = (0.4 + 0.03 * column + 1j * 0.03 * (2 - row)) * np.exp(1j * yaw)
    assert ground.height(place.real, place.imag) == pytest.approx(heights, abs=1e-14)


def test_the_edge_of_a_height_map_grows_out_of_the_ground_before_it():
    # A smooth ramp from 0 to the heights of the edge, halfway after 50 of 100 mm; level before it.
    # An edge at height 0 has no ramp, whatever follows.
    ground = Ground(HeightMap(np.full((3, 4), 0.02), 0.01, 0.5), 0.7)
    x = np.array([0.0, 0.4, 0.45, 0.5, 0.51, 9.0])
    assert ground.height(x, 0 * x) == pytest.approx([0, 0, 0.01, 0.02, 0.02, 0.02], abs=1e-15)
    rising = Ground(HeightMap(np.tile([0.0, 0.01, 0.02, 0.03], (3, 1)), 0.02, 0.5), 0.7)
    assert (rising.height(np.linspace(0.0, 0.5, 99), np.zeros(99)) == 0).all()


@given(st.floats(-3, 3), st.floats(-0.7, 0.7), st.floats(-3, 3), st.floats(-3, 3))
def test_a_slope_turned_is_a_slope_in_that_direction(yaw, angle, x, y):
    # z = tan a (x cos w + y sin w); rounding of numbers below 5.
    height = Ground(Slope(angle), 0.7, yaw=yaw).height(np.array(x), np.array(y))
    along = x * math.cos(yaw) + y * math.sin(yaw)
    assert float(height) == pytest.approx(math.tan(angle) * along, abs=1e-14)


def test_friction_is_that_of_the_last_patch_that_holds_a_point():
    patches = (Patch((0, 1), (0, 1), 0.1), Patch((0.5, 2), (0, 1), 0.3))
    ground = Ground(Flat(), 0.7, patches)
    x, y = np.array([0.2, 0.7, 1.5, 0.2, -1.0]), np.array([0.5, 0.5, 0.5, 1.5, 0.5])
    assert ground.friction(x, y).tolist() == [0.1, 0.3, 0.3, 0.7, 0.7]
    turned = Ground(Flat(), 0.7, patches, math.pi / 2)
    assert turned.friction(-y, x).tolist() == [0.1, 0.3, 0.3, 0.7, 0.7]


STONE = {"height_range": 0.0, "depth": 0.1}
WIDE = {"width": 0.2, "height": 0.03, "distance": 0.1, "count": 2}
DIAGONAL = np.clip(0.8 * (EAST + NORTH - 0.7), 0.0, 0.06)
MANY = 1001 * (Patch((0, 1), (0, 1), 0.1),)
BACKWARDS = tuple(Section(start, 0.0, Steps((), ())) for start in (0.5, 0.3))


@pytest.mark.parametrize(
    ("make", "what"),
    [
        (lambda: Slope(math.radians(80)), "slope of 80° exceeds 45°, the steepest this contact"),
        (lambda: Waves(0.2, 0.4, 0.3), "waves of 200 mm in 400 mm are steeper than 45°"),
        (lambda: Rough(0.05, 0.1, 0.3), "rough ground of 50 mm in waves of 100 mm is steeper"),
        # 24 waves up to 3.2 m long: heights of 90 mm on a ramp of 100 mm.
        (lambda: Rough(0.03, 0.8, 0.3), "rough ground of 30 mm in waves of 800 mm is steeper"),
        (lambda: HeightMap(np.eye(3), 0.1, 0.0), "height map has a slope of 84° near row 1, col"),
        # A ramp to h over 0.1 m is as steep as 15/8 h/0.1 m in its middle: atan(1.125).
        (lambda: HeightMap(np.full((5, 9), 0.06), 0.01, 0.3), "height map has a slope of 48°"),
        # The cubic through 0, 0, h, h is as steep as 5/4 h/cell halfway: atan(1.1875).
        (lambda: HeightMap(0.019 * (EAST > 0.3), 0.02, 0.3), "height map has a slope of 50° betw"),
        # 0.8 along and 0.8 across are 0.8 √2 together: 48.5°, and more at the bends.
        (lambda: HeightMap(DIAGONAL, 0.02, 0.3), "height map has a slope of 5"),
        (lambda: HeightMap(HILLS, 0.0, 0.0), "samples of the height map are 0 m apart"),
        (lambda: Ground(Flat(), math.nan), "friction is nan; it must be 0 or more and 10 or less"),
        (lambda: Patch((1, 1), (0, 1), 0.3), "a patch of friction goes from 1 to 1 m"),
        (lambda: Ground(Flat(), 0.7, MANY), "ground has 1001 patches of friction; the limit is 1"),
        (lambda: Blocks(0.001, 0.0, 0.0, 0.1, 0.3), "a field of 3840000 blocks; the limit is"),
        (lambda: Blocks(0.1, 0.1, 0.2, 0.1, 0.3), "the floor between blocks lies 0.1 m deep"),
        (lambda: Blocks(0.1, 0.1, 0.02, 0.1, 0.3, jitter=0.06), "blocks are displaced by up to 0"),
        (lambda: Blocks.stones(0.3, size=0.1, distance=0.1, **STONE), "stones of 0.1 m, 0.1 m fr"),
        (lambda: Steps.beams(0.3, **WIDE), "beams of 0.2 m width, 0.1 m from centre to centre;"),
        (lambda: Course.mixed(0.3, difficulty=1.1), "the difficulty of a course is 1.1; it must"),
        (lambda: Course(BACKWARDS), "a section of a course begins at 0.3 m, the one before at 0."),
        (lambda: Steps((0.1,), ()), "steps.z has 0 values; one per edge, 1 in all."),
        (lambda: Steps((math.nan,), (0.0,)), "steps.x[0] is nan m; it must be a number below"),
    ],
)
def test_ground_that_cannot_be_walked_is_refused(make, what):
    with pytest.raises(InvalidInput) as caught:
        make()
    assert caught.value.what.startswith(what)


@pytest.mark.parametrize(
    ("unit", "hint"), [(1e-3, "map_cell_mm = 61"), (1.0, "are these numbers millimetres?")]
)
def test_a_height_map_in_millimetres_is_guessed(unit, hint):
    # Heights from 0 to 60, 10 mm apart: even in millimetres too steep.
    with pytest.raises(InvalidInput) as caught:
        HeightMap(unit * 60.0 * np.eye(3), 0.01, 0.0)
    assert caught.value.hint.startswith(hint)


@pytest.mark.parametrize("shape", [*CURVED, *LEVEL], ids=lambda s: type(s).__name__)
def test_ground_that_faces_up_has_an_upright_normal_everywhere(shape):
    ground = Ground(shape, 0.7, yaw=0.3)
    is_upright = bool((ground.normal(*places(4000)) == [0.0, 0.0, 1.0]).all())
    assert ground.faces_up == is_upright == (shape in LEVEL)
