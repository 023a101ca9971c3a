"""Reader of dataset.yaml, line by line (docs/reference/formats.md)."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Iterator
from itertools import zip_longest
from typing import NamedTuple

from groundray.cluster.store import Sum
from groundray.dataset import Error

_SUM = r'bytes: (\d+), sha256: "([0-9a-f]{64})"\}'
_SENSOR = re.compile(r'  - \{name: "([\w-]+)", kind: (lidar|camera), .*\bframes: (\d+)\}\n')
_FRAME = re.compile(r'  - \{sensor: "([\w-]+)", frame: (\d+), stamp_s: [^,]+, state: (\w+)')
_PRODUCT = re.compile(r'"([\w.-]+)": \{' + _SUM)
_FILE = re.compile(r'  - \{path: "([\w-]+/[\w.-]+)", ' + _SUM + r"\n")


class Listed(NamedTuple):
    """File of a dataset."""

    path: str
    sum: Sum


class _Sensor(NamedTuple):
    kind: str
    first: int  # place of its first frame among all frames
    frames: int


def closed(lines: Iterable[str]) -> Iterator[bytes]:
    """Yields the lines and the checksum that ends a dataset.yaml."""
    digest = hashlib.sha256()
    for line in lines:
        digest.update(line.encode())
        yield line.encode()
    yield f'sha256_above: "{digest.hexdigest()}"\n'.encode()


class Listing:
    """Contents of a dataset.yaml: iterate over `frames` once, then read `files`."""

    def __init__(self, name: str, lines: Iterable[bytes]) -> None:
        self.name = name
        self.header = ""
        """All lines before the frames, except that of the shard."""
        self.files: list[str] = []
        """Lines of the files that belong to no frame."""
        self.shard = ""
        """Line of the shard, or empty."""
        self.sensors: dict[str, _Sensor] = {}
        self.total = 0
        """Number of frames of the run."""
        self._lines = iter(lines)
        self._digest = hashlib.sha256()
        for line in self._until("frames:\n"):
            if line.startswith("shard: "):
                self.shard = line
                continue
            self.header += line
            if sensor := _SENSOR.fullmatch(line):
                self.sensors[sensor[1]] = _Sensor(sensor[2], self.total, int(sensor[3]))
                self.total += int(sensor[3])

    def _broken(self) -> Error:
        return Error(f"{self.name}: changed since it was written, or truncated")

    def _until(self, *ends: str) -> Iterator[str]:
        for each in self._lines:
            line = each.decode(errors="replace")
            if line.startswith("sha256_above: "):
                is_whole = line == f'sha256_above: "{self._digest.hexdigest()}"\n'
                if not is_whole or "frames:\n" in ends or next(self._lines, None) is not None:
                    raise self._broken()
                return
            self._digest.update(each)
            if line in ends:
                return
            yield line
        raise self._broken()

    def frames(self) -> Iterator[str]:
        """Yields the line of each frame that is done."""
        is_listed = False
        for line in self._until():
            is_listed = is_listed or line == "files:\n"
            if is_listed:
                self.files.append(line)
            elif ", state: pending" not in line:
                yield line

    def place(self, line: str) -> int:
        """Returns the place of a frame among all frames of the run."""
        frame = _FRAME.match(line)
        sensor = self.sensors.get(frame[1]) if frame else None
        if frame is None or sensor is None or int(frame[2]) >= sensor.frames:
            raise self._broken()
        return sensor.first + int(frame[2])

    def products(self, line: str) -> list[Listed]:
        """Returns the files of a frame."""
        self.place(line)
        name, number = _FRAME.match(line).group(1, 2)  # type: ignore[union-attr]
        stem = f"{self.sensors[name].kind}/{name}/{int(number):06}"
        return [Listed(stem + p[1], Sum(int(p[2]), p[3])) for p in _PRODUCT.finditer(line)]

    def others(self) -> list[Listed]:
        """Returns the files that belong to no frame, after all frames."""
        found = [_FILE.fullmatch(line) for line in self.files[1:]]
        if not all(found):
            raise self._broken()
        return [Listed(each[1], Sum(int(each[2]), each[3])) for each in found if each]

    def common(self) -> str:
        """Returns what all shards of a run have in common, after all frames."""
        return self.header + "".join(self.files)


def difference(text: str, other: str) -> str:
    """Returns the first line that differs between two texts, from shortly before the difference."""
    pairs = zip_longest(text.splitlines(), other.splitlines(), fillvalue="")
    lines = next((pair for pair in pairs if pair[0] != pair[1]), ("", ""))
    same = next((i for i, (a, b) in enumerate(zip(*lines, strict=False)) if a != b), 0)
    begin = max(0, same - 40)
    line, second = (each[begin : begin + 80] for each in lines)
    return f"'{line}' instead of '{second}'"
