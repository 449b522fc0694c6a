"""Planned walks: the paper's figures, exactness, and what is refused."""

import itertools
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from phasmid.errors import InfeasibleWalk, InvalidInput
from phasmid.forces import analyse
from phasmid.gait import HEXAPOD_GAITS
from phasmid.kinematics import body_from_hip, foot_position, neutral_feet
from phasmid.motion import plan
from phasmid.robot import load_robot
from phasmid.scenario import load_scenario
from phasmid.simulation import simulate
from support.terrains import TERRAINS
from support.walks import WALKS, tilted_robot, uneven_robot

PAPER = load_scenario("paper")
STRIDES = {
    "forward": {"step_length_mm": 40},
    "backward": {"step_length_mm": -40},
    "sideways": {"step_length": 0, "step_sideways_mm": 40},
    "turning": {"step_length": 0, "step_turn_deg": 12},
    "on an arc": {"step_length_mm": 30, "step_sideways_mm": -10, "step_turn_deg": -8},
}


def test_the_papers_plan_has_41_samples_a_cycle_and_goes_400_mm():
    walk = plan(PAPER)
    assert len(walk.time) == 5 * 40 + 1
    assert walk.time[40] == pytest.approx(2.0, abs=1e-12)
    assert walk.trunk.position[-1] == pytest.approx([0.4, 0, 0.1], abs=1e-12)
    assert walk.trunk.yaw[-1] == 0


def test_legs_135_swing_first_from_half_a_stroke_behind_to_half_a_stroke_ahead():
    walk = plan(PAPER)
    neutral = 0.1248 + 0.150 * np.sqrt(0.5)
    x = walk.foot_position[:, 0, 0] - walk.trunk.position[:, 0]
    # 1e-12: sums of lengths below 1 m through the inverse and back.
    assert x[0] == pytest.approx(neutral - 0.020, abs=1e-12)
    assert x[20] == pytest.approx(neutral + 0.020, abs=1e-12)
    assert x[40] == pytest.approx(neutral - 0.020, abs=1e-12)
    assert walk.stance[:20].tolist() == [[False, True] * 3] * 20
    assert walk.stance[20:40].tolist() == [[True, False] * 3] * 20
    # The top of the lift is amid the swing.
    z = walk.foot_position[:, 0, 2]
    assert z[10] == pytest.approx(0.030, abs=1e-12)
    assert np.argmax(z[:21]) == 10


@pytest.mark.parametrize("timing", ["rest-to-rest", "constant-speed"])
@pytest.mark.parametrize("stride", ["turning", "on an arc"])
@pytest.mark.parametrize(
    ("robot", "gait"),
    [
        *(("phantomx-paper", gait) for gait in HEXAPOD_GAITS),
        ("quadruped", "crawl"),
        (tilted_robot(), "ripple"),
        (uneven_robot(), "ripple"),
    ],
)
def test_standing_feet_stay_and_swinging_feet_stay_above(robot, gait, timing, stride):
    # Stance law "straight" is exact, sway and tilt or not: 1e-12 m is round-off of the inverse
    # and back.
    changes = {"stance_timing": timing, "period": 4.0, **STRIDES[stride]}
    walk = plan(PAPER.replace(robot=robot, gait=gait, **changes)).sample(np.linspace(0, 8, 2001))
    feet = walk.foot_position
    both = walk.stance[1:] & walk.stance[:-1]
    assert np.abs(np.diff(feet, axis=0)[both]).max() < 1e-12
    assert feet[..., 2].min() > -1e-12
    assert np.abs(feet[..., 2][walk.stance]).max() < 1e-12


LEVEL = [
    dict(zip(("stance_law", "stance_timing", "curve", "gait"), way, strict=True))
    for way in itertools.product(
        ["straight", "coxa-only"],
        ["rest-to-rest", "constant-speed"],
        ["quintic", "cubic-spline"],
        ["tripod", "ripple"],
    )
]
UNEVEN = [
    {**TERRAINS[name], "step_length_mm": 60, "step_turn_deg": 6, "period": 3.0, "duration": 6.0}
    for name in ("stairs", "step", "waves")
]
ODD = [
    {"robot": robot, "gait": gait, "terrain": terrain, "period": 4.0, **STRIDES["on an arc"]}
    for robot, gait in (("quadruped", "crawl"), (tilted_robot(), "ripple"))
    for terrain in ("flat", "slope")
]


