"""The command groundray-export."""

from __future__ import annotations

import argparse
import os
import shutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from groundray.dataset import Camera, Dataset, Error, Lidar
from groundray.export import (
    clouds,
    coco,
    denoised,
    kitti,
    kitti_object,
    label_images,
    las,
    nuscenes,
    ros_bag,
    tum,
)
from groundray.export.boxes import BoxChoice
from groundray.export.categories import Categories
from groundray.export.label_sets import LabelSet, find_set
from groundray.export.labels import LabelMap
from groundray.export.notes import Notes, tell_of_columns, tell_of_products
from groundray.export.options import (
    KITTI,
    LAS,
    OF_CAMERAS,
    PACKAGES,
    check_options,
    parser_of_command,
)
from groundray.export.scan import FullScale
from groundray.guarded_work import DONE, run_guarded
from groundray.packages import check_packages


def _chosen(dataset: Dataset, kind: str, names: Sequence[str] | None) -> list[Lidar] | list[Camera]:
    sensors: list[Lidar] | list[Camera] = dataset.lidars if kind == "lidar" else dataset.cameras
    if names is None:
        return sensors
    known = [sensor.name for sensor in sensors]
    for name in names:
        if name not in known:
            raise Error(
                f"{dataset.folder}: it has no {kind} {name}; it has: {', '.join(known) or 'none'}"
            )
    return [sensor for sensor in sensors if sensor.name in names]  # type: ignore[return-value]


def _set_of(options: argparse.Namespace) -> LabelSet | None:
    """Returns the set of labels that --labels names; None if it names a file, or nothing."""
    given: str = options.labels or ".yaml"
    return None if given.endswith((".yaml", ".yml")) else find_set(given)


def _labels(options: argparse.Namespace, most: int, dataset: Dataset, notes: Notes) -> LabelMap:
    """Returns the map of labels that --labels names, by a set or a file; else that of none."""
    chosen = _set_of(options)
    if chosen is None:
        return LabelMap(Path(options.labels) if options.labels else None, most)
    near = sorted(chosen.nearest & set(dataset.classes.values()))
    if near:
        notes.tell(f"{chosen.name} has no class of its own for {', '.join(near)}: see labels.md")
    return LabelMap.of_set(chosen, dataset, most)


def _categories(options: argparse.Namespace, dataset: Dataset, notes: Notes) -> Categories:
    """Returns the categories of the set that --labels names, or nuScenes'; else own labels."""
    chosen = _set_of(options)
    if chosen is None and options.labels:
        rule = f"--labels {options.labels}: {options.to} needs the name of a set, such as rellis_3d"
        raise Error(f"{rule}: a map of labels has no names of categories")
    if chosen is None and options.to == "nuscenes" and dataset.classes:
        chosen = find_set("nuscenes_lidarseg")
    return Categories(dataset, chosen, notes)


