"""Points of LAS, LAZ and MCAP files as a NumPy array: `python -m groundray.foreign.cloud FILE`.

Standard output gets a line with the name of the format, and then an .npy file with one structured
row per point. x, y and z of LAS are doubles: the stored integers times scale plus offset. Those of
MCAP are as in its messages, all PointCloud2 of one topic, one after another, with the columns
`message` (number of the message) and `stamp_s` (stamp of its header).
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundray.dataset import Error
from groundray.file_content import open_regular
from groundray.foreign.module import need, run

_TYPE = "sensor_msgs/msg/PointCloud2"
# NumPy types of PointField.datatype, without the byte order.
_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}

Table = NDArray[np.void]


def _table_of(columns: dict[str, NDArray[Any]], rows: int) -> Table:
    """Returns packed rows of columns, whose second axis becomes `_0`, `_1`, ...."""
    flat: dict[str, NDArray[Any]] = {}
    for name, values in columns.items():
        if values.ndim == 1:
            flat[name] = values
        else:
            flat |= {f"{name}_{i}": values[:, i] for i in range(values.shape[1])}
    table: Table = np.empty(rows, [(name, values.dtype) for name, values in flat.items()])
    for name, values in flat.items():
        table[name] = values
    return table


def read_las(file: Path) -> tuple[str, Table]:
    """Reads a LAS or LAZ file: all dimensions of its points, also extra bytes."""
    packages = {"laspy": "laspy"} | ({"lazrs": "lazrs"} if file.suffix.lower() == ".laz" else {})
    need(packages, "LAS")
    import laspy

    with open_regular(file) as stream:
        reader = laspy.LasReader(stream, closefd=False)
        expected = reader.header.point_count
        las = reader.read()
        if len(las.points) != expected:
            raise Error(f"its header states {expected} points, but it has {len(las.points)}")
        columns: dict[str, NDArray[Any]] = {}
        for name in ("x", "y", "z", *las.point_format.dimension_names):
            if name not in ("X", "Y", "Z"):
                columns[name] = np.asarray(las[name])
    version = f"{las.header.version.major}.{las.header.version.minor}"
    form = f"LAS {version}, point format {las.point_format.id}"
    return form, _table_of(columns, len(las.points))


def _choose_topic(file: Any, wanted: str | None) -> str:
    summary = file.get_summary()
    if summary is None:
        rule = "it has no summary: it is cut short, or was written without one"
        raise Error(f"{rule}; `mcap recover` writes a copy that has one")
    if summary.statistics and set(summary.statistics.channel_message_counts) - set(
        summary.channels
    ):
        raise Error(
            "its summary does not list all channels; `mcap recover` writes a copy that does"
        )
    topics = {
        each.topic
        for each in summary.channels.values()
        if each.schema_id and summary.schemas[each.schema_id].name == _TYPE
    }
    names = ", ".join(sorted(topics)) or "none"
    if wanted is not None and wanted not in topics:
        raise Error(f"it has no points on the topic {wanted}; topics with points: {names}")
    if not topics:
        raise Error(f"it has no topic with points ({_TYPE})")
    if wanted is None and len(topics) > 1:
        rule = f"it has points on several topics: {names}"
        raise Error(f"{rule}; name one by the environment variable GROUNDRAY_TOPIC")
    return wanted or topics.pop()


def _dtype_of(message: Any) -> np.dtype[np.void]:
    """Returns the layout of a message's points."""
    order = ">" if message.is_bigendian else "<"
    names, formats, offsets = [], [], []
    for each in message.fields:
        kind = _NUMBERS.get(each.datatype)
        if kind is None or each.count < 1 or each.count > 64:
            rule = f"its field {each.name} has the type {each.datatype}, {each.count} times"
            raise Error(f"{rule}, which PointField does not define; is the message damaged?")
        for i in range(each.count):
            names.append(each.name if each.count == 1 else f"{each.name}_{i}")
            formats.append(order + kind)
            offsets.append(each.offset + i * np.dtype(kind).itemsize)
    try:
        return np.dtype(
            {"names": names, "formats": formats, "offsets": offsets, "itemsize": message.point_step}
        )
    except ValueError as fault:
        raise Error(f"the fields of its points do not fit: {fault}") from None


