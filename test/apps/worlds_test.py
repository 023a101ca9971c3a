"""The scenes of docs/guide/worlds.md are short, and their lidars see what they are about."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from dataset_runs import PROGRAM
from plyfile import PlyData

ROOT = Path(__file__).resolve().parents[2]
IS_FULL = os.environ.get("GROUNDRAY_PROOF") == "full"
WORLDS = sorted((ROOT / "data/scenes/worlds").glob("*.yaml"))
QUICK = ("alpine_path", "gravel_pit")  # with erosion, an ecosystem, a walker and vehicles


def test_worlds_have_at_most_60_lines():
    assert len(WORLDS) == 11
    for world in [*WORLDS, ROOT / "data/scenes/forest_track.yaml"]:
        assert len(world.read_text().splitlines()) <= 60, world


@pytest.mark.parametrize("world", [w for w in WORLDS if IS_FULL or w.stem in QUICK])
def test_lidars_see_plants_and_objects_of_worlds(tmp_path, world):
    run = [PROGRAM, "generate", world, "-o", tmp_path / "out", "--sensor", "top"]
    done = subprocess.run(run, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    points = PlyData.read(tmp_path / "out/lidar/top/000000.ply")["vertex"].data
    labels, counts = np.unique(points["label"], return_counts=True)
    assert len(points) > 5000
    assert 1 in labels
    assert len(labels) >= 3, dict(zip(labels, counts, strict=True))
