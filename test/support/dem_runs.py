"""Runs `groundray reconstruct dem` and reads its results."""

import json
import os
import re
import subprocess
from pathlib import Path

import cv2
import laspy
import numpy as np
import pytest
from plyfile import PlyData

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "build/release/bin/groundray"
PRAIRIE = ROOT / "data/terrain/prairie_1m.tif"
SHARED = Path(os.environ.get("GROUNDRAY_SHARED_DATA", ROOT.parent / "shared/data"))
COROMANDEL = SHARED / "lidar/als_coromandel/points.laz"
IS_FULL = os.environ.get("GROUNDRAY_PROOF") == "full"
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
    "clearance",
]
CAMERA = """\
groundray_camera: 1
model: Grey camera of 0.3 MP
size_px: [640, 480]
lens: {{pinhole: {{focal_px: [457, 457], centre_px: [319.5, 239.5]}}}}
rate_hz: {rate_hz}
first_ms: {first_ms}
shutter: {{exposure_ms: 0.5}}
aperture: {{f_number: 4}}
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
products: [{products}]
sources: {{all: an example of our own}}
"""
PAIR = """\
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

NOISE_M = 0.02
LIDAR = """\
lidars:
  - name: top
    preset: {preset}
    mount: {{translation_m: [0, 0, 1.8]}}
    range_noise_sigma_m: {noise}
"""
SKY = """\
sky:
  analytic: {}
  sun: {utc: 2026-06-21T16:30:00Z, latitude_deg: 46.506, longitude_deg: -93.92}
"""


def groundray(*arguments, **options):
    return subprocess.run(
        [PROGRAM, *map(str, arguments)],
        **{"capture_output": True, "text": True, "timeout": 900} | options,
    )


def done(*arguments, **options):
    result = groundray(*arguments, **options)
    assert result.returncode == 0, result.stderr
    return result.stdout


def made(*arguments, **options):
    return done("reconstruct", "dem", *arguments, **options)


def refused(folder, *arguments, words, **options):
    """Asserts one error message that contains all words, and no file that is new or changed.
    Progress lines before the message may contain some of the words as well."""
    before = {path: path.lstat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}
    result = groundray("reconstruct", "dem", *arguments, **options)
    assert result.returncode == 1, result
    _, *reported = re.split(r"^groundray: ", result.stderr, flags=re.MULTILINE)
    assert len(reported) == 1, result.stderr
    for word in words:
        assert word in reported[0], result.stderr
    after = {path: path.lstat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}
    assert before == after


class Raster:
    """Bands of a file as read by GDAL's own programs, northernmost row first."""

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
        """Returns the positions of the samples, the centres of pixels, in the CRS."""
        rows, columns = self.bands.shape[1:]
        x = self.west + (np.arange(columns) + 0.5) * self.cell
        y = self.north - (np.arange(rows) + 0.5) * self.cell
        return np.meshgrid(x, y)


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


def points_file(path, points):
    np.save(path, np.asarray(points, dtype=float))
    return path


def triangle_heights(truth, x, y):
    """Heights on the triangles of each cell, split from (column + 1, row) to (column, row + 1)."""
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


def fractal(size, cell, rms, shortest, longest, seed):
    """Periodic random field with a Hurst exponent of 0.8, synthesised from its spectrum."""
    waves = np.fft.fftfreq(size, cell)
    k = np.hypot(*np.meshgrid(waves, waves))
    with np.errstate(divide="ignore"):
        amplitude = np.where((k > 1 / longest) & (k < 1 / shortest), k**-1.8, 0)
    noise = np.random.default_rng(seed).standard_normal((size, size))
    heights = np.fft.ifft2(amplitude * np.fft.fft2(noise)).real
    return heights * rms / heights.std()


def add_outliers(dataset, share, seed):
    """Multiplies some ranges by random factors between 0.5 and 1.5."""
    rng = np.random.default_rng(seed)
    for path in sorted((dataset / "lidar").glob("*/*[0-9].ply")):
        scan = PlyData.read(path, mmap=False)
        rows = scan["vertex"].data
        scale = np.where(rng.random(len(rows)) < share, rng.uniform(0.5, 1.5, len(rows)), 1)
        for axis in "xyz":
            rows[axis] *= scale.astype("f4")
        scan.write(path)


def write_camera(folder, rate_hz):
    text = CAMERA.format(rate_hz=rate_hz, first_ms=5, products="picture")
    (folder / "camera.yaml").write_text(text)


def scene(
    folder,
    dem,
    middle,
    seconds=0.52,
    preset="velodyne_vlp16",
    stereo="",
    speed_m_s=20,
    noise_m=NOISE_M,
):
    x, y = middle
    write_camera(folder, rate_hz=50)
    texture = ", texture: {albedo: gravel.png, size_m: 8}" if stereo else ""
    gravel = np.clip(128 + 60 * fractal(1024, 8 / 1024, 1, 0.02, 1, 6), 0, 255)
    cv2.imwrite(str(folder / "gravel.png"), gravel.astype(np.uint8))
    path = folder / "scene.yaml"
    path.write_text(
        f"groundray: 1\nseed: 3\nduration_s: {seconds}\n"
        f"terrain: {{dem: {dem}, material: dry_soil, label: 1{texture}}}\n"
        "platform:\n  drive:\n"
        f"    waypoints_m: [[{x - 10}, {y - 6}], [{x + 2}, {y + 6}], [{x + 20}, {y + 9}]]\n"
        f"    speed_m_s: {speed_m_s}\n    height_m: 0.5\n"
        + LIDAR.format(preset=preset, noise=noise_m)
        + stereo
    )
    return path


def same_bytes_on_any_threads(folder, *arguments):
    """Returns whether a DEM made on one CPU equals one made on all CPUs, byte by byte."""
    for name, cpus in (("one", {min(os.sched_getaffinity(0))}), ("all", os.sched_getaffinity(0))):
        made(
            *(*arguments, "-o", folder / f"{name}.tif"),
            preexec_fn=lambda cpus=cpus: os.sched_setaffinity(0, cpus),
        )
    return (folder / "one.tif").read_bytes() == (folder / "all.tif").read_bytes()


def nmad_of(errors):
    return 1.4826 * np.median(np.abs(errors - np.median(errors)))


# What may be expected of an airborne lidar some hundred metres up, and in plan of its beams' width.
AIRBORNE = ("--airborne", "--range-sd-m", "0.03", "--across-sd-m", "0.12")


def coromandel():
    """Points of a real airborne scan of bush on steep land, without noise points, and whether they
    are ground according to the provider's classification."""
    if not COROMANDEL.exists():
        pytest.skip(f"there is no {COROMANDEL}; set GROUNDRAY_SHARED_DATA")
    scan = laspy.read(COROMANDEL)
    labels = np.asarray(scan.classification)
    is_valid = ~np.isin(labels, (7, 18))  # low and high noise
    points = np.column_stack([scan.x, scan.y, scan.z])
    return points[is_valid], labels[is_valid] == 2
