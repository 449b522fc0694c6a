"""Recordings as ROS 2 messages, in MCAP files and live, for Foxglove and ROS tools."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from phasmid.arguments import checked
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

_NUMBERS = {"int32": "<i4", "uint32": "<u4", "float64": "<f8"}
"""Types of numbers, which are aligned by their size."""

WORLD, BODY = "world", "base_link"
"""Names of the frames, as ROS has them."""

XYZW = [1, 2, 3, 0]
"""Order of a quaternion w x y z in ROS."""

Sample = Mapping[str, np.ndarray]
"""Channels of a recording at one instant."""

Values = Callable[[Sample], Sequence[np.ndarray]]
"""Returns numbers of a message from a sample."""


class Topic:
    """Encoder of a topic's messages, which differ in time stamps and float64 values only.

    One message is encoded in advance, as by ROS 2 (CDR, little-endian). The numbers are then
    replaced for each sample.

    Args:
        kind: Type of the messages.
        content: The constant fields by name, nested as in the definition. Absent numbers, and
            elements None of a list, vary.
        values: Returns the varying float64 values of a sample, in the order of the definition.

    Attributes:
        kind: Type of the messages.
    """

    def __init__(self, kind: str, content: Mapping[str, Any], values: Values) -> None:
        self.kind, self._values = kind, values
        # Words of four bytes that hold the stamps' seconds and nanoseconds, and the values.
        stamp_words: list[int] = []
        value_words: list[int] = []
        data = bytearray(b"\0\1\0\0")

        def append(kind: str, content: Any) -> None:
            kind, is_array, length = kind.partition("[")
            if is_array:
                if length == "]":
                    append("uint32", len(content))
                for element in content:
                    append(kind, element)
            elif kind == "string":
                text = content.encode() + b"\0"
                append("uint32", len(text))
                data.extend(text)
            elif kind in _NUMBERS:
                number = np.array(content or 0, _NUMBERS[kind])
                # The first four bytes do not count for the alignment.
                data.extend(bytes((4 - len(data)) % number.itemsize))
                if content is None:
                    words = value_words if kind == "float64" else stamp_words
                    words.extend(range(len(data) // 4, (len(data) + number.itemsize) // 4))
                data.extend(number.tobytes())
            else:
                for line in (_MESSAGES | _PARTS)[kind].splitlines():
                    part, name = line.split()
                    append(part, (content or {}).get(name))

        append(kind, content)
        # Every message ends with a number or a count, and so with a whole word.
        self._words = np.frombuffer(data, "<u4").copy()
        self._stamp_words = np.reshape(stamp_words, (-1, 2))
        self._value_words = np.array(value_words)

    def encode(self, sample: Sample, ns: int) -> bytes:
        """Return the message of a sample at a time [ns]."""
        values = np.concatenate([part.ravel() for part in self._values(sample)], dtype="<f8")
        self._words[self._stamp_words] = divmod(ns, 10**9)
        self._words[self._value_words] = values.view("<u4")
        return self._words.tobytes()


def topics(sample: Sample, leg_names: Sequence[str]) -> dict[str, Topic]:
    """Return the topics of samples with the same channels, by name.

    Args:
        sample: One of the samples.
        leg_names: Names of the legs, in order.
    """
    found: dict[str, Topic] = {}
    world, body = {"frame_id": WORLD}, {"frame_id": BODY}
    joints = [f"{leg}.{joint}" for leg in leg_names for joint in JOINTS]
    for suffix in ("", "_target"):
        # Targets have no torque.
        names = [f"joint_{name}{suffix}" for name in ("position", "velocity", "torque")]
        if names[0] in sample:
            content: dict[str, Any] = {"header": body, "name": joints}
            for field, name in zip(("position", "velocity", "effort"), names, strict=True):
                content[field] = [None] * np.size(sample.get(name, ()))
            values = _channels(*(name for name in names if name in sample))
            topic = Topic("sensor_msgs/msg/JointState", content, values)
            found[f"/joint_states{suffix}"] = topic
    if {"body_position", "body_orientation"} <= sample.keys():
        stamped = {"header": world, "child_frame_id": BODY}
        found["/tf"] = Topic("tf2_msgs/msg/TFMessage", {"transforms": [stamped]}, _pose)
        if {"body_velocity", "body_angular_velocity"} <= sample.keys():
            unknown = {"covariance": [0.0] * 36}
            content = stamped | {"pose": unknown, "twist": unknown}
            found["/odom"] = Topic("nav_msgs/msg/Odometry", content, _odometry)
    if {"imu_orientation", "imu_angular_velocity", "imu_acceleration"} <= sample.keys():
        content = {"header": body}
        for name in ("orientation", "angular_velocity", "linear_acceleration"):
            # A covariance that begins with 0 is unknown.
            content[f"{name}_covariance"] = [0.0] * 9
        found["/imu"] = Topic("sensor_msgs/msg/Imu", content, _imu)
    for leg, name in enumerate(leg_names[: len(sample.get("foot_force", ()))]):
        content = {"header": world, "wrench": {"torque": dict.fromkeys("xyz", 0.0)}}
        topic = Topic("geometry_msgs/msg/WrenchStamped", content, _channels("foot_force", at=leg))
        found[f"/feet/{name}/force"] = topic
    return found


def _channels(*names: str, at: Any = ...) -> Values:
    """Return the function that takes channels from a sample, at an index."""
    return lambda sample: [sample[name][at] for name in names]


def _pose(sample: Sample) -> tuple[np.ndarray, ...]:
    return sample["body_position"], sample["body_orientation"][XYZW]


def _odometry(sample: Sample) -> tuple[np.ndarray, ...]:
    """Return the body's pose in the world, and its velocities in its own axes."""
    w, x, y, z = sample["body_orientation"].tolist()
    R_world_body = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    velocities = sample["body_velocity"], sample["body_angular_velocity"]
    # A diverged run has infinite values, and their products have no number.
    with np.errstate(over="ignore", invalid="ignore"):
        return *_pose(sample), *(velocity @ R_world_body for velocity in velocities)


