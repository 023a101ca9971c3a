"""Categories of instances: the classes of a label set, or the dataset's own labels."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from groundray.dataset import Dataset, Error
from groundray.export.label_sets import LabelSet
from groundray.export.notes import Notes


@dataclass(frozen=True)
class Category:
    """Number and name of a category."""

    number: int
    name: str


class Categories:
    """Categories in the order of their numbers, and the one of each label."""

    def __init__(self, dataset: Dataset, of: LabelSet | None, notes: Notes) -> None:
        """Takes the categories of a set; without one, each label is a category.

        The latter has the number of the label, and the name of its class, else `label_` and the
        number; labels of one class get names that differ. Classes that a set lacks are added to it,
        with a note.

        Raises Error if there is a set, but the dataset states no classes.
        """
        self._of: dict[int, Category] = {}
        self.listed: list[Category] = []
        labels = {group.label for group in dataset.object_groups}
        if of is None:
            self._take_own(dataset, sorted(labels | set(dataset.classes)))
            return
        if not dataset.classes:
            rule = f"it states no classes, which the set {of.name} needs"
            fix = "add `classes: {1: ground, ...}` to the scene"
            raise Error(f"{dataset.folder / 'dataset.yaml'}: {rule}; {fix}")
        self._take_set(dataset, sorted(labels), of, notes)

    def of(self, label: int) -> Category:
        """Returns the category of a label. Raises Error if dataset.yaml lists no such object."""
        if label not in self._of:
            rule = f"a frame has a box of the label {label}, which dataset.yaml does not list"
            raise Error(f"{rule}: is the frame from this dataset?")
        return self._of[label]

    def _take_own(self, dataset: Dataset, labels: list[int]) -> None:
        uses = Counter(dataset.classes.values())
        for label in labels:
            name = dataset.classes.get(label, f"label_{label}")
            self._of[label] = Category(label, f"{name}_{label}" if uses[name] > 1 else name)
        self.listed = list(self._of.values())

    def _take_set(self, dataset: Dataset, labels: list[int], of: LabelSet, notes: Notes) -> None:
        listed = {name: Category(number, name) for number, name in sorted(of.names.items())}
        for label in labels:
            ours = dataset.classes.get(label, f"label_{label}")
            if ours in of.of:
                self._of[label] = listed[of.names[of.of[ours]]]
                if ours in of.nearest:
                    notes.tell(f"{of.name} has no class of its own for {ours}: see labels.md")
                continue
            if ours not in listed:
                number = max(each.number for each in listed.values()) + 1
                listed[ours] = Category(number, ours)
                notes.tell(f"{of.name} has no category for {ours}: it is added as number {number}")
            self._of[label] = listed[ours]
        self.listed = list(listed.values())
