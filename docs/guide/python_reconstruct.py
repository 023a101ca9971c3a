"""Reconstructs a mesh and a DEM from scans of known ground and compares both with the truth.

    python3 docs/guide/python_reconstruct.py [FOLDER]

The mesh and the DEM are written to FOLDER if it is given.
"""

import sys
from pathlib import Path

import groundray
import numpy as np


def make_ground() -> groundray.Terrain:
    """Returns 80 m of hills."""
    row, column = np.mgrid[:161, :161]
    return groundray.Terrain(1.5 * np.sin(column / 25) * np.cos(row / 31), cell_m=0.5)


def scan_ground(ground: groundray.Terrain) -> list[groundray.Scan]:
    """Returns five scans along a drive."""
    scene = groundray.scene(
        {
            "groundray": 1,
            "seed": 3,
            "duration_s": 0.55,
            "platform": {
                "drive": {"waypoints_m": [[30, 40], [50, 44]], "speed_m_s": 15, "height_m": 0.5}
            },
            "lidars": [
                {
                    "name": "roof",
                    "preset": "velodyne_vlp16",
                    "mount": {"translation_m": [0, 0, 1.8]},
                    "range_noise_sigma_m": 0.02,
                }
            ],
        },
        terrain=ground,
    )
    roof = scene.lidar("roof")
    return [roof.scan(t_s=time_s) for time_s in roof.times_s]


def tell_mesh(scans: list[groundray.Scan], ground: groundray.Terrain) -> groundray.Mesh:
    """Links and merges scans, simplifies the mesh and prints its distance from the ground."""
    mesh, _ = groundray.reconstruct_mesh(scans)
    small, figures = groundray.simplify(mesh, max_error_m=0.05)
    most_m = figures["from_original"]["at_most_m"]
    print(f"{mesh}, simplified to {len(small.triangles)}; largest error at most {most_m:.3f} m")
    # The scans' D has another origin than the ground's.
    truth = ground.mesh(0)
    shift_m = np.subtract(truth.origin_w_m, small.origin_w_m)
    truth = groundray.Mesh(truth.vertices_m + shift_m, truth.triangles)
    found = groundray.compare(truth, small, within_m=[0.1])["figures"]
    rms_m = found["other to reference: RMS distance"]
    share = found["precision within 0.1 m"]
    print(f"it lies {1000 * rms_m:.0f} mm RMS off the ground, {share:.1f} % of it within 0.1 m")
    return small


def tell_dem(scans: list[groundray.Scan], ground: groundray.Terrain) -> groundray.Terrain:
    """Fuses scans to a DEM, fills its holes and compares errors with standard deviations."""
    dem = groundray.fuse_dem(scans, cell_m=0.5)
    filled = groundray.fill_dem(dem.elevation_m, cell_m=0.5)
    rows, columns = dem.elevation_m.shape
    row, column = np.mgrid[:rows, :columns]
    places_m = np.array(dem.first_sample_m) + np.stack([column, row], -1) * dem.step_m
    # The origin of the scans' D is the ground's centre in whole metres, as for a file.
    truth_m = ground.heights_at(places_m.reshape(-1, 2) + 40).reshape(rows, columns)
    off_m = dem.elevation_m - truth_m
    known = np.isfinite(off_m)
    off_sds = off_m[known] / np.sqrt(dem.variance_m2[known])
    print(f"{known.sum()} samples, {1000 * np.sqrt(np.mean(off_m[known] ** 2)):.0f} mm RMS off, ")
    print(f"{100 * np.mean(np.abs(off_sds) < 2):.0f} % within two standard deviations")
    print(f"{filled['filled']} samples filled in {filled['holes']} blank areas")
    return groundray.Terrain(filled["heights_m"], 0.5)


def main() -> None:
    ground = make_ground()
    scans = scan_ground(ground)
    mesh = tell_mesh(scans, ground)
    dem = tell_dem(scans, ground)
    if len(sys.argv) > 1:
        mesh.save(Path(sys.argv[1]) / "ground.ply")
        dem.save(Path(sys.argv[1]) / "ground.tif")


if __name__ == "__main__":
    main()
