"""Draws docs/pictures/ecosystem.png: a forest with undergrowth and litter below its canopy.

    pip install pillow
    python3 docs/pictures/draw_ecosystem.py build/release/bin out/ecosystem_picture

The picture takes a minute of two cores.
"""

import pathlib
import subprocess
import sys

from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENE = f"""
groundray: 1
seed: 11
duration_s: 0.1
terrain:
  dem: {ROOT}/data/terrain/prairie_1m.tif
  material: dry_grass
  texture: {{generate: short_grass, size_m: 3}}
  tolerance_mrad: 0.5
  relief: {{cell_m: 0.125, fractal: {{rms_m: 0.03, hurst: 0.7, shortest_m: 0.4, longest_m: 8}}}}
  cover:
    - {{material: litter, canopy: [0.4, 1], canopy_blend: 0.4,
       texture: {{generate: forest_litter}}}}
ecosystem:
  - {{name: spruce, label: 6, asset: spruce, leaves: geometry, density_per_m2: 0.06,
     sizes_m: [1, 22], weibull: {{shape: 1.5, scale_m: 10}}, tolerance: 0.4, min_distance_m: 1}}
  - {{name: birch, label: 6, asset: birch, leaves: geometry, density_per_m2: 0.05,
     sizes_m: [2, 18], weibull: {{shape: 2, scale_m: 10}}, zone: 0.8}}
  - {{name: oak, label: 6, asset: oak, leaves: geometry, density_per_m2: 0.02,
     sizes_m: [2, 18], zone: 0.8, tolerance: 0.2}}
  - {{name: fern, label: 3, asset: fern, density_per_m2: 1.2, sizes_m: [0.3, 1],
     weibull: {{shape: 3, scale_m: 0.5}}, zone: 0.7, canopy: [0.4, 1], canopy_blend: 0.4}}
scatter:
  - {{name: meadow, label: 2, density_per_m2: 0.8, scale: [0.5, 1], canopy: [0, 0.3],
     canopy_blend: 0.3, models: [{{asset: grass_patch, variant: 1}}, {{asset: grass_patch}}]}}
sky: {{analytic: {{}}, sun: {{azimuth_deg: 230, elevation_deg: 55}}}}
platform:
  drive:
    {{waypoints_m: [[429440, 5150720], [429460, 5150700]], speed_m_s: 1, height_m: 1.7}}
cameras: [{{name: eye, file: eye.yaml, mount: {{}}}}]
"""
CAMERA = """
groundray_camera: 1
model: an example
size_px: [WIDTH, HEIGHT]
lens: {pinhole: {focal_px: [FOCAL, FOCAL], centre_px: [CX, CY]}}
rate_hz: 10
sampling: {samples: SAMPLES, most_samples: SAMPLES, depth: 4}
products: [radiance]
"""


def main(programs, folder, width=480, samples=16):
    height = width * 2 // 3
    words = {"WIDTH": width, "HEIGHT": height, "FOCAL": width * 0.62, "SAMPLES": samples}
    words |= {"CX": width / 2 - 0.5, "CY": height / 2 - 0.5}
    camera = CAMERA
    for word, value in words.items():
        camera = camera.replace(word, str(value))
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.yaml").write_text(SCENE)
    (folder / "eye.yaml").write_text(camera)
    command = [programs / "groundray", "generate", folder / "scene.yaml", "-o", folder / "data"]
    subprocess.run(command, check=True)
    picture = Image.open(folder / "data/camera/eye/000000_preview.png").convert("RGB")
    palette = picture.quantize(256, method=Image.Quantize.MEDIANCUT)
    drawn = picture.quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG)
    drawn.save(ROOT / "docs/pictures/ecosystem.png", optimize=True)


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), *map(int, sys.argv[3:]))
