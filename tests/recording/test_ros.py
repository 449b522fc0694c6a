"""A recording as ROS 2 messages is read by ROS's own format and says the same numbers."""

import numpy as np
import pytest

from phasmid import load_scenario, plan, sense, simulate
from phasmid.errors import InvalidInput
from phasmid.kinematics import quaternion_rotation
from phasmid.recording.ros import save_mcap

NAMES = ("right_front", "right_middle", "right_rear", "left_rear", "left_middle", "left_front")


@pytest.fixture(scope="module")
def run():
    scenario = load_scenario("paper").replace(duration=0.2)
    return sense(scenario, simulate(scenario, plan(scenario)))


@pytest.fixture(scope="module")
def topics(run, tmp_path_factory):
    """Messages by topic, as an independent decoder reads them from their definitions."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    path = tmp_path_factory.mktemp("ros") / "walk.mcap"
    save_mcap(run, path, leg_names=NAMES, rate=50.0)
    found: dict = {}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, message, content in reader.iter_decoded_messages():
            found.setdefault(channel.topic, []).append((message.log_time, content))
    return found


def xyz(vector):
    return [vector.x, vector.y, vector.z]


def test_joints_and_feet_and_inertial_sensor_say_what_was_recorded(run, topics):
    feet = {f"/feet/{name}/force" for name in NAMES}
    rest = {"/joint_states", "/joint_states_target", "/tf", "/odom", "/imu"}
    assert set(topics) == feet | rest
    for messages in topics.values():
        assert [time for time, _ in messages] == [20_000_000 * k for k in range(11)]
    for k in range(11):
        row = run.isel(time=20 * k)
        state, imu = topics["/joint_states"][k][1], topics["/imu"][k][1]
        assert state.name[:4] == [
            "right_front.coxa",
            "right_front.femur",
            "right_front.tibia",
            "right_middle.coxa",
        ]
        assert state.header.stamp.nanosec == 20_000_000 * k
        assert np.array_equal(state.position, row.joint_position.values.ravel())
        assert np.array_equal(state.velocity, row.joint_velocity.values.ravel())
        assert np.array_equal(state.effort, row.joint_torque.values.ravel())
        for leg, name in enumerate(NAMES):
            wrench = topics[f"/feet/{name}/force"][k][1]
            assert xyz(wrench.wrench.force) == list(row.foot_force.values[leg])
        q = imu.orientation
        assert [q.w, q.x, q.y, q.z] == list(row.imu_orientation.values)
        assert xyz(imu.linear_acceleration) == list(row.imu_acceleration.values)
        assert xyz(imu.angular_velocity) == list(row.imu_angular_velocity.values)


def test_the_body_stands_in_the_world_and_moves_in_its_own_axes(run, topics):
    # nav_msgs/Odometry: the pose in header.frame_id, the twist in child_frame_id.
    for k, (_, odometry) in enumerate(topics["/odom"]):
        row = run.isel(time=20 * k)
        q = odometry.pose.pose.orientation
        assert [q.w, q.x, q.y, q.z] == list(row.body_orientation.values)
        assert xyz(odometry.pose.pose.position) == list(row.body_position.values)
        R = quaternion_rotation(row.body_orientation.values)
        twist = odometry.twist.twist
        # Speeds below 1 m/s and 1 rad/s, turned by a handful of products.
        assert xyz(twist.linear) == pytest.approx(R.T @ row.body_velocity.values, abs=1e-14)
        assert xyz(twist.angular) == pytest.approx(
            R.T @ row.body_angular_velocity.values, abs=1e-14
        )
    (_, tf) = topics["/tf"][-1]
    assert (tf.transforms[0].header.frame_id, tf.transforms[0].child_frame_id) == (
        "world",
        "base_link",
    )


@pytest.mark.parametrize("value", [1e308, -1e308, np.inf, np.nan])
def test_values_beyond_any_robot_are_written_without_a_warning(run, tmp_path, value):
    extreme = run.isel(time=slice(0, 3)).copy(deep=True)
    for channel in extreme.data_vars.values():
        if channel.dtype.kind == "f":
            channel.values[1:] = value
    save_mcap(extreme, tmp_path / "a.mcap", rate=1000.0)
    assert (tmp_path / "a.mcap").stat().st_size > 0


def test_a_time_below_0_has_no_stamp(run, tmp_path):
    early = run.assign_coords(time=run["time"] - 5.0)
    with pytest.raises(InvalidInput, match="begins at -5 s; stamps of ROS 2 begin at 0"):
        save_mcap(early, tmp_path / "a.mcap")
    assert not list(tmp_path.iterdir())


def test_what_a_recording_lacks_is_left_out(run, tmp_path):
    from mcap.reader import make_reader

    few = run[["joint_position"]]
    save_mcap(few, tmp_path / "a.mcap", rate=1000.0)
    with (tmp_path / "a.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    assert {channel.topic for channel in summary.channels.values()} == {"/joint_states"}
    assert summary.statistics.message_count == few.sizes["time"]
