"""Draws view*.png of docs/pictures with groundray-view.

    pip install pillow
    cmake --build --preset release --target draw_window
    python3 docs/pictures/draw_view.py build/release/bin out/view

view.png and view_compare.png are the window, which the program draw_window shows on an X server of
its own (xvfb-run); all others need no display. They show the demo. view_deviation.png shows a mesh
from four scans of rough ground, with 2 cm of noise: its distance from that ground.
"""

import os
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
    shrink(file)


def shrink(file: pathlib.Path) -> None:
    """Saves a third of the bytes; this method keeps the rare colours at the ends of scales."""
    picture = Image.open(file).convert("RGB")
    picture = picture.quantize(256, method=Image.Quantize.MAXCOVERAGE, kmeans=2)
    picture.save(file, optimize=True)


def draw_window(programs: pathlib.Path, demo: pathlib.Path) -> None:
    display = ["xvfb-run", "-a", "-s", "-screen 0 1600x1000x24"]
    program = [programs / "draw_window", DEMO, demo, ROOT / "docs/pictures"]
    environment = os.environ | {"GROUNDRAY_DATA": str(ROOT / "data")}
    subprocess.run([*display, *program], check=True, env=environment)
    for name in ("view.png", "view_compare.png"):
        shrink(ROOT / "docs/pictures" / name)


def draw_scan(programs: pathlib.Path, demo: pathlib.Path) -> None:
    hidden = ["--hide", "sensors", "--hide", "path"]
    draw(programs, "view_scan.png", DEMO, demo, *hidden, "--colour-by", "range")


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


def main() -> None:
    programs, out = map(pathlib.Path, sys.argv[1:])
    demo = out / "offroad_trail"
    if not (demo / "dataset.yaml").exists():
        subprocess.run([programs / "groundray", "generate", DEMO, "-o", demo], check=True)
    draw_window(programs, demo)
    draw_scan(programs, demo)
    draw_levels(programs)
    draw_deviation(programs, out)


if __name__ == "__main__":
    main()
