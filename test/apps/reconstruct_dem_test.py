"""`groundray reconstruct dem` as a user meets it: DEMs from datasets and from others' points.

The oracles: GDAL's own programs read what is written, and NumPy knows the ground: that which the
test made, or the triangles of the DEM that was scanned. Of a real scan those who made it say which
points are ground, and SciPy makes surfaces of these.
"""

import json
import os
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import laspy
import numpy as np
import pytest
from plyfile import PlyData
from scipy.interpolate import LinearNDInterpolator
from scipy.ndimage import map_coordinates
from scipy.stats import chi2

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "build/release/bin/groundray"
PRAIRIE = ROOT / "data/terrain/prairie_1m.tif"
JACKSBORO = ROOT / "data/terrain/jacksboro.tif"
SHARED = Path(os.environ.get("GROUNDRAY_SHARED_DATA", ROOT.parent / "shared/data"))
COROMANDEL = SHARED / "lidar/als_coromandel/points.laz"
IS_FULL = os.environ.get("GROUNDRAY_PROOF") == "full"
NOISE_M = 0.02
LAYERS = [
    "elevation",
    "variance",
    "n_lidar",
    "n_stereo",
    "chi2",
    "n_surfaces",
    "source",
    "distance_to_data",
    "fill_sd",
    "upper_bound",
    "slope",
    "overhang",
]
LIDAR = """\
lidars:
  - name: top
    preset: {preset}
    mount: {{translation_m: [0, 0, 1.8]}}
    range_noise_sigma_m: {noise}
"""
CAMERA = """\
groundray_camera: 1
model: Grey camera of 0.3 MP
size_px: [640, 480]
lens: {pinhole: {focal_px: [457, 457], centre_px: [319.5, 239.5]}}
rate_hz: 50
first_ms: 5
shutter: {exposure_ms: 0.5}
aperture: {f_number: 4}
imager:
  pixel_pitch_um: 4.8
  filter: rggb
  quantum_efficiency: [0.45, 0.6, 0.5]
  full_well_e: 10000
  read_noise_e: 5
  dark_current_e_s: 10
  prnu_percent: 0.5
  dsnu_e: 1
  gain_dn_e: 0.4
  black_dn: 64
  bits: 12
products: [picture]
sources: {all: an example of our own}
"""
STEREO = """\
sky:
  analytic: {}
  sun: {utc: 2026-06-21T16:30:00Z, latitude_deg: 46.506, longitude_deg: -93.92}
cameras:
  - name: left
    file: camera.yaml
    mount: {translation_m: [1.5, 0.25, 1.6], pitch_deg: 15}
    sampling: {samples: 4, most_samples: 4, depth: 2}
  - name: right
    file: camera.yaml
    mount: {translation_m: [1.5, -0.25, 1.6], pitch_deg: 15}
    sampling: {samples: 4, most_samples: 4, depth: 2}
stereo:
  - {name: pair, left: left, right: right, images: rectified}
"""


