"""`groundray reconstruct dem` for users: DEMs from datasets and from points of other software.

The oracles: GDAL's programs read the output, and NumPy computes the ground: a surface made by the
test, or the triangles of the scanned DEM.
"""

import json
import signal
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from dem_runs import (
    AIRBORNE,
    IS_FULL,
    LAYERS,
    PAIR,
    PRAIRIE,
    PROGRAM,
    ROOT,
    SKY,
    Raster,
    add_outliers,
    coromandel,
    done,
    fractal,
    made,
    nmad_of,
    points_file,
    refused,
    same_bytes_on_any_threads,
    scene,
    triangle_heights,
    write_camera,
    write_dem,
)
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree
from scipy.stats import chi2

JACKSBORO = ROOT / "data/terrain/jacksboro.tif"


@pytest.fixture(scope="module")
def prairie(tmp_path_factory):
    """Five scans of the prairie with noise and 1.5 % outliers, and their DEM."""
    folder = tmp_path_factory.mktemp("prairie")
    done("generate", scene(folder, PRAIRIE, (429448, 5150664)), "-o", folder / "data")
    add_outliers(folder / "data", 0.015, 1)
    out = folder / "out"
    out.mkdir()
    done(
        *("reconstruct", "dem", folder / "data", "--truth", PRAIRIE, "--cell-m", "0.25"),
        *("-o", out / "dem.tif", "--report", out / "dem.json", "--error-map", out / "error.tif"),
        *("--picture", out / "dem.png"),
    )
    return folder


def figures(report, of):
    return next(part for part in report["truth"] if part["of"] == of)


def judge(errors, stated_m, name, record_property):
    """By the issue's bounds.

    Neighbours within 5 x 5 cells have much of an error in common. Of 10,000 samples as few as 400
    may be independent: the RMS of what is normalised scatters by 0.035, far less than its bounds.
    """
    z = errors / stated_m
    rms, nmad, p95 = np.sqrt(np.mean(z**2)), nmad_of(errors), np.quantile(np.abs(errors), 0.95)
    record_property(f"margin: NMAD, {name}", f"{nmad / 0.008} {nmad:.3g} 0.008 m")
    record_property(f"margin: 95 % of errors, {name}", f"{p95 / 0.05} {p95:.3g} 0.05 m")
    off = abs(rms - 1)
    record_property(f"margin: normalised RMS less 1, {name}", f"{off / 0.15} {off:.3g} 0.15")
    record_property(f"normalised RMS, {name}", f"{rms:.3f}")
    for sds in (1, 2):
        share = np.mean(np.abs(z) <= sds)
        record_property(f"within {sds} sd, {name}", f"{share:.3f} of {len(z)}")
    assert len(errors) > 10000
    assert nmad <= 0.008
    assert p95 <= 0.05
    assert 0.85 <= rms <= 1.15


def test_heights_and_their_stated_errors_are_correct(prairie, tmp_path, record_property):
    dem, truth = Raster(prairie / "out/dem.tif", tmp_path), Raster(PRAIRIE, tmp_path)
    error = dem["elevation"] - triangle_heights(truth, *dem.places())
    is_measured = np.isin(dem["source"], (1, 2, 3))
    e = error[is_measured & ~np.isnan(error)]
    z = (error / np.sqrt(dem["variance"]))[is_measured & ~np.isnan(error)]
    reported = figures(json.loads((prairie / "out/dem.json").read_text()), "measured")
    rounding = 1e-4  # floats of 400 m
    assert reported["samples"] == len(e)
    for key, value in (
        ("bias_m", e.mean()),
        ("rmse_m", np.sqrt(np.mean(e**2))),
        ("nmad_m", nmad_of(e)),
        ("p95_m", np.quantile(np.abs(e), 0.95, method="inverted_cdf")),
        ("largest_m", np.abs(e).max()),
    ):
        assert reported[key] == pytest.approx(value, abs=rounding), key
    assert reported["normalised_rms"] == pytest.approx(np.sqrt(np.mean(z**2)), rel=0.01)
    assert reported["within_1sd"] == pytest.approx(np.mean(np.abs(z) <= 1), abs=0.01)
    assert reported["within_2sd"] == pytest.approx(np.mean(np.abs(z) <= 2), abs=0.01)
    error_map = Raster(prairie / "out/error.tif", tmp_path)
    assert np.nanmax(np.abs(error_map["error"] - error)) < rounding
    judge(e, e / z, "prairie by lidar", record_property)


