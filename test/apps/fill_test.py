"""Blank areas of DEMs filled from the command line, compared with other methods."""

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
import scipy.stats

ROOT = Path(__file__).resolve().parents[2]
spec = importlib.util.spec_from_file_location("fill_peers", ROOT / "test/benchmark/fill_peers.py")
peers = importlib.util.module_from_spec(spec)
sys.modules["fill_peers"] = peers
spec.loader.exec_module(peers)
JACKSBORO = ROOT / "data/terrain/jacksboro.tif"
PRAIRIE = ROOT / "data/terrain/prairie_1m.tif"


def fill(*arguments):
    line = [peers.PROGRAM, "terrain", "fill", *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True, timeout=300)


# groundray's RMSE as a share of others' is this at most.
LARGEST_SHARES = {"thin plate": 1, "SciPy RBF": 1.02, "GDAL": 0.95, "Telea": 0.95, "NS": 0.95}
# Shadows come with bounds by lines of sight; others' ways make no use of these.
JUDGED = (*(kind for kind in peers.KINDS if kind != "shadows"), peers.BOUNDED)
MASKS = 10 if os.environ.get("GROUNDRAY_PROOF") == "full" else 4
# A DEM and kind alone exceeds a share by chance in 1 of 100 runs of all such comparisons (Sidak).
CHANCE = 1 - 0.99 ** (1 / (2 * len(JUDGED) * len(LARGEST_SHARES)))


@pytest.fixture(scope="module")
def runs():
    """Results of both DEMs by kind, for the masks of ./dev bench fill."""
    others = {name: fill for name, fill in peers.PEERS.items() if name in LARGEST_SHARES}
    found = {}
    for dem in ("jacksboro", "fractal"):
        ground = peers.load(dem)
        for kind in peers.KINDS:
            for seed in range(MASKS):
                for run in peers.compare(ground, kind, seed, others):
                    found.setdefault(run["kind"], {}).setdefault(dem, []).append(run)
    return found


@pytest.mark.parametrize("kind", JUDGED)
def test_fills_no_worse_than_other_software(runs, kind):
    both = [peers.summarise(of_dem)["shares"] for of_dem in runs[kind].values()]
    for peer, most in LARGEST_SHARES.items():
        # As the shares are averaged by ./dev bench fill; no slack.
        assert np.exp(np.mean([np.log(shares[peer]) for shares in both])) <= most, peer
        for dem, of_dem in runs[kind].items():
            # Each alone must not be worse but by chance: Student's t of the masks' log ratios.
            logs = [np.log(run["own"][peer] / run["squares"][peer]) / 2 for run in of_dem]
            worse = np.array(logs) - np.log(most)
            if worse.mean() > 0 and worse.std() > 0:
                chance = scipy.stats.ttest_1samp(worse, 0, alternative="greater").pvalue
                assert chance > CHANCE, (dem, peer)


def test_line_of_sight_bounds_reduce_errors_in_shadows(runs):
    for dem, held in runs[peers.BOUNDED].items():
        free = runs["shadows"][dem]
        assert peers.summarise(held)["rmse"] <= 0.97 * peers.summarise(free)["rmse"], dem


@pytest.mark.parametrize("kind", JUDGED)
def test_stated_standard_deviations_are_correct(runs, kind):
    found = peers.summarise([run for of_dem in runs[kind].values() for run in of_dem])
    assert 0.85 <= found["rms_sds"] <= 1.15
    # What normal errors cover that are 1.15 and 0.85 of their stated sds.
    for k in (1, 2):
        low, high = (2 * scipy.stats.norm.cdf(k / sds) - 1 for sds in (1.15, 0.85))
        assert low <= found["cover"][k - 1] <= high, k


@pytest.mark.parametrize("method", ["telea", "ns"])
def test_inpainting_matches_opencv(method):
    ground = peers.cut(peers.load("jacksboro"), np.random.default_rng(6), 64)
    mask, _ = peers.make_mask("blob 5 %", ground, np.random.default_rng(2))
    ours = peers.by_groundray(ground, mask, "--method", method)[0]
    flag = {"telea": cv2.INPAINT_TELEA, "ns": cv2.INPAINT_NS}[method]
    theirs = peers.inpaint(ground, mask, flag)
    # OpenCV may be of another release.
    assert np.abs(ours - theirs)[mask].max() < 0.01 * np.ptp(ground)


