"""Draws docs/pictures/assets.png, a sheet of the assets, with a small rasteriser.

    pip install numpy pillow plyfile
    g++ -std=c++20 -O2 -ffp-contract=off -I. docs/export_assets.cpp \
        build/release/terrain/libgroundray_terrain.a build/release/core/libgroundray_core.a \
        -lfmt -lsleef -o export_assets
    mkdir assets && ./export_assets assets
    python3 docs/pictures/draw_assets.py assets docs/pictures/assets.png
"""

import pathlib
import sys

import numpy as np
import plyfile
from PIL import Image, ImageDraw

TILE, SUPER = 280, 3
SUN = np.array([0.55, -0.45, 0.7]) / np.linalg.norm([0.55, -0.45, 0.7])
NAMES = [
    "rock",
    "stone",
    "grass_tuft",
    "shrub",
    "conifer",
    "broadleaf_tree",
    "fence_post",
    "wire",
    "vehicle",
    "person_cylinder",
    "calibration_board",
    "sphere_target",
    "spruce",
    "pine",
    "birch",
    "oak",
    "bush",
    "snag",
    "fern",
    "reed",
    "grass_patch",
    "fallen_log",
    "stump",
    "pickup",
    "ugv",
    "tractor",
    "fence",
    "sign",
    "hay_bale",
    "boulder",
]


def view_axes(turn_deg: float, tilt_deg: float) -> np.ndarray:
    turn, tilt = np.radians([turn_deg, tilt_deg])
    towards = np.array([np.cos(tilt) * np.cos(turn), np.cos(tilt) * np.sin(turn), np.sin(tilt)])
    right = np.array([-np.sin(turn), np.cos(turn), 0])
    return np.stack([right, np.cross(towards, right), towards])


def draw(stem: pathlib.Path) -> Image.Image:
    ply = plyfile.PlyData.read(stem.with_suffix(".ply"))
    vertex, face = ply["vertex"], ply["face"]
    points = np.column_stack([vertex[a] for a in "xyz"]).astype(float)
    uv = np.column_stack([vertex["s"], vertex["t"]])
    triangles = np.stack(face["vertex_indices"])
    colours = np.column_stack([face[c] for c in ("red", "green", "blue")])
    image = None
    if stem.with_suffix(".rgba").exists():
        image = np.fromfile(stem.with_suffix(".rgba"), np.uint8).reshape(128, 128, 4) / 255

    axes = view_axes(-50, 12)
    seen = points @ axes.T
    size = TILE * SUPER
    middle = (seen.min(0) + seen.max(0)) / 2
    scale = 0.86 * size / np.ptp(seen[:, :2], axis=0).max()
    flat = (seen[:, :2] - middle[:2]) * scale * [1, -1] + size / 2
    pixels = np.ones((size, size, 3)) * [0.86, 0.88, 0.9]
    depth = np.full((size, size), -np.inf)
    for corners, colour, has_image in zip(triangles, colours, face["image"], strict=True):
        a, b, c = flat[corners]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        low = np.maximum(np.floor(np.minimum(np.minimum(a, b), c)).astype(int), 0)
        high = np.minimum(np.ceil(np.maximum(np.maximum(a, b), c)).astype(int) + 1, size)
        if abs(area) < 1e-9 or (high <= low).any():
            continue
        x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
        wb = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area
        wc = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area
        weights = np.stack([1 - wb - wc, wb, wc], -1)
        z = weights @ seen[corners, 2]
        window = np.s_[low[1] : high[1], low[0] : high[0]]
        hit = (weights >= -1e-9).all(-1) & (z > depth[window])
        tint = np.ones((*z.shape, 3))
        if has_image:
            place = weights @ uv[corners]
            column = np.clip((place[..., 0] * 128).astype(int), 0, 127)
            row = np.clip(((1 - place[..., 1]) * 128).astype(int), 0, 127)
            hit &= image[row, column, 3] >= 0.5
            tint = image[row, column, :3] ** 2.2
        p, q, r = points[corners]
        normal = np.cross(q - p, r - p)
        normal /= np.linalg.norm(normal)
        normal *= np.sign(normal @ axes[2]) or 1
        light = 2.1 * max(normal @ SUN, 0) + 0.75 + 0.35 * normal[2]
        pixels[window][hit] = np.clip(colour * tint * light, 0, 1)[hit] ** (1 / 2.2)
        depth[window][hit] = z[hit]
    picture = Image.fromarray((pixels * 255).astype(np.uint8)).resize((TILE, TILE), Image.BOX)
    extent = " x ".join(f"{e:.2f}" for e in np.ptp(points, axis=0))
    label = f"{stem.name}: {len(triangles)} triangles\n{extent} m"
    ImageDraw.Draw(picture).text((6, 4), label, fill=(30, 30, 30))
    return picture


def main() -> None:
    folder = pathlib.Path(sys.argv[1])
    columns = 4
    sheet = Image.new("RGB", (columns * TILE, -(-len(NAMES) // columns) * TILE), "white")
    for i, name in enumerate(NAMES):
        sheet.paste(draw(folder / name), (i % columns * TILE, i // columns * TILE))
    sheet.quantize(160).save(sys.argv[2], optimize=True)


if __name__ == "__main__":
    main()
