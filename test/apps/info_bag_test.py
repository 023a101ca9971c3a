"""`groundray info` of ROS bags and MCAP files, as rosbags and mcap wrote them."""

import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from itertools import pairwise

import numpy as np
import pytest
from dataset_runs import PROGRAM, groundray
from export_runs import PACKAGE, export

pytest.importorskip("rosbags", reason="pip install -r test/requirements.txt")
from groundray.foreign import bag, module
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import Reader as Ros2Reader
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

BEGIN_NS = 1_750_000_000_123_456_789
STEP_NS = 250_000_001
COUNTS = {"/left/text": 7, "/right/text": 4, "/empty": 0}
LINES = [
    "messages  11 on 3 topics",
    "begins    1750000000.123456789 s, 2025-06-15 15:06:40 UTC",
    "duration  2.500000010 s",
]
TOPICS = [
    "topic     /empty: std_msgs/msg/String, 0 messages",
    "topic     /left/text: std_msgs/msg/String, 7 messages",
    "topic     /right/text: std_msgs/msg/String, 4 messages",
]
STRING = b"\0\1\0\0\5\0\0\0text\0"


def write_mcap(file, compression=CompressionType.ZSTD, topics=COUNTS):
    with file.open("wb") as stream:
        writer = McapWriter(stream, compression=compression)
        writer.start(profile="ros2")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        time_ns = BEGIN_NS
        for topic, count in topics.items():
            channel = writer.register_channel(topic, "cdr", schema)
            for _ in range(count):
                writer.add_message(channel, time_ns, STRING, time_ns)
                time_ns += STEP_NS
        writer.finish()
    return file


def write_rosbag(writer, version):
    types = get_typestore(Stores.ROS2_HUMBLE if version == 2 else Stores.ROS1_NOETIC)
    text = types.types["std_msgs/msg/String"](data="text")
    serialize = types.serialize_cdr if version == 2 else types.serialize_ros1
    data = bytes(serialize(text, "std_msgs/msg/String"))
    with writer:
        time_ns = BEGIN_NS
        for topic, count in COUNTS.items():
            connection = writer.add_connection(topic, "std_msgs/msg/String", typestore=types)
            for _ in range(count):
                writer.write(connection, time_ns, data)
                time_ns += STEP_NS


def environment(**more):
    return {**os.environ, "GROUNDRAY_PYTHON": sys.executable, "PYTHONPATH": str(PACKAGE), **more}


def described(file, **options):
    result = groundray("info", file, env=environment(), **options)
    assert result.returncode == 0, result.stderr
    assert not result.stderr
    return result.stdout.splitlines()


def refused(file, **options):
    """Returns the only line that is printed."""
    options = {"env": environment(), **options}
    result = groundray("info", file, **options)
    assert result.returncode == 1, result
    assert result.stdout == ""
    (line,) = result.stderr.splitlines()
    assert str(file) in line
    return line


@pytest.mark.parametrize("compression", list(CompressionType))
def test_an_mcap_file_is_described(tmp_path, compression):
    file = write_mcap(tmp_path / "drive.mcap", compression)
    assert described(file) == ["kind      MCAP, profile ros2", *LINES, *TOPICS]


def test_a_folder_of_ros_2_and_its_file_alone_are_described(tmp_path):
    write_rosbag(Ros2Writer(tmp_path / "drive"), 2)
    assert described(tmp_path / "drive") == ["kind      ROS 2 bag, sqlite3", *LINES, *TOPICS]
    (file,) = (tmp_path / "drive").glob("*.db3")
    assert described(file) == ["kind      ROS 2 bag, sqlite3", *LINES, *TOPICS]


@pytest.mark.parametrize("compression", [None, *Ros1Writer.CompressionFormat])
def test_a_bag_of_ros_1_is_described(tmp_path, compression):
    writer = Ros1Writer(tmp_path / "drive.bag")
    if compression:
        writer.set_compression(compression)
    write_rosbag(writer, 1)
    assert described(tmp_path / "drive.bag") == ["kind      ROS 1 bag", *LINES, *TOPICS]


