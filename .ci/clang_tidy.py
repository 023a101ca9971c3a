"""Runs clang-tidy on every source whose current state has not passed before.

    clang_tidy.py BUILD CLANG_TIDY SOURCE...

BUILD holds compile_commands.json. A source that passes leaves a stamp in
$XDG_CACHE_HOME/groundray/clang-tidy (~/.cache/groundray/clang-tidy). The name of a stamp is a hash
of all inputs of the result: the texts of the source and of the headers of this tree that it
includes, directly or not; its compile command; clang-tidy's version and settings; the versions of
installed headers. Paths are relative to the root of the tree, so all clones share their stamps.

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
import subprocess
import sys
import time
from pathlib import Path

INCLUDE = re.compile(r'^ *# *include *(["<])([^">]+)[">]', re.MULTILINE)
FOLDERS = ("", "data")  # search path of includes
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

    def dependencies(self, path: str) -> list[str]:
        """Returns a source and the headers of the tree that it includes, directly or not."""
        known = {path}
        open_ends = [path]
        while open_ends:
            for name in self.included(open_ends.pop()):
                if name not in known:
                    known.add(name)
                    open_ends.append(name)
        return sorted(known)

    def stamp(self, path: str, settings: str) -> str:
        """Returns the hash of a source with its headers and settings."""
        digest = hashlib.sha256(settings.encode())
        for name in self.dependencies(path):
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


def passes(clang_tidy: str, build: str, path: str) -> bool:
    done = subprocess.run(
        [clang_tidy, "-p", build, "--quiet", path], capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        noise = re.compile(r"^\d+ warnings?( and \d+ errors?)? generated")
        said = [line for line in done.stderr.splitlines() if not noise.match(line)]
        print(done.stdout, *said, sep="\n", flush=True)
    return done.returncode == 0


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

    def stamp(tree: SourceTree, path: str) -> Path:
        # For a source of no target, clang-tidy uses the command of a source with a similar name.
        command = command_of.get(path) or json.dumps(command_of)
        return folder / tree.stamp(path, f"{common}\0{command}")

    wanted = {}
    for path in map(os.path.normpath, sources):
        passed = stamp(tree, path)
        if passed.exists():
            passed.touch()
        else:
            wanted[path] = passed

    def check(path: str) -> bool:
        good = passes(clang_tidy, build, path)
        if good and stamp(SourceTree(root), path) == wanted[path]:  # unchanged during the run
            wanted[path].touch()
        return good

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        failed = list(pool.map(check, wanted)).count(False)
    delete_old(folder)
    before = len(sources) - len(wanted)
    print(f"clang-tidy: {len(sources)} sources, {before} passed before, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
