"""Datasets of scenes with wind."""

import numpy as np
import pytest
from dataset_runs import CAMERA, SCENE, files, generate, groundray
from plyfile import PlyData

PLANTS = """\
scatter:
  - {name: meadow, label: 5, density_per_m2: 0.3, scale: [0.7, 1.4],
     models: [{asset: grass_patch}, {asset: reed, weight: 0.2}]}
  - {name: trees, label: 6, density_per_m2: 0.01, scale: [0.7, 1.2], models: [{asset: birch}]}
"""
WIND = "wind: {speed_m_s: 9, from_deg: 300}\n"
WINDY = SCENE + PLANTS + WIND


def run(folder, name, *more, scene=WINDY):
    result = generate(folder, *more, scene=scene, out=name)
    assert result.returncode == 0, result.stderr
    return folder / name


def products(dataset):
    """Returns the files of all frames, without previews and the records of the run."""
    parts = ("top/0", "front/0", "eye/0")
    all_files = files(dataset)
    names = {n for n in all_files if any(part in n for part in parts)}
    return {n: all_files[n] for n in names if not n.endswith("_preview.png")}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return run(tmp_path_factory.mktemp("windy"), "out", "--threads", "2")


def test_bytes_do_not_depend_on_threads_and_shards(whole, tmp_path):
    assert len(products(whole)) > 9
    one = run(tmp_path, "one", "--threads", "1")
    assert files(one) == files(whole)
    shards = [run(tmp_path, f"shard{k}", "--shard", f"{k}/2", "--threads", "3") for k in (1, 2)]
    result = groundray("merge", *shards, "-o", tmp_path / "joined")
    assert result.returncode == 0, result.stderr
    assert files(tmp_path / "joined") == files(whole)


def test_scans_do_not_depend_on_other_sensors(whole, tmp_path):
    more = "  - {name: side, preset: velodyne_vlp16, mount: {translation_m: [0, 9, 3]}}\n"
    other = products(run(tmp_path, "more", scene=WINDY.replace("cameras:\n", more + "cameras:\n")))
    scans = [name for name in products(whole) if name.startswith("lidar/")]
    assert len(scans) > 5
    for name in scans:
        assert other[name] == products(whole)[name]


def test_no_wind_has_the_bytes_of_a_scene_without_wind(whole, tmp_path):
    calm = run(tmp_path, "calm", scene=SCENE + PLANTS)
    zero = run(tmp_path, "zero", scene=SCENE + PLANTS + "wind: {speed_m_s: 0}\n")
    assert products(zero) == products(calm)
    for name in ("lidar/top/000000.ply", "camera/eye/000000.exr"):
        assert products(whole)[name] != products(calm)[name]


def test_scans_have_the_velocity_of_plants(whole):
    scan = PlyData.read(sorted(whole.glob("*/top/*.ply"))[0])["vertex"].data
    speed_m_s = np.sqrt(scan["vx"] ** 2 + scan["vy"] ** 2 + scan["vz"] ** 2)
    assert speed_m_s[scan["label"] == 1].max() == 0
    assert speed_m_s[scan["label"] == 5].max() > 0.05


def test_info_states_the_wind(tmp_path):
    for wind in (WIND, ""):
        (tmp_path / "scene.yaml").write_text(SCENE + wind)
        (tmp_path / "camera.yaml").write_text(CAMERA)
        info = groundray("info", tmp_path / "scene.yaml")
        assert info.returncode == 0, info.stderr
        lines = [line for line in info.stdout.splitlines() if line.startswith("wind")]
        assert lines == (["wind      9 m/s from 300 degrees in W, turbulence 0.2"] if wind else [])


def test_light_sources_cannot_sway(tmp_path):
    (tmp_path / "lamp.yaml").write_text(
        "groundray_material: 1\nname: lamp\nemission_w_m2_sr: [5, 5, 5]\n"
        "spectrum: {wavelengths_nm: [400, 1000], reflectances: [0.5, 0.5]}\n"
    )
    tree = (
        "  - {name: tree, label: 6, asset: birch, at_m: [429444, 5150672], material: lamp.yaml}\n"
    )
    scene = SCENE.replace("lidars:\n", tree + "lidars:\n")
    result = generate(tmp_path, scene=scene + WIND)
    assert result.returncode == 1
    assert "scene.yaml:10:5: object 'tree': its material emits light" in result.stderr
    assert "add sway: {frequency_hz: 1, lean_deg: 0}" in result.stderr
