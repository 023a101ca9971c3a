"""Compares meshes from simulated scans with other software, in accuracy and CPU time.

A known scene (fractal ground, boulders, trunks) is scanned from 1, 3 and 10 poses with 2 cm of
noise and reconstructed from the same points by groundray, by CGAL's advancing front (perimeter at
most 3 m) and by Open3D's ball pivoting, which is given the true normals. Precision is the share of
the mesh's area within 10 cm of the truth, completeness the share of the truth visible from within
25 m that is within 10 cm of the mesh. Times are of the process, all threads.
Run by `./dev bench reconstruction`; arguments: number of seeds, numbers of poses.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import open3d as o3d

PROGRAM = Path(__file__).resolve().parents[2] / "build/release/bin/reconstruct_closed_loop"
RADII_M = (0.1, 0.2, 0.4, 0.8)
METHODS = {
    "groundray": "groundray",
    "advancing_front": "CGAL advancing front",
    "ball_pivoting": "Open3D ball pivoting",
}


def closed_loop(*arguments: object) -> dict:
    run = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)


def ball_pivoting(folder: Path) -> float:
    """Returns CPU seconds; writes the mesh to `folder`."""
    cloud = o3d.io.read_point_cloud(str(folder / "points.ply"))
    assert cloud.has_normals()
    begin = time.process_time()
    mesh = o3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(
        cloud, o3d.utility.DoubleVector(RADII_M)
    )
    cpu_s = time.process_time() - begin
    o3d.io.write_triangle_mesh(str(folder / "ball_pivoting.ply"), mesh)
    return cpu_s


def compare(seed: int, poses: int, rings: int = 64, columns: int = 1800) -> dict[str, dict]:
    """Returns triangles, cpu_s, precision, completeness and f1 of each method."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        found = closed_loop("rebuild", folder, seed, poses, rings, columns)
        cpu_s = ball_pivoting(folder)
        theirs = closed_loop("evaluate", folder, folder / "ball_pivoting.ply")
        return {
            "groundray": found["groundray"],
            "advancing_front": found["advancing_front"],
            "ball_pivoting": theirs | {"cpu_s": cpu_s},
        }


def row(method: str, runs: list[dict]) -> str:
    def values(key: str) -> np.ndarray:
        return np.array([run[method][key] for run in runs])

    f1 = values("f1")
    return (
        f"  {METHODS[method]:22} {values('triangles').mean():9.0f}"
        f" {values('precision').mean():10.4f} {values('completeness').mean():13.4f}"
        f" {f1.mean():8.4f} {f1.min():7.4f} {values('cpu_s').mean():9.3f}"
    )


def main() -> None:
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    numbers = [int(word) for word in sys.argv[2:]] or [1, 3, 10]
    for poses in numbers:
        runs = [compare(seed, poses) for seed in range(1, seeds + 1)]
        print(f"{seeds} scenes, {poses} scans of 64 x 1800")
        print(
            "  method                 triangles  precision  completeness  F1 mean     min     CPU s"
        )
        for method in METHODS:
            print(row(method, runs))
        for method in list(METHODS)[1:]:
            wins = sum(run["groundray"]["f1"] >= run[method]["f1"] for run in runs)
            share = max(run["groundray"]["cpu_s"] / run[method]["cpu_s"] for run in runs)
            print(
                f"  groundray's F1 is at least {METHODS[method]}'s in {wins} of {seeds} scenes,"
                f" at {share:.3f} of its CPU time at most"
            )


if __name__ == "__main__":
    main()
