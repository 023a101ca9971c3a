"""Reader of datasets written by `groundray generate`: contents, scans, paths and cameras.

Files are read on request, one at a time. Lengths are metres, angles radians; times are whole
nanoseconds on the dataset's own clock, which begins at `Dataset.time_origin_ns`. Frames: D is the
dataset frame (east, north, up; W minus `origin_w_m`), B the body, S a lidar, C a camera.
"""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundray._core import Error
from groundray.file_content import load_yaml, read_text

__all__ = ["Camera", "Dataset", "Error", "Frame", "Lidar", "ObjectGroup", "StereoPair", "matrix_of"]

Floats = NDArray[np.float64]

MOST_S = 2**32
"""Upper bound of times: the year 2106; the sum of two fits into 64 bits as nanoseconds."""
_OF_TIMES = "must be within 2^32 s; was the file damaged?"


@dataclass(frozen=True)
class Frame:
    """A finished scan or image: its number, and the time at which it begins."""

    number: int
    stamp_ns: int


@dataclass(frozen=True)
class Lidar:
    """A lidar. `is_deskewed`: x, y, z are in S at the stamp, else in S as each pulse fired.

    `intensity_scale` is the meaning of its column: `cosine` (without light), `power`, `reflectance`
    or `eight_bit`. `returns` names the echoes of a pulse that it reports.
    """

    name: str
    number: int
    model: str
    frames: tuple[Frame, ...]
    X_BS: Floats
    is_deskewed: bool
    intensity_scale: str
    returns: str


@dataclass(frozen=True)
class Camera:
    """A camera: its lens is `lens_model` with the parameters of the calibration.

    X_BC is the mount of C as rendered. Row v is exposed from stamp + v `row_s` for `exposure_s`.
    """

    name: str
    number: int
    model: str
    frames: tuple[Frame, ...]
    X_BC: Floats
    size_px: tuple[int, int]
    lens_model: str
    lens: dict[str, Any]
    pinhole_matrix: Floats | None  # K, 3 x 3, px; None if the lens is not a pinhole
    exposure_s: float
    row_s: float

    @property
    def middle_ns(self) -> int:
        """Time from an image's stamp to the middle of its middle row's exposure."""
        return round((self.exposure_s + self.row_s * (self.size_px[1] - 1)) / 2 * 1e9)


@dataclass(frozen=True)
class StereoPair:
    """Two cameras by their names."""

    name: str
    left: str
    right: str
    is_rectified: bool


@dataclass(frozen=True)
class ObjectGroup:
    """Objects of one entry of the scene: `count` instances from `first_instance` on."""

    name: str
    label: int
    first_instance: int
    count: int


def nanoseconds_of(text: str) -> int:
    """Converts the text of seconds to whole nanoseconds: a double has too few digits.

    Raises ValueError with the rule if the text is not a number within `MOST_S` of 0.
    """
    try:
        seconds = Decimal(text)
    except InvalidOperation:
        raise ValueError("must be a number of seconds") from None
    if seconds.is_nan() or not seconds.copy_abs() < MOST_S:
        raise ValueError(_OF_TIMES)
    return int((seconds * 10**9).to_integral_value())


