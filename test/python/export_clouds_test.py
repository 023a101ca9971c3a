"""PCD, LAS, LAZ and NPZ files, read by Open3D, pypcd4, laspy with lazrs, and NumPy."""

import shutil
import struct
import subprocess

import numpy as np
import pytest
import yaml
from export_runs import PROGRAM, export, pose_between, poses_between, run_folder, scans, world_of

LIDARS = ["top", "front", "bare-16"]


def record():
    return yaml.safe_load((run_folder() / "dataset.yaml").read_text())


@pytest.fixture(scope="module")
def pcd(tmp_path_factory):
    out = tmp_path_factory.mktemp("pcd") / "out"
    assert export("pcd", out) == 0
    return out


@pytest.mark.parametrize("lidar", LIDARS)
def test_pypcd4_reads_every_column_of_a_pcd_file_exactly(pcd, lidar):
    pypcd4 = pytest.importorskip("pypcd4", reason="pip install -r test/requirements.txt")
    for i, (stamp_s, rows) in enumerate(scans(lidar)):
        read = pypcd4.PointCloud.from_path(pcd / lidar / f"{i:06}.pcd")
        assert read.fields == rows.dtype.names
        assert read.points == len(rows)
        for name in rows.dtype.names:
            column = read.pc_data[name]
            assert column.dtype == rows.dtype[name]
            assert column.tobytes() == np.ascontiguousarray(rows[name]).tobytes()
        view = read.metadata.viewpoint
        X = pose_between(lidar, stamp_s)
        np.testing.assert_allclose(view[:3], X[:3, 3], atol=1e-4)
        from scipy.spatial.transform import Rotation

        turned = Rotation.from_quat([*view[4:], view[3]]).as_matrix()
        np.testing.assert_allclose(turned, X[:3, :3], atol=1e-5)


def test_open3d_reads_points_of_a_pcd_file_in_the_requested_frame(pcd, tmp_path):
    o3d = pytest.importorskip("open3d", reason="pip install -r test/requirements.txt")
    options = ["--lidar", "bare-16", "--columns", "x,y,z,nx,ny,nz,label"]
    assert export("pcd", tmp_path / "world", *options, "--frame", "world") == 0
    assert export("pcd", tmp_path / "stamp", *options, "--frame", "stamp") == 0
    for i, (stamp_s, rows) in enumerate(scans("bare-16")):
        fired = np.asarray(o3d.io.read_point_cloud(str(pcd / f"bare-16/{i:06}.pcd")).points)
        np.testing.assert_array_equal(fired, np.stack([rows[a] for a in "xyz"], axis=-1))
        world = o3d.t.io.read_point_cloud(str(tmp_path / f"world/bare-16/{i:06}.pcd")).point
        # Floats of D: positions are within 500 m, where a float resolves 3e-5 m.
        np.testing.assert_allclose(world.positions.numpy(), world_of(rows), atol=1e-4)
        normals = np.stack([rows[f"n{axis}"] for axis in "xyz"], axis=-1)
        np.testing.assert_array_equal(world.normals.numpy(), normals)
        np.testing.assert_array_equal(world.label.numpy().ravel(), rows["label"])
        X = pose_between("bare-16", stamp_s)
        stamp = np.asarray(
            o3d.io.read_point_cloud(str(tmp_path / f"stamp/bare-16/{i:06}.pcd")).points
        )
        np.testing.assert_allclose(stamp @ X[:3, :3].T + X[:3, 3], world_of(rows), atol=3e-4)


def test_an_unknown_column_is_rejected(tmp_path, capsys):
    assert export("pcd", tmp_path / "out", "--columns", "x,y,z,colour") == 1
    assert "it has no column colour; it has x, y, z, intensity" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("lidar", LIDARS)
def test_npz_files_have_every_column_with_its_unit_and_the_pose(tmp_path, lidar):
    assert export("npz", tmp_path / "out", "--lidar", lidar) == 0
    units = {"x": "x_m", "time": "time_s", "incidence": "incidence_rad", "vx": "vx_m_s"}
    units |= {"range_true": "range_true_m", "ring": "ring", "intensity": "intensity", "nx": "nx"}
    units |= {"amplitude": "amplitude_w", "width": "width_s", "world_z": "world_z_m"}
    for i, (stamp_s, rows) in enumerate(scans(lidar)):
        with np.load(tmp_path / f"out/{lidar}/{i:06}.npz", allow_pickle=False) as read:
            assert len(read.files) == len(rows.dtype.names) + 4
            for name in set(units) & set(rows.dtype.names):
                column = read[units[name]]
                assert column.dtype == rows.dtype[name]
                np.testing.assert_array_equal(column, rows[name])
            assert read["stamp_ns"] == round(stamp_s * 1e9)
            np.testing.assert_allclose(read["X_DS"], pose_between(lidar, stamp_s), atol=1e-4)
            assert read["origin_w_m"].tolist() == record()["origin_w_m"]
            assert str(read["crs_wkt"]) == record()["crs_wkt"]


