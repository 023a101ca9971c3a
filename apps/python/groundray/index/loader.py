"""Loader of the frames of an index, for training with NumPy or PyTorch."""

from __future__ import annotations

import difflib
import operator
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, SupportsIndex

import numpy as np
from numpy.typing import NDArray

from groundray.dataset import Error, matrix_of
from groundray.index.frame_files import CHANNELS, PICTURE, Arrays, Place, read_image, read_points
from groundray.index.rows import NOTHING, class_name
from groundray.index.table import read_columns, read_facts
from groundray.packages import check_packages

_PACKAGES = {"pyarrow": "pyarrow"}
_PACKAGES_OF_IMAGES = {"OpenEXR": "openexr", "cv2": "opencv-python-headless"}
_LABELS = 2**16  # upper bound of labels
_COUNTS = ("classes", "instances")  # large, and for statistics only


class Frames:
    """Frames of an index: a sequence that reads one frame at a time from its dataset.

    A frame is a dict of NumPy arrays. That of a lidar has an array of n for each column, by its
    name in `groundray.Scan`, and `X_DS`, its pose at the stamp. That of a camera has arrays of
    height x width (x 3) by their names in `groundray.Image`, and `X_DC`, the pose at the middle of
    the exposure. Both have `class_id` if they have `label`: numbers of `classes`.

    Can be pickled, and read by several threads or processes at once.
    """

    def __init__(
        self,
        index: str | Path,
        split: str | None = None,
        *,
        kind: str | None = None,
        sensors: Sequence[str] | None = None,
        columns: Sequence[str] | None = None,
        channels: Sequence[str] | None = None,
        transform: Callable[[Arrays], Any] | None = None,
    ) -> None:
        """Reads the index, but no frame.

        split: frames of this split; all for None. kind: `lidar` or `camera`; both for None.
        sensors: names of sensors; all for None. columns: of scans; all for None. channels: of
        images, such as `depth_m`; for None `picture`, `label` and `instance`, as far as an image
        has them. transform: makes what is returned from a frame's arrays.

        Raises Error if the index is missing, damaged or of another version, or has no such split,
        sensor or channel.
        """
        check_packages(_PACKAGES, "an index")
        self.index = Path(index)
        facts = read_facts(self.index)
        self.classes = facts.classes
        """Names of the classes; the number of a class is its place, and 0 is `nothing`."""
        self._check(split, facts.splits, kind, channels)
        self._columns = None if columns is None else tuple(columns)
        self._channels = None if channels is None else tuple(channels)
        self._transform = transform
        self._home = self.index.resolve().parent
        self._numbers = {name: number for number, name in enumerate(self.classes)}
        table = read_columns(self.index, _COUNTS)
        kept = np.ones(table.num_rows, bool)
        for column, values in (
            ("split", None if split is None else [split]),
            ("kind", None if kind is None else [kind]),
            ("sensor", sensors),
        ):
            kept &= self._is_any(table, column, values)
        self._table = table.filter(kept)
        if not len(self):
            raise Error(f"{self.index}: it has no such frame: check split, kind and sensors")
        if "camera" in self._table.column("kind").unique().to_pylist():
            check_packages(_PACKAGES_OF_IMAGES, "reading images")

    def _check(
        self,
        split: str | None,
        splits: Sequence[str],
        kind: str | None,
        channels: Sequence[str] | None,
    ) -> None:
        if split is not None and not splits:
            fix = "make it again with groundray-index --split"
            raise Error(f"{self.index}: its frames are not split; {fix}")
        known = [
            ("split", [] if split is None else [split], splits),
            ("kind", [] if kind is None else [kind], ["lidar", "camera"]),
            ("channel", channels or [], [PICTURE, *CHANNELS]),
        ]
        for what, given, names in known:
            for name in given:
                if name not in names:
                    raise self._unknown(what, name, names)

    def _unknown(self, what: str, name: str, names: Sequence[str]) -> Error:
        near = difflib.get_close_matches(name, names, 1)
        listed = f"there are {', '.join(names)}"
        meant = f"did you mean {near[0]}? T{listed[1:]}" if near else listed
        return Error(f"{self.index}: there is no {what} {name}; {meant}")

    def _is_any(self, table: Any, column: str, values: Sequence[str] | None) -> NDArray[np.bool_]:
        """Returns a mask of rows whose column has one of the values; any row for None."""
        if values is None:
            return np.ones(table.num_rows, bool)
        names = np.array(table.column(column).to_pylist(), dtype=object)
        for value in values:
            if column == "sensor" and value not in names:
                raise self._unknown(column, value, sorted(set(names)))
        return np.isin(names.astype(str), list(values))

    def __len__(self) -> int:
        """Returns the number of frames."""
        return int(self._table.num_rows)

    def row(self, i: SupportsIndex) -> dict[str, Any]:
        """Returns what the index states of frame i, except for the counts of classes and instances.

        Raises IndexError if there is no such frame.
        """
        number = operator.index(i)
        if not -len(self) <= number < len(self):
            rule = f"there is no frame {number}: it has {len(self)} frames, numbered from 0"
            raise IndexError(f"{self.index}: {rule}")
        row: dict[str, Any] = self._table.slice(number % len(self), 1).to_pylist()[0]
        return row | {name: dict(row[name]) for name in ("files", "labels")}

    def __getitem__(self, i: SupportsIndex) -> Any:
        """Reads frame i; returns its arrays, or what `transform` makes of them.

        Raises IndexError if there is no such frame, and Error if a file of it is missing, damaged,
        or not the one that was indexed.
        """
        row = self.row(i)
        is_lidar = row["kind"] == "lidar"
        size_px = None if is_lidar else (row["width_px"], row["height_px"])
        folder = self._home / row["dataset"]
        if not folder.is_dir():
            fix = "was it moved without its index? Make the index again"
            raise Error(f"{folder}: there is no such dataset, but {self.index} lists it; {fix}")
        place = Place(folder, row["files"], row["points"], size_px)
        if is_lidar:
            arrays = read_points(place, self._columns)
        else:
            arrays = read_image(place, self._channels)
        if "label" in arrays:
            arrays["class_id"] = self._class_ids(arrays["label"], row["labels"], folder)
        rotation_xyzw = [row[f"q{axis}"] for axis in "xyzw"]
        pose = matrix_of(rotation_xyzw, [row[f"{axis}_m"] for axis in "xyz"])
        arrays["X_DS" if is_lidar else "X_DC"] = pose
        return arrays if self._transform is None else self._transform(arrays)

    def _class_ids(
        self, labels: NDArray[Any], classes: dict[int, str], folder: Path
    ) -> NDArray[np.int64]:
        numbers = np.full(_LABELS, -1, np.int64)
        for name, number in self._numbers.items():
            unnamed = re.fullmatch(r"label (\d+)", name)
            if unnamed:
                numbers[int(unnamed[1])] = number
        for label, name in (classes | {0: NOTHING}).items():
            numbers[label] = self._numbers[name]
        ids: NDArray[np.int64] = numbers[np.minimum(labels, _LABELS - 1)]
        if ids.size and ids.min() < 0:
            unknown = class_name(int(labels[ids < 0][0]), classes)
            rule = f"a frame has the class {unknown}, which {self.index} does not list"
            raise Error(f"{folder}: {rule}: it was generated again; make the index again")
        return ids

    def torch(self) -> Any:
        """Returns the frames as a `torch.utils.data.Dataset` of tensors.

        Raises Error if PyTorch is not installed.
        """
        check_packages({"torch": "torch"}, "a dataset of tensors")
        from groundray.index.torch_frames import TorchFrames

        return TorchFrames(self)
