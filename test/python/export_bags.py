"""Bags as rosbags reads them, with its own definitions of messages."""

import functools
from pathlib import Path

import numpy as np
import pytest
from export_runs import export, run_folder

pytest.importorskip("rosbags", reason="pip install -r test/requirements.txt")
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

SHIFT_NS = 10**9  # a run's clock begins at 0, which ROS takes for "the latest"
TYPES = get_typestore(Stores.ROS2_HUMBLE)
NUMPY = {1: "i1", 2: "u1", 3: "<i2", 4: "<u2", 5: "<i4", 6: "<u4", 7: "<f4", 8: "<f8"}


def messages(folder):
    """Topic, log time and message, in the order of the file."""
    with Reader(folder) as reader:
        for connection, time_ns, data in reader.messages():
            yield connection.topic, time_ns, TYPES.deserialize_cdr(data, connection.msgtype)


def stamp_ns(message):
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def points_of(message):
    fields = message.fields
    dtype = np.dtype(
        {
            "names": [each.name for each in fields],
            "formats": [NUMPY[each.datatype] for each in fields],
            "offsets": [each.offset for each in fields],
            "itemsize": message.point_step,
        }
    )
    assert message.height == 1
    assert message.row_step == message.point_step * message.width == len(message.data)
    return np.frombuffer(message.data.tobytes(), dtype)


def of(everything, topic):
    return [(time_ns, message) for name, time_ns, message in everything if name == topic]


@functools.cache
def whole_bag() -> tuple[Path, list]:
    """The bag of the complete dataset, made once for all tests, and its messages."""
    out = run_folder().parent / "bag"
    assert export("mcap", out, "--depth") == 0
    return out, list(messages(out))
