"""Lidars with simulated light: the program's files, read by NumPy and plyfile."""

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
SCENE = (ROOT / "data/scenes/lidar_physics.yaml").read_text()
SPEED_OF_LIGHT = 299_792_458


def generate(scene, folder, *more):
    text = scene.replace("../terrain/", f"{ROOT / 'data/terrain'}/")
    (folder / "scene.yaml").write_text(text.replace("duration_s: 0.5", "duration_s: 0.1"))
    command = [PROGRAM, "generate", folder / "scene.yaml", "-o", folder / "out", *more]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


class Scan:
    def __init__(self, folder):
        stem = folder / "out/lidar/top/000000"
        ply = PlyData.read(f"{stem}.ply")
        self.comments = ply.comments
        self.echoes = ply["vertex"].data
        self.missed = PlyData.read(f"{stem}_no_returns.ply")["vertex"].data
        self.power_w = np.load(f"{stem}_wave.npy")
        self.index = np.load(f"{stem}_wave_index.npy")
        self.record = yaml.safe_load((folder / "out/dataset.yaml").read_text())

    def comment(self, pattern):
        return next(m for line in self.comments if (m := re.fullmatch(pattern, line)))


@pytest.fixture(scope="module")
def noisy(tmp_path_factory):
    folder = tmp_path_factory.mktemp("noisy")
    result = generate(SCENE, folder)
    assert result.returncode == 0, result.stderr
    return Scan(folder)


@pytest.fixture(scope="module")
def exact(tmp_path_factory):
    folder = tmp_path_factory.mktemp("exact")
    quiet = re.sub(r"      noise:\n(        .*\n)+", "      threshold_w: 1e-9\n", SCENE)
    quiet = quiet.replace("angular_jitter_mrad: 0.1", "angular_jitter_mrad: 0")
    quiet = quiet.replace("timing: constant_fraction", "timing: centre_of_gravity")
    quiet = quiet.replace("returns: dual", "returns: all").replace("range_step_mm: 2\n", "\n")
    result = generate(quiet, folder)
    assert result.returncode == 0, result.stderr
    return Scan(folder)


def test_every_pulse_has_echoes_or_a_reason(noisy):
    pulses = np.concatenate([np.unique(noisy.echoes["pulse"]), noisy.missed["pulse"]])
    assert np.array_equal(np.sort(pulses), np.arange(1809 * 16))  # 55.296 us in 0.1 s, 16 beams
    assert set(np.unique(noisy.missed["reason"])) <= {0, 1, 2, 3}
    assert {0, 2} <= set(np.unique(noisy.missed["reason"]))
    length = np.linalg.norm([noisy.missed[c].astype(float) for c in ("dx", "dy", "dz")], axis=0)
    assert np.abs(length - 1).max() < 1e-6


def test_ranges_are_multiples_of_their_step_and_near_the_truth(noisy):
    e = noisy.echoes
    surface = (e["kind"] == 0) & (e["second_share"] == 0) & (e["snr"] > 30)
    assert surface.sum() > 5000
    # Jitter moves ground seen at a grazing angle along the beam; look where it is steep.
    steep = surface & (e["incidence"] < 1.3)
    reported = np.linalg.norm([e[c][steep].astype(float) for c in "xyz"], axis=0)
    error = reported - e["range_true"][steep]
    assert abs(np.median(error)) < 0.02
    assert np.isnan(e["range_true"][e["kind"] != 0]).all()
    assert (e["return_index"] <= e["return_count"]).all()
    assert e["return_count"].max() <= 2  # dual


def test_centroids_of_waveforms_match_the_ranges(exact):
    """Computed twice from the same floats: the centre of gravity is the centroid."""
    interval_s = float(exact.comment(r"waveform_interval_s (\S+)")[1])
    e, index = exact.echoes, exact.index
    runs = {}
    for row in index:
        runs.setdefault(row["pulse"], []).append(row)
    checked = 0
    for echo in e[e["return_count"] == 1][::50]:
        if len(runs[echo["pulse"]]) != 1:
            continue
        (run,) = runs[echo["pulse"]]
        power_w = exact.power_w[run["first_sample"] : run["first_sample"] + run["count"]]
        power_w = power_w.astype(float)
        time_s = run["start_s"] + interval_s * np.arange(len(power_w))
        centroid_m = SPEED_OF_LIGHT / 2 * (power_w * time_s).sum() / power_w.sum()
        # The VLP-16's beams leave up to 11 mm from the origin, along z.
        assert abs(np.linalg.norm([echo[c] for c in "xyz"]) - centroid_m) < 0.012
        assert echo["amplitude"] == pytest.approx(power_w.max(), rel=0.02)  # between samples
        checked += 1
    assert checked > 100


def test_convergence_is_reported(exact):
    reported = yaml.safe_load(exact.comment(r"convergence (.*)")[1])
    assert reported["pulses"] == 1809 * 16 // 64 + 1
    assert 0 <= reported["other_echoes"] <= reported["pulses"]
    for name, limit in [("range", 0.1), ("true", 0.1)]:
        assert reported[f"{name}_rms_m"] <= reported[f"{name}_max_m"] < limit
    assert reported["share_rms"] <= reported["share_max"] <= 1
    assert exact.record["frames"][0]["convergence"] == reported


def test_a_folder_of_another_laser_or_material_is_rejected(noisy, tmp_path):
    material = tmp_path / "mine.yaml"
    text = (ROOT / "data/materials/dry_grass.yaml").read_text()
    scene = SCENE.replace("material: dry_grass", f"material: {material}")
    material.write_text(text)
    assert generate(scene, tmp_path).returncode == 0
    assert generate(scene, tmp_path, "--resume").returncode == 0
    material.write_text(re.sub(r"reflectances: \[([\d.]+)", "reflectances: [0.5", text))
    result = generate(scene, tmp_path)
    assert result.returncode == 1
    assert "another scene" in result.stderr


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"pulse_fwhm_ns: 5": "pulse_fwhm_ns: 5\n      pulse_shape: [0, 1, 0]"}, "pulse"),
        ({"sub_rays: 16 ": "sub_rays: 24 "}, "sub_rays = 24"),
        ({"material: dry_grass": "label: 1"}, "must have a material"),
        ({"visibility_m: 2000": "fog_range_m: 50", "overlap_m: [0.5, 1]": ""}, "needs overlap_m"),
        ({"wavelength_nm: 905": "wavelength_nm: 2200"}, "2200"),
    ],
)
def test_an_invalid_lidar_is_rejected_before_anything_is_written(tmp_path, changes, words):
    scene = SCENE
    for old, new in changes.items():
        assert old in scene
        scene = scene.replace(old, new)
    result = generate(scene, tmp_path)
    assert result.returncode == 1
    assert words in result.stderr
    assert "scene.yaml:" in result.stderr
    assert not (tmp_path / "out").exists()
