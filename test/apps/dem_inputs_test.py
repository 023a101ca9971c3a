"""Inputs of `groundray reconstruct dem`, and errors in them.

A dataset with a lidar and a stereo pair is damaged in one place at a time: each fault causes one
message that names the place, and no new file.
"""

import os
import re
import shutil
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest
from dem_runs import (
    CAMERA,
    LAYERS,
    PAIR,
    PRAIRIE,
    PROGRAM,
    groundray,
    made,
    points_file,
    refused,
    same_bytes_on_any_threads,
)

SCENE = """\
groundray: 1
seed: 5
duration_s: 0.3
terrain:
  dem: {prairie}
  material: dry_soil
  texture: {{albedo: gravel.png, size_m: 8}}
sky:
  analytic: {{}}
  sun: {{azimuth_deg: 130, elevation_deg: 40}}
platform:
  drive:
    waypoints_m: [[429440, 5150660], [429460, 5150668]]
    speed_m_s: 5
    height_m: 0.5
lidars:
  - name: top
    preset: velodyne_vlp16
    mount: {{translation_m: [0, 0, 1.8]}}
    range_noise_sigma_m: 0.02
"""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recorded")
    grains = cv2.GaussianBlur(np.random.default_rng(1).normal(0, 1, (1024, 1024)), (0, 0), 2)
    gravel = np.clip(128 + 45 * grains / grains.std(), 0, 255)
    cv2.imwrite(str(folder / "gravel.png"), gravel.astype(np.uint8))
    camera = CAMERA.format(rate_hz=5, first_ms=100, products="radiance, picture")
    (folder / "camera.yaml").write_text(camera)
    (folder / "scene.yaml").write_text(SCENE.format(prairie=PRAIRIE) + PAIR)
    result = groundray("generate", folder / "scene.yaml", "-o", folder / "data")
    assert result.returncode == 0, result.stderr
    return folder / "data"


@pytest.fixture
def data(recorded, tmp_path):
    """A copy that tests may modify."""
    return Path(shutil.copytree(recorded, tmp_path / "data"))


def changed(path, pattern, by):
    text, count = re.subn(pattern, by, path.read_text(), flags=re.MULTILINE)
    assert count > 0
    path.write_text(text)


def without_lidar(data):
    changed(data / "dataset.yaml", r"^.*(kind: lidar|sensor: top).*\n", "")
    shutil.rmtree(data / "lidar")
    (data / "poses/top.tum").unlink()
    (data / "calibration/top.yaml").unlink()


def bands(path, folder):
    raw = folder / "bands.raw"
    command = ["gdal_translate", "-q", "-of", "ENVI", "-ot", "Float32", "-co", "INTERLEAVE=BSQ"]
    subprocess.run([*command, path, raw], check=True)
    return np.fromfile(raw, "<f4").reshape(len(LAYERS), -1)


def test_stereo_pairs_alone_make_a_dem(recorded, data, tmp_path):
    """The bytes are equal for datasets with and without a lidar."""
    alone = ["--cell-m", "0.5", "-o", tmp_path / "alone.tif", "--no-lidar"]
    assert "pair/000000" in made(recorded, *alone)
    named = ["--cell-m", "0.5", "-o", tmp_path / "named.tif", "--no-lidar", "--stereo", "pair"]
    made(recorded, *named)
    layers = bands(tmp_path / "alone.tif", tmp_path)
    assert layers[2].max() == 0  # n_lidar
    assert set(np.unique(layers[6])) <= {0, 2, 4}  # source
    assert np.count_nonzero(layers[6] == 2) > 20
    assert np.all(np.isnan(layers[9]))  # upper_bound: no beam is known
    without_lidar(data)
    made(data, "--cell-m", "0.5", "-o", tmp_path / "none.tif")
    whole = (tmp_path / "alone.tif").read_bytes()
    assert whole == (tmp_path / "none.tif").read_bytes()
    assert whole == (tmp_path / "named.tif").read_bytes()