def _export(options: argparse.Namespace, out: Path, dataset: Dataset, notes: Notes) -> str:
    lidars: list[Lidar] = _chosen(dataset, "lidar", options.lidar)  # type: ignore[assignment]
    cameras: list[Camera] = _chosen(dataset, "camera", options.camera)  # type: ignore[assignment]
    if options.no_images:
        cameras = []
    if not lidars and options.to not in {"mcap", "labels"} | OF_CAMERAS:
        raise Error(f"{dataset.folder}: it has no lidar, but {options.to} needs scans")
    full_scale = FullScale(options.intensity_full_scale)
    if lidars:
        tell_of_columns(options.to, options.points or "full", notes)
    tell_of_products(dataset, options.to, lidars, cameras, notes)
    if options.to in KITTI:
        wanted = options.to == "semantic-kitti"
        labels = _labels(options, 65535, dataset, notes) if wanted else None
        settings = kitti.KittiOptions(options.sequence or 0, full_scale, labels)
        return kitti.write_kitti(dataset, lidars, cameras, settings, out, notes)
    if options.to == "tum":
        return tum.write_tum(dataset, cameras, options.depth_per_m or 5000, out, notes)
    if options.to == "coco":
        categories = _categories(options, dataset, notes)
        choice = BoxChoice(dataset, options.boxes_of)
        with_polygons, least_px = options.segmentation != "rle", options.crowd_below_px or 0
        masks = coco.CocoOptions(categories, choice, with_polygons, least_px)
        return coco.write_coco(dataset, cameras, masks, out, notes)
    if options.to == "kitti-object":
        choice, split = BoxChoice(dataset, options.boxes_of), options.split or (100, 0, 0)
        objects = kitti_object.KittiObjectOptions(full_scale, choice, split)
        return kitti_object.write_kitti_object(dataset, lidars, cameras, objects, out, notes)
    if options.to == "nuscenes":
        tables = nuscenes.NuscenesOptions(
            full_scale,
            _categories(options, dataset, notes),
            BoxChoice(dataset, options.boxes_of),
            options.sequence or 0,
            round((options.keyframe_s or 0.5) * 1e9),
        )
        return nuscenes.write_nuscenes(dataset, lidars, cameras, tables, out, notes)
    if options.to == "labels":
        chosen = _set_of(options)
        if chosen is None:
            raise Error("--to labels needs --labels with the name of a set, such as rellis_3d")
        map_ = _labels(options, 65535, dataset, notes)
        return label_images.write_labels(dataset, lidars, cameras, chosen, map_, out, notes)
    if options.to == "denoised":
        return denoised.write_denoised(dataset, cameras, out, notes)
    if options.to == "pcd":
        columns = options.columns.split(",") if options.columns else []
        return clouds.write_pcd(dataset, lidars, columns, options.frame or "fired", out)
    if options.to == "npz":
        return clouds.write_npz(dataset, lidars, out)
    if options.to in LAS:
        labels = _labels(options, 255, dataset, notes) if options.labels else None
        place, clock = options.place or "measured", options.clock or "run"
        form = las.LasOptions(options.to, bool(options.merge), place, clock, full_scale, labels)
        return las.write_las(dataset, lidars, form, out, notes)
    if not lidars and not cameras:
        raise Error(f"{dataset.folder}: it has no sensor to export")
    bag = ros_bag.BagOptions(
        options.points or "full",
        options.compression or "zstd",
        options.shift_s,
        bool(options.depth),
        full_scale,
    )
    return ros_bag.write_bag(dataset, lidars, cameras, bag, out, notes)


def _open(options: argparse.Namespace) -> Dataset:
    dataset = Dataset(options.dataset)
    if dataset.pending and not options.skip_pending:
        rule = f"{dataset.pending} of its frames are pending"
        fix = "finish it with groundray generate, or export the others with --skip-pending"
        raise Error(f"{dataset.folder}: {rule}; {fix}")
    return dataset


@contextmanager
def _written_aside(out: Path, dataset: Path) -> Iterator[Path]:
    """Yields a temporary folder that becomes `out` at the end and is removed on any failure.

    Raises Error if `out` exists and is not an empty folder, or is inside the dataset.
    """
    out = out.resolve()
    if out.exists() and not out.is_dir():
        raise Error(f"{out}: a file of this name exists; choose a new folder with -o")
    if out.exists() and any(out.iterdir()):
        raise Error(f"{out}: the folder is not empty; choose a new one with -o or remove it")
    if out.is_relative_to(dataset.resolve()):
        raise Error(f"{out}: it is inside the dataset; choose another folder with -o")
    made = [each for each in out.parents if not each.exists()]
    out.parent.mkdir(parents=True, exist_ok=True)
    aside = out.parent / f".{out.name}.{os.getpid()}.part"
    shutil.rmtree(aside, ignore_errors=True)  # of a killed process with this number
    aside.mkdir()
    try:
        yield aside
        os.replace(aside, out)
    finally:
        shutil.rmtree(aside, ignore_errors=True)
        for each in made:  # the innermost first; those that are not empty stay
            with suppress(OSError):
                each.rmdir()


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command; returns its exit code."""
    parser = parser_of_command()
    options = parser.parse_args(arguments)
    check_options(parser, options)
    notes = Notes()

    def work() -> str:
        check_packages(PACKAGES.get(options.to, {}), options.to)
        dataset = _open(options)
        if dataset.pending:
            notes.tell(f"{dataset.pending} frames are pending and skipped")
        with _written_aside(options.output, options.dataset) as folder:
            return _export(options, folder, dataset, notes)

    code, told = run_guarded(work)
    if code != DONE:
        print(f"groundray-export: {told}", file=sys.stderr)
        return code
    for line in notes.lines():
        print(f"note: {line}")
    print(f"{options.output}: {told}")
    return DONE
