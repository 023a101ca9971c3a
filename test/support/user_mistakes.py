"""Mistakes that users make, as rows of tables, and the folder in which they are made."""

import os
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from dataset_runs import ROOT

BIN = Path(os.environ.get("GROUNDRAY", ROOT / "build/release/bin/groundray")).parent

LIDAR = """\
groundray_lidar: 1
model: Two beams
rotation: {rate_hz: 10, sense: clockwise, start_azimuth_deg: 0}
firing_period_us: 1000
range_gate_m: {near: 0.5, far: 60}
beam_columns: [ring, elevation_deg, firing_time_us]
beams:
  - [0, -20, 0]
  - [1, -10, 500]
"""
CAMERA = """\
groundray_camera: 1
model: A small camera
size_px: [24, 18]
lens: {pinhole: {focal_px: [20, 20], centre_px: [11.5, 8.5]}}
shutter: {exposure_ms: 1}
products: [radiance, truth]
"""
SCENE = """\
groundray: 1
seed: 7
duration_s: 0.3
terrain:
  dem: hills.tif
  material: dry_soil
sky: {analytic: {}, sun: {azimuth_deg: 130, elevation_deg: 40}}
platform:
  drive:
    waypoints_m: [[429420, 5150660], [429430, 5150670], [429440, 5150672]]
    speed_m_s: 8
    height_m: 0.5
objects:
  - {name: rock, label: 4, asset: rock, size_m: 1, at_m: [429436, 5150680]}
lidars:
  - {name: top, file: head.yaml, mount: {translation_m: [0, 0, 1.5]}}
cameras:
  - name: eye
    file: eye.yaml
    mount: {translation_m: [1, 0, 1.2], pitch_deg: 5}
    trigger: {lidar: top}
    sampling: {samples: 2, most_samples: 2}
"""
WALK = """\
0 429420 5150660 420 0 0 0 1
0.2 429421 5150660 420 0 0 0 1
0.4 429422 5150660 420 0 0 0 1
"""
RAMP = """\
v 0 0 0
v 1 0 0
v 1 1 0.5
v 0 1 0.5
f 1 2 3
f 1 3 4
"""


def run(program: str, *arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [BIN / program, *arguments],
        cwd=cwd,
        env={**os.environ, "COLUMNS": "1000"},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def make_workshop(folder: Path) -> Path:
    """Makes the sound files: a scene, what it names, its dataset, and the dataset's two shards."""
    window = ["-srcwin", "150", "180", "64", "64"]
    prairie = ROOT / "data/terrain/prairie_1m.tif"
    subprocess.run(
        ["gdal_translate", "-q", *window, prairie, folder / "hills.tif"], check=True, timeout=60
    )
    for name, text in {
        "scene.yaml": SCENE,
        "head.yaml": LIDAR,
        "eye.yaml": CAMERA,
        "walk.tum": WALK,
        "ramp.obj": RAMP,
        "notes.txt": "Remember the milk.\n",
        "empty.dat": "",
    }.items():
        (folder / name).write_text(text)
    (folder / "mine").mkdir()
    (folder / "mine/notes.txt").write_text("keep")
    for out, more in {
        "run": [],
        "half_1": ["--shard", "1/2"],
        "half_2": ["--shard", "2/2"],
    }.items():
        made = run("groundray", "generate", "scene.yaml", "-o", out, *more, cwd=folder)
        assert made.returncode == 0, made.stderr
    return folder


@dataclass(frozen=True)
class Mistake:
    """A mistake: what the user runs, and what the message must contain."""

    name: str
    command: str  # program and arguments; the scene's are GENERATE
    says: tuple[str, ...]
    edits: tuple[tuple[str, str, str], ...] = ()  # file, text that is there, text in its place
    files: dict[str, str | bytes] = field(default_factory=dict)  # files to write
    prepare: Callable[[Path], None] | None = None  # other changes of the folder
    code: int = 1


GENERATE = "groundray generate scene.yaml -o out"


def in_scene(name: str, before: str, after: str, *says: str, **more) -> Mistake:
    """Returns a mistake in the scene file, which `generate` reports."""
    return Mistake(name, GENERATE, says, (("scene.yaml", before, after),), **more)


def in_file(name: str, file: str, content: str | bytes, command: str, *says: str) -> Mistake:
    """Returns a mistake in a file that is written first."""
    return Mistake(name, command, says, files={file: content})


def truncate(file: str, size: int) -> Callable[[Path], None]:
    """Returns a change that cuts a file short."""

    def change(folder: Path) -> None:
        (folder / file).write_bytes((folder / file).read_bytes()[:size])

    return change


def state_of(folder: Path) -> dict[str, tuple[int, bytes]]:
    return {
        path.relative_to(folder).as_posix(): (
            path.lstat().st_mtime_ns,
            path.read_bytes() if path.is_file() else b"",
        )
        for path in folder.rglob("*")
    }


INTERNALS = (
    "Traceback",
    "std::",
    "terminate called",
    "Invoked with",
    "nanobind",
    "yaml-cpp",
    ".cpp",
    "basic_",
    "bad_alloc",
    "json.exception",
    "what()",
    " 0x",
)


def check_words(said: str, says: tuple[str, ...]) -> None:
    """Checks that a message contains all words, is short, and shows no internals."""
    for word in says:
        assert word in said, f"{word!r} is missing in:\n{said}"
    for word in INTERNALS:
        assert word not in said, f"{word!r} is in:\n{said}"
    lines = said.splitlines()
    assert 1 <= len(lines) <= 12, said
    assert len(set(lines)) == len(lines), said
    assert max(map(len, lines)) <= 700, said


def check(mistake: Mistake, workshop: Path, folder: Path) -> None:
    """Makes a mistake in a copy of the workshop: it must be reported, and nothing be written."""
    folder = shutil.copytree(workshop, folder / "home", symlinks=True)
    for file, before, after in mistake.edits:
        text = (folder / file).read_text()
        assert text.count(before) == 1, (file, before)
        (folder / file).write_text(text.replace(before, after))
    for file, content in mistake.files.items():
        data = content.encode() if isinstance(content, str) else content
        (folder / file).write_bytes(data)
    if mistake.prepare is not None:
        mistake.prepare(folder)
    before = state_of(folder)
    program, *arguments = mistake.command.split()
    result = run(program, *arguments, cwd=folder)
    said = result.stderr
    assert result.returncode == mistake.code, (result.returncode, result.stdout, said)
    if mistake.code == 1:
        parts = said.split(f"{program}: ")
        assert len(parts) == 2 or said.startswith(f"{program}: "), said
        said = parts[-1] if len(parts) == 2 else said
    check_words(said, mistake.says)
    assert state_of(folder) == before