def test_the_viewer_shows_npz_files_where_it_shows_the_dataset(tmp_path):
    """Pictures from above, 6 cm a pixel, of a scan during which the lidar moved by 1.2 m."""
    cv2 = pytest.importorskip("cv2", reason="pip install -r test/requirements.txt")
    program = PROGRAM.with_name("groundray-view")
    if not program.exists():
        pytest.skip(f"{program} does not exist: build it first")
    assert export("npz", tmp_path / "out", "--lidar", "bare-16") == 0
    _, rows = next(iter(scans("bare-16")))
    centre_m = np.add(record()["origin_w_m"], np.median(world_of(rows), axis=0))
    eye_m = np.add(centre_m, [0, 0, 50])
    run, file = run_folder(), tmp_path / "out/bare-16/000000.npz"
    options = ["--look-from", ",".join(map(str, eye_m)), "--look-at", ",".join(map(str, centre_m))]
    options += ["--size", "600x600", "--no-legend", "--point-size", 3]
    options += ["--colour-by", "ring", "--range", "0,15"]
    pictures = []
    for inputs, hidden in (([run], ["lidar/top", "lidar/front"]), ([run, file], ["lidar"])):
        command = [program, *inputs, *options, "--screenshot", tmp_path / "view.png"]
        command += [f"--hide={each}" for each in (*hidden, "sensors", "path")]
        command = [*map(str, command)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
        assert done.returncode == 0, done.stderr
        pictures.append(cv2.imread(str(tmp_path / "view.png")).astype(int))
    of_dataset, of_file = pictures
    # The background depends on the row alone.
    points = np.abs(of_dataset - of_dataset[:, :1]).max(axis=-1) > 20
    assert points.sum() > 2000, points.sum()
    # A point between two pixels may be drawn at either.
    assert (np.abs(of_dataset - of_file).max(axis=-1) > 20).sum() < 0.01 * points.sum()


@pytest.fixture(scope="module")
def laz(tmp_path_factory):
    pytest.importorskip("laspy", reason="pip install -r test/requirements.txt")
    out = tmp_path_factory.mktemp("laz") / "out"
    assert export("laz", out) == 0
    return out


@pytest.mark.parametrize("lidar", LIDARS)
def test_laz_points_are_the_measured_points_in_the_crs(laz, lidar):
    """Slerp here and screws in the exporter differ by well below a millimetre."""
    import laspy

    for i, (stamp_s, rows) in enumerate(scans(lidar)):
        read = laspy.read(laz / lidar / f"{i:06}.laz")
        times_s = stamp_s + rows["time"] * (lidar != "front")  # front's points are of the stamp
        X = poses_between(lidar, np.clip(times_s, 0, 0.3))
        measured = np.stack([rows[axis] for axis in "xyz"], axis=-1).astype(float)
        expected = (X[0] @ measured[..., None])[..., 0] + X[1] + record()["origin_w_m"]
        known = times_s <= 0.3  # beyond its last line the path goes on
        np.testing.assert_allclose(read.xyz[known], expected[known], atol=3e-4)
        if lidar == "bare-16":  # which measures exactly
            expected = world_of(rows) + record()["origin_w_m"]
            np.testing.assert_allclose(read.xyz, expected, atol=1e-4 + 0.5e-4)


def test_laz_columns_match_the_scan(laz):
    import laspy

    for lidar in LIDARS:
        for i, (stamp_s, rows) in enumerate(scans(lidar)):
            read = laspy.read(laz / lidar / f"{i:06}.laz")
            names = {axis: f"sensor_{axis}" for axis in "xyz"} | {"intensity": "intensity_own"}
            for name in rows.dtype.names:
                column = np.asarray(read[names.get(name, name)])
                assert column.dtype == rows.dtype[name]
                np.testing.assert_array_equal(column, rows[name])
            np.testing.assert_array_equal(read.return_number, rows["return_index"])
            np.testing.assert_array_equal(read.number_of_returns, rows["return_count"])
            scaled = np.clip(np.rint(rows["intensity"].astype(float) * 65535), 0, 65535)
            np.testing.assert_array_equal(read.intensity, scaled)
            np.testing.assert_allclose(
                read.gps_time, stamp_s + rows["time"].astype(float), atol=1e-9
            )
        about = {each.name: each.description for each in read.point_format.extra_dimensions}
        assert about["range_true"] == "m; truth: from beam to surface"
    assert len(about) == len(rows.dtype.names)


def test_laz_files_have_version_1_4_and_the_crs(laz):
    import laspy

    pyproj = pytest.importorskip("pyproj", reason="pip install -r test/requirements.txt")
    file = laz / "top/000000.laz"
    read = laspy.read(file)
    text = read.header.vlrs.get("WktCoordinateSystemVlr")[0].string
    assert text.startswith("PROJCS[")  # WKT 1, which LAS 1.4 requires
    assert pyproj.CRS.from_wkt(text).to_epsg() == 26915
    assert read.header.parse_crs().to_epsg() == 26915
    # Bytes of the header by the specification: version, WKT bit, point format, scales, offsets.
    data = file.read_bytes()
    assert data[:4] == b"LASF"
    assert data[24:26] == bytes([1, 4])
    assert struct.unpack_from("<H", data, 6)[0] & 0b10001 == 0b10000
    assert data[104] & 0x3F == 6
    assert struct.unpack_from("<6d", data, 131) == (1e-4, 1e-4, 1e-4, *record()["origin_w_m"])


def test_a_dataset_without_a_crs_is_exported_without_one(tmp_path, capsys):
    import laspy

    run = shutil.copytree(run_folder(), tmp_path / "run")
    record = yaml.safe_load((run / "dataset.yaml").read_text())
    record |= {"crs": "", "crs_wkt": ""}
    (run / "dataset.yaml").write_text(yaml.safe_dump(record))
    assert export("las", tmp_path / "out", "--lidar", "front", source=run) == 0
    assert "note: the dataset has no CRS" in capsys.readouterr().out
    read = laspy.read(tmp_path / "out/front/000000.las")
    assert not read.header.vlrs.get("WktCoordinateSystemVlr")
    assert read.header.parse_crs() is None
    record["crs_wkt"] = "PROJCS[nonsense"
    (run / "dataset.yaml").write_text(yaml.safe_dump(record))
    assert export("las", tmp_path / "bad", "--lidar", "front", source=run) == 1
    assert "crs_wkt is not a CRS" in capsys.readouterr().err


def test_las_files_of_the_truth_are_correct_merged_or_not(tmp_path):
    import laspy

    (tmp_path / "map.yaml").write_text("labels: {40: 2, 72: 3}\nothers: 1\n")
    options = ["--place", "truth", "--labels", str(tmp_path / "map.yaml"), "--lidar", "top"]
    assert export("las", tmp_path / "each", *options) == 0
    assert export("las", tmp_path / "one", *options, "--merge") == 0
    merged = laspy.read(tmp_path / "one/top.las")
    begin = 0
    for i, (_, rows) in enumerate(scans("top")):
        read = laspy.read(tmp_path / f"each/top/{i:06}.las")
        expected = world_of(rows) + record()["origin_w_m"]
        np.testing.assert_allclose(read.xyz, expected, atol=0.5e-4 + 1e-9)
        classes = np.select([rows["label"] == 40, rows["label"] == 72], [2, 3], 1)
        np.testing.assert_array_equal(read.classification, classes)
        part = slice(begin, begin + len(rows))
        np.testing.assert_array_equal(merged.xyz[part], read.xyz)
        np.testing.assert_array_equal(merged.instance[part], rows["instance"])
        begin += len(rows)
    assert len(merged.points) == begin
    np.testing.assert_allclose(merged.header.maxs, merged.xyz.max(axis=0), atol=1e-9)
    np.testing.assert_allclose(merged.header.mins, merged.xyz.min(axis=0), atol=1e-9)


def test_las_times_follow_the_clock_of_the_dataset():
    """The GPS day of the 1st of January 2020, when GPS was 18 s ahead of UTC."""
    import dataclasses

    from export_runs import dataset, read_scan
    from groundray.export.las import LasOptions, _Form
    from groundray.export.notes import Notes
    from groundray.export.scan import FullScale
    from groundray.export.sensor_path import SensorPath

    data = dataset()
    lidar = data.lidars[0]
    scan = read_scan(data, lidar, lidar.frames[0])
    data.time_origin_ns = 1_577_836_800 * 10**9 + 250_000_000
    path = SensorPath(data.path_file(lidar))
    options = LasOptions("las", False, "measured", "unix", FullScale(None), None)
    gps_s = (
        1_261_872_018.25  # of that Unix time: 7300 days of 86400 s, 5 leap days, 18 leap seconds
    )
    for clock, origin_ns in (("unix", data.time_origin_ns), ("gps", round(gps_s * 1e9))):
        data.time_origin_ns = origin_ns
        form = _Form(data, [path], dataclasses.replace(options, clock=clock))
        header = form.header(scan, 0)
        assert header.global_encoding.gps_time_type == 1
        record = form.points(scan, path, header, Notes())
        expected_s = gps_s - 1e9 + scan.rows["time"].astype(float)
        np.testing.assert_allclose(record.gps_time, expected_s, atol=1e-6)
