"""Categories of instances: the classes of a label set, or the dataset's own labels."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from groundray.dataset import Dataset
from groundray.export.label_sets import LabelSet
from groundray.export.labels import LabelMap


@dataclass(frozen=True)
class Category:
    """Number and name of a category."""

    number: int
    name: str


class Categories:
    """Categories in the order of their numbers, and the one of each label."""

    def __init__(self, dataset: Dataset, of: LabelSet | None, map_: LabelMap) -> None:
        """Takes the categories of a set with its map of labels; without one, a category a label.

        The latter has the number of the label, and the name of its class, else `label_` and the
        number; labels of one class get names that differ.
        """
        self._map = map_
        if of is not None:
            self.listed = [Category(number, name) for number, name in sorted(of.names.items())]
        else:
            self.listed = _own(dataset)
        self._names = {each.number: each for each in self.listed}

    def of(self, label: int) -> Category:
        """Returns the category of a label. Raises Error if the set has none."""
        number = int(self._map.of(np.array([label]))[0])
        return self._names.get(number, Category(number, f"label_{number}"))


def _own(dataset: Dataset) -> list[Category]:
    labels = sorted({group.label for group in dataset.object_groups} | set(dataset.classes))
    uses = Counter(dataset.classes.values())
    names = {label: dataset.classes.get(label, f"label_{label}") for label in labels}
    return [
        Category(label, f"{name}_{label}" if uses[name] > 1 else name)
        for label, name in names.items()
    ]
