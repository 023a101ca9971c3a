"""ROS 2 bags in MCAP: points, images, camera infos and transforms, in time order."""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundray.dataset import Camera, Dataset, Error, Frame, Lidar
from groundray.export.images import (
    has_depths,
    has_pictures,
    pixels_of,
    read_depths_m,
    read_picture,
)
from groundray.export.mcap_file import POINT_TYPES, Bag, Message
from groundray.export.notes import Notes
from groundray.export.ros_layouts import rows_of
from groundray.export.scan import FullScale, read_scan
from groundray.export.sensor_path import Floats, SensorPath, quaternion_wxyz
from groundray.file_content import read_yaml

MAP, BODY = "map", "base_link"
_MODELS = ("plumb_bob", "rational_polynomial", "equidistant")


@dataclass(frozen=True)
class BagOptions:
    """`shift_ns` is added to all times; None adds one second if the clock begins at 0."""

    layout: str
    compression: str
    shift_ns: int | None
    with_depths: bool
    full_scale: FullScale


def write_bag(
    dataset: Dataset,
    lidars: Sequence[Lidar],
    cameras: Sequence[Camera],
    options: BagOptions,
    out: Path,
    notes: Notes,
) -> str:
    """Writes a bag as `ros2 bag` does: `metadata.yaml` and `<name>.mcap`."""
    source = _Source(dataset, lidars, cameras, options, notes)
    bag = Bag(out / f"{dataset.folder.resolve().name or 'dataset'}.mcap", options.compression)
    try:
        bag.begin(_facts(dataset, source.shift_ns))
        for message in source.messages():
            bag.write(message)
        bag.end()
    finally:
        bag.file.close()
    (out / "metadata.yaml").write_text(bag.record())
    return f"{sum(bag.counts.values())} messages of {len(bag.counts)} topics"


def _facts(dataset: Dataset, shift_ns: int) -> dict[str, str]:
    return {
        "version": dataset.version,
        "seed": dataset.seed,
        "crs": dataset.crs,
        "crs_wkt": dataset.crs_wkt,
        "origin_w_m": " ".join(f"{value:.17g}" for value in dataset.origin_w_m),
        "time_origin_ns": str(dataset.time_origin_ns),
        "shift_ns": str(shift_ns),
    }


