"""Datasets of the scenes of data/, with all rays traced exactly.

exact_scenes.py make FOLDER PROGRAM        writes one of each scene to FOLDER
exact_scenes.py compare FOLDER FOLDER      compares them byte by byte

Run with the Python of the system: it needs no packages.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

DATA = Path(__file__).resolve().parents[2] / "data"
BEGIN = re.compile(r"^groundray: 1\b.*\n", re.MULTILINE)  # of a scene, not of a sensor's file


def scenes() -> list[Path]:
    files = sorted((DATA / "scenes").glob("*.yaml"))
    return [file for file in files if BEGIN.search(file.read_text())]


def make(
    folder: Path, program: Path, files: list[Path], *options: str, **variables: str
) -> list[str]:
    """Writes a dataset of each scene of `files`; returns the standard error of each run."""
    reports = []
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "scenes").mkdir(parents=True)
    for part in DATA.iterdir():
        if part.name != "scenes":
            (folder / part.name).symlink_to(part)
    for file in files:
        for other in file.parent.glob("*.yaml"):
            shutil.copy(other, folder / "scenes")
        scene = folder / "scenes" / file.name
        text = file.read_text()
        assert "\ntracing:" not in text, f"{file} chooses its tracing"
        scene.write_text(BEGIN.sub(r"\g<0>tracing: exact\n", text, count=1))
        print(f"exact_scenes: {file.name}", file=sys.stderr, flush=True)
        done = subprocess.run(
            [program, "generate", scene, "-o", folder / "datasets" / file.stem, *options],
            env={**os.environ, **variables},
            capture_output=True,
            text=True,
        )
        if done.returncode != 0:
            raise SystemExit(f"{file}: {done.stderr}")
        reports.append(done.stderr)
    return reports


def differences(one: Path, other: Path) -> list[str]:
    """Returns a line for each file that the datasets of two folders do not share byte by byte."""
    listed = [
        {p.relative_to(f): p for p in sorted((f / "datasets").rglob("*")) if p.is_file()}
        for f in (one, other)
    ]
    assert listed[0], f"{one} contains no dataset"
    found = [f"{name}: only in one of them" for name in listed[0].keys() ^ listed[1].keys()]
    for name in listed[0].keys() & listed[1].keys():
        first, second = (files[name].read_bytes() for files in listed)
        if first != second:
            unequal = sum(a != b for a, b in zip(first, second, strict=False))
            found.append(
                f"{name}: {unequal} of {len(first)} bytes differ; the other has {len(second)}"
            )
    return sorted(found)


def main() -> None:
    match sys.argv[1:]:
        case ["make", folder, program]:
            make(Path(folder), Path(program), scenes())
        case ["compare", one, other]:
            found = differences(Path(one), Path(other))
            print("\n".join(found) or f"all files of {one} and {other} are equal")
            sys.exit(bool(found))
        case _:
            sys.exit(__doc__)


if __name__ == "__main__":
    main()
