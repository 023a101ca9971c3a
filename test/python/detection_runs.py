"""A dataset with boxes: what moves, and what hides it, seen by a stereo pair and two lidars."""

import atexit
import functools
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import OpenEXR
import yaml
from export_runs import PROGRAM, ROOT, run_folder
from plyfile import PlyData
from scipy.spatial.transform import Rotation, Slerp

CAMERA = """\
groundray_camera: 1
model: A small pinhole
size_px: [96, 72]
lens: {pinhole: {focal_px: [66, 67], centre_px: [46.2, 36.9]}}
shutter: {exposure_ms: 2}
aperture: {f_number: 4}
imager: {pixel_pitch_um: 5, filter: rggb, quantum_efficiency: 0.5, full_well_e: 10000,
         gain_dn_e: 0.4, bits: 8, read_noise_e: 3}
sampling: {samples: 2, most_samples: 2, depth: 2}
products: [truth, picture, boxes]
"""
# The car drives ahead and turns, the walker crosses behind trees, and trees leave the image.
SCENE = f"""\
groundray: 1
seed: 11
classes: {{4: rock, 6: tree, 10: vehicle, 11: person, 40: ground}}
duration_s: 1.2
terrain:
  dem: {ROOT / "data/terrain/prairie_1m.tif"}
  material: dry_soil
  label: 40
sky:
  analytic: {{}}
  sun: {{utc: 2026-06-21T16:30:00Z, latitude_deg: 46.506, longitude_deg: -93.92}}
platform:
  drive:
    waypoints_m: [[429436, 5150654], [429441, 5150659], [429448, 5150662]]
    speed_m_s: 4
    height_m: 0.5
objects:
  - {{name: rock, label: 4, asset: rock, size_m: 2, at_m: [429445, 5150666], stance: on_slope}}
  - name: car
    label: 10
    asset: pickup
    drive:
      waypoints_m: [[429447, 5150662], [429457, 5150668], [429467, 5150668]]
      speed_m_s: 6
      height_m: 0
  - name: walker
    label: 11
    asset: person
    drive: {{waypoints_m: [[429448, 5150671], [429444, 5150672]], speed_m_s: 1.5, height_m: 0}}
scatter:
  - {{name: trees, label: 6, density_per_m2: 0.005, scale: [0.3, 0.6], models: [{{asset: birch}}]}}
lidars:
  - name: top
    preset: velodyne_vlp16
    boxes: report
    mount: {{translation_m: [0, 0, 1.5], yaw_deg: 5}}
  - {{name: front, preset: velodyne_vlp16, mount: {{translation_m: [1.2, 0.1, 0.8]}}}}
cameras:
  - name: left
    file: camera.yaml
    mount: {{translation_m: [1, 0.2, 1.2], pitch_deg: 3}}
    trigger: {{lidar: top, delay_ms: 20}}
  - name: right
    file: camera.yaml
    mount: {{translation_m: [1.01, -0.2, 1.21], pitch_deg: 3, yaw_deg: 1}}
    trigger: {{lidar: top, delay_ms: 20}}
stereo:
  - {{name: pair, left: left, right: right, images: rectified}}
"""
FORMS = ["coco", "kitti-object", "nuscenes"]