def test_an_exported_bag_has_the_topics_that_rosbags_finds(tmp_path):
    assert export("mcap", tmp_path / "out") == 0
    with Ros2Reader(tmp_path / "out") as reader:
        topics = {each.topic: (each.msgtype, each.msgcount) for each in reader.connections}
        span_ns = reader.end_time - 1 - reader.start_time
        begin_ns, total = reader.start_time, reader.message_count
    lines = described(tmp_path / "out")
    assert lines[1] == f"messages  {total} on {len(topics)} topics"
    assert lines[2] == f"begins    {begin_ns // 10**9}.{begin_ns % 10**9:09} s"
    assert lines[3] == f"duration  {span_ns // 10**9}.{span_ns % 10**9:09} s"
    counted = {t: f"{k}, {n} message{'' if n == 1 else 's'}" for t, (k, n) in topics.items()}
    expected = [f"topic     {topic}: {text}" for topic, text in sorted(counted.items())]
    assert lines[4:] == expected
    (file,) = (tmp_path / "out").glob("*.mcap")
    assert described(file)[1:] == lines[1:]


@pytest.mark.parametrize(
    "name",
    [
        "-drive.mcap",
        "--help.mcap",
        "a b'c\"d$(touch gone)`e`;f.mcap",
        "öß\u4e2d.mcap",
        "\udcff.mcap",
    ],
)
def test_any_name_of_a_file_is_only_a_name(tmp_path, name):
    write_mcap(tmp_path / name)
    assert described(tmp_path / name)[-3:] == TOPICS
    assert described(f"./{name}", cwd=tmp_path)[-3:] == TOPICS
    if name.startswith("-"):
        result = groundray("info", "--", name, cwd=tmp_path, env=environment())
        assert result.stdout.splitlines()[-3:] == TOPICS, result.stderr
    assert [each.name for each in tmp_path.iterdir()] == [name]


def test_names_of_topics_cannot_control_the_terminal(tmp_path):
    write_mcap(tmp_path / "drive.mcap", topics={"/a\x1b[2J\nkind      b": 1})
    result = groundray("info", tmp_path / "drive.mcap", env=environment())
    assert "\x1b" not in result.stdout
    assert len(result.stdout.splitlines()) == 5
    assert "/a\\x1b[2J\\nkind      b: std_msgs" in result.stdout


def test_modules_in_the_current_folder_are_not_run(tmp_path):
    write_mcap(tmp_path / "drive.mcap")
    for name in ("groundray", "numpy", "mcap", "yaml", "json"):
        (tmp_path / f"{name}.py").write_text("open('run.txt', 'w').close()\n")
    assert described("drive.mcap", cwd=tmp_path)[-3:] == TOPICS
    assert not (tmp_path / "run.txt").exists()


def test_without_python_the_message_says_what_to_install(tmp_path):
    file = write_mcap(tmp_path / "drive.mcap")
    nowhere = {"PATH": str(tmp_path)}
    line = refused(file, env=nowhere)
    assert "python3 cannot be started (No such file or directory)" in line
    assert (
        "`pip install '.[export]'` in groundray's sources installs it; $GROUNDRAY_PYTHON names"
        in line
    )
    line = refused(file, env={**environment(), "GROUNDRAY_PYTHON": "/nowhere/python"})
    assert "/nowhere/python cannot be started" in line


def test_a_python_without_the_package_or_its_needs_is_named(tmp_path):
    file = write_mcap(tmp_path / "drive.mcap")
    line = refused(file, env=environment(PYTHONPATH=""))
    assert "groundray's Python package reads it, which " in line
    assert f"{sys.executable} does not have: `pip install '.[export]'`" in line
    bare = tmp_path / "python"
    bare.write_text(f'#!/bin/sh\nexec {sys.executable} -S "$@"\n')
    bare.chmod(0o755)
    line = refused(file, env=environment(GROUNDRAY_PYTHON=str(bare)))
    assert "ModuleNotFoundError: No module named " in line
    assert "pip install '.[export]'" in line
    # A Python that has everything but mcap.
    (tmp_path / "sitecustomize.py").write_text("import sys; sys.modules['mcap'] = None\n")
    line = refused(file, env=environment(PYTHONPATH=f"{PACKAGE}:{tmp_path}"))
    assert "MCAP needs mcap, which this Python lacks: pip install mcap" in line
    old = tmp_path / "old"
    old.write_text("#!/bin/sh\necho 'unknown option -P' >&2\nexit 2\n")
    old.chmod(0o755)
    line = refused(file, env=environment(GROUNDRAY_PYTHON=str(old)))
    assert "needs Python 3.11 or newer" in line
    assert "unknown option -P" in line