def test_thin_plate_matches_scipy():
    ground = peers.cut(peers.load("jacksboro"), np.random.default_rng(1), 96)
    mask, _ = peers.make_mask("blob 20 %", ground, np.random.default_rng(2))
    ours = peers.by_groundray(ground, mask, "--tension", 0)[0]
    # Floats of up to 1000 m are off by 3e-5 m.
    assert np.abs(ours - peers.thin_plate(ground, mask)).max() < 1e-4


@pytest.mark.parametrize("cell_m", [1, 30])  # ground of some 80 and 10 degrees
def test_cgal_meshes_approximate_a_thin_plate(cell_m):
    ground = peers.cut(peers.load("jacksboro"), np.random.default_rng(3), 96)
    mask, _ = peers.make_mask("blob 5 %", ground, np.random.default_rng(4))
    ours = peers.by_groundray(ground, mask, "--method", "cgal", cell_m=cell_m)[0]
    # Holes whose parts touch at a sample alone are left.
    filled = mask & np.isfinite(ours)
    assert filled.sum() >= 0.9 * mask.sum()
    plate = peers.thin_plate(ground, mask)
    rmse = [np.sqrt(((z - ground)[filled] ** 2).mean()) for z in (ours, plate)]
    assert rmse[0] <= 1.1 * rmse[1]


def test_holes_beyond_the_limits_stay(tmp_path):
    ground = peers.cut(peers.load("jacksboro"), np.random.default_rng(5), 64)
    ground[5:8, 5:8] = np.nan
    ground[20:40, 20:40] = np.nan
    ground[50:, 60:] = np.nan
    peers.write_grid(tmp_path / "in.asc", ground)
    result = fill(tmp_path / "in.asc", "-o", tmp_path / "out.tif", "--farthest-m", 5)
    assert result.returncode == 0, result.stderr
    assert "9 of 465 missing samples filled" in result.stdout
    for why in ("not enclosed by data", "too far from data"):
        assert why in result.stdout
    out = peers.read_tiff(tmp_path / "out.tif")
    expected = np.isnan(ground)
    expected[5:8, 5:8] = False
    assert (np.isnan(out) == expected).all()
    known = np.isfinite(ground)
    assert (out[known] == ground[known].astype(np.float32)).all()


def test_the_filled_file_is_a_dem(tmp_path):
    result = fill(PRAIRIE, "-o", tmp_path / "out.tif")
    assert result.returncode == 0, result.stderr
    info = [
        subprocess.run([peers.PROGRAM, "info", path], capture_output=True, text=True).stdout
        for path in (PRAIRIE, tmp_path / "out.tif")
    ]
    codes = [re.findall(r"EPSG:\d+", text) for text in info]
    assert codes[0] == codes[1] != []


def test_srtm_voids_are_filled_without_spikes(tmp_path):
    tiles = sorted((peers.SHARED / "srtm3_sierra_nevada").glob("*.hgt.zip"))
    if not tiles:
        pytest.skip(f"there is no SRTM in {peers.SHARED}; set GROUNDRAY_SHARED_DATA")
    tile = next(t for t in tiles if t.name.startswith("N37W004"))
    inside = f"/vsizip/{tile}/{tile.name.removesuffix('.zip')}"
    result = fill(inside, "--reproject-to", "utm", "-o", tmp_path / "out.tif")
    assert result.returncode == 0, result.stderr
    stay = fill(inside, "--reproject-to", "utm", "-o", tmp_path / "stay.tif", "--farthest-m", 1e-3)
    assert stay.returncode == 0, stay.stderr
    filled, left = (read_voids(tmp_path / name) for name in ("out.tif", "stay.tif"))
    voids = np.isnan(left) & np.isfinite(filled)
    assert (filled[np.isfinite(left)] == left[np.isfinite(left)]).all()
    if voids.any():
        assert filled[voids].min() >= np.nanmin(left) - 50
        assert filled[voids].max() <= np.nanmax(left) + 50


def read_voids(path):
    heights = peers.read_tiff(path)
    return np.where(heights <= -32768, np.nan, heights)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--method", "gdal", "--tension", "0.1"], "apply only to --method tension"),
        (["--tension", "1"], "tension = 1 must be at least 0 and below 1"),
        (["--bound", str(JACKSBORO)], "its samples do not match the DEM's"),
    ],
)
def test_fill_errors_are_reported_and_nothing_is_written(tmp_path, options, message):
    peers.write_grid(tmp_path / "in.asc", np.ones((8, 8)))
    result = fill(tmp_path / "in.asc", "-o", tmp_path / "out.tif", *options)
    assert result.returncode == 1
    assert message in result.stderr
    assert not (tmp_path / "out.tif").exists()
