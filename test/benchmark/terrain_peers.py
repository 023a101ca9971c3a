"""Compares terrain meshes with those of pydelatin and pymartini, on the same 4097 x 4097 samples.

All have a tolerance of 5 m. The true error of each mesh is measured exactly by one oracle:
every triangle against the surface of groundray's definition, at samples and wherever
edges cross. Then the peers' tolerances are searched for the coarsest mesh within 5 m.

pydelatin is the algorithm of hmm (greedy insertion into a Delaunay triangulation), which is in no
package registry; pymartini is Martini's (right-triangulated irregular network).
Run by `./dev bench terrain`.
"""

import json
import os
import resource
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = ROOT / "build/release/bin"
FOLDER = ROOT / "build/bench/terrain"
TOLERANCE_M = 5.0


def delatin(heights: np.ndarray, tolerance_m: float) -> tuple[np.ndarray, np.ndarray]:
    from pydelatin import Delatin

    mesh = Delatin(heights, max_error=tolerance_m)
    vertices = np.rint(mesh.vertices[:, :2]).astype(np.int32)
    vertices[:, 1] = len(heights) - 1 - vertices[:, 1]  # its y points up
    return vertices, mesh.triangles


def martini(heights: np.ndarray, tolerance_m: float) -> tuple[np.ndarray, np.ndarray]:
    from pymartini import Martini

    return Martini(len(heights)).create_tile(heights.ravel()).get_mesh(tolerance_m)


PEERS = {"pydelatin": delatin, "pymartini": martini}


def cpu_s() -> float:
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in both)


def mesh_here(peer: str, tolerance_m: float) -> None:
    """Makes a mesh in its own process, and prints time and memory."""
    columns, rows = map(int, (FOLDER / "size.txt").read_text().split())
    heights = np.fromfile(FOLDER / "heights.f32", np.float32).reshape(rows, columns)
    PEERS[peer](heights[:5, :5], tolerance_m)  # excludes the loading in the first call
    begin_s = cpu_s()
    vertices, triangles = PEERS[peer](heights, tolerance_m)
    took_s = cpu_s() - begin_s
    peak_mb = 1.024e-3 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    vertices.astype(np.int32).tofile(FOLDER / f"{peer}.vertices.i32")
    triangles.astype(np.uint32).tofile(FOLDER / f"{peer}.triangles.u32")
    print(json.dumps({"cpu_s": took_s, "peak_mb": peak_mb}))


def judged(name: str) -> dict:
    program = PROGRAMS / "groundray_mesh_error"
    run = subprocess.run([program, FOLDER, name], stdout=subprocess.PIPE, check=True)
    return json.loads(run.stdout)


def peer_mesh(peer: str, tolerance_m: float) -> dict:
    command = [sys.executable, __file__, peer, str(tolerance_m)]
    run = subprocess.run(command, stdout=subprocess.PIPE, check=True)
    return {"asked_m": tolerance_m} | json.loads(run.stdout) | judged(peer)


def our_mesh() -> dict:
    run = subprocess.run(
        [
            PROGRAMS / "groundray_bench",
            f"--benchmark_filter=terrain_mesh/tolerance_m:{TOLERANCE_M:.0f}/",
            "--benchmark_format=json",
        ],
        env={**os.environ, "GROUNDRAY_BENCH_EXPORT": str(FOLDER)},
        stdout=subprocess.PIPE,
        check=True,
    )
    result = json.loads(run.stdout)["benchmarks"][0]
    assert not result.get("error_occurred"), result["error_message"]
    took = {"cpu_s": 1e-3 * result["real_time"], "peak_mb": result["peak_MB"]}
    return {"asked_m": TOLERANCE_M} | took | judged(str(TOLERANCE_M))


def coarsest_that_keeps(peer: str, tolerance_m: float) -> dict | None:
    """Bisects the peer's tolerance for the coarsest mesh within `tolerance_m`.

    The true error is not monotonic in the tolerance, so there may be a coarser one.
    """
    best = None
    low, high = tolerance_m / 64, tolerance_m
    for _ in range(8):
        middle = (low * high) ** 0.5
        found = peer_mesh(peer, middle)
        if found["largest_m"] <= tolerance_m:
            best, low = found, middle
        else:
            high = middle
    return best


def show(name: str, row: dict) -> None:
    print(
        f"{name:<17}{row['asked_m']:8.2f} m{row['cpu_s']:8.2f} s{row['peak_mb']:7.0f} MB"
        f"{row['triangles']:12,}{row['largest_m']:10.3f} m{row['rms_m']:8.3f} m"
        f"{'' if row['conforming'] else '  does not conform'}",
        flush=True,
    )


def show_at_equal_error(row: dict) -> None:
    """Compares with groundray at the peer's true error, since groundray keeps its tolerance."""
    ours = judged(str(row["largest_m"]))
    print(
        f"{'':>37} {ours['triangles']:11,}{ours['largest_m']:10.3f} m{ours['rms_m']:8.3f} m"
        f"  groundray's at that error: {ours['triangles'] / row['triangles']:.2f} x",
        flush=True,
    )


def main() -> None:
    print(
        f"{'':17}{'bound':>10}{'CPU':>10}{'peak':>10}{'triangles':>12}{'true error':>12}{'RMS':>10}"
    )
    ours = our_mesh()
    show("groundray", ours)
    cpu_ratios = []
    for peer in PEERS:
        row = peer_mesh(peer, TOLERANCE_M)
        show(f"{peer} {version(peer)}", row)
        show_at_equal_error(row)
        cpu_ratios.append(f"{ours['cpu_s'] / row['cpu_s']:.2f} x {peer}'s")
    print(f"\nWith smaller tolerances, for a true error of {TOLERANCE_M} m:")
    for peer in PEERS:
        found = coarsest_that_keeps(peer, TOLERANCE_M)
        if found is None:
            print(f"{peer}: for no tolerance above a 64th of that")
            continue
        show(f"{peer} {version(peer)}", found)
        show_at_equal_error(found)
    print(f"\nCPU time of groundray, for {TOLERANCE_M} m: {', '.join(cpu_ratios)}")


if __name__ == "__main__":
    if len(sys.argv) == 3:
        mesh_here(sys.argv[1], float(sys.argv[2]))
    else:
        main()
