"""Draws docs/pictures/worlds.png: the first camera of data/scenes/forest_track.yaml and of the
scenes in data/scenes/worlds.

    pip install pillow pyyaml
    python3 docs/pictures/draw_worlds.py build/release/bin out/worlds [SCENE …]

The pictures are the cameras' own, with 16 paths a pixel: two to five minutes of two cores
each. With names of scenes, only these are made anew, if out/worlds has the others.
"""

import pathlib
import subprocess
import sys

import yaml
from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENES = (
    *("meadow", "forest_track", "gravel_pit", "desert_wash", "moor", "vineyard"),
    *("alpine_path", "river_bank", "burnt_forest", "tundra", "plantation", "stone_quarry"),
)
SAMPLING = {"samples": 16, "most_samples": 16}
COLUMNS, WIDTH, GAP = 3, 400, 6


def picture_of(name, programs, folder):
    (path,) = (ROOT / "data/scenes").rglob(f"{name}.yaml")
    scene = yaml.safe_load(path.read_text())
    scene["terrain"]["dem"] = str((path.parent / scene["terrain"]["dem"]).resolve())
    scene.pop("stereo", None)
    camera = scene["cameras"][0]
    scene["cameras"] = [camera]
    camera["file"] = str(path.parent / camera["file"])
    camera["sampling"] |= SAMPLING
    camera["products"] = ["picture"]
    camera.pop("project", None)
    (folder / f"{name}.yaml").write_text(yaml.safe_dump(scene))
    command = [programs / "groundray", "generate", folder / f"{name}.yaml", "-o", folder / name]
    subprocess.run([*command, "--sensor", camera["name"]], check=True)
    return folder / name / "camera" / camera["name"] / "000000.png"


def main(programs, folder, names):
    folder.mkdir(parents=True, exist_ok=True)
    for name in names or SCENES:
        Image.open(picture_of(name, programs, folder)).convert("RGB").save(folder / f"{name}.png")
    pictures = [Image.open(folder / f"{name}.png") for name in SCENES]
    height = WIDTH * pictures[0].height // pictures[0].width
    rows = -(-len(pictures) // COLUMNS)
    size = (COLUMNS * (WIDTH + GAP) - GAP, rows * (height + GAP) - GAP)
    sheet = Image.new("RGB", size, "white")
    for i, picture in enumerate(pictures):
        place = ((i % COLUMNS) * (WIDTH + GAP), (i // COLUMNS) * (height + GAP))
        sheet.paste(picture.resize((WIDTH, height), Image.Resampling.LANCZOS), place)
    palette = sheet.quantize(256, method=Image.Quantize.MEDIANCUT)
    drawn = sheet.quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG)
    drawn.save(ROOT / "docs/pictures/worlds.png", optimize=True)


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3:])
