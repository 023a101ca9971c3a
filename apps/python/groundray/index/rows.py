"""Rows of the index: one for each frame of a sensor."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundray.dataset import Camera, Dataset, Error, Frame, Lidar
from groundray.export.images import read_channels
from groundray.export.scan import read_scan
from groundray.export.sensor_path import SensorPath, quaternion_wxyz

NOTHING = "nothing"
"""Class of label 0: sky, echoes from the air, false alarms."""

Row = dict[str, Any]


def class_name(label: int, classes: Mapping[int, str]) -> str:
    """Returns the name of a label's class; `label 4` if the scene names none."""
    return NOTHING if label == 0 else classes.get(label, f"label {label}")


def kind_of(sensor: Lidar | Camera) -> str:
    """Returns `lidar` or `camera`, which is also the folder of its files."""
    return "lidar" if isinstance(sensor, Lidar) else "camera"


def rows_of(dataset: Dataset) -> Iterator[Row]:
    """Yields a row for each finished frame, by sensor.

    Raises Error if a file is missing, or damaged.
    """
    sensors: list[Lidar | Camera] = [*dataset.lidars, *dataset.cameras]
    for sensor in sensors:
        if not sensor.frames:
            continue
        path = SensorPath(dataset.path_file(sensor))
        files = _files_of(dataset, sensor)
        for frame in sensor.frames:
            pose_ns = frame.stamp_ns + (0 if isinstance(sensor, Lidar) else sensor.middle_ns)
            own = files.get(frame.number, {})
            row: Row = {
                "sensor": sensor.name,
                "kind": kind_of(sensor),
                "model": sensor.model,
                "frame": frame.number,
                "stamp_ns": frame.stamp_ns,
                "time_origin_ns": dataset.time_origin_ns,
                "pose_ns": pose_ns,
                **_pose(path, pose_ns),
                "origin_w_m": dataset.origin_w_m.tolist(),
                "files": sorted(own.items()),
                "labels": sorted(dataset.classes.items()),
            }
            if isinstance(sensor, Lidar):
                yield row | _of_scan(dataset, sensor, frame)
            else:
                yield row | _of_image(dataset, sensor, frame, own)


def _files_of(dataset: Dataset, sensor: Lidar | Camera) -> dict[int, dict[str, str]]:
    """Returns the files of each frame, relative to the dataset, by the end of their names."""
    folder = f"{kind_of(sensor)}/{sensor.name}"
    files: dict[int, dict[str, str]] = {}
    try:
        names = sorted(os.listdir(dataset.folder / folder))
    except OSError:
        names = []  # each frame is then reported as missing
    for name in names:
        parts = re.fullmatch(r"(\d{6,})([._].+)", name)
        if parts and not name.endswith(".part"):
            files.setdefault(int(parts[1]), {})[parts[2]] = f"{folder}/{name}"
    return files


def _pose(path: SensorPath, time_ns: int) -> Row:
    X = path.pose_at(time_ns)
    w, x, y, z = quaternion_wxyz(X[:3, :3])
    position = {f"{axis}_m": float(X[i, 3]) for i, axis in enumerate("xyz")}
    return {**position, "qx": x, "qy": y, "qz": z, "qw": w}


def _of_scan(dataset: Dataset, lidar: Lidar, frame: Frame) -> Row:
    rows = read_scan(dataset, lidar, frame).rows
    return {
        "is_deskewed": lidar.is_deskewed,
        "points": len(rows),
        **_counts(rows["label"], rows["instance"], dataset.classes),
    }


def _of_image(dataset: Dataset, camera: Camera, frame: Frame, files: Mapping[str, str]) -> Row:
    width, height = camera.size_px
    row: Row = {"width_px": width, "height_px": height}
    if not files:
        file = dataset.image_file(camera, frame, ".*")
        raise Error(f"{file}: there is none, although dataset.yaml lists it as done; removed?")
    if ".exr" not in files:
        return row
    file = dataset.image_file(camera, frame, ".exr")
    channels = read_channels(file)
    if "Label" not in channels:
        return row
    label, instance, is_valid = (
        _channel(file, channels, name, (height, width)) for name in ("Label", "Instance", "Valid")
    )
    seen = is_valid != 0
    counts = _counts(label[seen], instance[seen], dataset.classes)
    return row | {"pixels": int(np.count_nonzero(seen)), **counts}


def _channel(
    file: Path, channels: Mapping[str, Any], name: str, shape: tuple[int, int]
) -> NDArray[np.uint32]:
    values = channels.get(name)
    if values is None or values.shape != shape:
        rule = f"must have a channel {name} of the size that its calibration states"
        raise Error(f"{file}: it {rule}; is it from another camera?")
    return np.asarray(values, dtype=np.uint32)


def _counts(labels: NDArray[Any], instances: NDArray[Any], classes: Mapping[int, str]) -> Row:
    """Returns the counts of each class, and of each instance, in the order of their numbers."""
    of_class: dict[str, int] = {}
    for label, count in zip(*np.unique(labels, return_counts=True), strict=True):
        name = class_name(int(label), classes)
        of_class[name] = of_class.get(name, 0) + int(count)
    keys = instances.astype(np.uint64) << np.uint64(32) | labels.astype(np.uint64)
    keys, counts = np.unique(keys[instances != 0], return_counts=True)
    return {
        "classes": list(of_class.items()),
        "instances": [
            {"instance": key >> 32, "label": key & 0xFFFFFFFF, "count": count}
            for key, count in zip(keys.tolist(), counts.tolist(), strict=True)
        ],
    }
