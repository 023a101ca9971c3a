"""Draws docs/pictures/walking.png: half a stride of a person and of a deer.

    python3 docs/pictures/draw_walk.py assets docs/pictures/walking.png

draw_assets.py states how the folder assets is made.
"""

import pathlib
import sys

from draw_assets import TILE, draw
from PIL import Image


def main() -> None:
    folder = pathlib.Path(sys.argv[1])
    sheet = Image.new("RGB", (4 * TILE, 2 * TILE), "white")
    for row, kind in enumerate(("person", "deer")):
        for column in range(4):
            tile = draw(folder / f"{kind}_walk_{column}")
            sheet.paste(tile, (column * TILE, row * TILE))
    sheet.quantize(160).save(sys.argv[2], optimize=True)


if __name__ == "__main__":
    main()
