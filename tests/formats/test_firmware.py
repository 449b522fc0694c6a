"""The C header of `phasmid export --out walk.h`, compiled on this machine, against the package."""

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from phasmid import load_scenario, plan
from phasmid.cli import main
from phasmid.errors import InvalidInput
from phasmid.formats import firmware_header
from phasmid.kinematics import body_from_hip, foot_position
from phasmid.kinematics.leg import angles_and_margin

ROOT, PAPER = Path(__file__).parents[2], load_scenario("paper")
OFFSET_LEGS = ROOT / "examples/offset-legs.toml"
HOST = Path(__file__).with_name("firmware_host.c")
WARNINGS = ("-Wall", "-Wextra", "-Werror", "-pedantic", "-Wdouble-promotion")
DOUBLE = "-DPHASMID_REAL=double"

REACHABLE = 100_000
"""Least number of feet of a robot that are compared."""

ANGLE = 1e-6
"""Largest difference of joint angles in double precision [rad]; tables have seven decimals."""

LENGTH = 1e-12
"""Largest difference of feet [m]: thousands of round-offs of a metre, in double precision."""

WALKS = {
    "phantomx-paper": {"robot": "phantomx-paper"},
    "phantomx-mk4": {"robot": "phantomx-mk4", "step_turn_deg": 10, "samples": 97},
    "octopod": {"robot": "octopod", "gait": "tetrapod", "stance_timing": "constant-speed"},
    # Tilted hips, lateral offsets, a coxa without length, a gait that sways.
    "offset-legs": {"robot": str(OFFSET_LEGS), "gait": "crawl", "step_length_mm": 20},
}


def compiler(*names):
    """Return the first compiler that is there; without one the test is skipped."""
    found = next(filter(None, map(shutil.which, names)), None)
    if found is None:
        pytest.skip(f"needs one of {', '.join(names)}")
    return found


