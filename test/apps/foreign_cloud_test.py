"""LAS, LAZ and the points of MCAP files, which programs read through Python, against other readers.

`convert_cloud` writes what `read_cloud` returns, to the bit; viewer, `info` and `compare` use it.
"""

import os
import shutil
import struct
import subprocess
import sys
from pathlib import Path

import laspy
import numpy as np
import pytest
from dataset_runs import groundray
from export_runs import PACKAGE, ROOT, export, run_folder
from export_runs import scans as scans_of
from plyfile import PlyData, PlyElement

pytest.importorskip("mcap_ros2", reason="pip install -r test/requirements.txt")
from groundray import Error
from groundray.foreign import cloud
from mcap.writer import Writer

PROGRAMS = ROOT / "build/release/bin"
CONVERT = PROGRAMS / "convert_cloud"
VIEWER = PROGRAMS / "groundray-view"
SHARED = Path(os.environ.get("GROUNDRAY_SHARED_DATA", "/nowhere")) / "lidar"


def environment(**more):
    env = {name: value for name, value in os.environ.items() if name != "DISPLAY"}
    return {**env, "GROUNDRAY_PYTHON": sys.executable, "PYTHONPATH": str(PACKAGE), **more}


def run(*command, **more):
    return subprocess.run(
        [str(word) for word in command],
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
        env=environment(**more),
    )


def columns_of(file, folder, **more):
    """Returns the columns that read_cloud finds, through a PLY file."""
    result = run(CONVERT, file, folder / "columns.ply", **more)
    assert result.returncode == 0, result.stderr
    assert "unread" not in result.stdout
    table = PlyData.read(folder / "columns.ply")["vertex"].data
    offsets = dict(line.split()[1:] for line in result.stdout.splitlines())
    return table, offsets


def assert_equal(table, offsets, columns):
    """Both have the same columns with the same values."""
    assert set(table.dtype.names) == {name.replace(" ", "_") for name in columns}
    for name, values in columns.items():
        found = table[name.replace(" ", "_")]
        if name in offsets:
            np.testing.assert_array_equal(found + int(offsets[name]), values, err_msg=name)
        else:
            np.testing.assert_array_equal(found, np.asarray(values, found.dtype), err_msg=name)
            if found.dtype.itemsize >= values.dtype.itemsize:
                np.testing.assert_array_equal(found, values, err_msg=name)


def picture_of(file, folder, *options, **more):
    picture = folder / f"{file.name}.png"
    size = ["--size", "300x200", "--no-legend"]
    result = run(VIEWER, file, "--screenshot", picture, *size, *options, **more)
    assert result.returncode == 0, result.stderr
    return picture.read_bytes()


def assert_shown_like(table, file, folder, *options, **more):
    """The viewer draws the file as it draws a PLY file of these columns, which plyfile writes."""
    (folder / "peer").mkdir()
    peer = folder / "peer" / f"{file.stem}.ply"
    PlyData([PlyElement.describe(table, "vertex")]).write(str(peer))
    drawn = picture_of(file, folder, *options, **more)
    assert drawn == picture_of(peer, folder / "peer", *options)
    assert len(drawn) > 2000  # not the background alone


def las_columns(file):
    """Returns all dimensions as laspy reads them; x, y and z by the formula of the format."""
    read = laspy.read(file)
    columns = {name: np.asarray(read[name]) for name in read.point_format.dimension_names}
    for i, name in enumerate("XYZ"):
        whole = columns.pop(name)
        columns[name.lower()] = whole * read.header.scales[i] + read.header.offsets[i]
    return {
        f"{name}_{i}" if values.ndim > 1 else name: part
        for name, values in columns.items()
        for i, part in enumerate(values.T if values.ndim > 1 else [values])
    }


