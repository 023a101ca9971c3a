"""Sweeps: runs of one scene over a table of parameters."""

from __future__ import annotations

import copy
import itertools
import os
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import yaml

from groundray._core import Worlds
from groundray.dataset import Error
from groundray.file_content import read_bytes, read_text

_KEYS = ("scene", "shards", "vary", "runs", "worlds")


class Run(NamedTuple):
    """Run of a sweep: `name` is the end of its store, `scene` the text of its scene file."""

    name: str
    scene: bytes
    parameters: str  # as text: "seed=3 sky.sun.elevation_deg=40", or "world=17"


class Sweep(NamedTuple):
    """Table of runs. `scene` is the file that they vary."""

    scene: Path
    shards: int
    runs: list[Run]


def _load(path: Path) -> yaml.Node:
    try:
        node = yaml.compose(read_text(path, "name a YAML file"))
    except yaml.YAMLError as fault:
        raise Error(f"{path}: {' '.join(str(fault).split())}") from None
    if not isinstance(node, yaml.MappingNode):
        raise Error(f"{path}: it must be a map of keys and values")
    return node


def _entries(node: yaml.Node, path: Path, key: str) -> dict[str, yaml.Node]:
    if not isinstance(node, yaml.MappingNode):
        raise Error(f"{path}: {key} must be a map of keys and values")
    return {str(name.value): value for name, value in node.value}


def _items(node: yaml.Node, path: Path, key: str) -> list[yaml.Node]:
    if not isinstance(node, yaml.SequenceNode) or not node.value:
        raise Error(f"{path}: {key} must be a list with one item at least")
    return list(node.value)


def _text(node: yaml.Node) -> str:
    if isinstance(node, yaml.ScalarNode):
        return str(node.value)
    return " ".join(yaml.serialize(node, width=1 << 30).split())


def _changed(node: yaml.Node, names: list[str], value: yaml.Node) -> yaml.Node:
    """Returns a copy with a value at a path; raises KeyError with the name that is not there.

    What the path does not pass is shared with the original, so nothing else changes.
    """
    name, *rest = names
    changed = copy.copy(node)
    if isinstance(node, yaml.MappingNode):
        keys = [str(key.value) for key, _ in node.value]
        changed.value = list(node.value)
        if name in keys:
            at = keys.index(name)
            key, old = node.value[at]
            changed.value[at] = key, _changed(old, rest, value) if rest else value
        elif not rest:
            changed.value.append((yaml.ScalarNode("tag:yaml.org,2002:str", name), value))
        else:
            raise KeyError(name)
    elif isinstance(node, yaml.SequenceNode):
        items = node.value
        found = [i for i, each in enumerate(items) if name in (str(i), _name_of(each))]
        if not found:
            raise KeyError(name)
        changed.value = list(items)
        changed.value[found[0]] = _changed(items[found[0]], rest, value) if rest else value
    else:
        raise KeyError(name)
    return changed


def _name_of(item: yaml.Node) -> str | None:
    if not isinstance(item, yaml.MappingNode):
        return None
    return next((str(value.value) for key, value in item.value if key.value == "name"), None)


def _tables(table: dict[str, yaml.Node], path: Path) -> Iterator[tuple[str, dict[str, yaml.Node]]]:
    """Yields the parameters of each run, with the place of the table that they are from."""
    if "vary" in table:
        varied = _entries(table["vary"], path, "vary")
        values = [_items(node, path, f"vary.{key}") for key, node in varied.items()]
        for chosen in itertools.product(*values):
            yield "vary", dict(zip(varied, chosen, strict=True))
        return
    for i, each in enumerate(_items(table["runs"], path, "runs")):
        yield f"runs[{i}]", _entries(each, path, f"runs[{i}]")


def _worlds(node: yaml.Node, scene: Path, path: Path) -> list[Run]:
    """Returns the runs of worlds whose values the scene's distributions give: N, or [from, to]."""
    texts = [_text(each) for each in node.value] if isinstance(node, yaml.SequenceNode) else ["0"]
    texts += [] if isinstance(node, yaml.SequenceNode) else [_text(node)]
    if len(texts) != 2 or not all(text.isdecimal() for text in texts):
        rule = "must be the number of worlds, or [from, to] of their numbers"
        raise Error(f"{path}: worlds = {_text(node)} {rule}")
    first, end = (int(text) for text in texts)
    worlds = Worlds(scene)
    if not first < end <= len(worlds):
        rule = f"must be worlds of {scene}, which has {len(worlds)}, from 0 on"
        raise Error(f"{path}: worlds = {_text(node)} {rule}")
    return [
        Run(f"{world:06}", worlds.scene_text(world).encode(), f"world={world}")
        for world in range(first, end)
    ]


def read_sweep(path: Path) -> Sweep:
    """Reads PARAMS.yaml and the scene that it names. Raises Error with file and key."""
    table = _entries(_load(path), path, "the file")
    for key in table:
        if key not in _KEYS:
            raise Error(f"{path}: unknown key {key}; it may have {', '.join(_KEYS)}")
    for key in ("scene", "shards"):
        if key not in table:
            raise Error(f"{path}: {key} is missing")
    if sum(key in table for key in ("vary", "runs", "worlds")) != 1:
        raise Error(f"{path}: it must have either vary, runs or worlds")
    shards = _text(table["shards"])
    if not shards.isdecimal() or not 1 <= int(shards) <= 1_000_000:
        raise Error(f"{path}: shards = {shards} must be a whole number from 1 to 1000000")
    scene = path.parent / _text(table["scene"])
    if "worlds" in table:
        return Sweep(scene, int(shards), _worlds(table["worlds"], scene, path))
    whole = _load(scene)
    runs: list[Run] = []
    for place, parameters in _tables(table, path):
        varied = whole
        for key, value in parameters.items():
            try:
                varied = _changed(varied, key.split("."), value)
            except KeyError as fault:
                raise Error(f"{path}: {place}.{key}: {scene} has no {fault.args[0]}") from None
        shown = " ".join(f"{key}={_text(value)}" for key, value in parameters.items())
        text = yaml.serialize(varied, allow_unicode=True, width=1 << 30).encode()
        runs.append(Run(f"{len(runs) + 1:04}", text, shown))
    return Sweep(scene, int(shards), runs)


def write_scene(sweep: Sweep, run: Run) -> Path:
    """Writes the scene of a run beside that which it varies, so that its paths hold."""
    file = sweep.scene.with_name(f"{sweep.scene.stem}.{run.name}{sweep.scene.suffix}")
    try:
        if not file.exists():
            part = file.with_name(f".{file.name}.{os.getpid()}.part")
            part.write_bytes(run.scene)
            part.replace(file)
        elif read_bytes(file) != run.scene:
            raise Error(f"{file}: another file of this name exists; remove it, or move the scene")
    except OSError as fault:
        raise Error(f"{file}: {fault.strerror}; a sweep writes its scenes here") from None
    return file
