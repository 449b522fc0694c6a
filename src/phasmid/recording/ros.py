"""Recordings as ROS 2 messages, in MCAP files and live, for Foxglove and ROS tools."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.recording.channels import JOINTS
from phasmid.recording.file import write_whole
from phasmid.recording.recording import Recording

_TIME = "int32 sec\nuint32 nanosec"
_HEADER = "builtin_interfaces/Time stamp\nstring frame_id"
_XYZ = "float64 x\nfloat64 y\nfloat64 z"
_QUATERNION = f"{_XYZ}\nfloat64 w"
_PARTS = {
    "builtin_interfaces/Time": _TIME,
    "std_msgs/Header": _HEADER,
    "geometry_msgs/Vector3": _XYZ,
    "geometry_msgs/Point": _XYZ,
    "geometry_msgs/Quaternion": _QUATERNION,
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation\n"
    "geometry_msgs/Quaternion rotation",
    "geometry_msgs/TransformStamped": "std_msgs/Header header\nstring child_frame_id\n"
    "geometry_msgs/Transform transform",
    "geometry_msgs/Wrench": "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque",
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose\nfloat64[36] covariance",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
    "geometry_msgs/TwistWithCovariance": "geometry_msgs/Twist twist\nfloat64[36] covariance",
}
_MESSAGES = {
    "sensor_msgs/msg/JointState": "std_msgs/Header header\nstring[] name\nfloat64[] position\n"
    "float64[] velocity\nfloat64[] effort",
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "nav_msgs/msg/Odometry": "std_msgs/Header header\nstring child_frame_id\n"
    "geometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist",
    "geometry_msgs/msg/WrenchStamped": "std_msgs/Header header\ngeometry_msgs/Wrench wrench",
    "sensor_msgs/msg/Imu": "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\n"
    "float64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n"
    "float64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\n"
    "float64[9] linear_acceleration_covariance",
}
"""Standard message types by the fields that they are made of."""

MESSAGE_GROUPS: tuple[set[str], ...] = (
    {"joint_position"},
    {"joint_position_target"},
    {"body_position", "body_orientation"},
    {"imu_orientation", "imu_angular_velocity", "imu_acceleration"},
    {"foot_force"},
)
"""Channels that make a message; others only fill it."""

WORLD, BODY = "world", "base_link"
"""Names of the frames, as ROS has them."""

Message = tuple[str, str, dict[str, Any]]
"""Topic, type and content."""


def save_mcap(
    recording: Recording,
    path: str | Path,
    *,
    leg_names: Sequence[str] | None = None,
    rate: float = 100.0,
) -> None:
    """Write a recording as ROS 2 messages; time counts from 0 as in the recording.

    Topics: ``/joint_states`` (angles, speeds, torques), ``/joint_states_target``, ``/tf`` and
    ``/odom`` (the body in the world; its twist in its own axes, as ROS has it), ``/imu`` where
    sensors were recorded, and for each foot ``/feet/NAME/force`` (of the ground on the foot, world
    axes). Channels that the recording lacks are left out.

    Args:
        recording: A simulation, an analysis or a robot's log.
        path: The file, by custom ``.mcap``; an older one is replaced.
        leg_names: Of its legs, in order; ``leg1``, ``leg2`` and so on by default.
        rate: Most messages of a topic a second [1/s].

    Raises:
        InvalidInput: The extra ``ros`` is not installed, the rate is not positive, the names are
            not one text for each leg, or the recording has no channel of any message.
        OutputError: The file cannot be written.
    """
    check_mcap()
    path = Path(path)
    if not rate > 0:
        raise InvalidInput(f"rate is {rate}; it must be greater than 0.")
    if not any(group <= {str(name) for name in recording.data_vars} for group in MESSAGE_GROUPS):
        raise InvalidInput(
            "none of these channels has a message of its own.",
            hint="joint_position, foot_force, or body_position with body_orientation",
        )
    names = names_of_legs(recording, leg_names)
    from mcap_ros2.writer import Writer

    time = np.asarray(recording["time"].values)
    arrays = {str(name): np.asarray(recording[name].values) for name in recording.data_vars}
    file = io.BytesIO()
    writer: Any = Writer(file)
    schemas: dict[str, Any] = {}
    for row in rows_at(time, rate).tolist():
        ns = round(1e9 * float(time[row]))
        sample = {name: values[row] for name, values in arrays.items()}
        for topic, kind, content in messages(sample, names, ns):
            if kind not in schemas:
                schemas[kind] = writer.register_msgdef(kind, definition(kind))
            writer.write_message(topic, schemas[kind], content, log_time=ns, publish_time=ns)
    writer.finish()
    write_whole(path, file.getvalue())


def check_mcap() -> None:
    """Refuse to write MCAP files without the packages for it; called before a run starts.

    Raises:
        InvalidInput: The extra ``ros`` is not installed.
    """
    try:
        import_module("mcap_ros2.writer")
    except ImportError as error:
        raise InvalidInput(
            "an MCAP file needs the packages mcap and mcap-ros2-support, which were not found.",
            hint='pip install "phasmid[ros]"',
        ) from error


def names_of_legs(recording: Recording, names: Sequence[str] | None) -> Sequence[str]:
    """Return a name for each leg: those given, the recording's own, or ``leg1`` and so on.

    Raises:
        InvalidInput: The names are not one text for each leg.
    """
    count = recording.sizes.get("leg", 0)
    if names is None and "leg_name" in recording.coords:
        return [str(name) for name in recording["leg_name"].values]
    if names is None:
        return [f"leg{number}" for number in range(1, count + 1)]
    if count and len(names) != count:
        raise InvalidInput(f"leg_names has {len(names)} names; one per leg, {count} in all.")
    return names


def rows_at(time: np.ndarray, rate: float) -> np.ndarray:
    """Return the first sample of each interval of 1/rate.

    Args:
        time: Of all samples [s].
        rate: Most samples a second [1/s].
    """
    # Allow one nanosecond of round-off.
    number = np.floor((time - time[0]) * rate + 1e-9 * rate)
    rows: np.ndarray = np.flatnonzero(np.diff(number, prepend=-1.0) > 0)
    return rows


def definition(kind: str) -> str:
    """Return the definition of a message with those of its parts."""
    text, found, pending = _MESSAGES[kind], [], [_MESSAGES[kind]]
    while pending:
        for line in pending.pop().splitlines():
            part = line.split()[0].split("[")[0]
            if part in _PARTS and part not in found:
                found.append(part)
                pending.append(_PARTS[part])
    for part in found:
        text += f"\n{'=' * 80}\nMSG: {part}\n{_PARTS[part]}"
    return text


def encoder(kind: str) -> Callable[[dict[str, Any]], bytes]:
    """Return the function that encodes contents of messages of a type (extra ``ros``)."""
    # The package has no public encoder of messages that go elsewhere than into a file.
    from mcap_ros2._dynamic import serialize_dynamic

    found: Callable[[dict[str, Any]], bytes] = serialize_dynamic(kind, definition(kind))[kind]
    return found


def messages(
    sample: Mapping[str, np.ndarray],
    names: Sequence[str],
    ns: int,
    wanted: Callable[[str], bool] = lambda topic: True,  # noqa: ARG005
) -> Iterator[Message]:
    """Yield the messages of one sample.

    Args:
        sample: Channels of a recording at one instant.
        names: Names of the legs, in order.
        ns: Time of the sample [ns].
        wanted: Whether a topic's message is made.
    """
    stamp = {"sec": ns // 10**9, "nanosec": ns % 10**9}
    world, body = ({"stamp": stamp, "frame_id": frame} for frame in (WORLD, BODY))
    joints = [f"{leg}.{joint}" for leg in names for joint in JOINTS]
    for suffix in ("", "_target"):
        if not wanted(f"/joint_states{suffix}"):
            continue
        # Targets have no torque.
        fields = {"position": "position", "velocity": "velocity", "effort": "torque"}
        state = {
            field: np.ravel(sample.get(f"joint_{name}{suffix}", ())).tolist()
            for field, name in fields.items()
        }
        if state["position"]:
            content = {"header": body, "name": joints} | state
            yield f"/joint_states{suffix}", "sensor_msgs/msg/JointState", content
    if {"body_position", "body_orientation"} <= sample.keys():
        position, orientation = sample["body_position"], _quaternion(sample["body_orientation"])
        transform = {"translation": _vector(position), "rotation": orientation}
        stamped = {"header": world, "child_frame_id": BODY, "transform": transform}
        yield "/tf", "tf2_msgs/msg/TFMessage", {"transforms": [stamped]}
        if {"body_velocity", "body_angular_velocity"} <= sample.keys() and wanted("/odom"):
            twist = {
                "linear": _in_body(sample, "body_velocity"),
                "angular": _in_body(sample, "body_angular_velocity"),
            }
            pose = {"position": _vector(position), "orientation": orientation}
            content = {"header": world, "child_frame_id": BODY}
            content["pose"] = {"pose": pose, "covariance": [0.0] * 36}
            content["twist"] = {"twist": twist, "covariance": [0.0] * 36}
            yield "/odom", "nav_msgs/msg/Odometry", content
    if {"imu_orientation", "imu_angular_velocity", "imu_acceleration"} <= sample.keys():
        content = {
            "header": body,
            "orientation": _quaternion(sample["imu_orientation"]),
            "angular_velocity": _vector(sample["imu_angular_velocity"]),
            "linear_acceleration": _vector(sample["imu_acceleration"]),
        }
        # A covariance that begins with 0 is unknown.
        unknown = {f"{name}_covariance": [0.0] * 9 for name in content if name != "header"}
        yield "/imu", "sensor_msgs/msg/Imu", content | unknown
    for name, force in zip(names, sample.get("foot_force", ()), strict=False):
        if not wanted(f"/feet/{name}/force"):
            continue
        wrench = {"force": _vector(force), "torque": _vector(np.zeros(3))}
        content = {"header": world, "wrench": wrench}
        yield f"/feet/{name}/force", "geometry_msgs/msg/WrenchStamped", content


def _vector(values: np.ndarray) -> dict[str, float]:
    return dict(zip("xyz", values.tolist(), strict=True))


def _quaternion(values: np.ndarray) -> dict[str, float]:
    return dict(zip("wxyz", values.tolist(), strict=True))


def _in_body(sample: Mapping[str, np.ndarray], name: str) -> dict[str, float]:
    """Return a world vector in the axes of the body."""
    # Lazy import: scipy takes 0.2 s.
    from scipy.spatial.transform import Rotation

    rotation = Rotation.from_quat(sample["body_orientation"], scalar_first=True)
    return _vector(rotation.inv().apply(sample[name]))
