"""A trajectory of joint angles is read whole, or refused in one sentence."""

import os

import numpy as np
import pytest

from phasmid import load_robot, load_scenario, load_trajectory, plan, save_recording
from phasmid.errors import InvalidInput, PhasmidError
from phasmid.forces import analyse
from phasmid.motion import JointTrajectory
from phasmid.motion.trajectory import joint_names

ROBOT = load_robot("phantomx-paper")
NAMES = joint_names(ROBOT)
WALK = plan(load_scenario("paper").replace(duration=2.0))


def table(rows=41, step=0.05):
    time = np.arange(rows) * step
    return time, WALK.sample(time).q.reshape(rows, 18).copy()


def write(path, time, q, names=NAMES):
    lines = [",".join(["time", *names])]
    lines += [",".join(repr(float(x)) for x in (t, *row)) for t, row in zip(time, q, strict=True)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_angles_are_read_from_tables_arrays_and_recordings(tmp_path):
    # repr of a float is read back to the same float.
    time, q = table()
    read = load_trajectory(write(tmp_path / "walk.csv", time, q), "phantomx-paper")
    assert np.array_equal(read.time, time)
    assert np.array_equal(read.q.reshape(-1, 18), q)
    # To degrees and back: two roundings of angles below 4 rad.
    order = np.random.default_rng(0).permutation(18)
    names = [f"{NAMES[i]}_deg" for i in order]
    write(tmp_path / "deg.csv", time, np.degrees(q[:, order]), names)
    np.save(tmp_path / "deg.npy", np.column_stack([time, np.degrees(q)]))
    for read in (
        load_trajectory(tmp_path / "deg.csv", ROBOT),
        load_trajectory(tmp_path / "deg.npy", ROBOT, unit="deg"),
    ):
        assert np.abs(read.q.reshape(-1, 18) - q).max() < 4 * np.finfo(float).eps * 4
    recording = analyse(WALK.experiment, WALK)
    save_recording(recording, tmp_path / "walk.nc")
    read = load_trajectory(tmp_path / "walk.nc", ROBOT)
    assert np.array_equal(read.q, recording.joint_position_target.values)


def test_between_rows_runs_a_cubic_spline(tmp_path):
    # The natural spline through samples of a curve with fourth derivative below B misses it by
    # at most 5/384 B h^4 inside, and at the ends by as much as the curve's own second derivative
    # there is not 0: a sine over whole half waves has none.
    h, n = 0.02, 101
    time, q = np.arange(n) * h, np.zeros((n, 18))
    q[:] = table(1)[1]
    wave = 0.2 * np.sin(np.pi * time)
    q[:, 0] += wave
    made = JointTrajectory(ROBOT, time, q.reshape(n, 6, 3))
    fine = np.linspace(0, 2, 1999)
    angle, velocity, acceleration = (values[:, 0, 0] for values in made.angles(fine))
    sine, cosine = 0.2 * np.sin(np.pi * fine), 0.2 * np.pi * np.cos(np.pi * fine)
    bound = 5 / 384 * 0.2 * np.pi**4 * h**4
    assert np.abs(angle - q[0, 0] - sine).max() < 1.01 * bound
    # The derivatives of a spline are off by 1/24 B h^3 and 3/8 B h^2.
    assert np.abs(velocity - cosine).max() < 1.01 / 24 * 0.2 * np.pi**4 * h**3
    assert np.abs(acceleration + np.pi**2 * sine).max() < 1.01 * 3 / 8 * 0.2 * np.pi**4 * h**2


def test_before_and_after_the_joints_stand_still():
    time, q = table()
    made = JointTrajectory(ROBOT, time + 7.0, q.reshape(-1, 6, 3))
    angle, velocity, acceleration = made.angles(np.array([-1.0, 0.0, 2.0, 5.0]))
    assert np.array_equal(angle[0], angle[1])
    assert np.array_equal(angle[3], angle[2])
    # The last piece's polynomial is evaluated at its end, in a handful of roundings.
    assert np.abs(angle[3] - made.q[-1]).max() < 8 * np.finfo(float).eps * np.pi
    assert not velocity[[0, 3]].any()
    assert not acceleration[[0, 3]].any()


ROWS = np.column_stack(table())
"""Times [s], and angles [rad]."""


@pytest.mark.parametrize(
    ("place", "values", "what"),
    [
        (
            np.s_[17, 0],
            0.795,
            "trajectory row 18: time 0.795 s does not follow 0.8 s by 1e-06 s or",
        ),
        (np.s_[40, 0], 1e300, "trajectory row 41: time is 1e+300 s; it must be a finite number"),
        (np.s_[5:, 1], 45.0, 'right_front.coxa reaches 45 rad. unit = "deg"'),
        (np.s_[20:, 3], ROWS[20:, 3] + 0.8, "right_front.tibia jumps 0.8"),
        (
            np.s_[:, 5],
            np.linspace(ROWS[0, 5], 2.0, 41),
            "trajectory row 41 turns right_middle.femur to 114.6°; its limits are -100° to",
        ),
    ],
)
def test_motions_that_no_robot_can_make_are_told(tmp_path, place, values, what):
    rows = ROWS.copy()
    rows[place] = values
    with pytest.raises(PhasmidError) as caught:
        load_trajectory(write(tmp_path / "a.csv", rows[:, 0], rows[:, 1:]), ROBOT)
    assert f"{caught.value.what} {caught.value.hint}".startswith(what)
    assert (caught.value.where, caught.value.exit_status) == ("a.csv", 2)


HEAD = ",".join(["time", *NAMES])
CELLS = "nan", "inf", "three", ""
CLAIM = b"{'descr': '<f8', 'fortran_order': False, 'shape': (10000000000, 19), }"
CLAIM = b"\x93NUMPY\x01\x00\x76\x00" + CLAIM + b" " * (117 - len(CLAIM)) + b"\n" + bytes(100)


def with_cell(cell):
    """A table whose last angle of the first row is something else."""
    return f"{HEAD}\n{'0,' * 18}{cell}\n1{',0' * 18}\n"


@pytest.mark.parametrize(
    ("name", "content", "what"),
    [
        ("a.csv", "", 'has no column "time"'),
        ("a.csv", HEAD.replace(f",{NAMES[-1]}", "") + "\n0", "has 17 joint columns; 18 are needed"),
        ("a.csv", "time,knee\n0,0\n", 'a column "knee"'),
        ("a.csv", "time,time\n0,0\n", 'a column "time.1"'),
        *(
            ("a.csv", with_cell(cell), "row 1, column left_front.tibia: not a fin")
            for cell in CELLS
        ),
        ("a.csv", b"\xff\xfe\x00", "not a table of text"),
        ("a.npy", CLAIM, "not an array that can be read"),
        ("a.npy", b"\x93NUMPY", "not an array that can be read"),
        ("a.xlsx", b"x", "is no trajectory that can be read"),
        ("absent.csv", None, "does not exist or is not a file"),
    ],
)
def test_what_is_no_trajectory_is_refused(tmp_path, name, content, what):
    if content is not None:
        (tmp_path / name).write_bytes(content.encode() if isinstance(content, str) else content)
    with pytest.raises(InvalidInput, match=what):
        load_trajectory(tmp_path / name, ROBOT)


def test_objects_and_pipes_are_refused_unread(tmp_path):
    np.save(tmp_path / "traj.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(InvalidInput, match="is not an array that can be read"):
        load_trajectory(tmp_path / "traj.npy", ROBOT)
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "a.csv")
        with pytest.raises(InvalidInput, match="does not exist or is not a file"):
            load_trajectory(tmp_path / "a.csv", ROBOT)
