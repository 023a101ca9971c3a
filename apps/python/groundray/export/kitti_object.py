"""KITTI object detection: pictures, points and calibration of each frame, and labelled boxes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from groundray.dataset import Camera, Dataset, Error, Lidar
from groundray.export.boxes import Box, BoxChoice, Extent, has_boxes, read_boxes
from groundray.export.clouds import tell_of_scan
from groundray.export.kitti import (
    KittiFrame,
    KittiView,
    frames_of,
    numbers_text,
    pictures_of,
    velodyne_bytes,
    view_of,
)
from groundray.export.notes import Notes
from groundray.export.scan import FullScale, read_scan
from groundray.export.sensor_path import Floats, SensorPath

# Types of KITTI; other classes keep their names.
_TYPES = {"vehicle": "Car", "person": "Pedestrian"}
# Least visible share of the occlusion states "fully visible" and "partly occluded".
_FULLY, _PARTLY = 0.9, 0.5
# Axes of a box in KITTI, with the length along x, the height along y (down) and the width along z,
# in those of O.
_R_OK = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], dtype=float)


@dataclass(frozen=True)
class KittiObjectOptions:
    """`split` has the percentages of the frames, in order of time, for train, val and test."""

    full_scale: FullScale
    choice: BoxChoice
    split: tuple[int, int, int]


def write_kitti_object(
    dataset: Dataset,
    lidars: Sequence[Lidar],
    cameras: Sequence[Camera],
    options: KittiObjectOptions,
    out: Path,
    notes: Notes,
) -> str:
    """Writes the frames of the first lidar with a camera, or with a rectified pair."""
    boxed = [camera for camera in cameras if has_boxes(dataset, camera)]
    if not boxed:
        rule = "it has no image with boxes, which kitti-object needs"
        fix = "add boxes and picture to the products of a camera, and generate it again"
        raise Error(f"{dataset.folder}: {rule}; {fix}")
    view = view_of(dataset, cameras, "", notes)
    if view.left not in boxed:
        name = view.left.name if view.left else ""
        rule = f"camera {name}, the left one, has no boxes, which kitti-object needs"
        raise Error(f"{dataset.folder}: {rule}; add boxes to its products, or choose another one")
    lidar = lidars[0]
    for other in lidars[1:]:
        notes.tell(f"KITTI's frames have one lidar, here {lidar.name}: {other.name} is left out")
    notes.tell("points and boxes are those of the middle of the picture's exposure")
    frames = frames_of(lidar, view, "", notes)
    writer = _Writer(dataset, lidar, view, options, out, notes)
    counts = writer.write(frames)
    return f"{counts[0]} frames for train, {counts[1]} for val, {counts[2]} for test"


@dataclass(frozen=True)
class _Writer:
    dataset: Dataset
    lidar: Lidar
    view: KittiView
    options: KittiObjectOptions
    out: Path
    notes: Notes

    def write(self, frames: Sequence[KittiFrame]) -> tuple[int, int, int]:
        """Writes all frames; returns how many are for train, val and test."""
        path = SensorPath(self.dataset.path_file(self.lidar))
        for part in ("training", "testing"):
            folders = ["calib", "velodyne", "image_2", *(["image_3"] if self.view.right else [])]
            for folder in (*folders, *(["label_2"] if part == "training" else [])):
                (self.out / part / folder).mkdir(parents=True)
        last_of_train = round(len(frames) * self.options.split[0] / 100)
        labelled = round(len(frames) * (self.options.split[0] + self.options.split[1]) / 100)
        tilt_rad = 0.0
        for i, frame in enumerate(frames):
            part, name = ("training", i) if i < labelled else ("testing", i - labelled)
            self._write_inputs(path, frame, self.out / part, f"{name:06}")
            if part == "training":
                tilt_rad = max(tilt_rad, self._write_labels(path, frame, f"{name:06}.txt"))
        if tilt_rad > 0:
            rule = "boxes turn about the camera's y axis alone; their largest other rotation is"
            self.notes.tell(f"{rule} {math.degrees(tilt_rad):.1f} deg, which is left out")
        self._write_lists(frames, last_of_train, labelled)
        return last_of_train, labelled - last_of_train, len(frames) - labelled

    def _write_inputs(self, path: SensorPath, frame: KittiFrame, folder: Path, name: str) -> None:
        scan = read_scan(self.dataset, self.lidar, frame.scan)
        tell_of_scan(scan, self.notes)
        points = velodyne_bytes(scan, path, frame.time_ns, self.options.full_scale)
        (folder / "velodyne" / f"{name}.bin").write_bytes(points)
        (folder / "calib" / f"{name}.txt").write_text(self._calibration())
        assert frame.image is not None  # the view has a camera
        pictures = pictures_of(self.dataset, self.view, frame.image, self.notes)
        for side, picture in enumerate(pictures):
            (folder / f"image_{side + 2}" / f"{name}.png").write_bytes(picture.data)

    def _calibration(self) -> str:
        P_left, P_right = self.view.matrices
        X_CB = np.linalg.inv(self.view.X_BC(self.lidar)).astype(np.float64)
        X_SB = np.linalg.inv(self.lidar.X_BS).astype(np.float64)
        lines: dict[str, Floats] = {
            "P0": P_left,
            "P1": P_right,
            "P2": P_left,
            "P3": P_right,
            "R0_rect": np.eye(3),
            "Tr_velo_to_cam": (X_CB @ self.lidar.X_BS)[:3],
            "Tr_imu_to_velo": X_SB[:3],
        }
        return "".join(f"{name}: {numbers_text(matrix)}\n" for name, matrix in lines.items())

    def _write_labels(self, path: SensorPath, frame: KittiFrame, name: str) -> float:
        """Writes the boxes of an image; returns their largest rotation that KITTI leaves out."""
        assert self.view.left is not None
        assert frame.image is not None
        boxes = self.options.choice.of(read_boxes(self.dataset, self.view.left, frame.image))
        X_DS = path.pose_at(frame.time_ns)
        X_CD = np.linalg.inv(X_DS @ np.linalg.inv(self.lidar.X_BS) @ self.view.X_BC(self.lidar))
        lines, tilt_rad = [], 0.0
        for box in boxes:
            placed = _placed(box, X_CD @ box.at(frame.time_ns))
            tilt_rad = max(tilt_rad, placed.tilt_rad)
            lines.append(f"{self._type(box.label)} {placed.text()}\n")
        (self.out / "training/label_2" / name).write_text("".join(lines))
        return tilt_rad

    def _type(self, label: int) -> str:
        name = self.dataset.classes.get(label, "Misc")
        return _TYPES.get(name, name.capitalize())

    def _write_lists(self, frames: Sequence[KittiFrame], last_of_train: int, labelled: int) -> None:
        folder = self.out / "ImageSets"
        folder.mkdir()
        numbers = {
            "train": range(last_of_train),
            "val": range(last_of_train, labelled),
            "trainval": range(labelled),
            "test": range(len(frames) - labelled),
        }
        for name, listed in numbers.items():
            (folder / f"{name}.txt").write_text("".join(f"{number:06}\n" for number in listed))
        (self.out / "frames.txt").write_text("".join(self._origins(frames, labelled)))

    def _origins(self, frames: Sequence[KittiFrame], labelled: int) -> Iterator[str]:
        """Yields what each frame was made of."""
        assert self.view.left is not None
        yield f"# frame, image of {self.view.left.name}, scan of {self.lidar.name}, time in ns\n"
        for i, frame in enumerate(frames):
            name = f"training/{i:06}" if i < labelled else f"testing/{i - labelled:06}"
            image = frame.image.number if frame.image else -1
            time_ns = self.dataset.time_origin_ns + frame.time_ns
            yield f"{name} {image} {frame.scan.number} {time_ns}\n"


@dataclass(frozen=True)
class _Placed:
    """A box in the camera, turned about the camera's y axis alone."""

    extent: Extent
    size_m: Floats
    bottom_m: Floats  # centre of the lower face
    turn_rad: float
    tilt_rad: float  # angle of the rotation that is left out

    def text(self) -> str:
        """Returns the columns of a label from the second on."""
        x_m, _, z_m = self.bottom_m
        alpha_rad = _wrapped(self.turn_rad - math.atan2(x_m, z_m))
        length_m, width_m, height_m = self.size_m
        truncated = f"{self.extent.truncated_share:.6f} {_occlusion(self.extent)}"
        numbers = (
            *(alpha_rad, *self.extent.whole),
            *(height_m, width_m, length_m),
            *(*self.bottom_m, self.turn_rad),
        )
        return f"{truncated} {' '.join(f'{number:.6f}' for number in numbers)}"


def _placed(box: Box, X_CO: Floats) -> _Placed:
    """Places a box with the turn that leaves the least rotation out."""
    assert box.extent is not None  # boxes of images have one
    R_CK = X_CO[:3, :3] @ _R_OK
    turn_rad = math.atan2(R_CK[0, 2] - R_CK[2, 0], R_CK[0, 0] + R_CK[2, 2])
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    left_out = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T @ R_CK
    tilt_rad = math.acos(min(max((np.trace(left_out) - 1) / 2, -1.0), 1.0))
    bottom_m = X_CO[:3, 3] + [0, box.size_m[2] / 2, 0]
    return _Placed(box.extent, box.size_m, bottom_m, turn_rad, tilt_rad)


def _occlusion(extent: Extent) -> int:
    """Returns KITTI's state: 0 fully visible, 1 partly, 2 largely occluded, 3 unknown."""
    if extent.alone is None:
        return 3
    return 0 if extent.visible_share >= _FULLY else 1 if extent.visible_share >= _PARTLY else 2


def _wrapped(angle_rad: float) -> float:
    return math.remainder(angle_rad, 2 * math.pi)
