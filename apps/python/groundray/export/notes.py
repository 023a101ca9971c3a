"""Notes on what a format omits or cannot express, each printed once, with a count."""

from __future__ import annotations

from collections.abc import Sequence

from groundray.dataset import Camera, Dataset, Lidar

_OF_SCANS = {"pcd", "las", "laz", "npz"}
_OF_CAMERAS = {"tum", "denoised", "coco"}
_WITH_BOXES = {"kitti-object", "nuscenes"}
_PRODUCTS = {
    "_boxes.npy": "boxes are not exported",
    "_no_returns.ply": "tables of pulses without an echo are not exported",
    "_wave.npy": "waveforms are not exported",
}


class Notes:
    """Sentences in the order of their first occurrence."""

    def __init__(self) -> None:
        self._counts: dict[str, int] = {}

    def tell(self, sentence: str) -> None:
        """Adds a sentence once."""
        self._counts.setdefault(sentence, 0)

    def count(self, sentence: str, number: int) -> None:
        """Adds to the number that replaces `{}` in a sentence; ignores 0."""
        if number:
            self._counts[sentence] = self._counts.get(sentence, 0) + int(number)

    def lines(self) -> list[str]:
        """Returns the sentences with their numbers."""
        return [sentence.replace("{}", str(n)) for sentence, n in self._counts.items()]


def tell_of_columns(form: str, layout: str, notes: Notes) -> None:
    """Notes which columns the points of a format lack. `layout` is that of a bag's points."""
    if form in ("kitti", "kitti-object"):
        notes.tell("points have only x, y, z and intensity: no times, rings, returns or truth")
    elif form == "semantic-kitti":
        notes.tell("labels and instances are the only truth of points; no times, rings or returns")
    elif form == "nuscenes":
        notes.tell("points have only x, y, z, intensity and ring: no times, returns or truth")
    elif form == "mcap" and layout != "full":
        notes.tell(f"points have only the fields of the {layout} layout, and no truth")


def tell_of_products(
    dataset: Dataset, form: str, lidars: Sequence[Lidar], cameras: Sequence[Camera], notes: Notes
) -> None:
    """Notes which files of the sensors are not exported."""
    for lidar in lidars if form not in _OF_CAMERAS else ():
        for suffix, sentence in _PRODUCTS.items():
            if suffix == "_boxes.npy" and form in _WITH_BOXES:
                continue
            if any(dataset.scan_file(lidar, each, suffix).is_file() for each in lidar.frames[:1]):
                notes.tell(sentence)
    if form in _OF_SCANS and dataset.cameras:
        notes.tell(f"{form} contains only scans: images are not exported")
    elif form in _OF_CAMERAS and dataset.lidars:
        notes.tell(f"{form} contains only cameras: lidars are not exported")
    if form in _OF_SCANS | {"denoised", "coco"}:
        return
    for camera in cameras:
        if any(dataset.image_file(camera, each, ".exr").is_file() for each in camera.frames[:1]):
            has_depths = form in ("tum", "mcap")
            kept = "pictures and depths" if has_depths else "pictures"
            notes.tell(f"images are exported as {kept} only, without other channels")
