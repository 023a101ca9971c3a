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


LIGHT = """
    beam: {profile: gaussian, divergence_mrad: [1, 1], aperture_mm: [10, 10], sub_rays: 16}
    laser: {wavelength_nm: 905, pulse_energy_nj: 300, pulse_fwhm_ns: 5}
    receiver: {aperture_mm: 20, threshold_w: 1.0e-9, timing: peak,
               returns: strongest, intensity: reflectance}
"""

GROUND = f"""
groundray: 1
seed: 1
duration_s: 0.1
terrain:
  dem: ../terrain/prairie_1m.tif
  material: dry_soil
  label: 1
PLACE
platform:
  drive:
    waypoints_m: [[429450, 5150684], [429452, 5150684]]
    speed_m_s: 0.1
    height_m: 1
lidars:
  - name: top
    preset: velodyne_vlp16
    mount: {{translation_m: [0, 0, 1]}}
    range_noise_sigma_m: 0
{LIGHT}"""

# The DEM's square in UTM 15 N, west and east of x = 429452.3125 m.
CORNERS = ["429252.3125", "5150885.4252", "429652.3125", "5150485.4252"]


def geotiff(path, pixels, *options):
    """Writes pixels (H x W x bands, bytes) over all of the DEM, through GDAL."""
    rows, columns, bands = pixels.shape
    kind = {1: b"P5", 3: b"P6"}[bands]
    raw = path.with_suffix(".pnm")
    raw.write_bytes(b"%s\n%d %d\n255\n" % (kind, columns, rows) + pixels.tobytes())
    place = ["-a_srs", "EPSG:26915", "-a_ullr", *CORNERS]
    subprocess.run(["gdal_translate", "-q", *place, *options, raw, path], check=True)
    return path


def reflectances(folder):
    """Reflectance of the ground west and east of the middle by the lidar; labels; eastings."""
    scan = PlyData.read(folder / "out/lidar/top/000000.ply")["vertex"].data
    record = yaml.safe_load((folder / "out/dataset.yaml").read_text())
    east = scan["world_x"] + record["origin_w_m"][0] - 429452.3125
    matt = scan["intensity"] / np.cos(scan["incidence"])
    clear = (scan["share"] > 0.99) & (np.abs(east) > 1) & (np.cos(scan["incidence"]) > 0.2)
    return matt[clear & (east < 0)], matt[clear & (east > 0)], scan["label"], east


def test_an_orthophoto_in_another_crs_brightens_and_darkens_the_ground(tmp_path):
    pixels = np.zeros((64, 64, 3), np.uint8)
    pixels[:, :32], pixels[:, 32:] = 188, 137  # linear 0.502886 and 0.250158: IEC 61966-2-1
    photo = geotiff(tmp_path / "utm.tif", pixels)
    turned = tmp_path / "photo.tif"
    subprocess.run(["gdalwarp", "-q", "-t_srs", "EPSG:4326", photo, turned], check=True)
    scene = GROUND.replace("PLACE", f"  orthophoto: {turned}")
    result = run("generate", scene, tmp_path)
    assert result.returncode == 0, result.stderr
    west, east, _, _ = reflectances(tmp_path)
    assert len(west) > 100
    assert len(east) > 100
    ratio = np.median(west) / np.median(east)
    assert abs(ratio - 0.502886 / 0.250158) < 0.01  # pulses on slopes have longer, lower echoes


def test_a_mask_lays_gravel_over_soil(tmp_path):
    pixels = np.zeros((64, 64, 1), np.uint8)
    pixels[:, 32:] = 255
    mask = geotiff(tmp_path / "mask.tif", pixels)
    layer = f"  cover:\n    - {{material: gravel, label: 9, mask: {mask}, mask_full: 255}}"
    result = run("generate", GROUND.replace("PLACE", layer), tmp_path)
    assert result.returncode == 0, result.stderr
    west, east, label, side = reflectances(tmp_path)
    # Pixels of the mask are 6.25 m wide and linear between their centres.
    assert (label[side < -0.1] == 1).all()
    assert (label[side > 0.1] == 9).all()
    assert set(np.unique(label)) == {1, 9}
    assert abs(np.median(west) / np.median(east) - 1) > 0.05
    result = run("generate", GROUND.replace("PLACE", layer.replace("255", "1")), tmp_path)
    assert result.returncode == 1
    assert "cover, layer 1" in result.stderr
    assert "mask_full: 255" in result.stderr


def test_images_of_the_ground_that_are_missing_are_named(tmp_path):
    for place in ("  orthophoto: none.tif", "  texture: {albedo: none.png, size_m: 1}"):
        result = run("generate", GROUND.replace("PLACE", place), tmp_path)
        assert result.returncode == 1
        assert "none." in result.stderr
        assert "no such file" in result.stderr.lower()
        assert not (tmp_path / "out").exists()
