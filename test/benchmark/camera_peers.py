"""Compares the path tracer with Mitsuba 3: the same landscape, light, pinhole and depth.

Images are compared first, then the paths that each traces in a second of one core.
test/apps/camera_peers_test.py does only the first part. Run by `./dev bench camera`.
"""

import ctypes.util
import json
import os
import resource
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from statistics import NormalDist
from types import ModuleType

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "build/release/bin/expose_scene"
DEPTH = 3  # in rays, as Mitsuba counts: the longest paths have one bounce


@dataclass
class Picture:
    """Linear RGB, height x width x 3."""

    mean: np.ndarray
    standard_error: np.ndarray
    paths: int
    cpu_s: float


def ours(folder: Path, width: int, samples: int, terrain: int) -> tuple[dict, Picture]:
    """Returns the scene and our picture of it; writes the terrain to `folder`."""
    command = [PROGRAM, folder, width, samples, DEPTH, terrain]
    run = subprocess.run(list(map(str, command)), stdout=subprocess.PIPE, check=True)
    scene = json.loads(run.stdout)
    columns, rows = scene["size_px"]
    mean, error = (
        np.load(folder / f"{name}.npy").reshape(rows, columns, 3).astype(float)
        for name in ("radiance", "standard_error")
    )
    write_ply(folder, scene)
    return scene, Picture(mean, error, scene["paths"], scene["cpu_s"])


def write_ply(folder: Path, scene: dict) -> None:
    """Each cell is two triangles, split from its north-east to its south-west."""
    n = scene["terrain_samples"]
    heights = np.load(folder / "heights.npy")
    row, column = np.divmod(np.arange(n * n), n)
    (x0, y0), (dx, dy) = scene["origin_m"], scene["step_m"]
    vertices = np.stack([x0 + dx * column, y0 + dy * row, heights], axis=1).astype("<f4")
    nw = np.arange(n * n).reshape(n, n)[:-1, :-1].ravel()
    near = np.stack([nw, nw + n, nw + 1], axis=1)
    far = np.stack([nw + 1, nw + n, nw + n + 1], axis=1)
    faces = np.empty(2 * len(nw), dtype=[("count", "u1"), ("vertices", "<i4", 3)])
    faces["count"], faces["vertices"] = 3, np.concatenate([near, far])
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    data = header.encode("ascii") + vertices.tobytes() + faces.tobytes()
    (folder / "terrain.ply").write_bytes(data)


def mitsuba(variant: str) -> ModuleType:
    """Imports Mitsuba; the variants of llvm need the shared library of LLVM 17 or later."""
    if variant.startswith("llvm") and "DRJIT_LIBLLVM_PATH" not in os.environ:
        found = (ctypes.util.find_library(f"LLVM-{number}") for number in range(22, 16, -1))
        if name := next(filter(None, found), None):
            os.environ["DRJIT_LIBLLVM_PATH"] = name
    import mitsuba as mi

    mi.set_variant(variant)
    return mi


def theirs(mi: ModuleType, folder: Path, scene: dict) -> object:
    """Returns Mitsuba's scene: the sun is a disc far enough away that its light is parallel."""
    T = mi.ScalarTransform4f
    columns, rows = scene["size_px"]
    distance_m, angle_rad = 1e6, scene["sun_radius_rad"]
    sun = np.array(scene["sun"]) * distance_m
    radiance = np.array(scene["sun_irradiance"]) / (np.pi * np.sin(angle_rad) ** 2)
    return mi.load_dict(
        {
            "type": "scene",
            "terrain": {
                "type": "ply",
                "filename": str(folder / "terrain.ply"),
                "face_normals": True,
                "bsdf": {
                    "type": "diffuse",
                    "reflectance": {"type": "rgb", "value": [scene["albedo"]] * 3},
                },
            },
            "sky": {"type": "constant", "radiance": {"type": "rgb", "value": scene["sky"]}},
            "sun": {
                "type": "disk",
                "to_world": T().look_at(origin=sun.tolist(), target=[0, 0, 0], up=[0, 0, 1])
                @ T().scale([distance_m * float(np.tan(angle_rad))] * 2 + [1.0]),
                "emitter": {
                    "type": "area",
                    "radiance": {"type": "rgb", "value": radiance.tolist()},
                },
            },
            "sensor": {
                "type": "perspective",
                "fov_axis": "x",
                "fov": float(np.degrees(2 * np.arctan(columns / 2 / scene["focal_px"]))),
                "near_clip": 1e-3,
                "far_clip": 1e5,
                "to_world": T().look_at(origin=scene["from"], target=scene["to"], up=[0, 0, 1]),
                "film": {
                    "type": "hdrfilm",
                    "width": columns,
                    "height": rows,
                    "rfilter": {"type": "box"},
                    "pixel_format": "rgb",
                    "component_format": "float32",
                },
                "sampler": {"type": "independent"},
            },
        }
    )


