"""Draws docs/pictures/ground_textures.png, a square metre of each kind of generated ground.

    pip install numpy pillow
    g++ -std=c++20 -O2 -march=x86-64-v3 -ffp-contract=off -I. docs/export_ground_images.cpp \
        terrain/textures/*.cpp terrain/lod/pass.cpp core/math.cpp core/error.cpp \
        -lfmt -lsleef -ltbb -o export_ground_images
    mkdir ground && ./export_ground_images ground
    python3 docs/pictures/draw_ground_textures.py ground docs/pictures/ground_textures.png
"""

import pathlib
import sys

import numpy as np
from PIL import Image, ImageDraw

SIDE, TILE, COLUMNS = 1024, 256, 5
SUN = np.array([-0.6, 0.35, 0.72]) / np.linalg.norm([-0.6, 0.35, 0.72])
NAMES = [
    "bare_soil",
    "mud",
    "gravel",
    "sand",
    "forest_litter",
    "moss",
    "short_grass",
    "dead_grass",
    "rock",
    "heath",
]


def draw(file: pathlib.Path) -> Image.Image:
    albedo, normal = np.fromfile(file, np.uint8).reshape(2, SIDE, SIDE, 3) / 255
    light = 0.45 + 1.0 * np.clip((2 * normal - 1) @ SUN, 0, 1)
    linear = albedo**2.2 * light[..., None]
    linear *= (0.12 / linear.mean()) ** 0.5  # dark kinds become lighter, light ones darker
    size = (TILE, SIDE // TILE, TILE, SIDE // TILE, 3)
    pixels = np.clip(linear.reshape(size).mean((1, 3)), 0, 1) ** (1 / 2.2)
    picture = Image.fromarray((255 * pixels).astype(np.uint8))
    pen = ImageDraw.Draw(picture)
    pen.rectangle((0, 0, 8 + pen.textlength(file.stem), 16), fill=(20, 20, 20))
    pen.text((4, 2), file.stem, fill="white")
    return picture


def main() -> None:
    folder = pathlib.Path(sys.argv[1])
    sheet = Image.new("RGB", (COLUMNS * TILE, len(NAMES) // COLUMNS * TILE))
    for i, name in enumerate(NAMES):
        sheet.paste(draw(folder / f"{name}.rgb"), (i % COLUMNS * TILE, i // COLUMNS * TILE))
    sheet.quantize(80).save(sys.argv[2], optimize=True)


if __name__ == "__main__":
    main()
