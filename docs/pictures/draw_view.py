"""Draws view_levels.png and view_deviation.png of docs/pictures with groundray-view.

    pip install pillow
    python3 docs/pictures/draw_view.py build/release/bin out/view

The first is the ground of the demo, coloured by the levels of its clipmap. The second is a mesh
from four scans of rough ground, with 2 cm of noise, coloured by its distance from that ground.
"""

import pathlib
import subprocess
import sys

from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parents[2]
DEMO = ROOT / "data/scenes/offroad_trail.yaml"
SCENE = f"""groundray: 1
seed: 3
duration_s: 1
terrain:
  dem: {ROOT}/data/terrain/prairie_1m.tif
  relief:
    cell_m: 0.25
    period_m: 64
    fractal: {{rms_m: 0.08, hurst: 0.7, shortest_m: 1, longest_m: 16}}
platform:
  drive:
    waypoints_m: [[429400, 5150650], [429420, 5150664], [429444, 5150672]]
    speed_m_s: 8
    height_m: 0.5
    footprint_m: [2.6, 1.8]
lidars:
  - name: top
    preset: ouster_os1_128
    range_noise_sigma_m: 0.02
    mount: {{translation_m: [0, 0, 1.8]}}
"""


def draw(programs: pathlib.Path, name: str, *arguments: object) -> None:
    file = ROOT / "docs/pictures" / name
    program = programs / "groundray-view"
    subprocess.run(
        [program, *map(str, arguments), "--screenshot", file, "--size", "1280x640"], check=True
    )
    # A third of the bytes; this method keeps the rare colours at the ends of scales.
    picture = Image.open(file).quantize(256, method=Image.Quantize.MAXCOVERAGE, kmeans=2)
    picture.save(file, optimize=True)


def draw_levels(programs: pathlib.Path) -> None:
    hidden = ["--hide", "objects", "--hide", "path"]
    eye = ["--look-from", "429385,5150430,600", "--look-at", "429400,5150622,386"]
    levels = ["--colour-by", "terrain=clipmap level", "--follow", "429402,5150652,389"]
    draw(programs, "view_levels.png", DEMO, *levels, *hidden, *eye)


def draw_deviation(programs: pathlib.Path, out: pathlib.Path) -> None:
    out.mkdir(parents=True, exist_ok=True)
    scene, mesh = out / "scene.yaml", out / "ground.ply"
    scene.write_text(SCENE)
    program = programs / "groundray"
    subprocess.run([program, "generate", scene, "-o", out / "scans"], check=True)
    options = ["--frames", "0:10:3", "--max-error-m", "0.03", "-o", mesh]
    subprocess.run([program, "reconstruct", "mesh", out / "scans", *options], check=True)
    eye = ["--look-from", "429378,5150618,404", "--look-at", "429411,5150654,386"]
    colours = ["--compare-with", scene, "--range=-0.03,0.03"]
    draw(programs, "view_deviation.png", mesh, *colours, *eye)


if __name__ == "__main__":
    draw_levels(pathlib.Path(sys.argv[1]))
    draw_deviation(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