def test_bytes_of_stereo_and_smoothed_dems_do_not_depend_on_threads(recorded, tmp_path):
    options = ["--cell-m", "0.25", "--smooth", "--reach", "hull"]
    assert same_bytes_on_any_threads(tmp_path, recorded, *options)
    layers = bands(tmp_path / "one.tif", tmp_path)
    assert {1, 2, 3, 4} <= set(np.unique(layers[6]))  # source: all kinds are in it


def test_inputs_without_measurements_are_reported(data, tmp_path):
    out = ["--cell-m", "1", "-o", tmp_path / "dem.tif"]
    refused(tmp_path, data, *out, "--no-lidar", "--no-stereo", words=["exclude all measurements"])
    refused(tmp_path, data, *out, "--no-lidar", "--sensor", "top", words=["--sensor"])
    late = ["--no-lidar", "--stereo-frames", "9:"]
    refused(tmp_path, data, *out, *late, words=["no simultaneous images", "(--stereo-frames)"])
    words = ["--stereo-frames: 'x' must be"]
    refused(tmp_path, data, *out, "--stereo-frames", "x", words=words)
    refused(tmp_path, data, *out, "--frames", "9:", words=["no scan among", "--no-lidar"])
    without_lidar(data)
    refused(tmp_path, data, *out, "--no-stereo", words=["dataset.yaml", "has no lidar"])
    changed(data / "dataset.yaml", r"^.*kind: stereo.*\n", "")
    refused(tmp_path, data, *out, words=["a stereo pair is needed", "--stereo LEFT,RIGHT"])
    assert "left,right/000000" in made(data, *out, "--stereo", "left,right")


def cut(path):
    os.truncate(path, path.stat().st_size // 2)


def other_size(path):
    cv2.imwrite(str(path), np.zeros((48, 64), np.uint8))


def last_pose_late(path):
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join([*lines[:4], "40" + lines[-1][lines[-1].index(" ") :]]))


def first_poses(path):
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:4]))


def gap_in_a_scan(path):
    """Poses up to 0.03 s, then at 3 s: stamps of scans are covered, across a gap."""
    lines = path.read_text().splitlines(keepends=True)
    kept = [line for line in lines if line.startswith("#") or float(line.split()[0]) <= 0.03]
    path.write_text("".join([*kept, "3" + lines[-1][lines[-1].index(" ") :]]))


def frames_lost(path):
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[: lines.index("files:\n") - 2]))


@pytest.mark.parametrize(
    ("file", "fault", "words"),
    [
        (
            "camera/left/000000.png",
            Path.unlink,
            ["left/000000.exr", "this one is radiance", "was one removed"],
        ),
        ("camera/left/000000.png", cut, ["left/000000.png", "truncated"]),
        ("camera/right/000000.png", other_size, ["right/000000.png", "64 x 48", "640 x 480"]),
        ("poses/left.tum", last_pose_late, ["poses/left.tum", "have a gap", "--pose-gap-s"]),
        ("poses/top.tum", last_pose_late, ["top/00000", "have a gap", "--pose-gap-s"]),
        ("poses/top.tum", gap_in_a_scan, ["top/000000", "have a gap", "--pose-gap-s"]),
        ("poses/right.tum", first_poses, ["poses/right.tum", "covers 0 to", "truncated?"]),
        ("lidar/top/000000.ply", cut, ["top/000000.ply", "truncated?"]),
        ("dataset.yaml", frames_lost, ["dataset.yaml:", "'frames'", "are listed", "truncated?"]),
        ("calibration/left.yaml", Path.unlink, ["left.yaml", "no such file"]),
    ],
)
def test_errors_in_a_dataset_name_their_file(data, tmp_path, file, fault, words):
    fault(data / file)
    refused(tmp_path, data, "--cell-m", "1", "-o", tmp_path / "dem.tif", words=words)


