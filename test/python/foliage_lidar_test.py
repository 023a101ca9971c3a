"""An airborne lidar among plants: the share of its pulses that reach the ground follows from the
leaf area, projection and clumping that docs/reference/assets.md states."""

import re
from pathlib import Path

import groundray
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
PLANTS = 200_000
# A head whose axis points ahead, high up: lines across the flight, within a degree of straight
# down. Without a laser, each pulse is one ray and returns from what it hits first.
LIDAR = """\
groundray_lidar: 1
model: Line scanner
rotation: {rate_hz: 100, sense: clockwise, start_azimuth_deg: 0, field_of_view_deg: [-0.9, 0.9]}
firing_period_us: 0.2
beam_columns: [ring, elevation_deg, firing_time_us]
beams: [[0, 0, 0]]
"""
KINDS = (
    ("fern", "blades"),
    ("reed", "blades"),
    ("shrub", "cards"),
    ("bush", "geometry"),
    ("birch", "cards"),
    ("spruce", "geometry"),
    ("oak", "geometry"),
)


def stated(kind, leaves):
    """Returns leaf area, gap fraction, projection G and clumping straight down, from the page."""
    row = rf"^\| `{kind}` \| {leaves} \| ([\d.]+) \| [\d.]+ \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|"
    found = re.search(row, (ROOT / "docs/reference/assets.md").read_text(), re.MULTILINE)
    return [float(cell) for cell in found.groups()]


@pytest.mark.parametrize(("kind", "leaves"), KINDS)
def test_pulses_reach_the_ground_by_the_law_of_beer_and_lambert(tmp_path, kind, leaves):
    area_m2, gap, projection, clumping = stated(kind, leaves)
    # gap = exp(-clumping projection L), and L is the leaf area over that of the crown's outline.
    crown_m2 = area_m2 * projection * clumping / -np.log(gap)
    # Crowns at random places cover each other at random, so their gaps multiply as leaves do.
    density_per_m2 = 1 / (crown_m2 * (1 - gap))
    side_m = min(700, int(np.sqrt(PLANTS / density_per_m2)))
    geometry = {"leaves": "geometry"} if leaves == "geometry" else {}
    (tmp_path / "lidar.yaml").write_text(LIDAR)
    scene = groundray.scene(
        {
            "groundray": 1,
            "seed": 3,
            "duration_s": 2,
            "terrain": {},
            "platform": {
                "drive": {
                    "waypoints_m": [[0.05 * side_m, side_m / 2], [0.95 * side_m, side_m / 2]],
                    "speed_m_s": 0.45 * side_m,
                    "height_m": 28 * side_m,
                }
            },
            "scatter": [
                {
                    "name": "plants",
                    "label": 6,
                    "density_per_m2": density_per_m2,
                    "models": [{"asset": kind, "variant": v, **geometry} for v in (0, 1)],
                }
            ],
            "lidars": [{"name": "down", "file": "lidar.yaml", "mount": {"pitch_deg": 90}}],
        },
        folder=tmp_path,
        terrain=groundray.Terrain(np.zeros((side_m + 1, side_m + 1)), cell_m=1.0),
    )
    lidar = scene.lidar("down")
    labels = np.concatenate([lidar.scan(t_s=t)["label"] for t in lidar.times_s])
    assert len(labels) > 20_000
    reached = (labels == 1).mean()
    # Two standard errors of 0.006, for the trees, which are few; the table's rounding, 0.01; and
    # wood, which the table leaves out: 0.357 of the pulses pass oaks.
    assert reached == pytest.approx(np.exp(-1), abs=0.025)
