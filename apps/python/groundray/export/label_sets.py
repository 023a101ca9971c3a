"""Label sets of public datasets: classes, colours, and how groundray's classes map to them."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from groundray._core import data_folder
from groundray.dataset import Error
from groundray.file_content import read_yaml


@dataclass(frozen=True)
class LabelSet:
    """Label set of a file in data/labels (docs/reference/labels.md).

    `names` and `colours` are by its own numbers, `of` maps classes of groundray to these numbers,
    `nothing` is the number of what nothing was hit, and `nearest` are the classes that it does not
    have, which are mapped to the nearest ones.
    """

    file: Path
    name: str
    names: Mapping[int, str]
    colours: Mapping[int, tuple[int, int, int]]
    of: Mapping[str, int]
    nothing: int
    nearest: frozenset[str]


def _folder() -> Path:
    return Path(data_folder()) / "labels"


def set_names() -> list[str]:
    """Returns the names of all sets, sorted."""
    return sorted(file.stem for file in _folder().glob("*.yaml"))


def find_set(name: str) -> LabelSet:
    """Reads a set by its name, or the beginning of one name. Raises Error with those that exist."""
    known = set_names()
    found = [each for each in known if each == name] or [k for k in known if k.startswith(name)]
    if len(found) == 1:
        return _read(_folder() / f"{found[0]}.yaml")
    near = difflib.get_close_matches(name, known, 1)
    meant = f"did you mean {near[0]}? " if near else ""
    rule = "begins several sets" if found else "is no set of labels, nor a file ending in .yaml"
    raise Error(f"--labels {name}: it {rule}; {meant}There are {', '.join(found or known)}")


def _read(file: Path) -> LabelSet:
    values: dict[str, Any] = read_yaml(file, "is the installation complete?")
    try:
        labels = values["labels"]
        return LabelSet(
            file,
            str(values["name"]),
            {int(each["id"]): str(each["name"]) for each in labels},
            {int(each["id"]): _colour(each["colour"]) for each in labels},
            {str(ours): int(theirs) for ours, theirs in values["of"].items()},
            int(values["nothing"]),
            frozenset(values["nearest"]),
        )
    except (KeyError, TypeError, ValueError) as fault:
        raise Error(f"{file}: it is not a file of labels: {fault}; was it changed?") from None


def _colour(values: Any) -> tuple[int, int, int]:
    red, green, blue = (int(value) for value in values)
    return red, green, blue