def _points_of(message: Any) -> Table:
    """Returns the points of a PointCloud2, row by row."""
    layout = _dtype_of(message)
    height, width, step = message.height, message.width, message.row_step
    if step < width * layout.itemsize or len(message.data) < height * step:
        rule = f"a message has {len(message.data)} bytes, but {height} rows of {step} bytes for"
        raise Error(f"{rule} {width} points of {layout.itemsize}; is it damaged?")
    rows = np.ndarray((height, width), layout, bytes(message.data), 0, (step, layout.itemsize))
    return rows.reshape(-1)


def _messages(file: Any, topic: str) -> Iterator[Any]:
    for _, channel, _, message in file.iter_decoded_messages(topics=[topic], log_time_order=True):
        if channel.topic == topic:
            yield message


def read_mcap(path: Path, wanted: str | None) -> tuple[str, Table]:
    """Reads all PointCloud2 of a topic; None if it must be the only one with points."""
    need({"mcap": "mcap", "mcap_ros2": "mcap-ros2-support"}, "MCAP")
    from mcap.reader import SeekingReader
    from mcap_ros2.decoder import DecoderFactory

    parts: list[Table] = []
    with open_regular(path) as stream:
        file = SeekingReader(
            stream,
            validate_crcs=True,
            decoder_factories=[DecoderFactory()],
            record_size_limit=2**31,
        )
        topic = _choose_topic(file, wanted)
        for message in _messages(file, topic):
            points = _points_of(message)
            columns = {name: points[name] for name in points.dtype.names or ()}
            if columns.keys() & {"message", "stamp_s"}:
                columns = {
                    f"field_{n}" if n in ("message", "stamp_s") else n: columns[n] for n in columns
                }
            stamp = message.header.stamp
            stamp_s = stamp.sec + 1e-9 * stamp.nanosec
            columns["message"] = np.full(len(points), len(parts), np.uint32)
            columns["stamp_s"] = np.full(len(points), stamp_s)
            parts.append(_table_of(columns, len(points)))
            if parts[-1].dtype.names != parts[0].dtype.names:
                raise Error(f"messages of the topic {topic} have different fields")
    if not parts:
        raise Error(f"the topic {topic} has no message")
    return f"MCAP, {len(parts)} messages of {topic}", np.concatenate(parts)


def read(file: Path, topic: str | None = None) -> tuple[str, Table]:
    """Returns the name of the format, and one structured row per point."""
    readers: dict[str, Callable[[], tuple[str, Table]]] = {
        ".las": lambda: read_las(file),
        ".laz": lambda: read_las(file),
        ".mcap": lambda: read_mcap(file, topic),
    }
    if file.suffix.lower() not in readers:
        raise Error("it is neither a LAS, LAZ nor an MCAP file")
    return readers[file.suffix.lower()]()


def _work(arguments: list[str]) -> str:
    if len(arguments) != 1:
        raise Error("usage: python -m groundray.foreign.cloud FILE")
    form, table = read(Path(arguments[0]), os.environ.get("GROUNDRAY_TOPIC") or None)
    for name in table.dtype.names or ():
        if not name.isascii() or not name.isprintable():
            raise Error(f"the name of its column {name!r} must be ASCII; rename it")
    printable = "".join(c if c.isprintable() else "?" for c in form)
    sys.stdout.write(f"{printable}\n")
    sys.stdout.flush()
    np.lib.format.write_array(sys.stdout.buffer, table, allow_pickle=False)
    return ""


if __name__ == "__main__":
    sys.exit(run(_work))