def _imu(sample: Sample) -> tuple[np.ndarray, ...]:
    turn, acceleration = sample["imu_angular_velocity"], sample["imu_acceleration"]
    return sample["imu_orientation"][XYZW], turn, acceleration


@checked
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
        InvalidInput: The rate is not positive, the names are not one text for each leg, the time
            begins below 0, or the recording has no channel of any message.
        OutputError: The file cannot be written.
    """
    # Lazy import: 0.07 s.
    from mcap.writer import Writer

    path = Path(path)
    if not rate > 0:
        raise InvalidInput(f"rate is {rate}; it must be greater than 0.")
    names = names_of_legs(recording, leg_names)
    time = np.asarray(recording["time"].values)
    if time[0] < 0:
        raise InvalidInput(
            f"the recording begins at {time[0]:g} s; stamps of ROS 2 begin at 0.",
            hint="another format, such as .nc",
        )
    arrays = {str(name): np.asarray(recording[name].values) for name in recording.data_vars}
    found = topics({name: values[0] for name, values in arrays.items()}, names)
    if not found:
        raise InvalidInput(
            "none of these channels has a message of its own.",
            hint="joint_position, foot_force, or body_position with body_orientation",
        )
    file = io.BytesIO()
    writer: Any = Writer(file)
    writer.start("ros2")
    channels = {}
    for name, topic in found.items():
        text = definition(topic.kind).encode()
        schema = writer.register_schema(topic.kind, "ros2msg", text)
        channels[name] = writer.register_channel(name, "cdr", schema)
    for row in rows_at(time, rate).tolist():
        ns = round(1e9 * float(time[row]))
        sample = {name: values[row] for name, values in arrays.items()}
        for name, topic in found.items():
            writer.add_message(channels[name], ns, topic.encode(sample, ns), ns)
    writer.finish()
    write_whole(path, file.getvalue())


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
