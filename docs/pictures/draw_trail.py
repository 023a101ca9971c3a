"""Draws docs/pictures/offroad_trail.png: the first second of data/scenes/offroad_trail.yaml.

    pip install matplotlib numpy pillow plyfile
    groundray generate data/scenes/offroad_trail.yaml -o out/offroad_trail
    groundray terrain mesh data/terrain/prairie_1m.tif -o mesh.ply \
        --max-error-m 0.15
    python3 docs/pictures/draw_trail.py out/offroad_trail mesh.ply docs/pictures/offroad_trail.png
"""

import pathlib
import sys

import matplotlib
import numpy as np
import plyfile
from PIL import Image

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

EYE, TARGET = np.array([-55, -43, 390.2]), np.array([-37.5, -22, 386.8])  # metres, in D
NEAR_M = 2
SUN = np.array([-0.6, -0.3, 0.75]) / np.linalg.norm([-0.6, -0.3, 0.75])
NIGHT = "#10141c"
# By label: name, colour, size of a point at a distance of 1 m.
KINDS = {
    1: ("ground", "#b0946e", 13),
    2: ("grass", "#e3e84f", 34),
    3: ("shrubs", "#2fd3a0", 34),
    4: ("rocks", "#ececf4", 34),
    5: ("trees", "#4cc35c", 30),
    10: ("vehicle", "#ff7a45", 44),
    11: ("person", "#ff5fd9", 34),
    12: ("fence posts", "#5ab0ff", 44),
}
SHOWN_AT_S, LONGEST_S = 0.45, 0.15  # moving objects: time shown, tolerance


def project(points: np.ndarray) -> np.ndarray:
    """Returns the image coordinates, as tangents to the right and up, and the depth."""
    ahead = (TARGET - EYE) / np.linalg.norm(TARGET - EYE)
    right = np.cross(ahead, [0, 0, 1])
    right /= np.linalg.norm(right)
    seen = (points - EYE) @ np.stack([right, np.cross(right, ahead), ahead]).T
    seen[..., :2] /= np.maximum(seen[..., 2:], NEAR_M)
    return seen


def draw_ground(axes: plt.Axes, file: str) -> None:
    mesh = plyfile.PlyData.read(file)
    vertices = np.column_stack([mesh["vertex"][axis] for axis in "xyz"])
    corners = vertices[np.stack(mesh["face"]["vertex_indices"])]
    seen = project(corners)
    shown = (seen[..., 2] > NEAR_M).all(axis=1)
    corners, seen = corners[shown], seen[shown]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    light = 0.06 + 0.16 * np.clip(normals @ SUN, 0, 1)
    far_first = np.argsort(-seen[..., 2].mean(axis=1))
    colours = (light[:, None] * [1, 0.95, 0.88])[far_first]
    polygons = PolyCollection(seen[far_first, :, :2], facecolors=colours, edgecolors=colours)
    polygons.set_linewidth(0.4)
    axes.add_collection(polygons)


def read_points(folder: pathlib.Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the points, their labels, and the sunlight on them."""
    points, labels, light = [], [], []
    for file in sorted(folder.glob("lidar/*/*.ply")):
        scan = plyfile.PlyData.read(file)["vertex"].data

        def columns(*names: str, scan: np.ndarray = scan) -> np.ndarray:
            return np.column_stack([scan[name] for name in names]).astype(float)

        time_s = 0.1 * int(file.stem) + scan["time"].astype(float)  # both scan at 10 Hz
        ahead_s = SHOWN_AT_S - time_s
        velocity = columns("vx", "vy", "vz")
        kept = (velocity == 0).all(axis=1) | (np.abs(ahead_s) < LONGEST_S)
        p_dq = columns("world_x", "world_y", "world_z") + velocity * ahead_s[:, None]
        points.append(p_dq[kept])
        labels.append(scan["label"][kept])
        light.append(0.6 + 0.4 * np.clip(columns("nx", "ny", "nz") @ SUN, 0, 1)[kept])
    return np.concatenate(points), np.concatenate(labels), np.concatenate(light)


def draw_points(axes: plt.Axes, folder: pathlib.Path) -> None:
    points, labels, light = read_points(folder)
    seen = project(points)
    far_first = np.argsort(-seen[:, 2])
    far_first = far_first[seen[far_first, 2] > NEAR_M]
    seen, labels, light = seen[far_first], labels[far_first], light[far_first]
    tints, sizes = np.ones((len(labels), 3)), np.zeros(len(labels))
    for label, (name, colour, size) in KINDS.items():
        tints[labels == label] = to_rgb(colour)
        sizes[labels == label] = size
        axes.scatter([], [], s=30, color=colour, label=name)
    sizes = np.clip((sizes / seen[:, 2]) ** 2, 0.7, 16)
    axes.scatter(seen[:, 0], seen[:, 1], s=sizes, c=tints * light[:, None], linewidths=0)


def main() -> None:
    figure = plt.figure(figsize=(11, 6.2), dpi=100, facecolor=NIGHT)
    axes = figure.add_axes([0, 0, 1, 1], xlim=(-0.6, 0.6), ylim=(-0.286, 0.39))
    axes.axis("off")
    draw_ground(axes, sys.argv[2])
    draw_points(axes, pathlib.Path(sys.argv[1]))
    axes.legend(loc="lower center", fontsize=10, ncols=len(KINDS), facecolor=NIGHT, labelcolor="w")
    figure.canvas.draw()
    picture = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())).convert("RGB")
    picture.quantize(256, Image.Quantize.FASTOCTREE).save(sys.argv[3], optimize=True)


if __name__ == "__main__":
    main()
