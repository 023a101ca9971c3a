"""Labels of images and points in the numbers of a label set, and panoptic segments."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundray.dataset import Camera, Dataset, Error, Frame, Lidar
from groundray.export.images import read_channels, read_labels
from groundray.export.kitti import LabelWriter
from groundray.export.label_sets import LabelSet
from groundray.export.labels import LabelMap
from groundray.export.notes import Notes
from groundray.export.scan import read_scan

_MOST_OF_8_BITS = 255  # largest number that a PNG of 8 bits holds


def write_labels(
    dataset: Dataset,
    lidars: Sequence[Lidar],
    cameras: Sequence[Camera],
    of: LabelSet,
    map_: LabelMap,
    out: Path,
    notes: Notes,
) -> str:
    """Writes labels of all images that have truth, and of all points, a folder for each sensor."""
    images = scans = 0
    for camera in cameras:
        if _has_labels(dataset, camera):
            images += _Images(dataset, camera, of, map_, out / camera.name).write()
        else:
            notes.tell(f"camera {camera.name} has no truth among its products: it is left out")
    for lidar in lidars:
        folder = out / lidar.name
        folder.mkdir()
        labels = LabelWriter(dataset, map_, folder)
        for frame in lidar.frames:
            labels.write(read_scan(dataset, lidar, frame), frame.number)
            scans += 1
        labels.finish(folder / "instances.txt", notes)
    if images + scans == 0:
        raise Error(f"{dataset.folder}: it has no image with truth and no scan to label")
    return f"labels of {images} images and {scans} scans in the numbers of {of.name}"


def _has_labels(dataset: Dataset, camera: Camera) -> bool:
    files = (dataset.image_file(camera, frame, ".exr") for frame in camera.frames)
    first = next((file for file in files if file.is_file()), None)
    return first is not None and "Label" in read_channels(first, only_names=True)


class _Images:
    """Label images of one camera, and its panoptic.json."""

    def __init__(
        self, dataset: Dataset, camera: Camera, of: LabelSet, map_: LabelMap, folder: Path
    ) -> None:
        self._dataset, self._camera, self._of, self._map = dataset, camera, of, map_
        self._folder = folder
        objects = {group.label for group in dataset.object_groups}
        self._things = {map_.labels[label] for label in objects if label in map_.labels}
        self._palette = np.zeros((max(of.colours) + 1, 3), np.uint8)
        for number, colour in of.colours.items():
            self._palette[number] = colour

    def write(self) -> int:
        self._folder.mkdir()
        images, annotations = [], []
        for frame in self._camera.frames:
            width, height = self._camera.size_px
            name = f"{frame.number:06}"
            image = {"id": frame.number, "file_name": f"{name}.png"}
            images.append({**image, "width": width, "height": height})
            segments = self._write_frame(frame, name)
            about = {"image_id": frame.number, "file_name": f"{name}_panoptic.png"}
            annotations.append({**about, "segments_info": segments})
        categories = [
            {
                "id": number,
                "name": name,
                "supercategory": "",
                "isthing": int(number in self._things),
                "color": list(self._of.colours[number]),
            }
            for number, name in self._of.names.items()
        ]
        record = {"images": images, "annotations": annotations, "categories": categories}
        text = json.dumps(record, indent=1) + "\n"
        (self._folder / "panoptic.json").write_text(text, encoding="utf-8")
        return len(images)

    def _write_frame(self, frame: Frame, name: str) -> list[dict[str, Any]]:
        labels, instances = read_labels(self._dataset, self._camera, frame)
        numbers = self._map.of(labels.ravel()).reshape(labels.shape)
        deep = np.uint8 if max(self._of.names) <= _MOST_OF_8_BITS else np.uint16
        self._png(f"{name}_label.png", numbers.astype(deep))
        self._png(f"{name}_colour.png", self._palette[numbers])
        keys = numbers.astype(np.uint64) << np.uint64(32) | instances
        segments, which = np.unique(keys, return_inverse=True)
        ids = which.reshape(labels.shape) + 1
        shares = [ids % 256, ids // 256 % 256, ids // 65536]
        self._png(f"{name}_panoptic.png", np.stack(shares, axis=-1).astype(np.uint8))
        return [self._segment(i + 1, int(key), ids) for i, key in enumerate(segments)]

    @staticmethod
    def _segment(number: int, key: int, ids: NDArray[Any]) -> dict[str, Any]:
        rows, columns = np.nonzero(ids == number)
        left, top = int(columns.min()), int(rows.min())
        size = [int(columns.max()) - left + 1, int(rows.max()) - top + 1]
        return {
            "id": number,
            "category_id": key >> 32,
            "instance_id": key & 0xFFFFFFFF,  # the dataset's; 0 for surfaces without one
            "area": len(rows),
            "bbox": [left, top, *size],
            "iscrowd": 0,
        }

    def _png(self, name: str, pixels: NDArray[Any]) -> None:
        import cv2

        stored = pixels[..., ::-1] if pixels.ndim == 3 else pixels
        (self._folder / name).write_bytes(bytes(cv2.imencode(".png", stored)[1]))
