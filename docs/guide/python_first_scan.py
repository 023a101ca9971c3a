"""A scene from Python: a lidar and a camera observe the same ground, and are compared.

    python3 docs/guide/python_first_scan.py

Needs only the package: the ground is a NumPy array that is made here.
"""

import tempfile
from pathlib import Path

import groundray
import numpy as np

CAMERA = """\
groundray_camera: 1
model: A pinhole
size_px: [160, 120]
lens:
  pinhole: {focal_px: [130, 130], centre_px: [79.5, 59.5]}
sampling: {samples: 4}
products: [radiance, truth]
"""


def make_scene(folder: Path) -> groundray.Scene:
    """Returns 60 m of hills with a rock, and a vehicle that drives over them."""
    row, column = np.mgrid[:241, :241]
    terrain = groundray.Terrain(np.sin(column / 19) + 0.7 * np.cos(row / 13), cell_m=0.25)
    (folder / "pinhole.yaml").write_text(CAMERA)
    return groundray.scene(
        {
            "groundray": 1,
            "seed": 1,
            "duration_s": 0.5,
            "terrain": {"material": "dry_soil", "label": 40},
            "sky": {"analytic": {}, "sun": {"azimuth_deg": 130, "elevation_deg": 40}},
            "platform": {
                "drive": {"waypoints_m": [[20, 30], [40, 30]], "speed_m_s": 4, "height_m": 0.5}
            },
            "objects": [
                {"name": "rock", "label": 70, "asset": "rock", "size_m": 2, "at_m": [32, 31]}
            ],
            "lidars": [
                {
                    "name": "roof",
                    "preset": "velodyne_vlp16",
                    "mount": {"translation_m": [0, 0, 1.5]},
                    "range_noise_sigma_m": 0.02,
                }
            ],
            "cameras": [
                {
                    "name": "front",
                    "file": "pinhole.yaml",
                    "mount": {"translation_m": [0.5, 0, 1.2], "pitch_deg": 10},
                }
            ],
        },
        folder=folder,
        terrain=terrain,
    )


def tell_noise(scan: groundray.Scan) -> None:
    """Compares the reported ranges with the truth in the same scan."""
    reported_m = np.sqrt(scan["x_m"] ** 2 + scan["y_m"] ** 2 + scan["z_m"] ** 2)
    rms_m = np.std(reported_m - scan["range_true_m"])
    print(f"{len(scan)} echoes, ranges off by {1000 * rms_m:.1f} mm RMS, as set in the scene")
    on_rock = scan["label"] == 70
    print(f"{on_rock.sum()} on the rock, {scan['range_true_m'][on_rock].min():.3f} m away")


def tell_rays(scene: groundray.Scene, image: groundray.Image) -> None:
    """Casts a ray for each pixel and compares it with the image's truth."""
    camera = scene.camera("front")
    middle_s = image.t_s + 0.0025  # of an exposure of 5 ms
    X_DC = camera.pose(middle_s)
    directions = camera.directions.reshape(-1, 3) @ X_DC[:3, :3].T
    rays = scene.cast_rays(np.tile(X_DC[:3, 3], (len(directions), 1)), directions, middle_s)
    seen = np.isfinite(rays["range_true_m"])
    off_m = np.abs(rays["range_true_m"][seen] - image["range_m"].ravel()[seen]).max()
    print(f"{seen.sum()} of {len(rays)} pixels show a surface; rays agree to {off_m:.1e} m")


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        scene = make_scene(Path(folder))
        print(scene)
        tell_noise(scene.lidar("roof").scan(t_s=0.0))
        image = scene.camera("front").expose(frame=0)
        sky = np.isinf(image["depth_m"])
        print(f"radiance of the sky {image['radiance_w_m2_sr'][sky].mean(axis=0)} W/(m2 sr)")
        tell_rays(scene, image)


if __name__ == "__main__":
    main()