def matrix_of(
    rotation_xyzw: Sequence[float] | Floats, translation_m: Sequence[float] | Floats
) -> Floats:
    """Returns the pose as a 4 x 4 matrix."""
    x, y, z, w = np.asarray(rotation_xyzw, dtype=float) / np.linalg.norm(rotation_xyzw)
    X = np.eye(4)
    X[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    X[:3, 3] = translation_m
    return X


class _Map:
    """A map of a YAML file; errors of its values state file and key."""

    def __init__(self, path: Path, value: Any, where: str = "") -> None:
        self.path = path
        self.where = where
        if not isinstance(value, dict):
            raise Error(
                f"{path}: {where or 'the file'} must be a map of keys and values; was it cut short?"
            )
        self.values: dict[str, Any] = value

    def fault(self, key: str, rule: str) -> Error:
        place = f"{self.where}.{key}" if self.where else key
        return Error(f"{self.path}: {place} {rule}")

    def get(self, key: str) -> Any:
        if key not in self.values:
            raise self.fault(key, "is missing: is this a complete file of groundray?")
        return self.values[key]

    def text(self, key: str, default: str | None = None) -> str:
        value = self.values.get(key, default) if default is not None else self.get(key)
        if not isinstance(value, str):
            raise self.fault(key, "must be text")
        return value

    def numbers(self, key: str, count: int | None = None) -> list[float]:
        value = self.get(key)
        try:
            numbers = [float(each) for each in value] if isinstance(value, list) else [float(value)]
        except (TypeError, ValueError):
            raise self.fault(key, f"= {value} must be numeric") from None
        if (count is not None and len(numbers) != count) or not np.all(np.isfinite(numbers)):
            expected = "finite numbers" if count is None else f"{count} finite numbers"
            raise self.fault(key, f"= {value} must be {expected}")
        return numbers

    def whole(self, key: str) -> int:
        number = self.numbers(key, 1)[0]
        if number != int(number):
            raise self.fault(key, f"= {number} must be a whole number")
        return int(number)

    def time_ns(self, key: str) -> int:
        """Reads seconds exactly, to the nanosecond."""
        try:
            return nanoseconds_of(self.text(key))
        except ValueError as fault:
            raise self.fault(key, f"= {self.values[key]} {fault}") from None

    def seconds(self, key: str) -> float:
        seconds = self.numbers(key, 1)[0]
        if not abs(seconds) < MOST_S:
            raise self.fault(key, f"= {seconds} {_OF_TIMES}")
        return seconds

    def classes(self) -> dict[int, str]:
        """Returns the classes by label at `classes`; none if there is no such key."""
        classes = self.values.get("classes", {})
        texts = isinstance(classes, dict) and all(isinstance(k, str) for k in classes.values())
        if not texts or not all(label.isdecimal() for label in classes):
            raise self.fault("classes", "must be a map of labels to classes")
        return {int(label): name for label, name in classes.items()}

    def texts(self, key: str) -> dict[str, str]:
        """Returns the values of a map as texts, lists and maps as JSON; none without the key."""
        values = self.values.get(key, {})
        if not isinstance(values, dict):
            raise self.fault(key, "must be a map of keys and values; was the file cut short?")
        return {
            str(each): value if isinstance(value, str) else json.dumps(value)
            for each, value in values.items()
        }

    def maps(self, key: str, *, is_optional: bool = False) -> list[_Map]:
        value = self.values.get(key, []) if is_optional else self.get(key)
        if not isinstance(value, list):
            raise self.fault(key, "must be a list; was the file cut short?")
        return [_Map(self.path, each, f"{key}[{i}]") for i, each in enumerate(value)]


def _read_map(path: Path) -> _Map:
    return _Map(path, load_yaml(read_text(path), path))


def _read_mount(calibration: _Map, key: str) -> Floats:
    mount = _Map(calibration.path, calibration.values.get(key, {}), key)
    if not mount.values:
        return np.eye(4)
    rotation_xyzw = mount.numbers("rotation_xyzw", 4)
    if abs(np.linalg.norm(rotation_xyzw) - 1) > 1e-6:
        raise mount.fault("rotation_xyzw", "must have length 1")
    return matrix_of(rotation_xyzw, mount.numbers("translation_m", 3))


def _why_no_dataset(folder: Path) -> str:
    if folder.is_file():
        return "it is a file; give the folder that groundray generate wrote"
    if folder.exists():
        return "it contains no dataset.yaml; give an output of groundray generate"
    names = [each.name for each in folder.parent.iterdir()] if folder.parent.is_dir() else []
    near = difflib.get_close_matches(folder.name, sorted(names), n=1)
    return "there is no such folder" + "".join(f"; did you mean '{name}'?" for name in near)


class Dataset:
    """Contents of the `dataset.yaml` and the calibrations of a folder."""

    def __init__(self, folder: str | Path) -> None:
        """Reads everything except scans, images and paths.

        Raises Error if the folder contains no dataset, or one of its files is invalid.
        """
        self.folder = Path(folder)
        record = self.folder / "dataset.yaml"
        if not record.is_file():
            raise Error(f"{self.folder}: {_why_no_dataset(self.folder)}")
        root = _read_map(record)
        if root.text("groundray_dataset") != "1":
            raise root.fault(
                "groundray_dataset",
                f"= {root.get('groundray_dataset')} must be 1: use a newer groundray",
            )
        self.version = root.text("version", "")
        self.seed = root.text("seed", "")
        self.world = root.whole("world") if "world" in root.values else None
        self.drawn = root.texts("drawn")
        self.time_origin_ns = root.time_ns("time_origin_s") if "time_origin_s" in root.values else 0
        self.origin_w_m: Floats = np.array(root.numbers("origin_w_m", 3))
        self.crs = root.text("crs", "")
        self.crs_wkt = root.text("crs_wkt", "")
        self.scene = root.text("scene", "")
        self.pairs: list[StereoPair] = []
        self.lidars: list[Lidar] = []
        self.cameras: list[Camera] = []
        self.pending = 0
        frames = self._read_frames(root)
        for sensor in root.maps("sensors"):
            self._read_sensor(sensor, frames)
        self.classes = root.classes()
        self.object_groups = [
            ObjectGroup(
                each.text("name"),
                each.whole("label"),
                each.whole("first_instance"),
                each.whole("count"),
            )
            for each in root.maps("objects", is_optional=True)
        ]

    def _read_frames(self, root: _Map) -> dict[str, list[Frame | None]]:
        """Returns the frames of each sensor; None for a pending frame."""
        frames: dict[str, list[Frame | None]] = {}
        for each in root.maps("frames"):
            state = each.text("state")
            if state not in ("done", "pending"):
                raise each.fault("state", f"= {state} must be done or pending")
            frame = Frame(each.whole("frame"), each.time_ns("stamp_s")) if state == "done" else None
            frames.setdefault(each.text("sensor"), []).append(frame)
        return frames

    def _read_sensor(self, sensor: _Map, frames: dict[str, list[Frame | None]]) -> None:
        name, kind = sensor.text("name"), sensor.text("kind")
        if not re.fullmatch(r"[A-Za-z0-9_-]+", name):
            raise sensor.fault("name", f"= {name!r} must consist of letters, digits, _ and -")
        if kind == "stereo":
            is_rectified = sensor.text("images", "") == "rectified"
            self.pairs.append(
                StereoPair(name, sensor.text("left"), sensor.text("right"), is_rectified)
            )
            return
        listed = frames.get(name, [])
        if "frames" in sensor.values and sensor.whole("frames") != len(listed):
            rule = f"= {sensor.whole('frames')}, but {len(listed)} of {name} are listed"
            raise sensor.fault("frames", f"{rule}: was the file cut short?")
        done = tuple(sorted((f for f in listed if f is not None), key=lambda frame: frame.number))
        self.pending += len(listed) - len(done)
        calibration = _read_map(self.folder / "calibration" / f"{name}.yaml")
        number = sensor.whole("number")
        if kind == "lidar":
            self.lidars.append(_lidar(name, number, done, calibration, self.scene))
        elif kind == "camera":
            self.cameras.append(_camera(name, number, done, calibration))
        else:
            raise sensor.fault("kind", f"= {kind} must be lidar, camera or stereo")

    def scan_file(self, lidar: Lidar, frame: Frame, suffix: str = ".ply") -> Path:
        """Returns the file of a scan."""
        return self.folder / "lidar" / lidar.name / f"{frame.number:06}{suffix}"

    def image_file(self, camera: Camera, frame: Frame, suffix: str) -> Path:
        """Returns the file of an image's product, which need not exist."""
        return self.folder / "camera" / camera.name / f"{frame.number:06}{suffix}"

    def path_file(self, sensor: Lidar | Camera) -> Path:
        """Returns the file of the sensor's path through D."""
        return self.folder / "poses" / f"{sensor.name}.tum"

    def camera_info_file(self, camera: Camera) -> Path:
        """Returns the file of the ROS camera_info; it exists if ROS supports the lens."""
        return self.folder / "calibration" / f"{camera.name}.ros.yaml"


def _pinhole_matrix(model: str, lens: _Map) -> Floats | None:
    is_plain = "coefficients" not in lens.values or not any(lens.numbers("coefficients"))
    if model not in ("pinhole", "brown_conrady") or not is_plain:
        return None
    (f_u, f_v), (c_u, c_v) = lens.numbers("focal_px", 2), lens.numbers("centre_px", 2)
    skew = lens.numbers("skew", 1)[0] if "skew" in lens.values else 0.0
    return np.array([[f_u, f_u * skew, c_u], [0, f_v, c_v], [0, 0, 1]])


def _camera(name: str, number: int, frames: tuple[Frame, ...], calibration: _Map) -> Camera:
    lenses = _Map(calibration.path, calibration.get("lens"), "lens").values
    if len(lenses) != 1:
        raise calibration.fault("lens", "must have one key, the lens model")
    ((lens_model, values),) = lenses.items()
    lens = _Map(calibration.path, {} if values is None else values, f"lens.{lens_model}")
    width, height = calibration.numbers("size_px", 2)
    exposure_s, row_s = calibration.seconds("exposure_s"), calibration.seconds("row_s")
    if not (1 <= width < 2**31 and 1 <= height < 2**31):
        raise calibration.fault("size_px", f"= [{width}, {height}] must be from 1 to 2^31 px")
    if not abs(exposure_s) + abs(row_s * height) < MOST_S:
        raise calibration.fault("row_s", f"= {row_s} must end within 2^32 s")
    return Camera(
        name=name,
        number=number,
        model=calibration.text("model", ""),
        frames=frames,
        X_BC=_read_mount(calibration, "X_BC"),
        size_px=(int(width), int(height)),
        lens_model=lens_model,
        lens=lens.values,
        pinhole_matrix=_pinhole_matrix(lens_model, lens),
        exposure_s=exposure_s,
        row_s=row_s,
    )


def _receiver(name: str, calibration: _Map, scene: str) -> dict[str, Any]:
    """Returns the receiver of the scene, else of the lidar's file; empty without a laser."""
    own = load_yaml(calibration.text("lidar_file", "{}"), calibration.path)
    settings: dict[str, Any] = dict(own) if isinstance(own, dict) else {}
    of_scene = load_yaml(scene, calibration.path) if scene else {}
    lidars = of_scene.get("lidars", []) if isinstance(of_scene, dict) else []
    for lidar in lidars if isinstance(lidars, list) else []:
        if isinstance(lidar, dict) and lidar.get("name") == name:
            settings |= {key: lidar[key] for key in ("laser", "receiver") if key in lidar}
    receiver = settings.get("receiver")
    return receiver if "laser" in settings and isinstance(receiver, dict) else {}


def _lidar(
    name: str, number: int, frames: tuple[Frame, ...], calibration: _Map, scene: str
) -> Lidar:
    receiver = _receiver(name, calibration, scene)
    return Lidar(
        name=name,
        number=number,
        model=calibration.text("model", ""),
        frames=frames,
        X_BS=_read_mount(calibration, "X_BS"),
        is_deskewed=calibration.text("points", "as_fired") == "at_stamp",
        intensity_scale=str(receiver.get("intensity", "power")) if receiver else "cosine",
        returns=str(receiver.get("returns", "strongest")),
    )
