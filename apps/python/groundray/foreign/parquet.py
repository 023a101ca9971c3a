"""Tables of groundray's programs as Parquet: python -m groundray.foreign.parquet CSV OUT."""

from __future__ import annotations

import sys
from pathlib import Path

from groundray.dataset import Error
from groundray.foreign.module import need, run


def write(table: Path, out: Path) -> None:
    """Writes a CSV file of UTF-8 with one line of names as Parquet.

    Columns of whole numbers, numbers, and `true` and `false` get types of these; others are texts.
    """
    from pyarrow import csv, parquet, uint64

    options = csv.ConvertOptions(column_types={"seed": uint64()}, strings_can_be_null=False)
    parquet.write_table(csv.read_csv(table, convert_options=options), out)


def _work(arguments: list[str]) -> str:
    if len(arguments) != 2:
        raise Error("usage: python -m groundray.foreign.parquet TABLE.csv OUT.parquet")
    need({"pyarrow": "pyarrow"}, "Parquet")
    write(Path(arguments[0]), Path(arguments[1]))
    return ""


if __name__ == "__main__":
    sys.exit(run(_work))
