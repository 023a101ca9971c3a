"""What the stereo pair of data/scenes/stereo_trail.yaml adds to its lidar, and what the report of
`groundray reconstruct dem` says about matches.

The oracle is the triangles of the scanned DEM, computed by NumPy.
"""

import json
import re

import numpy as np
import pytest
from dem_runs import PRAIRIE, ROOT, Raster, done, made, nmad_of, triangle_heights

SCENE = ROOT / "data/scenes/stereo_trail.yaml"
DEM = ("--cell-m", "0.1", "--no-fill", "--sight", "none")


@pytest.fixture(scope="module")
def trail(tmp_path_factory):
    """The scene's data, and DEMs of its lidar alone and of both kinds of sensors."""
    folder = tmp_path_factory.mktemp("stereo_trail")
    done("generate", SCENE, "-o", folder / "data")
    made(folder / "data", *DEM, "--no-stereo", "-o", folder / "lidar.tif")
    said = made(
        *(folder / "data", *DEM, "--farthest-depth-m", "12", "-o", folder / "both.tif"),
        *("--report", folder / "both.json"),
    )
    (folder / "said.txt").write_text(said)
    return folder


def test_stereo_measures_the_ground_within_the_lidar_s_rings(trail, tmp_path):
    """The lowest ring, 15 degrees down, meets level ground 8.6 m from the mast."""
    dems = {name: Raster(trail / f"{name}.tif", tmp_path) for name in ("lidar", "both")}
    measured = {name: np.count_nonzero(dem["source"]) for name, dem in dems.items()}
    both = dems["both"]
    stereo = both["source"] == 2
    assert np.count_nonzero(stereo) > 2000
    assert measured["both"] > measured["lidar"] + 2000
    error = both["elevation"] - triangle_heights(Raster(PRAIRIE, tmp_path), *both.places())
    # As of lidar and stereo in the closed loop: see reconstruct_dem_test.py. Errors of a pair are
    # correlated, so the normalised ones of three pairs only have an upper limit.
    assert nmad_of(error[stereo]) < 0.008
    assert np.quantile(np.abs(error[stereo]), 0.95) < 0.05
    assert 0.3 < np.sqrt(np.mean(error[stereo] ** 2 / both["variance"][stereo])) < 1.15


def test_the_report_says_why_pixels_are_no_points(trail):
    pairs = json.loads((trail / "both.json").read_text())["pairs"]
    assert [pair["name"] for pair in pairs] == [f"pair/{i:06}" for i in range(3)]
    sums = {}
    sizes = {sum(pair["pixels"].values()) for pair in pairs}
    assert len(sizes) == 1  # that of the rectified image, about 640 x 480
    assert sizes.pop() == pytest.approx(640 * 480, rel=0.2)
    for pair in pairs:
        pixels = pair["pixels"]
        used = ("points", "between", "too_uncertain", "out_of_limits")
        assert pair["points"] == pixels["points"]
        assert pair["matched"] == sum(pixels[key] for key in used)
        # A point of each sixth row and column.
        assert pixels["between"] == pytest.approx(35 / 36 * pair["matched"], rel=0.02)
        for key, count in pixels.items():
            sums[key] = sums.get(key, 0) + count
    said = (trail / "said.txt").read_text().split("pixels of the pairs:\n")[1]
    printed = re.findall(r"^ +(\d+) +([\d.]+) %  \S", said, flags=re.MULTILINE)
    assert [int(count) for count, _ in printed] == list(sums.values())
    shares = [float(share) for _, share in printed]
    assert sum(shares) == pytest.approx(100, abs=0.05 * len(shares))
