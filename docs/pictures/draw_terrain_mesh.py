"""Draws docs/pictures/terrain_mesh.png: a wireframe of a terrain mesh, coloured by level.

    pip install matplotlib numpy plyfile
    groundray terrain mesh data/terrain/jacksboro.tif -o mesh.ply --max-error-m 4 \
        --viewpoint -3000,-6000,700 --angle-mrad 5
    python3 docs/pictures/draw_terrain_mesh.py mesh.ply docs/pictures/terrain_mesh.png
"""

import sys

import matplotlib
import numpy as np
import plyfile

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.collections import PolyCollection
from matplotlib.patches import Patch


def main() -> None:
    mesh = plyfile.PlyData.read(sys.argv[1])
    vertices = np.column_stack([mesh["vertex"][axis] for axis in "xyz"])
    triangles = np.stack(mesh["face"]["vertex_indices"])
    levels = mesh["face"]["level"].astype(int)

    tilt = np.radians(50)
    height = 3 * (vertices[:, 2] - vertices[:, 2].mean())  # exaggerated three times
    flat = np.column_stack([vertices[:, 0], vertices[:, 1] * np.sin(tilt) + height * np.cos(tilt)])
    corners = np.column_stack([vertices[:, :2], height])[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    sun = np.array([-1, 1, 1.2]) / np.linalg.norm([-1, 1, 1.2])
    shade = 0.45 + 0.55 * np.clip(normals @ sun, 0, 1)

    colours = plt.get_cmap("turbo")(np.linspace(0.08, 0.92, levels.max() + 1))
    faces = colours[levels].copy()
    faces[:, :3] *= shade[:, None]
    far_first = np.argsort(-corners[:, :, 1].mean(axis=1))
    figure, axes = plt.subplots(figsize=(12, 8), dpi=80)
    axes.add_collection(
        PolyCollection(
            flat[triangles][far_first],
            facecolors=faces[far_first],
            edgecolors=(0, 0, 0, 0.55),
            linewidths=0.25,
        )
    )
    axes.autoscale()
    axes.set_aspect("equal")
    axes.axis("off")
    counts = np.bincount(levels)
    axes.legend(
        handles=[
            Patch(color=colours[level], label=f"level {level}: {count} triangles")
            for level, count in enumerate(counts)
        ],
        loc="lower left",
        fontsize=9,
    )
    figure.savefig(sys.argv[2], bbox_inches="tight", pad_inches=0.05)


if __name__ == "__main__":
    main()