def test_layers_agree_with_each_other_and_the_file_with_gdal(prairie, tmp_path):
    dem = Raster(prairie / "out/dem.tif", tmp_path)
    assert dem.names == LAYERS
    assert dem.info["metadata"]["IMAGE_STRUCTURE"]["LAYOUT"] == "COG"
    assert "UTM zone 15N" in dem.info["coordinateSystem"]["wkt"]
    source, has_height = dem["source"], ~np.isnan(dem["elevation"])
    assert set(np.unique(source)) <= {0, 1, 2, 3, 4}
    assert np.array_equal(has_height, source > 0)
    is_measured = np.isin(source, (1, 2, 3))
    assert np.array_equal(is_measured, dem["variance"] >= 0)
    assert np.array_equal(is_measured, dem["distance_to_data"] == 0)
    assert np.all(dem["fill_sd"][source == 4] > 0)
    assert np.all(np.isnan(dem["fill_sd"][source != 4]))
    assert dem["n_stereo"].max() == 0
    report = json.loads((prairie / "out/dem.json").read_text())
    assert dem["n_lidar"].sum() <= report["fused"]["points"]
    assert report["samples"]["lidar"] == np.count_nonzero(source == 1)
    assert report["samples"]["filled"] == np.count_nonzero(source == 4) > 0
    rows, columns = np.nonzero(is_measured)
    for row, column in zip(*(axis[::9973] for axis in np.nonzero(~is_measured)), strict=True):
        nearest = dem.cell * np.sqrt(np.min((rows - row) ** 2 + (columns - column) ** 2))
        assert dem["distance_to_data"][row, column] == pytest.approx(nearest, rel=1e-5)
    z = dem["elevation"]
    rise = np.hypot(z[1:-1, 2:] - z[1:-1, :-2], z[2:, 1:-1] - z[:-2, 1:-1]) / (2 * dem.cell)
    inner = np.where(has_height[1:-1, 1:-1], rise, np.nan)
    apart = np.degrees(np.arctan(inner)) - dem["slope"][1:-1, 1:-1]
    assert np.count_nonzero(~np.isnan(apart)) > 100
    assert np.nanmax(np.abs(apart)) < 0.02


def test_a_dem_is_usable_as_terrain(prairie, tmp_path):
    said = done("info", prairie / "out/dem.tif")
    assert "UTM zone 15N" in said
    done("terrain", "fill", prairie / "out/dem.tif", "-o", tmp_path / "again.tif")
    again = done(
        *("reconstruct", "dem", prairie / "data", "--like", prairie / "out/dem.tif"),
        *("-o", tmp_path / "like.tif", "--truth", prairie / "out/dem.tif"),
    )
    assert "measured" in again
    a, b = Raster(prairie / "out/dem.tif", tmp_path), Raster(tmp_path / "like.tif", tmp_path)
    assert (a.west, a.north, a.cell) == (b.west, b.north, b.cell)
    assert np.array_equal(a.bands[:4], b.bands[:4], equal_nan=True)


def test_bytes_of_a_dem_do_not_depend_on_threads(prairie, tmp_path):
    filters = ["--ground-filter", "ground", "--reach", "hull"]
    assert same_bytes_on_any_threads(tmp_path, prairie / "data", "--cell-m", "0.25", *filters)


def test_blank_areas_stay_on_request(prairie, tmp_path):
    done(
        *("reconstruct", "dem", prairie / "data", "--cell-m", "0.25", "--no-fill"),
        *("-o", tmp_path / "open.tif", "--sight", "none"),
    )
    dem = Raster(tmp_path / "open.tif", tmp_path)
    assert set(np.unique(dem["source"])) == {0, 1}
    assert np.all(np.isnan(dem["upper_bound"]))


