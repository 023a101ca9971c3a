"""Runs clang-tidy on every group of sources whose current state has not passed before.

    clang_tidy.py BUILD CLANG_TIDY SOURCE...

BUILD holds compile_commands.json. Up to 8 sources of a folder with the same flags are a group: a
file that includes them is read as one, which parses common headers once and takes about a quarter
of the time. If a group has a finding or does not compile, its sources are read one by one, and
their findings count. Missing includes may stay hidden in a group; the preset dev compiles each
source by itself.

A group that passes leaves a stamp in $XDG_CACHE_HOME/groundray/clang-tidy
(~/.cache/groundray/clang-tidy). The name of a stamp is a hash of all inputs of the result: the
texts of the sources and of the headers of this tree that they include, directly or not; the
compile commands; clang-tidy's version and settings; the versions of installed headers. Paths are
relative to the root of the tree, so all clones share their stamps.

Neither PyPI nor Debian has a cache of clang-tidy's results, and ccache stores none.
Includes are parsed, not preprocessed: they are paths from the root. This takes half a second for
the complete tree; clang's preprocessor takes 90.
"""

import concurrent.futures
import contextlib
import functools
import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
import time
from pathlib import Path

INCLUDE = re.compile(r'^ *# *include *(["<])([^">]+)[">]', re.MULTILINE)
FOLDERS = ("", "data")  # search path of includes
MOST_IN_GROUP = 8
KEPT_DAYS = 90  # stamps unused for this long are deleted


def stamp_folder() -> Path:
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return cache / "groundray" / "clang-tidy"


class SourceTree:
    """The sources below a folder, and which of its headers each of them includes."""

    def __init__(self, root: Path):
        self.root = root
        self.text = functools.cache(lambda path: (root / path).read_bytes())
        self.included = functools.cache(self._included)

    def _included(self, path: str) -> tuple[str, ...]:
        found = []
        for mark, name in INCLUDE.findall(self.text(path).decode()):
            places = [os.path.join(folder, name) for folder in (*FOLDERS, os.path.dirname(path))]
            place = next((p for p in places if (self.root / p).is_file()), None)
            if place:
                found.append(os.path.normpath(place))
            elif mark == '"':
                sys.exit(f'{path}: #include "{name}" is not a file of this tree')
        return tuple(found)

    def dependencies(self, paths: list[str]) -> list[str]:
        """Returns sources and the headers of the tree that they include, directly or not."""
        known = set(paths)
        open_ends = [*paths]
        while open_ends:
            for name in self.included(open_ends.pop()):
                if name not in known:
                    known.add(name)
                    open_ends.append(name)
        return sorted(known)

    def stamp(self, paths: list[str], settings: str) -> str:
        """Returns the hash of sources with their headers and settings."""
        digest = hashlib.sha256("\0".join([settings, *paths]).encode())
        for name in self.dependencies(paths):
            digest.update(f"\0{name}\0{len(self.text(name))}\0".encode())
            digest.update(self.text(name))
        return digest.hexdigest()


def run(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def common_settings(root: Path, clang_tidy: str) -> str:
    known = run("dpkg-query", "-W", "-f=${db:Status-Status} ${Package} ${Version}\n", "*-dev")
    packages = "\n".join(line for line in known.splitlines() if line.startswith("installed "))
    python_headers = re.findall("^nanobind==.*", (root / "test/requirements.txt").read_text(), re.M)
    settings = (root / ".clang-tidy").read_text()
    return "\0".join([run(clang_tidy, "--version"), packages, *python_headers, settings])


def flags_by_source(build: Path, root: Path) -> dict[str, list[str]]:
    """Returns the flags of each source of the tree, with paths relative to its root."""
    flags = {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        command = entry["command"].replace(f"{root}/", "").replace(str(root), ".")
        words = shlex.split(command)[1:]
        path = os.path.relpath(entry["file"], root)
        without = {"-c", "-o", path}
        flags[path] = [
            word
            for before, word in zip(["", *words], words, strict=False)
            if word not in without and before != "-o"
        ]
    return flags


def groups_of(flags: dict[str, list[str]]) -> list[list[str]]:
    """Returns the sources in groups of one folder, with equal flags."""
    alike: dict[tuple[str, ...], list[str]] = {}
    for path, words in flags.items():
        alike.setdefault((os.path.dirname(path), *words), []).append(path)
    return [
        paths[i : i + MOST_IN_GROUP]
        for paths in alike.values()
        for i in range(0, len(paths), MOST_IN_GROUP)
    ]


def findings(*command: str) -> str | None:
    """Returns what clang-tidy finds, or None if it passes."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    noise = re.compile(r"^\d+ warnings?( and \d+ errors?)? generated")
    said = [line for line in done.stderr.splitlines() if not noise.match(line)]
    return "\n".join([done.stdout, *said]) if done.returncode != 0 else None


def passes(clang_tidy: str, group: list[str], flags: list[str], folder: Path) -> bool:
    """Prints the findings of a group of sources.

    :param folder: of files that include the sources of a group.
    """
    quietly = [clang_tidy, "--quiet"]
    if len(group) > 1:
        file = folder / group[0].replace("/", "_")
        file.write_text("".join(f'#include "{path}"\n' for path in group))
        options = ["--checks=-bugprone-suspicious-include", str(file), "--", *flags, "-I."]
        if findings(*quietly, *options) is None:
            return True
    found = [findings(*quietly, path, "--", *flags) for path in group]
    failed = [text for text in found if text is not None]
    print("\n".join(failed), end="", flush=True)
    return not failed


def delete_old(folder: Path) -> None:
    oldest = time.time() - KEPT_DAYS * 86400
    for stamp in folder.iterdir():
        with contextlib.suppress(FileNotFoundError):  # another clone may delete it too
            if stamp.stat().st_mtime < oldest:
                stamp.unlink()


def main() -> int:
    build, clang_tidy, *sources = sys.argv[1:]
    root = Path.cwd().resolve()
    tree = SourceTree(root)
    common = common_settings(root, clang_tidy)
    known = flags_by_source(Path(build), root)
    # A source of no target is given the flags of the target that uses most libraries.
    richest = max(known.values(), key=lambda flags: (len(flags), flags), default=[])
    flags = {path: known.get(path, richest) for path in map(os.path.normpath, sources)}
    groups = groups_of(flags)
    folder = stamp_folder()
    folder.mkdir(parents=True, exist_ok=True)
    files = Path(build) / "groups"
    files.mkdir(exist_ok=True)

    def stamp(tree: SourceTree, group: list[str]) -> Path:
        return folder / tree.stamp(group, "\0".join([common, *flags[group[0]]]))

    wanted = {}
    for group in groups:
        passed = stamp(tree, group)
        if passed.exists():
            passed.touch()
        else:
            wanted[tuple(group)] = passed

    def check(group: tuple[str, ...]) -> bool:
        good = passes(clang_tidy, [*group], flags[group[0]], files)
        if good and stamp(SourceTree(root), [*group]) == wanted[group]:  # unchanged during the run
            wanted[group].touch()
        return good

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        failed = list(pool.map(check, wanted)).count(False)
    delete_old(folder)
    before = len(groups) - len(wanted)
    print(
        f"clang-tidy: {len(sources)} sources in {len(groups)} groups, {before} passed before, "
        f"{failed} failed"
    )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
