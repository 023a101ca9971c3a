"""The command groundray-index."""

from __future__ import annotations

import argparse
import os
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from groundray.dataset import Dataset, Error
from groundray.export.notes import Notes
from groundray.guarded_work import DONE, run_guarded
from groundray.index.report import report_of
from groundray.index.rows import Row, rows_of
from groundray.index.sources import Source, find_datasets, source_of
from groundray.index.splits import Shares, World, parse_shares, split_worlds
from groundray.index.statistics import ALL, Statistics
from groundray.index.table import Writer, drawn_types, drawn_values, is_index
from groundray.packages import check_packages
from groundray.shell_text import add_text_options

_PACKAGES = {"pyarrow": "pyarrow", "OpenEXR": "openexr"}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="groundray-index",
        description="List the frames of datasets in one table, with counts of classes and splits.",
        epilog="Columns, splits and the loader: docs/reference/dataset_index.md. Exit codes: "
        "0 done, 1 failed, 2 wrong usage, 130 interrupted. INDEX appears only when complete.",
        allow_abbrev=False,
    )
    add = parser.add_argument
    text = "folders of datasets, or folders that contain such"
    add("datasets", metavar="DATASET", nargs="+", type=Path, help=text)
    text = "table of the frames, a .parquet file; an older index is replaced"
    add("-o", "--output", required=True, type=_parquet, metavar="INDEX", help=text)
    text = "shares of the worlds, such as train=0.8,validation=0.1,test=0.1"
    add("--split", type=_shares, metavar="NAME=SHARE,...", help=text)
    add("--seed", type=_whole, metavar="N", help="another choice of the worlds (default: 0)")
    text = "statistics of classes and splits with plots, an .html file"
    add("--report", type=_html, metavar="FILE", help=text)
    text = "list finished frames if some are pending"
    add("--skip-pending", action="store_true", help=text)
    add_text_options(parser)
    return parser


def _ending(text: str, ending: str) -> Path:
    if not text.endswith(ending):
        raise argparse.ArgumentTypeError(f"{text} must end in {ending}")
    return Path(text)


def _parquet(text: str) -> Path:
    return _ending(text, ".parquet")


def _html(text: str) -> Path:
    return _ending(text, ".html")


def _whole(text: str) -> int:
    if not text.isdecimal() or int(text) >= 2**64:
        raise argparse.ArgumentTypeError(f"{text} must be a whole number below 2^64")
    return int(text)


def _shares(text: str) -> Shares:
    try:
        return Shares(parse_shares(text), 0)
    except ValueError as fault:
        raise argparse.ArgumentTypeError(str(fault)) from None


def _sources(options: argparse.Namespace) -> list[Source]:
    """Returns the datasets. Raises Error if two of them have the same frames, or one is invalid."""
    sources = [source_of(Dataset(folder)) for folder in find_datasets(options.datasets)]
    for source in sources:
        if source.pending and not options.skip_pending:
            rule = f"{source.pending} of its frames are pending"
            fix = "finish it with groundray generate, or list the others with --skip-pending"
            raise Error(f"{source.folder}: {rule}; {fix}")
    return sources


def _check_outputs(options: argparse.Namespace, sources: Sequence[Source]) -> None:
    output: Path = options.output
    for file in filter(None, (output, options.report)):
        if file.is_dir():
            raise Error(f"{file}: it is a folder; choose another name")
        for source in sources:
            if file.resolve().is_relative_to(source.folder):
                fix = "choose another folder"
                raise Error(f"{file}: it is inside the dataset {source.folder}; {fix}")
    if output.exists() and not is_index(output):
        raise Error(f"{output}: a file of this name exists that is no index; choose another name")


@contextmanager
def _written_aside(*outputs: Path | None) -> Iterator[list[Path]]:
    """Yields temporary files that replace the outputs at the end; any failure removes them."""
    wanted = [each.resolve() for each in outputs if each is not None]
    parts = [each.parent / f".{each.name}.{os.getpid()}.part" for each in wanted]
    made = {parent for each in wanted for parent in each.parents if not parent.exists()}
    try:
        for each in wanted:
            each.parent.mkdir(parents=True, exist_ok=True)
        yield parts
        for part, each in zip(parts, wanted, strict=True):
            os.replace(part, each)
    finally:
        for part in parts:
            part.unlink(missing_ok=True)
        for parent in sorted(made, key=lambda each: -len(each.parts)):
            with suppress(OSError):  # those that are not empty stay
                parent.rmdir()


class _Seen:
    """Frames of worlds that several datasets show, such as shards."""

    def __init__(self, sources: Sequence[Source]) -> None:
        self._datasets = Counter((source.key, source.seed) for source in sources)
        self._folders: dict[tuple[World, int, str, int], Path] = {}

    def add(self, source: Source, row: Row) -> None:
        """Raises Error if another dataset of the world has the frame."""
        if self._datasets[source.key, source.seed] == 1:
            return
        key = (source.key, source.seed, row["sensor"], row["frame"])
        other = self._folders.setdefault(key, source.folder)
        if other != source.folder:
            what = f"frame {row['frame']} of {row['sensor']}"
            rule = f"{what} is also in {other}, a dataset of the same world and seed"
            raise Error(f"{source.folder}: {rule}; leave out one of them")


def _index(options: argparse.Namespace, sources: Sequence[Source]) -> str:
    shares: Shares | None = options.split and Shares(options.split.of, options.seed or 0)
    split = split_worlds({source.key for source in sources}, shares) if shares else {}
    types = drawn_types([source.drawn for source in sources])
    statistics = Statistics(shares.names if shares else (ALL,))
    home, seen, count = options.output.resolve().parent, _Seen(sources), 0
    with _written_aside(options.output, options.report) as parts:
        with Writer(parts[0], types, shares) as writer:
            for source in sources:
                common: Row = {
                    "dataset": Path(os.path.relpath(source.folder, home)).as_posix(),
                    "scene": source.scene,
                    "world": source.world,
                    "seed": source.seed,
                    "split": split.get(source.key),
                    **drawn_values(source.drawn, types),
                }
                for row in rows_of(Dataset(source.folder)):
                    seen.add(source, row)
                    writer.add(common | row)
                    statistics.add(common | row)
                    count += 1
            if count == 0:
                raise Error(f"{options.datasets[0]}: the datasets have no finished frame to list")
        if options.report:
            page = report_of(statistics, options.output.name)
            parts[1].write_text(page, encoding="utf-8")
    worlds = len({source.key for source in sources})
    told = f"{count} frames of {len(sources)} datasets, {worlds} worlds"
    if shares:
        worlds_of = Counter(split.values())
        each = [f"{name} {worlds_of[name]}" for name in shares.names]
        told += f": {', '.join(each)}"
    return told


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command; returns its exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.seed is not None and options.split is None:
        parser.error("--seed applies to --split")

    notes = Notes()

    def work() -> str:
        check_packages(_PACKAGES, "an index")
        sources = _sources(options)
        _check_outputs(options, sources)
        notes.count("{} frames are pending and skipped", sum(each.pending for each in sources))
        return _index(options, sources)

    code, told = run_guarded(work)
    if code != DONE:
        print(f"groundray-index: {told}", file=sys.stderr)
        return code
    for line in notes.lines():
        print(f"note: {line}")
    print(f"{options.output}: {told}")
    return DONE
