"""PointCloud2 layouts of ROS 2 drivers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundray.export.notes import Notes
from groundray.export.scan import FullScale, Scan

Rows = NDArray[Any]

# Field offsets are those of the drivers' own structures, padding included.
VELODYNE = np.dtype(
    [*((name, "<f4") for name in ("x", "y", "z", "intensity")), ("ring", "<u2"), ("time", "<f4")]
)
OUSTER = np.dtype(
    {
        "names": ["x", "y", "z", "intensity", "t", "reflectivity", "ring", "ambient", "range"],
        "formats": ["<f4", "<f4", "<f4", "<f4", "<u4", "<u2", "<u2", "<u2", "<u4"],
        "offsets": [0, 4, 8, 16, 20, 24, 26, 28, 32],
        "itemsize": 48,
    }
)
AUTOWARE = np.dtype(
    [
        *[("x", "<f4"), ("y", "<f4"), ("z", "<f4")],
        *[("intensity", "u1"), ("return_type", "u1"), ("channel", "<u2")],
        *[("azimuth", "<f4"), ("elevation", "<f4"), ("distance", "<f4"), ("time_stamp", "<u4")],
    ]
)

# Return types of Autoware.
_INVALID, _SINGLE_STRONGEST, _SINGLE_LAST, _DUAL_ONLY = 0, 1, 2, 7
_STRONGEST_FIRST, _STRONGEST_LAST, _WEAK_FIRST, _WEAK_LAST = 3, 4, 5, 6
# Type of a pulse's only echo, by the lidar's choice of returns; otherwise single strongest.
_OF_ONE = {"last": _SINGLE_LAST, "dual": _DUAL_ONLY, "all": _DUAL_ONLY}


def rows_of(layout: str, scan: Scan, full_scale: FullScale, notes: Notes) -> Rows:
    """Returns a scan's points in a layout: velodyne, ouster, autoware, or full, all columns."""
    if layout == "velodyne":
        return _velodyne(scan, full_scale)
    if layout == "ouster":
        return _ouster(scan, full_scale, notes)
    if layout == "autoware":
        return _autoware(scan, full_scale, notes)
    return scan.rows


def _with_places(scan: Scan, layout: np.dtype[Any]) -> Rows:
    rows: Rows = np.zeros(len(scan), layout)
    for axis in "xyz":
        rows[axis] = scan.rows[axis]
    return rows


def _velodyne(scan: Scan, full_scale: FullScale) -> Rows:
    rows = _with_places(scan, VELODYNE)
    rows["intensity"] = full_scale.shares(scan.lidar, scan.rows) * 255
    rows["ring"] = scan.rows["ring"]
    rows["time"] = scan.rows["time"]
    return rows


def _offsets_ns(scan: Scan) -> NDArray[np.uint32]:
    return (scan.times_ns - scan.frame.stamp_ns).astype(np.uint32)


def _ouster(scan: Scan, full_scale: FullScale, notes: Notes) -> Rows:
    rows = _with_places(scan, OUSTER)
    rows["intensity"] = scan.rows["intensity"]
    rows["t"] = _offsets_ns(scan)
    rows["reflectivity"], clipped = full_scale.whole(scan.lidar, scan.rows, 255)
    notes.count("{} reflectivities are clipped at 255", clipped)
    rows["ring"] = scan.rows["ring"]
    rows["range"] = np.rint(np.linalg.norm(scan.points_m, axis=1) * 1000)
    notes.tell("ambient of the Ouster layout is 0: the dataset has no ambient light")
    return rows


def _autoware(scan: Scan, full_scale: FullScale, notes: Notes) -> Rows:
    rows = _with_places(scan, AUTOWARE)
    rows["intensity"], clipped = full_scale.whole(scan.lidar, scan.rows, 255)
    notes.count("{} intensities are clipped at 255", clipped)
    rows["return_type"] = _return_types(scan, notes)
    rows["channel"] = scan.rows["ring"]
    x, y, z = scan.points_m.T
    rows["azimuth"] = np.arctan2(y, x)
    rows["elevation"] = np.arctan2(z, np.hypot(x, y))
    rows["distance"] = np.linalg.norm(scan.points_m, axis=1)
    rows["time_stamp"] = _offsets_ns(scan)
    return rows


def _return_types(scan: Scan, notes: Notes) -> NDArray[np.uint8]:
    """Returns types: one echo by the lidar's returns, two by order and strength, more as 0."""
    rows = scan.rows
    count, index = rows["return_count"], rows["return_index"]
    of_one = _OF_ONE.get(scan.lidar.returns, _SINGLE_STRONGEST)
    if scan.lidar.returns in ("first", "second"):
        notes.tell(
            f"return_type of {scan.lidar.returns} echoes is single strongest: it has no other"
        )
    types = np.where(count == 1, of_one, _INVALID).astype(np.uint8)
    # Echoes of one pulse follow each other.
    first = np.flatnonzero((count == 2) & (index == 1))
    first = first[first + 1 < len(rows)]
    first = first[(count[first + 1] == 2) & (index[first + 1] == 2)]
    strength = rows["amplitude" if "amplitude" in scan.names else "intensity"]
    is_first_stronger = strength[first] >= strength[first + 1]
    types[first] = np.where(is_first_stronger, _STRONGEST_FIRST, _WEAK_FIRST)
    types[first + 1] = np.where(is_first_stronger, _WEAK_LAST, _STRONGEST_LAST)
    notes.count(
        "{} points belong to pulses with more than two returns: their return_type is 0",
        int(np.count_nonzero(count > 2)),
    )
    return types