def test_dem_errors_are_reported_and_leave_no_files(prairie, tmp_path):
    out = ["-o", tmp_path / "dem.tif"]
    data = prairie / "data"
    cell = ["--cell-m", "1"]
    air = ["--airborne", "--range-sd-m", "0.1"]
    one = points_file(tmp_path / "one.npy", [[10, 20, 30]])
    refused(tmp_path, one, *cell, *air, *out, words=["only 1 point"])
    none = points_file(tmp_path / "none.npy", np.full((4, 3), np.nan))
    refused(tmp_path, none, *cell, *air, *out, words=["a DEM cannot be computed"])
    rng = np.random.default_rng(5)
    wild = rng.uniform([0, 0, -500], [60, 60, 500], (400, 3))
    outliers = points_file(tmp_path / "outliers.npy", wild)
    refused(
        tmp_path, outliers, *cell, *air, *out, words=["none of the 400 points is usable as ground"]
    )
    refused(tmp_path, data, *out, words=["--cell-m", "--like"])
    other = write_dem(prairie / "other.tif", np.zeros((9, 9)), 429440, 5150670, 1)
    for option in ("--like", "--truth"):
        words = ["other.tif", "its CRS is", "gdalwarp"]
        refused(tmp_path, data, *out, option, other, words=words)
    far = write_dem(prairie / "far.tif", np.zeros((9, 9)), 1000, 1000, 1, "EPSG:26915")
    refused(tmp_path, data, *out, "--like", far, words=["are outside the DEM's extent"])
    refused(tmp_path, data, *cell, *out, "--stereo", "pear", words=["no stereo pair 'pear'"])
    refused(tmp_path, one, *cell, *out, "--stereo", "pear", words=["only a dataset has stereo"])
    refused(tmp_path, data, *cell, "-o", tmp_path / "dem.png", words=["must end in .tif"])
    refused(tmp_path, data, *cell, "-o", tmp_path / "no/dem.tif", words=["there is no folder"])
    refused(tmp_path, data, *cell, *out, "--filter-slope", "1", words=["--ground-filter"])
    refused(tmp_path, data, *cell, *out, "--memory-mb", "1", words=["more than"])


def test_a_gap_in_the_poses_is_reported(prairie, tmp_path):
    poses = (prairie / "data/poses/top.tum").read_text().splitlines(keepends=True)
    (tmp_path / "gap.tum").write_text("".join([*poses[:2], "4" + poses[-1].lstrip("0")]))
    words = ["the poses have a gap of", "--pose-gap-s"]
    command = [prairie / "data", "--poses", tmp_path / "gap.tum", "--cell-m", "1"]
    refused(tmp_path, *command, "-o", tmp_path / "dem.tif", words=words)


def test_an_interrupted_dem_run_leaves_no_files(prairie, tmp_path):
    """Interrupts the run at its first message, long before the end."""
    command = [PROGRAM, "reconstruct", "dem", prairie / "data", "--cell-m", "0.05"]
    run = subprocess.Popen(
        [*map(str, command), "-o", str(tmp_path / "dem.tif")], stderr=subprocess.PIPE
    )
    assert run.stderr.read(1)
    run.send_signal(signal.SIGINT)
    _, said = run.communicate(timeout=120)
    assert run.returncode == 130, said
    assert list(tmp_path.iterdir()) == []


@dataclass(frozen=True)
class Ground:
    """A DEM, the centre of the drive on it, and the cells to reconstruct."""

    dem: Path
    middle: tuple[float, float]
    cells: tuple


def like_itself(folder, heights):
    rows, columns = heights.shape
    cell = 0.25
    dem = write_dem(folder / "truth.tif", heights, 500000, 5600000, cell)
    return Ground(dem, (500000 + columns * cell / 2, 5600000 - rows * cell / 2), ("--like", dem))


def prairie_of_1_m(_folder):
    """Real ground whose triangles are wider than the cells: creases, and planes between them."""
    return Ground(PRAIRIE, (429448, 5150664), ("--cell-m", "0.25"))


def fractal_ground(folder):
    return like_itself(folder, 100 + fractal(640, 0.25, 0.5, 1, 64, 3))


