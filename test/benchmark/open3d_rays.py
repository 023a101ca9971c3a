"""Compares `Terrain.cast_rays` of the Python package with Open3D's RaycastingScene.

Both cast a million rays at one surface of 400 x 400 samples, on all cores: those of a lidar by ring
and with all rings in turn, those of an image, and random ones. groundray takes and returns doubles
and has 11 columns; Open3D has floats. Run by `./dev bench open3d`.
"""

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import open3d as o3d

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "build/release/python"))
import groundray

SAMPLES = 400  # of 1 m
COUNT = 1_000_000
ROUNDS = 9


def hills() -> np.ndarray:
    row, column = np.mgrid[:SAMPLES, :SAMPLES]
    rough = np.random.default_rng(1).normal(0, 0.05, row.shape)
    waves = 6 * np.sin(column / 17) * np.cos(row / 23) + 2 * np.sin(row / 5 + column / 31)
    return (waves + rough).astype(np.float32)


def open3d_scene(heights_m: np.ndarray) -> o3d.t.geometry.RaycastingScene:
    row, column = np.mgrid[:SAMPLES, :SAMPLES].astype(np.float32)
    vertices = np.stack([column, SAMPLES - 1 - row, heights_m], -1).reshape(-1, 3)
    cell = np.arange(SAMPLES - 1, dtype=np.uint32)
    nw = (cell[:, None] * SAMPLES + cell).ravel()
    ne, sw, se = nw + 1, nw + SAMPLES, nw + SAMPLES + 1
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(vertices, np.concatenate([np.c_[nw, ne, sw], np.c_[se, sw, ne]]))
    return scene


def lidar_rays(start: np.ndarray, *, in_turn: bool) -> tuple[np.ndarray, np.ndarray]:
    """Rays of 125 rings: ring by ring, or all rings in turn."""
    turn = np.linspace(0, 2 * np.pi, COUNT // 125, endpoint=False)
    up = np.radians(np.linspace(-25, 15, 125))
    turn, up = (a.ravel() for a in np.meshgrid(turn, up, indexing="ij" if in_turn else "xy"))
    directions = np.stack([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)], -1)
    return np.tile(start, (COUNT, 1)), directions


def image_rays(start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    row, column = np.mgrid[:1000, :1000].reshape(2, -1)
    x, z = np.ones(COUNT), (499.5 - row) / 700
    pitch = 0.3
    x, z = x * np.cos(pitch) + z * np.sin(pitch), z * np.cos(pitch) - x * np.sin(pitch)
    return np.tile(start, (COUNT, 1)), np.stack([x, (499.5 - column) / 700, z], -1)


def random_rays() -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(2)
    origins = random.uniform([20, 20, 20], [380, 380, 60], (COUNT, 3))
    directions = random.normal(size=(COUNT, 3))
    directions[:, 2] = -np.abs(directions[:, 2]) - 0.3
    return origins, directions


def check(ours_m: np.ndarray, theirs_m: np.ndarray, name: str) -> None:
    """Ranges agree to a float's accuracy, but for rays that graze a silhouette."""
    hit = np.isfinite(ours_m) & np.isfinite(theirs_m)
    assert hit.mean() > 0.3, f"{name}: only {hit.mean():.1%} of the rays hit"
    differ = np.isfinite(ours_m) != np.isfinite(theirs_m)
    differ[hit] = np.abs(ours_m[hit] - theirs_m[hit]) > 0.01
    assert differ.mean() < 1e-4, f"{name}: {differ.mean():.1e} of the ranges differ"


def seconds(cast) -> float:
    """Returns the CPU time of all threads."""
    begin = time.process_time()
    cast()
    return time.process_time() - begin


def rates() -> Iterator[tuple[str, dict[str, float]]]:
    """Yields kinds of rays and the rates of each way to cast them, Mrays/CPU-s, medians."""
    heights_m = hills()
    terrain = groundray.Terrain(heights_m)
    scene = open3d_scene(heights_m)
    start = np.array([200.3, 199.2, terrain.heights_at([[200.3, 199.2]])[0] + 2])
    kinds = {
        "lidar, by ring": lidar_rays(start, in_turn=False),
        "lidar, rings in turn": lidar_rays(start, in_turn=True),
        "image": image_rays(np.array([30.0, 200, 40])),
        "random": random_rays(),
    }
    for name, (origins, directions) in kinds.items():
        unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        floats = np.concatenate([origins, unit], 1).astype(np.float32)
        casts = {
            "exact": lambda o=origins, d=directions: terrain.cast_rays(o, d),
            "fast": lambda o=origins, d=directions: terrain.cast_rays(o, d, tracing="fast"),
            "Open3D": lambda f=floats: scene.cast_rays(f),
        }
        theirs_m = casts["Open3D"]()["t_hit"].numpy()
        for tracing in ("exact", "fast"):
            check(casts[tracing]()["range_true_m"], theirs_m, f"{name}, {tracing}")
        spent = {which: [] for which in casts}
        for _ in range(ROUNDS):  # in turn, so that all meet the same load
            for which, cast in casts.items():
                spent[which].append(seconds(cast))
        yield name, {which: 1e-6 * COUNT / float(np.median(s)) for which, s in spent.items()}


def main() -> None:
    print(f"{'Mrays/CPU-s, medians':22} {'exact':>14} {'fast':>14} {'Open3D':>7}")
    for name, rate in rates():
        ours = (f"{rate[t]:6.2f} ({rate[t] / rate['Open3D']:4.2f} x)" for t in ("exact", "fast"))
        print(f"{name:22} {' '.join(ours)} {rate['Open3D']:7.2f}")


if __name__ == "__main__":
    main()
