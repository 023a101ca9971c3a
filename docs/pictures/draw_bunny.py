"""Draws docs/pictures/bunny.png: the Stanford bunny merged from its ten range scans.

    pip install numpy open3d pillow
    groundray reconstruct mesh bun.conf --preset object --range-sd-m 0.0001 --apart-m 0.001 \
        -o bunny.ply
    python3 docs/pictures/draw_bunny.py bunny.ply docs/pictures/bunny.png
"""

import sys

import numpy as np
import open3d as o3d
from PIL import Image

PIXELS = 960  # side of a view as traced
SHRUNK = 2  # then reduced by this factor, for smooth outlines
SHADES = 64  # of each colour
VIEWS_DEG = ((0, 10), (120, 10), (240, 25))  # azimuth and elevation
FRONT = np.array([205, 205, 215.0])
BACK = np.array([230, 90, 60.0])  # the inside, seen through holes


def view(scene: o3d.t.geometry.RaycastingScene, middle, size_m: float, azimuth, elevation):
    azimuth, elevation = np.radians([azimuth, elevation])
    towards = np.array(
        [
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
            np.cos(elevation) * np.cos(azimuth),
        ]
    )
    right = np.cross([0, 1, 0], towards)
    right /= np.linalg.norm(right)
    up = np.cross(towards, right)
    steps = np.linspace(-0.42, 0.42, PIXELS)
    x, y = np.meshgrid(steps, -steps)
    origins = middle + size_m * (2 * towards + x[..., None] * right + y[..., None] * up)
    rays = np.concatenate([origins, np.broadcast_to(-towards, origins.shape)], axis=-1)
    hits = scene.cast_rays(o3d.core.Tensor(rays.astype(np.float32)))
    is_hit = np.isfinite(hits["t_hit"].numpy())
    cosine = (hits["primitive_normals"].numpy() @ towards)[..., None]
    shade = np.where(cosine > 0, FRONT, BACK) * (0.15 + 0.85 * np.abs(cosine))
    return np.where(is_hit[..., None], shade, 255).astype(np.uint8)


def palette() -> Image.Image:
    """Returns colours of both sides from black to white: outlines blend with the background."""
    to_full = np.linspace(0, 1, SHADES)[:, None]
    ramps = [
        np.concatenate([to_full * side, side + to_full * (255 - side)]) for side in (FRONT, BACK)
    ]
    colours = Image.new("P", (1, 1))
    colours.putpalette(np.concatenate(ramps).astype(np.uint8).ravel().tolist())
    return colours


def main() -> None:
    mesh = o3d.io.read_triangle_mesh(sys.argv[1])
    box = mesh.get_axis_aligned_bounding_box()
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))
    size_m = float(np.linalg.norm(box.get_extent()))
    views = [view(scene, box.get_center(), size_m, *angles) for angles in VIEWS_DEG]
    picture = Image.fromarray(np.hstack(views)).reduce(SHRUNK)
    picture.quantize(palette=palette(), dither=Image.Dither.NONE).save(sys.argv[2], optimize=True)


if __name__ == "__main__":
    main()
