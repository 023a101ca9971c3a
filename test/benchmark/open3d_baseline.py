"""Compares a complete scan of groundray with the rays alone in Open3D's RaycastingScene.

Both trace the rays of one VLS-128 over one surface of 4097 x 4097 samples: triangles, in Open3D.
Run by `./dev bench open3d`; needs about 8 GB.
"""

import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import open3d as o3d

PROGRAM = Path(__file__).resolve().parents[2] / "build/release/bin/groundray_bench"


def groundray_mrays_s(folder: Path) -> float:
    """Returns million rays per second of a scan, end to end; writes the case to `folder`."""
    run = subprocess.run(
        [PROGRAM, "--benchmark_filter=scan_vls128/typical", "--benchmark_format=json"],
        env={**os.environ, "GROUNDRAY_BENCH_EXPORT": str(folder)},
        capture_output=True,
        check=True,
    )
    return json.loads(run.stdout)["benchmarks"][0]["Mrays/s"]


def open3d_scene(folder: Path) -> o3d.t.geometry.RaycastingScene:
    columns, rows, x0, y0, dx, dy = np.loadtxt(folder / "frame.txt")
    columns, rows = int(columns), int(rows)
    vertices = np.empty((rows, columns, 3), np.float32)
    vertices[..., 0] = x0 + dx * np.arange(columns)
    vertices[..., 1] = (y0 + dy * np.arange(rows))[:, None]
    vertices[..., 2] = np.fromfile(folder / "heights.f32", np.float32).reshape(rows, columns)
    first = (np.arange(rows - 1, dtype=np.uint32)[:, None] * columns) + np.arange(
        columns - 1, dtype=np.uint32
    )
    near = np.stack([first, first + 1, first + columns], axis=-1)
    far = np.stack([first + columns + 1, first + columns, first + 1], axis=-1)
    triangles = np.concatenate([near.reshape(-1, 3), far.reshape(-1, 3)])
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(vertices.reshape(-1, 3), triangles)
    return scene


def ratios() -> tuple[float, float]:
    """Returns our rate by theirs, measured before and after theirs."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        before = groundray_mrays_s(folder)
        rays = np.fromfile(folder / "rays.f64").reshape(-1, 6).astype(np.float32)
        scene = open3d_scene(folder)
        hits = np.isfinite(scene.cast_rays(rays)["t_hit"].numpy()).mean()
        assert 0.05 < hits < 0.95, f"{hits:.1%} of the rays hit: not the case that groundray traces"
        best = np.inf
        for _ in range(10):
            begin = time.perf_counter()
            scene.cast_rays(rays)
            best = min(best, time.perf_counter() - begin)
        theirs = 1e-6 * len(rays) / best
        after = groundray_mrays_s(folder)
    print(f"groundray, full scan    {before:6.2f} and {after:6.2f} Mrays/s (before and after)")
    print(f"Open3D, rays alone      {theirs:6.2f} Mrays/s (best of 10)")
    return before / theirs, after / theirs


def main() -> None:
    both = ratios()
    print(f"ratio                   {min(both):6.2f} to {max(both):.2f}")


if __name__ == "__main__":
    main()
