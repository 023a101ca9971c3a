"""Scans: their rows, and their points and intensities in other frames and scales."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundray.dataset import Dataset, Error, Frame, Lidar
from groundray.export.sensor_path import Floats, SensorPath
from groundray.file_content import read_listed

# Units and meanings of the columns that docs/reference/formats.md defines.
UNITS = {
    **dict.fromkeys(["x", "y", "z", "world_x", "world_y", "world_z", "range_true"], "m"),
    **dict.fromkeys(["error_estimate", "range_sd", "error_bound"], "m"),
    **dict.fromkeys(["vx", "vy", "vz"], "m/s"),
    **dict.fromkeys(["time", "width"], "s"),
    "incidence": "rad",
    "amplitude": "W",
}
MEANINGS = {
    "intensity": "as the sensor reports it",
    "time": "since the stamp of the scan",
    "ring": "number of the beam",
    "return_index": "which echo of its pulse, from 1",
    "return_count": "how many echoes of its pulse",
    **{f"world_{axis}": "truth: the surface, in D" for axis in "xyz"},
    "range_true": "truth: from beam to surface",
    **{f"n{axis}": "truth: normal, axes of D" for axis in "xyz"},
    "incidence": "truth: beam to normal",
    "label": "truth: semantic class",
    "instance": "truth: number of the object",
    "error_estimate": "truth: error of range_true",
    "pulse": "number in the sweep",
    "amplitude": "peak power at the detector",
    "width": "full width at half of the peak",
    "snr": "peak over noise",
    "kind": "0 surface, 1 air, 2 false alarm",
    "share": "truth: energy of first surface",
    "second_share": "truth: energy of the next one",
    "second_label": "truth: class of the next one",
    "range_sd": "standard deviation of range",
    **{f"v{axis}": "truth: velocity, axes of D" for axis in "xyz"},
    "error_bound": "truth: bound of error",
}

_TYPES = {
    **dict.fromkeys(["char", "int8"], "<i1"),
    **dict.fromkeys(["uchar", "uint8"], "<u1"),
    **dict.fromkeys(["short", "int16"], "<i2"),
    **dict.fromkeys(["ushort", "uint16"], "<u2"),
    **dict.fromkeys(["int", "int32"], "<i4"),
    **dict.fromkeys(["uint", "uint32"], "<u4"),
    **dict.fromkeys(["float", "float32"], "<f4"),
    **dict.fromkeys(["double", "float64"], "<f8"),
}
_REQUIRED = (
    *("x", "y", "z", "intensity", "time", "ring", "return_index", "return_count"),
    *("world_x", "world_y", "world_z", "range_true", "nx", "ny", "nz", "label", "instance"),
)

# Intensity that is exported as full scale: a white plane at normal incidence, or the largest 8-bit
# value.
_FULL_SCALES = {"cosine": 1.0, "reflectance": 1.0, "eight_bit": 255.0}


@dataclass(frozen=True)
class Scan:
    """The rows of one scan's file; columns have the names of docs/reference/formats.md."""

    lidar: Lidar
    frame: Frame
    rows: NDArray[Any]

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def names(self) -> tuple[str, ...]:
        """The columns, in the order of the file."""
        return tuple(self.rows.dtype.names or ())

    @property
    def points_m(self) -> Floats:
        """n x 3: x, y, z, in the frame given by `Lidar.is_deskewed`."""
        return np.stack([self.rows[axis].astype(float) for axis in "xyz"], axis=-1)

    @property
    def times_ns(self) -> NDArray[np.int64]:
        """Firing time of each pulse on the dataset's clock."""
        offsets_ns = np.rint(self.rows["time"].astype(float) * 1e9).astype(np.int64)
        return np.add(offsets_ns, self.frame.stamp_ns, dtype=np.int64)

    def points_in_world_m(self, path: SensorPath) -> Floats:
        """Returns the reported points in D by the true path: n x 3."""
        times_ns = self.times_ns
        if self.lidar.is_deskewed:
            times_ns = np.full_like(times_ns, self.frame.stamp_ns)
        when, which = np.unique(times_ns, return_inverse=True)
        rotations, positions_m = path.at(when)
        return (rotations[which] @ self.points_m[..., None])[..., 0] + positions_m[which]

    def points_at_m(self, path: SensorPath, time_ns: int) -> Floats:
        """Returns the reported points in S at one time: n x 3."""
        if self.lidar.is_deskewed and time_ns == self.frame.stamp_ns:
            return self.points_m
        X_DS = path.pose_at(time_ns)
        return (self.points_in_world_m(path) - X_DS[:3, 3]) @ X_DS[:3, :3]