def jacksboro_with_relief(folder):
    """A valley's side of the real DEM, smoothly between its samples, with relief of our own."""
    size, cell = 640, 0.25
    real = Raster(JACKSBORO, folder)
    steps = np.arange(size) * cell
    rows = 150 + steps / abs(real.info["geoTransform"][5])
    columns = 150 + steps / real.cell
    places = np.meshgrid(rows, columns, indexing="ij")
    smooth = map_coordinates(real.bands[0], places, order=3, mode="nearest")
    return like_itself(folder, smooth + fractal(size, cell, 0.1, 1, 16, 4))


def coromandel_ground(folder):
    """Labelled ground with blank areas filled: rough, with a mean slope of 38 degrees."""
    points, is_ground = coromandel()
    labelled = points_file(folder / "ground.npy", points[is_ground])
    done(
        *("reconstruct", "dem", labelled, *AIRBORNE, "--outlier-share", "0", "--cell-m", "1"),
        *("--reach", "everywhere", "--largest-share", "1", "-o", folder / "layers.tif"),
    )
    dem = folder / "truth.tif"
    command = ["gdal_translate", "-q", "-b", "1", "-a_srs", "EPSG:2193"]
    subprocess.run([*command, folder / "layers.tif", dem], check=True)
    raster = Raster(dem, folder)
    assert not np.isnan(raster.bands).any()
    x, y = raster.places()
    return Ground(dem, (x.mean(), y.mean()), ("--cell-m", "0.25"))


def dem_report(folder, ground, name, *options):
    """The DEM of a closed loop's scans and pairs, folder/name.tif; its report."""
    done(
        *("reconstruct", "dem", folder / "data", *ground.cells, "--truth", ground.dem),
        # Farther off depths of this pair are worse than 0.1 m, and stated so.
        *("--farthest-depth-m", "12", *options),
        *("-o", folder / f"{name}.tif", "--report", folder / f"{name}.json"),
    )
    return json.loads((folder / f"{name}.json").read_text())


def closed_loop(folder, ground, pairs):
    """Five scans and some stereo pairs of a known ground; the report."""
    path = scene(folder, ground.dem, ground.middle, preset="ouster_os0_128", stereo=SKY + PAIR)
    write_camera(folder, rate_hz=pairs / 0.5)
    done("generate", path, "-o", folder / "data")
    add_outliers(folder / "data", 0.015, 2)
    report = dem_report(folder, ground, "dem")
    assert len(report["scans"]) == 5
    assert len(report["pairs"]) >= pairs
    return report


@pytest.mark.parametrize(
    "ground", [prairie_of_1_m, fractal_ground, jacksboro_with_relief, coromandel_ground]
)
def test_scans_and_stereo_reproduce_the_ground(tmp_path, record_property, ground):
    """As many pairs as the issue's proof has under `./dev prove`, else two."""
    record_property("size", "full" if IS_FULL else "reduced")
    name = ground.__name__.replace("_", " ")
    known = ground(tmp_path)
    report = closed_loop(tmp_path, known, pairs=20 if IS_FULL else 2)
    layers, truth = Raster(tmp_path / "dem.tif", tmp_path), Raster(known.dem, tmp_path)
    error = layers["elevation"] - triangle_heights(truth, *layers.places())
    is_judged = np.isin(layers["source"], (1, 2, 3)) & ~np.isnan(error)
    e, stated_m = error[is_judged], np.sqrt(layers["variance"][is_judged])
    reported = figures(report, "measured")
    assert reported["samples"] == pytest.approx(len(e), abs=2)  # that may be on the border
    assert reported["nmad_m"] == pytest.approx(nmad_of(e), abs=1e-4)
    assert reported["normalised_rms"] == pytest.approx(
        np.sqrt(np.mean((e / stated_m) ** 2)), rel=0.01
    )
    for of in ("lidar", "stereo", "fused", "filled"):
        part = figures(report, of)
        if part["stated"]:
            keys = ("stated", "normalised_rms", "within_1sd", "within_2sd")
            record_property(f"{of}, {name}", " ".join(f"{key} {part[key]:.3g}" for key in keys))
    assert report["samples"]["fused"] + report["samples"]["stereo"] > 50
    # Without the scans every cell of the pairs counts, not only those few that no scan has.
    alone = dem_report(tmp_path, known, "stereo", "--no-lidar")
    stereo = figures(alone, "stereo")
    record_property(f"stereo without lidar, {name}", "{normalised_rms:.3g}".format(**stereo))
    if stereo["stated"] >= 100:
        # Of a pair all may be off alike, so that there are no more errors than pairs: their mean
        # square is as wide as chi² is. 95 % of it, about the bounds.
        count = len(alone["pairs"])
        low, high = np.sqrt(chi2.ppf([0.025, 0.975], count) / count)
        assert 0.85 * low <= stereo["normalised_rms"] <= 1.15 * high
    judge(e, stated_m, name, record_property)


