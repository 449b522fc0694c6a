"""Command tracking: shares of a commanded motion, against motions whose shares are known."""

import numpy as np
import pytest

from phasmid.kinematics import CommandTracking, rpy_quaternion, track_command, track_velocity

TIME = np.linspace(0.0, 5.0, 501)


def moved(velocity, time=TIME):
    """Poses of a body that moves at a constant velocity in its own axes: vx, vy, wz."""
    vx, vy, wz = velocity
    yaw = wz * time
    if wz:
        x = (vx * np.sin(yaw) - vy * (1 - np.cos(yaw))) / wz
        y = (vx * (1 - np.cos(yaw)) + vy * np.sin(yaw)) / wz
    else:
        x, y = vx * time, vy * time
    return np.stack([x, y], axis=-1), rpy_quaternion(0 * yaw, 0 * yaw, yaw)


@pytest.mark.parametrize("command", [(0.05, 0.0, 0.2), (0.0, -0.03, 0.0), (0.02, 0.04, -1.5)])
@pytest.mark.parametrize("share", [1.0, 0.41, 0.0, -0.5])
def test_a_body_that_makes_a_share_of_its_twist_has_that_share(command, share):
    """Arcs and turns of more than half a circle, too: way and turn are counted along the path.

    Chords of 10 ms differ from an arc by (wz dt)²/24, less than 1e-5.
    """
    track = track_command(TIME, np.tile(command, (len(TIME), 1)), *moved(share * np.array(command)))
    assert track.distance_share == pytest.approx(share, abs=1e-4)
    assert track.commanded_distance == pytest.approx(5 * np.hypot(*command[:2]))
    assert track.turn_share == (pytest.approx(share, abs=1e-9) if command[2] else None)


def test_a_walk_off_a_planned_course_counts_along_the_course_only():
    """The body turns by a quarter circle on its way straight ahead: 2/pi of its path is ahead."""
    pose = moved((0.05, 0.0, np.pi / 10))
    planned = np.tile([0.05, 0.0, 0.0], (len(TIME), 1))
    assert track_command(TIME, planned, *pose, 0 * TIME).distance_share == pytest.approx(
        2 / np.pi, 1e-4
    )
    assert track_command(TIME, planned, *pose).distance_share == pytest.approx(1, 1e-4)


def test_parts_of_a_run_add_up_to_it():
    command = np.tile([0.05, 0.0, 0.2], (len(TIME), 1))
    position, orientation = moved((0.03, 0.01, 0.1))
    whole = track_command(TIME, command, position, orientation)
    total = CommandTracking()
    # Successive parts share a sample.
    for part in (slice(0, 101), slice(100, 350), slice(349, 501)):
        total += track_command(TIME[part], command[part], position[part], orientation[part])
    for name in ("distance", "commanded_distance", "turn", "commanded_turn"):
        assert getattr(total, name) == pytest.approx(getattr(whole, name), rel=1e-9)


def test_nothing_commanded_has_no_share():
    still = np.zeros((len(TIME), 3))
    track = track_command(TIME, still, *moved((0.05, 0.0, 0.0)))
    assert (track.distance_share, track.turn_share, track.smallest_share) == (None, None, None)
    # The lesser share counts.
    command = np.tile([0.05, 0.0, 0.2], (len(TIME), 1))
    track = track_velocity(TIME, command, command * [0.9, 1.0, 0.3])
    assert track.smallest_share == track.turn_share == pytest.approx(0.3)