def built(folder, scenario, *options):
    """Compile the header with the host program; any warning is an error."""
    (folder / "walk.h").write_text(firmware_header(plan(scenario)), encoding="utf-8")
    program = folder / "host.exe"
    command = [compiler("cc", "gcc", "clang"), "-std=c99", *options, *WARNINGS, f"-I{folder}"]
    command += [str(HOST), "-o", str(program), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return program


class Answers(NamedTuple):
    """Results of the host program: M feet of each of L legs, T phases, N samples of a cycle."""

    code: np.ndarray
    q: np.ndarray
    code_body: np.ndarray
    q_body: np.ndarray
    foot: np.ndarray
    foot_body: np.ndarray
    servo: np.ndarray
    gait: np.ndarray
    offsets: np.ndarray
    neutral: np.ndarray
    stance: np.ndarray
    period: float
    duty_factor: float


def answers(program, robot, feet, phases=()):
    """Run the program for feet in the hip frames, shape (M, L, 3), and for phases of the gait."""
    count, legs = feet.shape[:2]
    leg = np.tile(np.arange(legs), count)[:, None]
    poses = np.hstack([leg, feet.reshape(-1, 3), body_from_hip(robot, feet).reshape(-1, 3)])
    given, written = program.with_suffix(".in"), program.with_suffix(".out")
    np.concatenate([[len(poses), len(phases)], poses.ravel(), phases]).tofile(given)
    subprocess.run([str(program), str(given), str(written)], check=True)
    sizes = [17 * len(poses), 3 * legs * len(phases), 4 * legs]
    rows, gait, constants, rest = np.split(np.fromfile(written), np.cumsum(sizes))
    rows, constants = rows.reshape(count, legs, 17), constants.reshape(legs, 4)
    code, q, code_body, q_body, *others = np.split(rows, [1, 4, 5, 8, 11, 14], axis=-1)
    return Answers(
        code[..., 0],
        q,
        code_body[..., 0],
        q_body,
        *others,
        gait.reshape(-1, legs, 3),
        constants[:, 0],
        constants[:, 1:],
        rest[:-2].reshape(-1, legs),
        *rest[-2:],
    )


def feet_around(robot, count):
    """Return feet in balls about the hips, some beyond reach or limits, shape (M, L, 3)."""
    rng, legs = np.random.default_rng(88226), len(robot.legs)
    direction = rng.normal(size=(count // legs, legs, 3))
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    farthest = robot.arrays.lengths.sum(axis=1) + np.abs(robot.arrays.lateral_offsets.sum(axis=1))
    share = np.cbrt(rng.uniform(size=(count // legs, legs)))
    return direction * (farthest * share)[..., None]


def codes(robot, q, margin):
    """Return the results of the inverse kinematics that the package implies."""
    low, high = np.moveaxis(robot.arrays.joint_limits, -1, 0)
    within = ((low <= q) & (q <= high)).all(axis=-1)
    return np.where(margin < 0, 1, np.where(within, 0, 2))


@pytest.mark.parametrize("name", WALKS)
def test_the_header_computes_as_the_package_does(name, tmp_path):
    scenario = PAPER.replace(**WALKS[name])
    walk = plan(scenario)
    robot, samples = walk.robot, scenario.stride.samples - 1
    feet = feet_around(robot, 3 * REACHABLE)
    q, margin = angles_and_margin(robot.arrays, feet)
    expected = codes(robot, q, margin)
    # Many of each kind, so that no leg or branch is left out.
    reached = expected != 1
    assert reached.sum() >= REACHABLE
    assert all((expected == code).sum() > 1000 for code in (0, 1, 2))
    # Samples and middles between them, in this cycle and in others.
    phases = np.arange(2 * samples) / (2 * samples)
    phases = np.concatenate([phases, phases - 3, phases + 2])
    got = answers(built(tmp_path, scenario, "-O2", DOUBLE), robot, feet, phases)

    assert (got.code == expected).all()
    assert (got.code_body == expected).all()
    assert np.abs(got.q - q)[reached].max() < ANGLE
    assert np.abs(got.q_body - q)[reached].max() < ANGLE
    # Out of reach the leg is stretched or folded towards the point, as the package's.
    assert np.abs(got.q - q).max() < ANGLE
    foot = foot_position(robot.arrays, got.q)
    assert np.abs(got.foot - foot).max() < LENGTH
    assert np.abs(got.foot_body - body_from_hip(robot, foot)).max() < LENGTH
    assert np.abs(got.foot - feet)[reached].max() < 1e-9

    # q of time 0 is that of every whole cycle. Middles are means of two samples.
    table = walk.sample(np.arange(samples) * scenario.build().course.stride.period / samples)
    both = np.stack([table.q, (table.q + np.roll(table.q, -1, axis=0)) / 2], axis=1)
    cycle = got.gait.reshape(3, samples, 2, -1, 3)
    assert np.abs(cycle - both).max() < ANGLE
    assert (got.stance == table.stance).all()
    assert np.abs(got.offsets - walk.gait.offsets).max() < 1e-15
    assert np.abs(got.neutral - robot.arrays.neutral_foot).max() < 1e-15
    assert got.period == scenario.build().course.stride.period
    assert got.duty_factor == pytest.approx(walk.gait.duty_factor, abs=1e-15)


def test_single_precision_places_feet_within_a_micrometre(tmp_path):
    """Round-off of a float is 6e-8 of its value, 2e-8 m at 0.3 m; some fifty add up."""
    robot = PAPER.load_robot()
    feet = feet_around(robot, 20_000)
    q, margin = angles_and_margin(robot.arrays, feet)
    got = answers(built(tmp_path, PAPER), robot, feet, [0.25])
    expected = codes(robot, q, margin)
    assert (got.code == expected).mean() > 0.999
    usable = expected == 0
    assert usable.sum() > 4000
    assert np.abs(foot_position(robot.arrays, got.q) - feet)[usable].max() < 1e-6
    assert np.abs(got.q - q)[usable].max() < 1e-4
    assert np.abs(got.gait[0] - plan(PAPER).sample(np.array([0.5])).q[0]).max() < ANGLE


def test_servo_angles_count_from_the_zeros_of_the_robot_file(tmp_path):
    """The maker's limits of the Mark IV are whole degrees from its servos' zeros."""
    scenario = PAPER.replace(robot="phantomx-mk4")
    robot = scenario.load_robot()
    low, high = np.moveaxis(robot.arrays.joint_limits, -1, 0)
    feet = foot_position(robot.arrays, np.stack([low, robot.arrays.joint_limits.mean(axis=-1)]))
    got = answers(built(tmp_path, scenario, DOUBLE), robot, feet)
    shift = np.degrees(got.servo - got.q)
    assert np.degrees(low) + shift == pytest.approx(np.tile([-55, -90, -125], (2, 6, 1)), abs=1e-5)
    assert np.degrees(high) + shift == pytest.approx(np.tile([55, 98, 45], (2, 6, 1)), abs=1e-5)


def check_as_cpp(*options):
    command = [compiler("c++", "g++", "clang++"), "-x", "c++", "-std=c++11", "-fsyntax-only"]
    done = subprocess.run([*command, *options], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("real", ["float", "double"])
def test_the_header_compiles_as_cpp(real, tmp_path):
    (tmp_path / "walk.h").write_text(firmware_header(plan(PAPER)), encoding="utf-8")
    check_as_cpp(f"-DPHASMID_REAL={real}", f"-I{tmp_path}", str(HOST), *WARNINGS)


def test_a_point_that_is_not_finite_is_out_of_reach(tmp_path):
    robot = PAPER.load_robot()
    feet = np.tile(robot.arrays.neutral_foot, (3, 1, 1))
    feet[0, :, 0], feet[1, :, 2] = np.nan, np.inf
    got = answers(built(tmp_path, PAPER, DOUBLE), robot, feet, [np.nan, -1e-20, 0.0])
    assert got.code.tolist() == [[1] * 6, [1] * 6, [0] * 6]
    # A phase that is none begins the cycle, and one just before it does not leave the table.
    assert (got.gait == got.gait[2]).all()


def test_names_end_no_comment(tmp_path):
    robot = PAPER.load_robot()
    legs = (replace(robot.legs[0], name="/*/ */\n#error"), *robot.legs[1:])
    built(tmp_path, PAPER.replace(robot=replace(robot, name="*/ #error /*", legs=legs)))


def test_the_stated_deviation_is_that_of_linear_interpolation():
    """Twice as many samples deviate a quarter as much, where the motion is smooth."""
    found = [
        float(re.search(r"by at most (\S+) rad", firmware_header(plan(s)))[1])
        for s in (PAPER.replace(samples=n) for n in (81, 161))
    ]
    assert found[0] / found[1] == pytest.approx(4, rel=0.1)


def test_uneven_ground_has_no_cycle():
    with pytest.raises(InvalidInput, match="cycles that are all equal"):
        firmware_header(plan(PAPER.replace(terrain="stairs", duration=1)))


BOARD = """\
unsigned long millis(void);
void delay(unsigned long);
void write_servo(int, float);
"""


def test_the_sketch_of_the_page_compiles_with_the_header_of_its_command(here, capsys):
    page = (ROOT / "docs/firmware.md").read_text("utf-8")
    assert main(re.search("```\nphasmid (.*)\n```", page)[1].split()) == 0, capsys.readouterr().err
    sketch = re.search("```cpp\n(.*?)```", page, re.DOTALL)[1]
    (here / "sketch.cpp").write_text(BOARD + sketch, encoding="utf-8")
    check_as_cpp("sketch.cpp", *WARNINGS[:-1])