def test_missing_images_and_keys_are_reported(data, tmp_path):
    out = ["--cell-m", "1", "-o", tmp_path / "dem.tif"]
    for name in ("left", "right"):
        (data / f"camera/{name}/000000.png").unlink()
    assert "pair/000000" in made(data, *out)  # of light
    (tmp_path / "dem.tif").unlink()
    shutil.rmtree(data / "camera/left")
    refused(tmp_path, data, *out, words=["left/000000.png", "was it removed", "--no-stereo"])
    changed(data / "dataset.yaml", r"^crs_wkt: .*$", "crs_wkt: nonsense")
    only = [*out, "--no-stereo"]
    refused(tmp_path, data, *only, words=["the CRS 'nonsense'", "crs_wkt"])
    changed(data / "dataset.yaml", r"^origin_w_m: .*$", "")
    refused(tmp_path, data, *only, words=["dataset.yaml:", "key 'origin_w_m': missing"])


def test_invalid_areas_are_reported(recorded, tmp_path):
    out = ["--no-stereo", "-o", tmp_path / "dem.tif"]
    box = ["--area", "429450", "5150650", "429400", "5150700"]
    refused(tmp_path, recorded, *out, "--cell-m", "1", *box, words=["--area: 429450", "W < E"])
    far = ["--area", "0", "0", "9", "9"]
    refused(tmp_path, recorded, *out, "--cell-m", "1", *far, words=["outside", "--area"])
    refused(tmp_path, recorded, *out, "--cell-m", "1e-4", words=["samples", "larger cells"])


def test_a_dataset_is_not_overwritten(data, tmp_path):
    out = ["--cell-m", "1", "-o", tmp_path / "dem.tif"]
    for option, file in (("--report", "dataset.yaml"), ("--picture", "camera/left/000000.png")):
        refused(tmp_path, data, *out, option, data / file, words=[file, "another name"])


def test_a_full_disk_leaves_no_dem_and_the_error_names_the_file(recorded, tmp_path):
    """A limit on file sizes, as set by `ulimit -f`, simulates it."""
    limit = ["bash", "-c", 'ulimit -f 8; exec "$@"', "bash", PROGRAM, "reconstruct", "dem"]
    command = [*limit, recorded, "--no-stereo", "--cell-m", "0.25", "-o", tmp_path / "dem.tif"]
    result = subprocess.run([*map(str, command)], capture_output=True, text=True, timeout=300)
    assert result.returncode == 1, result
    assert f"{tmp_path}/dem.tif: cannot be written" in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_scans_without_noise_are_reported(data, tmp_path):
    changed(data / "calibration/top.yaml", r"^range_noise_sigma_m: .*$", "range_noise_sigma_m: 0")
    for path in sorted((data / "lidar/top").glob("*[0-9].ply")):
        path.write_bytes(path.read_bytes().replace(b"float range_sd\n", b"float other_no\n", 1))
    out = ["--no-stereo", "--cell-m", "1", "-o", tmp_path / "dem.tif"]
    assert "have no standard deviation of range" in made(data, *out)
    assert "have no standard deviation" not in made(data, *out, "--range-sd-m", "0.02")


@pytest.mark.parametrize("vertical", [5703, 6360])  # NAVD88, in metres and in US feet
def test_a_vertical_datum_is_kept(tmp_path, vertical):
    dem, made_of = tmp_path / "dem.tif", tmp_path / "filled.tif"
    system = f"EPSG:26915+{vertical}"
    subprocess.run(["gdal_translate", "-q", "-a_srs", system, PRAIRIE, dem], check=True)
    result = groundray("terrain", "fill", dem, "-o", made_of)
    assert result.returncode == 0, result.stderr
    info = subprocess.run(["gdalinfo", made_of], check=True, capture_output=True, text=True).stdout
    assert 'COMPOUNDCRS["NAD83 / UTM zone 15N' in info
    assert 'VDATUM["North American Vertical Datum 1988"' in info
    vertical_part = info[info.index("VERTCRS") : info.index("Data axis")]
    assert "foot" not in vertical_part
    assert "Unit Type: met" in info or "Unit Type: m\n" in info


