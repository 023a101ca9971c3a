"""Options of the command groundray-export, and which formats they apply to."""

from __future__ import annotations

import argparse
from pathlib import Path

from groundray.shell_text import add_text_options

FORMS = (
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
    "coco",
    "kitti-object",
    "nuscenes",
)
KITTI, LAS = {"kitti", "semantic-kitti"}, {"las", "laz"}
OF_CAMERAS = {"tum", "denoised", "coco"}  # without scans
_BOXED = {"coco", "kitti-object", "nuscenes"}
# Formats that an option applies to; options not listed apply to all.
_ONLY_OF = {
    "lidar": set(FORMS) - OF_CAMERAS,
    "camera": KITTI | {"kitti-object", "nuscenes", "mcap", "labels"} | OF_CAMERAS,
    "no_images": KITTI | {"mcap", "nuscenes"},
    "intensity_full_scale": KITTI | LAS | {"kitti-object", "nuscenes", "mcap"},
    "sequence": KITTI | {"nuscenes"},
    "labels": {"semantic-kitti", "labels", "coco", "nuscenes"} | LAS,
    "boxes_of": _BOXED,
    "segmentation": {"coco"},
    "crowd_below_px": {"coco"},
    "split": {"kitti-object"},
    "keyframe_s": {"nuscenes"},
    "depth_per_m": {"tum"},
    "columns": {"pcd"},
    "frame": {"pcd"},
    "merge": LAS,
    "place": LAS,
    "clock": LAS,
    "points": {"mcap"},
    "depth": {"mcap"},
    "compression": {"mcap"},
    "shift_s": {"mcap"},
}
# Modules that a format needs, with their names in pip.
PACKAGES = {
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
    "coco": {"OpenEXR": "openexr"},
}


def parser_of_command() -> argparse.ArgumentParser:
    """Returns the parser of the command's options."""
    parser = argparse.ArgumentParser(
        prog="groundray-export",
        description="Convert a dataset of groundray generate to a format that other programs read.",
        epilog="Contents and limits of each format: docs/reference/export.md. Exit codes: "
        "0 done, 1 failed, 2 wrong usage, 130 interrupted. OUT appears only when complete.",
        allow_abbrev=False,
    )
    parser.add_argument("dataset", metavar="DATASET", type=Path, help="folder with a dataset.yaml")
    parser.add_argument("--to", required=True, choices=FORMS, help="format of the files")
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
    _add_boxes(parser.add_argument_group("boxes"))
    _add_others(parser.add_argument_group("other options"))
    return parser


def _add_choices(group: argparse._ArgumentGroup) -> None:
    add = group.add_argument
    add("--lidar", action="append", metavar="NAME", help="only this lidar; may be repeated")
    add("--camera", action="append", metavar="NAME", help="only this camera; may be repeated")
    text = "omit cameras (kitti, semantic-kitti, mcap, nuscenes)"
    add("--no-images", action="store_true", default=None, help=text)


def _add_points(group: argparse._ArgumentGroup) -> None:
    add = group.add_argument
    text = "intensity that becomes 1, 255 or 65535 in formats with such a scale"
    add("--intensity-full-scale", type=_positive, metavar="I", help=text)
    text = (
        "set of labels, such as rellis_3d, or a map of labels (semantic-kitti, las, laz, labels, "
    )
    text += "coco; for the last two a set only)"
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


def _add_boxes(group: argparse._ArgumentGroup) -> None:
    add = group.add_argument
    text = "classes or labels whose instances are exported (default: all)"
    add("--boxes-of", metavar="A,B,...", help=text)
    text = "masks of COCO (default: polygon, along the edges of the pixels)"
    add("--segmentation", choices=("polygon", "rle"), help=text)
    text = "join instances of fewer visible pixels to crowds of COCO (default: 0)"
    add("--crowd-below-px", type=_count, metavar="N", help=text)
    text = "percentages of KITTI's frames for train, val and test (default: 100,0,0)"
    add("--split", type=_percentages, metavar="A,B,C", help=text)
    text = "time between samples of nuScenes (default: 0.5)"
    add("--keyframe-s", type=_positive, metavar="T", help=text)


def _add_others(group: argparse._ArgumentGroup) -> None:
    add = group.add_argument
    text = "number of KITTI's first sequence, or of nuScenes' scene (default: 0)"
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


def _count(text: str) -> int:
    value = int(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} must not be negative")
    return value


def _percentages(text: str) -> tuple[int, int, int]:
    parts = [int(part) for part in text.split(",")]
    if len(parts) != 3 or min(parts) < 0 or sum(parts) != 100:
        raise argparse.ArgumentTypeError(f"{text} must be three percentages with the sum 100")
    return parts[0], parts[1], parts[2]


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


def check_options(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """Ends the program with a message if an option does not apply to the format."""
    for name, forms in _ONLY_OF.items():
        if getattr(options, name) is not None and options.to not in forms:
            rule = f"applies to {', '.join(sorted(forms))}, not to {options.to}"
            parser.error(f"--{name.replace('_', '-')} {rule}")
    if options.camera and options.no_images:
        parser.error("--camera and --no-images exclude each other")
