"""Blank areas of DEMs filled from the command line, judged against other people's ways."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

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


@pytest.mark.parametrize("kind", peers.KINDS)
@pytest.mark.parametrize("dem", ["jacksboro", "fractal"])
def test_fills_no_worse_than_other_people(dem, kind):
    ground = peers.load(dem)
    runs = [peers.compare(ground, kind, seed, size=128) for seed in range(3)]
    found = peers.summarise([run for run in runs if run])
    rmse = found["rmse"]
    own = rmse["bounded" if kind == "shadows" else "groundray"]
    # What the shares scatter by on three small masks; ./dev bench fill has ten large ones.
    chance = 1.03
    assert own <= chance * rmse["thin plate"]
    assert own <= 1.02 * chance * rmse["SciPy RBF"]
    for peer in ("GDAL", "Telea", "NS"):
        assert own <= 0.95 * chance * rmse[peer]
    if kind == "shadows":
        assert rmse["bounded"] <= 0.97 * rmse["groundray"]
    else:
        # Errors within a hole go together, so shares of three masks scatter.
        assert found["cover"][0] == pytest.approx(0.68, abs=0.15)
        assert found["cover"][1] == pytest.approx(0.95, abs=0.08)


def test_thin_plate_is_the_one_of_scipy():
    ground = peers.cut(peers.load("jacksboro"), np.random.default_rng(1), 96)
    mask, _ = peers.make_mask("blob 20 %", ground, np.random.default_rng(2))
    ours = peers.by_groundray(ground, mask, "--tension", 0)[0]
    # Floats of up to 1000 m are off by 3e-5 m.
    assert np.abs(ours - peers.thin_plate(ground, mask)).max() < 1e-4


def test_meshes_of_cgal_come_near_a_thin_plate():
    ground = peers.cut(peers.load("jacksboro"), np.random.default_rng(3), 96)
    mask, _ = peers.make_mask("blob 5 %", ground, np.random.default_rng(4))
    ours = peers.by_groundray(ground, mask, "--method", "cgal", cell_m=30)[0]
    # Holes whose parts touch at a sample alone are left.
    filled = mask & np.isfinite(ours)
    assert filled.sum() >= 0.9 * mask.sum()
    plate = peers.thin_plate(ground, mask)
    rmse = [np.sqrt(((z - ground)[filled] ** 2).mean()) for z in (ours, plate)]
    assert rmse[0] <= 1.1 * rmse[1]


def test_holes_stay_when_asked_to(tmp_path):
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


def test_what_is_written_is_a_dem_again(tmp_path):
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
        (["--method", "gdal", "--tension", "0.1"], "go with --method tension alone"),
        (["--tension", "1"], "tension = 1 must be 0 to below 1"),
        (["--bound", str(JACKSBORO)], "its samples are not those of the DEM"),
    ],
)
def test_faults_of_a_filling_are_told_and_nothing_is_written(tmp_path, options, message):
    peers.write_grid(tmp_path / "in.asc", np.ones((8, 8)))
    result = fill(tmp_path / "in.asc", "-o", tmp_path / "out.tif", *options)
    assert result.returncode == 1
    assert message in result.stderr
    assert not (tmp_path / "out.tif").exists()
