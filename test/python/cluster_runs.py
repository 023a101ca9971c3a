"""A small run for tests of groundray-cluster, its single run, and programs that misbehave."""

import functools
import os
import signal
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
CAMERA = """\
groundray_camera: 1
model: A small camera
size_px: [32, 24]
rate_hz: 10
lens: {pinhole: {focal_px: [30, 30], centre_px: [15.5, 11.5]}}
shutter: {exposure_ms: 1}
products: [radiance, truth]
sampling: {samples: 1, most_samples: 1}
"""
SCENE = """\
groundray: 1
seed: 5
terrain: {dem: %s, material: dry_soil}
sky: {analytic: {}, sun: {azimuth_deg: 130, elevation_deg: 40}}
platform:
  drive: {waypoints_m: [[429340, 5150600], [429560, 5150770]], speed_m_s: 2, height_m: 0.5}
cameras:
  - {name: eye, file: camera.yaml, mount: {translation_m: [1, 0, 1.2]}}
"""
# Changes the last byte of a file in a shard and its checksum, as a faulty processor would.
FAULTY = """python3 - "$@" <<'END'
import hashlib, pathlib, re, subprocess, sys
subprocess.run(["{real}", *sys.argv[1:]], check=True)
out = pathlib.Path(sys.argv[sys.argv.index("-o") + 1])
file = next(out.glob("{file}"))
before = file.read_bytes()
after = before[:-1] + bytes([before[-1] ^ 1])
file.write_bytes(after)
record = out / "dataset.yaml"
text = record.read_text().rsplit("sha256_above", 1)[0]
sums = [hashlib.sha256(each).hexdigest() for each in (before, after)]
text = text.replace(*sums)
record.write_text(text + 'sha256_above: "' + hashlib.sha256(text.encode()).hexdigest() + '"\\n')
END
exit"""


@functools.cache
def single_run():
    """Returns the scene and the files of its dataset, as a single run makes them."""
    folder = Path(tempfile.mkdtemp(prefix="groundray-cluster-test-"))
    dataset_runs.make_whole(folder)
    return folder / "scene.yaml", files(folder / "out")


def camera_scene(folder, frames):
    """Writes the scene of a run of so many small images."""
    terrain = ROOT / "data/terrain/prairie_1m.tif"
    scene = folder / "scene.yaml"
    scene.write_text(SCENE % terrain + f"duration_s: {frames / 10}\n")
    (folder / "camera.yaml").write_text(CAMERA)
    return scene


def camera_run(folder, frames):
    """Returns such a scene and the files of its dataset, as a single run makes them."""
    scene = camera_scene(folder, frames)
    alone = dataset_runs.groundray("generate", scene, "-o", folder / "out")
    assert alone.returncode == 0, alone.stderr
    return scene, files(folder / "out")


def arguments(scene, store, *more, shards=SHARDS):
    given = ["run", scene, "--shards", shards, "--store", store]
    if "--groundray" not in more:
        given += ["--groundray", PROGRAM]
    return [str(each) for each in (*given, *more)]


def cluster(*given):
    """Runs the command in this process; returns its exit code."""
    return command.main([str(each) for each in given])


def started(*given):
    """Starts the command as a process that Ctrl-C reaches, even if this one ignores it."""
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "groundray.cluster", *map(str, given)],
        env={**os.environ, "PYTHONPATH": str(PACKAGE)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=functools.partial(signal.signal, signal.SIGINT, signal.SIG_DFL),
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


def faulty_program(folder, file):
    """Makes a program whose file (the first that a pattern finds) has other bytes."""
    return program(folder, FAULTY.format(real=PROGRAM, file=file))


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
