"""Frames show the recording at their times, and the camera keeps the robot in their middle."""

import numpy as np
import pytest

from phasmid.errors import InvalidInput
from phasmid.reporting.film.film import (
    HIGH,
    MOST_FRAMES,
    WIDE,
    camera_of,
    frame_times,
    frames_of,
    smoothed,
    square_side,
)
from phasmid.reporting.robot_mesh import body_pose, robot_corners
from phasmid.reporting.run import read_run


def test_whole_cycles_make_a_film_that_loops():
    # 4 s at 15 a second are 60 frames; the 61st would be the first again.
    time = frame_times(np.linspace(1.0, 5.0, 4001), 15.0, 1.0)
    assert len(time) == 60
    np.testing.assert_allclose([time[0], time[-1] + 1 / 15], [1.0, 5.0])
    # Slow motion has more frames.
    time = frame_times(np.array([0.0, 1.0]), 30.0, 0.25)
    assert len(time) == 120
    np.testing.assert_allclose(np.diff(time), 0.25 / 30)


def test_an_endless_film_is_refused():
    length = MOST_FRAMES / 30 * 2.5
    with pytest.raises(InvalidInput, match=r"has 135000 frames; the limit is 54000\.") as caught:
        frame_times(np.array([0.0, length]), 30.0, 1.0)
    assert caught.value.hint == "speed=3"


def test_between_samples_values_are_on_straight_lines_and_orientations_are_units(run):
    frames = frames_of(run, fps=47.0, speed=1.0)
    assert len(frames.time) == round(0.4 * 47)
    for k in range(3):
        expected = np.interp(frames.time, run.time, run.channel("body_position")[:, k])
        np.testing.assert_allclose(frames.channel("body_position")[:, k], expected, atol=1e-12)
    length = np.linalg.norm(frames.channel("body_orientation"), axis=1)
    np.testing.assert_allclose(length, 1.0, rtol=1e-14)


def test_a_quaternion_and_its_negative_are_one_orientation(recording, run):
    flipped = recording.copy(deep=True)
    flipped["body_orientation"][::2] *= -1
    turns = [
        body_pose(*frames_of(one, fps=47.0, speed=1.0).pose("a test")[:2])
        for one in (read_run(flipped), run)
    ]
    np.testing.assert_allclose(turns[0], turns[1], atol=1e-12)


def test_a_recording_without_a_pose_is_refused(recording):
    with pytest.raises(InvalidInput, match="the recording has no body_position; a video"):
        frames_of(read_run(recording.drop_vars(["body_position"])), fps=10.0, speed=1.0)


def test_without_seen_forces_the_models_are_shown(recording):
    run = read_run(recording.drop_vars(["foot_force", "foot_normal_force"]))
    assert run.force_words == "by the model"
    np.testing.assert_array_equal(run.normal_force, recording["foot_normal_force_model"].values)


def test_the_robot_fills_the_middle_of_the_picture(frames):
    size = (1280, 532)
    view, displacement = camera_of(frames, size)
    position, orientation, q = frames.pose("a test")
    seen = []
    for frame, X_world_body in enumerate(body_pose(position, orientation)):
        corners = robot_corners(frames.robot, q[frame], X_world_body)
        seen.append(view.moved(displacement[frame]).project(corners).reshape(-1, 2))
    points = np.concatenate(seen)
    low, high = points.min(axis=0), points.max(axis=0)
    # A part of a pixel: the camera looks at the robot in every frame of so short a film.
    np.testing.assert_allclose((low + high) / 2, [640, 266], atol=1.0)
    filled = (high - low) / size
    assert filled.max() <= max(WIDE, HIGH) + 1e-3
    assert abs(filled[0] - WIDE) < 2e-3 or abs(filled[1] - HIGH) < 2e-3


def test_the_camera_follows_smoothly_and_without_delay():
    # A body that stops at each step: 20 mm of to and fro about an even way, five times a second.
    time = np.arange(301) / 30
    way = np.stack([0.1 * time + 0.02 * np.sin(2 * np.pi * 5 * time), 0 * time], axis=1)
    found = smoothed(way, 30.0)
    np.testing.assert_allclose(found[[0, -1]], way[[0, -1]], atol=1e-3)
    # Over 1 s of smoothing, what repeats 5 times a second shrinks by exp(-(2π·5)²/2): to nothing.
    np.testing.assert_allclose(found[60:-60, 0], 0.1 * time[60:-60], atol=2e-3)


def test_a_cycle_passes_whole_squares():
    assert square_side(0.04) == 0.08
    assert square_side(0.12) == 0.12
    assert square_side(0.0) == 0.1