def test_files_are_cloud_optimised(recorded, tmp_path):
    """Checked by GDAL."""
    check = ["/usr/bin/python3", "-m", "osgeo_utils.samples.validate_cloud_optimized_geotiff"]
    probe = subprocess.run([*check, PRAIRIE], capture_output=True, text=True)
    if "No module" in probe.stderr or not Path(check[0]).exists():
        pytest.skip("GDAL's Python samples are not there: apt-get install python3-gdal")
    error = ["--truth", PRAIRIE, "--error-map", tmp_path / "error.tif"]
    made(recorded, "--no-stereo", "--cell-m", "0.2", "-o", tmp_path / "dem.tif", *error)
    for name in ("dem.tif", "error.tif"):
        said = subprocess.run([*check, tmp_path / name], capture_output=True, text=True)
        assert "is a valid cloud optimized GeoTIFF" in said.stdout, said


def survey(path, rows=3000, **more):
    """Level ground in map coordinates, without poses, 0.2 m too high, with a hole in the middle."""
    random = np.random.default_rng(8)
    columns = {name: random.uniform(0, 30, rows) for name in "xy"}
    columns["z"] = 240.2 + random.normal(0, 0.01, rows)
    columns |= more
    table = np.rec.fromarrays(list(columns.values()), names=list(columns))
    table = table[np.hypot(table.x - 15, table.y - 15) > 4]
    table.x += 600_000
    table.y += 5_000_000
    np.save(path, np.array(table.tolist(), dtype=table.dtype.descr))
    return path


def test_filled_heights_include_the_common_error(tmp_path):
    """Measured heights have a common error of 0.2 m, so filled ones cannot be better."""
    points = survey(tmp_path / "points.npy", 12000)
    noise = ["--airborne", "--range-sd-m", "0.01", "--position-sd-m", "0.2"]
    made(points, *noise, "--cell-m", "1", "-o", tmp_path / "dem.tif")
    layers = bands(tmp_path / "dem.tif", tmp_path)
    filled = layers[6] == 4
    assert np.count_nonzero(filled) > 30
    assert np.median(layers[8][filled]) == pytest.approx(0.2, rel=0.1)
    # All of them are off by one standard deviation, to what the ground's noise adds.
    z = (layers[0][filled] - 240) / layers[8][filled]
    assert 0.8 < np.sqrt(np.mean(z**2)) < 1.1


def test_sparse_points_are_reported(tmp_path):
    """One point in nine cells, no more than an outlier in fifty: none is known to be of the ground,
    unless there are no outliers."""
    cells = np.stack(np.meshgrid(np.arange(0, 90, 3), np.arange(0, 90, 3)), axis=-1).reshape(-1, 2)
    crowd = np.random.default_rng(2).uniform(0, 3, (300, 2))
    points = points_file(
        tmp_path / "sparse.npy",
        np.column_stack([np.concatenate([cells + 0.5, crowd]), np.full(1200, 7.0)]),
    )
    out = ["--airborne", "--cell-m", "1", "--range-sd-m", "0.01", "-o", tmp_path / "dem.tif"]
    said = made(points, *out)
    assert "cells with points have too few" in said
    assert "--outlier-share" in said
    assert "have too few" not in made(points, *out, "--outlier-share", "0")


def test_map_coordinates_require_poses_or_airborne(tmp_path):
    points = survey(tmp_path / "points.npy")
    out = ["--cell-m", "1", "-o", tmp_path / "dem.tif"]
    words = ["points.npy", "km from the sensor", "--airborne", "--poses"]
    refused(tmp_path, points, *out, words=words)
    assert "sensor's frame" not in made(points, *out, "--airborne")


