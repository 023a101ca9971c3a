"""What a dataset holds and a form has no place for, told once."""

from __future__ import annotations

from collections.abc import Sequence

from groundray.dataset import Camera, Dataset, Lidar
from groundray.export.notes import Notes

_OF_SCANS = {"pcd", "las", "laz", "npz"}
_PRODUCTS = {
    "_no_returns.ply": "tables of pulses without an echo are not exported",
    "_wave.npy": "waveforms are not exported",
}


def tell_of_columns(form: str, layout: str, notes: Notes) -> None:
    """Tells which columns the points of a form lack. `layout` is that of a bag's points."""
    if form == "kitti":
        notes.tell("points have x, y, z and intensity alone: no times, rings, returns or truth")
    elif form == "semantic-kitti":
        notes.tell(
            "of the truth points have labels and instances alone; no times, rings or returns"
        )
    elif form == "mcap" and layout != "full":
        notes.tell(f"points have the fields of the {layout} layout alone, and no truth")


def tell_of_products(
    dataset: Dataset, form: str, lidars: Sequence[Lidar], cameras: Sequence[Camera], notes: Notes
) -> None:
    """Tells which files of the sensors are not exported."""
    for lidar in lidars if form != "tum" else ():
        for suffix, sentence in _PRODUCTS.items():
            if any(dataset.scan_file(lidar, each, suffix).is_file() for each in lidar.frames[:1]):
                notes.tell(sentence)
    if form in _OF_SCANS and dataset.cameras:
        notes.tell(f"{form} is of scans alone: images are not exported")
    elif form == "tum" and dataset.lidars:
        notes.tell("tum is of cameras alone: lidars are not exported")
    if form in _OF_SCANS:
        return
    for camera in cameras:
        if any(dataset.image_file(camera, each, ".exr").is_file() for each in camera.frames[:1]):
            has_depths = form in ("tum", "mcap")
            kept = "pictures and depths" if has_depths else "pictures"
            notes.tell(f"of images {kept} are exported, and no other channels")
