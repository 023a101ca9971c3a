"""A small run for tests of groundray-cluster, its single run, and programs that misbehave."""

import functools
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import dataset_runs
import pytest
from dataset_runs import PROGRAM, ROOT, files

PACKAGE = Path(os.environ.get("GROUNDRAY_PACKAGE", ROOT / "build/release/python"))
if not (PACKAGE / "groundray").is_dir():
    pytest.skip(f"{PACKAGE} has no package groundray: build it first", allow_module_level=True)
pytest.importorskip("obstore", reason="groundray-cluster needs obstore")

from groundray.cluster import command  # noqa: E402

SHARDS = 6


@functools.cache
def single_run():
    """Returns the scene and the files of its dataset, as a single run makes them."""
    folder = Path(tempfile.mkdtemp(prefix="groundray-cluster-test-"))
    dataset_runs.make_whole(folder)
    return folder / "scene.yaml", files(folder / "out")


def arguments(scene, store, *more, shards=SHARDS):
    given = ["run", scene, "--shards", shards, "--store", store]
    if "--groundray" not in more:
        given += ["--groundray", PROGRAM]
    return [str(each) for each in (*given, *more)]


def cluster(*given):
    """Runs the command in this process; returns its exit code."""
    return command.main([str(each) for each in given])


def started(*given):
    """Starts the command as a process."""
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "groundray.cluster", *map(str, given)],
        env={**os.environ, "PYTHONPATH": str(PACKAGE)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def program(folder, before="", version=""):
    """Makes a program that notes its runs in `calls`, acts, and continues as groundray."""
    file = folder / "groundray"
    told = f"[ $1 = --version ] && {{ echo groundray {version}; exit; }}" if version else ""
    file.write_text(
        f'#!/bin/sh\n{told}\nif [ $1 = generate ]; then\n  echo "$@" >> {folder}/calls\n'
        f'  {before}\nfi\nexec {PROGRAM} "$@"\n'
    )
    file.chmod(0o755)
    return file


def hanging(folder):
    """Makes a program that makes its frames, but hangs instead of ending, the first time."""
    before = f"""if mkdir {folder}/first 2>/dev/null; then
    {PROGRAM} "$@"
    echo $$ > {folder}/pid
    exec sleep 99
  fi"""
    return program(folder, before)


def pid_in(folder):
    """Waits for the process of that program that hangs."""
    return wait_for(lambda: (folder / "pid").exists() and int((folder / "pid").read_text() or 0))


def calls(folder):
    file = folder / "calls"
    return file.read_text().splitlines() if file.exists() else []


def wait_for(holds, seconds=60):
    """Waits until a function returns something true, which it returns."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if found := holds():
            return found
        time.sleep(0.02)
    raise AssertionError("waited in vain")


def is_alive(pid):
    stat = Path(f"/proc/{pid}/stat")
    try:
        return stat.read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False