def render(mi: ModuleType, scene: object, samples: int, seed: int) -> np.ndarray:
    integrator = mi.load_dict({"type": "path", "max_depth": DEPTH, "rr_depth": 1000})
    return np.array(mi.render(scene, integrator=integrator, spp=samples, seed=seed)).astype(float)


def cpu_s() -> float:
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def picture(mi: ModuleType, scene: object, samples: int, batches: int) -> Picture:
    """Returns the mean of independent pictures, and its standard error from their spread."""
    render(mi, scene, 1, 1000)  # excludes the compilation in the first call
    begin_s = cpu_s()
    parts = np.array([render(mi, scene, samples, seed) for seed in range(batches)])
    took_s = cpu_s() - begin_s
    error = parts.std(axis=0, ddof=1) / np.sqrt(batches)
    paths = parts[0, ..., 0].size * samples * batches
    return Picture(parts.mean(axis=0), error, paths, took_s)


@dataclass
class Agreement:
    """Agreement of two pictures of one scene."""

    pixels: float  # share of them whose difference is not significant
    blocks: float  # likewise, of means over 8 x 8 pixels
    bias: float  # of the mean over all, relative
    bias_sigma: float  # its standard deviation

    def holds(self) -> bool:
        """Mitsuba's own tests require 99.75 % of pixels. Pixels are too noisy to show a missing
        bounce of light, so blocks and the mean are tested too."""
        share = min(self.pixels, self.blocks)
        return share >= 0.9975 and abs(self.bias) <= 4 * self.bias_sigma


def blocks(picture: Picture, side: int) -> tuple[np.ndarray, np.ndarray]:
    rows, columns = (size // side for size in picture.mean.shape[:2])

    def parted(values: np.ndarray) -> np.ndarray:
        inside = values[: rows * side, : columns * side]
        return inside.reshape(rows, side, columns, side, 3).mean(axis=(1, 3))

    return parted(picture.mean), np.sqrt(parted(picture.standard_error**2)) / side


def share_explained(a: Picture, b: Picture, side: int) -> float:
    """Tests every block of pixels and channel for a difference, at a significance of 0.01 for all
    together (Sidak).

    Errors are floored at 1e-3 of the mean: where none of a few paths was lit, none is known.
    """
    (mean_a, error_a), (mean_b, error_b) = blocks(a, side), blocks(b, side)
    level = 1 - (1 - 0.01) ** (1 / mean_a.size)
    error = np.sqrt(error_a**2 + error_b**2 + (1e-3 * b.mean.mean()) ** 2)
    z = np.abs(mean_a - mean_b) / error
    most = NormalDist().inv_cdf(1 - level / 2)
    return float((z <= most).all(axis=-1).mean())


def compare(a: Picture, b: Picture) -> Agreement:
    mean = b.mean.mean()
    sigma = np.sqrt((a.standard_error**2 + b.standard_error**2).sum()) / a.mean.size
    bias = float((a.mean.mean() - mean) / mean)
    return Agreement(share_explained(a, b, 1), share_explained(a, b, 8), bias, float(sigma / mean))


def check(mi: ModuleType, folder: Path) -> Agreement:
    """Compares a small picture of many paths."""
    scene, here = ours(folder, 96, 256, 129)
    return compare(here, picture(mi, theirs(mi, folder, scene), 64, 16))


def bench(variant: str) -> None:
    """Checks and measures a variant in its own process: Mitsuba aborts it if LLVM is too old."""
    mi = mitsuba(variant)
    with tempfile.TemporaryDirectory() as name:
        agreement = check(mi, Path(name))
        if not agreement.holds():
            sys.exit(f"the pictures differ: {agreement}")
        scene, here = ours(Path(name), 1280, 4, 1025)
        there = picture(mi, theirs(mi, Path(name), scene), 1, 4)
    rates = (1e-6 * picture.paths / picture.cpu_s for picture in (here, there))
    print(json.dumps(dict(zip(("groundray", "mitsuba"), rates, strict=True))))


def main() -> None:
    if len(sys.argv) == 2:
        return bench(sys.argv[1])
    for variant in ("llvm_ad_rgb", "scalar_rgb"):
        run = subprocess.run([sys.executable, __file__, variant], stdout=subprocess.PIPE, text=True)
        if run.returncode != 0:
            print(f"Mitsuba {variant} does not run; llvm_ad_rgb needs libllvm19", file=sys.stderr)
            continue
        rate = json.loads(run.stdout)
        print(
            f"paths per second of a core: groundray {rate['groundray']:.2f} M, Mitsuba "
            f"{version('mitsuba')} {variant} {rate['mitsuba']:.2f} M, "
            f"{rate['groundray'] / rate['mitsuba']:.2f} times as many"
        )
    return None


if __name__ == "__main__":
    main()
