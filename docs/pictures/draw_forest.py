"""Draws docs/pictures/forest_track.png: the left camera of data/scenes/forest_track.yaml.

    pip install pillow pyyaml
    python3 docs/pictures/draw_forest.py build/release/bin out/forest_picture

The picture is the camera's own, with 32 paths a pixel: three minutes of two cores.
"""

import pathlib
import subprocess
import sys

import yaml
from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENE = ROOT / "data/scenes/forest_track.yaml"
SAMPLES = 32


def main(programs, folder):
    scene = yaml.safe_load(SCENE.read_text())
    scene["terrain"]["dem"] = str(ROOT / "data/terrain/prairie_1m.tif")
    del scene["stereo"]
    scene["cameras"] = scene["cameras"][:1]
    camera = scene["cameras"][0]
    camera["file"] = str(SCENE.parent / camera["file"])
    camera["sampling"] |= {"samples": SAMPLES, "most_samples": SAMPLES}
    camera["products"] = ["picture"]
    del camera["project"]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.yaml").write_text(yaml.safe_dump(scene))
    command = [programs / "groundray", "generate", folder / "scene.yaml", "-o", folder / "data"]
    subprocess.run([*command, "--sensor", camera["name"]], check=True)
    picture = Image.open(folder / "data/camera" / camera["name"] / "000000.png").convert("RGB")
    palette = picture.quantize(256, method=Image.Quantize.MEDIANCUT)
    drawn = picture.quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG)
    drawn.save(ROOT / "docs/pictures/forest_track.png", optimize=True)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