def rough_ground(folder):
    """Triangles half as wide as the cells, with waves from 0.3 m on: ground that bends in cells."""
    size, cell = 1024, 0.125
    x, y = np.meshgrid(np.arange(size) * cell, -np.arange(size) * cell)
    waves = 0.4 * np.sin(0.15 * x + 0.07 * y) + 0.1 * np.sin(0.6 * x - 0.3 * y)
    heights = 100 + waves + fractal(size, cell, 0.02, 0.3, 8, 9)
    dem = write_dem(folder / "truth.tif", heights, 500000.03, 5600000.07, cell)
    return Ground(dem, (500064, 5599936), ("--cell-m", "0.25"))


SLOWLY = {"seconds": 2.02, "speed_m_s": 5, "noise_m": 0.005}  # up to 300 points per cell


@pytest.mark.parametrize(
    ("ground", "drive"),
    [
        (rough_ground, SLOWLY),
        *([(prairie_of_1_m, {}), (fractal_ground, {}), (jacksboro_with_relief, {})] * IS_FULL),
    ],
)
def test_stated_errors_are_correct_at_all_ranges(tmp_path, record_property, ground, drive):
    """Of the triangles that were scanned. Near the sensor, noise averages out to a millimetre, and
    what is left is how the ground bends within a cell. Beyond 20 m most cells have a single point,
    and few of the cells around them have any."""
    record_property("size", "full" if IS_FULL else "reduced")
    known = ground(tmp_path)
    path = scene(tmp_path, known.dem, known.middle, preset="ouster_os0_128", **drive)
    done("generate", path, "-o", tmp_path / "data")
    add_outliers(tmp_path / "data", 0.015, 2)
    made(
        *(tmp_path / "data", *known.cells, "--truth", known.dem, "--no-fill", "--sight", "none"),
        *("-o", tmp_path / "dem.tif", "--report", tmp_path / "dem.json"),
    )
    dem, truth = Raster(tmp_path / "dem.tif", tmp_path), Raster(known.dem, tmp_path)
    x, y = dem.places()
    error = dem["elevation"] - triangle_heights(truth, x, y)
    is_judged = (dem["source"] == 1) & ~np.isnan(error)
    z = (error / np.sqrt(dem["variance"]))[is_judged]
    origin_m = json.loads((tmp_path / "dem.json").read_text())["origin_w_m"]
    poses = np.loadtxt(tmp_path / "data/poses/top.tum")
    to_path = cKDTree(poses[:, 1:3] + origin_m[:2])
    range_m, _ = to_path.query(np.column_stack([x[is_judged], y[is_judged]]))
    name, wrong = ground.__name__.replace("_", " "), []
    for low, high in ((0, 3), (3, 5), (5, 10), (10, 20), (20, np.inf)):
        near = z[(low <= range_m) & (range_m < high)]
        assert len(near) > 1000
        rms = np.sqrt(np.mean(near**2))
        record_property(f"normalised RMS, {name}, {low} to {high} m", f"{rms:.3f} of {len(near)}")
        off, most = abs(rms - 1), 0.15
        margin = f"{off / most} {off:.3g} {most}"
        record_property(f"margin: normalised RMS less 1, {name}, {low} to {high} m", margin)
        if off > most:
            wrong.append(f"{low} to {high} m: {rms:.3f}")
    assert not wrong
