"""Contents of ROS bags and MCAP files: `python -m groundray.foreign.bag FILE`.

FILE is an .mcap, .db3 or .bag file, or the folder of a ROS 2 bag. Numbers of messages are those of
the files themselves, not of metadata.yaml.
"""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import quote

import yaml

from groundray.dataset import Error
from groundray.file_content import open_regular, read_text
from groundray.foreign.module import need, run

_MAGIC = b"\x89MCAP0\r\n"
_EPOCH_NS = 10**9 * 315_532_800  # earlier stamps, before 1980, are not those of a calendar


@dataclass
class Contents:
    """Messages of a bag: their numbers by topic and type, and the first and last time of log."""

    kind: str
    topics: Counter[tuple[str, str]] = field(default_factory=Counter)
    first_ns: int | None = None
    last_ns: int | None = None
    files: int = 1

    def add_times(self, first_ns: int, last_ns: int) -> None:
        """Extends the span of times."""
        self.first_ns = first_ns if self.first_ns is None else min(self.first_ns, first_ns)
        self.last_ns = last_ns if self.last_ns is None else max(self.last_ns, last_ns)

    def lines(self) -> Iterable[str]:
        """Yields the description, as of `groundray info`."""
        yield f"kind      {self.kind}"
        if self.files > 1:
            yield f"files     {self.files}"
        plural = "" if len(self.topics) == 1 else "s"
        yield f"messages  {self.topics.total()} on {len(self.topics)} topic{plural}"
        if self.first_ns is not None and self.last_ns is not None:
            yield f"begins    {_time_text(self.first_ns)}"
            yield f"duration  {_seconds_text(self.last_ns - self.first_ns)} s"
        for (topic, kind), count in sorted(self.topics.items()):
            messages = "1 message" if count == 1 else f"{count} messages"
            yield f"topic     {_one_line(topic)}: {_one_line(kind)}, {messages}"