def test_a_crash_or_a_flood_of_the_interpreter_is_one_message(tmp_path):
    file = write_mcap(tmp_path / "drive.mcap")
    for name, text, words in (
        ("crash", "kill -SEGV $$", "was ended by signal 11 while it read the file"),
        ("flood", "exec cat /dev/zero", "what was read of it exceeds 64 MiB"),
        ("other", "echo x", "groundray.foreign.bag printed 'x': is it of another version?"),
    ):
        program = tmp_path / name
        program.write_text(f"#!/bin/sh\n{text}\n")
        program.chmod(0o755)
        assert words in refused(file, env=environment(GROUNDRAY_PYTHON=str(program)))


def make_all(folder):
    """Returns a bag of each kind."""
    write_rosbag(Ros2Writer(folder / "drive"), 2)
    write_rosbag(Ros1Writer(folder / "drive.bag"), 1)
    (db3,) = (folder / "drive").glob("*.db3")
    shutil.copy(db3, folder / "drive.db3")
    return [
        write_mcap(folder / "drive.mcap"),
        folder / "drive.bag",
        folder / "drive.db3",
    ]


def test_a_cut_bag_is_one_message(tmp_path):
    for file in make_all(tmp_path):
        whole = file.read_bytes()
        for size in (0, 5, 20, len(whole) // 2, len(whole) - 1):
            file.write_bytes(whole[:size])
            if file.suffix == ".db3" and size == len(whole) - 1:
                continue  # SQLite does not need the last byte
            refused(file)
        file.write_bytes(whole)
    line = refused(shutil.copy(tmp_path / "drive.bag", tmp_path / "not.mcap"))
    assert "it is not an MCAP file: it does not begin as one" in line


def test_a_folder_with_missing_or_cut_files_is_one_message(tmp_path):
    write_rosbag(Ros2Writer(tmp_path / "drive"), 2)
    folder = tmp_path / "drive"
    text = (folder / "metadata.yaml").read_text()
    (file,) = folder.glob("*.db3")
    with sqlite3.connect(file) as base:
        base.execute("DELETE FROM messages WHERE id = 3")
    base.close()
    assert "states 11 messages, but its files have 10: was" in refused(folder).replace(";", ":")
    file.rename(folder / "gone")
    assert "drive.db3: No such file or directory; was the bag copied completely?" in refused(folder)
    (folder / "gone").rename(file)
    (folder / "metadata.yaml").write_text(text[: len(text) // 3])
    refused(folder)
    (folder / "metadata.yaml").write_text("a: 1\n")
    assert "its metadata.yaml is not that of a ROS 2 bag" in refused(folder)
    bomb = "".join(f"{b}: &{b} [{', '.join([f'*{a}'] * 9)}]\n" for a, b in pairwise("abcdefghijkl"))
    (folder / "metadata.yaml").write_text(f"a: &a [1]\n{bomb}")  # 9^11 numbers if written out
    assert "its metadata.yaml is not that of a ROS 2 bag" in refused(folder)


def test_values_of_metadata_are_checked_before_they_are_printed(tmp_path):
    write_rosbag(Ros2Writer(tmp_path / "drive"), 2)
    file = tmp_path / "drive/metadata.yaml"
    text = file.read_text()
    assert "storage_identifier: sqlite3\n" in text
    forged = 'storage_identifier: "x\\nmessages  999 on 1 topic"\n'
    file.write_text(text.replace("storage_identifier: sqlite3\n", forged))
    lines = described(tmp_path / "drive")
    assert lines[0] == "kind      ROS 2 bag, x\\nmessages  999 on 1 topic"
    assert lines[1:] == LINES + TOPICS
    file.write_text(text.replace("storage_identifier: sqlite3\n", "storage_identifier: [1]\n"))
    assert "needs a storage_identifier that is a text" in refused(tmp_path / "drive")


def test_messages_that_the_file_or_its_summary_does_not_hold_are_not_forgotten(tmp_path):
    write_rosbag(Ros2Writer(tmp_path / "drive"), 2)
    (file,) = (tmp_path / "drive").glob("*.db3")
    log = file.with_name(file.name + "-wal")
    log.write_bytes(b"messages")
    assert "it has messages in a write-ahead log, drive.db3-wal" in refused(file)
    short = tmp_path / "short.mcap"
    with short.open("wb") as stream:
        writer = McapWriter(stream, repeat_channels=False, repeat_schemas=False)
        writer.start(profile="ros2")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        writer.add_message(writer.register_channel("/a", "cdr", schema), 1, STRING, 1)
        writer.finish()
    assert "its summary does not list all channels" in refused(short)


def test_an_interrupted_description_ends_with_its_module(tmp_path):
    """A module that never ends: SIGINT to `groundray` alone ends both."""
    folder = tmp_path / "package/groundray/foreign"
    folder.mkdir(parents=True)
    for each in (folder, folder.parent):
        (each / "__init__.py").touch()
    pid = tmp_path / "pid"
    (folder / "bag.py").write_text(
        f"import os, time\nopen({str(pid)!r}, 'w').write(str(os.getpid()))\ntime.sleep(300)\n"
    )
    command = [PROGRAM, "info", write_mcap(tmp_path / "drive.mcap")]
    run = subprocess.Popen(command, env=environment(PYTHONPATH=str(tmp_path / "package")))
    while not (pid.exists() and pid.read_text()):
        time.sleep(0.01)
    run.send_signal(signal.SIGINT)
    assert run.wait(timeout=60) == 130
    with pytest.raises(ProcessLookupError):
        os.kill(int(pid.read_text()), 0)


def test_a_lost_exit_code_is_no_success(tmp_path):
    file = write_mcap(tmp_path / "drive.mcap")
    file.write_bytes(file.read_bytes()[:-1])
    line = refused(file, preexec_fn=lambda: signal.signal(signal.SIGCHLD, signal.SIG_IGN))
    assert "is lost: is SIGCHLD ignored?" in line


def test_views_pipes_and_devices_are_rejected_without_waiting(tmp_path):
    """A view can compute for ever; a pipe may never be written to."""
    file = tmp_path / "drive.db3"
    with sqlite3.connect(file) as base:
        base.execute("CREATE TABLE topics(id INTEGER, name TEXT, type TEXT)")
        base.execute(
            "CREATE VIEW messages AS WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x FROM n) "
            "SELECT x AS topic_id, x AS timestamp FROM n"
        )
    base.close()
    assert "it has no table messages" in refused(file)
    os.mkfifo(tmp_path / "pipe.mcap")
    assert "it is a pipe or device, not a file" in refused(tmp_path / "pipe.mcap")


@pytest.mark.parametrize("kind", ["mcap", "bag", "db3"])
def test_damage_anywhere_yields_a_description_or_one_line(tmp_path, capsys, monkeypatch, kind):
    """In this process, since starting Python takes half a second. Seeded."""
    (file,) = (each for each in make_all(tmp_path) if each.suffix == f".{kind}")
    monkeypatch.setattr(module, "_limit_memory", lambda: None)
    monkeypatch.setattr(sys, "argv", ["bag", str(file)])
    for stream in (sys.stdout, sys.stderr):
        monkeypatch.setattr(stream, "reconfigure", lambda **_: None, raising=False)
    whole = np.frombuffer(file.read_bytes(), np.uint8)
    generator = random.Random(kind)
    codes = []
    for _ in range(300):
        data = whole.copy()
        for _ in range(generator.choice([1, 3, 20])):
            data[generator.randrange(len(data))] = generator.choice([0, 1, 0x7F, 0xFF])
        file.write_bytes(data.tobytes())
        codes.append(module.run(bag._work))
        printed = capsys.readouterr()
        assert printed.out.count("\n") >= 2 if codes[-1] == 0 else printed.out == ""
        assert printed.err.count("\n") == (0 if codes[-1] == 0 else 1), printed.err
    assert set(codes) == {module.DONE, module.FAILED}
