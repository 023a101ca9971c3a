"""Compares groundray with other software on one scene: the example of docs/reference/golden.md.

    python docs/guide/compare_peers.py OUT [PROGRAMS]

A lidar and a camera are placed on the prairie DEM. Open3D's RaycastingScene scans the same surface
in single precision, as a mesh that groundray writes; Mitsuba 3, if it is installed, renders the
same view. `groundray-golden compare` evaluates both. The datasets and two reports are written to
OUT; PROGRAMS is the folder of groundray's programs, by default build/release/bin.
"""

import subprocess
import sys
from pathlib import Path

import numpy as np
import open3d as o3d
import OpenEXR
from plyfile import PlyData, PlyElement

ROOT = Path(__file__).resolve().parents[2]
DEM = ROOT / "data/terrain/prairie_1m.tif"
CENTRE_W_M = np.array([429452, 5150685])  # D's origin: the middle of the DEM, in whole metres
HEIGHT_M = 396.0  # some 2.4 m above the ground there
SIZE_PX = (160, 120)
FOCAL_PX = 120.0
PITCH_DEG = 15
RUNS = 32  # of Mitsuba with different seeds, to estimate its error
SCENE = f"""\
groundray: 1
seed: 1
duration_s: 0.1
terrain: {{dem: {DEM}, material: grey.yaml}}
platform: {{trajectory: standing.tum}}
sky: {{constant: {{radiance_w_m2_sr: 1}}}}
lidars:
  - {{name: top, preset: velodyne_hdl32e, mount: {{}}}}
cameras:
  - {{name: front, file: camera.yaml, mount: {{pitch_deg: {PITCH_DEG}}}}}
"""
CAMERA = f"""\
groundray_camera: 1
model: A pinhole
size_px: [{SIZE_PX[0]}, {SIZE_PX[1]}]
lens:
  pinhole:
    focal_px: [{FOCAL_PX}, {FOCAL_PX}]
    centre_px: [{(SIZE_PX[0] - 1) / 2}, {(SIZE_PX[1] - 1) / 2}]
sampling: {{samples: 64, depth: 3}}
products: [radiance, truth]
"""
GREY = """\
groundray_material: 1
name: grey
spectrum: {wavelengths_nm: [400, 2500], reflectances: [0.5, 0.5]}
"""


def run(*command: str | Path) -> None:
    subprocess.run(list(map(str, command)), check=True)


def ours(out: Path, programs: Path) -> None:
    """Makes the dataset, and the ground as a mesh in D."""
    x, y = CENTRE_W_M
    pose = f"{x} {y} {HEIGHT_M} 0 0 0 1"
    for name, text in (
        ("scene.yaml", SCENE),
        ("camera.yaml", CAMERA),
        ("grey.yaml", GREY),
        ("standing.tum", f"0 {pose}\n10 {pose}\n"),
    ):
        (out / name).write_text(text)
    run(programs / "groundray", "generate", out / "scene.yaml", "-o", out / "dataset")
    run(programs / "groundray", "terrain", "mesh", DEM, "--max-error-m", "0", "-o", out / "dem.ply")


def ground(out: Path) -> tuple[np.ndarray, np.ndarray]:
    """Returns vertices in D and triangles."""
    ply = PlyData.read(out / "dem.ply")
    vertices = np.stack([ply["vertex"][axis] for axis in "xyz"], axis=-1)
    return vertices, np.stack(ply["face"]["vertex_indices"])


def scan_with_open3d(out: Path) -> Path:
    """Casts the rays of our scan, derived from its points, in single precision."""
    vertices, triangles = ground(out)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(vertices.astype(np.float32), triangles.astype(np.uint32))
    scan = PlyData.read(out / "dataset/lidar/top/000000.ply")["vertex"]
    points = np.stack([scan[axis] for axis in "xyz"], axis=-1).astype(float)
    directions = points / np.linalg.norm(points, axis=-1, keepdims=True)
    origins = np.broadcast_to([0, 0, HEIGHT_M], points.shape)
    rays = np.concatenate([origins, directions], axis=-1).astype(np.float32)
    range_m = scene.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy()
    met = np.isfinite(range_m)
    x, y, z = (directions[met] * range_m[met, None]).T.astype(np.float32)
    vertex = np.rec.fromarrays([x, y, z, scan["ring"][met]], names="x,y,z,ring")
    PlyData([PlyElement.describe(np.asarray(vertex), "vertex")]).write(out / "open3d.ply")
    return out / "open3d.ply"


def render_with_mitsuba(out: Path) -> Path | None:
    """Renders our view with Mitsuba's path tracer; returns None if it is not installed."""
    try:
        import mitsuba as mi
    except ImportError:
        return None
    mi.set_variant("scalar_rgb")
    vertices, triangles = ground(out)
    mesh = mi.Mesh("ground", len(vertices), len(triangles))
    values = mi.traverse(mesh)
    values["vertex_positions"] = vertices.astype(np.float32).ravel()
    values["faces"] = triangles.astype(np.uint32).ravel()
    values.update()
    mesh.write_ply(str(out / "mitsuba.ply"))
    down = np.sin(np.radians(PITCH_DEG))
    ahead = [np.cos(np.radians(PITCH_DEG)), 0, -down]
    scene = mi.load_dict(
        {
            "type": "scene",
            "ground": {
                "type": "ply",
                "filename": str(out / "mitsuba.ply"),
                "face_normals": True,
                "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}},
            },
            "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}},
            "sensor": {
                "type": "perspective",
                "fov_axis": "x",
                "fov": float(np.degrees(2 * np.arctan(SIZE_PX[0] / 2 / FOCAL_PX))),
                "near_clip": 1e-3,
                "far_clip": 1e5,
                "to_world": mi.ScalarTransform4f().look_at(
                    origin=[0, 0, HEIGHT_M],
                    target=[ahead[0], 0, HEIGHT_M + ahead[2]],
                    up=[0, 0, 1],
                ),
                "film": {
                    "type": "hdrfilm",
                    "width": SIZE_PX[0],
                    "height": SIZE_PX[1],
                    "rfilter": {"type": "box"},
                    "pixel_format": "rgb",
                    "component_format": "float32",
                },
            },
        }
    )
    path = mi.load_dict({"type": "path", "max_depth": 3, "rr_depth": 1000})
    images = [np.array(mi.render(scene, integrator=path, spp=4, seed=seed)) for seed in range(RUNS)]
    mean = np.mean(images, axis=0).astype(np.float32)
    error = (np.std(images, axis=0, ddof=1) / np.sqrt(RUNS)).astype(np.float32)
    channels = {"RGB": mean, "Samples": np.full(mean.shape[:2], RUNS, np.float32)}
    channels |= {f"StdError.{name}": error[..., i].copy() for i, name in enumerate("RGB")}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, channels).write(str(out / "mitsuba.exr"))
    return out / "mitsuba.exr"


def main() -> None:
    out = Path(sys.argv[1]).resolve()
    programs = Path(sys.argv[2]) if len(sys.argv) > 2 else ROOT / "build/release/bin"
    out.mkdir(parents=True, exist_ok=True)
    ours(out, programs)
    compare = [programs / "groundray-golden", "compare"]
    scan = out / "dataset/lidar/top/000000.ply"
    run(*compare, scan, scan_with_open3d(out), "-o", out / "scan_report")
    if image := render_with_mitsuba(out):
        light = out / "dataset/camera/front/000000.exr"
        run(*compare, light, image, "--share-beyond", "0.001", "-o", out / "image_report")
    else:
        print("mitsuba is not installed, so no image was compared")


if __name__ == "__main__":
    main()