@dataclass
class _Source:
    """The messages of a dataset."""

    dataset: Dataset
    lidars: Sequence[Lidar]
    cameras: Sequence[Camera]
    options: BagOptions
    notes: Notes

    def __post_init__(self) -> None:
        self.topics = _topic_names([*self.lidars, *self.cameras])
        self.infos = {each.name: _camera_info(self.dataset, each) for each in self.cameras}
        self.shift_ns = self._shift_ns()

    def _shift_ns(self) -> int:
        shift_ns = self.options.shift_ns
        if shift_ns is None:
            shift_ns = 10**9 if self.dataset.time_origin_ns == 0 else 0
        if shift_ns and self.options.shift_ns is None:
            self.notes.tell(
                "stamps are shifted by 1 s: ROS reads a stamp of 0 as the latest; see --shift-s"
            )
        first_ns = self.dataset.time_origin_ns + shift_ns
        if not 0 <= first_ns < (2**31 - 10**7) * 10**9:
            rule = "ROS stamps must be from 0 to 2^31 s"
            raise Error(f"{self.dataset.folder}: {rule}; choose another --shift-s")
        return shift_ns

    def _stamp(self, time_ns: int) -> dict[str, int]:
        total_ns = self._log_time(time_ns)
        return {"sec": total_ns // 10**9, "nanosec": total_ns % 10**9}

    def _log_time(self, time_ns: int) -> int:
        return self.dataset.time_origin_ns + self.shift_ns + time_ns

    def _message(
        self, time_ns: int, order: int, topic: str, kind: str, values: dict[str, Any]
    ) -> Message:
        return Message(self._log_time(time_ns), order, topic, kind, values)

    def messages(self) -> Iterator[Message]:
        """Yields all messages in time order, reading one frame after another."""
        sensors: list[Lidar | Camera] = [*self.lidars, *self.cameras]
        path = SensorPath(self.dataset.path_file(sensors[0]))
        mount = sensors[0].X_BS if isinstance(sensors[0], Lidar) else sensors[0].X_BC
        yield self._static(int(path.times_ns[0]), sensors)
        streams = [self._body(path, np.linalg.inv(mount).astype(np.float64))]
        streams += [self._points(i, lidar) for i, lidar in enumerate(self.lidars, 1)]
        streams += [
            self._images(i, camera) for i, camera in enumerate(self.cameras, 1 + len(self.lidars))
        ]
        yield from heapq.merge(*streams, key=lambda message: message[:2])

    def _static(self, time_ns: int, sensors: Sequence[Lidar | Camera]) -> Message:
        transforms = []
        for sensor in sensors:
            X = sensor.X_BS if isinstance(sensor, Lidar) else sensor.X_BC
            transforms.append(
                self._transform(time_ns, BODY, self._frame(sensor), X[:3, :3], X[:3, 3])
            )
        return self._message(
            time_ns, 0, "/tf_static", "tf2_msgs/msg/TFMessage", {"transforms": transforms}
        )

    def _frame(self, sensor: Lidar | Camera) -> str:
        topic = self.topics[sensor.name]
        return topic if isinstance(sensor, Lidar) else f"{topic}_optical_frame"

    def _transform(
        self, time_ns: int, parent: str, child: str, R: Floats, p_m: Floats
    ) -> dict[str, Any]:
        w, x, y, z = quaternion_wxyz(R)
        return {
            "header": {"stamp": self._stamp(time_ns), "frame_id": parent},
            "child_frame_id": child,
            "transform": {
                "translation": dict(zip("xyz", map(float, p_m), strict=True)),
                "rotation": {"x": x, "y": y, "z": z, "w": w},
            },
        }

    def _body(self, path: SensorPath, X_SB: Floats) -> Iterator[Message]:
        """Yields X_DB at the poses of the path, extended to the end of the last sweep."""
        times_ns = path.times_ns
        last_ns = max((self._last_time_ns(lidar) for lidar in self.lidars), default=0)
        if last_ns > times_ns[-1]:
            path.pose_at(last_ns)  # raises if it is far beyond the path
        step_ns = 10**7
        more = np.arange(times_ns[-1] + step_ns, last_ns + 2 * step_ns, step_ns, dtype=np.int64)
        times_ns = np.concatenate([times_ns, more]) if last_ns > times_ns[-1] else times_ns
        for begin in range(0, len(times_ns), 1000):
            part = times_ns[begin : begin + 1000]
            rotations, positions_m = path.at(part)
            for time_ns, R, p_m in zip(part.tolist(), rotations, positions_m, strict=True):
                transform = self._transform(
                    time_ns, MAP, BODY, R @ X_SB[:3, :3], p_m + R @ X_SB[:3, 3]
                )
                yield self._message(
                    time_ns, 0, "/tf", "tf2_msgs/msg/TFMessage", {"transforms": [transform]}
                )

    def _last_time_ns(self, lidar: Lidar) -> int:
        if not lidar.frames:
            return 0
        times_ns = read_scan(self.dataset, lidar, lidar.frames[-1]).times_ns
        return int(times_ns.max()) if times_ns.size else lidar.frames[-1].stamp_ns

    def _points(self, order: int, lidar: Lidar) -> Iterator[Message]:
        topic, frame_id = f"/{self.topics[lidar.name]}/points", self._frame(lidar)
        for frame in lidar.frames:
            scan = read_scan(self.dataset, lidar, frame)
            rows = rows_of(self.options.layout, scan, self.options.full_scale, self.notes)
            header = {"stamp": self._stamp(frame.stamp_ns), "frame_id": frame_id}
            yield self._message(
                frame.stamp_ns, order, topic, "sensor_msgs/msg/PointCloud2", cloud_of(rows, header)
            )

    def _images(self, order: int, camera: Camera) -> Iterator[Message]:
        topic = f"/{self.topics[camera.name]}"
        with_pictures = has_pictures(self.dataset, camera)
        with_depths = self.options.with_depths and has_depths(self.dataset, camera)
        if not with_pictures:
            self.notes.tell(
                f"camera {camera.name} has no pictures (product picture), only a camera_info"
            )
        if self.options.with_depths and not with_depths:
            self.notes.tell(f"camera {camera.name} has no depths (product truth)")
        if camera.row_s:
            self.notes.tell(
                f"camera {camera.name} has a rolling shutter; stamps are those of the middle row"
            )
        for frame in camera.frames:
            time_ns = frame.stamp_ns + camera.middle_ns
            header = {"stamp": self._stamp(time_ns), "frame_id": self._frame(camera)}
            info = {**self.infos[camera.name], "header": header}
            yield self._message(
                time_ns, order, f"{topic}/camera_info", "sensor_msgs/msg/CameraInfo", info
            )
            if with_pictures:
                image = self._picture(camera, frame, header)
                yield self._message(
                    time_ns, order, f"{topic}/image_raw", "sensor_msgs/msg/Image", image
                )
            if with_depths:
                depths_m = read_depths_m(self.dataset, camera, frame).astype("<f4")
                image = _image(depths_m, "32FC1", header)
                yield self._message(
                    time_ns, order, f"{topic}/depth/image_raw", "sensor_msgs/msg/Image", image
                )

    def _picture(self, camera: Camera, frame: Frame, header: dict[str, Any]) -> dict[str, Any]:
        picture = read_picture(self.dataset, camera, frame)
        encoding = f"{'rgb' if picture.is_colour else 'mono'}{picture.bits}"
        return _image(pixels_of(picture), encoding, header)


def _topic_names(sensors: Sequence[Lidar | Camera]) -> dict[str, str]:
    """Returns valid ROS names: letters, digits and _, beginning with a letter."""
    names: dict[str, str] = {}
    for sensor in sensors:
        name = sensor.name.replace("-", "_")
        name = name if name[0].isalpha() else f"sensor_{name}".replace("__", "_")
        if name in names.values() or name in ("tf", "tf_static", MAP, BODY):
            rule = f"sensor {sensor.name}: its ROS name {name} is already in use"
            raise Error(f"{rule}; export it separately with --lidar or --camera")
        names[sensor.name] = name
    return names


def cloud_of(rows: NDArray[Any], header: dict[str, Any]) -> dict[str, Any]:
    """Returns a PointCloud2 of one row."""
    fields: Any = rows.dtype.fields or {}
    is_dense = all(bool(np.isfinite(rows[axis]).all()) for axis in "xyz")
    return {
        "header": header,
        "height": 1,
        "width": len(rows),
        "fields": [
            {"name": name, "offset": int(offset), "datatype": POINT_TYPES[kind.str[1:]], "count": 1}
            for name, (kind, offset, *_) in fields.items()
        ],
        "is_bigendian": False,
        "point_step": rows.dtype.itemsize,
        "row_step": rows.dtype.itemsize * len(rows),
        "data": rows.tobytes(),
        "is_dense": is_dense,
    }


def _image(pixels: NDArray[Any], encoding: str, header: dict[str, Any]) -> dict[str, Any]:
    height, width = pixels.shape[:2]
    data = pixels.tobytes()
    return {
        "header": header,
        "height": height,
        "width": width,
        "encoding": encoding,
        "is_bigendian": 0,
        "step": len(data) // height,
        "data": data,
    }


def _camera_info(dataset: Dataset, camera: Camera) -> dict[str, Any]:
    """Returns CameraInfo without its header, from the file with the lens in ROS's terms."""
    file = dataset.camera_info_file(camera)
    if not file.is_file():
        rule = f"camera {camera.name} has the lens {camera.lens_model}, unknown to CameraInfo"
        fix = "exclude it: name the others with --camera, or give --no-images"
        raise Error(f"{dataset.folder}: {rule} ({', '.join(_MODELS)}); {fix}")
    read = read_yaml(file)
    try:
        values = {
            "height": int(read["image_height"]),
            "width": int(read["image_width"]),
            "distortion_model": str(read["distortion_model"]),
            "d": [float(k) for k in read["distortion_coefficients"]["data"]],
            "k": [float(each) for each in read["camera_matrix"]["data"]],
            "r": [float(each) for each in read["rectification_matrix"]["data"]],
            "p": [float(each) for each in read["projection_matrix"]["data"]],
        }
    except (KeyError, TypeError, ValueError) as fault:
        raise Error(f"{file}: it is not a camera_info of ROS: {fault!r}: is it damaged?") from None
    sizes = {name: len(values[name]) for name in ("k", "r", "p")}  # type: ignore[arg-type]
    if sizes != {"k": 9, "r": 9, "p": 12} or values["distortion_model"] not in _MODELS:
        raise Error(
            f"{file}: its matrices or its model are not those of a camera_info: is it damaged?"
        )
    region = {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False}
    return {**values, "binning_x": 0, "binning_y": 0, "roi": region}