def test_returns_are_selected(tmp_path):
    """First returns are leaves 3 m above the ground; last returns are ground."""
    rows = 3000
    pulse = np.arange(rows) // 2
    index = 1 + np.arange(rows) % 2
    points = survey(tmp_path / "points.npy", rows, pulse=pulse, return_index=index)
    table = np.load(points)
    table["z"] += np.where(table["return_index"] == 1, 3, 0)
    np.save(points, table)
    for choice, height in (("first", 243.2), ("last", 240.2)):
        out = tmp_path / f"{choice}.tif"
        made(points, "--airborne", "--cell-m", "2", "--returns", choice, "-o", out, "--no-fill")
        layers = bands(out, tmp_path)
        assert np.nanmedian(layers[0]) == pytest.approx(height, abs=0.02), choice


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--no-stereo", "--match-sd-px", "1"], ["--match-sd-px", "--no-stereo"]),
        (["--no-stereo", "--stereo-frames", "0"], ["--stereo-frames", "--no-stereo"]),
        (["--airborne", "--sight", "beams"], ["--sight", "--airborne"]),
        (["--airborne", "--divergence-mrad", "3"], ["--divergence-mrad", "--airborne"]),
        (["--no-fill", "--reach", "hull"], ["--reach", "--no-fill"]),
        (["--method", "cgal", "--sight-margin-m", "1"], ["--sight-margin-m", "--method cgal"]),
        (["--most-edges", "9"], ["--most-edges", "--method cgal"]),
        (["--no-fill", "--method", "cgal", "--most-edges", "9"], ["--method", "--no-fill"]),
    ],
)
def test_options_without_effect_are_rejected(recorded, tmp_path, options, words):
    refused(tmp_path, recorded, "--cell-m", "1", "-o", tmp_path / "dem.tif", *options, words=words)


def test_options_of_noise_and_filling_have_their_documented_effect(recorded, tmp_path):
    def layers(name, *options):
        out = tmp_path / f"{name}.tif"
        made(
            recorded, "--no-stereo", "--cell-m", "0.5", "--range-sd-m", "0.02", "-o", out, *options
        )
        return bands(out, tmp_path)

    plain = layers("plain")
    measured = plain[6] == 1
    turned = layers("turned", "--attitude-sd-mrad", "10")
    more = (turned[1] - plain[1])[measured & (turned[6] == 1)]
    assert np.mean(more > 0) > 0.9  # of the variances
    assert np.median(turned[8][turned[6] == 4]) > np.median(plain[8][plain[6] == 4])
    smooth = layers("smooth", "--smooth")
    both = measured & (smooth[6] == 1)
    assert np.count_nonzero(both) > 100
    assert 0 < np.max(np.abs(smooth[0] - plain[0])[both]) < 0.2
    faired = layers("faired", "--method", "cgal")
    assert np.array_equal(faired[0][measured], plain[0][measured])
    assert np.all(np.isnan(faired[8]))
    assert np.count_nonzero(faired[6] == 4) > 0
    few_edges = layers("few_edges", "--method", "cgal", "--most-edges", "3")
    assert np.count_nonzero(few_edges[6] == 4) == 0  # a rim about a sample has more
    few = layers("few", "--area", "429445", "5150655", "429455", "5150665")
    assert few.shape[1] == 20 * 20


def test_the_picture_distinguishes_measured_and_filled_samples(recorded, tmp_path):
    """Three panels of the DEM's samples: filled ones are orange, and only in the second."""
    out, picture = tmp_path / "dem.tif", tmp_path / "dem.png"
    made(recorded, "--no-stereo", "--cell-m", "0.5", "-o", out, "--picture", picture)
    image = cv2.imread(str(picture)).astype(int)
    info = subprocess.run(["gdalinfo", out], check=True, capture_output=True, text=True).stdout
    columns, rows = map(int, re.search(r"Size is (\d+), (\d+)", info).groups())
    source = bands(out, tmp_path)[6].reshape(rows, columns)
    scale = max(columns, rows) / 600
    width, height = int(columns / scale), int(rows / scale)
    assert image.shape == (height, 3 * width + 2 * 8, 3)
    at = np.floor((np.arange(max(width, height)) + 0.5) * scale).astype(int)
    shown = source[np.ix_(at[:height], at[:width])]
    measured, both, sd = (image[:, k * (width + 8) :][:, :width] for k in range(3))
    blue, red = both[..., 0], both[..., 2]
    assert np.array_equal(red > 1.3 * blue, shown == 4)
    dark = np.array([51, 36, 31])  # blue, green, red
    assert np.array_equal(np.all(np.abs(measured - dark) <= 1, axis=2), shown != 1)
    assert np.all(measured[shown == 1].std(axis=1) < 1)  # grey
    assert np.array_equal(np.all(np.abs(both - dark) <= 1, axis=2), shown == 0)
    assert np.array_equal(np.all(np.abs(sd - dark) <= 1, axis=2), shown == 0)
