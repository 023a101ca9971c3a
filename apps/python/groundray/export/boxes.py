"""Boxes of instances in scans and images, and the choice of those to export."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundray.dataset import Camera, Dataset, Error, Frame, Lidar, matrix_of
from groundray.export.sensor_path import Floats
from groundray.file_content import read_listed

Rectangle = tuple[int, int, int, int]
"""Left, top, right and bottom pixel, all included."""

_SPACE = {
    "instance": "<u4",
    "label": "<u2",
    **dict.fromkeys(["time_s", "x_m", "y_m", "z_m", "length_m", "width_m", "height_m"], "<f8"),
    **dict.fromkeys(["qx", "qy", "qz", "qw", "vx_m_s", "vy_m_s", "vz_m_s"], "<f8"),
}
_ENDS = ("u_min", "v_min", "u_max", "v_max")
_IN_SCANS = {**_SPACE, "points": "<u4"}
_IN_IMAGES = {
    **_SPACE,
    "pixels": "<u4",
    **dict.fromkeys([f"visible_{end}" for end in _ENDS], "<i4"),
    "alone": "<u4",
    **dict.fromkeys([f"alone_{end}" for end in _ENDS], "<i4"),
    **dict.fromkeys(["visible_share", "truncated_share"], "<f8"),
}
_DAMAGED = "it is damaged; generate it again"


@dataclass(frozen=True)
class Extent:
    """Extent of an instance in an image: as visible, and alone, as if nothing else were there.

    `alone` is None if no pixel would show it at its centre.
    """

    pixels: int
    visible: Rectangle
    alone_pixels: int
    alone: Rectangle | None
    visible_share: float
    truncated_share: float

    @property
    def whole(self) -> Rectangle:
        """The rectangle of the instance alone, else the visible one."""
        return self.visible if self.alone is None else self.alone


@dataclass(frozen=True)
class Box:
    """Box of an instance: its pose X_DO and its size along x, y and z of O, at one time.

    `extent` is None in a scan.
    """

    instance: int
    label: int
    time_ns: int
    X_DO: Floats
    size_m: Floats
    velocity_m_s: Floats
    extent: Extent | None

    def at(self, time_ns: int) -> Floats:
        """Returns X_DO at another time, for the velocity of this one."""
        X_DO = self.X_DO.copy()
        X_DO[:3, 3] += self.velocity_m_s * ((time_ns - self.time_ns) * 1e-9)
        return X_DO


class BoxChoice:
    """The classes or labels whose instances are exported; all if the text is None."""

    def __init__(self, dataset: Dataset, text: str | None) -> None:
        """Reads class names and labels with commas between. Raises Error for an unknown one."""
        self._labels: set[int] | None = None
        if text is None:
            return
        labels = {group.label for group in dataset.object_groups}
        chosen: set[int] = set()
        for word in text.split(","):
            of_class = {n for n, name in dataset.classes.items() if name == word} & labels
            if word.isdecimal() and int(word) in labels:
                of_class = {int(word)}
            if not of_class:
                names = {dataset.classes[n] for n in labels if n in dataset.classes}
                has = ", ".join([*sorted(names), *map(str, sorted(labels))])
                rule = f"--boxes-of {word}: it is no class or label of an object"
                raise Error(f"{rule}; {dataset.folder} has {has or 'none'}")
            chosen |= of_class
        self._labels = chosen

    def of(self, boxes: Sequence[Box]) -> list[Box]:
        """Returns the chosen ones, in their order."""
        return [box for box in boxes if self._labels is None or box.label in self._labels]


def has_boxes(dataset: Dataset, sensor: Lidar | Camera) -> bool:
    """Returns whether any frame of the sensor has boxes; then all must have them."""
    return any(_file(dataset, sensor, frame).is_file() for frame in sensor.frames)


def read_boxes(dataset: Dataset, sensor: Lidar | Camera, frame: Frame) -> list[Box]:
    """Reads the boxes of one frame. Raises Error if they are missing or damaged."""
    file = _file(dataset, sensor, frame)
    is_image = isinstance(sensor, Camera)
    rows = _read_table(file, _IN_IMAGES if is_image else _IN_SCANS)
    return list(
        _boxes_of(rows, file, frame, sensor.size_px if isinstance(sensor, Camera) else None)
    )


def _file(dataset: Dataset, sensor: Lidar | Camera, frame: Frame) -> Path:
    if isinstance(sensor, Camera):
        return dataset.image_file(sensor, frame, "_boxes.npy")
    return dataset.scan_file(sensor, frame, "_boxes.npy")


def _read_table(file: Path, fields: dict[str, str]) -> NDArray[Any]:
    data = read_listed(file, "its frame")
    stream = io.BytesIO(data)
    try:
        if np.lib.format.read_magic(stream) != (1, 0):
            raise ValueError("it is not version 1.0 of NPY")
        shape, _, dtype = np.lib.format.read_array_header_1_0(stream)
    except Exception as fault:  # whatever NumPy raises for a damaged header
        reason = " ".join(str(fault).split())
        raise Error(f"{file}: it is not a table of boxes: {reason}: {_DAMAGED}") from None
    if dtype != np.dtype(list(fields.items())) or len(shape) != 1:
        rule = f"it must be a list of rows of {', '.join(fields)}"
        raise Error(f"{file}: {rule}: {_DAMAGED}")
    expected = stream.tell() + shape[0] * dtype.itemsize
    if len(data) != expected:
        rule = f"it has {len(data)} bytes, but its header requires {expected}"
        raise Error(f"{file}: {rule}: {_DAMAGED}")
    return np.frombuffer(data, dtype, shape[0], stream.tell())


def _boxes_of(
    rows: NDArray[Any], file: Path, frame: Frame, size_px: tuple[int, int] | None
) -> Iterator[Box]:
    for i, row in enumerate(rows):
        reals = [float(row[name]) for name in rows.dtype.names or () if row[name].dtype.kind == "f"]
        turn = [float(row[name]) for name in ("qx", "qy", "qz", "qw")]
        size_m = np.array([float(row[name]) for name in ("length_m", "width_m", "height_m")])
        is_sound = all(map(math.isfinite, reals)) and abs(float(row["time_s"])) < 3600
        if not is_sound or abs(np.linalg.norm(turn) - 1) > 1e-6 or np.any(size_m < 0):
            rule = f"the box of instance {row['instance']} in row {i} has invalid values"
            raise Error(f"{file}: {rule}: {_DAMAGED}")
        yield Box(
            int(row["instance"]),
            int(row["label"]),
            frame.stamp_ns + round(float(row["time_s"]) * 1e9),
            matrix_of(turn, [float(row[name]) for name in ("x_m", "y_m", "z_m")]),
            size_m,
            np.array([float(row[name]) for name in ("vx_m_s", "vy_m_s", "vz_m_s")]),
            None if size_px is None else _extent_of(row, file, size_px),
        )


def _extent_of(row: Any, file: Path, size_px: tuple[int, int]) -> Extent:
    visible, alone = (
        tuple(int(row[f"{name}_{end}"]) for end in _ENDS) for name in ("visible", "alone")
    )
    alone_pixels = int(row["alone"])
    for u_min, v_min, u_max, v_max in (visible, *((alone,) if alone_pixels else ())):
        if not (0 <= u_min <= u_max < size_px[0] and 0 <= v_min <= v_max < size_px[1]):
            rule = f"the rectangle of instance {row['instance']} is not inside the image"
            raise Error(f"{file}: {rule}: is it from another camera?")
    return Extent(
        int(row["pixels"]),
        visible,  # type: ignore[arg-type]
        alone_pixels,
        alone if alone_pixels else None,  # type: ignore[arg-type]
        float(row["visible_share"]),
        float(row["truncated_share"]),
    )
