"""Scenes with objects through the program: the trail that ships, read by NumPy and plyfile."""

import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
import yaml
from plyfile import PlyData

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("GROUNDRAY", ROOT / "build/release/bin/groundray"))
SCENE = (ROOT / "data/scenes/offroad_trail.yaml").read_text()


def run(command, scene, folder):
    text = scene.replace("../terrain/", f"{ROOT / 'data/terrain'}/")
    text = text.replace("file: rosette", f"file: {ROOT / 'data/scenes/rosette'}")
    (folder / "scene.yaml").write_text(text.replace("duration_s: 1\n", "duration_s: 0.1\n"))
    arguments = [PROGRAM, command, folder / "scene.yaml"]
    if command == "generate":
        arguments += ["-o", folder / "out"]
    return subprocess.run(arguments, capture_output=True, text=True, timeout=300)


@pytest.fixture(scope="module")
def trail(tmp_path_factory):
    folder = tmp_path_factory.mktemp("trail")
    result = run("generate", SCENE, folder)
    assert result.returncode == 0, result.stderr
    return folder / "out"


def test_instances_are_those_that_the_dataset_lists(trail):
    record = yaml.safe_load((trail / "dataset.yaml").read_text())
    firsts = [group["first_instance"] for group in record["objects"]]
    counts = [group["count"] for group in record["objects"]]
    assert sorted(firsts) == list(np.cumsum([1, *counts[:-1]]))
    for sensor in ("top", "front"):
        scan = PlyData.read(trail / f"lidar/{sensor}/000000.ply")["vertex"].data
        seen = set()
        for group in record["objects"]:
            first, count = group["first_instance"], group["count"]
            mine = (first <= scan["instance"]) & (scan["instance"] < first + count)
            assert (scan["label"][mine] == group["label"]).all()
            if mine.any():
                seen.add(group["name"])
        assert (scan["label"][scan["instance"] == 0] == 1).all()
        assert {"grass", "shrubs", "trees"} <= seen


def test_only_the_leader_moves(trail):
    scan = PlyData.read(trail / "lidar/top/000000.ply")["vertex"].data
    speed = np.linalg.norm([scan[c].astype(float) for c in ("vx", "vy", "vz")], axis=0)
    leader = scan["label"] == 10
    assert leader.sum() > 20
    assert (speed[~leader] == 0).all()
    in_plan = np.hypot(scan["vx"][leader], scan["vy"][leader])
    assert abs(np.median(in_plan) - 8) < 1  # m/s, as it drives; points turn with the body


def test_info_counts_what_stands_there(trail, tmp_path):
    record = yaml.safe_load((trail / "dataset.yaml").read_text())
    result = run("info", SCENE, tmp_path)
    assert result.returncode == 0, result.stderr
    for group in record["objects"]:
        assert f"{group['name']}: {group['count']} of label {group['label']}" in result.stdout


def test_a_laser_asks_for_materials(tmp_path):
    light = """    laser: {wavelength_nm: 905, pulse_energy_nj: 300, pulse_fwhm_ns: 5}
    receiver: {aperture_mm: 20, threshold_w: 1.0e-8, timing: peak, returns: dual}
"""
    scene = SCENE.replace("    preset: velodyne_vlp16\n", "    preset: velodyne_vlp16\n" + light)
    result = run("generate", scene, tmp_path)
    assert result.returncode == 0, result.stderr
    scan = PlyData.read(tmp_path / "out/lidar/top/000000.ply")["vertex"].data
    assert {1, 2, 3, 5, 10} <= set(np.unique(scan["label"]))
    board = "    asset: calibration_board\n    square_m: 0.1\n"
    scene = re.sub(r"    asset: person_cylinder\n    material: dry_grass\n", board, scene)
    result = run("info", scene, tmp_path)
    assert result.returncode == 1
    assert "object 'person': its surface 'white_paint' has no material" in result.stderr
