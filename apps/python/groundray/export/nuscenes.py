"""nuScenes: tables of samples, sensors and annotations, and the files of scans and pictures."""

from __future__ import annotations

import bisect
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from groundray.dataset import Camera, Dataset, Error, Frame, Lidar
from groundray.export.boxes import Box, BoxChoice, Extent, has_boxes, read_boxes
from groundray.export.categories import Categories
from groundray.export.clouds import tell_of_scan
from groundray.export.images import has_pictures, pinhole_of, read_picture
from groundray.export.kitti import NO_IMAGES
from groundray.export.notes import Notes
from groundray.export.nuscenes_tables import (
    Row,
    Tables,
    add_attributes,
    add_log,
    attributes_of,
    chain,
    microseconds,
    place,
    visibility_of,
)
from groundray.export.scan import FullScale, read_scan
from groundray.export.sensor_path import SensorPath

VERSION = "v1.0-trainval"
"""Folder of the tables."""

# A map of one pixel without drivable surface: a grey PNG.
_NO_MAP = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108000000003a7e9b55000000"
    "0a4944415478da6360000000020001e527defc0000000049454e44ae426082"
)


@dataclass(frozen=True)
class NuscenesOptions:
    """`keyframe_ns` is the time between samples."""

    full_scale: FullScale
    categories: Categories
    choice: BoxChoice
    scene_number: int
    keyframe_ns: int


@dataclass(frozen=True)
class _Datum:
    """A frame of a sensor; the number of its sample, and whether it is the sample's key frame."""

    sensor: Lidar | Camera
    frame: Frame
    time_ns: int
    sample: int
    is_key: bool


def write_nuscenes(
    dataset: Dataset,
    lidars: Sequence[Lidar],
    cameras: Sequence[Camera],
    options: NuscenesOptions,
    out: Path,
    notes: Notes,
) -> str:
    """Writes one scene of these sensors; its samples are scans of the first lidar."""
    sensors: list[Lidar | Camera] = [*lidars]
    for camera in cameras:
        if has_pictures(dataset, camera):
            sensors.append(camera)
        else:
            notes.tell(f"camera {camera.name} has no pictures (product picture): it is left out")
    if not any(has_boxes(dataset, sensor) for sensor in sensors):
        rule = "it has neither scans nor pictures with boxes, which nuscenes needs"
        fix = "set boxes: report for a lidar, or add boxes to the products of a camera"
        raise Error(f"{dataset.folder}: {rule}; {fix}, and generate it again")
    if not lidars[0].frames:
        raise Error(f"lidar {lidars[0].name}: it has no finished scan; generate one first")
    scene = _Scene(dataset, sensors, options, out, notes)
    return scene.write()


