"""Layers of a DEM besides heights: upper bounds of the ground, and overhangs.

The oracles: the triangles of the DEM that was scanned, what the test did to ranges, and the deck
that it built.
"""

import re
import shutil

import numpy as np
import pytest
from dem_runs import (
    NOISE_M,
    PRAIRIE,
    Raster,
    add_outliers,
    done,
    made,
    scene,
    triangle_heights,
    write_dem,
)
from plyfile import PlyData


@pytest.fixture(scope="module")
def prairie(tmp_path_factory):
    """Five scans over the prairie, with noise, and the same with 1.5 % outliers."""
    folder = tmp_path_factory.mktemp("prairie")
    path = scene(folder, PRAIRIE, (429448, 5150664))
    done("generate", path, "-o", folder / "without outliers")
    shutil.copytree(folder / "without outliers", folder / "data")
    add_outliers(folder / "data", 0.015, 1)
    return folder


# A beam goes down by 15 degrees and the vehicle's tilt, 10 at most, so that its range's noise makes
# 8 mm of height. Bounds are raised by two of these; of 10^5 points none is off by more than five.
BOUND_NOISE_M = 3 * NOISE_M * np.sin(np.radians(25))


def below_ground(dem, truth):
    """By how much bounds are below the triangles that were scanned, and by how much they may be
    without noise. A beam passes above the ground somewhere within half a cell of a sample, maybe
    where the ground is lowest; to its height there a quarter of a cell is added. So a bound may be
    too low where the ground is steeper than one in two, and has to be above it elsewhere."""
    x, y = dem.places()
    ground = triangle_heights(truth, x, y)
    lowest = ground
    for angle in np.arange(0, 2 * np.pi, np.pi / 16):
        there = (dem.cell / 2 * trig(angle) for trig in (np.cos, np.sin))
        lowest = np.minimum(lowest, triangle_heights(truth, *map(np.add, (x, y), there)))
    return ground - dem["upper_bound"], ground - lowest - dem.cell / 4


def test_no_bound_is_below_the_ground(prairie, tmp_path):
    clean, out = prairie / "without outliers", tmp_path / "dem.tif"
    made(clean, "--cell-m", "0.25", "-o", out)
    below, most = below_ground(Raster(out, tmp_path), Raster(PRAIRIE, tmp_path))
    is_steep = most > 0
    assert np.count_nonzero(~np.isnan(below)) > 100_000
    assert np.count_nonzero(~np.isnan(below[is_steep])) > 1000
    assert np.nanmax(below - most) < BOUND_NOISE_M


def too_long(prairie):
    """In plan, in W, where beams whose ranges are too long began, and where they seem to end."""
    begins, ends = [], []
    poses = np.loadtxt(prairie / "data/poses/top.tum")
    listed = (prairie / "data/dataset.yaml").read_text()
    stamps = re.findall(r'sensor: "top", .*stamp_s: ([\d.]+)', listed)
    zero = [float(x) for x in re.search(r"origin_w_m: \[(\S+), (\S+),", listed).groups()]
    for i, stamp in enumerate(stamps):
        name = f"lidar/top/{i:06}.ply"
        before, after = (
            PlyData.read(prairie / of / name, mmap=False)["vertex"].data
            for of in ("without outliers", "data")
        )
        ranges = [
            np.linalg.norm([scan[axis] for axis in "xyz"], axis=0) for scan in (before, after)
        ]
        scale = ranges[1] / ranges[0]
        is_long = scale > 1.001
        at = float(stamp) + before["time"][is_long].astype(float)
        origin = np.column_stack([np.interp(at, poses[:, 0], poses[:, k]) for k in (1, 2)])
        origin += zero
        true = np.column_stack([before[f"world_{axis}"][is_long] for axis in "xy"]) + zero
        begins.append(origin)
        ends.append(origin + scale[is_long, None] * (true - origin))
    return np.concatenate(begins), np.concatenate(ends)