def _one_line(text: str) -> str:
    """Returns a name without line ends and other characters that move the cursor."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def _seconds_text(time_ns: int) -> str:
    sign = "-" if time_ns < 0 else ""
    return f"{sign}{abs(time_ns) // 10**9}.{abs(time_ns) % 10**9:09}"


def _time_text(time_ns: int) -> str:
    text = f"{_seconds_text(time_ns)} s"
    if time_ns < _EPOCH_NS or time_ns >= 2**63:
        return text
    return f"{text}, {datetime.fromtimestamp(time_ns // 10**9, UTC):%Y-%m-%d %H:%M:%S} UTC"


def _read_mcap(file: Path, contents: Contents) -> str:
    """Adds the messages of an MCAP file; returns its profile."""
    need({"mcap": "mcap"}, "MCAP")
    from mcap.reader import SeekingReader

    with open_regular(file) as stream:
        if stream.read(len(_MAGIC)) != _MAGIC:
            raise Error("it is not an MCAP file: it does not begin as one")
        stream.seek(-len(_MAGIC), 2)
        if stream.read() != _MAGIC:
            rule = "it is cut short: it does not end as an MCAP file does"
            raise Error(f"{rule}; `mcap recover` restores what is there")
        stream.seek(0)
        reader = SeekingReader(stream, record_size_limit=2**30)
        summary = reader.get_summary()
        if summary is None or summary.statistics is None:
            rule = "it has no statistics, so that all of it would have to be read"
            raise Error(f"{rule}; `mcap recover` writes a copy that has them")
        if set(summary.statistics.channel_message_counts) - set(summary.channels):
            raise Error(
                "its summary does not list all channels; `mcap recover` writes a copy that does"
            )
        for number, channel in summary.channels.items():
            schema = summary.schemas.get(channel.schema_id)
            kind = schema.name if schema else f"without a type ({channel.message_encoding})"
            count = summary.statistics.channel_message_counts.get(number, 0)
            contents.topics[channel.topic, kind] += count
        if summary.statistics.message_count != (
            known := sum(summary.statistics.channel_message_counts.values())
        ):
            rule = f"its statistics contradict each other: {summary.statistics.message_count} and"
            raise Error(f"{rule} {known} messages; is it damaged?")
        if known:
            statistics = summary.statistics
            contents.add_times(statistics.message_start_time, statistics.message_end_time)
        return reader.get_header().profile


def _read_sqlite(file: Path, contents: Contents) -> None:
    """Adds the messages of a file of ROS 2's older storage."""
    import sqlite3

    with open_regular(file) as stream:
        if stream.read(16) != b"SQLite format 3\0":
            raise Error("it is not an SQLite file: it does not begin as one; is it compressed?")
    log = file.with_name(file.name + "-wal")
    if log.exists() and log.stat().st_size > 0:
        rule = f"it has messages in a write-ahead log, {log.name}"
        raise Error(f"{rule}; `sqlite3 {file.name} .tables` moves them into it")
    place = quote(os.fsencode(file.resolve()))
    base = sqlite3.connect(f"file:{place}?mode=ro&immutable=1", uri=True)
    try:
        made = dict(base.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table'"))
        for name in ("topics", "messages"):  # a view could compute for ever
            if not str(made.get(name, "")).upper().startswith("CREATE TABLE"):
                raise Error(f"it has no table {name}: is it a bag of ROS 2?")
        names = {
            number: (str(name), str(kind))
            for number, name, kind in base.execute("SELECT id, name, type FROM topics")
        }
        for topic in names.values():
            contents.topics[topic] += 0
        rows = base.execute(
            "SELECT topic_id, count(*), min(timestamp), max(timestamp) FROM messages GROUP BY 1"
        )
        for number, count, first_ns, last_ns in rows:
            if number not in names:
                raise Error(f"its messages have a topic {number}, which it does not list")
            contents.topics[names[number]] += count
            contents.add_times(int(first_ns), int(last_ns))
    finally:
        base.close()


def _read_ros_1(file: Path, contents: Contents) -> None:
    """Adds the messages of a bag of ROS 1."""
    need({"rosbags": "rosbags"}, "a ROS 1 bag")
    from rosbags.rosbag1 import Reader

    open_regular(file).close()
    with Reader(file) as bag:
        for topic, info in bag.topics.items():
            contents.topics[topic, str(info.msgtype)] += info.msgcount
        if bag.message_count:
            contents.add_times(bag.start_time, bag.end_time - 1)


def _read_folder(folder: Path) -> Contents:
    """Describes the bag of a folder with metadata.yaml."""
    text = read_text(folder / "metadata.yaml", "is this the folder of a ROS 2 bag?")
    try:
        record = yaml.safe_load(text)
    except yaml.YAMLError as fault:
        mark = getattr(fault, "problem_mark", None)
        place = f", line {mark.line + 1}" if mark else ""
        problem = getattr(fault, "problem", None) or "it is not YAML"
        raise Error(f"metadata.yaml{place}: {problem}; was the file cut short?") from None
    facts = record.get("rosbag2_bagfile_information") if isinstance(record, dict) else None
    if not isinstance(facts, dict):
        raise Error("its metadata.yaml is not that of a ROS 2 bag")
    names = facts.get("relative_file_paths")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise Error("its metadata.yaml lists no relative_file_paths; was it cut short?")
    storage, stated = facts.get("storage_identifier", "unknown"), facts.get("message_count")
    if not isinstance(storage, str) or not isinstance(stated, int):
        rule = "its metadata.yaml needs a storage_identifier that is a text"
        raise Error(f"{rule}, and a message_count that is a whole number")
    contents = Contents(f"ROS 2 bag, {_one_line(storage)}")
    contents.files = len(names)
    for name in names:
        file = folder / Path(name).name
        try:
            if file.suffix == ".mcap":
                _read_mcap(file, contents)
            elif file.suffix == ".db3":
                _read_sqlite(file, contents)
            else:
                rule = "is neither .mcap nor .db3; if it is compressed, decompress it by zstd first"
                raise Error(rule)
        except OSError as fault:
            raise Error(f"{file.name}: {fault.strerror}; was the bag copied completely?") from None
        except Error as fault:
            raise Error(f"{file.name}: {fault}") from None
    if stated != contents.topics.total():
        rule = f"its metadata.yaml states {stated} messages, but its files have"
        raise Error(f"{rule} {contents.topics.total()}; was the bag copied completely?")
    return contents


def contents_of(path: Path) -> Contents:
    """Describes a bag. Raises Error, or what a library raises, if it is damaged."""
    if path.is_dir():
        return _read_folder(path)
    contents = Contents("")
    match path.suffix.lower():
        case ".mcap":
            profile = _read_mcap(path, contents)
            contents.kind = f"MCAP, profile {_one_line(profile)}" if profile else "MCAP"
        case ".db3":
            contents.kind = "ROS 2 bag, sqlite3"
            _read_sqlite(path, contents)
        case ".bag":
            contents.kind = "ROS 1 bag"
            _read_ros_1(path, contents)
        case _:
            raise Error("it is not a bag: neither .mcap, .db3 nor .bag, nor a folder")
    return contents


def _work(arguments: list[str]) -> str:
    if len(arguments) != 1:
        raise Error("usage: python -m groundray.foreign.bag FILE")
    return "".join(f"{line}\n" for line in contents_of(Path(arguments[0])).lines())


if __name__ == "__main__":
    sys.exit(run(_work))
