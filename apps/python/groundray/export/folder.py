"""Folders that appear only when complete."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from groundray.dataset import Error


@contextmanager
def written_aside(out: Path, dataset: Path) -> Iterator[Path]:
    """Yields a temporary folder that becomes `out` at the end and is removed on any failure.

    Raises Error if `out` exists and is not an empty folder, or is inside the dataset.
    """
    out = out.resolve()
    if out.exists() and not out.is_dir():
        raise Error(f"{out}: a file of this name exists; choose a new folder with -o")
    if out.exists() and any(out.iterdir()):
        raise Error(f"{out}: the folder is not empty; choose a new one with -o or remove it")
    if out.is_relative_to(dataset.resolve()):
        raise Error(f"{out}: it is inside the dataset; choose another folder with -o")
    made = [each for each in out.parents if not each.exists()]
    out.parent.mkdir(parents=True, exist_ok=True)
    aside = out.parent / f".{out.name}.{os.getpid()}.part"
    shutil.rmtree(aside, ignore_errors=True)  # of a killed process with this number
    aside.mkdir()
    try:
        yield aside
        os.replace(aside, out)
    finally:
        shutil.rmtree(aside, ignore_errors=True)
        for each in made:  # the innermost first; those that are not empty stay
            with suppress(OSError):
                each.rmdir()
