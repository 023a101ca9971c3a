"""Datasets to index, and the world that each of them shows."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from groundray.dataset import Dataset, Error
from groundray.file_content import load_yaml
from groundray.index.splits import World


@dataclass(frozen=True)
class Source:
    """A dataset's folder, and its world.

    `scene` identifies the scene file: a hash of its content without seed and drawn values. `drawn`
    holds the texts of these values by their paths. `pending` is the number of missing frames.
    """

    folder: Path
    scene: str
    world: int | None
    seed: int
    drawn: Mapping[str, str]
    pending: int

    @property
    def key(self) -> World:
        """The world by which datasets are split."""
        return self.scene, self.world


def find_datasets(paths: Iterable[Path]) -> list[Path]:
    """Returns the datasets at and below the paths, each once, sorted.

    Raises Error if a path has none.
    """
    found: set[Path] = set()
    for path in paths:
        folders = list(_datasets_below(path.resolve()))
        if not folders and path.is_dir():
            fix = "give an output of groundray generate, or a folder with such outputs"
            raise Error(f"{path}: there is no dataset.yaml in it or below; {fix}")
        found.update(folders or [path])
    return sorted(found)


def _datasets_below(path: Path) -> Iterator[Path]:
    for folder, below, files in os.walk(path):
        if "dataset.yaml" in files:
            below.clear()
            yield Path(folder)


def source_of(dataset: Dataset) -> Source:
    """Returns what the index states of a dataset. Raises Error if its scene is invalid."""
    if not dataset.seed.isdecimal():
        rule = f"seed = {dataset.seed!r} must be a whole number"
        raise Error(f"{dataset.folder / 'dataset.yaml'}: {rule}; was it edited?")
    return Source(
        dataset.folder,
        _scene_hash(dataset),
        dataset.world,
        int(dataset.seed),
        dataset.drawn,
        dataset.pending,
    )


def _scene_hash(dataset: Dataset) -> str:
    record = dataset.folder / "dataset.yaml"
    scene = load_yaml(dataset.scene, record)
    if isinstance(scene, dict):
        drawn: dict[str, str] = dict(dataset.drawn)
        drawn |= dict.fromkeys(_varied(scene.pop("worlds", None)), "")
        for key in ("world", "seed"):
            scene.pop(key, None)
        for path, value in drawn.items():
            _remove(scene, path.split("."), value)
    text = json.dumps(scene, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _varied(worlds: Any) -> Iterator[str]:
    """Yields the paths that a block `worlds` varies."""
    vary = worlds.get("vary") if isinstance(worlds, dict) else None
    for path, distribution in vary.items() if isinstance(vary, dict) else ():
        table = distribution.get("table") if isinstance(distribution, dict) else None
        columns = table.get("columns") if isinstance(table, dict) else None
        yield from map(str, columns) if isinstance(columns, list) else (str(path),)


def _remove(within: Any, path: Sequence[str], value: str) -> None:
    """Removes the part of a scene at the path, if it is there.

    value: that which was drawn. A `false` may mean that the part is not there: then the number of
    an item is that of another one.
    """
    first, *rest = path
    key: Any = first
    if isinstance(within, list):
        names = [each.get("name") if isinstance(each, dict) else None for each in within]
        if first in names:
            key = names.index(first)
        elif first.isdecimal() and int(first) < len(within) and (rest or value != "false"):
            key = int(first)
        else:
            return
    elif not isinstance(within, dict) or first not in within:
        return
    if rest:
        _remove(within[key], rest, value)
    else:
        del within[key]