@pytest.mark.parametrize("form", ["las", "laz"])
def test_las_of_a_dataset_has_every_column_and_exact_coordinates(tmp_path, form):
    assert export(form, tmp_path / "out", "--lidar", "top") == 0
    file = tmp_path / f"out/top/000000.{form}"
    columns = las_columns(file)
    table, offsets = columns_of(file, tmp_path)
    assert_equal(table, offsets, columns)
    scan = PlyData.read(run_folder() / "lidar/top/000000.ply")["vertex"].data
    assert len(table) == len(scan) > 1000
    for name in ("ring", "return_index", "label", "intensity_own"):
        np.testing.assert_array_equal(table[name], scan[name.replace("_own", "")], err_msg=name)
    assert table["x"].dtype == np.float64
    # Numbers of UTM, in which a float is half a metre wide.
    assert 429_000 < table["x"].min() < table["x"].max() < 430_000
    assert 5_150_000 < table["y"].min() < table["y"].max() < 5_151_000
    peer = np.rec.fromarrays(
        [table[name] for name in ("x", "y", "z", "ring")], names=["x", "y", "z", "ring"]
    )
    assert_shown_like(peer, file, tmp_path, "--colour-by", "ring")


@pytest.mark.parametrize(
    "name",
    [
        "las_pdal/simple.las",
        "las_pdal/1.2-with-color.las",
        "las_pdal/4_6_crop.las",
        "als_coromandel/points.laz",
    ],
)
def test_surveys_of_others_are_read_as_by_laspy(tmp_path, name):
    file = SHARED / name
    if not file.is_file():
        pytest.skip("GROUNDRAY_SHARED_DATA has no such survey")
    columns = las_columns(file)
    table, offsets = columns_of(file, tmp_path)
    assert_equal(table, offsets, columns)
    lines = groundray("info", file, env=environment()).stdout.splitlines()
    assert lines[0].startswith("kind      points, LAS 1.")
    assert any(str(len(table)) in line for line in lines[1:3]), lines


def test_bags_of_a_dataset_have_the_points_of_its_scans(tmp_path):
    assert export("mcap", tmp_path / "out", "--lidar", "top", "--no-images") == 0
    (file,) = (tmp_path / "out").glob("*.mcap")
    stamps_s, scans = zip(*scans_of("top"), strict=True)
    table, _ = columns_of(file, tmp_path)
    joined = np.concatenate(scans)
    assert set(table.dtype.names) == {*joined.dtype.names, "message", "stamp_s"}
    for name in joined.dtype.names:
        np.testing.assert_array_equal(table[name], joined[name], err_msg=name)
    np.testing.assert_array_equal(
        table["message"], np.repeat([0, 1, 2], [len(scan) for scan in scans])
    )
    np.testing.assert_allclose(np.unique(table["stamp_s"]), 1 + np.array(stamps_s), atol=1e-9)
    names = ["x", "y", "z", "intensity"]
    peer = np.rec.fromarrays([joined[name] for name in names], names=names)
    assert_shown_like(peer, file, tmp_path, "--colour-by", "intensity")


def test_one_of_several_topics_is_chosen_by_name(tmp_path):
    assert export("mcap", tmp_path / "out", "--no-images") == 0
    (file,) = (tmp_path / "out").glob("*.mcap")
    result = run(CONVERT, file, tmp_path / "columns.ply")
    assert result.returncode == 1
    assert result.stderr == (
        f"{file}: it has points on several topics: /bare_16/points, /front/points, /top/points; "
        "name one by the environment variable GROUNDRAY_TOPIC\n"
    )
    table, _ = columns_of(file, tmp_path, GROUNDRAY_TOPIC="/front/points")
    scans = [PlyData.read(each) for each in sorted(run_folder().glob("lidar/front/00000?.ply"))]
    joined = np.concatenate([scan["vertex"].data for scan in scans])
    np.testing.assert_array_equal(table["x"], joined["x"])
    result = run(CONVERT, file, tmp_path / "columns.ply", GROUNDRAY_TOPIC="/back")
    assert "it has no points on the topic /back; topics with points: /bare_16" in result.stderr