def groundray(*arguments, **options):
    return subprocess.run(
        [PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=900, **options
    )


def done(*arguments, **options):
    result = groundray(*arguments, **options)
    assert result.returncode == 0, result.stderr
    return result.stdout


def refused(folder, *arguments, words):
    """One message that holds all words, and no file that was not there."""
    before = sorted(folder.rglob("*"))
    result = groundray("reconstruct", "dem", *arguments)
    assert result.returncode == 1, result
    for word in words:
        assert word in result.stderr, result.stderr
    assert before == sorted(folder.rglob("*"))


class Raster:
    """The bands of a file as GDAL's own programs give them, rows from the north."""

    def __init__(self, path, folder):
        raw = folder / "bands.raw"
        command = ["gdal_translate", "-q", "-of", "ENVI", "-ot", "Float32", "-co", "INTERLEAVE=BSQ"]
        subprocess.run([*command, path, raw], check=True)
        said = subprocess.run(["gdalinfo", "-json", path], check=True, capture_output=True).stdout
        self.info = json.loads(said)
        self.names = [band.get("description", "") for band in self.info["bands"]]
        columns, rows = self.info["size"]
        self.bands = np.fromfile(raw, "<f4").reshape(-1, rows, columns).astype(float)
        self.west, self.cell, _, self.north, _, _ = self.info["geoTransform"]

    def __getitem__(self, name):
        return self.bands[self.names.index(name)]

    def places(self):
        """Of the samples: the middles of pixels, in the CRS."""
        rows, columns = self.bands.shape[1:]
        x = self.west + (np.arange(columns) + 0.5) * self.cell
        y = self.north - (np.arange(rows) + 0.5) * self.cell
        return np.meshgrid(x, y)


def triangle_heights(truth, x, y):
    """Of the two triangles of each cell, split from (column + 1, row) to (column, row + 1)."""
    z = truth.bands[0]
    u = (x - truth.west) / truth.cell - 0.5
    v = (truth.north - y) / truth.cell - 0.5
    column = np.clip(np.floor(u).astype(int), 0, z.shape[1] - 2)
    row = np.clip(np.floor(v).astype(int), 0, z.shape[0] - 2)
    a, b = u - column, v - row
    nw, ne = z[row, column], z[row, column + 1]
    sw, se = z[row + 1, column], z[row + 1, column + 1]
    first = nw + a * (ne - nw) + b * (sw - nw)
    second = se + (1 - a) * (sw - se) + (1 - b) * (ne - se)
    little = 1e-6  # a sample of the border may be rounded out of it
    inside = (np.minimum(u, v) >= -little) & (u <= z.shape[1] - 1 + little)
    inside &= v <= z.shape[0] - 1 + little
    return np.where(inside, np.where(a + b <= 1, first, second), np.nan)


def write_dem(path, heights, west, north, cell, crs="EPSG:32631"):
    raw = path.with_suffix(".raw")
    heights.astype("<f4").tofile(raw)
    rows, columns = heights.shape
    raw.with_suffix(".hdr").write_text(
        f"ENVI\nsamples = {columns}\nlines = {rows}\nbands = 1\nheader offset = 0\n"
        "data type = 4\ninterleave = bsq\nbyte order = 0\n"
    )
    box = [west, north, west + columns * cell, north - rows * cell]
    command = ["gdal_translate", "-q", "-a_srs", crs, "-a_ullr", *map(str, box)]
    subprocess.run([*command, raw, path], check=True)
    return path


def fractal(size, cell, rms, shortest, longest, seed):
    """Waves of a Hurst exponent of 0.8, from the spectrum; the field repeats."""
    waves = np.fft.fftfreq(size, cell)
    k = np.hypot(*np.meshgrid(waves, waves))
    with np.errstate(divide="ignore"):
        amplitude = np.where((k > 1 / longest) & (k < 1 / shortest), k**-1.8, 0)
    noise = np.random.default_rng(seed).standard_normal((size, size))
    heights = np.fft.ifft2(amplitude * np.fft.fft2(noise)).real
    return heights * rms / heights.std()


def add_outliers(dataset, share, seed):
    """Ranges that are anywhere between half and one and a half of what they were."""
    rng = np.random.default_rng(seed)
    for path in sorted((dataset / "lidar").glob("*/*[0-9].ply")):
        scan = PlyData.read(path, mmap=False)
        rows = scan["vertex"].data
        scale = np.where(rng.random(len(rows)) < share, rng.uniform(0.5, 1.5, len(rows)), 1)
        for axis in "xyz":
            rows[axis] *= scale.astype("f4")
        scan.write(path)


def scene(folder, dem, middle, seconds=0.52, preset="velodyne_vlp16", stereo=""):
    x, y = middle
    (folder / "camera.yaml").write_text(CAMERA)
    texture = ", texture: {albedo: gravel.png, size_m: 8}" if stereo else ""
    gravel = np.clip(128 + 60 * fractal(1024, 8 / 1024, 1, 0.02, 1, 6), 0, 255)
    cv2.imwrite(str(folder / "gravel.png"), gravel.astype(np.uint8))
    path = folder / "scene.yaml"
    path.write_text(
        f"groundray: 1\nseed: 3\nduration_s: {seconds}\n"
        f"terrain: {{dem: {dem}, material: dry_soil, label: 1{texture}}}\n"
        "platform:\n  drive:\n"
        f"    waypoints_m: [[{x - 10}, {y - 6}], [{x + 2}, {y + 6}], [{x + 20}, {y + 9}]]\n"
        "    speed_m_s: 20\n    height_m: 0.5\n"
        + LIDAR.format(preset=preset, noise=NOISE_M)
        + stereo
    )
    return path


@pytest.fixture(scope="module")
def prairie(tmp_path_factory):
    """Five scans over the prairie, with noise and 1.5 % outliers; and what became of them."""
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


def nmad_of(errors):
    return 1.4826 * np.median(np.abs(errors - np.median(errors)))


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


def test_heights_and_what_is_said_of_them_are_true(prairie, tmp_path, record_property):
    dem, truth = Raster(prairie / "out/dem.tif", tmp_path), Raster(PRAIRIE, tmp_path)
    error = dem["elevation"] - triangle_heights(truth, *dem.places())
    is_measured = np.isin(dem["source"], (1, 2, 3))
    e = error[is_measured & ~np.isnan(error)]
    z = (error / np.sqrt(dem["variance"]))[is_measured & ~np.isnan(error)]
    told = figures(json.loads((prairie / "out/dem.json").read_text()), "measured")
    rounding = 1e-4  # floats of 400 m
    assert told["samples"] == len(e)
    for key, value in (
        ("bias_m", e.mean()),
        ("rmse_m", np.sqrt(np.mean(e**2))),
        ("nmad_m", nmad_of(e)),
        ("p95_m", np.sort(np.abs(e))[int(0.95 * (len(e) - 1))]),
        ("largest_m", np.abs(e).max()),
    ):
        assert told[key] == pytest.approx(value, abs=rounding), key
    assert told["normalised_rms"] == pytest.approx(np.sqrt(np.mean(z**2)), rel=0.01)
    assert told["within_1sd"] == pytest.approx(np.mean(np.abs(z) <= 1), abs=0.01)
    assert told["within_2sd"] == pytest.approx(np.mean(np.abs(z) <= 2), abs=0.01)
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


def test_a_dem_is_a_terrain_again(prairie, tmp_path):
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
    for name, cpus in (("one", {min(os.sched_getaffinity(0))}), ("all", os.sched_getaffinity(0))):
        done(
            *("reconstruct", "dem", prairie / "data", "--cell-m", "0.25"),
            *("-o", tmp_path / f"{name}.tif", "--ground-filter", "ground", "--reach", "hull"),
            preexec_fn=lambda cpus=cpus: os.sched_setaffinity(0, cpus),
        )
    assert (tmp_path / "one.tif").read_bytes() == (tmp_path / "all.tif").read_bytes()


def test_blank_areas_stay_when_asked_to(prairie, tmp_path):
    done(
        *("reconstruct", "dem", prairie / "data", "--cell-m", "0.25", "--no-fill"),
        *("-o", tmp_path / "open.tif", "--sight", "none"),
    )
    dem = Raster(tmp_path / "open.tif", tmp_path)
    assert set(np.unique(dem["source"])) == {0, 1}
    assert np.all(np.isnan(dem["upper_bound"]))


def test_no_bound_is_below_the_ground(prairie, tmp_path):
    """Beams that passed are above the triangles that were scanned, but for noise and outliers."""
    dem, truth = Raster(prairie / "out/dem.tif", tmp_path), Raster(PRAIRIE, tmp_path)
    below = triangle_heights(truth, *dem.places()) - dem["upper_bound"]
    below = below[~np.isnan(below)]
    assert len(below) > 10000
    assert np.mean(below > 0.05) < 3e-3


def points_file(path, points):
    np.save(path, np.asarray(points, dtype=float))
    return path


def test_faults_are_told_and_leave_nothing(prairie, tmp_path):
    out = ["-o", tmp_path / "dem.tif"]
    data = prairie / "data"
    cell = ["--cell-m", "1"]
    air = ["--airborne", "--range-sd-m", "0.1"]
    one = points_file(tmp_path / "one.npy", [[10, 20, 30]])
    refused(tmp_path, one, *cell, *air, *out, words=["only 1 point"])
    none = points_file(tmp_path / "none.npy", np.full((4, 3), np.nan))
    refused(tmp_path, none, *cell, *air, *out, words=["nothing to make a DEM of"])
    rng = np.random.default_rng(5)
    wild = rng.uniform([0, 0, -500], [60, 60, 500], (400, 3))
    outliers = points_file(tmp_path / "outliers.npy", wild)
    refused(tmp_path, outliers, *cell, *air, *out, words=["none of the 400 points makes ground"])
    refused(tmp_path, data, *out, words=["--cell-m", "--like"])
    other = write_dem(prairie / "other.tif", np.zeros((9, 9)), 429440, 5150670, 1)
    for option in ("--like", "--truth"):
        words = ["other.tif", "its CRS is", "gdalwarp"]
        refused(tmp_path, data, *out, option, other, words=words)
    far = write_dem(prairie / "far.tif", np.zeros((9, 9)), 1000, 1000, 1, "EPSG:26915")
    refused(tmp_path, data, *out, "--like", far, words=["lie outside of the DEM's frame"])
    refused(tmp_path, data, *cell, *out, "--stereo", "pear", words=["no stereo pair 'pear'"])
    refused(tmp_path, one, *cell, *out, "--stereo", "pear", words=["only a dataset has stereo"])
    refused(tmp_path, data, *cell, "-o", tmp_path / "dem.png", words=["must end in .tif"])
    refused(tmp_path, data, *cell, "-o", tmp_path / "no/dem.tif", words=["there is no folder"])
    refused(tmp_path, data, *cell, *out, "--filter-slope", "1", words=["--ground-filter"])
    refused(tmp_path, data, *cell, *out, "--memory-mb", "1", words=["more than"])


def test_a_gap_of_the_poses_is_told(prairie, tmp_path):
    poses = (prairie / "data/poses/top.tum").read_text().splitlines(keepends=True)
    (tmp_path / "gap.tum").write_text("".join([*poses[:2], "4" + poses[-1].lstrip("0")]))
    words = ["the poses have a gap of", "--pose-gap-s"]
    command = [prairie / "data", "--poses", tmp_path / "gap.tum", "--cell-m", "1"]
    refused(tmp_path, *command, "-o", tmp_path / "dem.tif", words=words)


def test_an_interrupted_run_leaves_nothing(prairie, tmp_path):
    command = [PROGRAM, "reconstruct", "dem", prairie / "data", "--cell-m", "0.05"]
    run = subprocess.Popen(
        [*map(str, command), "-o", str(tmp_path / "dem.tif")], stderr=subprocess.PIPE
    )
    time.sleep(1)
    run.send_signal(signal.SIGINT)
    _, said = run.communicate(timeout=120)
    assert run.returncode == 130, said
    assert list(tmp_path.iterdir()) == []


@dataclass(frozen=True)
class Ground:
    """A DEM to drive over, about where, and which cells are to come of it."""

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


# What may be expected of an airborne lidar some hundred metres up, and in plan of its beams' width.
AIRBORNE = ("--airborne", "--range-sd-m", "0.03", "--across-sd-m", "0.12")


def coromandel():
    """Points of a real airborne scan of bush on steep land, without noise, and if they are ground;
    their labels are of who made the scan."""
    if not COROMANDEL.exists():
        pytest.skip(f"there is no {COROMANDEL}; set GROUNDRAY_SHARED_DATA")
    scan = laspy.read(COROMANDEL)
    labels = np.asarray(scan.classification)
    is_valid = ~np.isin(labels, (7, 18))  # low and high noise
    points = np.column_stack([scan.x, scan.y, scan.z])
    return points[is_valid], labels[is_valid] == 2


def coromandel_ground(folder):
    """What is labelled ground, blank areas filled: 38 degrees steep in the mean, and rough."""
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


def closed_loop(folder, ground, pairs):
    """Five scans and some stereo pairs of a known ground; the report."""
    path = scene(folder, ground.dem, ground.middle, preset="ouster_os0_128", stereo=STEREO)
    camera = folder / "camera.yaml"
    camera.write_text(CAMERA.replace("rate_hz: 50", f"rate_hz: {pairs / 0.5}"))
    done("generate", path, "-o", folder / "data")
    add_outliers(folder / "data", 0.015, 2)
    done(
        *("reconstruct", "dem", folder / "data", *ground.cells, "--truth", ground.dem),
        # Farther off depths of this pair are worse than 0.1 m, and stated so.
        *("--farthest-depth-m", "12"),
        *("-o", folder / "dem.tif", "--report", folder / "dem.json"),
    )
    report = json.loads((folder / "dem.json").read_text())
    assert len(report["scans"]) == 5
    assert len(report["pairs"]) >= pairs
    return report


@pytest.mark.parametrize(
    "ground", [prairie_of_1_m, fractal_ground, jacksboro_with_relief, coromandel_ground]
)
def test_scans_and_stereo_give_the_ground_back(tmp_path, record_property, ground):
    """As many pairs as the issue's proof has under `./dev prove`, else two."""
    record_property("size", "full" if IS_FULL else "reduced")
    name = ground.__name__.replace("_", " ")
    known = ground(tmp_path)
    report = closed_loop(tmp_path, known, pairs=20 if IS_FULL else 2)
    layers, truth = Raster(tmp_path / "dem.tif", tmp_path), Raster(known.dem, tmp_path)
    error = layers["elevation"] - triangle_heights(truth, *layers.places())
    is_judged = np.isin(layers["source"], (1, 2, 3)) & ~np.isnan(error)
    e, stated_m = error[is_judged], np.sqrt(layers["variance"][is_judged])
    told = figures(report, "measured")
    assert told["samples"] == pytest.approx(len(e), abs=2)  # that may be on the border
    assert told["nmad_m"] == pytest.approx(nmad_of(e), abs=1e-4)
    assert told["normalised_rms"] == pytest.approx(np.sqrt(np.mean((e / stated_m) ** 2)), rel=0.01)
    for of in ("lidar", "stereo", "both", "filled"):
        part = figures(report, of)
        if part["stated"]:
            keys = ("stated", "normalised_rms", "within_1sd", "within_2sd")
            record_property(f"{of}, {name}", " ".join(f"{key} {part[key]:.3g}" for key in keys))
    assert report["samples"]["fused"] + report["samples"]["stereo"] > 50
    stereo = figures(report, "stereo")
    if stereo["stated"] >= 100:
        # Of a pair all may be off alike, so that there are no more errors than pairs: their mean
        # square is as wide as chi² is. 95 % of it, about the bounds.
        count = len(report["pairs"])
        low, high = np.sqrt(chi2.ppf([0.025, 0.975], count) / count)
        assert 0.85 * low <= stereo["normalised_rms"] <= 1.15 * high
    judge(e, stated_m, name, record_property)


def bilinear(raster, band, x, y):
    """NaN where one of the four samples around has none."""
    u = (x - raster.west) / raster.cell - 0.5
    v = (raster.north - y) / raster.cell - 0.5
    return map_coordinates(band, [v, u], order=1, mode="constant", cval=np.nan)


def triangulated(points, at):
    """Heights of SciPy's triangles of points, coordinates being near 0."""
    middle = points[:, :2].mean(axis=0)
    return LinearNDInterpolator(points[:, :2] - middle, points[:, 2])(at[:, :2] - middle)


def lowest_of(points, side):
    """The lowest point of each square."""
    square = np.floor((points[:, :2] - points[:, :2].min(axis=0)) / side).astype(int)
    key = square[:, 0] * 100_000 + square[:, 1]
    order = np.lexsort((points[:, 2], key))
    return points[order[np.r_[True, np.diff(key[order]) > 0]]]


def record_held_out(layers, held, name, record_property):
    """The DEM's errors at points that were not shown, and where they are numbers; records those of
    what is measured and of the rest. How precise the points are themselves nobody says, so that
    normalised errors are told, but not judged."""
    x, y = held[:, 0], held[:, 1]
    error = bilinear(layers, layers["elevation"], x, y) - held[:, 2]
    variance = bilinear(layers, layers["variance"], x, y)
    z = error / np.sqrt(variance)
    for of, is_in in (("measured", ~np.isnan(z)), ("filled in part", np.isnan(z))):
        e = error[is_in & ~np.isnan(error)]
        said = f"{len(e)} points, bias {e.mean():.3f} m, NMAD {nmad_of(e):.3f} m, "
        said += f"95 % {np.quantile(np.abs(e), 0.95):.3f} m, RMSE {np.sqrt(np.mean(e**2)):.3f} m"
        record_property(f"{name}, {of}", said)
    z = z[~np.isnan(z)]
    shares = " ".join(f"{np.mean(np.abs(z) <= sds):.3f} within {sds} sd" for sds in (1, 2))
    record_property(f"{name}, normalised", f"RMS {np.sqrt(np.mean(z**2)):.2f}, {shares}")
    is_near = ~np.isnan(error)
    assert np.mean(is_near) > 0.98  # but for some at the border
    return error, is_near


WHOLE = ("--reach", "hull", "--largest-share", "1", "--farthest-m", "12")


def test_labelled_ground_predicts_what_was_held_out_of_it(tmp_path, record_property):
    """A tenth of the points that those who made a scan call ground, from the others: as near as
    SciPy's triangles of the others are. One hole is most of it, and cells of 0.25 m take longer."""
    points, is_ground = coromandel()
    ground = points[is_ground]
    is_held = np.arange(len(ground)) % 10 == 0
    shown = points_file(tmp_path / "shown.npy", ground[~is_held])
    done(
        *("reconstruct", "dem", shown, *AIRBORNE, *WHOLE, "--outlier-share", "0"),
        *("--cell-m", "0.25" if IS_FULL else "0.3", "-o", tmp_path / "dem.tif"),
    )
    layers, held = Raster(tmp_path / "dem.tif", tmp_path), ground[is_held]
    error, is_near = record_held_out(layers, held, "labelled ground", record_property)
    theirs = triangulated(ground[~is_held], held) - held[:, 2]
    is_both = is_near & ~np.isnan(theirs)
    ours_m, theirs_m = (np.sqrt(np.mean(e[is_both] ** 2)) for e in (error, theirs))
    record_property("margin: RMSE by triangles'", f"{ours_m / theirs_m} {ours_m:.3g} {theirs_m} m")
    assert np.count_nonzero(is_both) > 950
    assert ours_m <= theirs_m


def test_ground_under_bush_is_nearer_than_lowest_points(tmp_path, record_property):
    """From all points, labels unseen, the ground that was held out: as near as triangles of the
    lowest points of squares, at whatever side of these is the best afterwards. What hides the
    ground altogether is taken for it by both, so the middle of the errors is judged."""
    points, is_ground = coromandel()
    is_held = np.zeros(len(points), bool)
    is_held[np.flatnonzero(is_ground)[::10]] = True
    shown, held = points[~is_held], points[is_held]
    done(
        *("reconstruct", "dem", points_file(tmp_path / "shown.npy", shown), *AIRBORNE, *WHOLE),
        *("--ground-filter", "air", "--filter-slope", "0.6", "--filter-threshold-m", "0.3"),
        # The filter has left what is no ground out; who is left may stand alone.
        *("--outlier-share", "0", "--cell-m", "0.5", "-o", tmp_path / "dem.tif"),
    )
    layers = Raster(tmp_path / "dem.tif", tmp_path)
    error, is_near = record_held_out(layers, held, "ground under bush", record_property)
    peers = [triangulated(lowest_of(shown, side), held) - held[:, 2] for side in (1, 1.5, 2, 3, 5)]
    is_all = is_near & ~np.isnan(peers).any(axis=0)
    for of, figure in (("NMAD", nmad_of), ("median size", lambda e: np.median(np.abs(e)))):
        ours_m = figure(error[is_all])
        theirs_m = min(figure(peer[is_all]) for peer in peers)
        said = f"{ours_m / theirs_m} {ours_m:.3g} {theirs_m} m"
        record_property(f"margin: {of} by lowest points'", said)
        assert ours_m <= theirs_m, of
