"""Frames of an index as arrays, from their files; names are those of the Python package."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundray.dataset import Error
from groundray.export.clouds import name_with_unit
from groundray.export.images import picture_in, pixels_of, read_channels
from groundray.export.scan import read_rows

Arrays = dict[str, NDArray[Any]]


class Place(NamedTuple):
    """Files of a frame by the end of their names, and their sizes as the index states them."""

    folder: Path
    files: dict[str, str]
    points: int | None
    size_px: tuple[int, int] | None

    def file(self, ending: str) -> Path:
        """Returns the file with this end of its name. Raises Error if the index lists none."""
        if ending not in self.files:
            has = ", ".join(self.files.values())
            raise Error(f"{self.folder}: the index lists no *{ending} of the frame, only {has}")
        return self.folder / self.files[ending]


PICTURE = "picture"
CHANNELS = {
    "label": ("Label",),
    "instance": ("Instance",),
    "material": ("Material",),
    "is_valid": ("Valid",),
    "depth_m": ("Z",),
    "range_m": ("Distance",),
    "position_m": ("P.X", "P.Y", "P.Z"),
    "normal": ("N.X", "N.Y", "N.Z"),
    "shading_normal": ("Ns.X", "Ns.Y", "Ns.Z"),
    "albedo": ("Albedo.R", "Albedo.G", "Albedo.B"),
    "incidence_rad": ("Incidence",),
    "velocity_m_s": ("Velocity.X", "Velocity.Y", "Velocity.Z"),
    "radiance_w_m2_sr": ("R", "G", "B"),
}
"""Channels of EXR files by the names of the Python package."""


def read_points(place: Place, columns: Sequence[str] | None) -> Arrays:
    """Reads columns of a scan, all of them for None, each an array of n.

    Raises Error if the file is damaged, is not the one that was indexed, or lacks a column.
    """
    file = place.file(".ply")
    rows = read_rows(file)
    if len(rows) != place.points:
        rule = f"it has {len(rows)} points, but the index states {place.points}"
        raise Error(f"{file}: {rule}: it was generated again; make the index again")
    names = {name_with_unit(name): name for name in rows.dtype.names or ()}
    wanted = list(names) if columns is None else columns
    missing = [name for name in wanted if name not in names]
    if missing:
        rule = f"it has no column {', '.join(missing)}; it has {', '.join(names)}"
        raise Error(f"{file}: {rule}")
    return {name: np.ascontiguousarray(rows[names[name]]) for name in wanted}


def read_image(place: Place, channels: Sequence[str] | None) -> Arrays:
    """Reads channels of an image, height x width or height x width x 3.

    For None, reads picture, label and instance as far as the image has them. Raises Error if a file
    is damaged, is not the one that was indexed, or lacks a channel.
    """
    if channels is None:
        return _default_image(place)
    arrays: Arrays = {}
    if PICTURE in channels:
        arrays[PICTURE] = _picture(place)
    named = [name for name in channels if name != PICTURE]
    if named:
        truth = place.file(".exr")
        stored = read_channels(truth)
        arrays |= {name: _channel(truth, stored, name, place) for name in named}
    return arrays


def _default_image(place: Place) -> Arrays:
    arrays: Arrays = {}
    if ".png" in place.files:
        arrays[PICTURE] = _picture(place)
    if ".exr" in place.files:
        truth = place.file(".exr")
        stored = read_channels(truth)
        if "Label" in stored:
            for name in ("label", "instance"):
                arrays[name] = _channel(truth, stored, name, place)
    return arrays


def _picture(place: Place) -> NDArray[Any]:
    assert place.size_px is not None
    return pixels_of(picture_in(place.file(".png"), place.size_px))


def _channel(file: Path, stored: Mapping[str, Any], name: str, place: Place) -> NDArray[Any]:
    parts = [stored[each] for each in CHANNELS[name] if each in stored]
    if len(parts) != len(CHANNELS[name]):
        has = ", ".join(each for each, of in CHANNELS.items() if set(of) <= set(stored))
        raise Error(f"{file}: it has no channel {name}; it has {has or 'none that is known'}")
    values: NDArray[Any] = parts[0] if len(parts) == 1 else np.stack(parts, axis=-1)
    assert place.size_px is not None
    width, height = place.size_px
    if values.shape[:2] != (height, width):
        rule = f"its size must be {width} x {height} px, as the index states"
        raise Error(f"{file}: {rule}: it was generated again; make the index again")
    return values
