"""COCO object detection: instances of images with their categories, masks and rectangles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from groundray.dataset import Camera, Dataset, Error, Frame
from groundray.export.boxes import Box, BoxChoice, Extent, Rectangle, has_boxes, read_boxes
from groundray.export.categories import Categories
from groundray.export.images import has_pictures, read_labels, read_picture
from groundray.export.json_tables import record_text
from groundray.export.labels import Numbers
from groundray.export.notes import Notes
from groundray.export.outlines import Mask, polygons, run_lengths

Record = dict[str, Any]


@dataclass(frozen=True)
class CocoOptions:
    """Instances of fewer visible pixels than `crowd_below_px` are joined to crowds."""

    categories: Categories
    choice: BoxChoice
    with_polygons: bool
    crowd_below_px: int


def write_coco(
    dataset: Dataset, cameras: Sequence[Camera], options: CocoOptions, out: Path, notes: Notes
) -> str:
    """Writes `annotations/instances.json` and the pictures of all cameras with boxes."""
    boxed = [camera for camera in cameras if has_boxes(dataset, camera)]
    if not boxed:
        rule = "it has no image with boxes, which coco needs"
        fix = "add boxes and truth to the products of a camera, and generate it again"
        raise Error(f"{dataset.folder}: {rule}; {fix}")
    images: list[Record] = []
    annotations: list[Record] = []
    for camera in cameras:
        if camera not in boxed:
            notes.tell(f"camera {camera.name} has no boxes among its products: it is left out")
            continue
        (out / "images" / camera.name).mkdir(parents=True)
        with_pictures = has_pictures(dataset, camera)
        if not with_pictures:
            notes.tell(f"camera {camera.name} has no pictures (product picture): no files of them")
        for frame in camera.frames:
            image = _image(dataset, camera, frame, len(images) + 1)
            images.append(image)
            if with_pictures:
                picture = read_picture(dataset, camera, frame)
                (out / "images" / image["file_name"]).write_bytes(picture.data)
            found = _Instances(dataset, camera, frame, options)
            for each in found.annotations():
                about = {"id": len(annotations) + 1, "image_id": image["id"]}
                annotations.append(about | each)
    _write(dataset, options.categories, images, annotations, out)
    return f"{len(annotations)} annotations of {len(images)} images"


def _image(dataset: Dataset, camera: Camera, frame: Frame, number: int) -> Record:
    return {
        "id": number,
        "width": camera.size_px[0],
        "height": camera.size_px[1],
        "file_name": f"{camera.name}/{frame.number:06}.png",
        "camera": camera.name,
        "frame": frame.number,
        "time_ns": dataset.time_origin_ns + frame.stamp_ns + camera.middle_ns,
    }


@dataclass(frozen=True)
class _Instances:
    """The annotations of one image."""

    dataset: Dataset
    camera: Camera
    frame: Frame
    options: CocoOptions

    def annotations(self) -> list[Record]:
        """Returns those of single instances, by their numbers, then the crowds, by category."""
        boxes = self.options.choice.of(read_boxes(self.dataset, self.camera, self.frame))
        instances = read_labels(self.dataset, self.camera, self.frame)[1]
        crowds: dict[int, Mask] = {}
        made: list[Record] = []
        for box in boxes:
            extent = _extent(box)
            mask = self._mask(instances, box, extent)
            category = self.options.categories.of(box.label).number
            if extent.pixels < self.options.crowd_below_px:
                crowd = crowds.setdefault(category, np.zeros(instances.shape, bool))
                _part(crowd, extent.visible)[...] |= mask
            else:
                made.append(self._single(box, extent, mask, category))
        return made + [_crowd(category, mask) for category, mask in sorted(crowds.items())]

    def _mask(self, instances: Numbers, box: Box, extent: Extent) -> Mask:
        """Returns the pixels of an instance in its visible rectangle."""
        mask: Mask = _part(instances, extent.visible) == box.instance
        if np.count_nonzero(mask) != extent.pixels:
            file = self.dataset.image_file(self.camera, self.frame, ".exr")
            rule = f"it shows instance {box.instance} in {np.count_nonzero(mask)} pixels of its "
            rule += f"rectangle, but the boxes of the image state {extent.pixels}"
            raise Error(f"{file}: {rule}: are both from the same run?")
        return mask

    def _single(self, box: Box, extent: Extent, mask: Mask, category: int) -> Record:
        left, top, _, _ = extent.visible
        segmentation = (
            polygons(mask, left, top)
            if self.options.with_polygons
            else _run_lengths(mask, left, top, self.camera.size_px)
        )
        return {
            "category_id": category,
            "segmentation": segmentation,
            "area": extent.pixels,
            "bbox": _bbox(extent.visible),
            "iscrowd": 0,
            "instance_id": box.instance,
            "amodal_bbox": _bbox(extent.whole),
            "amodal_area": extent.alone_pixels,
            "visible_share": extent.visible_share,
            "truncated_share": extent.truncated_share,
        }


def _extent(box: Box) -> Extent:
    assert box.extent is not None  # boxes of images have one
    return box.extent


def _crowd(category: int, mask: Mask) -> Record:
    rows, columns = np.nonzero(mask)
    ends = (int(columns.min()), int(rows.min()), int(columns.max()), int(rows.max()))
    return {
        "category_id": category,
        "segmentation": _run_lengths(mask, 0, 0, (mask.shape[1], mask.shape[0])),
        "area": len(rows),
        "bbox": _bbox(ends),
        "iscrowd": 1,
    }


def _run_lengths(mask: Mask, left: int, top: int, size_px: tuple[int, int]) -> Record:
    return {"size": [size_px[1], size_px[0]], "counts": run_lengths(mask, left, top, size_px)}


def _part(pixels: Any, rectangle: Rectangle) -> Any:
    u_min, v_min, u_max, v_max = rectangle
    return pixels[v_min : v_max + 1, u_min : u_max + 1]


def _bbox(rectangle: Rectangle) -> list[int]:
    """Returns left, top, width, height."""
    u_min, v_min, u_max, v_max = rectangle
    return [u_min, v_min, u_max - u_min + 1, v_max - v_min + 1]


def _write(
    dataset: Dataset,
    categories: Categories,
    images: Sequence[Record],
    annotations: Sequence[Record],
    out: Path,
) -> None:
    listed = [
        {"id": each.number, "name": each.name, "supercategory": ""} for each in categories.listed
    ]
    text = record_text(
        {
            "info": {"description": "groundray", "version": dataset.version},
            "licenses": [],
            "images": images,
            "annotations": annotations,
            "categories": listed,
        }
    )
    (out / "annotations").mkdir()
    (out / "annotations/instances.json").write_text(text, encoding="utf-8")
