"""Datasets of worlds to index, and the command that indexes them."""

import atexit
import functools
import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest
from export_runs import CAMERA, PROGRAM, ROOT, names_in

pytest.importorskip("pyarrow", reason="groundray-index needs pyarrow")

from groundray.index import command

WORLDS = 6
# Each world shows rocks and grass; some have a vehicle. The picture has noise and light.
SCENE = f"""\
groundray: 1
seed: 11
classes: {{1: ground, 2: grass, 7: rock, 10: vehicle}}
duration_s: 0.2
terrain: {{dem: {ROOT / "data/terrain/prairie_1m.tif"}, material: dry_soil, label: 1}}
sky: {{analytic: {{}}, sun: {{azimuth_deg: 130, elevation_deg: 40}}}}
platform:
  drive: {{waypoints_m: [[429440, 5150660], [429448, 5150668]], speed_m_s: 8, height_m: 0.5}}
objects:
  - {{name: rock, label: 7, asset: rock, size_m: 2, at_m: [429446, 5150669], stance: on_slope}}
  - {{name: post, label: 4, asset: rock, size_m: 1, at_m: [429450, 5150667], stance: on_slope}}
  - {{name: car, label: 10, asset: vehicle, at_m: [429454, 5150672], stance: on_slope}}
scatter:
  - name: grass
    label: 2
    density_per_m2: 0.5
    models: [{{asset: grass_tuft, variant: 1}}]
lidars:
  - {{name: top, preset: velodyne_vlp16, mount: {{translation_m: [0, 0, 1.5]}}}}
cameras:
  - name: eye
    file: camera.yaml
    mount: {{translation_m: [1, 0, 1.2], pitch_deg: 5}}
    trigger: {{lidar: top, delay_ms: 20}}
worlds:
  count: {WORLDS}
  vary:
    sky.sun.elevation_deg: {{uniform: [20, 65]}}
    scatter.grass.density_per_m2: {{log_uniform: [0.05, 0.5]}}
    objects.car: {{present: 0.5}}
    objects.rock.variant: {{whole: [0, 9]}}
    ground:
      table: {{columns: [terrain.material], rows: [[dry_soil], [gravel]]}}
"""


def generate(folder: Path, *options: str, out: str) -> None:
    done = subprocess.run(
        [PROGRAM, "generate", "scene.yaml", "-o", out, *options],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        cwd=folder,
    )
    assert done.returncode == 0, done.stderr


@functools.cache
def worlds_folder() -> Path:
    """The datasets of all worlds, `000000` and so on, made once for all tests."""
    folder = Path(tempfile.mkdtemp(prefix="groundray_index_"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    (folder / "scene.yaml").write_text(SCENE)
    (folder / "camera.yaml").write_text(CAMERA)
    for world in range(WORLDS):
        generate(folder, "--world", str(world), out=f"out/{world:06}")
    return folder / "out"


def index(out: Path, *options: str | Path, source: Path | list[Path] | None = None) -> int:
    """Runs the command in this process."""
    sources = source if isinstance(source, list) else [source or worlds_folder()]
    words = [*sources, "-o", out, *options]
    return command.main([str(word) for word in words])


def fails(capsys, out: Path, *options, source=None, code: int = 1) -> str:
    """Returns the command's only line; nothing is written, not even a parent folder."""
    before = names_in(out)
    assert index(out / "a/b/index.parquet", *options, source=source) == code
    reported = capsys.readouterr()
    assert reported.out == ""
    assert names_in(out) == before
    (line,) = reported.err.splitlines()
    assert line.startswith("groundray-index: ")
    return line