def test_only_outliers_cause_bounds_below_the_ground(prairie, tmp_path):
    """A range that is too long takes its beam under a crest, and out again: such a beam, and no
    other, passes the cell of each bound that is too low. These are few."""
    made(prairie / "data", "--cell-m", "0.25", "-o", tmp_path / "dem.tif")
    dem = Raster(tmp_path / "dem.tif", tmp_path)
    below, most = below_ground(dem, Raster(PRAIRIE, tmp_path))
    is_bound = ~np.isnan(below)
    assert np.count_nonzero(is_bound) > 10_000
    assert np.mean(below[is_bound] > 0.05) < 3e-3
    is_low = np.nan_to_num(below - most) > BOUND_NOISE_M
    begins, ends = too_long(prairie)
    x, y = dem.places()
    cells = np.column_stack([x[is_low], y[is_low]])
    along = ends - begins
    nearest = []
    for cell in cells:
        t = np.sum((cell - begins) * along, axis=1) / np.sum(along**2, axis=1)
        apart = cell - begins - np.clip(t, 0, 1)[:, None] * along
        nearest.append(np.hypot(*apart.T).min())
    assert len(begins) > 400
    slack_m = 0.02  # of the path between its poses
    assert np.max(nearest, initial=0) < dem.cell / np.sqrt(2) + slack_m


SLOPE, BASE_M, CLEARANCE_M = 0.04, 103.5, 3  # the deck's underside; above the ground in its middle
DECK = (np.array([500028, 5599981]), np.array([500034, 5599987]))  # its corners


def bridge(folder):
    """A level deck over ground that rises to the east, driven under."""
    columns = np.arange(120) * 0.5
    ground = BASE_M - CLEARANCE_M + SLOPE * (columns - 30.75) + np.zeros((60, 1))
    dem = write_dem(folder / "ground.tif", ground, 500000, 5600000, 0.5)
    (x, y), height = (DECK[1] - DECK[0]) / 2, 0.4
    corners = [(i * x, j * y, k * height) for k in (0, 1) for j in (-1, 1) for i in (-1, 1)]
    faces = [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6)]
    lines = [f"v {a} {b} {c}" for a, b, c in corners] + [
        f"f {a} {b} {c} {d}" for a, b, c, d in faces
    ]
    (folder / "deck.obj").write_text("\n".join([*lines, ""]))
    east, north = DECK[0] + (x, y)
    path = scene(folder, dem, (east + 4, north), seconds=0.82, preset="ouster_os0_128")
    path.write_text(
        path.read_text() + "objects:\n"
        "  - {name: deck, label: 2, model: deck.obj, up: z, metres_per_unit: 1, "
        f"material: dry_soil, at_m: [{east}, {north}], height_m: {BASE_M}}}\n"
    )
    done("generate", path, "-o", folder / "data")
    return folder / "data"


@pytest.mark.parametrize("choice", ["none", "ground"])
def test_overhangs_and_clearances_are_reported(tmp_path, choice):
    """Of each cell that is all under the deck its underside's height, to five standard deviations
    of the ranges, and the way that is free below: by that, and what the ground rises in a cell."""
    cell = 0.25
    data = bridge(tmp_path)
    made(data, "--cell-m", cell, "--ground-filter", choice, "-o", tmp_path / "dem.tif")
    dem = Raster(tmp_path / "dem.tif", tmp_path)
    x, y = dem.places()
    inner, outer = (
        (np.abs(x - DECK[0][0] - 3) < 3 + by) & (np.abs(y - DECK[0][1] - 3) < 3 + by)
        for by in (-0.6 * cell, 0.6 * cell)
    )
    is_seen = inner & (dem["n_surfaces"] == 2)
    assert np.count_nonzero(is_seen) > 0.8 * np.count_nonzero(inner)
    noise = 5 * NOISE_M
    assert np.max(np.abs(dem["overhang"] - BASE_M)[is_seen]) < noise
    free = BASE_M - (BASE_M - CLEARANCE_M + SLOPE * (x - 500031))
    apart = (dem["clearance"] - free)[is_seen]
    assert np.max(apart) < noise
    assert np.min(apart) > -2 * noise - SLOPE * cell
    assert np.max(np.abs(dem["elevation"] + free - BASE_M)[is_seen]) < noise
    has_none = (dem["n_surfaces"] < 2) & ~outer
    assert np.count_nonzero(has_none) > 3000
    for name in ("overhang", "clearance"):
        assert np.all(np.isnan(dem[name][has_none]))
    assert np.array_equal(np.isnan(dem["overhang"]), np.isnan(dem["clearance"]))
    assert np.count_nonzero(dem["n_surfaces"][~outer] > 1) == 0
