"""Statistics of an index: what each split has of each class."""

from __future__ import annotations

from dataclasses import dataclass, field

from groundray.index.rows import Row, class_name
from groundray.index.splits import World
from groundray.index.table import DRAWN

ALL = "all"
"""Name of the only split if frames are not split."""


@dataclass
class OfClass:
    """Counts of a class in a split: its points or pixels, and its instances in each frame."""

    count: int = 0
    frames: int = 0
    instances: int = 0


@dataclass
class OfSplit:
    """Counts of the frames of one kind of sensor in a split.

    `counted` is the number of frames that have labels, and `total` that of their points or pixels.
    """

    frames: int = 0
    counted: int = 0
    total: int = 0
    classes: dict[str, OfClass] = field(default_factory=dict)


@dataclass
class Statistics:
    """Counts by split, by kind of sensor, and by class; and drawn numbers by world."""

    splits: tuple[str, ...]
    worlds: dict[str, set[World]] = field(default_factory=dict)
    of: dict[tuple[str, str], OfSplit] = field(default_factory=dict)
    drawn: dict[str, dict[str, list[float]]] = field(default_factory=dict)

    def add(self, row: Row) -> None:
        """Adds a frame."""
        split, world = row["split"] or ALL, (row["scene"], row["world"])
        worlds = self.worlds.setdefault(split, set())
        if world not in worlds:
            worlds.add(world)
            for name, value in row.items():
                is_number = isinstance(value, int | float) and not isinstance(value, bool)
                if name.startswith(DRAWN) and is_number:
                    values = self.drawn.setdefault(name.removeprefix(DRAWN), {})
                    values.setdefault(split, []).append(float(value))
        mine = self.of.setdefault((split, row["kind"]), OfSplit())
        mine.frames += 1
        if "classes" not in row:
            return
        mine.counted += 1
        mine.total += row["points" if row["kind"] == "lidar" else "pixels"]
        names = dict(row["labels"])
        for name, count in row["classes"]:
            each = mine.classes.setdefault(name, OfClass())
            each.count += count
            each.frames += 1
        for instance in row["instances"]:
            mine.classes[class_name(instance["label"], names)].instances += 1

    def kinds(self) -> list[str]:
        """Returns the kinds of sensors that have labels, lidars first."""
        kinds = {kind for (_, kind), each in self.of.items() if each.counted}
        return sorted(kinds, reverse=True)

    def classes(self, kind: str) -> list[str]:
        """Returns the classes of a kind of sensor, the most frequent first."""
        totals: dict[str, int] = {}
        for (_, each), split in self.of.items():
            for name, counts in split.classes.items() if each == kind else ():
                totals[name] = totals.get(name, 0) + counts.count
        return sorted(totals, key=lambda name: (-totals[name], name))

    def of_split(self, split: str, kind: str) -> OfSplit:
        """Returns the counts of a kind of sensor in a split; zeros if it has none."""
        return self.of.get((split, kind), OfSplit())
