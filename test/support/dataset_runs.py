"""A small run of two lidars and a camera, for tests of complete datasets."""

import hashlib
import os
import re
import shutil
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("GROUNDRAY", ROOT / "build/release/bin/groundray"))

CAMERA = """\
groundray_camera: 1
model: A small camera
size_px: [48, 36]
lens: {pinhole: {focal_px: [40, 40], centre_px: [23.5, 17.5]}}
shutter: {exposure_ms: 1}
products: [radiance, truth, flow_flo]
"""
SCENE = f"""\
groundray: 1
seed: 7
duration_s: 0.3
terrain: {{dem: {ROOT / "data/terrain/prairie_1m.tif"}, material: dry_soil}}
sky: {{analytic: {{}}, sun: {{azimuth_deg: 130, elevation_deg: 40}}}}
platform:
  drive: {{waypoints_m: [[429440, 5150660], [429448, 5150668]], speed_m_s: 8, height_m: 0.5}}
objects:
  - {{name: rock, label: 4, asset: rock, size_m: 2, at_m: [429446, 5150670], stance: on_slope}}
lidars:
  - {{name: top, preset: velodyne_vlp16, mount: {{translation_m: [0, 0, 1.5]}}}}
  - {{name: front, preset: velodyne_vlp16, mount: {{translation_m: [1, 0, 1]}}, no_returns: report}}
cameras:
  - name: eye
    file: camera.yaml
    mount: {{translation_m: [1, 0, 1.2], pitch_deg: 5}}
    trigger: {{lidar: top, delay_ms: 20}}
    project: [top]
    sampling: {{samples: 2, most_samples: 2}}
"""


def command(folder, *more, scene=SCENE, out="out"):
    """Returns the command line of `generate`; writes the scene's files."""
    (folder / "scene.yaml").write_text(scene)
    (folder / "camera.yaml").write_text(CAMERA)
    return [
        str(part)
        for part in (PROGRAM, "generate", folder / "scene.yaml", "-o", folder / out, *more)
    ]


def groundray(*arguments, **options):
    return subprocess.run(
        [str(PROGRAM), *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        **options,
    )


def generate(folder, *more, scene=SCENE, out="out", **options):
    return groundray(*command(folder, *more, scene=scene, out=out)[1:], **options)


def files(folder):
    return {
        p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()
    }


def rewrite(dataset, *changes):
    """Replaces each text in dataset.yaml once and updates its checksum, as a deliberate change."""
    text = (dataset / "dataset.yaml").read_text().rsplit("sha256_above", 1)[0]
    for before, after in changes:
        assert before in text
        text = text.replace(before, after, 1)
    digits = hashlib.sha256(text.encode()).hexdigest()
    (dataset / "dataset.yaml").write_text(f'{text}sha256_above: "{digits}"\n')


def make_whole(folder):
    result = generate(folder)
    assert result.returncode == 0, result.stderr
    return folder / "out"


def as_cut_off(whole, out, frames):
    """Makes the folder of a run that was killed after this number of frames."""
    shutil.copytree(whole, out)
    record = (out / "dataset.yaml").read_text()
    head, rest = record.split("frames:\n")
    entries = [line[4:] for line in rest.split("files:\n")[0].splitlines()]
    pending = [re.sub(r"state: done.*", "state: pending}", entry) for entry in entries]
    text = head + "frames:\n" + "".join(f"  - {entry}\n" for entry in pending)
    digits = hashlib.sha256(text.encode()).hexdigest()
    (out / "dataset.yaml").write_text(f'{text}sha256_above: "{digits}"\n')
    lines = [f"{hashlib.sha256(e.encode()).hexdigest()[:16]} {e}\n" for e in entries[:frames]]
    (out / "dataset.journal").write_text("".join(lines))
    for entry in entries[frames:]:
        sensor, number = re.match(r'\{sensor: "(\w+)", frame: (\d+)', entry).groups()
        for file in out.glob(f"*/{sensor}/{int(number):06}*"):
            file.unlink()
    return lines
