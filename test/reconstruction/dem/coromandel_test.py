"""Bush on steep land: the ground of a real airborne scan against the labels of its file.

The labels are the surveyor's: 1.7 % of the points are ground, and many points on it are "low
vegetation". So labelled ground should be classified as ground, and the surface should pass through
it; other points that are classified as ground are counted, with a lenient limit.
"""

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import laspy
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[3]
SHARED = Path(os.environ.get("GROUNDRAY_SHARED_DATA", ROOT.parent / "shared/data"))
SCAN = SHARED / "lidar/als_coromandel/points.laz"
GROUND, NOISE = 2, (7, 18)  # classes of the American Society for Photogrammetry

OPTIONS = {
    "one set": ("airborne",),
    # For land as steep as here and 32 points a square metre.
    "for this land": ("airborne", "slope=0.6", "threshold_m=0.3", "scaling_m=0.3"),
}
# Errors of the cloth simulation filter on samp11, bush on steep land of the ISPRS filter test, with
# the options that its authors chose for it: Zhang et al. (2016), table 3.
MOST_MISSED, MOST_TAKEN = 0.0723, 0.1844
# The surface has one height per cell of this size, and the median slope of the land is 0.8: heights
# may deviate by the rise within a cell, and their median by no more than half of that.
CELL_M, RISE = 1, 0.8


def found_in(points: np.ndarray, folder: Path, *words: str) -> np.ndarray:
    np.save(folder / "in.npy", points)
    program = ROOT / "build/release/bin/filter_ground"
    subprocess.run([program, folder / "in.npy", folder / "out.npy", *words], check=True)
    return np.load(folder / "out.npy")


def read_scan() -> tuple[np.ndarray, np.ndarray]:
    """Points near 0, and their classes."""
    if not SCAN.exists():
        pytest.skip(f"there is no {SCAN}; set GROUNDRAY_SHARED_DATA")
    scan = laspy.read(SCAN)
    points = np.column_stack([scan.x, scan.y, scan.z])
    points[:, :2] -= np.floor(points[:, :2].min(axis=0))
    return points, np.asarray(scan.classification)


def test_labelled_ground_is_found(
    tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    points, labels = read_scan()
    is_ground, is_noise = labels == GROUND, np.isin(labels, NOISE)
    errors = {}
    for name, words in OPTIONS.items():
        found = found_in(points, tmp_path, *words)
        is_found = found["class"] == 0
        missed = np.mean(~is_found[is_ground])
        taken = np.mean(is_found[~is_ground & ~is_noise])
        total = np.mean((is_found != is_ground)[~is_noise])
        off_m = found["height_m"][is_ground]
        middle_m = np.median(off_m)
        spread_m = 1.4826 * np.median(np.abs(off_m - middle_m))
        record_property(f"{name}: type I, II, total", f"{missed:.4f} {taken:.4f} {total:.4f}")
        record_property(f"{name}: ground less surface", f"{middle_m:.3f} m, NMAD {spread_m:.3f} m")
        assert missed <= MOST_MISSED
        assert taken <= MOST_TAKEN
        assert abs(middle_m) <= RISE * CELL_M / 4
        assert spread_m <= RISE * CELL_M / 2
        errors[name] = missed, taken
    assert all(np.less(errors["for this land"], errors["one set"]))