@pytest.mark.parametrize("changes", LEVEL + UNEVEN + ODD)
def test_joint_velocities_and_accelerations_are_derivatives_of_the_angles(changes):
    # Central differences between instants that no switch separates; with cycles of 2 s the third
    # derivatives stay below 2e4 rad/s^3, so h = 2e-5 s errs below 2e-6 and round-off by 1e-10.
    walk, h = plan(PAPER.replace(**changes)), 2e-5
    # Switches, and the tops of the lifts, lie at multiples of 1/12 s; these instants do not.
    time = (np.arange(240) + 0.37) / 60
    before, here, after = (walk.sample(time + k * h) for k in (-1, 0, 1))
    assert np.abs((after.q - before.q) / (2 * h) - here.qd).max() < 2e-6
    assert np.abs((after.qd - before.qd) / (2 * h) - here.qdd).max() < 2e-5
    trunk, speed = here.trunk, (after.trunk.position - before.trunk.position) / (2 * h)
    assert np.abs(speed - trunk.velocity).max() < 1e-8


@pytest.mark.parametrize("timing", ["rest-to-rest", "constant-speed"])
@pytest.mark.parametrize("terrain", ["", "slope-up", "stairs", "rough", "gap"])
def test_quintic_walks_are_continuous_to_the_acceleration(terrain, timing):
    # q, q', q'' on both sides of every switch and lift top. A gap of 2e-9 s lets q'' drift by at
    # most 2e-9 s times 1e5 rad/s^3.
    arc = {"step_length_mm": 60, "step_turn_deg": 6, "period": 3.0, "duration": 6.0}
    changes = TERRAINS[terrain] | arc if terrain else {}
    scenario = PAPER.replace(stance_timing=timing, **changes)
    walk, events = plan(scenario), np.arange(1, 8) * scenario.build().course.stride.period / 4
    before, after = walk.sample(events - 1e-9), walk.sample(events + 1e-9)
    assert np.abs(after.q - before.q).max() < 1e-7
    assert np.abs(after.qd - before.qd).max() < 1e-6
    assert np.abs(after.qdd - before.qdd).max() < 2e-4


def test_every_cycle_is_the_first_one_seen_from_the_body():
    walk = plan(PAPER.replace(step_turn_deg=7, gait="amble"))
    once, later = walk.sample(np.linspace(0, 2, 101)), walk.sample(np.linspace(4, 6, 101))
    assert np.abs(once.q - later.q).max() < 1e-10


@pytest.mark.parametrize("stride", ["forward", "backward", "turning"])
def test_in_coxa_only_stance_nothing_but_the_coxa_moves(stride):
    walk = plan(PAPER.replace(stance_law="coxa-only", **STRIDES[stride]))
    speed = np.abs(walk.qd)[walk.stance]
    assert speed[:, 1:].max() < 1e-12
    assert speed[:, 0].max() > 0.1
    # Amid the stance the foot is the neutral one; the chord of its circle is the step.
    feet = body_from_hip(walk.robot, foot_position(walk.robot.arrays, walk.q))[:21, 1]
    assert feet[10, :2] == pytest.approx(neutral_feet(walk.robot)[1, :2], abs=1e-12)
    if stride != "turning":
        way = STRIDES[stride]["step_length_mm"] / 1000
        assert feet[0, 0] - feet[20, 0] == pytest.approx(way, abs=1e-12)


FAR = "is too much for right_front: the foot would be "
FAST, ALLOWED = "joint right_front.femur would turn at ", "the servo AX-12A allows "


@pytest.mark.parametrize(("preset", "gait"), WALKS)
def test_every_gait_of_every_preset_can_be_planned_in_every_direction(preset, gait):
    for stride in ("forward", "backward", "sideways", "turning"):
        walk = plan(PAPER.replace(robot=preset, gait=gait, **STRIDES[stride]))
        assert np.isfinite(walk.qdd).all()


