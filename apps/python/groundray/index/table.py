"""The index as a Parquet file: its columns, its writer and its reader."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

from groundray.dataset import Error
from groundray.index.rows import NOTHING, Row
from groundray.index.splits import Shares

VERSION = 1
"""Version of the columns, which the file states."""
DRAWN = "drawn."
"""Beginning of the names of columns of drawn values."""

_KEY = b"groundray_index"
_ROWS_OF_A_GROUP = 1000


@dataclass(frozen=True)
class Facts:
    """Facts that the file states beside its rows.

    `classes` are the names of all classes; the number of one is its place, and 0 is `nothing`.
    `splits` are empty if the frames are not split.
    """

    classes: tuple[str, ...]
    splits: tuple[str, ...]


def drawn_types(drawn: Sequence[Mapping[str, str]]) -> dict[str, Any]:
    """Returns the type of each drawn value in any of the datasets, by path, sorted by path.

    Whole numbers, numbers, `true` and `false` have types of these if all values of a path are such;
    other values are texts.
    """
    import pyarrow as pa

    values: dict[str, set[str]] = {}
    for each in drawn:
        for path, text in each.items():
            values.setdefault(path, set()).add(text)
    types: dict[str, Any] = {}
    for path, texts in sorted(values.items()):
        if texts <= {"true", "false"}:
            types[path] = pa.bool_()
        elif all(_is(int, text) and -(2**63) <= int(text) < 2**63 for text in texts):
            types[path] = pa.int64()
        elif all(_is(float, text) for text in texts):
            types[path] = pa.float64()
        else:
            types[path] = pa.string()
    return types


def _is(number: type[int] | type[float], text: str) -> bool:
    try:
        number(text)
    except ValueError:
        return False
    return "_" not in text  # 1_000 is a text outside Python


def schema_of(types: Mapping[str, Any]) -> Any:
    """Returns the columns of an index with these types of drawn values."""
    import pyarrow as pa

    def whole(bits: int) -> Any:
        return getattr(pa, f"uint{bits}")()

    instance = pa.struct([("instance", whole(32)), ("label", whole(32)), ("count", pa.int64())])
    return pa.schema(
        [
            ("dataset", pa.string()),
            ("scene", pa.string()),
            ("world", pa.int64()),
            ("seed", whole(64)),
            *((f"{DRAWN}{path}", kind) for path, kind in types.items()),
            ("split", pa.string()),
            ("sensor", pa.string()),
            ("kind", pa.string()),
            ("model", pa.string()),
            ("frame", pa.int64()),
            ("stamp_ns", pa.int64()),
            ("time_origin_ns", pa.int64()),
            ("pose_ns", pa.int64()),
            *((name, pa.float64()) for name in ("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")),
            ("origin_w_m", pa.list_(pa.float64(), 3)),
            ("is_deskewed", pa.bool_()),
            ("width_px", pa.int64()),
            ("height_px", pa.int64()),
            ("files", pa.map_(pa.string(), pa.string())),
            ("points", pa.int64()),
            ("pixels", pa.int64()),
            ("classes", pa.map_(pa.string(), pa.int64())),
            ("instances", pa.list_(instance)),
            ("labels", pa.map_(whole(32), pa.string())),
        ]
    )


class Writer:
    """Writer of an index, which holds a limited number of rows in memory."""

    def __init__(self, file: Path, types: Mapping[str, Any], shares: Shares | None) -> None:
        """Begins a file."""
        from pyarrow import parquet

        self._schema = schema_of(types)
        self._file = parquet.ParquetWriter(file, self._schema, compression="zstd")
        self._shares = shares
        self._classes: set[str] = set()
        self._rows: list[Row] = []

    def __enter__(self) -> Writer:
        """Returns itself."""
        return self

    def __exit__(
        self,
        _kind: type[BaseException] | None,
        fault: BaseException | None,
        _trace: TracebackType | None,
    ) -> None:
        """Ends the file; without an error, by what it states beside its rows."""
        if fault is None:
            self._flush()
            self._file.add_key_value_metadata({_KEY.decode(): self._facts()})
        self._file.close()

    def add(self, row: Row) -> None:
        """Adds a row."""
        self._classes.update(name for name, _ in row.get("classes", ()))
        self._classes.update(name for _, name in row["labels"])
        self._rows.append(row)
        if len(self._rows) == _ROWS_OF_A_GROUP:
            self._flush()

    def _flush(self) -> None:
        import pyarrow as pa

        self._file.write_table(pa.Table.from_pylist(self._rows, schema=self._schema))
        self._rows = []

    def _facts(self) -> str:
        facts: dict[str, Any] = {
            "version": VERSION,
            "classes": [NOTHING, *sorted(self._classes - {NOTHING})],
        }
        if self._shares is not None:
            shares = {name: float(share) for name, share in self._shares.of}
            facts |= {"splits": shares, "seed": self._shares.seed}
        return json.dumps(facts)


def drawn_values(drawn: Mapping[str, str], types: Mapping[str, Any]) -> Row:
    """Returns the columns of drawn values, given as texts by path."""
    return {f"{DRAWN}{path}": _value(text, types[path]) for path, text in drawn.items()}


def _value(text: str, kind: Any) -> Any:
    import pyarrow as pa

    if pa.types.is_boolean(kind):
        return text == "true"
    if pa.types.is_integer(kind):
        return int(text)
    return float(text) if pa.types.is_floating(kind) else text


def is_index(file: Path) -> bool:
    """Returns whether the file is an index, of any version."""
    from pyarrow import ArrowException, parquet

    try:
        return _KEY in (parquet.read_metadata(file).metadata or {})
    except (ArrowException, OSError):
        return False


def read_facts(file: Path) -> Facts:
    """Returns what an index states beside its rows.

    Raises Error if the file is missing, damaged, no index, or one of another version.
    """
    from pyarrow import ArrowException, parquet

    if not file.is_file():
        raise Error(f"{file}: there is no such file; make it with groundray-index")
    try:
        stated = (parquet.read_metadata(file).metadata or {}).get(_KEY)
    except (ArrowException, OSError) as fault:
        raise _damaged(file, fault) from None
    if stated is None:
        raise Error(f"{file}: it is not an index of groundray-index; give the file of its -o")
    facts = json.loads(stated)
    if facts["version"] != VERSION:
        rule = f"it is an index of version {facts['version']}, but this groundray reads {VERSION}"
        raise Error(f"{file}: {rule}: make it again with groundray-index")
    return Facts(tuple(facts["classes"]), tuple(facts.get("splits", ())))


def read_columns(file: Path, without: Sequence[str]) -> Any:
    """Returns the rows of an index as an Arrow table, without some columns.

    Raises Error if the file is damaged.
    """
    from pyarrow import ArrowException, parquet

    try:
        opened = parquet.ParquetFile(file)
        names = [name for name in opened.schema_arrow.names if name not in without]
        return opened.read(names)
    except (ArrowException, OSError) as fault:
        raise _damaged(file, fault) from None


def _damaged(file: Path, fault: Exception) -> Error:
    text = " ".join(str(fault).split())[:200]
    return Error(f"{file}: cannot read it as Parquet: {text}; is it damaged? Make it again")