class _Scene:
    """A scene to write: the files of all sensors, and the rows of all tables."""

    def __init__(
        self,
        dataset: Dataset,
        sensors: Sequence[Lidar | Camera],
        options: NuscenesOptions,
        out: Path,
        notes: Notes,
    ) -> None:
        self._dataset, self._sensors, self._options = dataset, sensors, options
        self._out, self._notes = out, notes
        self._name = f"scene-{options.scene_number:04}"
        self._tables = Tables(dataset, self._name)
        self._samples_ns = _samples_ns(sensors[0], options.keyframe_ns)
        self._samples: list[str] = []
        # By sample: points of each instance, boxes by instance, and how visible each is.
        self._points: list[Counter[int]] = [Counter() for _ in self._samples_ns]
        self._boxes: list[dict[int, Box]] = [{} for _ in self._samples_ns]
        self._shares: list[dict[int, float]] = [{} for _ in self._samples_ns]
        self._with_shares = [False for _ in self._samples_ns]

    def write(self) -> str:
        for sensor, channel in zip(self._sensors, self._channels(), strict=True):
            self._add_sensor(sensor, channel)
        self._add_samples()
        add_attributes(self._tables)
        for each in self._options.categories.listed:
            row = {"name": each.name, "description": "", "index": each.number}
            self._tables.add("category", [each.name], row)
        for sensor, channel in zip(self._sensors, self._channels(), strict=True):
            self._write_sensor(sensor, channel)
        count = self._annotate()
        folder = self._out / VERSION
        folder.mkdir()
        self._tables.write(folder)
        splits = json.dumps({"groundray": [self._name]}) + "\n"
        (folder / "splits.json").write_text(splits, encoding="utf-8")
        self._notes.tell("the map is empty: nuScenes' drivable surface is not in the dataset")
        return f"{len(self._samples)} samples, {count} annotations in {self._name}"

    def _channels(self) -> list[str]:
        """Returns names like LIDAR_TOP and CAM_FRONT. Raises Error if two are the same."""
        names = [
            f"{'CAM' if isinstance(sensor, Camera) else 'LIDAR'}_{sensor.name}".upper()
            for sensor in self._sensors
        ]
        names = [name.replace("-", "_") for name in names]
        twice = [name for name, count in Counter(names).items() if count > 1]
        if twice:
            rule = f"two of its sensors would be the channel {twice[0]}"
            raise Error(f"{self._dataset.folder}: {rule}; choose one with --lidar or --camera")
        return names

    def _add_sensor(self, sensor: Lidar | Camera, channel: str) -> None:
        is_camera = isinstance(sensor, Camera)
        about = {"channel": channel, "modality": "camera" if is_camera else "lidar"}
        token = self._tables.add("sensor", [channel], about)
        matrix: list[Any] = []
        if isinstance(sensor, Camera):
            matrix = pinhole_of(self._dataset, sensor, "nuScenes", NO_IMAGES).tolist()
            if sensor.row_s:
                rule = f"camera {sensor.name} has a rolling shutter"
                self._notes.tell(f"{rule}; poses and times are those of the middle row")
        X_BS = sensor.X_BC if isinstance(sensor, Camera) else sensor.X_BS
        row = {"sensor_token": token, **place(X_BS), "camera_intrinsic": matrix}
        self._tables.add("calibrated_sensor", [channel], row)

    def _add_samples(self) -> None:
        tables = self._tables
        times_us = [microseconds(self._dataset, time_ns) for time_ns in self._samples_ns]
        log = add_log(tables, self._dataset, self._name, times_us[0])
        map_file = self._out / tables.rows["map"][0]["filename"]
        map_file.parent.mkdir()
        map_file.write_bytes(_NO_MAP)
        scene = tables.token("scene")
        for i, time_us in enumerate(times_us):
            row = {"timestamp": time_us, "scene_token": scene, "prev": "", "next": ""}
            self._samples.append(tables.add("sample", [i], row))
        chain(tables.rows["sample"])
        about = {
            "name": self._name,
            "description": f"groundray {self._dataset.version}, seed {self._dataset.seed}",
            "log_token": log,
            "nbr_samples": len(self._samples),
            "first_sample_token": self._samples[0],
            "last_sample_token": self._samples[-1],
        }
        tables.add("scene", [], about)

    def _write_sensor(self, sensor: Lidar | Camera, channel: str) -> None:
        """Writes the files of a sensor and adds their rows; keeps what annotations need."""
        path = SensorPath(self._dataset.path_file(sensor))
        with_boxes = has_boxes(self._dataset, sensor)
        if not with_boxes:
            self._notes.tell(f"{sensor.name} has no boxes: what it alone sees has no annotation")
        for folder in ("samples", "sweeps"):
            (self._out / folder / channel).mkdir(parents=True)
        data = self._data_of(sensor)
        rows = []
        for datum in data:
            rows.append(self._add_datum(datum, channel, path))
            (self._out / rows[-1]["filename"]).write_bytes(self._file_of(datum, path))
            if datum.is_key and with_boxes:
                self._keep_boxes(datum)
        chain(rows)
        missing = len(self._samples) - sum(datum.is_key for datum in data)
        self._notes.count("{} samples have no frame of " + sensor.name + " near them", missing)

    def _add_datum(self, datum: _Datum, channel: str, path: SensorPath) -> Row:
        """Adds the pose of the body at a frame, and the frame; returns its row."""
        sensor, time_us = datum.sensor, microseconds(self._dataset, datum.time_ns)
        is_camera = isinstance(sensor, Camera)
        name = f"{'samples' if datum.is_key else 'sweeps'}/{channel}/"
        name += f"{self._name}__{channel}__{time_us}.{'png' if is_camera else 'pcd.bin'}"
        mount = sensor.X_BC if isinstance(sensor, Camera) else sensor.X_BS
        X_DB = path.pose_at(datum.time_ns) @ np.linalg.inv(mount)
        key = [channel, datum.frame.number]
        pose = self._tables.add("ego_pose", key, {"timestamp": time_us, **place(X_DB)})
        width, height = sensor.size_px if isinstance(sensor, Camera) else (0, 0)
        row = {
            "sample_token": self._samples[datum.sample],
            "ego_pose_token": pose,
            "calibrated_sensor_token": self._tables.token("calibrated_sensor", channel),
            "timestamp": time_us,
            "fileformat": "png" if is_camera else "pcd",
            "is_key_frame": datum.is_key,
            "height": height,
            "width": width,
            "filename": name,
        }
        self._tables.add("sample_data", key, row)
        return self._tables.rows["sample_data"][-1]

    def _data_of(self, sensor: Lidar | Camera) -> list[_Datum]:
        """Assigns frames to samples: the nearest one is key frame, others belong to the next."""
        middle_ns = sensor.middle_ns if isinstance(sensor, Camera) else 0
        times_ns = [frame.stamp_ns + middle_ns for frame in sensor.frames]
        times_us = [microseconds(self._dataset, time_ns) for time_ns in times_ns]
        if any(before >= after for before, after in pairwise(times_us)):
            rule = f"the stamps of {sensor.name} do not increase by microseconds"
            raise Error(f"{self._dataset.folder / 'dataset.yaml'}: {rule}; was it edited?")
        keys: dict[int, int] = {}
        for i, sample_ns in enumerate(self._samples_ns if times_ns else []):
            after = bisect.bisect_left(times_ns, sample_ns)
            around = range(max(after - 1, 0), min(after + 1, len(times_ns)))
            near = min(around, key=lambda k: abs(times_ns[k] - sample_ns))
            if abs(times_ns[near] - sample_ns) <= self._options.keyframe_ns // 2:
                keys.setdefault(near, i)
        last = len(self._samples_ns) - 1
        return [
            _Datum(
                sensor,
                frame,
                time_ns,
                keys.get(k, min(bisect.bisect_left(self._samples_ns, time_ns), last)),
                k in keys,
            )
            for k, (frame, time_ns) in enumerate(zip(sensor.frames, times_ns, strict=True))
        ]

    def _file_of(self, datum: _Datum, path: SensorPath) -> bytes:
        """Returns the picture, or the points at the datum's time; counts points of instances."""
        if isinstance(datum.sensor, Camera):
            picture = read_picture(self._dataset, datum.sensor, datum.frame)
            if picture.bits == 16:
                self._notes.tell("pictures have 16 bits, but nuScenes' have 8")
            return picture.data
        scan = read_scan(self._dataset, datum.sensor, datum.frame)
        tell_of_scan(scan, self._notes)
        if datum.is_key:
            instances, counts = np.unique(scan.rows["instance"], return_counts=True)
            found = dict(zip(instances.tolist(), counts.tolist(), strict=True))
            self._points[datum.sample].update(found)
        rows = np.empty((len(scan), 5), "<f4")
        rows[:, :3] = scan.points_at_m(path, datum.time_ns)
        rows[:, 3] = self._options.full_scale.shares(datum.sensor, scan.rows) * 255
        rows[:, 4] = scan.rows["ring"]
        return rows.tobytes()

    def _keep_boxes(self, datum: _Datum) -> None:
        """Keeps the first box of each instance in a sample, and its largest visible share."""
        boxes, shares = self._boxes[datum.sample], self._shares[datum.sample]
        found = read_boxes(self._dataset, datum.sensor, datum.frame)
        for box in self._options.choice.of(found):
            boxes.setdefault(box.instance, box)
            if box.extent is not None:
                share = max(shares.get(box.instance, 0.0), _share_of_whole(box.extent))
                shares[box.instance] = share
        self._with_shares[datum.sample] |= isinstance(datum.sensor, Camera)

    def _annotate(self) -> int:
        """Adds the annotations of all samples and their instances; returns their number."""
        tables = self._tables
        chains: dict[int, list[Row]] = {}
        for i, boxes in enumerate(self._boxes):
            for instance, box in sorted(boxes.items()):
                row = self._annotation(i, box)
                tables.add("sample_annotation", [i, instance], row)
                chains.setdefault(instance, []).append(tables.rows["sample_annotation"][-1])
        labels = {box.instance: box.label for boxes in self._boxes for box in boxes.values()}
        for instance, rows in sorted(chains.items()):
            chain(rows)
            category = self._options.categories.of(labels[instance])
            about = {
                "category_token": tables.token("category", category.name),
                "nbr_annotations": len(rows),
                "first_annotation_token": rows[0]["token"],
                "last_annotation_token": rows[-1]["token"],
                "groundray_instance": instance,
            }
            tables.add("instance", [instance], about)
        return len(tables.rows["sample_annotation"])

    def _annotation(self, sample: int, box: Box) -> Row:
        category = self._options.categories.of(box.label)
        speed_m_s = float(np.linalg.norm(box.velocity_m_s))
        share = self._shares[sample].get(box.instance, 0.0) if self._with_shares[sample] else None
        length_m, width_m, height_m = box.size_m.tolist()
        return {
            "sample_token": self._samples[sample],
            "instance_token": self._tables.token("instance", box.instance),
            "visibility_token": visibility_of(share),
            "attribute_tokens": attributes_of(self._tables, category, speed_m_s),
            **place(box.at(self._samples_ns[sample])),
            "size": [width_m, length_m, height_m],
            "num_lidar_pts": self._points[sample][box.instance],
            "num_radar_pts": 0,
        }


def _samples_ns(lidar: Lidar | Camera, keyframe_ns: int) -> list[int]:
    """Returns the stamps of scans that are at least this time apart, to a hundredth of it."""
    samples: list[int] = []
    for frame in lidar.frames:
        if not samples or frame.stamp_ns - samples[-1] >= keyframe_ns - keyframe_ns // 100:
            samples.append(frame.stamp_ns)
    return samples


def _share_of_whole(extent: Extent) -> float:
    """Returns the share of an instance that an image shows, what lies beside it included."""
    return extent.visible_share * (1 - extent.truncated_share)
