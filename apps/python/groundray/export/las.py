"""LAS and LAZ 1.4: scans in the coordinates of the CRS, with all columns as extra bytes."""

from __future__ import annotations

import datetime
import errno
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from groundray.dataset import Dataset, Error, Lidar
from groundray.export.labels import LabelMap
from groundray.export.notes import Notes
from groundray.export.scan import MEANINGS, UNITS, FullScale, Scan, read_scan
from groundray.export.sensor_path import Floats, SensorPath

_POINT_FORMAT = 6
_MOST_RETURNS = 15  # limit of the four bits in point format 6
_WEEK_S = 604800
_NO_DAY = datetime.date(2000, 1, 1)  # constant, so that equal datasets yield equal files
_GPS_ADJUSTED_S = 10**9
_GPS_EPOCH_UNIX_S = 315964800  # 1980-01-06
# Leap seconds since the GPS epoch, Unix seconds: each puts GPS one more second ahead of UTC.
_LEAP_SECONDS = (
    362793600, 394329600, 425865600, 489024000, 567993600, 631152000, 662688000, 709948800,
    741484800, 773020800, 820454400, 867715200, 915148800, 1136073600, 1230768000, 1341100800,
    1435708800, 1483228800,
)  # fmt: skip


@dataclass(frozen=True)
class LasOptions:
    """`place`: `measured`, the points as reported, or `truth`, the points on the surface.

    `clock` is that of the dataset's times: `run`, `gps` or `unix`.
    """

    suffix: str
    is_merged: bool
    place: str
    clock: str
    full_scale: FullScale
    labels: LabelMap | None


class _Form:
    """The header of all files of one lidar."""

    def __init__(self, dataset: Dataset, paths: Sequence[SensorPath], options: LasOptions) -> None:
        self.dataset = dataset
        self.options = options
        self.offset_m = np.rint(dataset.origin_w_m)
        reach_m = max(float(np.abs(path.positions_m).max()) for path in paths)
        # 32 bits of 0.1 mm reach 214 km, of 1 mm 2147 km.
        self.scale_m = 1e-4 if reach_m < 150e3 else 1e-3
        if reach_m > 2000e3:
            rule = f"its paths extend {reach_m:.0f} m from origin_w_m, too far for LAS files"
            raise Error(f"{dataset.folder}: {rule}")
        self.wkt = _wkt1(dataset)

    def header(self, scan: Scan, number: int) -> Any:
        """Returns the header of a file with the columns of this scan."""
        import laspy
        from laspy.vlrs.known import WktCoordinateSystemVlr

        header = laspy.LasHeader(point_format=_POINT_FORMAT, version="1.4")
        header.scales = np.full(3, self.scale_m)
        header.offsets = self.offset_m
        header.creation_date = _NO_DAY
        header.system_identifier = "groundray"
        header.generating_software = f"groundray {self.dataset.version}"
        header.file_source_id = min(number + 1, 65535)
        is_gps = self.options.clock != "run"
        header.global_encoding.gps_time_type = laspy.header.GpsTimeType(int(is_gps))
        header.global_encoding.synthetic_return_numbers = False
        header.add_extra_dims(
            [
                laspy.ExtraBytesParams(
                    _extra_name(name), scan.rows.dtype[name].newbyteorder("="), _meaning(name)
                )
                for name in scan.names
            ]
        )
        if self.wkt:
            header.global_encoding.wkt = True
            header.vlrs.append(WktCoordinateSystemVlr(self.wkt))
        return header

    def points(self, scan: Scan, path: SensorPath, header: Any, notes: Notes) -> Any:
        """Returns the scan's rows as LAS points."""
        import laspy

        rows = scan.rows
        record = laspy.ScaleAwarePointRecord.zeros(len(rows), header=header)
        D_m = (
            np.stack([rows[f"world_{axis}"] for axis in "xyz"], axis=-1)
            if self.options.place == "truth"
            else scan.points_in_world_m(path)
        )
        # Whole numbers of the scale, from the exact difference of origin and offset.
        whole = np.rint((D_m + (self.dataset.origin_w_m - self.offset_m)) / self.scale_m)
        if not np.all(np.abs(whole) < 2**31 - 1):
            file = self.dataset.scan_file(scan.lidar, scan.frame)
            raise Error(f"{file}: points are too far from origin_w_m for LAS files")
        record.X, record.Y, record.Z = (whole[:, i].astype(np.int32) for i in range(3))
        intensity, clipped = self.options.full_scale.whole(scan.lidar, rows, 65535)
        notes.count(
            "{} intensities are clipped at full scale; intensity_own has their values", clipped
        )
        record.intensity = intensity.astype(np.uint16)
        count = np.minimum(rows["return_count"], _MOST_RETURNS)
        record.return_number = np.minimum(rows["return_index"], count)
        record.number_of_returns = count
        many = int(np.count_nonzero(rows["return_count"] > _MOST_RETURNS))
        notes.count(
            "{} points belong to pulses with more than 15 returns, which LAS cannot number", many
        )
        if self.options.labels:
            record.classification = self.options.labels.of(rows["label"]).astype(np.uint8)
        record.point_source_id = np.full(len(rows), min(scan.lidar.number + 1, 65535), np.uint16)
        record.gps_time = self._gps_times_s(scan)
        for name in scan.names:
            record[_extra_name(name)] = rows[name]
        return record

    def _gps_times_s(self, scan: Scan) -> Floats:
        begin_ns = self.dataset.time_origin_ns + scan.frame.stamp_ns
        if self.options.clock != "run":
            begin_ns -= _GPS_ADJUSTED_S * 10**9
        if self.options.clock == "unix":
            unix_s = (self.dataset.time_origin_ns + scan.frame.stamp_ns) // 10**9
            leap_s = sum(since <= unix_s for since in _LEAP_SECONDS)
            begin_ns += (leap_s - _GPS_EPOCH_UNIX_S) * 10**9
        times_s = begin_ns * 1e-9 + scan.rows["time"].astype(float)
        if self.options.clock == "run" and times_s.size > 0 and times_s.max() >= _WEEK_S:
            raise Error(
                f"{self.dataset.folder}: its clock reaches {times_s.max():.0f} s, but GPS week "
                f"time, as which --clock run marks it, ends at {_WEEK_S} s: give --clock gps if "
                "the trajectory's clock counts from 1980, or --clock unix if from 1970"
            )
        return times_s


