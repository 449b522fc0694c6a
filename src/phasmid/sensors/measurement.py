"""A recording as the robot's own sensors would have seen it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.recording import Recording, check_recording, new_recording
from phasmid.robot import Robot
from phasmid.scenario import Scenario, check_scenario
from phasmid.sensors.feet import foot_channels
from phasmid.sensors.imu import imu_channels
from phasmid.sensors.joints import joint_channels

IMU_NEEDS = ("body_orientation", "body_velocity", "body_angular_velocity")


def sense(scenario: Scenario, recording: Recording) -> Recording:
    """Put what sensors would have told beside what a recording knows.

    Every sensor reads at its own rate, late, in steps and with noise; between its readings the
    last one stands. The noise comes from the scenario's seed alone: the same recording is sensed
    the same way each time, and a longer one begins like a shorter one.

    Args:
        scenario: Its robot and its sensors' rates, delays and noise are used.
        recording: What was seen, such as `simulate` returns.

    Returns:
        The recording with the channels ``joint_position_measured``, ``joint_load_measured``,
        ``imu_angular_velocity``, ``imu_acceleration``, ``imu_orientation``,
        ``foot_normal_force_measured`` and ``contact_measured``, as far as it has what they measure.

    Raises:
        InvalidInput: It has nothing that a sensor could measure, or so few samples that a sensor
            reads more often.
    """
    check_scenario(scenario)
    check_recording(recording)
    channels = {str(name): np.asarray(recording[name].values) for name in recording.data_vars}
    time = np.asarray(recording["time"].values)
    told = measured_channels(scenario, scenario.load_robot(), time, channels)
    if not told:
        raise InvalidInput(
            "the recording has nothing that a sensor could measure.", hint="phasmid.simulate"
        )
    attributes = {str(name): value for name, value in recording.attrs.items()}
    return new_recording(time, channels | told, attributes)


def measured_channels(
    scenario: Scenario,
    robot: Robot,
    time: Float[np.ndarray, " time"],
    channels: Mapping[str, np.ndarray],
) -> dict[str, np.ndarray]:
    """What sensors tell of a recording's channels, by channel name.

    Args:
        scenario: Its sensors and its gravity are used.
        robot: Its servo's stall torque is what a full load reading means where the servo's own
            output is not recorded.
        time: [s], shape (N,).
        channels: What was seen, by name.

    Raises:
        InvalidInput: A sensor reads more often than there are samples.
    """
    table = scenario.sensors
    interval = float(np.diff(time).max(initial=0.0))
    told: dict[str, np.ndarray] = {}
    if "joint_position" in channels:
        table.check_interval(interval, ["joint"])
        told |= joint_channels(table, time, channels["joint_position"], servo_load(robot, channels))
    if all(name in channels for name in IMU_NEEDS):
        table.check_interval(interval, ["imu"])
        seen = (channels[name] for name in IMU_NEEDS)
        told |= imu_channels(table, scenario.model.gravity, time, *seen)
    if "foot_normal_force" in channels:
        table.check_interval(interval, ["foot"])
        told |= foot_channels(table, time, channels["foot_normal_force"])
    return told


def servo_load(robot: Robot, channels: Mapping[str, np.ndarray]) -> np.ndarray | None:
    """The servos' output as a share of the largest; None where nothing tells it.

    An AX-12 does not measure its torque: what it reports as load is the output that its position
    loop asks of the motor.
    """
    if "servo_duty" in channels:
        return channels["servo_duty"]
    torque = channels.get("joint_torque")
    return None if torque is None else torque / robot.servo.stall_torque
