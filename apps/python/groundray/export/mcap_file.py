"""An MCAP file of ROS 2 messages, and the metadata.yaml that makes it a bag."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import yaml

from groundray.export.ros_messages import DEFINITIONS


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
            self._schemas[kind] = self._writer.register_msgdef(kind, DEFINITIONS[kind])
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
