"""Semantic classes and instances in the numbers of other datasets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundray.dataset import Dataset, Error
from groundray.export.label_sets import LabelSet
from groundray.file_content import read_yaml

Numbers = NDArray[np.uint32]


class LabelMap:
    """Map of the dataset's labels to others, from a file of `labels`, `others` and `instances`."""

    def __init__(self, file: Path | None, most: int, nothing: int = 0) -> None:
        """Keeps all labels if there is no file. Raises Error if the file is invalid.

        nothing: number of what has no label.
        """
        self.file = file
        self.most = most
        self.nothing = nothing
        self._places = "labels, or set others"
        self.labels: dict[int, int] = {}
        self.others: int | None = None
        self.with_instances: set[int] | None = None
        if file is not None:
            self._read(file)

    def _read(self, file: Path) -> None:
        values = read_yaml(file, "give the file of labels")
        known = {"labels", "others", "instances"}
        if not isinstance(values, dict) or "labels" not in values or set(values) - known:
            raise Error(f"{file}: it must be a map of labels and, optionally, others and instances")
        pairs = values["labels"]
        if not isinstance(pairs, dict):
            raise Error(f"{file}: labels must map the dataset's labels to other numbers")
        self.labels = {
            self._checked(ours, 65535): self._checked(theirs, self.most)
            for ours, theirs in pairs.items()
        }
        if "others" in values:
            self.others = self._checked(values["others"], self.most)
        if "instances" in values:
            if not isinstance(values["instances"], list):
                raise Error(f"{file}: instances must be a list of the dataset's labels")
            self.with_instances = {self._checked(each, 65535) for each in values["instances"]}

    def _checked(self, number: Any, most: int) -> int:
        if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number <= most:
            raise Error(f"{self.file}: {number!r} must be a whole number from 0 to {most}")
        return number

    @classmethod
    def of_set(cls, of: LabelSet, dataset: Dataset, most: int) -> LabelMap:
        """Maps the dataset's labels by their classes.

        Raises Error if it states no classes, or the set lacks one of them.
        """
        record = dataset.folder / "dataset.yaml"
        if not dataset.classes:
            fix = "add `classes: {1: ground, ...}` to the scene, or map labels by a file"
            raise Error(f"{record}: it states no classes, which the set {of.name} needs; {fix}")
        map_ = cls(None, most, of.nothing)
        map_.file = record
        map_._places = "the scene's classes"
        for label, name in dataset.classes.items():
            if name not in of.of:
                has = ", ".join(of.of)
                rule = f"the set {of.name} has no number for the class {name} of label {label}"
                raise Error(f"{of.file}: {rule}; it has {has}; map labels by a file instead")
            map_.labels[label] = map_._checked(of.of[name], most)
        return map_

    def of(self, labels: NDArray[Any]) -> Numbers:
        """Returns the mapped labels. Raises Error for a label without a number."""
        ours, which = np.unique(labels, return_inverse=True)
        theirs = np.array([self._one(int(label)) for label in ours], dtype=np.uint32)
        return theirs[which] if theirs.size else np.zeros(0, np.uint32)

    def _one(self, label: int) -> int:
        if self.file is not None:
            if label in self.labels:
                return self.labels[label]
            if self.others is not None:
                return self.others
            if label == 0:
                return self.nothing
            rule = f"it has no number for the label {label}"
            raise Error(f"{self.file}: {rule}; add it to {self._places}")
        if label > self.most:
            rule = f"label {label} is above {self.most}, the limit of this format"
            raise Error(f"{rule}; map it to another number with --labels")
        return label


class Instances:
    """Numbers of objects in 16 bits: their own if all fit, else in the order of occurrence."""

    most = 65535

    def __init__(self, dataset: Dataset, labels: LabelMap) -> None:
        self._labels = labels
        kept = labels.with_instances
        groups = [each for each in dataset.object_groups if kept is None or each.label in kept]
        last = max((group.first_instance + group.count - 1 for group in groups), default=0)
        self.is_renumbered = last > self.most
        self.numbers: dict[tuple[int, int], int] = {}  # of (their label, our instance)
        self._used: dict[int, int] = {}

    def of(self, rows: NDArray[Any], theirs: Numbers) -> Numbers:
        """Returns the numbers of instances; 0 for points without one."""
        ours = rows["instance"].astype(np.uint32)
        if self._labels.with_instances is not None:
            kept = np.isin(rows["label"], sorted(self._labels.with_instances))
            ours = np.where(kept, ours, np.uint32(0))
        if not self.is_renumbered:
            if ours.size and ours.max() > self.most:
                rule = f"a scan has the instance {ours.max()}, which dataset.yaml does not list"
                raise Error(f"{rule}: is the scan from this dataset?")
            return ours
        keys, first, which = np.unique(
            theirs.astype(np.uint64) << np.uint64(32) | ours, return_index=True, return_inverse=True
        )
        numbers = np.zeros(len(keys), np.uint32)
        for i in np.argsort(first, kind="stable"):
            numbers[i] = self._number(int(keys[i]) >> 32, int(keys[i]) & 0xFFFFFFFF)
        return numbers[which]

    def _number(self, label: int, instance: int) -> int:
        if instance == 0:
            return 0
        if (label, instance) not in self.numbers:
            self._used[label] = self._used.get(label, 0) + 1
            if self._used[label] > self.most:
                rule = f"more than {self.most} objects of the label {label} occur"
                fix = "list the labels with relevant instances as instances in the file of --labels"
                raise Error(f"{rule}, more than this format can number; {fix}")
            self.numbers[label, instance] = self._used[label]
        return self.numbers[label, instance]
