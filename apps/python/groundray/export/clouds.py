"""PCD and NPZ: a file for each scan."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundray.dataset import Dataset, Error, Lidar
from groundray.export.notes import Notes
from groundray.export.scan import UNITS, Scan, read_scan
from groundray.export.sensor_path import Floats, SensorPath, quaternion_wxyz

_PCD_KINDS = {"f": "F", "i": "I", "u": "U"}


def write_pcd(
    dataset: Dataset, lidars: Sequence[Lidar], columns: Sequence[str], frame: str, out: Path
) -> str:
    """Writes `<lidar>/000000.pcd`, binary, with these columns (all if the list is empty).

    `frame` is that of x, y, z: `fired`, as in the scan; `stamp`, S at the stamp; `world`, D.
    """
    count = 0
    for scan, path, file in _scans_of(dataset, lidars, out):
        rows, stamp_ns = scan.rows, scan.frame.stamp_ns
        X_DS = path.pose_at(stamp_ns)
        if frame != "fired":
            is_world = frame == "world"
            points_m = (
                scan.points_in_world_m(path) if is_world else scan.points_at_m(path, stamp_ns)
            )
            rows = rows.copy()
            for i, axis in enumerate("xyz"):
                rows[axis] = points_m[:, i]
            X_DS = np.eye(4) if is_world else X_DS
        rows = chosen_columns(rows, columns, str(dataset.scan_file(scan.lidar, scan.frame)))
        normals = {f"n{axis}": f"normal_{axis}" for axis in "xyz"} if frame == "world" else {}
        data = _pcd_header(rows, X_DS, normals) + rows.tobytes()
        file.with_suffix(".pcd").write_bytes(data)
        count += 1
    return f"{count} scans"


def _scans_of(
    dataset: Dataset, lidars: Sequence[Lidar], out: Path
) -> Iterator[tuple[Scan, SensorPath, Path]]:
    """Yields each scan with its sensor's path and its file, `<lidar>/000000`, in a new folder."""
    for lidar in lidars:
        path = SensorPath(dataset.path_file(lidar))
        (out / lidar.name).mkdir()
        for frame in lidar.frames:
            yield read_scan(dataset, lidar, frame), path, out / lidar.name / f"{frame.number:06}"


def chosen_columns(rows: NDArray[Any], columns: Sequence[str], file: str) -> NDArray[Any]:
    """Returns these columns, packed, in this order. Raises Error for an unknown one."""
    names = tuple(rows.dtype.names or ())
    missing = [name for name in columns if name not in names]
    if missing:
        rule = f"it has no column {', '.join(missing)}; it has {', '.join(names)}"
        raise Error(f"{file}: {rule}")
    kept = list(columns) or list(names)
    packed = np.zeros(len(rows), [(name, rows.dtype[name]) for name in kept])
    for name in kept:
        packed[name] = rows[name]
    return packed


def _pcd_header(rows: NDArray[Any], X_DS: Floats, other_names: dict[str, str]) -> bytes:
    names = rows.dtype.names or ()
    types = [rows.dtype[name] for name in names]
    position_m, (w, x, y, z) = X_DS[:3, 3], quaternion_wxyz(X_DS[:3, :3])
    view = " ".join(f"{value:.9g}" for value in (*position_m, w, x, y, z))
    lines = [
        "# .PCD v0.7 - Point Cloud Data file format",
        "VERSION 0.7",
        "FIELDS " + " ".join(other_names.get(name, name) for name in names),
        "SIZE " + " ".join(str(each.itemsize) for each in types),
        "TYPE " + " ".join(_PCD_KINDS[each.kind] for each in types),
        "COUNT " + " ".join("1" for _ in types),
        f"WIDTH {len(rows)}",
        "HEIGHT 1",
        f"VIEWPOINT {view}",
        f"POINTS {len(rows)}",
        "DATA binary",
    ]
    return ("\n".join(lines) + "\n").encode("ascii")


def write_npz(dataset: Dataset, lidars: Sequence[Lidar], out: Path) -> str:
    """Writes `<lidar>/000000.npz`: an array for each column, its unit in its name, and the pose."""
    count = 0
    for scan, path, file in _scans_of(dataset, lidars, out):
        stamp_ns = scan.frame.stamp_ns
        arrays: dict[str, Any] = {
            "stamp_ns": np.int64(dataset.time_origin_ns + stamp_ns),
            "X_DS": path.pose_at(stamp_ns),
            "origin_w_m": dataset.origin_w_m,
            "crs_wkt": np.str_(dataset.crs_wkt),
        }
        for name in scan.names:
            arrays[name_with_unit(name)] = np.ascontiguousarray(scan.rows[name])
        np.savez(file.with_suffix(".npz"), **arrays)
        count += 1
    return f"{count} scans"


def name_with_unit(column: str) -> str:
    """Returns the name of a column with its unit: range_true_m for range_true."""
    unit = UNITS.get(column, "").replace("/", "_").lower()
    return f"{column}_{unit}" if unit else column


def tell_of_scan(scan: Scan, notes: Notes) -> None:
    """Notes echoes of air and false alarms, which formats without `kind` cannot mark."""
    if "kind" in scan.names:
        sentence = "{} points are unmarked echoes of air or false alarms; their label is 0"
        notes.count(sentence, int(np.count_nonzero(scan.rows["kind"])))
