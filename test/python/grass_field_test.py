"""A field of 10^8 blades of grass: memory, time to the first frame, rate of a lidar in it, wind."""

import os
import subprocess
import time

import groundray
import numpy as np
from dataset_runs import PROGRAM, ROOT
from plyfile import PlyData

DEM = ROOT / "data/terrain/prairie_1m.tif"
# Patches of 1500 blades on 399 m x 399 m: 1.03e8 blades.
FIELD = """\
scatter:
  - {name: grass, label: 2, density_per_m2: 0.43,
     models: [{asset: grass_patch, variant: 1}, {asset: grass_patch, variant: 2},
              {asset: grass_patch, variant: 3}, {asset: grass_patch, variant: 4}]}
"""
IS_FULL = os.environ.get("GROUNDRAY_PROOF") == "full"
SCENE = f"""\
groundray: 1
seed: 4
duration_s: 0.3
terrain: {{dem: {DEM}, material: dry_soil}}
platform:
  drive: {{waypoints_m: [[429440, 5150660], [429448, 5150668]], speed_m_s: 8, height_m: 0.5}}
lidars: [{{name: top, preset: velodyne_vlp16, mount: {{translation_m: [0, 0, 1.5]}}}}]
"""


def test_first_frame_takes_less_than_2_gb_and_a_minute(tmp_path):
    (tmp_path / "field.yaml").write_text(SCENE + FIELD)
    command = [
        PROGRAM,
        "generate",
        tmp_path / "field.yaml",
        "-o",
        tmp_path / "out",
        "--frames",
        "0",
    ]
    began = time.monotonic()
    process = subprocess.Popen(list(map(str, command)), stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.monotonic() - began
    assert status == 0
    print(f"{seconds:.1f} s, {usage.ru_maxrss / 1024:.0f} MiB")
    scan = PlyData.read(tmp_path / "out/lidar/top/000000.ply")["vertex"].data
    assert (scan["label"] == 2).sum() > 5_000
    assert usage.ru_maxrss * 1024 <= 2e9
    assert seconds <= 60


def scan_rate(scene):
    """Returns scans per CPU second, of the fastest of several."""
    lidar = scene.lidar("top")
    best = np.inf
    for _ in range(5):
        began = time.process_time()
        lidar.scan(frame=0)
        best = min(best, time.process_time() - began)
    return 1 / best


def test_lidar_in_the_field_keeps_its_share_of_the_rate_on_bare_ground(tmp_path):
    field = groundray.scene(SCENE + FIELD, folder=tmp_path)
    bare = groundray.scene(SCENE, folder=tmp_path)
    ratio = np.median([scan_rate(field) / scan_rate(bare) for _ in range(5)])
    print(f"ratio {ratio:.3f}")
    # 0.27 was measured on a quiet machine; other programs that use the caches slow down the field
    # most, so only proofs require a quarter.
    assert ratio >= (0.25 if IS_FULL else 0.15)


def test_plants_in_wind_are_the_same_from_any_viewpoint(tmp_path):
    """The same rays, at several times, in scenes whose vehicles and lidars are elsewhere."""
    windy = SCENE + FIELD + "wind: {speed_m_s: 9, from_deg: 300}\n"
    drive = "[[429440, 5150660], [429448, 5150668]]"
    assert drive in windy
    scenes = [
        groundray.scene(windy.replace(drive, each), folder=tmp_path)
        for each in (drive, "[[429300, 5150800], [429310, 5150800]]")
    ]
    random = np.random.default_rng(8)
    count = 20_000
    places = random.uniform(-150, 150, (count, 2))
    origins = np.c_[places, scenes[0].heights_at(places) + random.uniform(0.1, 2, count)]
    directions = random.normal(size=(count, 3))
    directions[:, 2] -= 1
    for t_s in (0, 0.137, 0.3):
        here, there = (scene.cast_rays(origins, directions, t_s=t_s) for scene in scenes)
        assert (here["label"] == 2).sum() > count / 10
        for column in here.columns:
            np.testing.assert_array_equal(here[column], there[column])