def _extra_name(column: str) -> str:
    """Renames x, y, z and intensity of the sensor: LAS has fields of these names."""
    if column in "xyz":
        return f"sensor_{column}"
    return {"intensity": "intensity_own"}.get(column, column)


def _meaning(column: str) -> str:
    """Returns unit and meaning, cut off at 32 bytes."""
    meaning = "as reported, in the lidar" if column in "xyz" else MEANINGS.get(column, "")
    unit = UNITS.get(column)
    return (f"{unit}; {meaning}" if unit else meaning)[:32]


def _wkt1(dataset: Dataset) -> str:
    """Returns the CRS as WKT 1, which LAS 1.4 requires; unchanged if WKT 1 cannot express it."""
    import pyproj

    if not dataset.crs_wkt:
        return ""
    try:
        crs = pyproj.CRS.from_wkt(dataset.crs_wkt)
    except pyproj.exceptions.CRSError as fault:
        raise Error(f"{dataset.folder}/dataset.yaml: crs_wkt is not a CRS: {fault}") from None
    try:
        return str(crs.to_wkt("WKT1_GDAL"))
    except pyproj.exceptions.CRSError:
        return dataset.crs_wkt


def write_las(
    dataset: Dataset, lidars: Sequence[Lidar], options: LasOptions, out: Path, notes: Notes
) -> str:
    """Writes `<lidar>/000000.las`, or `<lidar>.las` with all scans if they are merged."""
    paths = [SensorPath(dataset.path_file(lidar)) for lidar in lidars]
    form = _Form(dataset, paths, options)
    if not form.wkt:
        notes.tell("the dataset has no CRS: the files have none, and coordinates are those of W")
    if options.clock == "run":
        notes.tell("times are seconds of the dataset's clock, marked as GPS week time; see --clock")
    if options.labels is None:
        notes.tell(
            "all classes are 0, never classified: the column label has the dataset's; see --labels"
        )
    for lidar, path in zip(lidars, paths, strict=True):
        _write_lidar(form, lidar, path, out, notes)
    return f"{sum(len(lidar.frames) for lidar in lidars)} scans"


def _write_lidar(form: _Form, lidar: Lidar, path: SensorPath, out: Path, notes: Notes) -> None:
    suffix, is_merged = form.options.suffix, form.options.is_merged
    file: _LasFile | None = None
    if not is_merged:
        (out / lidar.name).mkdir()
    for frame in lidar.frames:
        scan = read_scan(form.dataset, lidar, frame)
        if file is None or not is_merged:
            name = lidar.name if is_merged else f"{lidar.name}/{frame.number:06}"
            file = _LasFile(out / f"{name}.{suffix}", form.header(scan, lidar.number), scan.names)
        if scan.names != file.columns:
            rule = "its columns differ from those of the previous scans"
            place = form.dataset.scan_file(lidar, frame)
            raise Error(f"{place}: {rule}; export without --merge")
        file.write(form.points(scan, path, file.header, notes))
        if not is_merged:
            file.close()
    if is_merged and file is not None:
        file.close()


class _LasFile:
    """A file that is being written; errors of the compressor are raised as write errors."""

    def __init__(self, place: Path, header: Any, columns: tuple[str, ...]) -> None:
        import laspy

        self.header = header
        self.columns = columns
        self._place = place
        self._stream = place.open("wb")
        is_packed = place.suffix == ".laz"
        self._writer = laspy.open(
            self._stream, "w", header=header, do_compress=is_packed, closefd=False
        )

    def write(self, points: Any) -> None:
        self._guarded(lambda: self._writer.write_points(points))

    def close(self) -> None:
        self._guarded(self._writer.close)
        self._stream.close()

    def _guarded(self, work: Callable[[], object]) -> None:
        try:
            work()
        except RuntimeError as fault:  # raised by the compressor for a full disk
            self._stream.close()
            raise OSError(errno.EIO, f"cannot write: {fault}", str(self._place)) from None
