"""Contents of files, read with clear errors: texts, YAML, bytes."""

from __future__ import annotations

import errno
import math
import os
import re
import stat
from pathlib import Path
from typing import Any, BinaryIO

import yaml

from groundray._core import Error

_LOADER: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)  # all scalars stay text


def _place(mark: Any) -> str:
    return f":{mark.line + 1}:{mark.column + 1}" if mark is not None else ""


def _refuse_aliases(text: str, path: Path) -> None:
    """Rejects aliases, by which a few lines can stand for more values than memory holds."""
    if "&" not in text or "*" not in text:
        return
    for event in yaml.parse(text, Loader=_LOADER):
        if isinstance(event, yaml.AliasEvent):
            place = _place(event.start_mark)
            raise Error(f"{path}{place}: aliases (*name) are not allowed: write the value out")


def load_yaml(text: str, path: Path, loader: Any = _LOADER) -> Any:
    """Returns the content of a file's text; numbers are texts. Raises Error with the place."""
    try:
        _refuse_aliases(text, path)
        return yaml.load(text, Loader=loader)
    except yaml.YAMLError as fault:
        place = _place(getattr(fault, "problem_mark", None))
        problem = getattr(fault, "problem", None) or "it is not YAML"
        raise Error(f"{path}{place}: {problem}; was the file cut short or edited?") from None


def open_regular(path: Path) -> BinaryIO:
    """Opens a regular file to read; a pipe may never begin, a device never end. Raises OSError."""
    opener = lambda name, flags: os.open(name, flags | os.O_NONBLOCK)  # noqa: E731
    file = open(path, "rb", opener=opener)  # noqa: SIM115
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise OSError(errno.ESPIPE, "it is a pipe or device, not a file")
    return file


def read_bytes(path: Path) -> bytes:
    """Returns the bytes of a regular file. Raises OSError, too if memory does not suffice."""
    with open_regular(path) as file:
        size = os.fstat(file.fileno()).st_size
        if size > available_bytes():
            raise OSError(errno.ENOMEM, f"its {size} bytes exceed the available memory")
        return file.read()


def available_bytes() -> float:
    """Returns what the machine can still give, as the programs do; infinity if unknown."""
    with open("/proc/meminfo", encoding="ascii") as lines:
        found = re.search(r"MemAvailable: *(\d+) kB", lines.read())
    return 1024 * float(found[1]) if found else math.inf


def read_text(path: Path, hint: str = "is the dataset complete?") -> str:
    """Returns a file's text. Raises Error, with the hint, if it cannot be read."""
    try:
        return read_bytes(path).decode("utf-8").replace("\r\n", "\n")
    except OSError as fault:
        raise Error(f"{path}: cannot read it: {fault.strerror}; {hint}") from None
    except UnicodeDecodeError:
        raise Error(f"{path}: it is not UTF-8 text; is it damaged?") from None


def read_yaml(path: Path, hint: str = "is the dataset complete?") -> Any:
    """Returns a YAML file's content, with numbers as such. Raises Error, with the hint, if it
    cannot be read.
    """
    return load_yaml(read_text(path, hint), path, yaml.SafeLoader)


def read_listed(file: Path, what: str) -> bytes:
    """Returns the bytes of a finished frame's file. Raises Error if it cannot be read."""
    try:
        return read_bytes(file)
    except OSError as fault:
        rule = f"cannot read it: {fault.strerror}, although dataset.yaml lists {what} as done"
        raise Error(f"{file}: {rule}; was it removed?") from None
