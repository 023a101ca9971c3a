"""A dataset to export, and the command that exports it."""

import atexit
import functools
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("GROUNDRAY", ROOT / "build/release/bin/groundray"))
PACKAGE = Path(os.environ.get("GROUNDRAY_PACKAGE", ROOT / "build/release/python"))
if not (PACKAGE / "groundray").is_dir():
    pytest.skip(f"{PACKAGE} has no package groundray: build it first", allow_module_level=True)
if str(PACKAGE) not in sys.path:
    sys.path.insert(0, str(PACKAGE))

from groundray.dataset import Dataset  # noqa: E402
from groundray.export import command  # noqa: E402
from groundray.export.scan import read_scan  # noqa: E402

CAMERA = """\
groundray_camera: 1
model: A small camera
size_px: [96, 72]
lens:
  brown_conrady:
    focal_px: [80, 79]
    centre_px: [47.2, 35.9]
    coefficients: [-0.2, 0.04, 0.001, -0.002]
shutter: {exposure_ms: 2}
aperture: {f_number: 4}
imager: {pixel_pitch_um: 5, filter: rggb, quantum_efficiency: 0.5, full_well_e: 10000,
         gain_dn_e: 0.4, bits: 12, read_noise_e: 3}
sampling: {samples: 4, most_samples: 4, depth: 2}
products: [truth, picture]
"""
EYE = """\
groundray_camera: 1
model: A small fisheye whose rows are exposed one after another
size_px: [64, 60]
lens:
  kannala_brandt:
    focal_px: [24, 24.5]
    centre_px: [31.2, 30.1]
    coefficients: [0.003, 0.0007, -0.002, 0.0002]
rate_hz: 10
first_ms: 40
shutter: {exposure_ms: 4, row_us: 30}
products: [truth]
"""
# top has light, and so echoes in pairs; front sees exactly, and its points are moved to the stamp.
SCENE = f"""\
groundray: 1
seed: 5
classes: {{10: vehicle, 40: ground, 70: rock, 72: grass}}
duration_s: 0.3
terrain:
  dem: {ROOT / "data/terrain/prairie_1m.tif"}
  material: dry_soil
  label: 40
sky:
  analytic: {{}}
  sun: {{utc: 2026-06-21T16:30:00Z, latitude_deg: 46.506, longitude_deg: -93.92}}
platform:
  drive:
    waypoints_m: [[429436, 5150654], [429441, 5150659], [429448, 5150661]]
    speed_m_s: 12
    height_m: 0.5
objects:
  - {{name: rock, label: 70, asset: rock, size_m: 2, at_m: [429446, 5150668], stance: on_slope}}
  - name: leader
    label: 10
    asset: vehicle
    drive:
      waypoints_m: [[429448, 5150666], [429458, 5150672]]
      speed_m_s: 8
      height_m: 0
scatter:
  - name: grass
    label: 72
    density_per_m2: 0.5
    scale: [0.6, 1.4]
    models: [{{asset: grass_tuft, variant: 1}}]
lidars:
  - name: top
    preset: velodyne_vlp16
    mount: {{translation_m: [0, 0, 1.5], yaw_deg: 5}}
    beam: {{divergence_mrad: [3, 1.5], aperture_mm: [10, 8], sub_rays: 16}}
    laser: {{wavelength_nm: 905, pulse_energy_nj: 300, pulse_fwhm_ns: 5}}
    receiver: {{aperture_mm: 20, efficiency: 0.6, timing: constant_fraction, returns: all,
               intensity: reflectance}}
  - name: front
    preset: velodyne_vlp16
    points: at_stamp
    mount: {{translation_m: [1.2, 0.1, 0.8], pitch_deg: 4, yaw_deg: -20}}
  - {{name: bare-16, preset: velodyne_vlp16, mount: {{translation_m: [0.5, 0, 1.6]}}}}
cameras:
  - name: left
    file: camera.yaml
    mount: {{translation_m: [1, 0.2, 1.2], pitch_deg: 8}}
    trigger: {{lidar: top, delay_ms: 20}}
    project: [front, bare-16]
  - name: right
    file: camera.yaml
    mount: {{translation_m: [1.01, -0.2, 1.21], pitch_deg: 9, yaw_deg: 2}}
    trigger: {{lidar: top, delay_ms: 20}}
  - name: eye
    file: eye.yaml
    mount: {{translation_m: [1, 0, 1.4], pitch_deg: 20}}
    project: [bare-16]
stereo:
  - {{name: pair, left: left, right: right, images: rectified}}
"""


