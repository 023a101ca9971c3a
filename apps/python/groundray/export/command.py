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
from groundray.export import clouds, denoised, kitti, label_images, las, ros_bag, tum
from groundray.export.label_sets import LabelSet, find_set
from groundray.export.labels import LabelMap
from groundray.export.notes import Notes, tell_of_columns, tell_of_products
from groundray.export.scan import FullScale
from groundray.guarded_work import DONE, run_guarded
from groundray.packages import check_packages
from groundray.shell_text import add_text_options

_FORMS = (
    "kitti",
    "semantic-kitti",
    "tum",
    "pcd",
    "las",
    "laz",
    "npz",
    "mcap",
    "denoised",
    "labels",
)
_KITTI, _LAS = {"kitti", "semantic-kitti"}, {"las", "laz"}
# Formats that an option applies to; options not listed apply to all.
_ONLY_OF = {
    "lidar": set(_FORMS) - {"tum", "denoised"},
    "camera": _KITTI | {"tum", "mcap", "denoised", "labels"},
    "no_images": _KITTI | {"mcap"},
    "intensity_full_scale": _KITTI | _LAS | {"mcap"},
    "sequence": _KITTI,
    "labels": {"semantic-kitti", "labels"} | _LAS,
    "depth_per_m": {"tum"},
    "columns": {"pcd"},
    "frame": {"pcd"},
    "merge": _LAS,
    "place": _LAS,
    "clock": _LAS,
    "points": {"mcap"},
    "depth": {"mcap"},
    "compression": {"mcap"},
    "shift_s": {"mcap"},
}
# Modules that a format needs, with their names in pip.
_PACKAGES = {
    "tum": {"cv2": "opencv-python-headless", "OpenEXR": "openexr"},
    "las": {"laspy": "laspy", "pyproj": "pyproj"},
    "laz": {"laspy": "laspy", "lazrs": "lazrs", "pyproj": "pyproj"},
    "mcap": {
        "mcap": "mcap",
        "mcap_ros2": "mcap-ros2-support",
        "cv2": "opencv-python-headless",
        "OpenEXR": "openexr",
    },
    "denoised": {"pyoidn": "pyoidn", "OpenEXR": "openexr"},
    "labels": {"cv2": "opencv-python-headless", "OpenEXR": "openexr"},
}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="groundray-export",
        description="Convert a dataset of groundray generate to a format that other programs read.",
        epilog="Contents and limits of each format: docs/reference/export.md. Exit codes: "
        "0 done, 1 failed, 2 wrong usage, 130 interrupted. OUT appears only when complete.",
        allow_abbrev=False,
    )
    parser.add_argument("dataset", metavar="DATASET", type=Path, help="folder with a dataset.yaml")
    parser.add_argument("--to", required=True, choices=_FORMS, help="format of the files")
    parser.add_argument(
        "-o",
        "--output",
        required=True,
        type=Path,
        metavar="OUT",
        help="a new or empty folder",
    )
    parser.add_argument(
        "--skip-pending",
        action="store_true",
        help="export finished frames if some are pending",
    )
    add_text_options(parser)
    _add_choices(parser.add_argument_group("selection"))
    _add_points(parser.add_argument_group("points"))
    _add_others(parser.add_argument_group("other options"))
    return parser


def _add_choices(group: argparse._ArgumentGroup) -> None:
    add = group.add_argument
    add("--lidar", action="append", metavar="NAME", help="only this lidar; may be repeated")
    add("--camera", action="append", metavar="NAME", help="only this camera; may be repeated")
    text = "omit cameras (kitti, semantic-kitti, mcap)"
    add("--no-images", action="store_true", default=None, help=text)


def _add_points(group: argparse._ArgumentGroup) -> None:
    add = group.add_argument
    text = "intensity that becomes 1, 255 or 65535 in formats with such a scale"
    add("--intensity-full-scale", type=_positive, metavar="I", help=text)
    text = "set of labels, such as rellis_3d, or a map of labels (semantic-kitti, las, laz, labels)"
    add("--labels", metavar="SET|MAP.yaml", help=text)
    add("--columns", metavar="A,B,...", help="columns of a PCD file (default: all)")
    text = "frame of x, y, z in a PCD file (default: fired)"
    add("--frame", choices=("fired", "stamp", "world"), help=text)
    text = "points of a LAS file (default: measured)"
    add("--place", choices=("measured", "truth"), help=text)
    text = "clock of the dataset's times, for LAS (default: run)"
    add("--clock", choices=("run", "gps", "unix"), help=text)
    text = "one LAS file for each lidar"
    add("--merge", action="store_true", default=None, help=text)


def _add_others(group: argparse._ArgumentGroup) -> None:
    add = group.add_argument
    text = "number of KITTI's first sequence (default: 0)"
    add("--sequence", type=_whole, metavar="N", help=text)
    text = "depth value of a metre in TUM (default: 5000)"
    add("--depth-per-m", type=_positive, metavar="N", help=text)
    text = "layout of ROS 2 points (default: full)"
    add("--points", choices=("velodyne", "ouster", "autoware", "full"), help=text)
    add("--depth", action="store_true", default=None, help="add depth images to a bag")
    text = "compression of a bag (default: zstd)"
    add("--compression", choices=("zstd", "lz4", "none"), help=text)
    add("--shift-s", type=_seconds_ns, metavar="T", help="seconds added to all stamps of a bag")


def _positive(text: str) -> float:
    value = float(text)
    if not 0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} must be above 0")
    return value


def _whole(text: str) -> int:
    value = int(text)
    if not 0 <= value <= 99:
        raise argparse.ArgumentTypeError(f"{text} must be from 0 to 99")
    return value


def _seconds_ns(text: str) -> int:
    value = float(text)
    if not abs(value) < 2**31:
        raise argparse.ArgumentTypeError(f"{text} must be within 2^31 s")
    return round(value * 1e9)


def _check_options(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    for name, forms in _ONLY_OF.items():
        if getattr(options, name) is not None and options.to not in forms:
            rule = f"applies to {', '.join(sorted(forms))}, not to {options.to}"
            parser.error(f"--{name.replace('_', '-')} {rule}")
    if options.camera and options.no_images:
        parser.error("--camera and --no-images exclude each other")


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


def _export(options: argparse.Namespace, out: Path, dataset: Dataset, notes: Notes) -> str:
    lidars: list[Lidar] = _chosen(dataset, "lidar", options.lidar)  # type: ignore[assignment]
    cameras: list[Camera] = _chosen(dataset, "camera", options.camera)  # type: ignore[assignment]
    if options.no_images:
        cameras = []
    if not lidars and options.to not in ("tum", "mcap", "denoised", "labels"):
        raise Error(f"{dataset.folder}: it has no lidar, but {options.to} needs scans")
    full_scale = FullScale(options.intensity_full_scale)
    if lidars:
        tell_of_columns(options.to, options.points or "full", notes)
    tell_of_products(dataset, options.to, lidars, cameras, notes)
    if options.to in _KITTI:
        wanted = options.to == "semantic-kitti"
        labels = _labels(options, 65535, dataset, notes) if wanted else None
        settings = kitti.KittiOptions(options.sequence or 0, full_scale, labels)
        return kitti.write_kitti(dataset, lidars, cameras, settings, out, notes)
    if options.to == "tum":
        return tum.write_tum(dataset, cameras, options.depth_per_m or 5000, out, notes)
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
    if options.to in _LAS:
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
    parser = _parser()
    options = parser.parse_args(arguments)
    _check_options(parser, options)
    notes = Notes()

    def work() -> str:
        check_packages(_PACKAGES.get(options.to, {}), options.to)
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
