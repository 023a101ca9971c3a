"""A scene on rough ground, small enough for tests, and the programs of the build."""

import os
import subprocess
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
BIN = Path(os.environ.get("GROUNDRAY", ROOT / "build/release/bin/groundray")).parent
PACKAGE = ROOT / "build/release/python"

CELL_M = 0.5
# Two sweeps of a lidar with noise and light, of one without; images of a camera with an imager.
SENSORS = {
    "lidars": [
        {
            "name": "roof",
            "preset": "velodyne_vlp16",
            "mount": {"translation_m": [0, 0, 1.5]},
            "range_noise_sigma_m": 0.02,
        },
        {
            "name": "light",
            "preset": "velodyne_vlp16",
            "mount": {"translation_m": [0, 0, 1.2], "pitch_deg": 10},
            "beam": {
                "profile": "gaussian",
                "width": "inverse_e_square",
                "divergence_mrad": [3, 1.5],
                "sub_rays": 16,
                "most_sub_rays": 16,
            },
            "laser": {"wavelength_nm": 905, "pulse_energy_nj": 300, "pulse_fwhm_ns": 5},
            "receiver": {
                "aperture_mm": 20,
                "efficiency": 0.6,
                "response_fwhm_ns": 3,
                "noise": {"nep_w_per_sqrt_hz": 1.0e-12, "false_alarm_rate_hz": 50},
            },
            "no_returns": "report",
            "waveforms": "keep",
        },
    ],
}
CAMERA = """\
groundray_camera: 1
model: A small camera
size_px: [48, 36]
lens:
  pinhole:
    focal_px: [40, 40]
    centre_px: [23.5, 17.5]
rate_hz: 10
shutter: {exposure_ms: 2}
aperture: {f_number: 4}
imager: {pixel_pitch_um: 5, filter: rggb, quantum_efficiency: 0.5, full_well_e: 10000,
         gain_dn_e: 0.4, bits: 12, read_noise_e: 3}
sampling: {samples: 4, most_samples: 4, depth: 2}
products: [radiance, truth, bound, flow, coverage, irradiance, photons, electrons, raw, picture]
"""


def heights_m(rows=160, columns=200, seed=11):
    """Returns rough ground of hills and noise."""
    row, column = np.mgrid[:rows, :columns]
    hills = 2 * np.sin(column / 17) * np.cos(row / 23) + 0.5 * np.sin(row / 5)
    return (hills + np.random.default_rng(seed).normal(0, 0.05, hills.shape)).astype(np.float32)


def spec(folder, *, camera=False):
    """Returns a scene as dicts, without terrain."""
    all_of_it = {
        "groundray": 1,
        "seed": 7,
        "duration_s": 0.25,
        "terrain": {"material": "dry_grass"},
        "platform": {
            "drive": {
                "waypoints_m": [[30, 30], [45, 40]],
                "speed_m_s": 5,
                "height_m": 0.4,
            }
        },
        "objects": [
            {
                "name": "rock",
                "label": 70,
                "asset": "rock",
                "size_m": 1.5,
                "at_m": np.array([38, 35.3]),
                "stance": "on_slope",
            }
        ],
        **SENSORS,
    }
    if camera:
        (folder / "eye.yaml").write_text(CAMERA)
        all_of_it["sky"] = {
            "analytic": {},
            "sun": {"utc": "2026-06-21T16:30:00Z", "latitude_deg": 46.5, "longitude_deg": -93.9},
        }
        all_of_it["cameras"] = [
            {
                "name": "eye",
                "file": "eye.yaml",
                "mount": {"translation_m": [0.3, 0, 1.4], "pitch_deg": 12},
            }
        ]
    return all_of_it


def write(folder):
    """Writes ground.tif and scene.yaml, a scene on it; returns the terrain."""
    import groundray  # here, because other users of this module need no package
    from groundray._scene import to_yaml

    terrain = groundray.Terrain(heights_m(), CELL_M)
    terrain.save(folder / "ground.tif")
    scene = spec(folder)
    scene["terrain"]["dem"] = "ground.tif"
    (folder / "scene.yaml").write_text(to_yaml(scene))
    return terrain


def run(program, *arguments):
    """Runs one of the build's programs; its output is shown if it fails."""
    command = [str(BIN / program), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout
