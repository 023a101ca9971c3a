"""KITTI odometry, and SemanticKITTI, which adds labels: a sequence for each lidar."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from groundray.dataset import Camera, Dataset, Error, Frame, Lidar
from groundray.export.clouds import tell_of_scan
from groundray.export.images import Picture, pinhole_of, read_picture
from groundray.export.labels import Instances, LabelMap
from groundray.export.notes import Notes
from groundray.export.scan import FullScale, Scan, read_scan
from groundray.export.sensor_path import Floats, SensorPath

NO_IMAGES = ", or export with --no-images"
"""Remedy of faults of cameras, if the format does without them."""


@dataclass(frozen=True)
class KittiOptions:
    """`labels` is None for KITTI odometry."""

    first_sequence: int
    full_scale: FullScale
    labels: LabelMap | None


@dataclass(frozen=True)
class KittiView:
    """Replacement of KITTI's four cameras: a left one, and a right one if there is a pair."""

    left: Camera | None
    right: Camera | None
    matrices: tuple[Floats, Floats]  # P of the left and of the right one, 3 x 4

    def X_BC(self, lidar: Lidar) -> Floats:
        return self.left.X_BC if self.left else lidar.X_BS @ _X_SC


# Without a camera: a virtual one at the lidar, which looks along its x.
_X_SC = np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]], dtype=float)


@dataclass(frozen=True)
class KittiFrame:
    """A scan and its image, at one time."""

    time_ns: int  # of the pose, and of the frame of the points
    scan: Frame
    image: Frame | None


def write_kitti(
    dataset: Dataset,
    lidars: Sequence[Lidar],
    cameras: Sequence[Camera],
    options: KittiOptions,
    out: Path,
    notes: Notes,
) -> str:
    """Writes the sequences of these lidars, with the pictures of a camera or a rectified pair."""
    view = view_of(dataset, cameras, NO_IMAGES, notes)
    notes.tell(
        "points are relative to the pose at their frame's time; moving objects are not corrected"
    )
    counts = []
    for i, lidar in enumerate(lidars):
        number = options.first_sequence + i
        frames = frames_of(lidar, view, NO_IMAGES, notes)
        _Sequence(dataset, lidar, view, frames, options, out, number, notes).write()
        counts.append(f"sequence {number:02} of {lidar.name}: {len(frames)} frames")
    return "; ".join(counts)


def view_of(dataset: Dataset, cameras: Sequence[Camera], otherwise: str, notes: Notes) -> KittiView:
    """Returns the selected or only camera, else the first rectified pair.

    `otherwise` is added to the remedies of errors.
    """
    names = {camera.name: camera for camera in cameras}
    chosen = (each for each in dataset.pairs if {each.left, each.right} <= set(names))
    pair = next((each for each in chosen if each.is_rectified), None)
    if not cameras:
        notes.tell(
            "without a camera, camera 0 stands at the lidar, looks along its x and has P = [I | 0]"
        )
        ahead = np.hstack([np.eye(3), np.zeros((3, 1))])
        return KittiView(None, None, (ahead, ahead))
    if pair is None and len(cameras) > 1:
        rule = f"it has the cameras {', '.join(names)} and no rectified pair among them"
        raise Error(f"{dataset.folder}: {rule}; choose one with --camera{otherwise}")
    left = names[pair.left] if pair else cameras[0]
    right = names[pair.right] if pair else None
    P_left = np.hstack([pinhole_of(dataset, left, "KITTI", otherwise), np.zeros((3, 1))])
    if right is None:
        notes.tell(f"camera {left.name} replaces all four of KITTI's: P0 to P3 are equal")
        return KittiView(left, None, (P_left, P_left))
    left_out = [name for name in names if name not in (left.name, right.name)]
    if left_out:
        notes.tell(f"KITTI has one pair of cameras: {', '.join(left_out)} not exported")
    X_RL = np.linalg.inv(right.X_BC) @ left.X_BC
    if np.abs(X_RL[:3, :3] - np.eye(3)).max() > 1e-9:
        rule = f"cameras {left.name} and {right.name} are not parallel"
        raise Error(f"{dataset.folder}: {rule}; set images: rectified for their pair")
    K_right = pinhole_of(dataset, right, "KITTI", otherwise)
    return KittiView(left, right, (P_left, K_right @ X_RL[:3]))


def frames_of(lidar: Lidar, view: KittiView, otherwise: str, notes: Notes) -> list[KittiFrame]:
    """Returns a frame for each scan; with images, for each image that has a scan of its own.

    The scan of an image is the last one begun by the middle of its exposure, else the first.
    `otherwise` is added to the remedies of errors.
    """
    if not lidar.frames:
        raise Error(f"lidar {lidar.name}: it has no finished scan; generate one first")
    if view.left is None:
        return [KittiFrame(each.stamp_ns, each, None) for each in lidar.frames]
    if not view.left.frames:
        rule = f"camera {view.left.name}: it has no finished image"
        raise Error(f"{rule}; generate one{otherwise}")
    stamps = np.array([each.stamp_ns for each in lidar.frames])
    frames: list[KittiFrame] = []
    for image in view.left.frames:
        time_ns = image.stamp_ns + view.left.middle_ns
        i = max(int(np.searchsorted(stamps, time_ns, side="right")) - 1, 0)
        if frames and frames[-1].scan == lidar.frames[i]:
            notes.count("{} images are skipped: another image has their scan", 1)
        else:
            frames.append(KittiFrame(time_ns, lidar.frames[i], image))
    sentence = "{} scans of " + lidar.name + " are skipped: they have no image"
    sentence += "; --no-images exports all" if otherwise else ""
    notes.count(sentence, len(lidar.frames) - len(frames))
    return frames


@dataclass(frozen=True)
class _Sequence:
    """A sequence to write: `sequences/NN`, and `poses/NN.txt` for KITTI odometry."""

    dataset: Dataset
    lidar: Lidar
    view: KittiView
    frames: Sequence[KittiFrame]
    options: KittiOptions
    out: Path
    number: int
    notes: Notes

    def write(self) -> None:
        folder = self.out / "sequences" / f"{self.number:02}"
        (folder / "velodyne").mkdir(parents=True)
        path = SensorPath(self.dataset.path_file(self.lidar))
        self._write_calibration(folder / "calib.txt")
        begin_ns = self.frames[0].time_ns
        times = [f"{(each.time_ns - begin_ns) * 1e-9:.9f}\n" for each in self.frames]
        (folder / "times.txt").write_text("".join(times))
        self._write_poses(path, folder)
        labels = None
        if self.options.labels:
            (folder / "labels").mkdir()
            labels = LabelWriter(self.dataset, self.options.labels, folder / "labels")
        for i, each in enumerate(self.frames):
            scan = read_scan(self.dataset, self.lidar, each.scan)
            points = velodyne_bytes(scan, path, each.time_ns, self.options.full_scale)
            (folder / f"velodyne/{i:06}.bin").write_bytes(points)
            if labels:
                labels.write(scan, i)
            else:
                tell_of_scan(scan, self.notes)
            if each.image is not None:
                self._write_pictures(each.image, folder, f"{i:06}.png")
        if labels:
            labels.finish(folder / "instances.txt", self.notes)

    def _write_poses(self, path: SensorPath, folder: Path) -> None:
        """Writes the poses of camera 0 relative to the first."""
        X_SC = np.linalg.inv(self.lidar.X_BS) @ self.view.X_BC(self.lidar)
        X_DC = [path.pose_at(each.time_ns) @ X_SC for each in self.frames]
        poses = [np.linalg.inv(X_DC[0]) @ each for each in X_DC]
        file = folder / "poses.txt"
        if not self.options.labels:
            file = self.out / "poses" / f"{self.number:02}.txt"
            file.parent.mkdir(exist_ok=True)
        file.write_text("".join(numbers_text(pose[:3]) + "\n" for pose in poses))

    def _write_calibration(self, file: Path) -> None:
        P_left, P_right = self.view.matrices
        lines = {"P0": P_left, "P1": P_right, "P2": P_left, "P3": P_right}
        lines["Tr"] = (np.linalg.inv(self.view.X_BC(self.lidar)) @ self.lidar.X_BS)[:3]
        file.write_text(
            "".join(f"{name}: {numbers_text(matrix)}\n" for name, matrix in lines.items())
        )

    def _write_pictures(self, image: Frame, folder: Path, name: str) -> None:
        for side, picture in enumerate(pictures_of(self.dataset, self.view, image, self.notes)):
            # KITTI's cameras 0 and 1 are grey, 2 and 3 have colours.
            images = folder / f"image_{side + (2 if picture.is_colour else 0)}"
            images.mkdir(exist_ok=True)
            (images / name).write_bytes(picture.data)


def velodyne_bytes(scan: Scan, path: SensorPath, time_ns: int, full_scale: FullScale) -> bytes:
    """Returns the points in S at one time, with intensities as shares of full scale."""
    rows = np.empty((len(scan), 4), "<f4")
    rows[:, :3] = scan.points_at_m(path, time_ns)
    rows[:, 3] = full_scale.shares(scan.lidar, scan.rows)
    return rows.tobytes()


def pictures_of(dataset: Dataset, view: KittiView, image: Frame, notes: Notes) -> list[Picture]:
    """Reads the picture of the left camera, and of the right one if there is one."""
    pictures = []
    for camera in (view.left, view.right):
        if camera is None:
            continue
        frame = next((each for each in camera.frames if each.number == image.number), None)
        if frame is None:
            rule = f"it has no image {image.number}, but the other camera of its pair has"
            raise Error(f"camera {camera.name}: {rule}; generate it")
        pictures.append(read_picture(dataset, camera, frame))
    if any(picture.bits == 16 for picture in pictures):
        notes.tell("pictures have 16 bits, but KITTI's have 8: some programs read only the upper 8")
    return pictures


def numbers_text(matrix: Floats) -> str:
    """Returns the elements by rows, as KITTI's files have them."""
    return " ".join(f"{value:.16e}" for value in matrix.ravel())


class LabelWriter:
    """Files *.label: the class in the lower 16 bits, the instance in the upper 16."""

    def __init__(self, dataset: Dataset, labels: LabelMap, folder: Path) -> None:
        """Writes into `folder`, which exists."""
        self._folder = folder
        self._labels = labels
        self._instances = Instances(dataset, labels)

    def write(self, scan: Scan, i: int) -> None:
        theirs = self._labels.of(scan.rows["label"])
        instances = self._instances.of(scan.rows, theirs)
        values = (instances << np.uint32(16) | theirs).astype("<u4")
        (self._folder / f"{i:06}.label").write_bytes(values.tobytes())

    def finish(self, file: Path, notes: Notes) -> None:
        """Writes the dataset's number of each instance to a file if they were renumbered."""
        if self._labels.file is None:
            notes.tell(
                "labels are the dataset's own numbers, not SemanticKITTI's; --labels replaces them"
            )
        if not self._instances.is_renumbered:
            return
        notes.tell(
            f"instances are renumbered per label to fit 16 bits: {file.name} lists the originals"
        )
        lines = [
            f"{label} {number} {instance}\n"
            for (label, instance), number in self._instances.numbers.items()
        ]
        header = "# label, its instance here, the dataset's instance\n"
        file.write_text(header + "".join(lines))