HEADER = b"\0\1\0\0" + struct.pack("<iII", 5, 250_000_000, 2) + b"a\0\0\0"
DEFINITION = """\
std_msgs/Header header
uint32 height
uint32 width
PointField[] fields
bool is_bigendian
uint32 point_step
uint32 row_step
uint8[] data
bool is_dense
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: sensor_msgs/PointField
string name
uint32 offset
uint8 datatype
uint32 count
"""


def pad(data, to):
    return data + bytes(-(len(data) - 4) % to)  # CDR aligns to the end of its header of 4 bytes


def cloud_message(fields, points, *, height=1, big=False, row_gap=0, cut=0):
    """Encodes a PointCloud2 by the rules of CDR. fields: name, offset, datatype, count."""
    data = HEADER + struct.pack("<II", height, len(points) // height)
    data += struct.pack("<I", len(fields))
    for name, offset, datatype, count in fields:
        text = name.encode() + b"\0"
        data = pad(data, 4) + struct.pack("<I", len(text)) + text
        data = pad(data, 4) + struct.pack("<IB", offset, datatype)
        data = pad(data, 4) + struct.pack("<I", count)
    step = points.dtype.itemsize
    row = len(points) // height * step
    rows = b"".join(
        points.tobytes()[i * row : (i + 1) * row] + bytes(row_gap) for i in range(height)
    )
    rows = rows[: len(rows) - cut]
    data = pad(data + bytes([big]), 4) + struct.pack("<III", step, row + row_gap, len(rows))
    return data + rows + b"\1"


def write_bag(file, messages, topic="/points", kind="sensor_msgs/msg/PointCloud2"):
    with file.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2")
        schema = writer.register_schema(kind, "ros2msg", DEFINITION.encode())
        channel = writer.register_channel(topic, "cdr", schema)
        for i, message in enumerate(messages):
            writer.add_message(channel, i, message, i)
        writer.finish()
    return file


@pytest.mark.parametrize("big", [False, True])
def test_any_layout_of_a_point_cloud_is_read(tmp_path, big):
    """Padding within points and after rows, both byte orders, and fields of several numbers."""
    order = ">" if big else "<"
    layout = np.dtype(
        {
            "names": ["x", "y", "z", "ring", "rgb", "t"],
            "formats": [f"{order}{kind}" for kind in ("f4", "f4", "f4", "u2", "3u1", "f8")],
            "offsets": [0, 4, 8, 20, 23, 32],
            "itemsize": 48,
        }
    )
    points = np.zeros(6, layout)
    generator = np.random.default_rng(4)
    for name in ("x", "y", "z", "t"):
        points[name] = generator.normal(size=6)
    points["ring"] = np.arange(6) * 9000
    points["rgb"] = np.arange(18).reshape(6, 3)
    fields = [("x", 0, 7, 1), ("y", 4, 7, 1), ("z", 8, 7, 1), ("ring", 20, 4, 1)]
    fields += [("rgb", 23, 2, 3), ("t", 32, 8, 1)]
    message = cloud_message(fields, points, height=2, big=big, row_gap=16)
    file = write_bag(tmp_path / "drive.mcap", [message, message])
    table, _ = columns_of(file, tmp_path)
    for name in ("x", "y", "z", "ring", "t"):
        np.testing.assert_array_equal(table[name], np.tile(points[name], 2), err_msg=name)
    for i in range(3):
        np.testing.assert_array_equal(table[f"rgb_{i}"], np.tile(points["rgb"][:, i], 2))
    assert set(table["stamp_s"]) == {5.25}


XYZ = [("x", 0, 7, 1), ("y", 4, 7, 1), ("z", 8, 7, 1)]


@pytest.mark.parametrize(
    ("message", "rule"),
    [
        ({"fields": XYZ, "cut": 4}, "a message has 44 bytes, but 1 rows of 48 bytes"),
        ({"fields": [*XYZ, ("w", 8, 8, 1)]}, "the fields of its points do not fit"),
        ({"fields": [*XYZ, ("x", 0, 7, 1)]}, "the fields of its points do not fit"),
        ({"fields": [("x", 0, 9, 1)]}, "its field x has the type 9, 1 times"),
        ({"fields": [("x", 0, 7, 10**9)]}, "its field x has the type 7, 1000000000 times"),
    ],
)
def test_contradictory_messages_are_rejected(tmp_path, message, rule):
    points = np.zeros(4, [("x", "<f4"), ("y", "<f4"), ("z", "<f4")])
    file = write_bag(tmp_path / "drive.mcap", [cloud_message(points=points, **message)])
    result = run(CONVERT, file, tmp_path / "columns.ply")
    assert result.returncode == 1
    assert f"{file}: {rule}" in result.stderr
    assert result.stderr.count("\n") == 1


def test_files_without_points_are_rejected(tmp_path):
    file = write_bag(tmp_path / "text.mcap", [b"x"], kind="std_msgs/msg/String")
    with pytest.raises(Error, match=r"it has no topic with points \(sensor_msgs/msg/PointCloud2\)"):
        cloud.read(file)
    with pytest.raises(Error, match="the topic /points has no message"):
        cloud.read(write_bag(tmp_path / "empty.mcap", []))


@pytest.mark.parametrize("form", ["las", "laz", "mcap"])
def test_cut_files_and_missing_ones_are_one_message(tmp_path, form):
    assert export(form, tmp_path / "out", "--lidar", "top") == 0
    (whole, *_) = sorted((tmp_path / "out").rglob(f"*.{form}"))
    data = whole.read_bytes()
    file = tmp_path / f"cut.{form}"
    for size in (0, 3, 100, len(data) // 2):
        file.write_bytes(data[:size])
        result = run(VIEWER, file, "--screenshot", tmp_path / "out.png")
        assert result.returncode == 1, size
        assert result.stderr.startswith(f"groundray-view: {file}: ")
        assert result.stderr.count("\n") == 1, result.stderr
    if form == "las":  # cut between two points
        header = laspy.read(whole).header
        end = header.offset_to_point_data + 100 * header.point_format.size
        file.write_bytes(data[:end])
        result = run(CONVERT, file, tmp_path / "columns.ply")
        assert f"its header states {header.point_count} points, but it has 100" in result.stderr
    file.unlink()
    result = run(CONVERT, file, tmp_path / "columns.ply")
    assert "there is no such file" in result.stderr


def test_without_the_package_the_message_says_what_to_install(tmp_path):
    assert export("las", tmp_path / "out", "--lidar", "top") == 0
    file = shutil.copy(tmp_path / "out/top/000000.las", tmp_path / "-scan.las")
    result = run(VIEWER, file, "--screenshot", tmp_path / "out.png", GROUNDRAY_PYTHON="/no/python")
    assert result.returncode == 1
    assert "/no/python cannot be started (No such file or directory)" in result.stderr
    assert "pip install '.[export]'" in result.stderr
    assert not (tmp_path / "out.png").exists()
    picture_of(Path(file), tmp_path)  # a name that begins with a dash is only a name


def test_a_dem_from_las_equals_that_from_an_array_of_the_same_points(tmp_path):
    assert export("las", tmp_path / "out", "--lidar", "top") == 0
    file = tmp_path / "out/top/000000.las"
    columns = las_columns(file)
    np.save(tmp_path / "000000.npy", np.rec.fromarrays(list(columns.values()), names=[*columns]))
    for source, name in ((file, "las.tif"), (tmp_path / "000000.npy", "npy.tif")):
        options = ["--airborne", "--cell-m", 2, "--range-sd-m", 0.05, "--across-sd-m", 0.1]
        result = groundray(
            *("reconstruct", "dem", source, "-o", tmp_path / name, *options), env=environment()
        )
        assert result.returncode == 0, result.stderr
    assert (tmp_path / "las.tif").read_bytes() == (tmp_path / "npy.tif").read_bytes()
