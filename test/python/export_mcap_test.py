"""Bags of ROS 2, read by rosbags with its own definitions of messages."""

import shutil

import cv2
import numpy as np
import OpenEXR
import pytest
import yaml
from export_bags import SHIFT_NS, TYPES, messages, of, points_of, stamp_ns, whole_bag
from export_runs import (
    dataset,
    export,
    mount,
    read_scan,
    run_folder,
    scans,
)
from rosbags.typesys import get_types_from_msg

# As the drivers' sources have them: name, offset, type of PointField; then the length of a point.
LAYOUTS = {
    "velodyne": (
        [
            ("x", 0, 7),
            ("y", 4, 7),
            ("z", 8, 7),
            ("intensity", 12, 7),
            ("ring", 16, 4),
            ("time", 18, 7),
        ],
        22,
    ),
    "ouster": (
        [
            *[("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 16, 7), ("t", 20, 6)],
            *[("reflectivity", 24, 4), ("ring", 26, 4), ("ambient", 28, 4), ("range", 32, 6)],
        ],
        48,
    ),
    "autoware": (
        [
            *[("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 12, 2), ("return_type", 13, 2)],
            *[("channel", 14, 4), ("azimuth", 16, 7), ("elevation", 20, 7), ("distance", 24, 7)],
            ("time_stamp", 28, 6),
        ],
        32,
    ),
}


@pytest.fixture(scope="module")
def bag():
    return whole_bag()[0]


@pytest.fixture(scope="module")
def everything():
    return whole_bag()[1]


def test_message_definitions_match_those_of_ros(bag):
    from mcap.reader import make_reader

    with next(bag.glob("*.mcap")).open("rb") as file:
        summary = make_reader(file).get_summary()
    assert len(summary.schemas) == 4
    assert summary.statistics.message_count == sum(1 for _ in messages(bag))
    for schema in summary.schemas.values():
        assert schema.encoding == "ros2msg"
        defined = get_types_from_msg(schema.data.decode(), schema.name)
        for name, fields in defined.items():
            assert fields == TYPES.FIELDDEFS[name], name


def test_messages_are_in_time_order_and_static_transforms_are_latched(bag, everything):
    times_ns = [time_ns for _, time_ns, _ in everything]
    assert times_ns == sorted(times_ns)
    assert everything[0][0] == "/tf_static"
    assert len(of(everything, "/tf_static")) == 1
    assert {topic for topic, *_ in everything} == {
        "/tf",
        "/tf_static",
        *(f"/{lidar}/points" for lidar in ("top", "front", "bare_16")),
        *(f"/{camera}/camera_info" for camera in ("left", "right", "eye")),
        *(f"/{camera}/depth/image_raw" for camera in ("left", "right", "eye")),
        *(f"/{camera}/image_raw" for camera in ("left", "right")),
    }
    record = yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    profiles = {
        each["topic_metadata"]["name"]: each["topic_metadata"]["offered_qos_profiles"]
        for each in record["topics_with_message_count"]
    }
    assert yaml.safe_load(profiles.pop("/tf_static"))[0]["durability"] == 1  # transient local
    assert set(profiles.values()) == {""}
    assert record["message_count"] == len(everything)
    assert record["starting_time"]["nanoseconds_since_epoch"] == times_ns[0]
    assert record["duration"]["nanoseconds"] == times_ns[-1] - times_ns[0]


@pytest.mark.parametrize("lidar", ["top", "front", "bare-16"])
def test_the_full_layout_contains_the_rows_of_the_scan(everything, lidar):
    topic = lidar.replace("-", "_")
    read = of(everything, f"/{topic}/points")
    for (time_ns, message), (begin_s, rows) in zip(read, scans(lidar), strict=True):
        assert stamp_ns(message) == time_ns == round(begin_s * 1e9) + SHIFT_NS
        assert message.header.frame_id == topic
        assert message.is_dense
        points = points_of(message)
        assert points.dtype.names == rows.dtype.names
        for name in rows.dtype.names:
            np.testing.assert_array_equal(points[name], rows[name])


@pytest.mark.parametrize("layout", LAYOUTS)
def test_driver_layouts_have_the_field_offsets_of_the_drivers(tmp_path, layout):
    assert (
        export("mcap", tmp_path / "out", "--points", layout, "--lidar", "top", "--no-images") == 0
    )
    fields, length = LAYOUTS[layout]
    read = of(list(messages(tmp_path / "out")), "/top/points")
    for (_, message), (_, rows) in zip(read, scans("top"), strict=True):
        assert [(each.name, each.offset, each.datatype) for each in message.fields] == fields
        assert message.point_step == length
        points = points_of(message)
        for axis in "xyz":
            np.testing.assert_array_equal(points[axis], rows[axis])
        in_bytes = np.clip(np.rint(rows["intensity"].astype(float) * 255), 0, 255)
        range_m = np.linalg.norm(np.stack([rows[axis] for axis in "xyz"]).astype(float), axis=0)
        if layout == "velodyne":
            np.testing.assert_array_equal(points["time"], rows["time"])
            np.testing.assert_array_equal(points["ring"], rows["ring"])
            np.testing.assert_allclose(points["intensity"], rows["intensity"] * 255.0, rtol=1e-6)
        elif layout == "ouster":
            np.testing.assert_allclose(points["t"], rows["time"].astype(float) * 1e9, atol=0.51)
            np.testing.assert_array_equal(points["ring"], rows["ring"])
            np.testing.assert_array_equal(points["reflectivity"], in_bytes)
            np.testing.assert_allclose(points["range"], range_m * 1e3, atol=0.501)
        else:
            np.testing.assert_allclose(
                points["time_stamp"], rows["time"].astype(float) * 1e9, atol=0.51
            )
            np.testing.assert_array_equal(points["channel"], rows["ring"])
            np.testing.assert_array_equal(points["intensity"], in_bytes)
            np.testing.assert_allclose(points["distance"], range_m, rtol=1e-6)
            level = points["distance"].astype(float) * np.cos(points["elevation"])
            np.testing.assert_allclose(level * np.cos(points["azimuth"]), rows["x"], atol=1e-4)
            np.testing.assert_allclose(level * np.sin(points["azimuth"]), rows["y"], atol=1e-4)
            np.testing.assert_array_equal(points["return_type"], expected_return_types(rows))


def expected_return_types(rows):
    """By pulse: 7 for one return; of two the first 3 or 5, the last 6 or 4, by strength."""
    types = np.zeros(len(rows), int)
    for i, row in enumerate(rows):
        if row["return_count"] == 1:
            types[i] = 7
        elif row["return_count"] == 2 and row["return_index"] == 1:
            assert rows[i + 1]["pulse"] == row["pulse"]
            is_stronger = row["amplitude"] >= rows[i + 1]["amplitude"]
            types[i : i + 2] = (3, 6) if is_stronger else (5, 4)
    return types


def test_images_match_the_pictures_and_depths_of_the_run(everything):
    for camera in ("left", "right"):
        infos = of(everything, f"/{camera}/camera_info")
        images = of(everything, f"/{camera}/image_raw")
        assert len(images) == len(infos) == 3
        for i, ((_, info), (_, image)) in enumerate(zip(infos, images, strict=True)):
            assert stamp_ns(image) == stamp_ns(info)
            assert image.header.frame_id == info.header.frame_id == f"{camera}_optical_frame"
            recorded = cv2.imread(str(run_folder() / f"camera/{camera}/{i:06}.png"))
            assert (image.encoding, image.step) == ("rgb8", 3 * 96)
            read = image.data.reshape(image.height, image.width, 3)
            np.testing.assert_array_equal(read[..., ::-1], recorded)
    for i, (_, image) in enumerate(of(everything, "/eye/depth/image_raw")):
        with OpenEXR.File(
            str(run_folder() / f"camera/eye/{i:06}.exr"), separate_channels=True
        ) as exr:
            expected = exr.channels()["Z"].pixels
        assert (image.encoding, image.is_bigendian) == ("32FC1", 0)
        read = np.frombuffer(image.data.tobytes(), "<f4").reshape(image.height, image.width)
        np.testing.assert_array_equal(read, expected)


@pytest.mark.parametrize(
    ("encoding", "shape", "kind"),
    [("mono8", (), "u1"), ("mono16", (), "<u2"), ("rgb16", (3,), "<u2")],
)
def test_pictures_of_any_encoding_keep_their_values(tmp_path, encoding, shape, kind):
    run = shutil.copytree(run_folder(), tmp_path / "run")
    random = np.random.default_rng(9)
    pictures = random.integers(0, 256 ** np.dtype(kind).itemsize, (3, 72, 96, *shape)).astype(kind)
    for i, picture in enumerate(pictures):
        file = run / f"camera/left/{i:06}.png"
        assert cv2.imwrite(str(file), picture[..., ::-1] if shape else picture)
        shutil.copy(file, run / f"camera/right/{i:06}.png")
    assert export("mcap", tmp_path / "out", "--camera", "left", source=run) == 0
    images = of(list(messages(tmp_path / "out")), "/left/image_raw")
    for picture, (_, image) in zip(pictures, images, strict=True):
        assert (image.encoding, image.is_bigendian) == (encoding, 0)
        read = np.frombuffer(image.data.tobytes(), kind).reshape(picture.shape)
        np.testing.assert_array_equal(read, picture)
    assert export("kitti", tmp_path / "kitti", "--lidar", "top", source=run) == 0
    folders = {each.name for each in (tmp_path / "kitti/sequences/00").glob("image_*")}
    assert folders == ({"image_2", "image_3"} if shape else {"image_0", "image_1"})


def test_camera_infos_match_the_rectified_pair(everything):
    for camera in ("left", "right"):
        file = run_folder() / f"calibration/{camera}.ros.yaml"
        expected = yaml.safe_load(file.read_text())
        for _, info in of(everything, f"/{camera}/camera_info"):
            assert (info.width, info.height) == (96, 72)
            np.testing.assert_array_equal(info.k, expected["camera_matrix"]["data"])
            np.testing.assert_array_equal(info.p, expected["projection_matrix"]["data"])
            np.testing.assert_array_equal(info.r, np.eye(3).ravel())
    baseline_m = -info.p[3] / info.p[0]
    X_LR = np.linalg.inv(mount("left", "X_BC")) @ mount("right", "X_BC")
    assert baseline_m == pytest.approx(X_LR[0, 3], rel=1e-9)


@pytest.mark.parametrize("compression", ["lz4", "none"])
def test_compression_and_shift_change_neither_points_nor_order(tmp_path, everything, compression):
    options = ["--compression", compression, "--shift-s", "1700000000.5"]
    assert export("mcap", tmp_path / "out", *options) == 0
    read = list(messages(tmp_path / "out"))
    again = [(topic, time_ns - 1_700_000_000_500_000_000) for topic, time_ns, _ in read]
    first = [
        (topic, time_ns - SHIFT_NS) for topic, time_ns, _ in everything if "depth" not in topic
    ]
    assert again == first
    for (_, one), (_, other) in zip(
        of(read, "/top/points"), of(everything, "/top/points"), strict=True
    ):
        np.testing.assert_array_equal(one.data, other.data)


def test_stamps_of_a_recorded_clock_keep_their_nanoseconds(tmp_path, capsys):
    run = shutil.copytree(run_folder(), tmp_path / "run")
    text = (run / "dataset.yaml").read_text()
    origin = "time_origin_s: 0.000000000\n"
    assert origin in text
    (run / "dataset.yaml").write_text(text.replace(origin, "time_origin_s: 1403636579.763555527\n"))
    assert export("mcap", tmp_path / "out", "--lidar", "front", source=run) == 0
    read = of(list(messages(tmp_path / "out")), "/front/points")
    for (time_ns, message), (begin_s, _) in zip(read, scans("front"), strict=True):
        assert time_ns == 1403636579_763555527 + round(begin_s * 1e9)
        assert stamp_ns(message) == time_ns
    assert export("las", tmp_path / "las", source=run) == 1  # no week has so many seconds
    assert "give --clock gps" in capsys.readouterr().err
    assert export("las", tmp_path / "las", "--clock", "unix", source=run) == 0
    assert export("tum", tmp_path / "tum", "--camera", "left", source=run) == 0
    names = sorted(each.stem for each in (tmp_path / "tum/depth").iterdir())
    infos = of(list(messages(tmp_path / "out")), "/left/camera_info")
    expected = [(each.header.stamp.sec, each.header.stamp.nanosec) for _, each in infos]
    assert names == [f"{sec}.{nanosec:09}" for sec, nanosec in expected]


def test_mcap_ros2_reads_the_bag(bag):
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    lidar = dataset().lidars[0]
    with next(bag.glob("*.mcap")).open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        read = [message for *_, message in reader.iter_decoded_messages(topics=["/top/points"])]
    for message, frame in zip(read, lidar.frames, strict=True):
        assert message.width == len(read_scan(dataset(), lidar, frame))


def test_a_lens_without_an_equivalent_in_ros_is_rejected(tmp_path, capsys):
    shutil.copytree(run_folder(), tmp_path / "run")
    (tmp_path / "run/calibration/eye.ros.yaml").unlink()
    calibration = tmp_path / "run/calibration/eye.yaml"
    text = calibration.read_text()
    begin = text.index("lens:")
    lens = "lens: {eucm: {focal_px: [24, 24], centre_px: [31, 30], alpha: 0.6, beta: 1.1}}"
    calibration.write_text(text[:begin] + lens + text[text.index("\n", begin) :])
    assert export("mcap", tmp_path / "out", source=tmp_path / "run") == 1
    reported = capsys.readouterr().err
    assert "camera eye has the lens eucm, unknown to CameraInfo" in reported
    assert "exclude it" in reported
    options = ["--camera", "left", "--camera", "right"]
    assert export("mcap", tmp_path / "out", *options, source=tmp_path / "run") == 0
