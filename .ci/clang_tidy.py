"""Runs clang-tidy on every group of sources whose current state has not passed before.

    clang_tidy.py BUILD CLANG_TIDY SOURCE...

BUILD holds compile_commands.json. Up to 8 sources of a folder with the same flags are a group: a
file that includes them is read as one, which parses common headers once and takes FIGURE of the
time. If a group has a finding or does not compile, its sources are read one by one, and their
findings count. Missing includes may stay hidden in a group; the preset dev compiles each source by
itself.

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


def commands(build: Path, root: Path) -> dict[str, str]:
    """Returns the compile command of each source of the tree, without the path of its root."""
    entries = json.loads((build / "compile_commands.json").read_text())
    return {
        os.path.relpath(entry["file"], root): entry["command"].replace(str(root), ".")
        for entry in entries
    }


def flags_of(command: str, path: str) -> list[str]:
    """Returns the flags of a compile command: without compiler, source and object."""
    words = shlex.split(command)[1:]
    kept = []
    for word in words:
        if kept and kept[-1] == "-o":
            kept.pop()
        elif word != "-c" and not word.endswith(path):
            kept.append(word)
    return kept


def groups_of(sources: list[str], flags: dict[str, list[str]]) -> list[list[str]]:
    """Returns the sources in groups of one folder, with equal flags; those of no target singly."""
    alike: dict[tuple[str, ...], list[str]] = {}
    for path in sources:
        key = (os.path.dirname(path), *flags[path]) if path in flags else (path,)
        alike.setdefault(key, []).append(path)
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


class Tidy:
    """clang-tidy with the flags of a build tree."""

    def __init__(self, clang_tidy: str, build: str, flags: dict[str, list[str]]):
        self.clang_tidy = clang_tidy
        self.build = build
        self.flags = flags

    def group_passes(self, group: list[str]) -> bool:
        file = Path(self.build) / "groups" / (group[0].replace("/", "_"))
        file.parent.mkdir(exist_ok=True)
        file.write_text("".join(f'#include "{path}"\n' for path in group))
        checks = "--checks=-bugprone-suspicious-include"
        command = [self.clang_tidy, "--quiet", checks, str(file), "--", *self.flags[group[0]]]
        return findings(*command, "-I.") is None

    def passes(self, group: list[str]) -> bool:
        if len(group) > 1 and self.group_passes(group):
            return True
        found = [findings(self.clang_tidy, "-p", self.build, "--quiet", path) for path in group]
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
    command_of = commands(Path(build), root)
    folder = stamp_folder()
    folder.mkdir(parents=True, exist_ok=True)

    def stamp(tree: SourceTree, group: list[str]) -> Path:
        # For a source of no target, clang-tidy uses the command of a source with a similar name.
        used = [command_of.get(path) or json.dumps(command_of) for path in group]
        return folder / tree.stamp(group, "\0".join([common, *used]))

    flags = {path: flags_of(command, path) for path, command in command_of.items()}
    groups = groups_of([os.path.normpath(path) for path in sources], flags)
    wanted = {}
    for group in groups:
        passed = stamp(tree, group)
        if passed.exists():
            passed.touch()
        else:
            wanted[tuple(group)] = passed
    tidy = Tidy(clang_tidy, build, flags)

    def check(group: tuple[str, ...]) -> bool:
        good = tidy.passes([*group])
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