class FullScale:
    """Divisor of intensities: the user's choice, or the one that the sensor's scale implies."""

    def __init__(self, chosen: float | None) -> None:
        self.chosen = chosen

    def of(self, lidar: Lidar) -> float:
        """Returns the full scale. Raises Error for powers, which have none."""
        if self.chosen is not None:
            return self.chosen
        if lidar.intensity_scale not in _FULL_SCALES:
            raise Error(
                f"lidar {lidar.name}: its intensities are powers in watts, which have no full "
                f"scale: give one with --intensity-full-scale, and --lidar {lidar.name} if it is "
                "not that of all lidars; or record `receiver: {intensity: reflectance}`"
            )
        return _FULL_SCALES[lidar.intensity_scale]

    def shares(self, lidar: Lidar, rows: NDArray[Any]) -> Floats:
        """Returns intensities as shares of full scale, not clipped."""
        return rows["intensity"].astype(float) / self.of(lidar)

    def whole(self, lidar: Lidar, rows: NDArray[Any], most: int) -> tuple[NDArray[np.int64], int]:
        """Returns intensities as whole numbers from 0 to `most`, and how many were clipped."""
        scaled = np.rint(self.shares(lidar, rows) * most)
        clipped = np.clip(np.nan_to_num(scaled, nan=0.0), 0, most)
        return clipped.astype(np.int64), int(np.count_nonzero(clipped != scaled))


def read_scan(dataset: Dataset, lidar: Lidar, frame: Frame) -> Scan:
    """Reads one scan. Raises Error if it is missing, truncated, or not a scan of groundray."""
    return Scan(lidar, frame, read_rows(dataset.scan_file(lidar, frame)))


def read_rows(file: Path) -> NDArray[Any]:
    """Reads the rows of a scan's file. Raises Error as read_scan does."""
    data = read_listed(file, "it")
    dtype, count, offset = _read_header(data, file)
    expected = offset + count * dtype.itemsize
    if len(data) != expected:
        rule = f"it has {len(data)} bytes, but its header requires {expected}"
        raise Error(f"{file}: {rule}: it is damaged; generate it again")
    rows = np.frombuffer(data, dtype, count, offset)
    finite = np.isfinite([rows[axis] for axis in "xyz"]).all()
    if not finite or not np.all((rows["time"] >= 0) & (rows["time"] < 3600)):
        rule = "it has points with invalid coordinates or times"
        raise Error(f"{file}: {rule}: it is damaged; generate it again")
    return rows


def _read_header(data: bytes, file: Path) -> tuple[np.dtype[Any], int, int]:
    """Returns the type of a row, the number of rows and their offset."""
    end = data.find(b"end_header\n", 0, 1 << 20)
    lines = data[: max(end, 0)].decode("ascii", "replace").split("\n")
    if end < 0 or lines[:2] != ["ply", "format binary_little_endian 1.0"]:
        raise Error(f"{file}: it is not a PLY file of a groundray scan: is it damaged?")
    count = -1
    columns: list[tuple[str, str]] = []
    for line in lines[2:]:
        words = line.split()
        if words[:2] == ["element", "vertex"] and len(words) == 3 and words[2].isdigit():
            count = int(words[2])
        elif words[:1] == ["property"] and len(words) == 3 and words[1] in _TYPES:
            columns.append((words[2], _TYPES[words[1]]))
        elif words and words[0] != "comment":
            raise Error(f"{file}: its header has '{line}', which no scan of groundray has")
    names = [name for name, _ in columns]
    missing = [name for name in _REQUIRED if name not in names]
    if count < 0 or missing or len(set(names)) != len(names):
        what = f"lacks {', '.join(missing)}" if missing else "has no row count or repeats a column"
        raise Error(f"{file}: it {what}: is it a scan of groundray?")
    return np.dtype(columns), count, end + len(b"end_header\n")
