"""TUM RGB-D: pictures, depths and the path of a camera."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from groundray.dataset import Camera, Dataset, Error, Frame
from groundray.export.images import (
    has_depths,
    has_pictures,
    png_of,
    read_depths_m,
    read_picture,
)
from groundray.export.notes import Notes
from groundray.export.sensor_path import Floats, SensorPath, quaternion_wxyz
from groundray.file_content import read_text

_PngOf = Callable[[Frame], bytes]


def write_tum(
    dataset: Dataset, cameras: Sequence[Camera], depth_per_m: float, out: Path, notes: Notes
) -> str:
    """Writes one camera into `out`, several into folders named after them."""
    if not cameras:
        raise Error(f"{dataset.folder}: it has no camera, but TUM RGB-D needs images")
    if depth_per_m != 5000:
        notes.tell(f"a metre of depth is {depth_per_m:g}, not TUM's 5000: set this in the reader")
    count = 0
    for camera in cameras:
        folder = out if len(cameras) == 1 else out / camera.name
        folder.mkdir(exist_ok=True)
        count += _write_camera(dataset, camera, depth_per_m, folder, notes)
    return f"{count} images of {len(cameras)} cameras"


def _write_camera(
    dataset: Dataset, camera: Camera, depth_per_m: float, folder: Path, notes: Notes
) -> int:
    if not camera.frames:
        raise Error(f"camera {camera.name}: it has no finished image; generate one first")
    with_pictures, with_depths = has_pictures(dataset, camera), has_depths(dataset, camera)
    if not with_pictures and not with_depths:
        rule = f"camera {camera.name} has neither pictures nor depths"
        raise Error(f"{dataset.folder}: {rule}; add picture and truth to its products")
    times_ns = [frame.stamp_ns + camera.middle_ns for frame in camera.frames]
    stamps = [_stamp(dataset, time_ns) for time_ns in times_ns]
    if with_pictures:

        def picture_of(frame: Frame) -> bytes:
            return read_picture(dataset, camera, frame).data

        _write_images("rgb", "color images", camera, stamps, folder, picture_of)
    else:
        notes.tell(f"camera {camera.name} has no pictures (product picture): there is no rgb.txt")
    if with_depths:

        def depths_of(frame: Frame) -> bytes:
            return png_of(_depths_of(dataset, camera, frame, depth_per_m, notes))

        _write_images("depth", "depth maps", camera, stamps, folder, depths_of)
    else:
        notes.tell(f"camera {camera.name} has no depths (product truth): there is no depth.txt")
    _write_path(dataset, camera, times_ns, folder / "groundtruth.txt")
    calibration = read_text(dataset.folder / "calibration" / f"{camera.name}.yaml")
    (folder / "calibration.yaml").write_text(calibration, encoding="utf-8")
    if camera.pinhole_matrix is None:
        notes.tell(f"TUM RGB-D cannot express the lens of {camera.name}: see calibration.yaml")
    if camera.row_s:
        notes.tell(
            f"camera {camera.name} has a rolling shutter; stamps are those of the middle row"
        )
    return len(camera.frames)


def _stamp(dataset: Dataset, time_ns: int) -> str:
    total = dataset.time_origin_ns + time_ns
    sign, total = ("-", -total) if total < 0 else ("", total)
    return f"{sign}{total // 10**9}.{total % 10**9:09}"


def _write_images(
    name: str, title: str, camera: Camera, stamps: Sequence[str], folder: Path, png: _PngOf
) -> None:
    """Writes `<name>/<stamp>.png` of all frames, and their list `<name>.txt`."""
    (folder / name).mkdir()
    lines = [f"# {title}\n", f"# camera: {camera.name}\n", "# timestamp filename\n"]
    for frame, stamp in zip(camera.frames, stamps, strict=True):
        (folder / f"{name}/{stamp}.png").write_bytes(png(frame))
        lines.append(f"{stamp} {name}/{stamp}.png\n")
    (folder / f"{name}.txt").write_text("".join(lines))


def _depths_of(
    dataset: Dataset, camera: Camera, frame: Frame, depth_per_m: float, notes: Notes
) -> np.ndarray[tuple[int, ...], np.dtype[np.uint16]]:
    depths_m = read_depths_m(dataset, camera, frame)
    ahead = np.isfinite(depths_m) & (depths_m > 0)
    scaled = np.rint(np.where(ahead, depths_m, 0).astype(float) * depth_per_m)
    far = scaled > 65535
    sentence = "{} pixels are 0, which means unknown: they are beyond the "
    sentence += f"{65535 / depth_per_m:.6g} m that 16 bits can store; see --depth-per-m"
    notes.count(sentence, int(np.count_nonzero(far)))
    behind = np.isfinite(depths_m) & (scaled == 0)
    sentence = "{} pixels are 0: their points are on or behind the camera's plane"
    notes.count(sentence, int(np.count_nonzero(behind)))
    return np.where(far, 0, scaled).astype(np.uint16)


def _write_path(dataset: Dataset, camera: Camera, times_ns: Sequence[int], file: Path) -> None:
    """Writes the recorded poses and a pose at the exact time of each image."""
    path = SensorPath(dataset.path_file(camera))
    all_ns = np.union1d(path.times_ns, np.array(times_ns, dtype=np.int64))
    rotations, positions_m = path.at(all_ns)
    lines = [
        "# ground truth trajectory\n",
        f"# camera: {camera.name}\n",
        "# timestamp tx ty tz qx qy qz qw\n",
    ]
    for time_ns, R, p_m in zip(all_ns.tolist(), rotations, positions_m, strict=True):
        lines.append(f"{_stamp(dataset, time_ns)} {_pose_text(R, p_m)}\n")
    file.write_text("".join(lines))


def _pose_text(R: Floats, p_m: Floats) -> str:
    w, x, y, z = quaternion_wxyz(R)
    return " ".join(f"{value:.17g}" for value in (*p_m, x, y, z, w))