@functools.cache
def boxed_folder() -> Path:
    """The dataset of the scene, made once for all tests."""
    folder = Path(tempfile.mkdtemp(prefix="groundray_detection_"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    (folder / "scene.yaml").write_text(SCENE)
    (folder / "camera.yaml").write_text(CAMERA)
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


def source_of(form: str | None) -> Path:
    """Returns the dataset that tests of a format export."""
    return boxed_folder() if form in FORMS else run_folder()


def copy_of(request, folder: Path) -> Path:
    """Copies the dataset of the test's parameter `form`, if it has one, for it to modify."""
    call = getattr(request.node, "callspec", None)
    return shutil.copytree(source_of(call.params.get("form") if call else None), folder)


def boxes_of(sensor: str, frame: int, run: Path | None = None) -> np.ndarray:
    """Returns the table of boxes of a frame."""
    (file,) = (run or boxed_folder()).glob(f"*/{sensor}/{frame:06}_boxes.npy")
    return np.load(file)


def instances_of(camera: str, frame: int) -> np.ndarray:
    """Returns the instance of each pixel, height x width."""
    file = boxed_folder() / f"camera/{camera}/{frame:06}.exr"
    with OpenEXR.File(str(file), separate_channels=True) as image:
        return image.channels()["Instance"].pixels.astype(int)


@functools.cache
def stamps_s(sensor: str) -> list[float]:
    """Returns the stamps of a sensor's frames."""
    record = yaml.safe_load((boxed_folder() / "dataset.yaml").read_text())
    return [each["stamp_s"] for each in record["frames"] if each["sensor"] == sensor]


@functools.cache
def calibration(sensor: str) -> dict:
    return yaml.safe_load((boxed_folder() / f"calibration/{sensor}.yaml").read_text())


def matrix(rotation: Rotation, place_m) -> np.ndarray:
    """Returns a pose as a 4 x 4 matrix."""
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = rotation.as_matrix(), place_m
    return X


def mount_of(sensor: str) -> np.ndarray:
    """Returns the pose of a sensor in the body, by SciPy."""
    said = calibration(sensor)
    said = said.get("X_BC") or said["X_BS"]
    return matrix(Rotation.from_quat(said["rotation_xyzw"]), said["translation_m"])


@functools.cache
def path_of(sensor: str) -> tuple[np.ndarray, Slerp]:
    table = np.loadtxt(boxed_folder() / f"poses/{sensor}.tum")
    return table, Slerp(table[:, 0], Rotation.from_quat(table[:, 4:]))


def pose_of(sensor: str, time_s: float) -> np.ndarray:
    """Returns the pose of a sensor in D, by slerp and linear interpolation."""
    table, turn = path_of(sensor)
    place_m = [np.interp(time_s, table[:, 0], table[:, i]) for i in (1, 2, 3)]
    return matrix(turn(time_s), place_m)


def pinhole_of(camera: str) -> np.ndarray:
    (f_u, f_v), (c_u, c_v) = (
        calibration(camera)["lens"]["pinhole"][name] for name in ("focal_px", "centre_px")
    )
    return np.array([[f_u, 0, c_u], [0, f_v, c_v], [0, 0, 1]])


def pose_of_box(box, after_s: float) -> np.ndarray:
    """Returns the pose of a row of a table in D, `after_s` later than its frame's stamp."""
    turn = Rotation.from_quat([box[name] for name in ("qx", "qy", "qz", "qw")])
    passed_s = after_s - box["time_s"]
    return matrix(turn, [box[f"{k}_m"] + passed_s * box[f"v{k}_m_s"] for k in "xyz"])


def half_of_box(box) -> np.ndarray:
    return np.array([box["length_m"], box["width_m"], box["height_m"]]) / 2


def speed(box) -> float:
    return float(np.linalg.norm([box[f"v{k}_m_s"] for k in "xyz"]))


# In front or behind, left or right, above or below: in the axes of the object.
SIGNS = np.array([[x, y, z] for x in (1, -1) for y in (1, -1) for z in (1, -1)])


def corners_of_box(box, after_s: float) -> np.ndarray:
    """Returns the 8 corners in D, in the order of SIGNS."""
    X_DO = pose_of_box(box, after_s)
    return SIGNS * half_of_box(box) @ X_DO[:3, :3].T + X_DO[:3, 3]


def moved(X, points) -> np.ndarray:
    return points @ X[:3, :3].T + X[:3, 3]


def projected(K, points) -> np.ndarray:
    in_image = points @ K.T
    return in_image[:, :2] / in_image[:, 2:]


def scan_of(lidar: str, frame: int) -> np.ndarray:
    """Returns the rows of a scan, by plyfile."""
    return PlyData.read(boxed_folder() / f"lidar/{lidar}/{frame:06}.ply")["vertex"].data


__all__ = [
    "FORMS",
    "SIGNS",
    "boxed_folder",
    "boxes_of",
    "calibration",
    "copy_of",
    "corners_of_box",
    "half_of_box",
    "instances_of",
    "matrix",
    "mount_of",
    "moved",
    "pinhole_of",
    "pose_of",
    "pose_of_box",
    "projected",
    "scan_of",
    "source_of",
    "speed",
    "stamps_s",
]
