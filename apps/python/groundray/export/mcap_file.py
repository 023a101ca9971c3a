"""An MCAP file of ROS 2 messages, and the metadata.yaml that makes it a bag."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import yaml

_TIME = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n")
_HEADER = ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n")
_POINT_FIELD = (
    "sensor_msgs/PointField",
    "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\n"
    "uint8 FLOAT32=7\nuint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n",
)
_REGION = (
    "sensor_msgs/RegionOfInterest",
    "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n",
)
_VECTOR = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n")
_QUATERNION = ("geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n")
_TRANSFORM = (
    "geometry_msgs/Transform",
    "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
)
_STAMPED = (
    "geometry_msgs/TransformStamped",
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
)


def _definition(fields: str, *parts: tuple[str, str]) -> str:
    line = "=" * 80
    return fields + "".join(f"{line}\nMSG: {name}\n{text}" for name, text in parts)


# Complete definitions of the messages, in the format ros2msg.
_DEFINITIONS = {
    "sensor_msgs/msg/PointCloud2": _definition(
        "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\n"
        "bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n",
        *[_HEADER, _TIME, _POINT_FIELD],
    ),
    "sensor_msgs/msg/Image": _definition(
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\n"
        "uint8 is_bigendian\nuint32 step\nuint8[] data\n",
        *[_HEADER, _TIME],
    ),
    "sensor_msgs/msg/CameraInfo": _definition(
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\n"
        "float64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\n"
        "uint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n",
        *[_HEADER, _TIME, _REGION],
    ),
    "tf2_msgs/msg/TFMessage": _definition(
        "geometry_msgs/TransformStamped[] transforms\n",
        *[_STAMPED, _HEADER, _TIME, _TRANSFORM, _VECTOR, _QUATERNION],
    ),
}

# PointField's numbers of types, by kind and size.
POINT_TYPES = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}


class Message(NamedTuple):
    """A message to write: its time, then its order among messages of the same time."""

    time_ns: int
    order: int
    topic: str
    kind: str
    values: dict[str, Any]


class Bag:
    """An MCAP file that is being written, and the contents of its metadata.yaml."""

    def __init__(self, path: Path, compression: str) -> None:
        from mcap.writer import CompressionType
        from mcap_ros2.writer import Writer

        self.path = path
        self.file = path.open("wb")
        self.counts: dict[str, int] = {}
        self.kinds: dict[str, str] = {}
        self._times_ns: tuple[int, int] | None = None
        self._writer = Writer(self.file, compression=CompressionType[compression.upper()])
        self._schemas: dict[str, Any] = {}

    def begin(self, facts: dict[str, str]) -> None:
        self._writer.add_metadata("groundray", facts)

    def write(self, message: Message) -> None:
        """Appends a message; times must not decrease."""
        time_ns, _, topic, kind, values = message
        if kind not in self._schemas:
            self._schemas[kind] = self._writer.register_msgdef(kind, _DEFINITIONS[kind])
        sequence = self.counts.get(topic, 0)
        self._writer.write_message(topic, self._schemas[kind], values, time_ns, time_ns, sequence)
        self.counts[topic] = sequence + 1
        self.kinds[topic] = kind
        first_ns = self._times_ns[0] if self._times_ns else time_ns
        self._times_ns = (first_ns, time_ns)

    def end(self) -> None:
        self._writer.finish()  # type: ignore[no-untyped-call]

    def record(self) -> str:
        """Returns the text of metadata.yaml, which marks /tf_static as latched."""
        first_ns, last_ns = self._times_ns or (0, 0)
        topics = [
            {
                "topic_metadata": {
                    "name": topic,
                    "type": self.kinds[topic],
                    "serialization_format": "cdr",
                    "offered_qos_profiles": _LATCHED if topic == "/tf_static" else "",
                },
                "message_count": count,
            }
            for topic, count in self.counts.items()
        ]
        span = {
            "duration": {"nanoseconds": last_ns - first_ns},
            "starting_time": {"nanoseconds_since_epoch": first_ns},
            "message_count": sum(self.counts.values()),
        }
        information = {
            "version": 5,
            "storage_identifier": "mcap",
            **span,
            "topics_with_message_count": topics,
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [self.path.name],
            "files": [{"path": self.path.name, **span}],
        }
        return str(yaml.safe_dump({"rosbag2_bagfile_information": information}, sort_keys=False))


# Keep last, depth 1, reliable, transient local, in rosbag2's numbers; no deadlines.
_LATCHED = """\
- history: 1
  depth: 1
  reliability: 1
  durability: 1
  deadline: {sec: 9223372036, nsec: 854775807}
  lifespan: {sec: 9223372036, nsec: 854775807}
  liveliness: 1
  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false
"""