@functools.cache
def run_folder() -> Path:
    """The dataset of the scene, made once for all tests."""
    folder = Path(tempfile.mkdtemp(prefix="groundray_export_"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    (folder / "scene.yaml").write_text(SCENE)
    (folder / "camera.yaml").write_text(CAMERA)
    (folder / "eye.yaml").write_text(EYE)
    done = subprocess.run(
        [PROGRAM, "generate", "scene.yaml", "-o", "run"],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        cwd=folder,
    )
    assert done.returncode == 0, done.stderr
    return folder / "run"


def dataset() -> Dataset:
    return Dataset(run_folder())


def export(form: str, out: Path, *options: str, source: Path | None = None) -> int:
    """Runs the command in this process."""
    return command.main([str(source or run_folder()), "--to", form, "-o", str(out), *options])


def names_in(folder):
    return sorted(each.name for each in folder.iterdir())


def fails(capsys, run, form, *options, code=1):
    """Returns the command's only line; nothing is written, not even a parent folder."""
    before = names_in(run.parent)
    assert export(form, run.parent / "a/b/out", *options, source=run) == code
    reported = capsys.readouterr()
    assert reported.out == ""
    assert names_in(run.parent) == before
    (line,) = reported.err.splitlines()
    assert line.startswith("groundray-export: ")
    return line


def scans(name: str):
    """Yields the scans of a lidar read by plyfile, with their stamps in seconds."""
    import plyfile

    record = yaml.safe_load((run_folder() / "dataset.yaml").read_text())
    frames = [each for each in record["frames"] if each["sensor"] == name]
    for each in frames:
        file = run_folder() / f"lidar/{name}/{each['frame']:06}.ply"
        yield each["stamp_s"], plyfile.PlyData.read(file)["vertex"].data


def world_of(rows) -> np.ndarray:
    return np.stack([rows[f"world_{axis}"] for axis in "xyz"], axis=-1)


def still(rows) -> np.ndarray:
    """Returns a mask of points on static objects."""
    return (rows["vx"] == 0) & (rows["vy"] == 0) & (rows["vz"] == 0)


def mount(name: str, key: str) -> np.ndarray:
    """Returns a pose of the calibration, by SciPy."""
    from scipy.spatial.transform import Rotation

    said = yaml.safe_load((run_folder() / f"calibration/{name}.yaml").read_text())[key]
    X = np.eye(4)
    X[:3, :3] = Rotation.from_quat(said["rotation_xyzw"]).as_matrix()
    X[:3, 3] = said["translation_m"]
    return X


def poses_between(name: str, times_s) -> tuple[np.ndarray, np.ndarray]:
    """Returns rotations and positions of a sensor in D by slerp and linear interpolation."""
    from scipy.spatial.transform import Rotation, Slerp

    table = np.loadtxt(run_folder() / f"poses/{name}.tum")
    rotations = Slerp(table[:, 0], Rotation.from_quat(table[:, 4:]))(times_s).as_matrix()
    places = [np.interp(times_s, table[:, 0], table[:, i]) for i in (1, 2, 3)]
    return rotations, np.stack(places, axis=-1)


def pose_between(name: str, time_s: float) -> np.ndarray:
    """Returns one of these poses as a 4 x 4 matrix."""
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = poses_between(name, time_s)
    return X


__all__ = [
    "PACKAGE",
    "dataset",
    "export",
    "fails",
    "mount",
    "names_in",
    "pose_between",
    "poses_between",
    "read_scan",
    "run_folder",
    "scans",
    "still",
    "world_of",
]
