"""Folders that appear only when whole."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from groundray.dataset import Error


@contextmanager
def written_aside(out: Path, dataset: Path) -> Iterator[Path]:
    """Gives a folder to write into, which becomes `out` at the end; on any failure nothing remains.

    Raises Error if `out` is there and not an empty folder, or lies within the dataset.
    """
    out = out.resolve()
    if out.exists() and not out.is_dir():
        raise Error(f"{out}: there is a file of this name; choose a new folder with -o")
    if out.exists() and any(out.iterdir()):
        raise Error(f"{out}: the folder is not empty; choose a new one with -o or remove it")
    if out.is_relative_to(dataset.resolve()):
        raise Error(f"{out}: it lies within the dataset; choose a folder elsewhere with -o")
    made = [each for each in out.parents if not each.exists()]
    out.parent.mkdir(parents=True, exist_ok=True)
    aside = out.parent / f".{out.name}.{os.getpid()}.part"
    shutil.rmtree(aside, ignore_errors=True)  # of a process of this number that was killed
    aside.mkdir()
    try:
        yield aside
        os.replace(aside, out)
    finally:
        shutil.rmtree(aside, ignore_errors=True)
        for each in made:  # the innermost first; those that hold something stay
            with suppress(OSError):
                each.rmdir()