@pytest.mark.parametrize(
    ("changes", "what", "hint"),
    [
        ({"step_length_mm": 400}, f"step of 400 mm {FAR}289.7 mm", "step_length_mm = 230"),
        # The reach allows 60.5°, the servos 43.5° in this period.
        (
            {"step_turn_deg": 150, "step_length": 0},
            f"step of 150° {FAR}342.0 mm",
            "step_turn_deg = 43.5",
        ),
        (
            {"step_length": 0, "step_sideways_mm": 192},
            "step of 192 mm is too much for right_middle: its tibia would turn to -21.8°, 1.2° ",
            "step_sideways_mm = 191",
        ),
        (
            {"stance_law": "coxa-only", **STRIDES["sideways"]},
            "leg right_middle cannot make this step with its coxa alone: its foot moves 90° off",
            'stance_law = "straight"',
        ),
        # The robot's own stance.
        (
            {"body_height_mm": 300},
            f"neutral stance {FAR}320.5 mm",
            "stance_radius_mm = 150, body_height_mm = 100",
        ),
        (
            {"step_height_mm": 150},
            "step height of 150 mm is too much for right_front: its femur would turn to 101.9°, 1",
            "step_height_mm = 94",
        ),
        (
            {"robot": "quadruped", "gait": {"name": "crawl", "sway": 0.4}},
            f"sway of 0.4 {FAR}286.3 mm",
            "sway = 0.1",
        ),
        ({"period": 0.05}, f"{FAST}60.3 rad/s; {ALLOWED}6.18 rad/s.", "period = 0.49"),
        # No load: R i + k w = V and k i (1 - c1) = c0 + b w; 44.0 rpm at 9 V by docs/servos.md is
        # 4.605 rad/s, and 0.5 s * 6.03 / 4.605 rounds up to 0.66 s.
        (
            {"period": 0.5, "drive": "servo", "voltage": 9},
            f"{FAST}6.03 rad/s; {ALLOWED}4.59 rad/s ",
            "period = 0.66",
        ),
        # Below R c0/(k (1 - c1)) friction holds the rotor.
        (
            {"drive": "servo", "voltage": 0.05},
            f"{FAST}1.51 rad/s; {ALLOWED}0 rad/s at ",
            "voltage = 12.0",
        ),
    ],
)
def test_a_walk_that_cannot_be_made_is_told_why_and_what_can_be(changes, what, hint):
    """The quantity that is named is the one at fault, and the remedy can be walked."""
    scenario = PAPER.replace(**changes)
    with pytest.raises(InfeasibleWalk) as caught:
        plan(scenario)
    assert caught.value.what.startswith(what)
    assert caught.value.hint == hint
    plan(scenario.replace(**tomllib.loads(f"x = {{ {hint} }}")["x"]))


@pytest.mark.parametrize("changes", [{"step_length_mm": 231}, {"period": 0.48}])
def test_a_remedy_is_the_least_change_in_round_numbers(changes):
    with pytest.raises(InfeasibleWalk):
        plan(PAPER.replace(**changes))


def test_a_centre_of_mass_beyond_the_feet_is_told_with_its_phase():
    robot = load_robot("phantomx-paper")
    nose = replace(robot, body=replace(robot.body, com=np.array([0.24, 0.0, 0.0])))
    with pytest.raises(InfeasibleWalk, match=r"^at phase 0\..*mm outside the support polygon\."):
        plan(PAPER.replace(robot=nose))


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"robot": "phantomx-mk4"}, "robot"),
        ({"robot": "quadruped", "gait": "crawl"}, "robot"),
        ({"gait": "wave"}, "gait"),
        ({"step_length_mm": 30}, "stride"),
        ({"mounts": "perpendicular"}, "mounts"),
    ],
)
def test_a_walk_serves_only_scenarios_that_it_was_planned_for(changes, name):
    walk = plan(PAPER)
    walk.for_experiment(PAPER.replace(robot=load_robot("phantomx-paper")))
    for use in (analyse, simulate):
        with pytest.raises(InvalidInput, match=f"planned with another {name} than the scenario"):
            use(PAPER.replace(**changes), walk)


def test_a_walk_serves_other_drives_and_voltages_while_their_servos_are_quick_enough():
    # No-load speed of an AX-12A: 6.18 rad/s as rated, 2.47 at 5 V; the walk needs 1.5 or 3.
    quick = PAPER.replace(period=1.0)
    weak = {"drive": "servo", "voltage": 5.0}
    plan(PAPER).for_experiment(PAPER.replace(**weak))
    plan(quick).for_experiment(quick.replace(drive="servo"))
    with pytest.raises(InfeasibleWalk, match=r"the servo AX-12A allows .* rad/s at 5 V"):
        plan(quick).for_experiment(quick.replace(**weak))
